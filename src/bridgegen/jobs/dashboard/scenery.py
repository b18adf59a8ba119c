"""What a scenario states of the taxonomy: facts, quantities, and the declared ranges."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import numpy as np

from bridgegen.base.arrays import Float
from bridgegen.base.errors import BridgeGenError
from bridgegen.jobs.dashboard.results import Seen, scenario_name
from bridgegen.jobs.search.scenarios import load, within
from bridgegen.openx.file_scenario import FileScenario
from bridgegen.openx.opendrive.model import OpenDrive, Road
from bridgegen.scenario.language.expression import Expression
from bridgegen.scenario.language.parameters import Parameter
from bridgegen.scenario.language.scenario import LogicalScenario, SearchedScenario
from bridgegen.scenario.odd.states import facts_of_roads, states_of, table

BINS = 10
"""Number of bins of a declared range; a parameter of whole numbers has one for each, up to
``MOST_BINS``."""

MOST_BINS = 40

BANDS: Mapping[str, Sequence[float]] = {
    name: entry["upper"] for name, entry in table().quantities.items() if "upper" in entry
}
"""Upper limits of the bands in which evaluations of a quantity are counted, ascending."""

Columns = Mapping[str, Float]
"""Values of parameters by name, ``(N,)`` each, with those that stand at their default."""

_OF_FILES = "weather and speeds of an OpenSCENARIO file, of which the whole map counts"


@dataclass(frozen=True)
class Scenery:
    """What a scenario states.

    Attributes:
        title: of the scenario.
        facts: that hold in all its evaluations.
        parameters: that its file lets vary.
        defaults: of all parameters.
        quantities: of the taxonomy, by name.
        partly: what is not read of it; "" where all is.
    """

    title: str
    facts: frozenset[str]
    parameters: tuple[Parameter, ...]
    defaults: Mapping[str, float]
    quantities: Mapping[str, Expression] = field(repr=False)
    partly: str = ""

    @cached_property
    def edges(self) -> Mapping[str, Float]:
        """Of each parameter that varies, the edges of the bins of its declared range."""
        found = {}
        for parameter in self.parameters:
            edges = parameter.kind.edges(parameter.low, parameter.high, BINS)
            if len(edges) > MOST_BINS + 1:
                edges = np.linspace(parameter.low, parameter.high, BINS + 1)
            found[parameter.name] = edges
        return found

    @cached_property
    def columns(self) -> frozenset[str]:
        """The parameters on whose values the counts depend."""
        return frozenset(self.edges).union(*(each.names for each in self.quantities.values()))

    def inner(self, name: str, value: float | str) -> float:
        """Return the inner value of a parameter that varies, from what people read."""
        parameter = next(each for each in self.parameters if each.name == name)
        found = parameter.kind.read(value, parameter.low, parameter.high)
        return float("nan") if found is None else found

    def seen(self, columns: Columns, n: int) -> Seen:
        """Count evaluations.

        Args:
            columns: of the n evaluations with a result; a parameter that is missing stands at its
                default.
            n: how many they are.
        """
        filled = {name: np.full(n, value) for name, value in self.defaults.items()}
        filled.update(columns)
        found = Seen(n)
        for name, edges in self.edges.items():
            x = filled[name]
            inside = (x >= edges[0]) & (x <= edges[-1])
            where = np.searchsorted(edges[1:-1], x[inside], side="right")
            found.bins[name] = np.bincount(where, minlength=len(edges) - 1).tolist()
            if outside := int(n - inside.sum()):
                found.outside[name] = outside
        for name, of in self.quantities.items():
            upper = BANDS[name]
            if not of.names <= filled.keys():
                continue  # of a column that the result does not hold
            x = np.broadcast_to(of.evaluate(filled), (n,))
            known = x[~np.isnan(x)]
            where = np.searchsorted(upper, known, side="left")
            found.bands[name] = np.bincount(where, minlength=len(upper)).tolist()
        return found


def scenery_of(scenario: SearchedScenario, *, on_map: bool = False) -> Scenery:
    """Return what a scenario states.

    Args:
        scenario: logical, or of a file.
        on_map: whether it takes place on a map, whose roads are not read.
    """
    parameters = tuple(
        parameter for parameter in scenario.parameters.values() if parameter.low < parameter.high
    )
    defaults = {parameter.name: parameter.default for parameter in scenario.parameters.values()}
    if isinstance(scenario, LogicalScenario):
        defaults = scenario.usual_values()
        states = states_of(scenario, on_map=on_map)
        facts = set(states.facts) | (set() if on_map else facts_of_roads(scenario.roads))
        quantities = {name: of for name, of in states.quantities.items() if name in BANDS}
        partly = "roads of a map that a scenario is placed on" if on_map else ""
    elif isinstance(scenario, FileScenario):
        facts = {*scenario.states().facts, *_facts_of_map(scenario.roads.model)}
        quantities, partly = {}, _OF_FILES
    else:
        facts, quantities, partly = set[str](), {}, "all but the parameters"
    return Scenery(
        scenario.title, frozenset(facts), parameters, defaults, quantities, partly=partly
    )


# ---- scenario files ----

_ROAD_TYPES = {
    "motorway": "motorway",
    "rural": "rural",
    "town": "town",
    "townExpressway": "town",
    "townCollector": "town",
    "townArterial": "town",
    "townPrivate": "town",
    "townLocal": "town",
    "lowSpeed": "town",
}
"""OpenDRIVE's types of roads, by BridgeGen's."""


def _facts_of_map(roads: OpenDrive) -> set[str]:
    facts = {"traffic lane"} if roads.roads else set()
    for road in roads.roads:
        facts.add(f"{'left' if roads.left_hand else 'right'}-hand traffic")
        facts |= {_ROAD_TYPES[kind.type] for kind in road.types if kind.type in _ROAD_TYPES}
        facts |= _facts_of_lanes(road)
    return facts


def _facts_of_lanes(road: Road) -> set[str]:
    lanes = [lane for section in road.sections for lane in (*section.left, *section.right)]
    kinds = {lane.type for lane in lanes}
    facts = {"pavement"} if kinds & {"sidewalk", "walking"} else set()
    facts |= {"shoulder"} if kinds & {"shoulder", "stop"} else set()
    facts |= {"slip road"} if kinds & {"entry", "exit", "onRamp", "offRamp"} else set()
    if any(mark.type != "none" for lane in lanes for mark in lane.road_marks):
        facts.add("marked")
    if any(obj.type == "crosswalk" for obj in road.objects):
        facts.add("crosswalk")
    return facts


# --- The sceneries of a project: each scenario is read once, whatever number of results it has ---


Source = tuple[str, str, str, bool, str]
"""Source of a scenario: path or name, distribution, reading of empty triggers, whether it is on a
map, and the ODD that bounds it, as JSON; "" for none."""


class Sceneries:
    """Reads scenarios, and remembers them."""

    def __init__(self) -> None:
        self._known: dict[Source, tuple[Scenery, str] | None] = {}

    def of(self, source: Source, fingerprint: str = "") -> Scenery | None:
        """Return the scenery of a scenario; None where it cannot be read, or has changed.

        Args:
            source: of the scenario.
            fingerprint: of the scenario when its result was made; "" if that is not known.
        """
        if source not in self._known:
            self._known[source] = self._read(source)
        known = self._known[source]
        if known is None or (fingerprint and known[1] != fingerprint):
            return None
        return known[0]

    def by_name(self, project: Path) -> dict[str, Scenery]:
        """Return all that were read, by the names that results have their scenarios under."""
        return {
            scenario_name(text, project, distribution): known[0]
            for (text, distribution, *_), known in self._known.items()
            if known is not None
        }

    def _read(self, source: Source) -> tuple[Scenery, str] | None:
        text, distribution, trigger, on_map, odd = source
        try:
            scenario = load(text, distribution or None, trigger or None)
            scenario = within(scenario, json.loads(odd) if odd else None, text if on_map else None)
            return scenery_of(scenario, on_map=on_map), scenario.fingerprint
        except (BridgeGenError, OSError, ValueError):  # ValueError: NUL in a path
            return None
