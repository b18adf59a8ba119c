"""The actions that concern all, at the start and in events: weather, lights, values."""

from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.element import Element
from bridgegen.openx.openscenario.values import Value
from bridgegen.simulation.embedded import _codes as codes
from bridgegen.simulation.embedded.compiler.environments import Environments
from bridgegen.simulation.embedded.compiler.signals import Signals
from bridgegen.simulation.embedded.compiler.tables import Tables
from bridgegen.simulation.embedded.compiler.values import Values, seconds

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
