"""Ids that occur twice or out of turn, and links to what is not there: what no reader gets over."""

from collections.abc import Iterator

from bridgegen.openx.opendrive.model import (
    Connection,
    Junction,
    LaneSection,
    OpenDrive,
    Road,
)

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
