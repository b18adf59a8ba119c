"""Charts of pages without scripts, as SVG; their colours are those of ``web/still.css``."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from markupsafe import Markup, escape

from bridgegen.base.arrays import Float


def element(name: str, *content: object, **attributes: object) -> Markup:
    """Return an element: ``class_`` is its class, an underscore in a name a hyphen."""
    given = Markup("").join(
        Markup(' {}="{}"').format(key.rstrip("_").replace("_", "-"), _rounded(value))
        for key, value in attributes.items()
        if value is not None
    )
    inside = Markup("").join(map(escape, content))
    return Markup("<{}{}>{}</{}>").format(Markup(name), given, inside, Markup(name))


def _rounded(value: object) -> object:
    # A tenth of a pixel is not seen, and a page may hold thousands of points.
    return f"{value:.1f}".removesuffix(".0") if isinstance(value, float) else value


def svg(width: float, height: float, label: str, parts: Iterable[Markup], kind: str = "") -> Markup:
    """Return a picture with its name for those who do not see it."""
    return element(
        "svg",
        *parts,
        class_=kind or None,
        viewBox=f"0 0 {width:g} {height:.0f}",
        role="img",
        aria_label=label,
    )


def points_of(pairs: Iterable[tuple[float, float]]) -> str:
    """Return pixels as the attribute of a line or an area."""
    return " ".join(f"{x:.1f},{y:.1f}" for x, y in pairs)


class Plot:
    """A plot: marks are given in data units, and lie over those that were added before.

    Values outside an axis's range stand at its end.

    Args:
        size: width and height [pixels].
        x: the range of the horizontal axis.
        y: the range of the vertical axis, upwards.
        margins: left, right, top and bottom [pixels].
    """

    def __init__(
        self,
        size: tuple[float, float],
        x: tuple[float, float],
        y: tuple[float, float],
        margins: tuple[float, float, float, float],
    ) -> None:
        self.size, self._ranges = size, (x, y)
        left, right, top, bottom = margins
        self.left, self.right, self.top, self.base = left, size[0] - right, top, size[1] - bottom
        self._parts: list[Markup] = []

    def at(self, x: float) -> float:
        """Return the pixel of a value of the horizontal axis."""
        return float(self._x(np.array(x)))

    def height(self, y: float) -> float:
        """Return the pixel of a value of the vertical axis."""
        return float(self._y(np.array(y)))

    def _x(self, x: Float) -> Float:
        low, high = self._ranges[0]
        # A range of one value must not divide by 0: its marks stand at the start.
        share = (np.clip(x, low, high) - low) / ((high - low) or 1.0)
        return self.left + share * (self.right - self.left)

    def _y(self, y: Float) -> Float:
        low, high = self._ranges[1]
        share = (np.clip(y, low, high) - low) / ((high - low) or 1.0)
        return self.base - share * (self.base - self.top)

    def add(self, name: str, *content: object, **attributes: object) -> None:
        """Add an element in pixels; see `element`."""
        self._parts.append(element(name, *content, **attributes))

    def text(
        self, x: float, y: float, text: object, anchor: str = "middle", kind: str = ""
    ) -> None:
        """Write at a pixel."""
        self.add("text", text, class_=kind or None, x=x, y=y, text_anchor=anchor)

    def bars(self, edges: Float, heights: Float) -> None:
        """Add a bar between each two edges, from the axis on."""
        left, tops = self._x(edges), self._y(heights)
        for a, b, y in zip(left[:-1].tolist(), left[1:].tolist(), tops.tolist(), strict=True):
            self.add(
                "rect", class_="bar", x=a, y=y, width=max(b - a - 1.0, 0.5), height=self.base - y
            )

    def band(self, x: Float, low: Float, high: Float, kind: str = "band") -> None:
        """Add the area between two curves."""
        points = self._points(np.concatenate([x, x[::-1]]), np.concatenate([high, low[::-1]]))
        self.add("polygon", class_=kind, points=points)

    def line(self, x: Float, y: Float, kind: str = "line", dash: str | None = None) -> None:
        """Add a curve."""
        points = self._points(x, y)
        self.add("polyline", class_=kind, stroke_dasharray=dash, points=points)

    def dots(self, x: Float, y: Float, radius: float = 1.8) -> None:
        """Add a dot for each pair of values."""
        for a, b in zip(self._x(x).tolist(), self._y(y).tolist(), strict=True):
            self.add("circle", class_="dot", cx=a, cy=b, r=radius)

    def grid(self, x: int = 0, y: int = 0) -> None:
        """Add lines at so many round numbers of each axis, as `frame` has them."""
        for tick in ticks(*self._ranges[0], x) if x else ():
            self.add("path", class_="grid", d=f"M{self.at(tick):.1f} {self.base:g}V{self.top:g}")
        for tick in ticks(*self._ranges[1], y) if y else ():
            y_ = self.height(tick)
            self.add("path", class_="grid", d=f"M{self.left:g} {y_:.1f}H{self.right:g}")

    def image(self, address: str) -> None:
        """Add a picture that fills the plot."""
        self.add(
            "image",
            x=self.left,
            y=self.top,
            width=self.right - self.left,
            height=self.base - self.top,
            preserveAspectRatio="none",
            href=address,
        )

    def frame(self, x_label: str, y_label: str = "", most: int = 7) -> None:
        """Add the axes, each with ``most`` round numbers; the vertical one if it has a label."""
        self.add(
            "path",
            class_="axis",
            d=f"M{self.left:g} {self.base:g}H{self.right:g}"
            + (f"M{self.left:g} {self.top:g}V{self.base:g}" if y_label else ""),
        )
        for tick in ticks(*self._ranges[0], most):
            self.text(self.at(tick), self.base + 18.0, f"{tick:g}")
        self.text(0.5 * (self.left + self.right), self.base + 36.0, x_label)
        if y_label:
            for tick in ticks(*self._ranges[1], most):
                self.text(self.left - 6.0, self.height(tick) + 4.0, f"{tick:g}", "end")
            middle = 0.5 * (self.top + self.base)
            self.add(
                "text",
                y_label,
                text_anchor="middle",
                transform=f"translate(14 {middle:.0f}) rotate(-90)",
            )

    def svg(self, label: str, kind: str = "chart") -> Markup:
        """Return the picture."""
        return svg(*self.size, label, self._parts, kind)

    def _points(self, x: Float, y: Float) -> str:
        return points_of(zip(self._x(x).tolist(), self._y(y).tolist(), strict=True))


def ticks(low: float, high: float, most: int = 7) -> list[float]:
    """Return round numbers in a range, at most ``most`` steps apart."""
    if low == high:
        return [low]
    step = 10.0 ** np.floor(np.log10((high - low) / (most - 2.0)))
    # Round numbers are 1, 2 and 5 times a power of ten; 10 for what rounding leaves over.
    step *= next(value for value in (1.0, 2.0, 5.0, 10.0) if (high - low) / (step * value) <= most)
    # The tolerance keeps ticks at the ends, where a division such as 0.3 / 0.1 misses a whole
    # number.
    first = np.ceil(low / step - 1e-9)
    return [
        # Without the digits of rounding; and -0 becomes 0.
        float(f"{k * step:.10g}") + 0.0
        for k in np.arange(first, np.floor(high / step + 1e-9) + 1.0)
    ]


@dataclass(frozen=True)
class Interval:
    """A positive estimate with its interval: what it is of, its colour's class, and the numbers."""

    words: str
    kind: str
    low: float
    estimate: float
    high: float


def intervals(lines: Sequence[Interval], label: str, longest: int = 48) -> Markup:
    """Return intervals below each other over a logarithmic axis, each below its words.

    Args:
        lines: at least one, with estimates above 0.
        label: of the picture.
        longest: characters of a line's words that are shown.
    """
    # A lower end of 0 has no place on a logarithmic axis: a tenth of the estimate stands for it.
    least = min(line.low if line.low > 0.0 else line.estimate / 10.0 for line in lines)
    first = math.floor(math.log10(least))
    last = max(math.ceil(math.log10(max(line.high for line in lines))), first + 1)
    height = 44.0 * len(lines) + 34.0
    plot = Plot((480.0, height), (first, last), (0.0, 1.0), (20.0, 20.0, 6.0, 28.0))
    for power in range(first, last + 1):
        plot.add("path", class_="grid", d=f"M{plot.at(power):.1f} 6V{plot.base:g}")
        plot.text(plot.at(power), height - 10.0, f"1e{power}")
    for row, line in enumerate(lines):
        y, short = 34.0 + 44.0 * row, line.words[: longest - 2] + "…"
        words = line.words if len(line.words) < longest else short
        low, middle, high = (
            plot.at(math.log10(max(value, 10.0**first)))
            for value in (line.low, line.estimate, line.high)
        )
        plot.text(20.0, y - 14.0, words, "start", line.kind)
        plot.add("path", class_=f"interval {line.kind}", d=f"M{low:.1f} {y:g}H{high:.1f}")
        plot.add("circle", class_=line.kind, cx=middle, cy=y, r=4.5)
    return plot.svg(label, "chart intervals")


def bars(shares: Float, level: float, label: str) -> Markup:
    """Return a small chart of shares, and a dashed line at the share that is nothing special."""
    top = max(float(shares.max()), 2.0 * level)
    n = len(shares)
    plot = Plot((260.0, 98.0), (0.0, n), (0.0, top), (0.0, 0.0, 6.0, 6.0))
    plot.bars(np.arange(n + 1.0), shares)
    plot.line(np.array([0.0, n]), np.full(2, level), "even")
    return plot.svg(label, "chart intervals")


@dataclass(frozen=True)
class Point:
    """A share in a chart of successive results.

    Attributes:
        share: in [0, 1].
        low: lower end of its interval; equal to the upper end where there is none.
        high: its upper end.
        text: the share in words.
        is_some: whether anything was counted.
        words: what it is of, shown where the pointer is.
        group: what it shares with its neighbours, short for the axis and in full.
        href: where it leads; nowhere if empty.
    """

    share: float
    low: float
    high: float
    text: str
    is_some: bool
    words: str
    group: tuple[str, str]
    href: str = ""


MOST_NUMBERS = 6
"""Largest number of points whose values are written beside them; more would overlap."""


def trend(some: Sequence[Point], label: str) -> Markup:
    """Return a chart: a dot for each result with its interval, a line where the group changes.

    Args:
        some: at least one, in the order of time.
        label: of the picture.
    """
    n, most = len(some), max(point.high for point in some)
    top = next((item for item in (0.01, 0.02, 0.05, 0.1, 0.2, 0.5) if most <= item), 1.0)
    plot = Plot((340.0, 150.0), (0.0, n), (0.0, top), (44.0, 12.0, 18.0, 34.0))
    for value in (0.0, 0.5 * top, top):
        y = plot.height(value)
        plot.add("path", class_="grid", d=f"M{plot.left:g} {y:.1f}H{plot.right:g}")
        text = f"{100.0 * value:g}\N{NARROW NO-BREAK SPACE}%"
        plot.text(plot.left - 5.0, y + 4.0, text, "end")
    starts = [i for i, point in enumerate(some) if not i or point.group != some[i - 1].group]
    for start, end in zip(starts, [*starts[1:], n], strict=True):
        left, right = plot.at(start), plot.at(end)
        room, (name, words) = max(3, int((right - left) / 6.0)), some[start].group
        if start:
            plot.add("path", class_="new", d=f"M{left:.1f} {plot.top:g}V{plot.base:g}")
        short = name if len(name) <= room else f"…{name[-(room - 1) :]}"
        plot.add(
            "text",
            short,
            element("title", words),
            x=0.5 * (left + right),
            y=plot.base + 20.0,
            text_anchor="middle",
        )
    plot.line(np.arange(0.5, n), np.array([point.share for point in some]))
    for i, point in enumerate(some):
        x, y = plot.at(i + 0.5), plot.height(point.share)
        low, high = plot.height(point.low), plot.height(point.high)
        parts = [element("title", point.words)]
        if point.low != point.high:
            parts.append(element("path", class_="range", d=f"M{x:.1f} {low:.1f}V{high:.1f}"))
        kind = "dot some" if point.is_some else "dot"
        parts.append(element("circle", class_=kind, cx=x, cy=y, r=4.0))
        if point.href:
            plot.add("a", element("g", *parts), href=point.href)
        else:
            plot.add("g", *parts)
        if n <= MOST_NUMBERS or i == n - 1:
            plot.text(x, max(high - 5.0, 10.0), point.text)
    return plot.svg(label)


def columns(some: Sequence[tuple[int, Sequence[str]]], label: str) -> Markup:
    """Return a chart of counts in the order of time, each over its lines of words."""
    most, n = max(max(count for count, _ in some), 1), len(some)
    plot = Plot((max(110.0 * n, 330.0), 210.0), (0.0, n), (0.0, most), (4.0, 4.0, 22.0, 58.0))
    plot.add("path", class_="axis", d=f"M{plot.left:g} {plot.base:g}H{plot.right:g}")
    for i, (count, lines) in enumerate(some):
        x, y = plot.at(i + 0.5), plot.height(count)
        kind = "bar some" if count else "bar"
        title = element("title", f"{lines[0]}: {count:,}")
        height = max(plot.base - y, 1.0)
        plot.add("rect", title, class_=kind, x=x - 28.0, y=y, width=56.0, height=height)
        plot.text(x, y - 6.0, f"{count:,}", kind="value")
        for k, line in enumerate(lines):
            short = line if len(line) <= 17 else f"…{line[-16:]}"
            plot.text(x, plot.base + 17.0 + 16.0 * k, short)
    return plot.svg(label, "chart columns")


def strip(counts: Sequence[int]) -> Markup:
    """Return bins in a row, the fuller the darker; empty ones are outlined only."""
    most = max(counts, default=0) or 1
    width = 120.0 / max(len(counts), 1)
    cells = (
        element(
            "rect",
            element("title", f"{count:,}"),
            x=i * width,
            width=max(width - 1.0, 1.0),
            class_=None if count else "none",
            fill_opacity=f"{0.25 + 0.75 * count / most:.2f}" if count else None,
        )
        for i, count in enumerate(counts)
    )
    bins = Markup("").join(cells)
    return element("svg", bins, class_="strip", viewBox="0 0 120 14", aria_hidden="true")


def ground(lines: Sequence[tuple[str, Float]], low: Float, high: Float, label: str) -> Markup:
    """Return lines on the ground seen from above, x to the right, with a bar of round length.

    Args:
        lines: class and points, ``(n, 2)`` [m].
        low: lower left corner of what is shown, ``(2,)`` [m].
        high: upper right corner.
        label: of the picture.
    """
    width = 900.0
    span = np.maximum(high - low, 1.0)
    scale = min((width - 20.0) / span[0], 220.0 / span[1])
    height = float(span[1] * scale) + 40.0
    parts = []
    for kind, line in lines:
        xy = np.array([10.0, height - 30.0]) + (line - low) * scale * np.array([1.0, -1.0])
        parts.append(element("polyline", class_=kind, points=points_of(xy.tolist())))
    length = 10.0 ** np.floor(np.log10(0.4 * (width - 20.0) / scale))
    end = float(length * scale)
    parts.append(element("path", class_="scale", d=f"M10 {height - 8.0:.1f}h{end:.1f}"))
    parts.append(element("text", f"{length:g} m", x=16.0 + end, y=height - 4.0))
    return svg(width, height, label, parts, "chart")
