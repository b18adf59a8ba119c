"""A scenario as it is at a place of a map that has fewer lanes, or shorter legs, than its own."""

from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import replace

from bridgegen.base.errors import InputError
from bridgegen.openx.opendrive.furniture import Signal, SignalReference
from bridgegen.openx.opendrive.legs import governs, leads_to, signals_on
from bridgegen.openx.opendrive.merges import AFTER, MAIN
from bridgegen.openx.opendrive.model import OpenDrive, Road
from bridgegen.openx.opendrive.routes import plan_route
from bridgegen.openx.opendrive.to_owl.furniture import box_of, class_of, sign_of
from bridgegen.scenario.language.roads import RoadsSpec
from bridgegen.scenario.language.scenario import LogicalScenario
from bridgegen.scenario.language.story import (
    Action,
    Arrival,
    LaneChange,
    Participant,
    Story,
    Way,
    Waypoint,
)
from bridgegen.scenario.ontology.site import Facility, Leg, Site
from bridgegen.scenario.ontology.templates import phases_of

END_MARGIN = 1.0
"""Distance between the end of a shortened route and the end of its leg [m]."""


_BOTH_WAYS: tuple[tuple[str, Way], ...] = (("main", "in"), ("main", "out"))
_CARRIAGEWAY: tuple[tuple[str, Way], ...] = ((MAIN, "in"),)


def adapted(
    scenario: LogicalScenario, model: OpenDrive, site: Site
) -> tuple[LogicalScenario, list[str]]:
    """Return a scenario whose lanes and routes are those of a site, and a sentence per change.

    Who drives on a lane that is not there takes the outermost one, if nobody else is on it and
    nobody changes lane; a route ends on the lane that is reached, and where its leg ends.

    Args:
        scenario: what shall take place there.
        model: the road network.
        site: the place, with its legs named as the scenario's.
    """
    notes: list[str] = []
    lights = sum(facility.cls == "TrafficLight" for facility in site.facilities)
    if lights and scenario.roads.signals == "none":
        notes.append(
            f"the traffic lights of {site.where} ({lights}) are off: the scenario has none"
        )
    if site.kind in (None, "Merge"):
        scenario = _along(scenario, site, notes)
    participants = tuple(scenario.story.participants)
    if not any(isinstance(action, LaneChange) for action in _actions(scenario.story)):
        participants = tuple(_on_lanes(participants, site, notes))
    participants = tuple(_routed(participant, model, site, notes) for participant in participants)
    participants = tuple(_shortened(participant, site, notes) for participant in participants)
    if not notes:
        return scenario, notes
    story = replace(scenario.story, participants=participants)
    return replace(scenario, story=story), notes


def _along(scenario: LogicalScenario, site: Site, notes: list[str]) -> LogicalScenario:
    """Return a scenario of a road on one that has more lanes: they count from the outermost one.

    Who drives on the right does so there, and who stands beside the road stands beside them. At a
    merge the carriageway's lanes count so, before it and after it.
    """
    more: dict[tuple[str, Way], int] = {}
    for leg, way in _CARRIAGEWAY if site.kind == "Merge" else _BOTH_WAYS:
        own = scenario.roads.lanes(leg, way)
        there = len(_leg(site, leg).roads[0].along(way))
        if not isinstance(own, str) and there > own > 0:
            more[leg, way] = there - int(own)
            if site.kind == "Merge":
                more[AFTER, "out"] = there - int(own)
            counted = f"there are {there}, not {own:g}"
            notes.append(f"lanes {way} count from the outermost one: {counted}")
    if not more:
        return scenario

    def moved(place: Waypoint) -> Waypoint:
        if not isinstance(place.lane, int):
            return place
        return replace(place, lane=place.lane + more.get((place.leg, place.way), 0))

    return replace(scenario, story=_moved(scenario.story, moved))


def _leg(site: Site, name: str) -> Leg:
    leg = site.leg(name)
    assert leg is not None  # of a road and of a merge all are there
    return leg


def _moved(story: Story, moved: Callable[[Waypoint], Waypoint]) -> Story:
    """Return a story whose places are moved."""
    return replace(
        story,
        participants=tuple(
            replace(
                participant,
                start=moved(participant.start),
                end=None if participant.end is None else moved(participant.end),
                path=tuple(map(moved, participant.path)),
                change=tuple(map(moved, participant.change)),
            )
            for participant in story.participants
        ),
        jams=tuple(replace(jam, tail=moved(jam.tail)) for jam in story.jams),
        works=tuple(
            replace(
                work,
                start=moved(work.start),
                cones=tuple(map(moved, work.cones)),
                sign=moved(work.sign),
            )
            for work in story.works
        ),
        events=tuple(
            replace(
                event,
                actions=tuple(
                    replace(action, at=moved(action.at), place=moved(action.place))
                    if isinstance(action, Arrival)
                    else action
                    for action in event.actions
                ),
            )
            for event in story.events
        ),
    )


def _actions(story: Story) -> Iterator[Action]:
    for event in story.events:
        yield from event.actions


def _on_lanes(
    participants: tuple[Participant, ...], site: Site, notes: list[str]
) -> Iterator[Participant]:
    """Yield participants on lanes that are there, as long as each has one of its own."""
    starts = Counter(
        (participant.start.leg, participant.start.way, participant.start.lane)
        for participant in participants
    )
    for participant in participants:
        start, leg = participant.start, site.leg(participant.start.leg)
        lanes = len(leg.roads[0].along(start.way)) if leg is not None else 0
        if isinstance(start.lane, int) and not participant.path and start.lane > lanes > 0:
            outermost = (start.leg, start.way, lanes)
            if starts[outermost] == 0 and starts[start.leg, start.way, start.lane] == 1:
                starts[outermost] += 1
                notes.append(_said(f"{participant.name} starts", start, lanes))
                participant = replace(participant, start=replace(start, lane=lanes))
        yield participant


def _routed(
    participant: Participant, model: OpenDrive, site: Site, notes: list[str]
) -> Participant:
    """Return a participant whose route ends on the lane nearest to its own that it reaches."""
    start, end = participant.start, participant.end
    if end is None or participant.path or not isinstance(end.lane, int) or start.leg == end.leg:
        return participant
    leg, own = site.leg(end.leg), site.leg(start.leg)
    if leg is None or own is None or not isinstance(start.lane, int):
        return participant
    if start.lane > len(own.roads[0].along(start.way)):
        return participant
    wanted = end.lane
    lanes = range(1, len(leg.roads[0].along(end.way)) + 1)
    for lane in sorted(lanes, key=lambda lane: (abs(lane - wanted), lane)):
        there = replace(end, lane=lane)
        if has_way(model, site, start, there):
            if lane != wanted:
                notes.append(_said(f"the route of {participant.name} ends", end, lane))
            return replace(participant, end=there)
    return participant


def _said(what: str, place: Waypoint, lane: int) -> str:
    return f"{what} on lane {lane} of leg {place.leg} instead of lane {place.lane}"


def has_way(model: OpenDrive, site: Site, start: Waypoint, end: Waypoint) -> bool:
    """Return whether lanes lead from one place of a site to another."""
    try:
        plan_route(model, _on_lane(site, start), (), _on_lane(site, end))
    except InputError:
        return False
    return True


def _on_lane(site: Site, place: Waypoint) -> tuple[str, int, float]:
    """Return a lane of the road that touches the junction, halfway along that road."""
    leg = site.leg(place.leg)
    assert leg is not None  # `_missing` says so
    assert isinstance(place.lane, int)
    road = leg.roads[0]
    return road.road_id, road.along(place.way)[place.lane - 1].lane_id, 0.5 * road.length


def _shortened(participant: Participant, site: Site, notes: list[str]) -> Participant:
    """Return a participant whose route ends on the leg of a site."""
    end = participant.end
    leg = site.leg(end.leg) if end is not None else None
    if end is None or leg is None or isinstance(end.distance, str):
        return participant
    last = max(leg.length - END_MARGIN, 0.5 * leg.length)
    if end.distance <= last:
        return participant
    notes.append(
        f"the route of {participant.name} ends {last:.4g} m along leg {leg.name} instead of "
        f"{end.distance:g} m: the leg has {leg.length:.4g} m"
    )
    return replace(participant, end=replace(end, distance=last))


# --- What stands and lies at a place of a map: crosswalks, stop lines, signs and traffic lights ---
# It becomes part of a scenario that takes place there. A map says which lights there are and whom
# they are for, but not when they change: their phases are the scenario's. Where the scenario has no
# lights, those of the map are off.


NEAR = 40.0
"""Distance before a junction within which a light or a sign is for that junction [m]."""


def furnished(model: OpenDrive, site: Site, roads: RoadsSpec) -> Site:
    """Return a place of a map with what stands and lies there.

    Args:
        model: the road network.
        site: a junction, or a stretch of road.
        roads: of the scenario that takes place there.
    """
    found = [facility for leg in site.legs for facility in _on_leg(model, leg)]
    if site.kind is not None:
        lights = [light for leg in site.legs for light in _lights(model, site, leg)]
        found += lights
        if lights and roads.signals != "none":
            lit = {light.leg for light in lights}
            offset = roads.knobs["signal_offset"]
            assert not isinstance(offset, str)  # `knob_problems` refuses it
            headings = {leg.name: leg.heading_deg for leg in site.legs if leg.name in lit}
            phases = tuple(phases_of(roads, headings))
            site = replace(site, phases=phases, signal_offset=offset)
    return replace(site, facilities=tuple(_numbered(found)))


def _numbered(found: list[Facility]) -> Iterator[Facility]:
    """Yield facilities that are told apart by a number where a leg has several of a class."""
    seen: dict[tuple[str, str], int] = {}
    for facility in found:
        seen[facility.cls, facility.leg] = number = seen.get((facility.cls, facility.leg), 0) + 1
        yield replace(facility, number=number)


def _on_leg(model: OpenDrive, leg: Leg) -> Iterator[Facility]:
    """Yield the crosswalks, stop lines and signs on the first road of a leg."""
    arm = leg.roads[0]
    road = model.road(arm.road_id)
    for item in road.objects:
        cls, (low, high, _, _) = class_of(item), box_of(item)
        at = arm.distance(item.s)
        if at is None or cls not in ("Crosswalk", "StopLine"):
            continue
        if cls == "Crosswalk" and high > low:
            yield Facility(cls, leg.name, at, width=high - low, object_id=item.id, s=item.s)
        elif cls == "StopLine":
            yield Facility(cls, leg.name, at, governs=("in",), object_id=item.id, s=item.s)
    for signal in road.signals:
        cls, limit = sign_of(signal)
        at = arm.distance(signal.s)
        if at is None or cls in ("TrafficLight", "Signage", "ConstructionCard"):
            continue
        if _is_for(road, signal, [lane.lane_id for lane in arm.along("in")]):
            yield Facility(
                cls,
                leg.name,
                at,
                None if cls == "StopLine" else signal.t,
                governs=("in",),
                speed_limit=limit,
                object_id=signal.id,
                s=signal.s,
            )


def _lights(model: OpenDrive, site: Site, leg: Leg) -> Iterator[Facility]:
    """Yield the traffic lights for the traffic that comes along a leg, each signal once.

    They stand on the leg, or on the junction's roads that lead from it.
    """
    dynamic = {
        signal.id: signal
        for road in model.roads
        for signal in road.signals
        if signal.dynamic == "yes"
    }
    arm = leg.roads[0]
    road = model.road(arm.road_id)
    inbound = [lane.lane_id for lane in arm.along("in")]
    seen: set[str] = set()
    for signal in signals_on(road):
        at = arm.distance(signal.s)
        if signal.id not in dynamic or signal.id in seen or at is None or at > NEAR:
            continue
        if _is_for(road, signal, inbound):
            seen.add(signal.id)
            yield Facility(
                "TrafficLight", leg.name, at, governs=("in",), object_id=signal.id, s=signal.s
            )
    within = site.place_id.split("+") if site.kind != "Merge" else ()
    for inside in (road for name in within for road in model.connecting_roads(name)):
        for signal in signals_on(inside):
            if (
                signal.id in dynamic
                and signal.id not in seen
                and _comes_from(inside, signal, road.id)
            ):
                seen.add(signal.id)
                edge = arm.near
                yield Facility(
                    "TrafficLight", leg.name, 0.0, governs=("in",), object_id=signal.id, s=edge
                )


def _is_for(road: Road, signal: Signal | SignalReference, lanes: list[int]) -> bool:
    return any(governs(road, signal, lane) for lane in lanes)


def _comes_from(inside: Road, signal: Signal | SignalReference, road_id: str) -> bool:
    """Return whether a signal on a connecting road is for lanes that a road leads to."""
    for lane in inside.sections[0].lanes:
        if lane.drivable and governs(inside, signal, lane.id):
            entry = "end" if leads_to(inside, lane, "start") else "start"
            link = inside.link(entry)
            if link is not None and link.element_type == "road" and link.element_id == road_id:
                return True
    return False
