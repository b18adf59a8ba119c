"""A bird's-eye sketch of one concrete scenario as SVG: starts and closest approach."""

import html
import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from bridgegen.base.arrays import Bool, Float
from bridgegen.engine.runner import Runner
from bridgegen.pages.playback import AREA_KINDS, Entity, Lamp, Outline
from bridgegen.pages.scenery import Scenery, bodies, lamps
from bridgegen.scenario.participants import drawing_of

WIDTH, HEIGHT = 960, 430
"""Size of the picture in pixels."""

_REACH = (34.0, 95.0)  # m, half of the picture's width: minimum, maximum
_AFTER = 2.0  # s, length of the drawn paths beyond the closest approach
_MOVES = 0.05  # m/s
_GROUND, _INK, _PAPER = "#dfe5da", "#17202c", "#ffffff"
_AREAS = {
    "driving": "#8d949d",
    "junction": "#8d949d",
    "shoulder": "#a9afb6",
    "sidewalk": "#c3c8cd",
    "median": _GROUND,
    "stripe": "#f6f7f9",
}
_LINES = {  # colour, width [m], dashes [m]
    "edge": ("#f6f7f9", 0.15, ""),
    "solid": ("#f6f7f9", 0.15, ""),
    "broken": ("#f6f7f9", 0.15, "3 3"),
    "centre": ("#f6f7f9", 0.2, ""),
    "stop": ("#ffffff", 0.45, ""),
    "sign": ("#c00020", 0.4, ""),
    "route": ("#0b5fa5", 0.12, "1 1"),
}
_COLOURS = ("#0063b0", "#f0a30a", "#00805f", "#a83f84")
_LAMPS = {1: ("#ff4d4d", 0), 2: ("#ff4d4d", 0), 3: ("#ffd23f", 1), 4: ("#38d39f", 2)}
_ROUND = ("person", "cone")
_ROAD_WORKS = ("cone", "sign")


class _View(NamedTuple):
    """The view: its middle [m], and pixels per metre."""

    x: float
    y: float
    scale: float

    def point(self, x: float, y: float) -> tuple[float, float]:
        return WIDTH / 2 + (x - self.x) * self.scale, HEIGHT / 2 - (y - self.y) * self.scale

    def line(self, points: Float) -> str:
        return " ".join("{:.1f},{:.1f}".format(*self.point(x, y)) for x, y in points.tolist())

    def sees(self, points: Float) -> bool:
        """Return whether a part of a shape may be in the picture."""
        half = np.array([WIDTH, HEIGHT]) / self.scale / 2.0
        low, high = points.min(axis=0), points.max(axis=0)
        middle = np.array([self.x, self.y])
        return bool((low <= middle + half).all() and (high >= middle - half).all())


def sketch(runner: Runner, x: Float | None = None) -> str:
    """Return the picture of one row of a scenario.

    Args:
        runner: of the scenario and its ego.
        x: ``(len(space.names),)``; by default the row of the defaults.

    Returns:
        SVG of `WIDTH` by `HEIGHT` pixels: every body at the closest approach, its path until
        shortly afterwards, and as a dashed outline its start.
    """
    x = runner.space.row({}) if x is None else x
    rollout = runner.run(x[np.newaxis])
    road = Scenery(runner).road(x)
    n = int(rollout.n_steps[0])
    distance = rollout.distance[0].min(axis=0)[:n]
    closest = int(distance.argmin()) if np.isfinite(distance).any() else n - 1
    last = min(n - 1, closest + round(_AFTER / rollout.time_step))
    entities = bodies(rollout, runner.bodies(x))
    where = np.stack([rollout.x[0], rollout.y[0], rollout.h[0]], axis=-1)  # (E, T, 3)
    there = rollout.present[0] if rollout.present.size else np.ones(where.shape[:2], np.bool_)
    moving = [e == 0 or bool((rollout.v[0, e, :n] > _MOVES).any()) for e in range(len(entities))]
    seen = there & np.array(moving)[:, np.newaxis]
    view = _view(where[:, : last + 1][seen[:, : last + 1]], where[0, closest])
    parts = [*_roads(road.outlines, view), *_lamps(lamps(rollout, 0, road.lights), closest, view)]
    labels = []
    for e, body in enumerate(entities):
        at_works = drawing_of(body.type).shape in _ROAD_WORKS
        colour = "#d9480f" if at_works else _COLOURS[_number(e, moving)]
        if moving[e]:
            for first, end in _stays(there[e, : last + 1]):
                parts += _way(body, where[e], (first, closest, end), colour, view)
        if not there[e, closest]:
            continue
        parts.append(_body(body, where[e, closest], colour, view))
        if not at_works:
            labels.append((body.name, colour, view.point(*_centre(body, where[e, closest]))))
    parts += _labels(labels)
    title = html.escape(f"{runner.scenario.title}, seen from above")
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" role="img" '
        f'font-family="system-ui, sans-serif"><title>{title}</title>'
        f'<rect width="{WIDTH}" height="{HEIGHT}" fill="{_GROUND}"/>{"".join(parts)}'
        f"{_scale_bar(view)}</svg>\n"
    )


def _number(e: int, moving: Sequence[bool]) -> int:
    return 0 if e == 0 else (e - 1) % 3 + 1


def _stays(there: Bool) -> Iterator[tuple[int, int]]:
    """Yield the first and the last instant of each interval in which a body is present."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], there, [False]]).astype(np.int8)))
    yield from ((first, end - 1) for first, end in edges.reshape(-1, 2).tolist())


def _view(where: Float, ego: Float) -> _View:
    """Return the view that holds poses (·, 3); of long paths, the stretch about the ego's."""
    points = where[:, :2]
    low, high = points.min(axis=0), points.max(axis=0)
    half = 0.5 * (high - low) + 8.0
    reach = max(half[0], half[1] * WIDTH / HEIGHT)
    middle = 0.5 * (low + high)
    if reach > _REACH[1]:
        middle = ego[:2]
    reach = min(max(reach, _REACH[0]), _REACH[1])
    return _View(float(middle[0]), float(middle[1]), WIDTH / 2.0 / reach)


def _roads(road: Sequence[Outline], view: _View) -> Iterator[str]:
    for outline in road:
        if not view.sees(outline.points):
            continue
        line = view.line(outline.points)
        if outline.kind in AREA_KINDS:
            fill = _AREAS[outline.kind]
            yield f'<polygon points="{line}" fill="{fill}" stroke="{fill}" stroke-width="0.6"/>'
            continue
        colour, metres, dashes = _LINES[outline.kind]
        width = max(metres * view.scale, 0.8)
        dashed = " ".join(f"{float(part) * view.scale:.1f}" for part in dashes.split())
        more = f' stroke-dasharray="{dashed}"' if dashed else ""
        yield (
            f'<polyline points="{line}" fill="none" stroke="{colour}" '
            f'stroke-width="{width:.1f}"{more}/>'
        )


def _lamps(found: Sequence[Lamp], k: int, view: _View) -> Iterator[str]:
    """Yield the housings of the lights; red is farthest ahead, as in the report."""
    for lamp in found:
        x, y = view.point(lamp.x, lamp.y)
        r = max(0.45 * view.scale, 3.0)
        colour, lit = _LAMPS.get(int(lamp.states[k]), ("", -1))
        circles = "".join(
            f'<circle cx="{(2.2 - 2.2 * place) * r:.1f}" r="{0.85 * r:.1f}" '
            f'fill="{colour if place == lit else "#3a434e"}"/>'
            for place in range(3)
        )
        yield (
            f'<g transform="translate({x:.1f} {y:.1f}) rotate({-math.degrees(lamp.h):.1f})">'
            f'<rect x="{-3.6 * r:.1f}" y="{-1.3 * r:.1f}" width="{7.2 * r:.1f}" '
            f'height="{2.6 * r:.1f}" rx="{1.2 * r:.1f}" fill="#10161d"/>{circles}</g>'
        )


def _centre(body: Entity, at: Float) -> tuple[float, float]:
    return (
        float(at[0] + body.center_ahead * math.cos(at[2])),
        float(at[1] + body.center_ahead * math.sin(at[2])),
    )


def _way(
    body: Entity, where: Float, stay: tuple[int, int, int], colour: str, view: _View
) -> Iterator[str]:
    """Yield a body's start and path, with an arrow's head at the end.

    ``stay`` is its first instant, that of the closest approach, and its last one.
    """
    first, closest, last = stay
    yield _body(body, where[first], colour, view, start=True)
    centres = np.array([_centre(body, at) for at in where[: last + 1]])
    keep = np.unique(np.append(np.arange(first, last + 1, 4), [max(closest, first), last]))
    keep = keep[keep <= last]
    for part, opacity in ((keep[keep <= closest], 1.0), (keep[keep >= closest], 0.45)):
        if len(part) > 1:
            yield (
                f'<polyline points="{view.line(centres[part])}" fill="none" stroke="{colour}" '
                f'stroke-width="2.6" stroke-opacity="{opacity}"/>'
            )
    (x, y), turn = view.point(*centres[last]), -math.degrees(where[last, 2])
    yield (
        f'<path d="M0 -5 L10 0 L0 5 Z" fill="{colour}" '
        f'transform="translate({x:.1f} {y:.1f}) rotate({turn:.1f})"/>'
    )


def _body(body: Entity, at: Float, colour: str, view: _View, *, start: bool = False) -> str:
    x, y = view.point(*_centre(body, at))
    length, width = (max(size * view.scale, 5.0) for size in (body.length, body.width))
    look = (
        f'fill="none" stroke="{colour}" stroke-width="1.6" stroke-dasharray="4 3"'
        if start
        else f'fill="{colour}" stroke="{_PAPER}" stroke-width="1.2"'
    )
    place = f'transform="translate({x:.1f} {y:.1f}) rotate({-math.degrees(at[2]):.1f})"'
    drawn = drawing_of(body.type).shape
    if drawn in _ROUND:
        return f'<circle r="{max(length, width) / 2:.1f}" {look} {place}/>'
    shape = (
        f'<rect x="{-length / 2:.1f}" y="{-width / 2:.1f}" width="{length:.1f}" '
        f'height="{width:.1f}" rx="{width * 0.22:.1f}" {look}/>'
    )
    if start or drawn in ("sign", "thing"):
        return f"<g {place}>{shape}</g>"
    screen = (
        f'<rect x="{length * 0.14:.1f}" y="{-width * 0.36:.1f}" width="{length * 0.12:.1f}" '
        f'height="{width * 0.72:.1f}" fill="{_INK}" fill-opacity="0.6"/>'
    )
    return f"<g {place}>{shape}{screen}</g>"


def _labels(labels: list[tuple[str, str, tuple[float, float]]]) -> Iterator[str]:
    """Yield the bodies' names, each beside its body where it hides least."""
    taken: list[tuple[float, float, float, float]] = [
        (x - 10, y - 10, x + 10, y + 10) for _, _, (x, y) in labels
    ]
    for name, colour, (x, y) in labels:
        if not (0 <= x <= WIDTH and 0 <= y <= HEIGHT):
            continue
        w, h = 7.6 * len(name) + 12, 19
        places = [
            (x + dx * (w / 2 + 18), y + dy * 26)
            for dx, dy in ((0, -1), (0, 1), (1, 0), (-1, 0), (1, -1), (-1, 1), (1, 1), (-1, -1))
        ]
        boxes = [(px - w / 2, py - h / 2, px + w / 2, py + h / 2) for px, py in places]
        box = min(
            boxes, key=lambda pair: sum(_overlap(pair, other) for other in taken) + _out(pair)
        )
        taken.append(box)
        text = html.escape(name)
        yield (
            f'<rect x="{box[0]:.1f}" y="{box[1]:.1f}" width="{w:.1f}" height="{h}" rx="9.5" '
            f'fill="{_PAPER}" fill-opacity="0.93" stroke="{colour}" stroke-width="1.5"/>'
            f'<text x="{(box[0] + box[2]) / 2:.1f}" y="{box[3] - 5.4:.1f}" text-anchor="middle" '
            f'font-size="13" font-weight="600" fill="{_INK}">{text}</text>'
        )


def _overlap(a: tuple[float, ...], b: tuple[float, ...]) -> float:
    wide = min(a[2], b[2]) - max(a[0], b[0])
    high = min(a[3], b[3]) - max(a[1], b[1])
    return max(wide, 0.0) * max(high, 0.0)


def _out(box: tuple[float, ...]) -> float:
    size = (box[2] - box[0]) * (box[3] - box[1])
    return 3.0 * (size - _overlap(box, (0.0, 0.0, WIDTH, HEIGHT)))


def _scale_bar(view: _View) -> str:
    metres = next((m for m in (5, 10, 20, 50) if m * view.scale >= 60), 50)
    long = metres * view.scale
    return (
        f'<path d="M16 {HEIGHT - 20} v6 h{long:.1f} v-6" fill="none" stroke="{_INK}" '
        f'stroke-width="1.6"/><text x="{16 + long / 2:.1f}" y="{HEIGHT - 20}" '
        f'text-anchor="middle" font-size="12" fill="{_INK}">{metres} m</text>'
    )
