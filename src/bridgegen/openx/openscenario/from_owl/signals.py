"""OWL2OpenSCENARIO, its traffic lights: phases, and the changes of state that they bring.

A controller's phases are written as the standard has them, and as timed changes of state besides:
esmini and others run only these.
"""

import math
from collections.abc import Iterator

from bridgegen.base.errors import OntologyError
from bridgegen.openx.openscenario import model as osc
from bridgegen.scenario.ontology.graph import Individuals
from bridgegen.scenario.ontology.vocabulary import Subject

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
        if not phases or not all(0.0 < one < math.inf for one in durations):
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
        # The standard's cycle begins with its first phase: the one that runs at time 0.
        order = [*range(first, len(phases)), *range(first)]
        self.controllers.append(
            osc.TrafficSignalController(
                name,
                tuple(
                    osc.Phase(
                        ind.text(phases[k], "has_name"),
                        durations[k],
                        tuple(
                            osc.TrafficSignalState(light, LAMPS[state])
                            for light, state in sorted(shown[k].items())
                        ),
                    )
                    for k in order
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
