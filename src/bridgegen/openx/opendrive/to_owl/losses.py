"""Contents of a map that its individuals lack: they stay in the map's own file, which they name."""

from collections import Counter
from collections.abc import Iterator

from bridgegen.openx.opendrive.model import OpenDrive
from bridgegen.openx.opendrive.plan_view import ParamPoly3, Poly3
from bridgegen.openx.opendrive.to_owl.furniture import class_of
from bridgegen.scenario.ontology.vocabulary import tbox


def losses(model: OpenDrive) -> Iterator[str]:
    """Yield a sentence for each kind of content of a map that its individuals lack in part.

    Left out of every import, and not reported here: elevations but an even grade, lateral profiles,
    lane offsets, widths but at the start and the middle of a lane section, where along a lane its
    lines begin, the shapes and heights of objects, and lane speed limits.

    Args:
        model: the road network.
    """
    known = {
        name: frozenset(tbox().allowed[name]) for name in ("has_road_type", "has_marking_type")
    }
    curves = sum(
        isinstance(one.shape, Poly3 | ParamPoly3) for road in model.roads for one in road.plan_view
    )
    if curves:
        yield (
            f"{curves} stretches of reference line are cubics: their lengths and their curvatures "
            "at both ends are kept, their course between is not"
        )
    objects = Counter(
        one.type or "none" for road in model.roads for one in road.objects if class_of(one) is None
    )
    if objects:
        listed = ", ".join(f"{kind} ({count})" for kind, count in sorted(objects.items()))
        yield f"objects that the ontology has no class for are left out: {listed}"
    several = sum(len({(one.type, one.speed) for one in road.types}) > 1 for road in model.roads)
    if several:
        yield f"{several} roads change their type or speed limit: the first is kept"
    lines = Counter(
        mark.type
        for road in model.roads
        for section in road.sections
        for lane in (*section.center, *section.lanes)
        for mark in lane.road_marks
        if mark.type not in known["has_marking_type"]
    )
    if lines:
        listed = ", ".join(f"{kind} ({count})" for kind, count in sorted(lines.items()))
        yield f"lines of unknown kinds are left out: {listed}"
    types = sorted(
        {one.type for road in model.roads for one in road.types} - known["has_road_type"]
    )
    if types:
        yield f"road types that the standard does not have are left out: {', '.join(types)}"
