"""OpenSCENARIO2OWL, its legs: the intersection that a scenario takes place at, on a whole map.

A map as a whole has no middle: a road between two intersections is a leg of both. A scenario has
one, the intersection that the ego's route crosses, and distances count from there, along a road and
those that continue it. So positions come back as the distances that they were.
"""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass

import pyoxigraph as ox

from bridgegen.openx.opendrive.model import Junction, OpenDrive, Road
from bridgegen.scenario.ontology.vocabulary import bg


@dataclass(frozen=True)
class Stretch:
    """A road of a leg.

    Attributes:
        near: the end from which distances count; ``both`` and ``none`` mean its start.
        before: how far that is from the leg's beginning [m].
        inner: the id of the road that it continues, if any.
    """

    near: str
    before: float = 0.0
    inner: str | None = None


def stretches(roads: OpenDrive, ends: set[str]) -> dict[str, Stretch]:
    """Return the legs' roads, by their ids; none where no one intersection is between two roads.

    Args:
        roads: the map.
        ends: ids of the roads on which the ego starts, and on which its route ends.
    """
    if len(ends) != 2:
        return {}
    legs = [_legs_of(roads, junction) for junction in roads.junctions]
    found = [leg for leg in legs if ends <= leg.keys()]
    return found[0] if len(found) == 1 else {}


def with_legs(
    legs: Mapping[str, Stretch], nodes: Mapping[str, ox.NamedNode], quads: Iterable[ox.Quad]
) -> Iterator[ox.Quad]:
    """Yield the statements of a map, with the legs' nearer ends and continuations.

    Args:
        legs: roads of the legs, by their ids.
        nodes: these roads' individuals.
        quads: of the map, as a whole.
    """
    end, here = bg("has_junction_end"), set(nodes.values())
    yield from (quad for quad in quads if quad.predicate != end or quad.subject not in here)
    for road_id, leg in legs.items():
        yield ox.Quad(nodes[road_id], end, ox.Literal(leg.near))
        if leg.inner is not None:
            yield ox.Quad(nodes[leg.inner], bg("has_continuation"), nodes[road_id])


def _legs_of(roads: OpenDrive, junction: Junction) -> dict[str, Stretch]:
    """Return the roads that lead to a junction, each one once, by their ids."""
    found: dict[str, Stretch] = {}
    for road in roads.roads:
        ends = [] if road.is_connecting else road.ends_at(junction.id)
        if len(ends) == 1 and road.id not in found:
            for item, stretch in _chain(roads, road, ends[0]):
                if item.id in found:
                    break
                found[item.id] = stretch
    return found


def _chain(roads: OpenDrive, road: Road, near: str) -> Iterator[tuple[Road, Stretch]]:
    """Yield a road and those that continue it the same way round, away from its near end."""
    seen: set[str] = set()
    before, inner = 0.0, None
    while road.id not in seen:
        seen.add(road.id)
        yield road, Stretch(near, before, inner)
        link = road.link("end" if near == "start" else "start")
        if link is None or link.element_type != "road" or link.contact_point != near:
            return
        before += float(road.length)
        inner, onward = road.id, roads.roads_by_id.get(link.element_id)
        if onward is None or onward.is_connecting:
            return
        if len(road.sections) > 1 or len(onward.sections) > 1:
            return
        road = onward
