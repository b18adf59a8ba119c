"""From a scenario's template and the values of its static parameters to a `Site`."""

import math
from collections.abc import Iterator, Mapping

from bridgegen.base.errors import OntologyError
from bridgegen.scenario.language.kinds import TOLERANCE
from bridgegen.scenario.language.roads import (
    CROSSWALK_GAP,
    KNOBS,
    LegSpec,
    Quantity,
    RoadsSpec,
    usual,
)
from bridgegen.scenario.ontology.site import (
    ArmRoad,
    Direction,
    Facility,
    JunctionEnd,
    LaneType,
    Leg,
    Phase,
    Searched,
    Site,
    SiteLane,
    SiteSegment,
)

JUNCTION_ID = "100"

BESIDE = 0.75
"""Distance of signs, lights and lamps from the road's edge [m]; source: RSA 21, 0.5 to 1.5."""

RAMP_HEADING = 190.0
"""Heading of a ramp that joins a carriageway along +x at 10° from its right [deg]; ours."""

OPPOSITE = 45.0
"""Largest deviation from a straight line of the directions of legs that are opposite [deg];
ours."""

_BY_LEGS = {3: "TJunction", 4: "Crossroads"}
_WAYS: tuple[Direction, ...] = ("in", "out")


def site_of(roads: RoadsSpec, values: Mapping[str, float]) -> Site:
    """Return the road network of a template at some values of its parameters.

    Args:
        roads: the template with its knobs.
        values: the static parameters that it names, by name; others are ignored.

    Raises:
        OntologyError: a number of lanes is no whole number.
        KeyError: a parameter has no value.
    """
    return _Template(roads, values).site()


class _Template:
    def __init__(self, roads: RoadsSpec, values: Mapping[str, float]) -> None:
        self.roads, self.values = roads, values
        self.knobs = {name: self.measure(value) for name, value in roads.knobs.items()}

    def measure(self, value: Quantity) -> float:
        if isinstance(value, str):
            return Searched(float(self.values[value]), value)
        return value

    def site(self) -> Site:
        roads, knobs = self.roads, self.knobs
        if roads.template == "road":
            return self.assemble((self.road(),), None, None, {})
        if roads.template == "merge":
            measures = {
                "has_merge_length": knobs["merge_length"],
                "has_taper_length": knobs["taper_length"],
            }
            return self.assemble(tuple(self.carriageways()), "Merge", None, measures)
        legs = tuple(self.arm(number, name) for number, name in enumerate(roads.legs, start=1))
        if roads.template == "roundabout":
            measures = {
                "has_radius": knobs["radius"],
                "has_ring_lane_width": knobs["ring_lane_width"],
            }
            return self.assemble(legs, "Roundabout", None, measures)
        kind = _BY_LEGS.get(len(legs), "Intersection")
        return self.assemble(legs, kind, knobs["intersection_size"], {})

    def assemble(
        self,
        legs: tuple[Leg, ...],
        kind: str | None,
        size: float | None,
        measures: Mapping[str, float],
    ) -> Site:
        facilities = tuple(self.facilities(legs))
        headings = {name: leg.heading for name, leg in self.roads.legs.items()}
        return Site(
            name=self.roads.template,
            map_file=None,
            place_id=JUNCTION_ID,
            size=size,
            legs=legs,
            kind=kind,
            measures_of=measures,
            facilities=facilities,
            phases=tuple(phases_of(self.roads, headings)),
            signal_offset=self.knobs.get("signal_offset", 0.0),
            left_hand=self.roads.left_hand,
            country=self.roads.country,
        )

    # -- legs ----------------------------------------------------------------------------------

    def arm(self, number: int, name: str) -> Leg:
        """Return a leg of a junction; its reference line runs outwards."""
        spec = self.roads.legs[name]
        counts = {way: self.count(name, way) for way in _WAYS}
        road = self.arm_road(str(number), self.knobs["arm_length"], "start", counts, spec)
        return Leg(name, spec.heading, (road,))

    def road(self) -> Leg:
        """Return a road that meets no junction."""
        segments = tuple(
            SiteSegment(
                self.measure(segment.length),
                self.measure(segment.curvature),
                self.measure(segment.end_curvature),
            )
            for segment in self.roads.segments
        )
        length = self.knobs["length"]
        if segments:
            length = sum(float(segment.length) for segment in segments)
        counts = {way: self.count("main", way) for way in _WAYS}
        return Leg("main", 0.0, (self.arm_road("1", length, "none", counts, segments=segments),))

    def carriageways(self) -> Iterator[Leg]:
        """Yield the legs of a merge; all reference lines run with the traffic."""
        for number, (name, heading) in enumerate(
            (("main", 180.0), ("ramp", RAMP_HEADING), ("after", 0.0)), start=1
        ):
            counts = {way: self.count(name, way) for way in _WAYS}
            after = name == "after"
            length = self.knobs["after_length" if after else "arm_length"]
            road = self.arm_road(str(number), length, "start" if after else "end", counts)
            yield Leg(name, heading, (road,))

    def arm_road(
        self,
        road_id: str,
        length: float,
        junction_end: JunctionEnd,
        counts: Mapping[Direction, float],
        spec: LegSpec | None = None,
        segments: tuple[SiteSegment, ...] = (),
    ) -> ArmRoad:
        said: dict[Direction, float] = {
            way: count for way, count in counts.items() if isinstance(count, Searched)
        }
        change = self.roads.change
        return ArmRoad(
            road_id=road_id,
            length=length,
            junction_end=junction_end,
            lanes=tuple(self.lanes(counts, junction_end == "end", spec)),
            speed_limit=self.knobs["speed_limit"],
            road_type=self.roads.road_type,
            segments=segments,
            grade=self.knobs.get("grade", 0.0),
            change=change and (self.measure(change.at), *change[1:]),
            counts=said,
            closes={name: self.measure(limit) for name, limit in self.roads.closes.items()},
        )

    def count(self, leg: str, way: Direction) -> float:
        """Return a number of lanes.

        Raises:
            OntologyError: it is no whole number.
        """
        said = self.roads.lanes(leg, way)
        count = self.measure(said)
        if not (math.isfinite(count) and abs(count - round(count)) <= TOLERANCE):
            name = said if isinstance(said, str) else "lanes_per_direction"
            raise OntologyError(f"{name} must be a whole number, got {float(count)}")
        return count

    def lanes(
        self, counts: Mapping[Direction, float], towards: bool, spec: LegSpec | None
    ) -> Iterator[SiteLane]:
        """Yield lanes and strips, inside to outside; ``towards``: the road ends at the junction."""
        width = self.knobs["lane_width"]
        for way in _WAYS:
            sign = 1 if (way == "in") != towards else -1
            count = round(counts[way])
            for k in range(1, count + 1):
                turns = spec.turns[k - 1] if spec and way == "in" and spec.turns else ()
                yield SiteLane(sign * k, way, width, "driving", turns)
            outer = count
            strips: tuple[LaneType, ...] = ("shoulder", "sidewalk")
            for strip in strips:
                if self.knobs[f"{strip}_width"] > 0.0 and (count or self.both_sides):
                    outer += 1
                    yield SiteLane(sign * outer, way, self.knobs[f"{strip}_width"], strip)

    @property
    def both_sides(self) -> bool:
        """Whether strips lie on the side of a direction that has no lanes, too."""
        return self.roads.template in ("road", "crossroads", "t-junction")

    # -- facilities ----------------------------------------------------------------------------

    def facilities(self, legs: tuple[Leg, ...]) -> Iterator[Facility]:
        roads, width = self.roads, self.knobs["crosswalk_width"]
        for leg in legs:
            road = leg.roads[0]
            beside = road.width("in") + BESIDE
            at, spec = roads.crosswalk(leg.name), roads.legs.get(leg.name)
            stop = 0.0
            if at is not None:
                yield Facility("Crosswalk", leg.name, at, width=width)
                stop = at + 0.5 * width + CROSSWALK_GAP
            if spec is None or not road.along("in"):
                continue
            if roads.signals != "none":
                yield Facility("TrafficLight", leg.name, stop, beside, governs=("in",))
            if roads.template == "roundabout":
                yield Facility("YieldSign", leg.name, stop, beside, governs=("in",))
            elif spec.sign:
                cls = "StopSign" if spec.sign == "stop" else "YieldSign"
                yield Facility(cls, leg.name, stop, beside, governs=("in",))
            if at is not None or roads.signals != "none" or spec.sign == "stop":
                yield Facility("StopLine", leg.name, stop, governs=("in",))


def phases_of(roads: RoadsSpec, headings: Mapping[str, float]) -> Iterator[Phase]:
    """Yield the phases of traffic lights: green, yellow and red, one group of legs after another.

    Args:
        roads: the scenario's, with the times of its lights.
        headings: of the legs that have lights, by name [deg]; opposite ones are green together.
    """
    if roads.signals == "none":
        return
    groups: list[list[str]] = []
    for name, heading in headings.items():
        for group in groups:
            turns = (heading - headings[other] for other in group)
            if all(abs(math.remainder(turn, 180.0)) < OPPOSITE for turn in turns):
                group.append(name)
                break
        else:
            groups.append([name])
    green, yellow, red = (_time(roads, name) for name in ("green", "yellow", "all_red"))
    for together in map(tuple, groups):
        name = "".join(together)
        yield Phase(f"{name}_green", green, green=together)
        yield Phase(f"{name}_yellow", yellow, yellow=together)
        if red > 0.0:
            yield Phase(f"{name}_clearing", red)


def _time(roads: RoadsSpec, name: str) -> float:
    value = roads.knobs[f"{name}_time"]
    assert not isinstance(value, str)  # `knob_problems` refuses it
    return value


def crossroads(values: Mapping[str, float]) -> Site:
    """Return the paper's crossroads: four equal legs at right angles, other measures as usual.

    Args:
        values: knobs of the template by name; others are ignored.
    """
    known = KNOBS["crossroads"]
    said = {name: float(value) for name, value in values.items() if name in known}
    return site_of(usual("crossroads", **said), {})
