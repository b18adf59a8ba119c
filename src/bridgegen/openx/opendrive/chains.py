"""The roads of a leg of a scenario, on a map: as long as the same lanes lead on.

A leg begins at an end of a road or where its lanes change along it, and counts its distances from
there.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from bridgegen.base.arrays import Float
from bridgegen.openx.opendrive.geometry import reference_line
from bridgegen.openx.opendrive.lanes import section_end, values
from bridgegen.openx.opendrive.legs import leads_to
from bridgegen.openx.opendrive.model import LaneSection, OpenDrive, Road
from bridgegen.scenario.ontology.site import ArmRoad, Direction, JunctionEnd, LaneType, SiteLane
from bridgegen.scenario.weather import ROAD_TYPES

_STRIPS: dict[str, LaneType] = {
    "shoulder": "shoulder",
    "stop": "shoulder",
    "parking": "shoulder",
    "sidewalk": "sidewalk",
}
"""Types that lanes beside the driving lanes have in a scenario, by OpenDRIVE's type."""

_STEP = 2.0  # m, between places at which curvatures and widths are looked at


@dataclass(frozen=True, slots=True)
class Run:
    """Lane sections of a road, one after the other, with the same driving lanes.

    Attributes:
        road: the road.
        sections: the first and the last, in the order of the road.
        ids: of the driving lanes.
    """

    road: Road
    sections: tuple[int, int]
    ids: tuple[int, ...]

    @property
    def low(self) -> float:
        """Where it begins along the road [m]."""
        return self.road.sections[self.sections[0]].s

    @property
    def high(self) -> float:
        """Where it ends along the road [m]."""
        return section_end(self.road, self.sections[1])

    def reaches(self, end: str) -> bool:
        """Return whether it comes up to an end of its road, "start" or "end"."""
        first, last = self.sections
        return first == 0 if end == "start" else last == len(self.road.sections) - 1


def runs(road: Road) -> list[Run]:
    """Return the parts of a road along which its driving lanes stay the same, in its order."""
    found: list[Run] = []
    for index, section in enumerate(road.sections):
        ids = tuple(lane.id for lane in section.lanes if lane.drivable)
        if found and found[-1].ids == ids and _leads_on(road.sections[index - 1], section, ids):
            found[-1] = Run(road, (found[-1].sections[0], index), ids)
        else:
            found.append(Run(road, (index, index), ids))
    return [run for run in found if run.ids]


def _leads_on(section: LaneSection, following: LaneSection, ids: tuple[int, ...]) -> bool:
    """Return whether lanes of one section are those of the next: each by itself."""
    pairs = [(section.lane(number), following.lane(number)) for number in ids]
    return all(
        lane is not None
        and onward is not None
        and lane.successors == (lane.id,)
        and onward.predecessors == (onward.id,)
        for lane, onward in pairs
    )


def chain(model: OpenDrive, run: Run, end: str, *, meets: bool = True) -> Iterator[ArmRoad]:
    """Yield the roads of a leg, away from where it begins.

    Args:
        model: the road network.
        run: the part of a road that it begins with.
        end: the end of the run that it begins at: "start" or "end".
        meets: whether it begins at a junction.
    """
    lanes = [lane for lane in run.road.sections[run.sections[0]].lanes if lane.id in run.ids]
    inbound = {lane.id for lane in lanes if leads_to(run.road, lane, end)}
    seen: set[str] = set()
    while True:
        seen.add(run.road.id)
        yield _arm_road(run, end, inbound, meets)
        following = _continuation(model, run, end)
        if following is None or following[0].road.id in seen:
            return
        run, end, mapped = following
        inbound = {mapped[lane_id] for lane_id in inbound}


def _arm_road(run: Run, end: str, inbound: set[int], meets: bool) -> ArmRoad:
    road = run.road
    near = run.low if end == "start" else run.high
    s = np.linspace(run.low, run.high, 2 + int((run.high - run.low) / _STEP))
    widths, bends = _widths(run, s), np.abs(reference_line(road, s).curvature)
    at = 0 if end == "start" else -1
    lanes = [
        SiteLane(
            lane_id,
            "in" if lane_id in inbound else "out",
            float(widths[lane_id][at] if meets else widths[lane_id].min()),
        )
        for lane_id in sorted(run.ids, key=lambda number: (number not in inbound, abs(number)))
    ]
    sides: dict[bool, Direction] = {lane.lane_id > 0: lane.direction for lane in lanes}
    speeds = [kind.speed for kind in road.types if kind.speed is not None]
    kinds = [kind.type for kind in road.types if kind.type in ROAD_TYPES]
    touches: JunctionEnd = "start" if end == "start" else "end"
    return ArmRoad(
        road_id=road.id,
        length=run.high - run.low,
        junction_end="none" if end == "start" and not meets else touches,
        lanes=(*lanes, *_strips(run, widths, sides)),
        speed_limit=speeds[0].metres_per_second if speeds else None,
        road_type=kinds[0] if kinds else None,
        station=None if near == (0.0 if end == "start" else road.length) else near,
        bends=tuple((bends if end == "start" else bends[::-1]).tolist()),
    )


def _widths(run: Run, s: Float) -> dict[int, Float]:
    """Return how wide all lanes of a run's sections are at places along the road [m]."""
    found: dict[int, Float] = {}
    for index in range(run.sections[0], run.sections[1] + 1):
        low, high = run.road.sections[index].s, section_end(run.road, index)
        here = (s >= low) & ((s <= high) if index == run.sections[1] else (s < high))
        at = np.minimum(s[here], np.nextafter(high, low)) - low
        for lane in run.road.sections[index].lanes:
            found.setdefault(lane.id, np.zeros(len(s)))[here] = values(lane.widths, at)
    return found


def _strips(run: Run, widths: dict[int, Float], sides: dict[bool, Direction]) -> Iterator[SiteLane]:
    """Yield what lies beside the driving lanes all along a run, the nearest of each kind."""
    first, last = run.sections
    sections = run.road.sections[first : last + 1]
    for is_left, direction in sides.items():
        outermost = max(abs(number) for number in run.ids if (number > 0) == is_left)
        seen: set[LaneType] = set()
        for lane in sorted(sections[0].lanes, key=lambda item: abs(item.id)):
            kind = _STRIPS.get(lane.type)
            if kind is None or kind in seen or (lane.id > 0) != is_left:
                continue
            same = [section.lane(lane.id) for section in sections]
            width = float(widths[lane.id].min())
            goes_on = all(item is not None and item.type == lane.type for item in same)
            if abs(lane.id) > outermost and goes_on and width > 0.0:
                seen.add(kind)
                yield SiteLane(lane.id, direction, width, kind)


def _continuation(model: OpenDrive, run: Run, end: str) -> tuple[Run, str, dict[int, int]] | None:
    """Return the run that continues from the far end: it, its nearer end, its lane per lane.

    None if there is none, or if not every lane continues.
    """
    far = "end" if end == "start" else "start"
    link = run.road.link(far)
    if not run.reaches(far) or link is None or link.element_type != "road":
        return None
    if link.contact_point is None or model.road(link.element_id).is_connecting:
        return None
    onward = model.road(link.element_id)
    mapped: dict[int, int] = {}
    for lane_id in run.ids:
        lane = run.road.section_at(far).lane(lane_id)
        links = () if lane is None else lane.successors if far == "end" else lane.predecessors
        if len(links) != 1:
            return None
        mapped[lane_id] = links[0]
    following = run_at(onward, link.contact_point)
    if following is None or set(mapped.values()) != set(following.ids):
        return None
    return following, link.contact_point, mapped


def run_at(road: Road, end: str) -> Run | None:
    """Return the part of a road that touches its "start" or "end"; None without driving lanes."""
    return next((run for run in runs(road) if run.reaches(end)), None)
