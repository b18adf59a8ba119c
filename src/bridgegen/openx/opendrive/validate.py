"""What is wrong with a road network beyond its form: links, lanes and geometry that do not meet.

No schema and no single reader finds all of it: `carla.Map` loads most broken maps silently, and
no checker reports a junction whose id is also a road's, into which CARLA then finds no way.
"""

import math
from collections.abc import Iterable, Iterator
from itertools import pairwise

from bridgegen.openx.opendrive.geometry import pose
from bridgegen.openx.opendrive.lanes import lane_pose, section_end
from bridgegen.openx.opendrive.model import (
    CONTACTS,
    Connection,
    Junction,
    Lane,
    LaneSection,
    OpenDrive,
    Road,
)
from bridgegen.openx.opendrive.plan_view import Spiral

# --- Ids that occur twice or out of turn, and links to what does not exist ---


Owner = Road | Junction | Connection


def misnumbered(section: LaneSection) -> Iterator[str]:
    """Yield what is wrong with the lane ids of a section: each side counts from the centre."""
    for side, name, lanes in ((1, "left", section.left), (-1, "right", section.right)):
        ids = sorted((lane.id for lane in lanes), key=abs)
        if ids != [side * k for k in range(1, len(ids) + 1)]:
            yield f"lanes on the {name} must count from {side}, got {ids}"
    if [lane.id for lane in section.center] != [0]:
        got = ", ".join(str(lane.id) for lane in section.center) or "none"
        yield f"the center must be one lane 0, got {got}"


def broken_references(model: OpenDrive) -> Iterator[tuple[Owner, str]]:
    """Yield each broken reference: the record that makes it, and a sentence."""
    seen: set[tuple[str, str]] = set()
    for kind, records in (("road", model.roads), ("junction", model.junctions)):
        for record in records:
            if (kind, record.id) in seen:
                yield record, f"{kind} id must be unique, got '{record.id}' twice"
            seen.add((kind, record.id))
    for road in model.roads:
        if road.is_connecting and ("junction", road.junction) not in seen:
            yield road, f"road {road.id}: junction '{road.junction}' is not in the file"
        for end, link in (("predecessor", road.predecessor), ("successor", road.successor)):
            if link is None:
                continue
            if (link.element_type, link.element_id) not in seen:
                what = f"{link.element_type} '{link.element_id}'"
                yield road, f"road {road.id}: its {end}, {what}, is not in the file"
            elif link.element_type == "road" and link.contact_point is None:
                yield road, f"road {road.id}: its {end} is a road and needs a contactPoint"
    for junction in model.junctions:
        for connection in junction.connections:
            yield from _connection(model, junction, connection)


def _connection(
    model: OpenDrive, junction: Junction, connection: Connection
) -> Iterator[tuple[Owner, str]]:
    name = f"junction {junction.id}, connection {connection.id}"
    roads = model.roads_by_id
    incoming = roads.get(connection.incoming_road)
    key, road_id = "connectingRoad", connection.connecting_road
    if junction.is_direct:
        key, road_id = "linkedRoad", connection.linked_road
    if road_id is None or not connection.contact_point:
        missing = key if road_id is None else "contactPoint"
        yield connection, f"{name}: attribute {missing} is required"
        return
    connecting = roads.get(road_id)
    if incoming is None:
        yield connection, f"{name}: incomingRoad '{connection.incoming_road}' is not in the file"
    if connecting is None:
        problem = f"{name}: {key} '{road_id}' is not in the file"
        yield connection, problem
        return
    if junction.is_direct:
        if connection.contact_point not in connecting.ends_at(junction.id):
            contact = connection.contact_point
            yield (
                connection,
                f"{name}: the {contact} of road {road_id} has no link to this junction",
            )
    elif connecting.junction != junction.id:
        yield (
            connection,
            f"{name}: connectingRoad {connecting.id} must be of this junction, "
            f"got junction '{connecting.junction}'",
        )
    if incoming and not incoming.ends_at(junction.id):
        yield connection, f"{name}: incomingRoad {incoming.id} has no link to this junction"
    for link in connection.lane_links:
        if incoming and not any(
            incoming.section_at(contact).lane(link.from_lane)
            for contact in incoming.ends_at(junction.id)
        ):
            yield connection, f"{name}: road {incoming.id} has no lane {link.from_lane} there"
        if not connecting.section_at(connection.contact_point).lane(link.to_lane):
            yield connection, f"{name}: road {connecting.id} has no lane {link.to_lane} there"


GAP = 0.05
"""Largest gap between two ends that should meet [m]."""
KINK = 0.02
"""Largest jump of the heading between two ends that should meet [rad]."""
SLACK = 1e-3
"""Tolerance of s coordinates [m]."""


def problems(model: OpenDrive) -> list[str]:
    """Return what is wrong with a road network, one sentence each, with road, lane and value.

    Ids and references come first; where these are broken, nothing else is looked at.
    """
    # Everything below follows links, and would stumble over broken ones.
    broken = [sentence for _, sentence in broken_references(model)]
    broken += _collisions(model)
    if broken:
        return broken
    found: list[str] = []
    for road in model.roads:
        found += _reference_line(road)
        found += _sections(road)
        found += _along(road)
        found += _things(road)
    if not found:
        for road in model.roads:
            found += _ends(model, road)
        for junction in model.junctions:
            found += _junction(model, junction)
    found += _controllers(model)
    return found


def _collisions(model: OpenDrive) -> Iterator[str]:
    for junction in model.junctions:
        # No schema and none of ASAM's checks finds this one.
        if junction.id in model.roads_by_id:
            yield (
                f"a junction's id must differ from every road's, got '{junction.id}' for both "
                "(CARLA then finds no way into the junction)"
            )


# -- one road ------------------------------------------------------------------------------------


def _reference_line(road: Road) -> Iterator[str]:
    s = 0.0
    for index, geometry in enumerate(road.plan_view):
        if abs(geometry.s - s) > SLACK:
            yield f"road {road.id}: geometry {index} must start at {s:.6g} m, got {geometry.s:.6g}"
        s = geometry.s + geometry.length
        shape = geometry.shape
        # SUMO's netconvert takes 12 GB of memory on such a spiral; others divide by zero. It is
        # valid by the XSD, so no schema check finds it. Ours writes a line or an arc instead.
        if isinstance(shape, Spiral) and shape.curv_start == shape.curv_end:
            yield (
                f"road {road.id}: geometry {index}: a spiral's curvatures must differ, got "
                f"{shape.curv_start:g} for both (other readers divide by the difference)"
            )
    if abs(road.length - s) > SLACK:
        got = f"got {road.length:.6g}"
        yield f"road {road.id}: length must be that of its geometry, {s:.6g} m, {got}"
    for index, (item, following) in enumerate(pairwise(road.plan_view), start=1):
        end = pose(item, item.length)
        gap = math.dist(end[:2], (following.x, following.y))
        # `remainder`, because headings in files differ by whole turns.
        kink = abs(math.remainder(end.h - following.hdg, math.tau))
        if gap > GAP or kink > KINK:
            yield (
                f"road {road.id}: geometry {index} must begin where the one before ends, got a gap "
                f"of {gap:.3g} m and {kink:.3g} rad"
            )


def _sections(road: Road) -> Iterator[str]:
    starts = [section.s for section in road.sections]
    if starts[0] > SLACK:
        yield f"road {road.id}: the first laneSection must start at s=0 m, got {starts[0]:.6g}"
    for a, b in pairwise(starts):
        if b < a:
            yield f"road {road.id}: laneSections must be in order of s, got {b:.6g} after {a:.6g} m"
    if starts[-1] > road.length + SLACK:
        yield (
            f"road {road.id}: the laneSection at s={starts[-1]:.6g} m must start before the road's "
            f"end, {road.length:.6g} m"
        )
    for index, section in enumerate(road.sections):
        where = f"road {road.id}, laneSection at s={section.s:.6g} m"
        yield from (f"{where}: {problem}" for problem in misnumbered(section))
        length = section_end(road, index) - section.s
        for lane in section.lanes:
            yield from _widths(f"{where}, lane {lane.id}", lane, length)


def _widths(where: str, lane: Lane, length: float) -> Iterator[str]:
    if not lane.widths:
        if lane.drivable:
            yield f"{where}: a {lane.type} lane must have a width, got none"
        return
    if lane.widths[0].s > SLACK:
        yield f"{where}: the first width must start at sOffset=0 m, got {lane.widths[0].s:.6g}"
    ends = [width.s for width in lane.widths[1:]] + [length]
    for width, end in zip(lane.widths, ends, strict=True):
        if end < width.s:
            got = f"got sOffset={width.s:.6g} m"
            yield f"{where}: widths must be in order and within the section, {got}"
            continue
        least = _least((width.a, width.b, width.c, width.d), end - width.s)
        if least < -SLACK:
            yield f"{where}: width must be ≥ 0 m, got {least:.3g}"


def _least(cubic: tuple[float, float, float, float], end: float) -> float:
    """Return the smallest value of a cubic on [0, end]."""
    a, b, c, d = cubic
    # The least of a cubic on an interval is at an end or where its slope is 0; sampling would miss
    # a narrow dip.
    candidates = [0.0, end]
    if d:
        root = c * c - 3.0 * b * d
        if root >= 0.0:
            candidates += [(-c + sign * math.sqrt(root)) / (3.0 * d) for sign in (1.0, -1.0)]
    elif c:
        candidates.append(-b / (2.0 * c))
    return min(a + x * (b + x * (c + x * d)) for x in candidates if 0.0 <= x <= end)


def _along(road: Road) -> Iterator[str]:
    """Yield broken links between the lane sections of a road."""
    for section, following in pairwise(road.sections):
        for a, b, ahead in ((section, following, True), (following, section, False)):
            for lane in a.lanes:
                for target in lane.successors if ahead else lane.predecessors:
                    other = b.lane(target)
                    back = (
                        () if other is None else other.predecessors if ahead else other.successors
                    )
                    what = (
                        f"road {road.id}, laneSection at s={a.s:.6g} m, lane {lane.id}: its "
                        f"{'successor' if ahead else 'predecessor'} {target}"
                    )
                    if other is None:
                        yield f"{what} is not in the section at s={b.s:.6g} m"
                    # Only where somebody drives: elsewhere a one-sided link costs no way.
                    elif lane.id not in back and lane.drivable:
                        yield f"{what} must link back to it, got {list(back) or 'nothing'}"
                    elif road.direction(target) != road.direction(lane.id):
                        yield f"{what} runs the other way"


def _things(road: Road) -> Iterator[str]:
    """Yield objects and signals that are not on their road."""
    kinds: tuple[tuple[str, Iterable[tuple[str, float]]], ...] = (
        ("object", ((obj.id, obj.s) for obj in road.objects)),
        ("signal", ((signal.id, signal.s) for signal in road.signals)),
        ("signalReference", ((reference.id, reference.s) for reference in road.signal_references)),
    )
    for kind, things in kinds:
        for name, s in things:
            if s > road.length + SLACK:
                where = f"road {road.id}: {kind} {name}"
                yield f"{where} must have s ≤ {road.length:.6g} m, got {s:.6g}"


# -- where roads meet ----------------------------------------------------------------------------


def _ends(model: OpenDrive, road: Road) -> Iterator[str]:
    for contact in CONTACTS:
        link = road.link(contact)
        if link is None or link.element_type != "road":
            continue
        assert link.contact_point is not None  # checked by `broken_references`
        other = model.road(link.element_id)
        there = f"the {link.contact_point} of road {other.id}"
        what = f"road {road.id}: its {contact} is at {there}, which"
        back = other.link(link.contact_point)
        wanted = ("junction", road.junction) if road.is_connecting else ("road", road.id)
        got = (back.element_type, back.element_id) if back else ("nothing", "")
        if not other.is_connecting and got != wanted:
            yield f"{what} must link back to {' '.join(wanted)}, got {' '.join(got).strip()}"
            continue
        yield from _lanes_across(road, contact, other, link.contact_point)


def _lanes_across(road: Road, contact: str, other: Road, other_contact: str) -> Iterator[str]:
    section: LaneSection = road.section_at(contact)
    there = other.section_at(other_contact)
    for lane in section.lanes:
        if not lane.drivable:
            continue
        for target in lane.successors if contact == "end" else lane.predecessors:
            what = (
                f"road {road.id}, lane {lane.id}: lane {target} of road {other.id} at its {contact}"
            )
            if there.lane(target) is None:
                yield f"{what} is not there"
                continue
            leaves = (road.direction(lane.id) > 0) == (contact == "end")
            enters = (other.direction(target) > 0) == (other_contact == "start")
            if leaves != enters:
                yield f"{what} runs the other way"
                continue
            yield from _gap(what, road, lane.id, contact, other, target, other_contact)


def _gap(
    what: str, road: Road, lane_id: int, contact: str, other: Road, target: int, other_contact: str
) -> Iterator[str]:
    a = lane_pose(road, lane_id, 0.0 if contact == "start" else road.length)
    b = lane_pose(other, target, 0.0 if other_contact == "start" else other.length)
    gap, kink = math.dist(a[:2], b[:2]), abs(math.remainder(a.h - b.h, math.tau))
    if gap > GAP or kink > KINK:
        yield f"{what} must begin where it ends, got a gap of {gap:.3g} m and {kink:.3g} rad"


def _junction(model: OpenDrive, junction: Junction) -> Iterator[str]:
    served: set[tuple[str, int]] = set()
    entered: set[str] = set()
    for connection in junction.connections:
        yield from _connection_problems(model, junction, connection)
        entered.add(connection.entered_road)
        for each in connection.lane_links:
            served.add((connection.incoming_road, each.from_lane))
            if junction.is_direct:
                served.add((connection.entered_road, each.to_lane))
    for road in model.connecting_roads(junction.id):
        if road.id not in entered:
            yield f"junction {junction.id}: no connection leads into its road {road.id}"
    for road in model.roads:
        for contact in CONTACTS:
            link = road.link(contact)
            if link is None or (link.element_type, link.element_id) != ("junction", junction.id):
                continue
            for lane in road.section_at(contact).lanes:
                leaves = (road.direction(lane.id) > 0) == (contact == "end")
                if lane.type == "driving" and leaves and (road.id, lane.id) not in served:
                    yield f"junction {junction.id}: no way on for lane {lane.id} of road {road.id}"


def _connection_problems(
    model: OpenDrive, junction: Junction, connection: Connection
) -> Iterator[str]:
    name = f"junction {junction.id}, connection {connection.id}"
    incoming = model.road(connection.incoming_road)
    way = model.road(connection.entered_road)
    entry = connection.contact_point
    if not connection.lane_links:
        yield f"{name}: a laneLink is required, got none"
    if junction.is_direct:
        for each in connection.lane_links:
            what = (
                f"{name}: lane {each.to_lane} of road {way.id} beside lane {each.from_lane} of "
                f"road {incoming.id}"
            )
            contact = incoming.ends_at(junction.id)[0]
            yield from _gap(what, incoming, each.from_lane, contact, way, each.to_lane, entry)
        return
    link = way.link(entry)
    if link is None or (link.element_type, link.element_id) != ("road", incoming.id):
        got = f"{link.element_type} {link.element_id}" if link else "nothing"
        yield f"{name}: the {entry} of road {way.id} must link to road {incoming.id}, got {got}"
        return
    for each in connection.lane_links:
        contact = "end" if incoming.direction(each.from_lane) > 0 else "start"
        what = (
            f"{name}: lane {each.to_lane} of road {way.id} after lane {each.from_lane} of road "
            f"{incoming.id}"
        )
        if (
            incoming.section_at(contact).lane(each.from_lane) is None
            or link.contact_point != contact
        ):
            lane = f"lane {each.from_lane} of road {incoming.id}"
            yield f"{name}: {lane} does not lead into the junction"
        elif (way.direction(each.to_lane) > 0) != (entry == "start"):
            yield f"{what} runs the other way"
        else:
            yield from _gap(what, incoming, each.from_lane, contact, way, each.to_lane, entry)


def _controllers(model: OpenDrive) -> Iterator[str]:
    signals = {signal.id for road in model.roads for signal in road.signals}
    known = {controller.id for controller in model.controllers}
    for controller in model.controllers:
        for control in controller.controls:
            if control.signal_id not in signals:
                yield f"controller {controller.id}: signal '{control.signal_id}' is not in the file"
    for junction in model.junctions:
        for used in junction.controllers:
            if used.id not in known:
                yield f"junction {junction.id}: controller '{used.id}' is not in the file"
