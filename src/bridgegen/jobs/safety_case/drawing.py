"""An argument drawn: where its elements are, and as SVG in the shapes of the notation."""

import textwrap
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

from markupsafe import Markup

from bridgegen.jobs.safety_case.model import Element, RelationKind, SafetyCase
from bridgegen.pages.charts import element, points_of

# --- Where the elements of an argument are drawn: a head, and a column for each goal below it ---


Point = tuple[float, float]

LINE, PAD, CHARACTER = 14.5, 8.0, 6.1
"""Height of a line, margin of a text, and width of a character [pixels]."""
GAP, INDENT, TRUNK = 12.0, 15.0, 6.0
BADGE = 48.0
"""Width of a solution, assumption or justification whose text stands beside it [pixels]."""
WIDTH, LEAST, MOST = 1356.0, 140.0, 340.0
"""Width of a drawing, and least and greatest width of its columns [pixels]."""
HEAD, SIDE = 330.0, 380.0
"""Width of the elements in the middle of the head, and of those beside them [pixels]."""
MOST_LINES = 9
"""Maximum number of lines of a text; the table has all of it."""
ROUND = ("Solution", "CounterSolution", "Assumption", "Justification")


@dataclass(frozen=True)
class Box:
    """An element as it is drawn; lengths in pixels.

    Attributes:
        element: it.
        x: left edge.
        y: upper edge.
        width: of all, its text included.
        height: likewise.
        lines: of its text.
        badge: whether its text stands beside its shape, not in it.
    """

    element: Element
    x: float
    y: float
    width: float
    height: float
    lines: tuple[str, ...]
    badge: bool

    @property
    def bottom(self) -> float:
        """The lower edge."""
        return self.y + self.height


@dataclass(frozen=True)
class Edge:
    """A relation as it is drawn: corners of a line, the arrow at the last."""

    kind: RelationKind
    points: tuple[Point, ...]


@dataclass(frozen=True)
class Layout:
    """A drawing of an argument."""

    width: float
    height: float
    boxes: tuple[Box, ...]
    edges: tuple[Edge, ...]


def layout(case: SafetyCase, top: str, *, deep: bool = True) -> Layout:
    """Return the drawing of the argument below a goal, which a strategy supports.

    Args:
        case: all of it.
        top: id of the goal.
        deep: whether what is below the strategy's goals is drawn, too.
    """
    return _Layout(case).place(case.element(top), deep)


class _Layout:
    def __init__(self, case: SafetyCase) -> None:
        self._case = case
        self._boxes: list[Box] = []
        self._edges: list[Edge] = []

    def place(self, goal: Element, deep: bool) -> Layout:
        (strategy,) = self._case.targets(goal.id, "SupportedBy")
        goals = list(self._case.targets(strategy.id, "SupportedBy"))
        weights = [self._weight(item) if deep else 1.0 for item in goals]
        gaps = GAP * (len(goals) - 1)
        unit = min(max((WIDTH - gaps) / sum(weights), LEAST), MOST)
        widths = [unit * weight for weight in weights]
        columns = sum(widths) + gaps
        width = max(columns, HEAD + 2.0 * SIDE + 4.0 * GAP)
        upper, below = self._head(goal, 0.0, width)
        lower, below = self._head(strategy, below + 2.0 * GAP, width)
        middle = 0.5 * width
        self._edge("SupportedBy", (middle, upper.bottom), (middle, lower.y))
        bus = below + 1.5 * GAP
        x, height = 0.5 * (width - columns), 0.0
        for item, own in zip(goals, widths, strict=True):
            box, bottom = self._tree(item, x, bus + 2.0 * GAP, own, deep)
            end = x + 0.5 * own
            self._edge(
                "SupportedBy", (middle, lower.bottom), (middle, bus), (end, bus), (end, box.y)
            )
            x, height = x + own + GAP, max(height, bottom)
        return Layout(width, height + 2.0, tuple(self._boxes), tuple(self._edges))

    def _weight(self, goal: Element) -> float:
        """Return how wide a goal's column is to others: deep ones need room, leaves do not."""
        if next(self._case.challengers(goal.id), None) is not None:
            return 1.4
        return {1: 0.8, 2: 1.0}.get(self._depth(goal), 1.1)

    def _depth(self, item: Element) -> int:
        return 1 + max((self._depth(other) for other in self._below(item)), default=0)

    def _below(self, item: Element) -> list[Element]:
        return [
            *self._case.targets(item.id, "InContextOf"),
            *self._case.challengers(item.id),
            *self._case.targets(item.id, "SupportedBy"),
        ]

    def _head(self, item: Element, y: float, width: float) -> tuple[Box, float]:
        """Place an element in the middle, its contexts on both sides; return the lower edge."""
        box = self._box(item, 0.5 * (width - HEAD), y, HEAD)
        context = list(self._case.targets(item.id, "InContextOf"))
        half = (len(context) + 1) // 2
        bottom = box.bottom
        sides = (
            (context[:half], 0.0, SIDE, box.x),
            (context[half:], width - SIDE, 0.0, box.x + HEAD),
        )
        for some, x, inner, edge in sides:
            at = y
            for each in some:
                beside = self._box(each, x, at, SIDE)
                end, middle = (x + inner, 0.5 * (edge + x + inner))
                line = at + min(0.5 * beside.height, 0.5 * BADGE)
                start = y + min(0.5 * box.height, 24.0)
                self._edge(
                    "InContextOf", (edge, start), (middle, start), (middle, line), (end, line)
                )
                at = beside.bottom + 0.75 * GAP
            bottom = max(bottom, at - 0.75 * GAP)
        return box, bottom

    def _tree(
        self, item: Element, x: float, y: float, width: float, deep: bool = True
    ) -> tuple[Box, float]:
        """Place an element and all below it in a column; return the lower edge of all."""
        box = self._box(item, x, y, width)
        bottom = box.bottom + (10.0 if item.undeveloped else 0.0)
        if not deep:
            return box, bottom
        for kind in ("InContextOf", "Challenges", "SupportedBy"):
            found = (
                self._case.challengers(item.id)
                if kind == "Challenges"
                else self._case.targets(item.id, kind)
            )
            for other in found:
                child, end = self._tree(other, x + INDENT, bottom + GAP, width - INDENT)
                line = child.y + min(0.5 * child.height, 0.5 * BADGE)
                points = ((x + TRUNK, box.bottom), (x + TRUNK, line), (child.x, line))
                self._edge(kind, *(points[::-1] if kind == "Challenges" else points))
                bottom = end
        return box, bottom

    def _box(self, item: Element, x: float, y: float, width: float) -> Box:
        badge = item.kind in ROUND
        inside = (
            width
            - 2.0 * PAD
            - (BADGE if badge else 0.0)
            - (24.0 if item.kind == "Strategy" else 0.0)
        )
        lines = wrapped(item.statement.text, inside)
        rows = len(lines) if badge else len(lines) + 1  # and its id
        height = rows * LINE + (4.0 if badge else 2.0 * PAD)
        if badge:
            height = max(height, BADGE)
        box = Box(item, x, y, width, height, lines, badge)
        self._boxes.append(box)
        return box

    def _edge(self, kind: RelationKind, *points: Point) -> None:
        self._edges.append(Edge(kind, points))


def wrapped(text: str, width: float) -> tuple[str, ...]:
    """Return the lines of a text that fit into a width [pixels], at most ``MOST_LINES``."""
    characters = max(8, int(width / CHARACTER))
    lines: Sequence[str] = textwrap.wrap(text, characters, break_on_hyphens=False) or [""]
    if len(lines) > MOST_LINES:
        last = lines[MOST_LINES - 1][: characters - 2].rstrip(" ,;.")
        lines = [*lines[: MOST_LINES - 1], f"{last} …"]
    return tuple(lines)


SLANT = 12.0
"""Horizontal inclination of a strategy's sides [pixels]."""

_CLASS = {
    "supported": "ok",
    "not supported": "bad",
    "incomplete": "open",
    "undeveloped": "open",
    "": "",
}


def drawing(found: Layout, label: str) -> Markup:
    """Return an inline SVG.

    Args:
        found: what is drawn.
        label: of the whole, for people who do not see it.
    """
    width, height = round(found.width + 4.0), round(found.height + 4.0)
    return element(
        "svg",
        *map(_edge, found.edges),
        *map(_element, found.boxes),
        class_="gsn",
        role="img",
        aria_label=label,
        width=width,
        height=height,
        viewBox=f"-2 -2 {width} {height}",
    )


def _edge(edge: Edge) -> Markup:
    # The last piece with a length gives the arrow its direction: a line may end where it turned.
    (x0, y0), (x, y) = next(
        pair for pair in reversed([*pairwise(edge.points)]) if pair[0] != pair[1]
    )
    dx, dy = (x > x0) - (x < x0), (y > y0) - (y < y0)
    left = (x - 9 * dx - 4 * dy, y - 9 * dy - 4 * dx)
    right = (x - 9 * dx + 4 * dy, y - 9 * dy + 4 * dx)
    kind = edge.kind.lower()
    return element("polyline", class_=kind, points=points_of(edge.points)) + element(
        "polygon", class_=f"tip {kind}", points=points_of((left, (x, y), right))
    )


def _element(box: Box) -> Markup:
    item = box.element
    kind = item.kind.removeprefix("Counter").lower()
    counter = " counter" if item.kind.startswith("Counter") else ""
    words = f"{item.id}: {item.statement.text}" + (f" ({item.status})" if item.status else "")
    return element(
        "a",
        element("title", words),
        *_shape(box),
        *_text(box),
        *_marks(box),
        href=f"#{item.id}",
        class_=f"{kind}{counter} {_CLASS[item.status]}",
    )


def _shape(box: Box) -> Iterator[Markup]:
    x, y, w, h = box.x, box.y, box.width, box.height
    kind = box.element.kind
    if box.badge:
        r = 0.5 * BADGE - 2.0
        cx, cy = x + 0.5 * BADGE, y + 0.5 * BADGE
        if kind in ("Solution", "CounterSolution"):
            yield element("circle", class_="shape", cx=cx, cy=cy, r=r)
            return
        yield element("ellipse", class_="shape", cx=cx, cy=cy, rx=r, ry=0.7 * r)
        yield element("text", kind[0], class_="letter", x=cx + r - 6, y=cy + 0.7 * r + 7)
    elif kind == "Strategy":
        corners = ((x + SLANT, y), (x + w, y), (x + w - SLANT, y + h), (x, y + h))
        yield element("polygon", class_="shape", points=points_of(corners))
    else:
        rx = "16" if kind == "Context" else None
        yield element("rect", class_="shape", x=x, y=y, width=w, height=h, rx=rx)


def _text(box: Box) -> Iterator[Markup]:
    item = box.element
    if box.badge:
        x, y = box.x + BADGE + 4.0, box.y + 13.0
        middle, height = box.x + 0.5 * BADGE, box.y + 0.5 * BADGE
        letters = item.id.rstrip("0123456789.")
        for part, drop in ((letters, -1.5), (item.id.removeprefix(letters), 9.0)):
            yield element("text", part, class_="badge", x=middle, y=height + drop)
    else:
        x = box.x + PAD + (SLANT if item.kind == "Strategy" else 0.0)
        y = box.y + PAD + 10.0
        word = (" ", element("tspan", item.status, class_="status")) if item.status else ()
        yield element("text", item.id, *word, class_="id", x=x, y=y)
        y += LINE
    lines = (element("tspan", line, x=x, y=y + k * LINE) for k, line in enumerate(box.lines))
    yield element("text", *lines)


def _marks(box: Box) -> Iterator[Markup]:
    """Yield the diamond of an undeveloped goal, and the cross of a defeated one."""
    x, y, item = box.x + 0.5 * box.width, box.bottom, box.element
    if item.undeveloped:
        corners = ((x, y), (x + 9, y + 9), (x, y + 18), (x - 9, y + 9))
        yield element("polygon", class_="diamond", points=points_of(corners))
    if item.defeated:
        for a, b in ((box.y, y), (y, box.y)):
            yield element("line", class_="cross", x1=box.x, y1=a, x2=box.x + box.width, y2=b)
