"""What the individuals of a map are called: kind and ids, kept apart by colons."""

from urllib.parse import quote


def part_name(kind: str, *parts: str | int) -> str:
    """Return the name of a part of a map; ids are rid of colons."""
    return ":".join((kind, *(quote(str(part), safe="") for part in parts)))


def road_name(road_id: str) -> str:
    """Return the name of a road."""
    return part_name("road", road_id)


def junction_name(junction_id: str) -> str:
    """Return the name of a junction."""
    return part_name("junction", junction_id)


def lane_name(road_id: str, section: int, lane_id: int) -> str:
    """Return the name of a lane of the ``section``-th lane section, or of a strip."""
    return part_name("lane", road_id, section, lane_id)
