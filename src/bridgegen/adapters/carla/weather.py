"""CARLA's fourteen weather parameters, from the storyboard.

Exported files contain eleven of them as properties of their road condition, from the ontology with
the paper's couplings. In other files, they are computed from the physical quantities by the laws of
``bridgegen.scenario.weather``; quantities that OpenSCENARIO does not have (puddles,
fog distance) follow from the same couplings. Three that the paper does not have, on the scattering
of light, are those of CARLA's presets; there is no dust.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from bridgegen.base.arrays import Float, Int
from bridgegen.drivers._weather_columns import FRICTION_SCALE, STATED
from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.element import Element, walk
from bridgegen.openx.openscenario.values import Expr
from bridgegen.scenario.weather import CARLA_FIELDS, CARLA_NAMES, COLUMNS, STATED_BY
from bridgegen.simulation.embedded._codes import (
    DOES,
    EVENT,
    EVENT_NUMBER,
    FIRST,
    KIND,
    LAST,
    ROW,
    WEATHER_CHANGE,
)
from bridgegen.simulation.embedded.program import Program

if TYPE_CHECKING:
    import carla


@dataclass(frozen=True)
class Sky:
    """The weather that CARLA gets at an instant.

    Attributes:
        fields: the fourteen parameters, in their ranges.
        friction: factor on that of the dry road.
    """

    fields: Mapping[str, float]
    friction: float

    def parameters(self) -> "carla.WeatherParameters":
        """Return it as CARLA's."""
        import carla

        return carla.WeatherParameters(**self.fields)


class Weather:
    """The weather of one row as its storyboard makes it.

    Args:
        storyboard: the file.
        program: compiled from it.
        values: the row's, by parameter.
    """

    def __init__(
        self, storyboard: osc.OpenScenario, program: Program, values: Mapping[str, float]
    ) -> None:
        self._values = {**program.parameters, **values}
        found = _environments(storyboard)
        self._said = self._properties(found[0])
        self._later = [self._properties(group) for group in found[1:]]
        self._changes = _changes(program)
        self._stated: tuple[float, ...] = ()
        self._sky = Sky({}, 1.0)

    def at(self, k: int, physical: Float, events: Int) -> Sky:
        """Return the weather at an instant.

        Args:
            k: the instant.
            physical: ``(WEATHER,)`` as the embedded simulator has it, see `CoSimulation.weather`.
            events: ``(V,)``, see `CoSimulation.events`.
        """
        changed = False
        for event, row in self._changes:
            if events[event] == k:
                new, changed = self._later[row - 1], True
                self._said = {**self._said, **new} if new else {}
        stated = tuple(physical[:STATED].tolist())
        if changed or stated != self._stated:
            self._stated, self._sky = stated, self._sky_of(physical)
        return self._sky

    def _sky_of(self, physical: Float) -> Sky:
        return Sky(
            clamped({**of_quantities(physical), **self._said}), float(physical[FRICTION_SCALE])
        )

    def _properties(self, environments: list[osc.Environment]) -> dict[str, float]:
        """Return those of the parameters that environments say as CARLA has them."""
        said: dict[str, float] = {}
        for environment in environments:
            road = environment.road_condition
            for property_ in road.properties.properties if road and road.properties else ():
                field = CARLA_NAMES.get(str(property_.name))
                if field is not None and (value := self._number(property_.value)) is not None:
                    said[field] = value
        return said

    def _number(self, value: object) -> float | None:
        if isinstance(value, osc.ParameterRef | Expr):
            known = value.names <= self._values.keys()
            return float(value.resolve(self._values)) if known else None
        return _float(str(value))


def of_quantities(physical: Float) -> dict[str, float]:
    """Return the parameters that physical quantities come to.

    Args:
        physical: ``(STATED,)`` or more, see ``bridgegen.drivers._weather_columns``.
    """
    # All fourteen are always set: what is left out keeps the value of the last scenario.
    found = {name: field.preset for name, field in CARLA_FIELDS.items() if field.preset is not None}
    for index, column in enumerate(COLUMNS):
        parameter = STATED_BY.get(column.name)
        if parameter is None or not parameter.carla:
            continue
        value = parameter.law.inverse(float(physical[index]))
        if parameter.unit == "%":
            value = min(max(value, 0.0), 100.0)
        found[parameter.carla] = value
    fog, precipitation = found["fog_density"], found["precipitation"]
    deposits = max(min(5 / 3 * precipitation, 50 + 4 / 7 * (precipitation - 30)), 0.0)
    return {
        **found,
        "precipitation_deposits": deposits,
        "wetness": 100.0 * (1.0 - (1.0 - deposits / 100.0) ** 2),
        "fog_distance": 100.0 - fog,
        "fog_falloff": 0.05 * fog,
    }


def clamped(fields: Mapping[str, float]) -> dict[str, float]:
    """Return parameters within their ranges; an azimuth goes round."""
    result = {}
    for name, field in CARLA_FIELDS.items():
        value = fields[name]
        if name == "sun_azimuth_angle":
            value %= 360.0
        # CARLA's client does not clamp.
        result[name] = float(min(max(value, field.low), field.high))
    return result


def _environments(storyboard: osc.OpenScenario) -> list[list[osc.Environment]]:
    """Return the start's environments, then that of each event's action, in the file's order."""
    board = storyboard.storyboard

    def brought(part: Element) -> list[osc.Environment]:
        return [node.environment for node in walk(part) if isinstance(node, osc.EnvironmentAction)]

    later = [[environment] for story in board.stories for environment in brought(story)]
    return [brought(board.init.actions), *later]


def _changes(program: Program) -> list[tuple[int, int]]:
    """Return the events that change the weather, and the row of ``weathers`` that each brings."""
    return [
        (int(element[EVENT_NUMBER]), int(program.actions[j, ROW]))
        for element in program.elements.tolist()
        if element[KIND] == EVENT
        for j in range(element[FIRST], element[LAST])
        if program.actions[j, DOES] == WEATHER_CHANGE
    ]


def _float(text: str) -> float | None:
    try:
        return float(text)
    except ValueError:
        return None
