"""The actions that concern all, at the start and in events: weather, lights, values."""

import math
import re
from typing import Any

from bridgegen.base import elementary
from bridgegen.base.arrays import Int
from bridgegen.drivers._weather_columns import (
    CLOUD,
    ILLUMINANCE,
    RAIN,
    SNOW,
    STATED,
    SUN_AZIMUTH,
    SUN_ELEVATION,
)
from bridgegen.openx.openscenario import cloudiness
from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.element import Element
from bridgegen.openx.openscenario.values import Expr, Value
from bridgegen.scenario.language.expression import parse
from bridgegen.scenario.weather import COLUMNS, STATED_BY, Parameter, Physical, rain_formula
from bridgegen.simulation.embedded import _codes as codes
from bridgegen.simulation.embedded.compiler.declared import Values, seconds
from bridgegen.simulation.embedded.compiler.tables import Tables, table
from bridgegen.simulation.embedded.program import UNSAID

# --- Traffic lights: their states, and the controllers that take them through phases ---


LIGHT_STATES = {
    "off;off;off": 0,
    "on;off;off": 1,
    "on;on;off": 2,
    "off;on;off": 3,
    "off;off;on": 4,
}
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
        self._names = [tables.text(controller.name) for controller in self._found]
        self.lights: list[str] = []
        self.first_states: list[int] = []
        self.controllers: list[tuple[int, ...]] = []
        self.phases: list[tuple[int, ...]] = []
        self.changes: list[tuple[int, int]] = []
        for controller in self._found:
            self._add(controller)

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

    def _add(self, controller: osc.TrafficSignalController) -> None:
        first = len(self.phases)
        for phase in controller.phases:
            if phase.traffic_signal_group_state is not None:
                self._tables.unsupported(phase, "a TrafficSignalGroupState")
            change = len(self.changes)
            for state in phase.traffic_signal_states:
                light = self.light(self._tables.text(state.traffic_signal_id))
                self.changes.append((light, self.state(state, self._tables.text(state.state))))
            slot = self._tables.slot(phase.duration)
            self.phases.append((slot, change, len(self.changes)))
        reference = -1
        if controller.reference is not None:
            reference = self.controller(controller, self._tables.text(controller.reference))
        delay = self._tables.slot(0.0 if controller.delay is None else controller.delay)
        self.controllers.append((first, len(self.phases), delay, reference))


# --- The weathers of a storyboard, at the start and in events, as rows of slots ---
# What they do to sensors and tyres: ``bridgegen.drivers._weather_kernels``.


_TIME = re.compile(r"T(\d\d):(\d\d):(\d\d)")


class Environments:
    """The weathers, each a row of slots, −1 for what it leaves as it was; row 0 is the start's.

    Args:
        tables: the compiler's; takes down what cannot be run.
    """

    def __init__(self, tables: Tables) -> None:
        self._tables = tables
        self._rows = [[UNSAID] * STATED]

    @property
    def rows(self) -> Int:
        """``(V, STATED)``, see ``bridgegen.drivers._weather_columns``."""
        return table([tuple(row) for row in self._rows], STATED)

    def begin_with(self, environment: osc.Environment) -> None:
        """Take an environment into the start's weather."""
        self._fill(self._rows[0], environment)

    def add(self, environment: osc.Environment) -> int:
        """Add the weather that an event brings; return its row."""
        self._rows.append([UNSAID] * STATED)
        self._fill(self._rows[-1], environment)
        return len(self._rows) - 1

    def _fill(self, row: list[int], environment: osc.Environment) -> None:
        sky = environment.weather or osc.Weather()
        if sky.fog is not None and sky.fog.bounding_box is not None:
            self._tables.unsupported(sky.fog.bounding_box, "the BoundingBox of a Fog")
        for index, column in enumerate(COLUMNS):
            if column.element == "precipitation":
                continue
            value = self._stated(column, environment)
            if value is None and index == CLOUD:
                value = self._cover(sky)
            if value is not None:
                row[index] = self._tables.slot(value)
        if sky.precipitation is not None:
            self._fall(row, sky.precipitation)
        if sky.sun is None and environment.time_of_day is not None:
            self._time(row, environment.time_of_day)

    def _stated(self, column: Physical, environment: osc.Environment) -> Value | None:
        """Return what an environment states of a physical quantity; None if it states nothing."""
        if not column.element:
            return self._of_property(STATED_BY[column.name], environment.road_condition)
        of_road = column.element == "road_condition"
        holder = environment if of_road else environment.weather
        element: Any = getattr(holder, column.element, None)
        if element is None:
            return None
        # ``intensity`` of a Sun is lux in 1.0 and W/m² later, and a share in many files: not used.
        value: Value | None = getattr(element, column.attribute)
        return column.clear if value is None else value

    def _of_property(self, parameter: Parameter, road: osc.RoadCondition | None) -> Value | None:
        """Return the quantity of a parameter that our files say as a property, in percent."""
        said = road.properties.get(parameter.name) if road and road.properties else None
        if isinstance(said, osc.ParameterRef) and said.name in self._tables.parameters:
            return Expr("${" + re.sub(r"\bx\b", said.text, parameter.law.formula) + "}")
        if isinstance(said, str):
            try:
                percent = min(max(float(said), 0.0), 100.0)
            except ValueError:
                return None  # another tool's property of that name
            return float(parse(parameter.law.formula).evaluate({"x": percent}))
        return None

    def _fall(self, row: list[int], falling: osc.Precipitation) -> None:
        rate: Value = 0.0
        if falling.precipitation_intensity is not None:
            rate = falling.precipitation_intensity
        elif falling.intensity is not None:  # 1.0's share of the most: as a percentage is to us
            share = f"({_bare(falling.intensity)})"
            rate = Expr(f"${{{rain_formula(share)}}}")
        kind = self._tables.choice(osc.PrecipitationType, falling.precipitation_type)
        none = self._tables.slot(0.0)
        row[RAIN] = row[SNOW] = none
        if kind is osc.PrecipitationType.RAIN:
            row[RAIN] = self._tables.slot(rate)
        elif kind is osc.PrecipitationType.SNOW:
            row[SNOW] = self._tables.slot(rate)

    def _time(self, row: list[int], time: osc.TimeOfDay) -> None:
        """Place the sun by the time of day, where a file says nothing else of it."""
        found = _TIME.search(self._tables.text(time.date_time))
        if found is None:
            return
        hours, minutes, seconds = (int(part) for part in found.groups())
        elevation, azimuth = sun_at(hours + minutes / 60 + seconds / 3600)
        row[SUN_ELEVATION] = self._tables.slot(elevation)
        row[SUN_AZIMUTH] = self._tables.slot(azimuth)
        row[ILLUMINANCE] = self._tables.slot(-1.0)

    def _cover(self, sky: osc.Weather) -> Value | None:
        """Return the share of the sky that clouds cover by classes; None where none is said."""
        if sky.fractional_cloud_cover is not None:
            cover = self._tables.choice(osc.FractionalCloudCover, sky.fractional_cloud_cover)
            return cloudiness.of_cover(cover) / 100.0
        if sky.cloud_state is not None:
            state = self._tables.choice(osc.CloudState, sky.cloud_state)
            if state in cloudiness.OF_STATE:
                return cloudiness.OF_STATE[state] / 100.0
        return None


def sun_at(hours: float) -> tuple[float, float]:
    """Return the sun's elevation and azimuth [rad] at a time of day [h].

    The day is that of `bridgegen.openx.openscenario.from_owl.signals.time_of_day`: −90° at
    midnight, 50° at noon. The sun goes round evenly, and stands in the south at noon.
    """
    phase = (hours / 12.0 - 0.5) * math.pi
    return math.radians(-20.0 + 70.0 * elementary.sin(phase)), hours / 24.0 * 2.0 * math.pi


def _bare(value: Value) -> str:
    """Return a value as a part of an expression."""
    if isinstance(value, Expr):
        return value.text[2:-1]
    return format(value, "f") if isinstance(value, float) else str(value)


Row = tuple[int, ...]


class GlobalActions:
    """Rows of ``Program.actions``, and what the start sets.

    Attributes:
        signals: the lights and their controllers.
        values: the parameters and variables that change.
        environments: the weathers.
        first_phases: by controller, the phase that the start sets; missing where it sets none.
        first_time: the start's date [s] and whether it passes; None if it states none.

    Args:
        tables: the compiler's; takes down what cannot be run.
        scenario: the file.
    """

    def __init__(self, tables: Tables, scenario: osc.OpenScenario) -> None:
        self._tables = tables
        self.signals = Signals(tables, scenario.road_network.traffic_signals)
        self.values = Values(tables, scenario)
        self.environments = Environments(tables)
        self.first_phases: dict[int, int] = {}
        self.first_time: tuple[float, bool] | None = None

    def begin_with(self, action: Element) -> None:
        """Take an action of the start."""
        match action:
            case osc.EnvironmentAction():
                self.environments.begin_with(action.environment)
                self.first_time = self._time(action) or self.first_time
            case osc.InfrastructureAction():
                set_ = action.traffic_signal_action.action
                if isinstance(set_, osc.TrafficSignalStateAction):
                    light, state = self._light(set_)
                    self.signals.first_states[light] = state
                else:
                    controller, phase = self._phase(set_)
                    self.first_phases[controller] = phase
            case _:
                self.rows(action)

    def rows(self, action: Element) -> list[Row]:
        """Return the rows of an action of an event; unsupported ones are reported."""
        match action:
            case osc.EnvironmentAction():
                return self._environment(action)
            case osc.InfrastructureAction():
                set_ = action.traffic_signal_action.action
                if isinstance(set_, osc.TrafficSignalStateAction):
                    light, state = self._light(set_)
                    return [self._row(light, codes.LIGHT, state)]
                controller, phase = self._phase(set_)
                return [self._row(controller, codes.PHASE_CHANGE, path=phase)]
            case osc.ParameterAction():
                return [self._value(action, "parameter", action.parameter_ref)]
            case osc.VariableAction():
                return [self._value(action, "variable", action.variable_ref)]
            case osc.SetMonitorAction():  # monitors are outputs, and nothing looks at them
                return []
            case _:
                self._tables.unsupported(action, type(action).__name__)
        return []

    def _row(self, which: int, kind: int, value: Value = 0.0, flag: int = 0, path: int = 0) -> Row:
        slot = self._tables.slot(value)
        return which, kind, flag, 0, slot, slot, path

    def _environment(self, action: osc.EnvironmentAction) -> list[Row]:
        weather = self.environments.add(action.environment)
        rows = [self._row(0, codes.WEATHER_CHANGE, path=weather)]
        time = self._time(action)
        if time is not None:
            rows.append(self._row(0, codes.TIME_CHANGE, time[0], int(time[1])))
        return rows

    def _time(self, action: osc.EnvironmentAction) -> tuple[float, bool] | None:
        """Return the date that an environment states [s], and whether it passes."""
        time = action.environment.time_of_day
        if time is None:
            return None
        moment = seconds(self._tables.text(time.date_time))
        if moment is None:
            self._tables.unsupported(time, f'dateTime="{time.date_time}"')
            return None
        return moment, self._tables.truth(time.animation)

    def _light(self, action: osc.TrafficSignalStateAction) -> tuple[int, int]:
        light = self.signals.light(self._tables.text(action.name))
        return light, self.signals.state(action, self._tables.text(action.state))

    def _phase(self, action: osc.TrafficSignalControllerAction) -> tuple[int, int]:
        name = self._tables.text(action.traffic_signal_controller_ref)
        controller = self.signals.controller(action, name)
        return controller, self.signals.phase(action, controller, self._tables.text(action.phase))

    def _value(self, action: osc.ParameterAction | osc.VariableAction, what: str, name: str) -> Row:
        number, change = self.values.number(action, what, name), action.action
        if isinstance(change, osc.ParameterSetAction | osc.VariableSetAction):
            value = self.values.value(change, what, name, change.value)
            return self._row(number, codes.VALUE_SET, value)
        if not self.values.is_ordered(what, name):
            self._tables.unsupported(change, f"arithmetic on the text of {what} '{name}'")
        rule = change.rule.rule
        adds = isinstance(rule, osc.ParameterAddValueRule | osc.VariableAddValueRule)
        slot = self._tables.slot(rule.value)
        return number, codes.VALUE_ADD if adds else codes.VALUE_MULTIPLY, 0, 0, slot, slot, 0
