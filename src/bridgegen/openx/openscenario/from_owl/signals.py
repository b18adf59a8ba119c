"""OWL2OpenSCENARIO, its traffic lights: phases, and the changes of state that they bring.

A controller's phases are written as the standard has them, and as timed changes of state besides:
esmini and others run only these.
"""

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

from bridgegen.base.errors import OntologyError
from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.from_owl.quantities import Quantities, Quantity, parsed
from bridgegen.openx.openscenario.values import format_double
from bridgegen.scenario.ontology.graph import Individuals
from bridgegen.scenario.ontology.vocabulary import Subject
from bridgegen.scenario.weather import PARAMETERS, PARTS, PHYSICAL, SAME

LAMPS = {
    "red": "on;off;off",
    "red_yellow": "on;on;off",
    "yellow": "off;on;off",
    "green": "off;off;on",
    "off": "off;off;off",
}
"""The lamps of each state, top to bottom."""

LINKS = {
    "gives_green_to": "green",
    "gives_yellow_to": "yellow",
    "gives_red_yellow_to": "red_yellow",
}
"""The state of the lights that a phase names by each of its properties; all others are red."""

PASSED = "_passed"
"""End of the name of the part of a phase that has passed before time 0; it ends the cycle."""

_MOST_CHANGES = 200


def lamp_states(state: str) -> str:
    """Return the lamps of a state.

    Raises:
        OntologyError: there is no such state.
    """
    if state not in LAMPS:
        raise OntologyError(f"has_signal_state must be one of {', '.join(LAMPS)}, got '{state}'")
    return LAMPS[state]


class Signals:
    """The traffic lights of a scenario's individuals.

    Attributes:
        controllers: with their phases.
        start: the actions that set all lights at the start.
        offsets: by controller, the time of its first phase that has passed at the start [s]; those
            without any are left out.

    Args:
        individuals: one scenario.
        duration: of the scenario [s].

    Raises:
        OntologyError: a controller without lights or phases, a phase without a duration, or one
            light that two controllers switch.
    """

    def __init__(self, individuals: Individuals, duration: float) -> None:
        self._individuals, self._duration = individuals, duration
        self.controllers: list[osc.TrafficSignalController] = []
        self.start: list[osc.GlobalAction] = []
        self.offsets: dict[str, float] = {}
        self._changes: list[tuple[str, float, list[tuple[str, str]]]] = []
        seen: set[str] = set()
        for node in individuals.of_class("SignalController"):
            seen |= self._take(node, seen)

    def _take(self, node: Subject, seen: set[str]) -> set[str]:
        ind = self._individuals
        lights = {light: ind.text(light, "has_object_id") for light in ind.links(node, "has_light")}
        if seen & set(lights.values()):
            raise OntologyError(f"{ind.describe(node)} must switch lights that no other one does")
        phases = sorted(
            ind.links(node, "has_phase"), key=lambda phase: ind.integer(phase, "has_index")
        )
        if not phases and ind.links(node, "has_light"):
            return set()  # as maps have them: who is switched together, not when
        durations = [ind.number(phase, "has_duration") for phase in phases]
        if not phases or not all(0.0 < duration < math.inf for duration in durations):
            raise OntologyError(
                f"{ind.describe(node)} must have phases, each with a has_duration [s] above 0"
            )
        shown = [self._states(phase, lights) for phase in phases]
        name = ind.optional_text(node, "has_name") or ind.text(node, "has_object_id")
        offset = (ind.optional_number(node, "has_offset") or 0.0) % sum(durations)
        first = 0
        while offset >= durations[first]:
            offset -= durations[first]
            first = (first + 1) % len(phases)
        if offset > 0.0:
            self.offsets[name] = offset
        # The standard's cycle begins with its first phase, in full: with what is left of the one
        # that runs at time 0, whose passed part ends the cycle.
        order = (*range(first, len(phases)), *range(first))
        parts = [(k, ind.text(phases[k], "has_name"), durations[k]) for k in order]
        if offset > 0.0:
            _, said, lasts = parts[0]
            rest = (first, said, lasts - offset)
            parts = [rest, *parts[1:], (first, said + PASSED, offset)]
        self.controllers.append(
            osc.TrafficSignalController(
                name,
                tuple(
                    osc.Phase(
                        said,
                        lasts,
                        tuple(
                            osc.TrafficSignalState(light, LAMPS[state])
                            for light, state in sorted(shown[k].items())
                        ),
                    )
                    for k, said, lasts in parts
                ),
            )
        )
        self.start += [_set(light, state) for light, state in sorted(shown[first].items())]
        time, k, now = durations[first] - offset, first, dict(shown[first])
        while time < self._duration and len(self._changes) < _MOST_CHANGES:
            k = (k + 1) % len(phases)
            changed = sorted(item for item in shown[k].items() if now[item[0]] != item[1])
            if changed:
                self._changes.append((f"{name}_{len(self._changes) + 1}", time, changed))
            now |= shown[k]
            time += durations[k]
        return set(lights.values())

    def _states(self, phase: Subject, lights: dict[Subject, str]) -> dict[str, str]:
        shown = dict.fromkeys(lights.values(), "red")
        for link, state in LINKS.items():
            for light in self._individuals.links(phase, link):
                if light in lights:
                    shown[lights[light]] = state
        return shown

    def maneuver_groups(self) -> Iterator[osc.ManeuverGroup]:
        """Yield each change of state, at its time."""
        for name, time, changed in self._changes:
            actions = tuple(
                osc.Action(f"{name}_light_{light}", _set(light, state)) for light, state in changed
            )
            at = osc.SimulationTimeCondition(time, osc.Rule.GREATER_OR_EQUAL)
            condition = osc.Condition(
                f"{name}_time", 0.0, osc.ConditionEdge.NONE, osc.ByValueCondition(at)
            )
            trigger = osc.Trigger((osc.ConditionGroup((condition,)),))
            event = osc.Event(
                name, osc.Priority.OVERRIDE, actions, trigger, maximum_execution_count=1
            )
            yield osc.ManeuverGroup(
                f"{name}_group", 1, osc.Actors(False), (osc.Maneuver(f"{name}_maneuver", (event,)),)
            )


def _set(light: str, state: str) -> osc.GlobalAction:
    return osc.GlobalAction(
        osc.InfrastructureAction(
            osc.TrafficSignalAction(osc.TrafficSignalStateAction(light, LAMPS[state]))
        )
    )


# --- OWL2OpenSCENARIO, its weather: from CARLA's percentages and degrees to the standard's units --
# The ontology keeps the paper's weather parameters (percent and degrees, as CARLA has them); the
# standard wants physical quantities. A bound parameter is converted by an expression in the file,
# so # it stays searchable; `bridgegen.scenario.weather.Law` says what expressions know. What has no
# expression (classes, a time of day) is declared as a parameter of text, made from the present
# values.
#
# The originals are kept too, as properties of the road condition, for readers that know them.


_ELEMENTS: Mapping[str, Callable[..., Any]] = {
    "sun": osc.Sun,
    "fog": osc.Fog,
    "precipitation": osc.Precipitation,
    "wind": partial(osc.Wind, direction=0.0),
}
"""Constructors of the elements of the standard's Weather, called with their attributes; the
ontology knows no direction of wind."""

CLOUD_COVER = "fractional_cloud_cover"
ROAD_WETNESS = "road_wetness"
TIME_OF_DAY = "time_of_day"


def environment(
    individuals: Individuals, weather: Subject, quantities: Quantities, name: str = ""
) -> tuple[osc.Environment, list[osc.ParameterDeclaration]]:
    """Return the environment of a weather individual, and the text parameters that it refers to.

    Args:
        individuals: one scenario.
        weather: a Weather.
        quantities: the scenario's numbers.
        name: of the event that brings it; empty for the scenario's own.

    Raises:
        OntologyError: a part of the weather lacks a property, or it rains and snows at once.
    """
    found: dict[str, Quantity] = {}
    for part, parameters in PARTS.items():
        node = individuals.optional_link(weather, part.link)
        if node is not None:
            found |= {
                parameter.name: quantities.get(node, parameter.owl_property)
                for parameter in parameters
                if parameter.is_required
                or individuals.optional_number(node, parameter.owl_property) is not None
            }
    if "precipitation" in found and "snowfall" in found:
        raise OntologyError(
            f"{individuals.describe(weather)} must have has_rain or has_snow, not both"
        )
    texts: list[osc.ParameterDeclaration] = []

    def declare(text: str) -> osc.ParameterRef | None:
        law = LAWS[text]
        if law.part not in found:
            return None
        own = f"{name}_{text}" if name else text
        # Strings, also the dateTime: esmini supports no parameters of that type.
        value = law.text(quantities.value(found[law.part]))
        texts.append(osc.ParameterDeclaration(own, osc.ParameterType.STRING, value))
        return osc.ParameterRef(f"${own}")

    cover, wetness, time = map(declare, (CLOUD_COVER, ROAD_WETNESS, TIME_OF_DAY))
    result = osc.Environment(
        name=f"{name}_environment" if name else "environment",
        time_of_day=None if time is None else osc.TimeOfDay(animation=False, date_time=time),
        weather=_weather(found, cover, quantities),
        road_condition=osc.RoadCondition(
            friction_scale_factor=found.get("friction", 1.0),
            wetness=wetness,
            properties=osc.Properties(
                tuple(osc.Property(part, _text(value)) for part, value in found.items())
            ),
        ),
    )
    return result, texts


def _weather(
    found: dict[str, Quantity], cover: osc.ParameterRef | None, quantities: Quantities
) -> osc.Weather:
    elements: dict[str, dict[str, Any]] = {}
    for name, quantity in found.items():
        for of, formula in PARAMETERS[name].formulas:
            physical = PHYSICAL[of]
            if physical.element not in _ELEMENTS:
                continue
            element = elements.setdefault(physical.element, {})
            value = quantity if formula == SAME.formula else quantities.apply(formula, quantity)
            element[physical.attribute] = value
            if physical.element == "precipitation":
                element["precipitation_type"] = osc.PrecipitationType(of)
    made = {name: _ELEMENTS[name](**attributes) for name, attributes in elements.items()}
    return osc.Weather(cover, **made)


@dataclass(frozen=True)
class Law:
    """A text of the weather as a function of the number that it follows from.

    A formula, so that a page, which makes files of other values, has the same one.

    Attributes:
        part: the number.
        formula: of ``x``.
        words: the texts by the formula's value; none: its value is the time of a day [s].
    """

    part: str
    formula: str
    words: tuple[str, ...] = ()

    def text(self, x: float) -> str:
        """Return the text at a number."""
        value = int(parsed(self.formula).evaluate({"x": x}))
        if self.words:
            return self.words[value]
        return f"{DAY}T{value // 3600:02}:{value // 60 % 60:02}:{value % 60:02}"


DAY = "2025-03-20"
"""The day behind the paper's azimuth formula; means nothing. ``storyboard.js`` has it, too."""

COVER = Law(
    "cloudiness",
    "0 if x <= 0 else 8 if x >= 100 else min(max(floor(x * 8 / 100 + 0.5), 1), 7)",
    tuple(osc.FractionalCloudCover),
)
"""The eighths of sky that clouds cover; 0 and 8 mean none and all of it.

Source: WMO code table 2700.
"""

WETNESS = Law(
    "wetness",
    # 40 %: where the paper's friction formula turns from moist to wet.
    "0 if x <= 0 else 1 if x < 40 else 2",
    (osc.Wetness.DRY, osc.Wetness.MOIST, osc.Wetness.WET_WITH_PUDDLES),
)
"""The class of a road's wetness [%]: wet from where friction stops falling (40 %)."""

TIME = Law(
    "sun_altitude_angle",
    "round((asin(min(max((x + 20) / 70, -1), 1)) / pi + 0.5) * 12 * 3600)",
)
"""When, before noon, the sun stands at an altitude [deg].

CARLA's ``dynamic_weather.py``: altitude = −20 + 70·sin(t), from −90° at midnight to 50° at noon.
"""

LAWS: Mapping[str, Law] = {CLOUD_COVER: COVER, ROAD_WETNESS: WETNESS, TIME_OF_DAY: TIME}
"""By the name of the declared text."""


def _text(quantity: Quantity) -> str | osc.ParameterRef:
    return quantity if isinstance(quantity, osc.ParameterRef) else format_double(quantity)
