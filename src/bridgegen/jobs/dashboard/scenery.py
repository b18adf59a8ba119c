"""What a scenario states of the taxonomy: facts, quantities, and the declared ranges."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property, reduce
from pathlib import Path

import numpy as np

from bridgegen.base.arrays import Float
from bridgegen.base.errors import BridgeGenError
from bridgegen.jobs.dashboard.results import Seen, scenario_name
from bridgegen.jobs.dashboard.taxonomy import QUANTITIES
from bridgegen.jobs.search.scenarios import load
from bridgegen.openx.file_scenario import FileScenario
from bridgegen.openx.opendrive.model import OpenDrive, Road
from bridgegen.openx.openscenario.bodies import kind_of
from bridgegen.scenario.language.parameters import Parameter
from bridgegen.scenario.language.roads import Quantity, RoadsSpec
from bridgegen.scenario.language.scenario import LogicalScenario, SearchedScenario
from bridgegen.scenario.participants import PARTICIPANTS
from bridgegen.scenario.weather import CLEAR_AIR, CLOUDBURST, DRIZZLE, GALE, THICK_FOG

BINS = 10
"""Number of bins of a declared range; a parameter of whole numbers has one for each, up to
``MOST_BINS``."""

MOST_BINS = 40

Columns = Mapping[str, Float]
"""Values of parameters by name, ``(N,)`` each, with those that stand at their default."""

_OF_FILES = "weather and speeds of an OpenSCENARIO file, of which the whole map counts"

_KMH = 3.6
_NOON = 100_000.0  # [lx] direct sunlight, OpenSCENARIO's figure; see weather.ILLUMINANCE

_WEATHER: Mapping[str, tuple[str, Callable[[Float], Float]]] = {
    "rain": (
        "precipitation",
        lambda x: np.where(x > 0.0, DRIZZLE * CLOUDBURST ** (x / 100.0), 0.0),
    ),
    "visual_range": ("fog_density", lambda x: CLEAR_AIR / THICK_FOG ** (x / 100.0)),
    "illuminance": (
        "sun_altitude_angle",
        lambda x: _NOON * np.maximum(np.sin(np.radians(x)), 0.0),
    ),
    "cloud": ("cloudiness", lambda x: 8.0 * x / 100.0),
    "wind": ("wind_intensity", lambda x: GALE * x / 100.0),
    "wetness": ("wetness", lambda x: x),
}
"""Quantities of the weather, by the laws of `bridgegen.scenario.weather`."""


@dataclass(frozen=True)
class Measure:
    """A quantity of the taxonomy in a scenario.

    Attributes:
        sources: names of parameters, or constants.
        of: the quantity, in its unit, of their values ``(N,)``.
    """

    sources: tuple[Quantity, ...]
    of: Callable[..., Float]

    def values(self, columns: Columns) -> Float:
        """Return the quantity, ``(N,)``, or ``(1,)`` where it is constant.

        Raises:
            KeyError: a parameter is not among the columns.
        """
        return self.of(
            *(
                columns[source] if isinstance(source, str) else np.array([source])
                for source in self.sources
            )
        )


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
    quantities: Mapping[str, Measure] = field(repr=False)
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
        sources = (source for each in self.quantities.values() for source in each.sources)
        return frozenset(self.edges) | {source for source in sources if isinstance(source, str)}

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
            upper = QUANTITIES[name].upper
            try:
                x = np.broadcast_to(of.values(filled), (n,))
            except KeyError:
                continue  # of a column that the result does not hold
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
        facts, quantities = _of_logical(scenario, on_map)
        partly = "roads of a map that a scenario is placed on" if on_map else ""
    elif isinstance(scenario, FileScenario):
        facts, quantities, partly = _of_file(scenario), {}, _OF_FILES
    else:
        facts, quantities, partly = set[str](), {}, "all but the parameters"
    return Scenery(
        scenario.title, frozenset(facts), parameters, defaults, quantities, partly=partly
    )


# ---- logical scenarios ----


def _of_logical(scenario: LogicalScenario, on_map: bool) -> tuple[set[str], dict[str, Measure]]:
    kinds = {
        kind
        for participant in scenario.participants
        if participant.name != "ego"
        for kind in (participant.types or (participant.type,))
    }
    facts = {f"participant:{_kind(item)}" for item in kinds}
    facts |= {"participant:emergency" for participant in scenario.participants if participant.siren}
    facts |= {"jam"} if scenario.story.jams else set()
    facts |= {"road works", "warning sign"} if scenario.story.works else set()
    quantities = {name: Measure((source,), of) for name, (source, of) in _WEATHER.items()}
    quantities["ego_speed"] = Measure((scenario.ego.speed,), lambda v: _KMH * v)
    if not on_map:
        facts |= _facts_of_roads(scenario.roads)
        quantities |= _quantities_of_roads(scenario.roads)
    return facts, quantities


def _kind(name: str) -> str:
    """Return the kind of a participant by the taxonomy's classes: a van is with the cars."""
    if name not in PARTICIPANTS:
        return "car"  # a vehicle by its model's name
    return name if name == "emergency" else PARTICIPANTS[name].seen_as.name


def _facts_of_roads(roads: RoadsSpec) -> set[str]:
    template, knobs = roads.template, roads.knobs
    facts = {"traffic lane", "marked", "right-hand traffic", roads.road_type}
    facts |= {"slip road", "divided"} if template == "merge" else set()
    if template in ("crossroads", "t-junction"):
        facts |= {template, "undivided"}
        facts.add("junction without lights" if roads.signals == "none" else "traffic lights")
    if template == "roundabout":
        facts.add("undivided")
    if template == "road":
        facts.add("divided" if knobs["lanes_against"] == 0 else "undivided")
    facts |= {"pavement"} if knobs["sidewalk_width"] != 0 else set()
    facts |= {"shoulder"} if knobs["shoulder_width"] != 0 else set()
    if roads.crosswalk_at is not None or any(leg.crosswalk for leg in roads.legs.values()):
        facts.add("crosswalk")
    if any(leg.sign for leg in roads.legs.values()) or roads.signals != "none":
        facts.add("regulatory sign")
    return facts


def _quantities_of_roads(roads: RoadsSpec) -> dict[str, Measure]:
    knobs = roads.knobs
    found = {
        "lane_width": Measure((knobs["lane_width"],), _same),
        # in whole km/h: 13.9 m/s stand for 50 km/h
        "speed_limit": Measure((knobs["speed_limit"],), lambda v: np.rint(_KMH * v)),
        "grade": Measure((knobs.get("grade", 0.0),), _same),
    }
    lanes = next((knobs[name] for name in ("lanes", "lanes_per_direction") if name in knobs), None)
    if lanes is not None:
        found["lanes"] = Measure((lanes,), _same)
    if roads.template == "roundabout":
        measures = (knobs["radius"], knobs["ring_lane_width"])
        found["roundabout_diameter"] = Measure(measures, lambda r, width: 2.0 * r + width)
        return found
    bends = [name for each in roads.segments for name in (each.curvature, each.end_curvature)]
    found["curve_radius"] = Measure((0.0, *bends), _radius)
    return found


def _same(x: Float) -> Float:
    return x


def _radius(*curvatures: Float) -> Float:
    """Return the radius of the tightest bend [m]; inf where there is none."""
    tightest = reduce(np.maximum, map(np.abs, curvatures))
    with np.errstate(divide="ignore"):
        return np.asarray(1.0 / tightest)


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


def _of_file(scenario: FileScenario) -> set[str]:
    """Return the facts of a scenario file and its map."""
    facts = set[str]()
    for obj in scenario.storyboard.entities.scenario_objects:
        kind = kind_of(obj.entity_object) if str(obj.name).lower() != "ego" else None
        if kind is not None and kind.takes_part:
            facts.add(f"participant:{_kind(kind.name)}")
    return facts | _facts_of_map(scenario.roads.model)


def _facts_of_map(roads: OpenDrive) -> set[str]:
    facts = {"traffic lane"} if roads.roads else set()
    for road in roads.roads:
        facts.add("left-hand traffic" if road.rule == "LHT" else "right-hand traffic")
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


Source = tuple[str, str, str, bool]
"""Source of a scenario: path or name, distribution, reading of empty triggers ("" for none),
whether it is on a map."""


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
            for (text, distribution, _, _), known in self._known.items()
            if known is not None
        }

    def _read(self, source: Source) -> tuple[Scenery, str] | None:
        text, distribution, trigger, on_map = source
        try:
            scenario = load(text, distribution or None, trigger or None)
            return scenery_of(scenario, on_map=on_map), scenario.fingerprint
        except (BridgeGenError, OSError, ValueError):  # ValueError: NUL in a path
            return None
