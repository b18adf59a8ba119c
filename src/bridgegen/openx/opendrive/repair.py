"""Repairs of a road network as it is read: what a file means where its form is not as it should be.

A repair never invents a way to drive: a link that leads nowhere is left out, a border becomes a
width, a number that is missing in the count of lanes becomes a lane of no width.
"""

from collections.abc import Sequence
from dataclasses import replace

from bridgegen.openx.opendrive.lanes import rebased, section_end
from bridgegen.openx.opendrive.model import (
    Lane,
    LaneSection,
    OpenDrive,
    Road,
    Width,
)
from bridgegen.openx.opendrive.notes import Notes
from bridgegen.openx.opendrive.plan_view import Cubic
from bridgegen.openx.opendrive.repair_links import Lines, repair_links

__all__ = ["Lines", "Notes", "repair", "repair_section"]

MISSING_LANES = 10
"""Largest number of missing lane numbers in a section that are filled in."""

SLACK = 1e-3
"""Tolerance of lengths [m]."""


def repair(model: OpenDrive, lines: Lines, notes: Notes) -> OpenDrive:
    """Return a road network with its reference lines, widths and links repaired.

    Args:
        model: as it was read.
        lines: where its roads, junctions and connections stand; those of repaired ones are added.
        notes: takes a sentence for each repair.
    """
    roads = []
    for road in model.roads:
        line = lines[id(road)]
        repaired = _widths(_reference_line(road, line, notes), line, notes)
        lines[id(repaired)] = line
        roads.append(repaired)
    return repair_links(replace(model, roads=tuple(roads)), lines, notes)


# -- the reference line ----------------------------------------------------------------------------


def _reference_line(road: Road, line: int, notes: Notes) -> Road:
    pieces = tuple(geometry for geometry in road.plan_view if geometry.length > 0.0)
    if len(pieces) < len(road.plan_view):
        notes.add("no length", line, f"road {road.id}: a geometry of length 0 m is left out")
        road = replace(road, plan_view=pieces)
    end = pieces[-1].s + pieces[-1].length
    # Only a geometry that is too short is made the road's length. Continuing it instead would
    # invent road that nobody drew.
    if end < road.length - SLACK and road.sections[-1].s < end:
        notes.add(
            "short",
            line,
            f"road {road.id}: its length is {road.length:.6g} m, but its geometry ends at "
            f"{end:.6g} m: read as {end:.6g} m long",
        )
        road = replace(road, length=end)
    return road


# -- lanes -----------------------------------------------------------------------------------------


def _widths(road: Road, line: int, notes: Notes) -> Road:
    """Leave out the widths that begin beyond their lane section."""
    sections = []
    for index, section in enumerate(road.sections):
        length = section_end(road, index) - section.s
        sides = []
        for side in (section.left, section.right):
            kept = []
            for lane in side:
                within = tuple(
                    width for width in lane.widths if width.s <= max(length, 0.0) + SLACK
                )
                if len(within) < len(lane.widths):
                    beyond = lane.widths[-1].s
                    notes.add(
                        "beyond",
                        line,
                        f"road {road.id}, laneSection at s={section.s:.6g} m, lane {lane.id}: the "
                        f"width at sOffset={beyond:.6g} m begins beyond the section, which is "
                        f"{length:.6g} m long, and is left out",
                    )
                    lane = replace(lane, widths=within)
                kept.append(lane)
            sides.append(tuple(kept))
        if sides != [section.left, section.right]:
            section = replace(section, left=sides[0], right=sides[1])
        sections.append(section)
    return replace(road, sections=tuple(sections)) if tuple(sections) != road.sections else road


def repair_section(section: LaneSection, line: int, where: str, notes: Notes) -> LaneSection:
    """Return a lane section with widths instead of borders, and no gaps in the count of lanes.

    Args:
        section: as it was read.
        line: where it stands.
        where: what to call it.
        notes: takes a sentence for each repair.
    """
    left = _counted(section.left, 1, line, where, notes)
    right = _counted(section.right, -1, line, where, notes)
    for side in (left, right):
        if any(lane.borders for lane in side):
            notes.add("border", line, f"{where}: borders of lanes are read as widths")
            break
    left, right = _from_borders(left, 1.0), _from_borders(right, -1.0)
    if (left, right) == (section.left, section.right):
        return section
    return replace(section, left=left, right=right)


def _counted(
    lanes: tuple[Lane, ...], side: int, line: int, where: str, notes: Notes
) -> tuple[Lane, ...]:
    """Return the lanes of a side with a lane of no width for each number that is missing."""
    ids = {lane.id for lane in lanes}
    if len(ids) < len(lanes) or any(number * side <= 0 for number in ids):
        return lanes  # not a matter of counting: the reader says so
    missing = [side * k for k in range(1, max(map(abs, ids), default=0)) if side * k not in ids]
    if not missing or len(missing) > MISSING_LANES:
        return lanes
    notes.add(
        "count",
        line,
        f"{where}: its lanes must count from {side} without a gap, got "
        f"{sorted(ids, key=abs)}: read with lanes of no width in the gaps",
    )
    # A lane of no width and type none moves no border and can be driven by nobody: the numbers
    # count without a gap, and the road is as it was drawn.
    none = (Width(0.0, 0.0, 0.0, 0.0, 0.0),)
    filled = [*lanes, *(Lane(number, "none", widths=none) for number in missing)]
    return tuple(sorted(filled, key=lambda lane: -lane.id))


def _from_borders(lanes: tuple[Lane, ...], side: float) -> tuple[Lane, ...]:
    """Return the lanes of a side with widths where they had borders; a width comes first."""
    if not any(lane.borders for lane in lanes):
        return lanes
    made: dict[int, Lane] = {}
    # From the inside out, for a width is the difference of two borders. Cubics with different
    # starts are first brought to common ones (`_sum`), so that the difference is exact.
    inner: tuple[Cubic, ...] = ()  # |t| of the border so far
    for lane in sorted(lanes, key=lambda item: abs(item.id)):
        if lane.borders and not lane.widths:
            outer: tuple[Cubic, ...] = tuple(
                Width(border.s, side * border.a, side * border.b, side * border.c, side * border.d)
                for border in lane.borders
            )
            made[lane.id] = replace(lane, widths=_sum(outer, inner, -1.0), borders=())
            inner = outer
        else:
            made[lane.id] = replace(lane, borders=())
            inner = _sum(inner, lane.widths, 1.0)
    return tuple(made[lane.id] for lane in lanes)


def _sum(group: Sequence[Cubic], other: Sequence[Cubic], share: float) -> tuple[Width, ...]:
    """Return the sum of two lists of cubics, the second times ``share``."""
    starts = sorted({each.s for each in (*group, *other)})
    found = []
    for s in starts:
        both = zip(rebased(group, s, s), rebased(other, s, s), strict=True)
        found.append(Width(s, *(x + share * y for x, y in both)))
    return tuple(found)
