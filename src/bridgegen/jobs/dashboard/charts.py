"""Small charts of shares over successive results, as SVG."""

from html import escape

from bridgegen.jobs.dashboard.markup import when
from bridgegen.jobs.dashboard.trends import Point, Series
from bridgegen.pages.sentences import share

WIDTH, HEIGHT = 340.0, 150.0
_LEFT, _RIGHT, _TOP, _BELOW = 44.0, 12.0, 18.0, 34.0

MOST_NUMBERS = 6
"""Points whose values are written beside them; more would overlap."""

_STEPS = (0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0)
"""Upper ends of the vertical axis."""


def chart(series: Series, links: dict[str, str]) -> str:
    """Return a chart: a dot for each result with its interval, a line where the version changes.

    Args:
        series: at least one point.
        links: by source the address of the result's page.
    """
    points = series.points
    top = next((one for one in _STEPS if max(p.high for p in points) <= one), 1.0)
    parts = [_axis(top)]
    step = (WIDTH - _LEFT - _RIGHT) / len(points)
    at = [_LEFT + step * (i + 0.5) for i in range(len(points))]
    parts += _versions(points, at, step)
    line = " ".join(f"{x:.1f},{_y(p.share, top):.1f}" for x, p in zip(at, points, strict=True))
    parts.append(f'<polyline class="line" points="{line}"/>')
    for x, point in zip(at, points, strict=True):
        parts.append(_point(x, point, top, links.get(point.source, "")))
        if len(points) <= MOST_NUMBERS or point is points[-1]:
            y = _y(point.high, top) - 5.0
            parts.append(
                f'<text x="{x:.1f}" y="{max(y, 10.0):.1f}" text-anchor="middle">'
                f"{share(point.share)}</text>"
            )
    words = f"{series.measure} of {series.driver} in {series.title}: " + ", ".join(
        f"{point.driver} {share(point.share)}" for point in points[-5:]
    )
    return (
        f'<svg class="chart" viewBox="0 0 {WIDTH:g} {HEIGHT:g}" role="img" '
        f'aria-label="{escape(words)}">{"".join(parts)}</svg>'
    )


def strip(counts: list[int]) -> str:
    """Return bins in a row, the fuller the darker; empty ones are outlined only."""
    most = max(counts, default=0) or 1
    width = 120.0 / max(len(counts), 1)
    cells = []
    for i, count in enumerate(counts):
        shade = f' fill-opacity="{0.25 + 0.75 * count / most:.2f}"' if count else ' class="none"'
        cells.append(
            f'<rect x="{i * width:.1f}" width="{max(width - 1.0, 1.0):.1f}"{shade}>'
            f"<title>{count:,}</title></rect>"
        )
    return f'<svg class="strip" viewBox="0 0 120 14" aria-hidden="true">{"".join(cells)}</svg>'


def _y(value: float, top: float) -> float:
    return HEIGHT - _BELOW - (HEIGHT - _TOP - _BELOW) * min(value / top, 1.0)


def _axis(top: float) -> str:
    lines = []
    for value in (0.0, 0.5 * top, top):
        y = _y(value, top)
        lines.append(
            f'<path class="grid" d="M{_LEFT:g} {y:.1f}H{WIDTH - _RIGHT:g}"/>'
            f'<text x="{_LEFT - 5.0:g}" y="{y + 4.0:.1f}" text-anchor="end">{share(value)}</text>'
        )
    return "".join(lines)


def _versions(points: tuple[Point, ...], at: list[float], step: float) -> list[str]:
    """Return a label below the first point of each version, shortened to its room."""
    starts = [i for i, p in enumerate(points) if not i or p.driver != points[i - 1].driver]
    parts = []
    for start, end in zip(starts, [*starts[1:], len(points)], strict=True):
        left, right = at[start] - 0.5 * step, at[end - 1] + 0.5 * step
        room = max(3, int((right - left) / 6.0))
        label = points[start].version
        short = label if len(label) <= room else f"…{label[-(room - 1) :]}"
        if start:
            parts.append(f'<path class="new" d="M{left:.1f} {_TOP:g}V{HEIGHT - _BELOW:g}"/>')
        parts.append(
            f'<text x="{0.5 * (left + right):.1f}" y="{HEIGHT - 14.0:g}" text-anchor="middle">'
            f"{escape(short)}<title>{escape(points[start].driver)}</title></text>"
        )
    return parts


def _point(x: float, point: Point, top: float, address: str) -> str:
    words = f"{point.driver}, {when(point.time)} UTC: {share(point.share)}"
    words += f" ({point.count:,} of {point.of:,}); {point.source}"
    bar = ""
    if point.low != point.high:
        bar = f'<path class="bar" d="M{x:.1f} {_y(point.low, top):.1f}V{_y(point.high, top):.1f}"/>'
    kind = "dot some" if point.count else "dot"
    dot = f'<circle class="{kind}" cx="{x:.1f}" cy="{_y(point.share, top):.1f}" r="4"/>'
    body = f"<g><title>{escape(words)}</title>{bar}{dot}</g>"
    return f'<a href="{escape(address)}">{body}</a>' if address else body
