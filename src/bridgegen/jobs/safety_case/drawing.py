"""A layout as SVG, in the shapes of the notation; colours are the page's."""

from html import escape
from itertools import pairwise

from bridgegen.jobs.safety_case.layout import BADGE, LINE, PAD, Box, Edge, Layout

SLANT = 12.0
"""By how much a strategy's sides lean [pixels]."""

_CLASS = {
    "supported": "ok",
    "not supported": "bad",
    "incomplete": "open",
    "undeveloped": "open",
    "": "",
}


def drawing(found: Layout, label: str) -> str:
    """Return an inline SVG.

    Args:
        found: what is drawn.
        label: of the whole, for people who do not see it.
    """
    parts = [
        f'<svg class="gsn" role="img" aria-label="{escape(label)}" width="{found.width + 4:.0f}" '
        f'height="{found.height + 4:.0f}" viewBox="-2 -2 {found.width + 4:.0f} '
        f'{found.height + 4:.0f}">',
        *map(_edge, found.edges),
        *map(_element, found.boxes),
        "</svg>",
    ]
    return "".join(parts)


def _edge(edge: Edge) -> str:
    line = " ".join(f"{x:.1f},{y:.1f}" for x, y in edge.points)
    (x0, y0), (x, y) = next(
        pair for pair in reversed([*pairwise(edge.points)]) if pair[0] != pair[1]
    )
    dx, dy = (x > x0) - (x < x0), (y > y0) - (y < y0)
    back = [(x - 9 * dx - 4 * dy, y - 9 * dy - 4 * dx), (x - 9 * dx + 4 * dy, y - 9 * dy + 4 * dx)]
    tip = " ".join(f"{a:.1f},{b:.1f}" for a, b in (back[0], (x, y), back[1]))
    kind = edge.kind.lower()
    return f'<polyline class="{kind}" points="{line}"/><polygon class="tip {kind}" points="{tip}"/>'


def _element(box: Box) -> str:
    one = box.element
    kind = one.kind.removeprefix("Counter").lower()
    counter = " counter" if one.kind.startswith("Counter") else ""
    words = f"{one.id}: {one.statement.text}" + (f" ({one.status})" if one.status else "")
    return (
        f'<a href="#{escape(one.id)}" class="{kind}{counter} {_CLASS[one.status]}">'
        f"<title>{escape(words)}</title>{_shape(box)}{_text(box)}{_marks(box)}</a>"
    )


def _shape(box: Box) -> str:
    x, y, w, h = box.x, box.y, box.width, box.height
    kind = box.element.kind
    if box.badge:
        r = 0.5 * BADGE - 2.0
        cx, cy = x + 0.5 * BADGE, y + 0.5 * BADGE
        if kind in ("Solution", "CounterSolution"):
            return f'<circle class="shape" cx="{cx:.1f}" cy="{cy:.1f}" r="{r:.1f}"/>'
        letter = kind[0]
        return (
            f'<ellipse class="shape" cx="{cx:.1f}" cy="{cy:.1f}" rx="{r:.1f}" ry="{0.7 * r:.1f}"/>'
            f'<text class="letter" x="{cx + r - 6:.1f}" y="{cy + 0.7 * r + 7:.1f}">{letter}</text>'
        )
    if kind == "Strategy":
        corners = ((x + SLANT, y), (x + w, y), (x + w - SLANT, y + h), (x, y + h))
        points = " ".join(f"{a:.1f},{b:.1f}" for a, b in corners)
        return f'<polygon class="shape" points="{points}"/>'
    rounded = ' rx="16"' if kind == "Context" else ""
    return (
        f'<rect class="shape" x="{x:.1f}" y="{y:.1f}" width="{w:.1f}" height="{h:.1f}"{rounded}/>'
    )


def _text(box: Box) -> str:
    one = box.element
    if box.badge:
        x, y = box.x + BADGE + 4.0, box.y + 13.0
        middle, height = box.x + 0.5 * BADGE, box.y + 0.5 * BADGE
        letters = one.id.rstrip("0123456789.")
        name = "".join(
            f'<text class="badge" x="{middle:.1f}" y="{height + drop:.1f}">{escape(part)}</text>'
            for part, drop in ((letters, -1.5), (one.id.removeprefix(letters), 9.0))
        )
    else:
        x = box.x + PAD + (SLANT if one.kind == "Strategy" else 0.0)
        y = box.y + PAD + 10.0
        word = f' <tspan class="status">{one.status}</tspan>' if one.status else ""
        name = f'<text class="id" x="{x:.1f}" y="{y:.1f}">{escape(one.id)}{word}</text>'
        y += LINE
    lines = "".join(
        f'<tspan x="{x:.1f}" y="{y + k * LINE:.1f}">{escape(line)}</tspan>'
        for k, line in enumerate(box.lines)
    )
    return f"{name}<text>{lines}</text>"


def _marks(box: Box) -> str:
    """Return the diamond of an undeveloped goal, and the cross of a defeated one."""
    x, y, one = box.x + 0.5 * box.width, box.bottom, box.element
    marks = ""
    if one.undeveloped:
        corners = ((x, y), (x + 9, y + 9), (x, y + 18), (x - 9, y + 9))
        points = " ".join(f"{a:.1f},{b:.1f}" for a, b in corners)
        marks += f'<polygon class="diamond" points="{points}"/>'
    if one.defeated:
        left, right = box.x, box.x + box.width
        for a, b in ((box.y, y), (y, box.y)):
            marks += (
                f'<line class="cross" x1="{left:.1f}" y1="{a:.1f}" x2="{right:.1f}" y2="{b:.1f}"/>'
            )
    return marks
