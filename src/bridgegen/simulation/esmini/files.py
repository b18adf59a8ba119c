"""What esmini reads: the scenario as it is exported, with the values of a row.

An entity with a driver of BridgeGen has esmini's ExternalController from the start: it keeps the
state that it is given. No other entity has a controller, since esmini does not know those that
BridgeGen's files name. Expressions are evaluated here: esmini keeps six digits of its results.
"""

import tempfile
import weakref
from collections.abc import Collection, Iterator, Mapping, Sequence
from copy import deepcopy
from dataclasses import replace
from pathlib import Path
from shutil import rmtree

import numpy as np
from lxml import etree

from bridgegen.base.arrays import Float, opposite
from bridgegen.base.disk import write_whole
from bridgegen.base.errors import FileFormatError
from bridgegen.openx.opendrive.model import OpenDrive
from bridgegen.openx.opendrive.write import to_xml as road_xml
from bridgegen.openx.openscenario.model import OpenScenario
from bridgegen.openx.openscenario.values import Expr, Kind, parse_value
from bridgegen.openx.openscenario.write import to_xml

Node = etree._Element

_EXTERNAL = "ExternalController"


class Folder:
    """A temporary folder that is removed with this object.

    Attributes:
        path: of it.
    """

    def __init__(self) -> None:
        self.path = Path(tempfile.mkdtemp(prefix="bridgegen-esmini-"))
        weakref.finalize(self, rmtree, self.path, ignore_errors=True)


class RoadFiles:
    """The road networks that scenarios take place on, each in a file.

    Args:
        models: P road networks.
        courses: see `Simulator.roads`.

    Attributes:
        paths: of the P files.
        courses: P of them, or none.
    """

    def __init__(
        self, models: Sequence[OpenDrive], courses: Sequence[Mapping[str, Float]] = ()
    ) -> None:
        self._folder = Folder()
        self.courses = tuple(courses)
        written: dict[int, Path] = {}
        paths = []
        for p, model in enumerate(models):
            if id(model) not in written:  # courses may differ on the same roads
                written[id(model)] = self._folder.path / f"{p:04d}.xodr"
                write_whole(written[id(model)], [road_xml(_bare(model))])
            paths.append(written[id(model)])
        self.paths = tuple(paths)


def _bare(model: OpenDrive) -> OpenDrive:
    """Return a map without scenery and geo-reference.

    They do not affect motion, and esmini reports most kinds of them as errors.
    """
    header = replace(model.header, geo_reference=None, offset=None)
    roads = tuple(replace(road, objects=()) for road in model.roads)
    return replace(model, header=header, roads=roads)


class ScenarioFile:
    """A storyboard as esmini is to run it.

    Args:
        storyboard: as it is exported.
        driven: the names of the entities that drivers of ours drive.
    """

    def __init__(self, storyboard: OpenScenario, driven: Collection[str]) -> None:
        self._left_hand = storyboard.left_hand
        root = etree.fromstring(to_xml(storyboard))
        # esmini writes "unsupported controller type" for those that it does not know, and one that
        # an ObjectController merely names is not on: its default controller would drive.
        for controller in [*root.iterfind("./Entities/ScenarioObject/ObjectController")]:
            _remove(controller)
        for name in driven:
            _drive_from_outside(root, name)
        self._data = etree.tostring(root, xml_declaration=True, encoding="UTF-8")

    def event_paths(self) -> list[str]:
        """Return what esmini calls each event, in the order of the file."""
        root = etree.fromstring(self._data)
        return [
            "::".join(str(element.get("name")) for element in reversed(_named(event)))
            for event in root.iter("Event")
        ]

    def on(self, roads: Path, course: Mapping[str, Float]) -> "Template":
        """Return the scenario on a road network.

        Args:
            roads: the file of it.
            course: positions over time on it, see `Simulator.roads`.
        """
        root = etree.fromstring(self._data)
        for network in root.iterfind("./RoadNetwork/LogicFile"):
            network.set("filepath", str(roads))
        for name, vertices in course.items():
            _follow(root, name, vertices, left_hand=self._left_hand)
        return Template(root)


class Template:
    """A scenario on a road network, to be filled with the values of rows.

    Args:
        root: the document.
    """

    def __init__(self, root: Node) -> None:
        self._root = root
        self._declared = {
            str(element.get("name")): element
            for element in root.iterfind("./ParameterDeclarations/ParameterDeclaration")
        }
        self._expressions = [
            (node, str(name), expression)
            for node in root.iter(etree.Element)
            for name, text in node.attrib.items()
            if (expression := _expression(str(text))) is not None
        ]

    def write(self, path: Path, values: Mapping[str, float]) -> None:
        """Write the scenario of a row.

        Args:
            path: a file that is replaced.
            values: of the file's numeric parameters, all of them.

        Raises:
            StorageError: it cannot be written.
        """
        for name, value in values.items():
            if name in self._declared:
                declared = self._declared[name]
                is_whole = declared.get("parameterType") != "double"
                # In full: esmini's functions for parameters keep six decimals.
                declared.set("value", str(int(value)) if is_whole else repr(float(value)))
        for node, attribute, expression in self._expressions:
            node.set(attribute, _worked_out(expression, values))
        write_whole(path, [etree.tostring(self._root, xml_declaration=True, encoding="UTF-8")])


def _expression(text: str) -> Expr | None:
    """Return an attribute's expression; None if it is a literal, or a text that looks like one."""
    if not text.startswith("${"):
        return None
    try:
        value = parse_value(Kind.DOUBLE, text)
        return value if isinstance(value, Expr) and value.names is not None else None
    except FileFormatError:
        return None


def _worked_out(expression: Expr, values: Mapping[str, float]) -> str:
    """Return the value of an expression; the expression itself if it cannot be evaluated here."""
    if not expression.names <= values.keys():
        return str(expression)
    with np.errstate(all="ignore"):
        found = np.asarray(expression.resolve(dict(values)))
    if found.dtype == np.bool_:
        return str(bool(found)).lower()
    return repr(float(found)) if np.isfinite(found) else str(expression)


def _remove(node: Node) -> None:
    parent = node.getparent()
    assert parent is not None
    parent.remove(node)


def _named(event: Node) -> list[Node]:
    """Return an event and what it is part of, up to its story."""
    return [
        event,
        *(
            iterancestor
            for iterancestor in event.iterancestors("Maneuver", "ManeuverGroup", "Act", "Story")
        ),
    ]


def _drive_from_outside(root: Node, name: str) -> None:
    """Give an entity the controller for external states, whatever controller the file assigns."""
    for private in root.iterfind("./Storyboard/Init/Actions/Private"):
        if private.get("entityRef") == name:
            for action in [*private.iterfind("./PrivateAction/ControllerAction")]:
                parent = action.getparent()
                assert parent is not None
                _remove(parent)
            place = 1 if len(private) else 0
            private.insert(place, _assigned())
    for group in _groups_of(root, name):
        for action in [*group.iter("ControllerAction")]:
            for below in [*action]:
                action.remove(below)
            etree.SubElement(
                action, "ActivateControllerAction", lateral="true", longitudinal="true"
            )


def _assigned() -> Node:
    private = etree.Element("PrivateAction")
    assign = etree.SubElement(
        etree.SubElement(private, "ControllerAction"),
        "AssignControllerAction",
        activateLateral="true",
        activateLongitudinal="true",
    )
    controller = etree.SubElement(assign, "Controller", name="driver")
    properties = etree.SubElement(controller, "Properties")
    etree.SubElement(properties, "Property", name="esminiController", value=_EXTERNAL)
    return private


def _groups_of(root: Node, name: str) -> Iterator[Node]:
    """Yield the maneuver groups in which an entity acts."""
    for group in root.iter("ManeuverGroup"):
        if any(
            element.get("entityRef") == name for element in group.iterfind("./Actors/EntityRef")
        ):
            yield group


def _follow(root: Node, name: str, course: Float, *, left_hand: bool) -> None:
    """Write a course in the place of the timed trajectory that an entity follows."""
    for group in _groups_of(root, name):
        for line in group.iter("Polyline"):
            vertex = deepcopy(line[0])
            for old in [*line]:
                line.remove(old)
            for time, x, y, h in opposite(course, (2, 3) if left_hand else ()).tolist():
                new = deepcopy(vertex)
                new.set("time", repr(time))
                place = new.find("./Position/WorldPosition")
                assert place is not None
                for coordinate, value in (("x", x), ("y", y), ("h", h)):
                    place.set(coordinate, repr(value))
                line.append(new)
