"""The ontology's classes and individuals of one scenario in five columns, one for each layer."""

import textwrap
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from bridgegen.openx.source import source_of
from bridgegen.pages.painter import paint
from bridgegen.pages.picture import Picture
from bridgegen.pages.picture_payload import pictures_payload
from bridgegen.scenario.language.scenario import LogicalScenario
from bridgegen_reproduction.figures.look import WIDE, Theme, blank

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

POINTS = 6.2
"""Size of the text."""

LINE = POINTS * 1.28 / 72.0
"""[inches]: from line to line."""

COLUMNS = (1.42, 0.86, 0.86, 1.92, 1.3)
"""[inches]: widths of the columns; layers 2 and 3 of a plain crossroads are all but empty."""

GUTTER = 0.2
"""[inches]: between columns; links run there."""

_PAD, _GAP = 0.05, 0.1
_LETTER = POINTS * 0.59 / 72.0


@dataclass(frozen=True)
class Line:
    """A line of a block: its text, and how it is set."""

    text: str
    kind: str = "plain"


@dataclass
class Block:
    """A class with the individuals that are told together.

    Attributes:
        cls: name of the class.
        ids: the individuals'.
        lines: what is told of them.
        links: label and id of the block's links to others.
        x: left edge [inches]; set by the layout, as are the next.
        y: top edge, downwards.
        width: of it.
    """

    cls: str
    ids: tuple[str, ...]
    lines: tuple[Line, ...]
    links: tuple[tuple[str, str], ...]
    x: float = field(default=0.0, init=False)
    y: float = field(default=0.0, init=False)
    width: float = field(default=0.0, init=False)

    @property
    def height(self) -> float:
        """Of it [inches]."""
        return (1 + len(self.lines)) * LINE + 2 * _PAD


def picture_of(scenario: LogicalScenario) -> Picture:
    """Return the picture of a scenario's individuals at its defaults."""
    values = scenario.space().values(scenario.space().row({}))
    individuals = source_of(scenario, None).concrete(values).individuals
    assert individuals is not None
    return paint(individuals)


def blocks(picture: Picture) -> list[list[Block]]:
    """Return what is drawn, column by column."""
    payload = pictures_payload([picture])
    columns = [payload["columns"][k] for k in payload["pictures"][0]["columns"]]
    return [
        [block for group in groups for block in _blocks(group, int((width - 2 * _PAD) / _LETTER))]
        for groups, width in zip(columns, COLUMNS, strict=True)
    ]


def _blocks(group: Mapping[str, Any], letters: int) -> Iterator[Block]:
    if "common" in group:  # many of a class
        boxes = group["boxes"]
        lines = [*_wrapped(", ".join(_names(boxes)), letters, "name")]
        for fact in group["common"]:
            lines += _fact(fact, letters)
        yield Block(
            f"{group['class']} × {len(boxes)}",
            tuple(box["id"] for box in boxes),
            tuple(lines),
            tuple(tuple(link) for box in boxes for link in box.get("links", ())),
        )
        return
    for box in group["boxes"]:
        lines = list(_wrapped(box["name"], letters, "name"))
        for fact in box["facts"][: box.get("shown", len(box["facts"]))]:
            lines += _fact(fact, letters)
        ids, links = [box["id"]], [tuple(link) for link in box.get("links", ())]
        for item in box.get("inside", ()):
            lines += [Line(f"{item['class']}: {item['name']}", "name")]
            for fact in item["facts"][: item.get("shown", len(item["facts"]))]:
                lines += _fact(fact, letters)
            ids.append(item["id"])
            links += [tuple(link) for link in item.get("links", ())]
        own = set(ids)
        kept = tuple(link for link in links if link[1] not in own)
        yield Block(group["class"], tuple(ids), tuple(lines), kept)


def _names(boxes: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return the individuals' names; of lanes and the like, a leg's together."""
    names = [str(box["name"]) for box in boxes]
    if len(names) <= 6:
        return names
    return [names[0], names[1], "…", names[-1]]


def _fact(fact: Sequence[Any], letters: int) -> list[Line]:
    label, text = fact[0], fact[1]
    is_searched = len(fact) > 2 and bool(fact[2])
    told = f"{label}: {text}" if label else text
    return list(_wrapped(told.replace("\u202f", "\u00a0"), letters, "bound" if is_searched else ""))


def _wrapped(text: str, letters: int, kind: str) -> Iterator[Line]:
    for part in textwrap.wrap(text, letters, subsequent_indent="  "):
        yield Line(part, kind or "plain")


def ontology(picture: Picture, layers: Sequence[str], theme: Theme) -> "Figure":
    """Draw classes, individuals, their values and their links.

    Args:
        picture: of a scenario.
        layers: names of the five columns.
        theme: what to draw in.
    """
    columns = blocks(picture)
    head = 2 * LINE + 0.1
    tallest = head
    x = 0.0
    for column, width in zip(columns, COLUMNS, strict=True):
        y = head
        for block in column:
            block.x, block.y, block.width = x, y, width
            y += block.height + _GAP
        tallest, x = max(tallest, y), x + width + GUTTER
    total = x - GUTTER
    height = tallest + 2.4 * LINE
    figure = blank(WIDE, height * WIDE / total, theme)
    figure.set_layout_engine("none")
    axes = figure.add_axes((0.005, 0.005, 0.99, 0.99))
    axes.set_xlim(-0.12, total + 0.02)
    axes.set_ylim(height, 0)
    axes.set_axis_off()
    scale = WIDE / (total + 0.14)
    x = 0.0
    for number, (name, width) in enumerate(zip(layers, COLUMNS, strict=True), 1):
        parts = textwrap.wrap(f"{number} {name}", int(width / _LETTER / 1.1))[:2]
        for k, part in enumerate(parts):
            axes.text(
                x,
                k * LINE + 0.02,
                part,
                va="top",
                fontsize=(POINTS + 0.6) * scale,
                fontweight="bold",
                color=theme.ink,
            )
        if not columns[number - 1]:
            axes.text(
                x,
                head,
                "none in this\nscenario",
                va="top",
                fontsize=POINTS * scale,
                style="italic",
                color=theme.muted,
            )
        x += width + GUTTER
    _links(axes, columns, theme, scale)
    for column in columns:
        for block in column:
            _block(axes, block, theme, scale)
    axes.text(
        0,
        height - 0.6 * LINE,
        "blue and bold: the value is a parameter’s, at its default; orange arrows: links to "
        "another layer",
        va="bottom",
        fontsize=POINTS * scale,
        color=theme.muted,
    )
    return figure


def _block(axes: "Axes", block: Block, theme: Theme, scale: float) -> None:
    from matplotlib.patches import FancyBboxPatch

    axes.add_patch(
        FancyBboxPatch(
            (block.x, block.y),
            block.width,
            block.height,
            boxstyle="round,pad=0,rounding_size=0.04",
            facecolor=theme.paper,
            edgecolor=theme.muted,
            linewidth=0.7,
            zorder=3,
        )
    )
    y = block.y + _PAD
    axes.text(
        block.x + _PAD,
        y,
        block.cls,
        va="top",
        fontsize=POINTS * scale,
        style="italic",
        color=theme.muted,
        zorder=4,
    )
    for line in block.lines:
        y += LINE
        axes.text(
            block.x + _PAD,
            y,
            line.text,
            va="top",
            fontsize=POINTS * scale,
            zorder=4,
            color=theme.colours[0] if line.kind == "bound" else theme.ink,
            fontweight="bold" if line.kind in ("name", "bound") else "normal",
        )


def _links(axes: "Axes", columns: Sequence[Sequence[Block]], theme: Theme, scale: float) -> None:
    home = {name: block for column in columns for block in column for name in block.ids}
    for column in columns:
        lane = 0
        for block in column:
            inside: dict[int, Block] = {}
            across: dict[int, tuple[Block, list[str]]] = {}
            for label, other in block.links:
                there = home.get(other)
                if there is None or there is block:
                    continue
                if there in column:
                    inside[id(there)] = there
                else:
                    across.setdefault(id(there), (there, []))[1].append(label)
            if inside:
                _bus(axes, block, list(inside.values()), lane, theme)
                lane += 1
            for there, labels in across.values():
                _arrow(axes, block, there, "; ".join(dict.fromkeys(labels)), theme, scale)


def _bus(axes: "Axes", block: Block, others: Sequence[Block], lane: int, theme: Theme) -> None:
    """Draw links within a column: a line beside it, and a short one to each."""
    x = block.x - 0.04 - 0.035 * lane
    start = block.y + _PAD + 0.4 * LINE + 0.03 * lane
    ends = [other.y + _PAD + 0.4 * LINE + 0.03 * lane for other in others]
    axes.plot([block.x, x, x], [start, start, ends[0]], color=theme.muted, linewidth=0.7, zorder=2)
    axes.plot(
        [x, x], [min(start, *ends), max(start, *ends)], color=theme.muted, linewidth=0.7, zorder=2
    )
    for other, end in zip(others, ends, strict=True):
        axes.annotate(
            "",
            (other.x, end),
            (x, end),
            zorder=2,
            arrowprops={
                "arrowstyle": "-|>",
                "color": theme.muted,
                "linewidth": 0.7,
                "mutation_scale": 4,
                "shrinkA": 0,
                "shrinkB": 0,
            },
        )


def _arrow(
    axes: "Axes", block: Block, there: Block, label: str, theme: Theme, scale: float
) -> None:
    """Draw a link between columns, with its label in the middle."""
    to_the_left = there.x < block.x
    start = (block.x if to_the_left else block.x + block.width, block.y + 0.5 * block.height)
    end = (there.x + there.width if to_the_left else there.x, there.y + 0.5 * there.height)
    axes.annotate(
        "",
        end,
        start,
        zorder=2,
        arrowprops={
            "arrowstyle": "-|>",
            "color": theme.colours[1],
            "linewidth": 0.9,
            "mutation_scale": 6,
            "shrinkA": 0,
            "shrinkB": 0,
        },
    )
    share = 0.42
    axes.text(
        start[0] + share * (end[0] - start[0]),
        start[1] + share * (end[1] - start[1]),
        label,
        ha="center",
        va="center",
        fontsize=(POINTS - 0.4) * scale,
        color=theme.ink,
        zorder=5,
        bbox={"facecolor": theme.paper, "edgecolor": "none", "pad": 0.8},
    )
