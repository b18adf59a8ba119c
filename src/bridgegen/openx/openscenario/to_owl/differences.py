"""Contents of one file that another lacks: the check of a round trip.

Names that nothing refers to are labels and not compared, and neither is what the second says
besides; a value that the standard takes where none is written is that value.
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.element import Attribute, Element, children_of, declaration
from bridgegen.openx.openscenario.to_owl.build import Lost
from bridgegen.openx.openscenario.values import Expr, Kind, Literal, ParameterRef

# Numbers go through formulas and units on the way, and differ by rounding.
_REL, _ABS = 1e-9, 1e-9
_CLEAR = 1000.0  # m: what hides less is no fog (WMO)

_LABELS: frozenset[tuple[type[Element], str]] = frozenset(
    {
        (osc.Action, "name"),
        (osc.Condition, "name"),
        (osc.Environment, "name"),
        (osc.ManeuverGroup, "name"),
        (osc.Route, "name"),
        (osc.TriggeringEntities, "triggering_entities_rule"),  # of one entity
    }
)
_MEASURED = (
    osc.RelativeDistanceCondition,
    osc.TimeHeadwayCondition,
    osc.TimeToCollisionCondition,
)
_DEFAULTS: dict[tuple[type[Element], str], Any] = {
    (osc.Event, "maximum_execution_count"): 1,
    (osc.LaneChangeAction, "target_lane_offset"): 0.0,
    (osc.LanePosition, "offset"): 0.0,
    (osc.TransitionDynamics, "following_mode"): osc.FollowingMode.POSITION,
    (osc.Vehicle, "role"): osc.Role.NONE,
    **{(cls, "coordinate_system"): osc.CoordinateSystem.ENTITY for cls in _MEASURED},
    **{
        (cls, "relative_distance_type"): osc.RelativeDistanceType.EUCLIDIAN_DISTANCE
        for cls in _MEASURED
    },
    **{(osc.Orientation, angle): 0.0 for angle in "hpr"},
    **{(osc.WorldPosition, field): 0.0 for field in "zhpr"},
}
DETAILS = (
    osc.License
    | osc.Property
    | osc.Properties
    | osc.Axle
    | osc.ValueConstraint
    | osc.ValueConstraintGroup
    | osc.ObjectController
    | osc.ControllerAction
    | osc.ActivateControllerAction
    | osc.LightStateAction
    | osc.TrailerHitch
    | osc.ParameterDeclaration
    | osc.File
    | osc.TimeOfDay
)
"""Elements on which nothing depends that happens.

Who drives is chosen with the driver; where a parameter is needed, its value is stated.
"""

_DETAIL_FIELDS: frozenset[tuple[type[Element], str]] = frozenset(
    {
        *((cls, "name") for cls in (osc.Vehicle, osc.Pedestrian, osc.MiscObject)),
        *((cls, "model3d") for cls in (osc.Vehicle, osc.Pedestrian, osc.MiscObject)),
        (osc.Pedestrian, "model"),
        (osc.Center, "z"),
        (osc.Precipitation, "intensity"),
        (osc.Sun, "intensity"),
        (osc.Sun, "illuminance"),
        (osc.Weather, "cloud_state"),
    }
)
_OLD_NAMES: dict[Any, Any] = {
    osc.Priority.OVERWRITE: osc.Priority.OVERRIDE,
    osc.RelativeDistanceType.CARTESIAN_DISTANCE: osc.RelativeDistanceType.EUCLIDIAN_DISTANCE,
}


def is_detail(element: object) -> bool:
    """Return whether nothing that happens depends on an element."""
    return isinstance(element, DETAILS) and not _holds_pedals(element)


def _holds_pedals(element: object) -> bool:
    """Return whether an action holds a pedal, the wheel or the gear, or may do so."""
    if not isinstance(element, osc.ControllerAction):
        return False
    part = element.override_controller_value_action
    pedals = (
        ()
        if part is None
        else (
            part.throttle,
            part.brake,
            part.clutch,
            part.parking_brake,
            part.steering_wheel,
            part.gear,
        )
    )
    return any(pedal is not None and pedal.active is not False for pedal in pedals)


@dataclass(frozen=True)
class Differences:
    """Compares elements of two files.

    Attributes:
        here: the first file's parameters' values.
        there: the second's.
    """

    here: Mapping[str, Literal]
    there: Mapping[str, Literal]

    def between(self, element: Element, other: Element | None) -> Iterator[Lost]:
        """Yield lines of the first, and what stands there and not in the second."""
        tag = type(element).__name__
        if other is None or type(other) is not type(element):
            if not _is_nothing(element):
                yield Lost(element.line, _called(element), is_detail(element))
            return
        # A step takes no time, whatever number stands beside it.
        step = isinstance(element, osc.TransitionDynamics) and (
            element.dynamics_shape
            == osc.DynamicsShape.STEP
            == getattr(other, "dynamics_shape", None)
        )
        for attribute in declaration(type(element)).attributes.values():
            said = getattr(element, attribute.field)
            again = getattr(other, attribute.field)
            usual = _DEFAULTS.get((type(element), attribute.field))
            if (
                said is None
                or (type(element), attribute.field) in _LABELS
                or (step and attribute.field in ("dynamics_dimension", "value"))
                or self._same(attribute, said, usual if again is None else again)
            ):
                continue
            shown = str(said).lower() if isinstance(said, bool) else said
            becomes = "" if again is None else f" (it would become {_text(again, self.there)})"
            detail = (
                is_detail(element)
                or (type(element), attribute.field) in _DETAIL_FIELDS
                or self._is_size(element, other)
                or self._is_called_out(element, other)
            )
            yield Lost(
                element.line,
                f'{attribute.name}="{shown}" of {tag}{becomes}',
                detail or self._is_equal(attribute, said, again) or self._is_clear(element, other),
            )
        text = declaration(type(element)).text
        if text is not None and getattr(element, text) != getattr(other, text):
            yield Lost(element.line, f"the text of {tag}", is_detail(element))
        yield from self._below(element, other)

    def _below(self, element: Element, other: Element) -> Iterator[Lost]:
        # Like with like, by tag and key: the order of a file's elements means nothing here, and one
        # element that is missing must not shift all others.
        before: dict[tuple[str, Any], list[Element]] = {}
        for tag, child in children_of(other):
            before.setdefault((tag, self._key(child, self.there)), []).append(child)
        for tag, child in children_of(element):
            left = before.get((tag, self._key(child, self.here)))
            yield from self.between(child, left.pop(0) if left else None)
        # What the second file says besides is no loss, but for a condition: a further one makes an
        # event begin later, or not at all.
        for left in before.values():
            for child in left:
                if isinstance(child, osc.ConditionGroup | osc.Condition):
                    yield Lost(
                        element.line, f"{type(element).__name__} without a further {_about(child)}"
                    )

    def _key(self, child: Element, values: Mapping[str, Literal]) -> Any:
        """Return what an element is found by among its like: a property's name, a limit's rule."""
        if isinstance(child, osc.Property):
            return values[child.name.name] if isinstance(child.name, ParameterRef) else child.name
        return child.rule if isinstance(child, osc.ValueConstraint) else None

    def _same(self, attribute: Attribute, item: Any, other: Any) -> bool:
        if item == other:
            return True
        if other is None:
            return False
        if attribute.kind is Kind.STRING or attribute.kind is Kind.DATE_TIME:
            a, b = (_text(value, of) for value, of in ((item, self.here), (other, self.there)))
            return bool(_OLD_NAMES.get(a, a) == _OLD_NAMES.get(b, b)) or (
                attribute.is_literal and _as_number(a) == _as_number(b) is not None
            )
        names = [
            value.names if isinstance(value, ParameterRef | Expr) else frozenset[str]()
            for value in (item, other)
        ]
        return names[0] == names[1] and self._is_equal(attribute, item, other)

    def _is_size(self, element: Element, other: Element) -> bool:
        """Return whether two rates differ by their sign alone: they say how fast, not where to."""
        if not (
            isinstance(element, osc.TransitionDynamics)
            and isinstance(other, osc.TransitionDynamics)
        ):
            return False
        rate = osc.DynamicsDimension.RATE
        sizes = abs(_number(element.value, self.here)), abs(_number(other.value, self.there))
        return element.dynamics_dimension == other.dynamics_dimension == rate and math.isclose(
            *sizes
        )

    def _is_called_out(self, element: Element, other: Element) -> bool:
        """Return whether both are emergency vehicles, whichever: all are of one class."""
        roles = (osc.Role.AMBULANCE, osc.Role.FIRE, osc.Role.POLICE)
        return (
            isinstance(element, osc.Vehicle)
            and isinstance(other, osc.Vehicle)
            and element.role in roles
            and other.role in roles
        )

    def _is_clear(self, element: Element, other: Element) -> bool:
        """Return whether two fogs are none that a driver would notice."""
        if not (isinstance(element, osc.Fog) and isinstance(other, osc.Fog)):
            return False
        seen = _number(element.visual_range, self.here), _number(other.visual_range, self.there)
        return min(seen) >= _CLEAR

    def _is_equal(self, attribute: Attribute, value: Any, other: Any) -> bool:
        """Return whether two numbers are equal at the parameters' values."""
        is_text = attribute.kind is Kind.STRING and not attribute.takes_expressions
        if is_text or attribute.kind is Kind.DATE_TIME or other is None:
            return False
        try:
            a, b = _number(value, self.here), _number(other, self.there)
        except (TypeError, ValueError):
            return False
        return math.isclose(a, b, rel_tol=_REL, abs_tol=_ABS)


def _called(element: Element) -> str:
    """Return an element's tag, with its name if it has one."""
    name = getattr(element, "name", None)
    return type(element).__name__ if name is None else f"{type(element).__name__} {name}"


def _about(child: Element) -> str:
    if isinstance(child, osc.ConditionGroup):
        return (
            f"ConditionGroup ({', '.join(str(condition.name) for condition in child.conditions)})"
        )
    return type(child).__name__


def _is_nothing(element: Element) -> bool:
    """Return whether an element's presence has no meaning."""
    if isinstance(element, osc.Precipitation):
        return element.precipitation_type == osc.PrecipitationType.DRY
    silent = (
        osc.Properties
        | osc.TrafficSignals
        | osc.ParameterDeclarations
        | osc.VariableDeclarations
        | osc.MonitorDeclarations
    )
    return isinstance(element, silent) and not list(children_of(element))


def _text(value: Any, values: Mapping[str, Literal]) -> Any:
    return str(values[value.name]) if isinstance(value, ParameterRef) else value


def _number(value: Any, values: Mapping[str, Literal]) -> float:
    if not isinstance(value, ParameterRef | Expr):
        return float(value)
    numbers = {name: float(values[name]) for name in value.names}
    return float(value.resolve(numbers))


def _as_number(text: Any) -> float | None:
    try:
        return float(text)
    except (TypeError, ValueError):
        return None
