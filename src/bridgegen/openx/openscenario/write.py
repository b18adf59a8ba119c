"""From the model to an OpenSCENARIO file, in this version of the standard or another."""

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from lxml import etree

from bridgegen.base.errors import UnsupportedError
from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.element import (
    RAW,
    Attribute,
    Element,
    children_of,
    declaration,
    is_wrapper,
    rewritten,
    values_of,
    walk,
)
from bridgegen.openx.openscenario.mirror import mirrored
from bridgegen.openx.openscenario.storyboard import OpenScenario
from bridgegen.openx.openscenario.values import ParameterRef, format_value

if TYPE_CHECKING:
    from bridgegen.openx.openscenario.distributions import DistributionFile


def to_xml(scenario: "OpenScenario | DistributionFile") -> bytes:
    """Return the file: UTF-8, indented, the same bytes for the same model; mirrored back if it was.

    Numbers are written so that reading gives the same double back. A file of version 1.0 has what
    later versions wrap (a trajectory, in a ``TrajectoryRef``) bare.

    Raises:
        TypeError: a value of another type than its attribute's.
        ValueError: NaN, a text that XML or the standard cannot hold, or too few children.
    """
    root = etree.Element("OpenSCENARIO")
    if isinstance(scenario, OpenScenario) and scenario.left_hand:
        scenario = mirrored(scenario)
    fill(root, "OpenSCENARIO", scenario, bare=scenario.file_header.rev_minor == 0)
    # The same model gives the same bytes: nothing here depends on the date, on ids of the process
    # or on the order of a set.
    return etree.tostring(root, xml_declaration=True, encoding="UTF-8", pretty_print=True)


def _text(attribute: Attribute, value: Any) -> str:
    if attribute.means is RAW and isinstance(value, str):
        return value
    if attribute.enum is not None and not isinstance(value, ParameterRef):
        value = attribute.enum(value).value
    text = format_value(attribute.kind, value)
    if attribute.takes_expressions and isinstance(value, str) and text.startswith("${"):
        raise ValueError(f"the text '{text}' would be read as an expression")
    return text


def fill(node: etree._Element, tag: str, element: Element, *, bare: bool) -> None:
    """Give a node what an element has.

    Args:
        node: an empty one.
        tag: its own, for messages.
        element: what it shall be.
        bare: as of version 1.0, without what later versions wrap.

    Raises:
        TypeError: as of `to_xml`.
        ValueError: likewise.
    """
    declared = declaration(type(element))
    try:
        for attribute, value in values_of(element):
            node.set(attribute.name, _text(attribute, value))
        if declared.text is not None:
            node.text = getattr(element, declared.text)
    except (TypeError, ValueError) as error:
        raise type(error)(f"{tag}: {error}") from None
    for child in declared.children:
        if child.many and len(getattr(element, child.field)) < child.at_least:
            names = " or ".join(child.options)
            raise ValueError(f"{tag} must have at least {child.at_least} {names}")
    for name, below in children_of(element):
        wrapped = bare and is_wrapper(element, below)
        for each, item in children_of(below) if wrapped else ((name, below),):
            fill(etree.SubElement(node, each), each, item, bare=bare)


# --- Other versions of the standard: what was renamed, and what was required when ---
# Source: the XSDs of ASAM OpenSCENARIO XML 1.0 to 1.3. Of all that differs between 1.2 and 1.3,
# this # touches what our model can hold: an orientation without a type is absolute up to 1.2 and
# relative # from 1.3 on; 1.3 does without an act's start trigger, the storyboard's stop trigger,
# properties # and # a front axle, which 1.2 must have; an object controller's name and distances in
# the # coordinate # system of the world are new. Deprecated attributes are valid in both and stay:
# what # took their # place # is in another unit.


VERSIONS = {"1.2": 2, "1.3": 3}
"""The versions that can be written, and their minor revision."""

# Deprecated words are valid still, but tools differ in what they take: `overwrite` is 1.0's and
# 1.1's word for what is `override` from 1.2 on. So the names are those of the version that is
# written.
_RENAMED: dict[Any, Any] = {
    osc.Priority.OVERWRITE: osc.Priority.OVERRIDE,
    osc.RelativeDistanceType.CARTESIAN_DISTANCE: osc.RelativeDistanceType.EUCLIDIAN_DISTANCE,
    osc.ParameterType.INTEGER: osc.ParameterType.INT,
}


_LATER = (
    osc.AngleCondition,
    osc.ClothoidSpline,
    osc.MonitorDeclarations,
    osc.RandomRouteAction,
    osc.RelativeAngleCondition,
    osc.SetMonitorAction,
    osc.TrafficAreaAction,
    osc.TrafficDistribution,
    osc.Trailer,
    osc.TrailerAction,
    osc.TrailerCoupler,
    osc.TrailerHitch,
    # 1.2 has them, but its schema asks for a light and an animation at once, and for an odd tag
    osc.AppearanceAction,
    osc.TrafficSignalGroupState,
)
_LATER_ATTRIBUTES = ((osc.GeoPosition, "vertical_road_selection", "verticalRoadSelection"),)


def to_version(scenario: osc.OpenScenario, version: str, place: str) -> osc.OpenScenario:
    """Return a scenario of version 1.0 to 1.3 as one of another version that means the same.

    Args:
        scenario: as read.
        version: one of `VERSIONS`.
        place: what to call the scenario in messages.

    Raises:
        UnsupportedError: contents that the version does not support, by name and line, all at once.
    """
    was, minor = scenario.file_header.rev_minor, VERSIONS[version]
    if minor < 3:
        missing = [
            f"{place}: {what} cannot be said in version {version} (line {element.line})"
            for element in walk(scenario)
            for what in _only_later(element)
        ]
        if missing:
            raise UnsupportedError(*missing)
    made = rewritten(scenario, _modern(was if isinstance(was, int) else 0))
    if minor < 3:
        made = rewritten(made, _complete)
    return replace(made, file_header=replace(made.file_header, rev_major=1, rev_minor=minor))


def least_version(scenario: osc.OpenScenario) -> str:
    """Return the first of `VERSIONS` in which all of a scenario can be said."""
    return "1.3" if any(_only_later(element) for element in walk(scenario)) else "1.2"


def _only_later(element: Element) -> list[str]:
    """Return what of an element there is from 1.3 on only."""
    found = [
        f"{name} of {cls.__name__}"
        for cls, field, name in _LATER_ATTRIBUTES
        if isinstance(element, cls) and getattr(element, field) is not None
    ]
    if isinstance(element, _LATER):
        found.append(type(element).__name__)
    if isinstance(element, osc.AssignControllerAction) and isinstance(
        element.controller, osc.ObjectController
    ):
        found.append("AssignControllerAction with an ObjectController")
    if isinstance(element, osc.TrafficSourceAction | osc.TrafficSwarmAction) and (
        element.traffic_definition is None
    ):
        found.append(f"{type(element).__name__} without a TrafficDefinition")
    if isinstance(element, osc.Axles) and element.front is None:
        found.append("Axles without a FrontAxle")
    if getattr(element, "coordinate_system", None) is osc.CoordinateSystem.WORLD:
        found.append(f'coordinateSystem="world" of {type(element).__name__}')
    return found


def _modern(was: int) -> Callable[[Element], Element]:
    """Return what gives an element of version 1.``was`` the names and defaults of all others."""

    def change(element: Element) -> Element:
        if isinstance(element, osc.Orientation) and element.type is None:
            context = osc.ReferenceContext
            # The default changed from 1.2 to 1.3. Written out, it cannot be read in two ways.
            element = replace(element, type=context.RELATIVE if was >= 3 else context.ABSOLUTE)
        renamed: dict[str, Any] = {
            attribute.field: _RENAMED[value]
            for attribute, value in values_of(element)
            if attribute.enum is not None and value in _RENAMED
        }
        return replace(element, **renamed) if renamed else element

    return change


def _complete(element: Element) -> Element:
    """Return an element with what 1.2 must have and 1.3 need not, and without what it has not."""
    # 1.3 lets an act without a trigger begin with its story; 1.2 must have one, so it gets one that
    # fires at the start.
    if isinstance(element, osc.Act) and element.start_trigger is None:
        return replace(element, start_trigger=at_once())
    if isinstance(element, osc.Storyboard) and element.stop_trigger is None:
        return replace(element, stop_trigger=osc.Trigger())
    if isinstance(element, osc.ObjectController):
        return replace(element, name=None)
    if isinstance(element, osc.ActivateControllerAction):
        named = element.object_controller_ref
        if named is not None:  # an empty name is one, too
            return replace(element, object_controller_ref=None, controller_ref=named)
    owners = osc.Vehicle | osc.Pedestrian | osc.MiscObject | osc.Controller
    if isinstance(element, owners) and element.properties is None:
        return replace(element, properties=osc.Properties())
    return element


def at_once() -> osc.Trigger:
    """Return a trigger that fires at the start."""
    return at(0.0, "start")


def at(seconds: float, name: str) -> osc.Trigger:
    """Return a trigger that fires at a simulation time [s], its condition so named."""
    clock = osc.SimulationTimeCondition(seconds, osc.Rule.GREATER_OR_EQUAL)
    condition = osc.Condition(name, 0.0, osc.ConditionEdge.NONE, osc.ByValueCondition(clock))
    return osc.Trigger((osc.ConditionGroup((condition,)),))
