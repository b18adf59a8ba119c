"""The figures of a comparison as SVG, in colours for the colour-blind."""

from collections.abc import Mapping, Sequence

import numpy as np
from markupsafe import Markup

from bridgegen.base.arrays import Float
from bridgegen.base.statistics import quartiles
from bridgegen.pages.charts import Plot, element

WIDTH = 480.0
"""Width of a figure [pixels]: its text can be read where a phone shows it at 350."""

_ROW = 28.0  # pixels, of an algorithm's box
_LETTER = 7.5  # pixels, of a letter of an algorithm's name, at most
_MOST_COLUMNS = 4  # of the legend

LIGHT = ("#17202c", "#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9")
"""Colours on white paper, the baseline's first: ink, then Okabe and Ito's (2008), without yellow,
which is invisible there."""

DARK = ("#e7ecf3", "#3d9fe0", "#ff7f3f", "#1fc796", "#e39ac6", "#f2b73a", "#a5d8f5")
"""Colours on a dark page: the hues of `LIGHT`, lighter."""

DASHES = ("", "9 4", "3 3")
"""Dashes of lines; each is used with all colours before the next."""

_MARKS = """
.figure .line, .figure .box { fill: none; stroke-width: 2 } .figure .median { stroke-width: 4 }
.figure .band { fill-opacity: 0.16 } .figure .dot { fill-opacity: 0.65 }
"""

_PAPER = """
svg { background: #ffffff; font: 13px system-ui, sans-serif } text { fill: #17202c }
.axis { fill: none; stroke: #566273 } .grid { fill: none; stroke: #e4e9f0 }
"""


def style() -> Markup:
    """Return what a page needs to show figures, light or dark."""
    dark = f"@media (prefers-color-scheme: dark) {{\n{_coloured(DARK)}}}\n"
    return Markup(f"{_MARKS}{_coloured(LIGHT)}{dark}")


def _coloured(colours: Sequence[str]) -> str:
    return "".join(
        f".figure .line.k{i}, .figure .box.k{i} {{ stroke: {colour} }} "
        f".figure .band.k{i}, .figure .dot.k{i} {{ fill: {colour} }}\n"
        for i, colour in enumerate(colours)
    )


def as_file(figure: Markup) -> bytes:
    """Return a figure as an SVG file, on white paper."""
    look = element("style", Markup(f"{_PAPER}{_MARKS}{_coloured(LIGHT)}"))
    start, rest = str(figure).split(">", 1)
    return f'{start} xmlns="http://www.w3.org/2000/svg">{look}{rest}\n'.encode()


def boxes(samples: Mapping[str, Float], baseline: str, label: str) -> Markup:
    """Draw a box and every run's value for each algorithm.

    Args:
        samples: ``(n,)`` float64, finite, by algorithm, the first on top; none where n = 0.
        baseline: drawn in ink.
        label: of the axis.
    """
    values = np.concatenate([np.zeros(0), *samples.values()])
    low, high = (float(values.min()), float(values.max())) if len(values) else (0.0, 1.0)
    edge = 0.04 * (high - low) or 0.5
    left = 14.0 + _LETTER * max(map(len, samples))
    size = (WIDTH, 52.0 + _ROW * len(samples))
    plot = Plot(size, (low - edge, high + edge), (0.0, 1.0), (left, 10.0, 6.0, 46.0))
    plot.grid(7)
    for row, (name, kind, _) in enumerate(_looks(list(samples), baseline)):
        y = plot.top + _ROW * (row + 0.5)
        plot.text(left - 8.0, y + 4.0, name, "end")
        if not len(samples[name]):
            continue
        span, ends = quartiles(samples[name]), (samples[name].min(), samples[name].max())
        a, b = plot.at(span.low), plot.at(span.high)
        plot.add("rect", class_=f"box {kind}", x=a, y=y - 8.0, width=b - a, height=16.0)
        for one, other in ((float(ends[0]), span.low), (span.high, float(ends[1]))):
            path = f"M{plot.at(one):.1f} {y:.1f}H{plot.at(other):.1f}"
            plot.add("path", class_=f"box {kind}", d=path)
        middle = f"M{plot.at(span.median):.1f} {y - 8.0:.1f}v16"
        plot.add("path", class_=f"box median {kind}", d=middle)
        # Beside one another in the order of the seeds, so that equal values do not hide each other.
        n = len(samples[name])
        aside = np.linspace(-5.0, 5.0, n) if n > 1 else np.zeros(1)
        for value, off in zip(samples[name].tolist(), aside.tolist(), strict=True):
            plot.add("circle", class_=f"dot {kind}", cx=plot.at(value), cy=y + off, r=2.4)
    plot.frame(label)
    return plot.svg(label, "chart figure")


def curves(
    samples: Mapping[str, Float],
    points: Sequence[int],
    baseline: str,
    label: str,
    *,
    from_zero: bool = True,
) -> Markup:
    """Draw the median over runs, and the band between the quartiles, by evaluations.

    Args:
        samples: ``(n, c)`` float64 by algorithm: n runs, c points; none where n = 0.
        points: c numbers of evaluations.
        baseline: drawn in ink.
        label: of the vertical axis.
        from_zero: whether the vertical axis begins at 0; else where the curves are after a tenth of
            the evaluations, so that similar ends are distinguishable.
    """
    spans = {
        name: [quartiles(column) for column in runs.T]
        for name, runs in samples.items()
        if len(runs)
    }
    early = min((some[len(points) // 10].low for some in spans.values()), default=0.0)
    low = 0.0 if from_zero else float(np.floor(20.0 * early) / 20.0)
    high = max((span.high for some in spans.values() for span in some), default=0.0)
    longest = max(map(len, spans), default=0)
    columns = max(1, min(_MOST_COLUMNS, int(WIDTH / (40.0 + _LETTER * longest))))
    rows = -(-len(spans) // columns)
    top = high + 0.03 * (high - low) if high > low else low + 1.0
    size = (WIDTH, 286.0 + 18.0 * rows)
    plot = Plot(size, (0.0, points[-1]), (low, top), (52.0, 12.0, 8.0, 52.0 + 18.0 * rows))
    plot.grid(7, 7)
    x = np.array([0, *points], np.float64)
    shown = [look for look in _looks(list(samples), baseline) if look[0] in spans]
    for name, kind, _ in shown:
        lows, highs = (
            np.array([0.0, *(getattr(span, part) for span in spans[name])])
            for part in ("low", "high")
        )
        plot.band(x, lows, highs, f"band {kind}")
    for number, (name, kind, dash) in enumerate(shown):
        median = np.array([0.0, *(span.median for span in spans[name])])
        plot.line(x, median, f"line {kind}", dash or None)
        row, column = divmod(number, columns)
        u, v = 12.0 + column * (WIDTH - 12.0) / columns, plot.base + 60.0 + 18.0 * row
        path = f"M{u:.1f} {v - 4.0:.1f}h24"
        plot.add("path", class_=f"line {kind}", stroke_dasharray=dash or None, d=path)
        plot.text(u + 30.0, v, name, "start")
    plot.frame("evaluations", label)
    return plot.svg(label, "chart figure")


def _looks(names: Sequence[str], baseline: str) -> list[tuple[str, str, str]]:
    """Return each algorithm with the class of its colour and its dashes."""
    others = [name for name in names if name != baseline]
    looks = {baseline: ("k0", "")}
    for k, name in enumerate(others):
        hue, dash = k % (len(LIGHT) - 1), k // (len(LIGHT) - 1) % len(DASHES)
        looks[name] = (f"k{hue + 1}", DASHES[dash])
    return [(name, *looks[name]) for name in names]
