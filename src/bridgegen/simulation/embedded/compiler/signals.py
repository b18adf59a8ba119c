"""Traffic lights: their states, and the controllers that take them through phases."""

from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.element import Element
from bridgegen.simulation.embedded.compiler.tables import Tables

LIGHT_STATES = {
    "off;off;off": 0, "on;off;off": 1, "on;on;off": 2, "off;on;off": 3, "off;off;on": 4,
}  # fmt: skip
"""The states of a traffic light's three lamps as `Rollout.lights` has them."""

_MOST_STATES = 127  # they are kept as int8


class Signals:
    """The lights that are set or looked at, numbered as they come, and the controllers.

    Attributes:
        lights: names.
        first_states: their states at the start, by an action; -1: by none.
        controllers: first and past-the-last phase, slot of the delay, controller that it is a
            delay to or -1.
        phases: slot of the duration, first and past-the-last change.
        changes: light and state.

    Args:
        tables: the compiler's; takes down what cannot be run.
        declared: the file's.
    """

    def __init__(self, tables: Tables, declared: osc.TrafficSignals | None) -> None:
        self._tables = tables
        self._states = dict(LIGHT_STATES)
        self._found = declared.controllers if declared else ()
        self._names = [tables.text(one.name) for one in self._found]
        self.lights: list[str] = []
        self.first_states: list[int] = []
        self.controllers: list[tuple[int, ...]] = []
        self.phases: list[tuple[int, ...]] = []
        self.changes: list[tuple[int, int]] = []
        for one in self._found:
            self._add(one)

    def light(self, name: object) -> int:
        """Return the number of a light."""
        text = str(name)
        if text not in self.lights:
            self.lights.append(text)
            self.first_states.append(-1)
        return self.lights.index(text)

    def state(self, element: Element, text: object) -> int:
        """Return the number of a state; other words than a light's three lamps get numbers too."""
        number = self._states.setdefault(str(text), len(self._states))
        if number > _MOST_STATES:
            self._tables.unsupported(element, f'state="{text}" (more than {_MOST_STATES} states)')
            return 0
        return number

    def controller(self, element: Element, name: object) -> int:
        """Return the number of a controller; report an undeclared one."""
        if str(name) not in self._names:
            what = f'trafficSignalControllerRef="{name}" (no such controller)'
            self._tables.unsupported(element, what)
            return -1
        return self._names.index(str(name))

    def phase(self, element: Element, controller: int, name: object) -> int:
        """Return the number of a controller's phase; report a missing one."""
        if controller >= 0:
            for i, phase in enumerate(self._found[controller].phases):
                if self._tables.text(phase.name) == str(name):
                    return self.controllers[controller][0] + i
            self._tables.unsupported(element, f'phase="{name}" (no such phase)')
        return -1

    def _add(self, one: osc.TrafficSignalController) -> None:
        first = len(self.phases)
        for phase in one.phases:
            if phase.traffic_signal_group_state is not None:
                self._tables.unsupported(phase, "a TrafficSignalGroupState")
            change = len(self.changes)
            for state in phase.traffic_signal_states:
                light = self.light(self._tables.text(state.traffic_signal_id))
                self.changes.append((light, self.state(state, self._tables.text(state.state))))
            slot = self._tables.slot(phase.duration)
            self.phases.append((slot, change, len(self.changes)))
        reference = -1
        if one.reference is not None:
            reference = self.controller(one, self._tables.text(one.reference))
        delay = self._tables.slot(0.0 if one.delay is None else one.delay)
        self.controllers.append((first, len(self.phases), delay, reference))
