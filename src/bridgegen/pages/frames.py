"""Frames of a playback: the report's bird's-eye view, drawn with Pillow."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import matplotlib
import numpy as np
from PIL import Image, ImageDraw, ImageFont

from bridgegen.assess.metrics.distances import first_closest
from bridgegen.base.arrays import Float
from bridgegen.drivers.kinds import BLUE, BRAKE, LEFT, RIGHT
from bridgegen.pages.playback import AREA_KINDS, Playback
from bridgegen.pages.svg import SvgDraw
from bridgegen.scenario.participants import drawing_of
from bridgegen.scenario.weather import in_words

FINE = 2
"""Pixels drawn for each pixel of the picture, in each direction; averaging smooths edges."""

GROUND, INK, PAPER, MARKING, HIT = "#dfe5da", "#17202c", "#ffffff", "#f6f7f9", "#c00020"
PLAYERS = ("#0063b0", "#f0a30a", "#00805f", "#a83f84")
"""Colours of the ego and of the others in turn, as the report's."""

_AREAS = {
    "driving": "#8d949d",
    "junction": "#8d949d",
    "shoulder": "#a9afb6",
    "sidewalk": "#a9afb6",
    "median": GROUND,
    "stripe": MARKING,
}
_LINES = {  # colour, width [m], dash [m]
    "edge": (MARKING, 0.14, 0.0),
    "solid": (MARKING, 0.14, 0.0),
    "broken": (MARKING, 0.14, 3.0),
    "centre": (MARKING, 0.2, 0.0),
    "stop": (PAPER, 0.45, 0.0),
    "sign": (HIT, 0.3, 0.0),
    "route": ("#0b5fa5", 0.12, 1.0),
}
_LIT = {1: (2.2,), 2: (2.2, 0.0), 3: (0.0,), 4: (-2.2,)}  # places of the lit lamps by state
_FLASHES = 1.5  # a second; UN R48: 60 to 120 a minute
_RIM = "#10161d"  # tells a lamp from a body of its own colour
_MOVES = 0.05  # m/s
_SCALE = (18.0, 30.0)  # pixels per metre of a picture 960 pixels wide; below, the camera follows
_MARGIN = 7.0  # m around the paths
_FLAG = 1.0  # s, for which a contact is announced

Draw = ImageDraw.ImageDraw | SvgDraw
"""Canvas that a picture is drawn on: pixels, or SVG elements."""

Point = tuple[float, float]
Box = tuple[float, float, float, float]


@dataclass(frozen=True)
class _Camera:
    """The middle of the picture [m], pixels per metre, and half of the size [pixels]."""

    x: float
    y: float
    scale: float
    half: Point

    def of(self, points: Float) -> list[Point]:
        """Return points (n, 2) [m] in pixels."""
        u = self.half[0] + (points[:, 0] - self.x) * self.scale
        v = self.half[1] - (points[:, 1] - self.y) * self.scale
        return list(zip(u.tolist(), v.tolist(), strict=True))


class Film:
    """The frames of a stretch of a playback.

    Args:
        playback: what is drawn.
        size: of a frame, width and height [pixels].
        first: instant of the stretch.
        last: likewise, first <= last < n_steps.
    """

    def __init__(self, playback: Playback, size: tuple[int, int], first: int, last: int) -> None:
        self.playback, self.size = playback, size
        self._big = (size[0] * FINE, size[1] * FINE)
        self._unit = FINE * max(0.6, size[0] / 960.0)
        font = Path(matplotlib.get_data_path()) / "fonts/ttf/DejaVuSans-Bold.ttf"
        self._font = ImageFont.truetype(str(font), round(11 * self._unit))
        self._ground: tuple[_Camera, Image.Image] | None = None
        path = self._pair[:, first : last + 1].reshape(-1, 2)
        path = path[np.isfinite(path).all(axis=1)]
        low, high = path.min(axis=0) - _MARGIN, path.max(axis=0) + _MARGIN
        fit = min(self._big[0] / (high[0] - low[0]), 0.8 * self._big[1] / (high[1] - low[1]))
        self._follows = bool(fit < _SCALE[0] * self._unit)
        self._scale = float(np.clip(fit, _SCALE[0] * self._unit, _SCALE[1] * self._unit))
        self._middle = 0.5 * (low + high)

    @cached_property
    def centres(self) -> Float:
        """``(E, T, 2)`` the middle of each body [m]."""
        p = self.playback
        ahead = np.array([[entity.center_ahead] for entity in p.entities])
        return np.stack([p.x + ahead * np.cos(p.h), p.y + ahead * np.sin(p.h)], axis=-1)

    @cached_property
    def closest(self) -> int:
        """The instant of the minimum distance; 0 if there is no other participant."""
        gap = self.playback.distance[: self.playback.n_steps]
        return first_closest(gap) if np.isfinite(gap).any() else 0

    @cached_property
    def partner(self) -> int:
        """The other participant of the conflict, or the nearest one; 0 if there is none."""
        p = self.playback
        if p.conflict is not None:
            return p.conflict.partner
        gap = np.hypot(*(self.centres[1:, self.closest] - self.centres[0, self.closest]).T)
        return 1 + int(np.nanargmin(gap)) if np.isfinite(gap).any() else 0

    @cached_property
    def _pair(self) -> Float:
        return self.centres[[0, self.partner]]

    @cached_property
    def _players(self) -> list[int]:
        p = self.playback
        moves = [e for e in range(1, len(p.entities)) if (p.v[e, : p.n_steps] > _MOVES).any()]
        return list(dict.fromkeys([0, *moves, self.partner]))

    def contact(self, k: int) -> Point | None:
        """Return where the first contact was in the picture at instant k [pixels], if it was."""
        where = self._contact
        if where is None or where[0] > k:
            return None
        ((u, v),) = self._camera(k).of(where[1][np.newaxis])
        return u / FINE, v / FINE

    @cached_property
    def _contact(self) -> tuple[int, Float] | None:
        hits = np.flatnonzero(self.playback.distance[: self.playback.n_steps] <= 0.0)
        if not len(hits):
            return None
        k = int(hits[0])
        ego, other = (self._corners(e, k) for e in (0, self.partner))
        grid = np.linspace(0.0, 1.0, 21)[:, np.newaxis]
        edges = [
            np.concatenate([a + grid * (b - a) for a, b in zip(c, np.roll(c, 1, 0), strict=True)])
            for c in (ego, other)
        ]
        gap = np.hypot(*(edges[0][:, np.newaxis] - edges[1]).transpose(2, 0, 1))
        i, j = np.unravel_index(int(gap.argmin()), gap.shape)
        return k, 0.5 * (edges[0][i] + edges[1][j])

    def _camera(self, k: int) -> _Camera:
        middle = self._middle
        if self._follows:
            here = self._pair[:, k]
            middle = here[np.isfinite(here).all(axis=1)].mean(axis=0)
            reach = 0.3 * np.array(self._big) / self._scale
            middle = np.clip(middle, self._pair[0, k] - reach, self._pair[0, k] + reach)
            middle = np.where(np.isfinite(middle), middle, self._middle)
        half = (self._big[0] / 2.0, self._big[1] / 2.0)
        return _Camera(float(middle[0]), float(middle[1]), self._scale, half)

    def frame(self, k: int) -> Image.Image:
        """Return the picture of an instant."""
        camera = self._camera(k)
        if self._ground is None or self._ground[0] != camera:
            ground = Image.new("RGB", self._big, GROUND)
            self._draw_road(ImageDraw.Draw(ground), camera)
            self._ground = camera, ground
        image = self._ground[1].copy()
        self._draw_instant(ImageDraw.Draw(image), camera, k)
        return image.reduce(FINE)

    def drawing(self, k: int) -> str:
        """Return the picture of an instant as SVG."""
        camera, draw = self._camera(k), SvgDraw(self._big, GROUND)
        self._draw_road(draw, camera)
        self._draw_instant(draw, camera, k)
        return draw.svg(self.size)

    def _draw_instant(self, draw: Draw, camera: _Camera, k: int) -> None:
        self._draw_lamps(draw, camera, k)
        for e in self._players:
            self._draw_trail(draw, camera, e, k)
        for e in range(len(self.playback.entities)):
            self._draw_body(draw, camera, e, k)
        taken = self._draw_contact(draw, camera, k) + self._draw_clock(draw, k)
        self._draw_labels(draw, camera, k, taken)

    def _draw_road(self, draw: Draw, camera: _Camera) -> None:
        for lane in self.playback.lanes:
            if lane.kind in AREA_KINDS:
                draw.polygon(camera.of(lane.points), fill=_AREAS[lane.kind])
                continue
            colour, metres, dash = _LINES[lane.kind]
            width = max(round(metres * camera.scale), FINE)
            for part in _dashes(lane.points, dash):
                draw.line(camera.of(part), fill=colour, width=width, joint="curve")

    def _draw_lamps(self, draw: Draw, camera: _Camera, k: int) -> None:
        for lamp in self.playback.lamps:
            r = max(0.45, 3.2 * self._unit / camera.scale)
            along = np.array([math.cos(lamp.h), math.sin(lamp.h)])
            aside = np.array([-along[1], along[0]])
            at = np.array([lamp.x, lamp.y])
            box = [
                at + r * (a * along + b * aside)
                for a, b in ((3.6, 1.3), (-3.6, 1.3), (-3.6, -1.3), (3.6, -1.3))
            ]
            draw.polygon(camera.of(np.array(box)), fill="#10161d", outline=MARKING)
            lit = _LIT.get(int(lamp.states[k]), ())
            for place, colour in ((2.2, "#ff4d4d"), (0.0, "#ffd23f"), (-2.2, "#38d39f")):
                ((u, v),) = camera.of((at + place * r * along)[np.newaxis])
                draw.circle(
                    (u, v), 0.85 * r * camera.scale, fill=colour if place in lit else "#3a434e"
                )

    def _draw_trail(self, draw: Draw, camera: _Camera, e: int, k: int) -> None:
        points = self.centres[e, : k + 1]
        points = points[np.isfinite(points).all(axis=1)]
        if len(points) > 1:
            draw.line(camera.of(points), fill=self._colour(e), width=round(3 * self._unit))
            every = max(1, round(1.0 / self.playback.time_step))
            for at in camera.of(points[::every]):
                draw.circle(at, 2 * self._unit, fill=MARKING)

    def _colour(self, e: int) -> str:
        place = self._players.index(e) if e in self._players else 3
        return PLAYERS[0] if e == 0 else PLAYERS[(place - 1) % 3 + 1]

    def _corners(
        self, e: int, k: int, ends: tuple[float, float] = (-1.0, 1.0), side: float = 1.0
    ) -> Float:
        """Return the corners (4, 2) of a body, or of a stretch across it in shares of its half."""
        body, h = self.playback.entities[e], float(self.playback.h[e, k])
        along = 0.5 * body.length * np.array([math.cos(h), math.sin(h)])
        aside = 0.5 * side * body.width * np.array([-math.sin(h), math.cos(h)])
        a, b = (self.centres[e, k] + end * along for end in ends)
        return np.array([a - aside, b - aside, b + aside, a + aside])

    def _draw_body(self, draw: Draw, camera: _Camera, e: int, k: int) -> None:
        if not np.isfinite(self.centres[e, k]).all():
            return
        body = self.playback.entities[e]
        shape = drawing_of(body.type).shape
        colour = "#d9480f" if shape in ("cone", "sign") else self._colour(e)
        line = round(1.5 * self._unit)
        if shape in ("person", "cone"):
            ((u, v),) = camera.of(self.centres[e, k][np.newaxis])
            r = max(0.5 * max(body.length, body.width) * camera.scale, 5 * self._unit)
            draw.circle((u, v), r, fill=colour, outline=MARKING, width=line)
            draw.circle((u, v), 0.45 * r, fill=MARKING if shape == "cone" else INK)
            return
        draw.polygon(camera.of(self._corners(e, k)), fill=colour, outline=MARKING, width=line)
        if shape == "vehicle":
            for ends in ((0.24, 0.54), (-0.72, -0.56)):
                draw.polygon(camera.of(self._corners(e, k, ends, 0.72)), fill=INK)
            self._draw_shown(draw, camera, e, k)

    def _draw_shown(self, draw: Draw, camera: _Camera, e: int, k: int) -> None:
        """Draw the indicators as they flash, brake lights, and blue lights; as bodies.js does."""
        p = self.playback
        shows = 0 if p.shows is None else int(p.shows[e, k])
        if not shows:
            return
        body, h = p.entities[e], float(p.h[e, k])
        turn = np.array([[math.cos(h), math.sin(h)], [-math.sin(h), math.cos(h)]])
        r = max(0.3, 4 * self._unit / camera.scale)
        line = max(round(1.2 * self._unit), round(0.08 * camera.scale))
        lit = k * p.time_step * _FLASHES % 1.0 < 0.5

        def lamp(along: float, side: float, colour: str) -> None:
            at = np.array([along * body.length, side * body.width]) @ turn + self.centres[e, k]
            ((u, v),) = camera.of(at[np.newaxis])
            draw.circle((u, v), r * camera.scale, fill=colour, outline=_RIM, width=line)

        for side in (-1.0, 1.0):
            if shows & BRAKE:
                half = 0.6 * r / body.length
                box = [
                    (-0.5 + a * half, side * 0.25 + b * 0.14)
                    for a, b in ((1, 1), (-1, 1), (-1, -1), (1, -1))
                ]
                corners = np.array(box) * (body.length, body.width) @ turn + self.centres[e, k]
                draw.polygon(camera.of(corners), fill="#ff2d2d", outline=_RIM, width=line)
            if shows & (LEFT if side > 0 else RIGHT):
                for end in (-0.5, 0.5):
                    lamp(end, 0.5 * side, "#ffb000" if lit else "#7a5200")
            if shows & BLUE:
                lamp(-0.08, 0.2 * side, "#2f8cff" if lit == (side > 0) else "#123a75")

    def _draw_contact(self, draw: Draw, camera: _Camera, k: int) -> list[Box]:
        where = self._contact
        if where is None or where[0] > k:
            return []
        ((u, v),), r = camera.of(where[1][np.newaxis]), 7 * self._unit
        for colour, width in ((PAPER, 5.5), (HIT, 3.0)):
            for turn in (-1, 1):
                ends = [(u - r, v - turn * r), (u + r, v + turn * r)]
                draw.line(ends, fill=colour, width=round(width * self._unit))
        return [(u - 2 * r, v - 2 * r, u + 2 * r, v + 2 * r)]

    def _draw_clock(self, draw: Draw, k: int) -> list[Box]:
        p, u = self.playback, self._unit
        words = [f"{k * p.time_step:.1f} s"]
        hit = self._contact
        if hit is not None and 0 <= (k - hit[0]) * p.time_step <= _FLAG:
            words.append("collision")
        boxes = [
            self._pill(draw, "   ".join(words), (10 * u, 10 * u), HIT if len(words) > 1 else INK)
        ]
        now = [weather for weather in p.weather if weather.step <= k]
        if now:
            text = in_words(now[-1].stated)
            boxes.append(self._pill(draw, text, (10 * u, self._big[1] - 32 * u), INK))
        metres = next((m for m in (2, 5, 10, 20) if m * self._scale >= 50 * u), 20)
        x, y = self._big[0] - 16 * u, self._big[1] - 16 * u
        long = metres * self._scale
        draw.line(
            [(x - long, y - 5 * u), (x - long, y), (x, y), (x, y - 5 * u)],
            fill=INK,
            width=round(2 * u),
        )
        draw.text((x - long / 2, y - 4 * u), f"{metres} m", INK, self._font, anchor="mb")
        return [*boxes, (x - long, y - 20 * u, x, y)]

    def _pill(self, draw: Draw, text: str, at: Point, edge: str) -> Box:
        w, h, u = self._wide(text), 22 * self._unit, self._unit
        box = (at[0], at[1], at[0] + w, at[1] + h)
        draw.rounded_rectangle(box, 10 * u, PAPER, edge, round(1.5 * u))
        draw.text((at[0] + w / 2, at[1] + h / 2), text, INK, self._font, anchor="mm")
        return box

    def _wide(self, text: str) -> float:
        return float(self._font.getlength(text)) + 12 * self._unit

    def _draw_labels(self, draw: Draw, camera: _Camera, k: int, taken: list[Box]) -> None:
        """Draw names and speeds, each where it hides least of the others and of the contact."""
        p, bodies = self.playback, {}
        for e in range(len(p.entities)):
            if np.isfinite(self.centres[e, k]).all():
                u, v = zip(*camera.of(self._corners(e, k)), strict=True)
                bodies[e] = (min(u), min(v), max(u), max(v))
        taken = [*taken, *bodies.values()]
        frame = (0.0, 0.0, float(self._big[0]), float(self._big[1]))
        for e in self._players:
            if e not in bodies or not _overlap(bodies[e], frame):
                continue
            text = f"{p.entities[e].name}  {p.v[e, k]:.1f} m/s"
            w, h = self._wide(text), 22 * self._unit
            box = min(
                _places(bodies[e], w, h, 6 * self._unit),
                key=lambda place: (
                    sum(_overlap(place, other) for other in taken)
                    + 3.0 * (w * h - _overlap(place, frame))
                ),
            )
            taken.append(box)
            self._pill(draw, text, box[:2], self._colour(e))


def _places(body: Box, w: float, h: float, off: float) -> Iterator[Box]:
    """Yield the places of a label about a body, the preferred ones first."""
    x, y = (body[0] + body[2]) / 2, (body[1] + body[3]) / 2
    for more in (1.0, 3.0):
        dx, dy = (body[2] - body[0] + w) / 2 + more * off, (body[3] - body[1] + h) / 2 + more * off
        for a, b in ((0, -1), (0, 1), (1, 0), (-1, 0), (1, -1), (-1, 1), (1, 1), (-1, -1)):
            u, v = x + a * dx - w / 2, y + b * dy - h / 2
            yield u, v, u + w, v + h


def _overlap(a: Box, b: Box) -> float:
    wide, high = min(a[2], b[2]) - max(a[0], b[0]), min(a[3], b[3]) - max(a[1], b[1])
    return max(wide, 0.0) * max(high, 0.0)


def _dashes(points: Float, dash: float) -> Iterator[Float]:
    """Yield a line, or its dashes of a length [m] with gaps of the same length."""
    if not dash:
        yield points
        return
    s = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])
    for start in np.arange(0.0, s[-1], 2.0 * dash).tolist():
        at = np.array([start, min(start + dash, float(s[-1]))])
        yield np.stack([np.interp(at, s, points[:, i]) for i in range(2)], axis=-1)
