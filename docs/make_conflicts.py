"""Draws docs/conflicts.svg: one small picture for each type of conflict, the ego in blue.

python docs/make_conflicts.py
"""

from math import cos, pi, sin
from pathlib import Path
from typing import NamedTuple

from bridgegen.assess.conflict.types import ConflictType

WIDTH, HEIGHT, COLUMNS = 210, 132, 5
EGO, OTHER, INK = "#1f6fb2", "#c45a2b", "#333333"


class Body(NamedTuple):
    """A box: centre [px], heading [degrees, counter-clockwise], length and width, arrow length."""

    x: float
    y: float
    heading: float
    arrow: float = 34.0
    length: float = 44.0
    width: float = 20.0
    turn: float = 0.0


def man(x: float, y: float, heading: float, arrow: float = 26.0) -> Body:
    """A pedestrian."""
    return Body(x, y, heading, arrow, 10.0, 10.0)


def line(y: float) -> Body:
    """A border of the lane, or the edge of the road."""
    return Body(105, y, 0, 0, 190, 3)


PICTURES: dict[ConflictType, tuple[Body, Body]] = {
    ConflictType.REAR_END_STRIKING: (Body(46, 56, 0, 40), Body(140, 56, 0, 14)),
    ConflictType.REAR_END_STRUCK: (Body(140, 56, 0, 14), Body(46, 56, 0, 40)),
    ConflictType.CROSSING: (Body(60, 40, 0, 36), Body(132, 76, 90, 28)),
    ConflictType.TURNING: (Body(60, 76, 25, 40, turn=60), Body(158, 50, 180, 34)),
    ConflictType.SIDE_SWIPE: (Body(84, 80, 0, 44), Body(88, 44, -18, 40)),
    ConflictType.HEAD_ON: (Body(44, 66, 0, 36), Body(166, 48, 180, 36)),
    ConflictType.EGO_STANDING: (Body(140, 56, 0, 0), Body(46, 56, 0, 40)),
    ConflictType.VRU_BY_FRONT: (Body(64, 44, 0, 32), man(130, 76, 90, 30)),
    ConflictType.VRU_INTO_SIDE: (Body(100, 40, 0, 40), man(96, 92, 90, 32)),
    ConflictType.OBJECT: (Body(60, 56, 0, 40), Body(150, 56, 0, 0, 14, 34)),
    ConflictType.LANE_DEPARTURE: (Body(88, 56, 18, 40), line(58)),
    ConflictType.ROAD_DEPARTURE: (Body(88, 62, -18, 40), line(66)),
    ConflictType.CLOSE_PASS: (Body(84, 50, 0, 44), Body(96, 70, 0, 26, 24, 8)),
    ConflictType.UNJUSTIFIED_BRAKING: (Body(112, 56, 0, 10), Body(48, 56, 0, 18)),
}


def drawn(body: Body, colour: str) -> str:
    """Return the SVG of a body and the arrow of its motion, which starts at its front."""
    angle = body.heading * pi / 180.0
    parts = [
        f'<rect x="{-body.length / 2:g}" y="{-body.width / 2:g}" width="{body.length:g}" '
        f'height="{body.width:g}" rx="3" fill="{colour}" '
        f'transform="translate({body.x:g} {body.y:g}) rotate({-body.heading:g})"/>'
    ]
    if body.arrow > 0.0:
        x = body.x + 0.5 * body.length * cos(angle)
        y = body.y - 0.5 * body.length * sin(angle)
        end = angle + body.turn * pi / 180.0
        tip_x = x + body.arrow * (cos(angle) + cos(end)) / 2.0
        tip_y = y - body.arrow * (sin(angle) + sin(end)) / 2.0
        bend_x, bend_y = x + 0.5 * body.arrow * cos(angle), y - 0.5 * body.arrow * sin(angle)
        parts.append(
            f'<path d="M{x:.1f} {y:.1f}Q{bend_x:.1f} {bend_y:.1f} {tip_x:.1f} {tip_y:.1f}" '
            f'stroke="{INK}" stroke-width="2" fill="none" marker-end="url(#tip)"/>'
        )
    return "".join(parts)


def picture() -> str:
    """Return the figure."""
    types = [one for one in ConflictType if one]
    rows = -(-len(types) // COLUMNS)
    cells = []
    for i, kind in enumerate(types):
        ego, other = PICTURES[kind]
        place = f"translate({i % COLUMNS * WIDTH} {i // COLUMNS * HEIGHT})"
        cells.append(
            f'<g transform="{place}">'
            f'<rect x="4" y="4" width="{WIDTH - 8}" height="{HEIGHT - 8}" rx="6" fill="#f4f4f1"/>'
            f"{drawn(other, OTHER)}{drawn(ego, EGO)}"
            f'<text x="{WIDTH / 2:g}" y="{HEIGHT - 14}" text-anchor="middle">{kind.label}</text>'
            "</g>"
        )
    body = "\n".join(cells)
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {COLUMNS * WIDTH} {rows * HEIGHT}" '
        f'font-family="sans-serif" font-size="13" fill="{INK}">\n'
        '<defs><marker id="tip" viewBox="0 0 8 8" refX="6" refY="4" markerWidth="6" '
        f'markerHeight="6" orient="auto"><path d="M0 0L8 4L0 8z" fill="{INK}"/></marker></defs>\n'
        f"{body}\n</svg>\n"
    )


if __name__ == "__main__":
    Path(__file__).with_name("conflicts.svg").write_text(picture(), encoding="utf-8")
