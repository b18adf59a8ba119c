"""The bird's-eye view outside scripts: road, lights, bodies and labels, as pixels or as SVG."""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.util import find_spec
from pathlib import Path

import numpy as np
from PIL import ImageDraw, ImageFont

from bridgegen.base.arrays import Float
from bridgegen.drivers.kinds import BLUE, BRAKE, LEFT, RIGHT
from bridgegen.pages.playback import AREA_KINDS, Entity, Lamp, Outline
from bridgegen.pages.svg import SvgDraw
from bridgegen.scenario.participants import drawing_of

GROUND, ASPHALT, MARKING = "#dfe5da", "#8d949d", "#f6f7f9"
INK, PAPER, HIT = "#17202c", "#ffffff", "#c00020"
PLAYERS = ("#0063b0", "#f0a30a", "#00805f", "#a83f84")
"""Colours of the ego and of the others in turn, as the report's."""

MOVES = 0.05
"""Speed above which a participant counts as moving [m/s]."""

_AREAS = {"driving": ASPHALT, "junction": ASPHALT, "median": GROUND, "stripe": MARKING}
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
_FONT = "mpl-data/fonts/ttf/DejaVuSans-Bold.ttf"
_RIM = "#10161d"  # tells a lamp from a body of its own colour

Point = tuple[float, float]
Box = tuple[float, float, float, float]


class Pixels(ImageDraw.ImageDraw):
    """Pillow's canvas, which draws dashes, too."""

    def dashes(self, xy: Sequence[Point], fill: str, width: int, dash: float) -> None:
        """Draw a line of dashes with gaps of the same length [pixels]."""
        points = np.array(xy)
        s = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])
        for start in np.arange(0.0, s[-1], 2.0 * dash).tolist():
            at = np.array([start, min(start + dash, float(s[-1]))])
            u, v = (np.interp(at, s, points[:, i]).tolist() for i in range(2))
            self.line([*zip(u, v, strict=True)], fill=fill, width=width)


Draw = Pixels | SvgDraw
"""Canvas that a picture is drawn on: pixels, or SVG elements."""


@dataclass(frozen=True)
class Camera:
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

    def sees(self, points: Float) -> bool:
        """Return whether a part of a shape may be in the picture."""
        half = np.array(self.half) / self.scale
        low, high = points.min(axis=0), points.max(axis=0)
        middle = np.array([self.x, self.y])
        # By bounding boxes: a shape too many costs a line, one too few would be missing.
        return bool((low <= middle + half).all() and (high >= middle - half).all())


@cache
def font_of(size: int) -> ImageFont.FreeTypeFont | ImageFont.ImageFont:
    """Return the font of labels; of that size [pixels]."""
    # pymoo brings matplotlib, and so a font with the letters of all Europe; Pillow's own has few.
    found = find_spec("matplotlib")
    font = Path(found.origin if found and found.origin else "").parent / _FONT
    return ImageFont.truetype(str(font), size) if font.is_file() else ImageFont.load_default(size)


def centre_of(body: Entity, pose: Float) -> Float:
    """Return the middles of a body [m] by its poses ``(..., 3)``: x [m], y [m], heading [rad]."""
    h = pose[..., 2]
    return pose[..., :2] + body.center_ahead * np.stack([np.cos(h), np.sin(h)], axis=-1)


class View:
    """What is drawn of a place.

    Args:
        draw: the canvas.
        camera: what of the world is seen.
        unit: pixels of the canvas for each pixel of a picture that is 960 pixels wide.
    """

    def __init__(self, draw: Draw, camera: Camera, unit: float = 1.0) -> None:
        self.draw, self.camera, self.unit = draw, camera, unit
        self.font = font_of(round(11 * unit))
        self.taken: list[Box] = []

    def road(self, outlines: Iterable[Outline]) -> None:
        """Draw areas and lines in their order."""
        for outline in filter(lambda item: self.camera.sees(item.points), outlines):
            points = self.camera.of(outline.points)
            if outline.kind in AREA_KINDS:
                self.draw.polygon(points, fill=_AREAS.get(outline.kind, "#a9afb6"))
                continue
            colour, metres, dash = _LINES[outline.kind]
            width = max(round(metres * self.camera.scale), round(self.unit), 1)
            if dash:
                self.draw.dashes(points, colour, width, dash * self.camera.scale)
            else:
                self.draw.line(points, fill=colour, width=width, joint="curve")

    def lamps(self, found: Iterable[Lamp], k: int) -> None:
        """Draw the traffic lights at an instant; red is farthest ahead, as in the report."""
        for lamp in found:
            r = max(0.45, 3.2 * self.unit / self.camera.scale)
            along = np.array([math.cos(lamp.h), math.sin(lamp.h)])
            aside = np.array([-along[1], along[0]])
            at = np.array([lamp.x, lamp.y])
            box = [
                at + r * (a * along + b * aside)
                for a, b in ((3.6, 1.3), (-3.6, 1.3), (-3.6, -1.3), (3.6, -1.3))
            ]
            self.draw.polygon(self.camera.of(np.array(box)), fill="#10161d", outline=MARKING)
            lit = _LIT.get(int(lamp.states[k]), ())
            for place, colour in ((2.2, "#ff4d4d"), (0.0, "#ffd23f"), (-2.2, "#38d39f")):
                ((u, v),) = self.camera.of((at + place * r * along)[np.newaxis])
                fill = colour if place in lit else "#3a434e"
                self.draw.circle((u, v), 0.85 * r * self.camera.scale, fill=fill)

    def trail(self, points: Float, colour: str, every: int) -> None:
        """Draw a path ``(n, 2)`` [m], with a dot at every so many points."""
        points = points[np.isfinite(points).all(axis=1)]
        if len(points) > 1:
            pixels = self.camera.of(points)
            self.draw.line(pixels, fill=colour, width=round(3 * self.unit))
            for at in pixels[::every]:
                self.draw.circle(at, 2 * self.unit, fill=MARKING)

    def corners(
        self,
        body: Entity,
        pose: Float,
        ends: tuple[float, float] = (-1.0, 1.0),
        side: float = 1.0,
    ) -> Float:
        """Return the corners (4, 2) of a body, or of a stretch across it in shares of its half."""
        h, least = float(pose[2]), 5.0 * self.unit / self.camera.scale
        along = 0.5 * max(body.length, least) * np.array([math.cos(h), math.sin(h)])
        aside = 0.5 * side * max(body.width, least) * np.array([-math.sin(h), math.cos(h)])
        a, b = (centre_of(body, pose) + end * along for end in ends)
        return np.array([a - aside, b - aside, b + aside, a + aside])

    def start(self, body: Entity, pose: Float, colour: str) -> None:
        """Draw the dashed outline of a body."""
        box = self.camera.of(self.corners(body, pose))
        self.draw.dashes([*box, box[0]], colour, round(1.5 * self.unit), 4 * self.unit)

    def arrow(self, at: Float, h: float, colour: str) -> None:
        """Draw the head of an arrow from a point [m] on, in a direction [rad]."""
        turn = np.array([[math.cos(h), math.sin(h)], [-math.sin(h), math.cos(h)]])
        head = np.array([[0.0, 5.0], [10.0, 0.0], [0.0, -5.0]]) * self.unit / self.camera.scale
        self.draw.polygon(self.camera.of(head @ turn + at), fill=colour)

    def body(
        self, body: Entity, pose: Float, colour: str, shows: int = 0, *, is_lit: bool = False
    ) -> None:
        """Draw a body.

        Args:
            body: its size and type.
            pose: ``(3,)`` of its reference point.
            colour: of a participant; cones and signs have their own.
            shows: its indicators, brake lights and blue lights, see `bridgegen.drivers.kinds`.
            is_lit: whether lamps that flash are lit.
        """
        shape, line = drawing_of(body.type).shape, round(1.5 * self.unit)
        if shape in ("cone", "sign"):
            colour = "#d9480f"
        if shape in ("person", "cone"):
            ((u, v),) = self.camera.of(centre_of(body, pose)[np.newaxis])
            r = max(0.5 * max(body.length, body.width) * self.camera.scale, 5 * self.unit)
            self.draw.circle((u, v), r, fill=colour, outline=MARKING, width=line)
            self.draw.circle((u, v), 0.45 * r, fill=MARKING if shape == "cone" else INK)
            return
        # Of a body that is a few pixels wide, a rim and two windows would hide the colour.
        is_small = body.width * self.camera.scale < 8 * self.unit
        box = self.camera.of(self.corners(body, pose))
        self.draw.polygon(box, fill=colour, outline=MARKING, width=1 if is_small else line)
        if shape == "vehicle":
            for ends in ((0.24, 0.54), (-0.72, -0.56))[: 1 if is_small else 2]:
                self.draw.polygon(self.camera.of(self.corners(body, pose, ends, 0.72)), fill=INK)
            if shows:
                self._shown(body, pose, shows, is_lit=is_lit)

    def _shown(self, body: Entity, pose: Float, shows: int, *, is_lit: bool) -> None:
        """Draw the indicators as they flash, brake lights, and blue lights; as bodies.js does."""
        h, middle, scale = float(pose[2]), centre_of(body, pose), self.camera.scale
        turn = np.array([[math.cos(h), math.sin(h)], [-math.sin(h), math.cos(h)]])
        r = max(0.3, 4 * self.unit / scale)
        line = max(round(1.2 * self.unit), round(0.08 * scale))

        def lamp(along: float, side: float, colour: str) -> None:
            at = np.array([along * body.length, side * body.width]) @ turn + middle
            ((u, v),) = self.camera.of(at[np.newaxis])
            self.draw.circle((u, v), r * scale, fill=colour, outline=_RIM, width=line)

        for side in (-1.0, 1.0):
            if shows & BRAKE:
                half = 0.6 * r / body.length
                box = [
                    (-0.5 + a * half, side * 0.25 + b * 0.14)
                    for a, b in ((1, 1), (-1, 1), (-1, -1), (1, -1))
                ]
                corners = np.array(box) * (body.length, body.width) @ turn + middle
                self.draw.polygon(self.camera.of(corners), fill="#ff2d2d", outline=_RIM, width=line)
            if shows & (LEFT if side > 0 else RIGHT):
                for end in (-0.5, 0.5):
                    lamp(end, 0.5 * side, "#ffb000" if is_lit else "#7a5200")
            if shows & BLUE:
                lamp(-0.08, 0.2 * side, "#2f8cff" if is_lit == (side > 0) else "#123a75")

    def scale_bar(self) -> None:
        """Draw a bar of a round length in the lower right corner."""
        u, scale = self.unit, self.camera.scale
        metres = next((m for m in (2, 5, 10, 20, 50) if m * scale >= 50 * u), 50)
        x, y = 2 * self.camera.half[0] - 16 * u, 2 * self.camera.half[1] - 16 * u
        left = x - metres * scale
        bar = [(left, y - 5 * u), (left, y), (x, y), (x, y - 5 * u)]
        self.draw.line(bar, fill=INK, width=round(2 * u))
        self.draw.text(((left + x) / 2, y - 4 * u), f"{metres} m", INK, self.font, anchor="mb")
        self.taken.append((left, y - 20 * u, x, y))

    def pill(self, text: str, at: Point, edge: str) -> Box:
        """Draw a label with its upper left corner at a pixel."""
        w, h, u = self.wide(text), 22 * self.unit, self.unit
        box = (at[0], at[1], at[0] + w, at[1] + h)
        self.draw.rounded_rectangle(box, 10 * u, PAPER, edge, round(1.5 * u))
        self.draw.text((at[0] + w / 2, at[1] + h / 2), text, INK, self.font, anchor="mm")
        self.taken.append(box)
        return box

    def wide(self, text: str) -> float:
        """Return the width of a label [pixels]."""
        return float(self.font.getlength(text)) + 12 * self.unit

    def labels(self, bodies: Sequence[Float], named: Iterable[tuple[int, str, str]]) -> None:
        """Draw labels, each where it hides least of the others and of what is drawn already.

        Args:
            bodies: the corners of each body.
            named: number of a body, its label, and its colour.
        """
        boxes: list[Box] = []
        for corners in bodies:
            u, v = zip(*self.camera.of(corners), strict=True)
            boxes.append((min(u), min(v), max(u), max(v)))
        self.taken += boxes
        frame = (0.0, 0.0, 2 * self.camera.half[0], 2 * self.camera.half[1])
        for number, text, colour in named:
            if not overlap(boxes[number], frame):
                continue
            w, h = self.wide(text), 22 * self.unit
            box = min(
                _places(boxes[number], w, h, 6 * self.unit),
                # Rounded: the noise of these sums must not decide between places that hide nothing.
                key=lambda place: round(
                    sum(overlap(place, other) for other in self.taken)
                    + 3.0 * (w * h - overlap(place, frame)),
                    3,
                ),
            )
            self.pill(text, box[:2], colour)


def _places(body: Box, w: float, h: float, off: float) -> Iterator[Box]:
    """Yield the places of a label about a body, the preferred ones first."""
    x, y = (body[0] + body[2]) / 2, (body[1] + body[3]) / 2
    for more in (1.0, 3.0):
        dx, dy = (body[2] - body[0] + w) / 2 + more * off, (body[3] - body[1] + h) / 2 + more * off
        for a, b in ((0, -1), (0, 1), (1, 0), (-1, 0), (1, -1), (-1, 1), (1, 1), (-1, -1)):
            u, v = x + a * dx - w / 2, y + b * dy - h / 2
            yield u, v, u + w, v + h


def overlap(a: Box, b: Box) -> float:
    """Return the area that two boxes share."""
    wide, high = min(a[2], b[2]) - max(a[0], b[0]), min(a[3], b[3]) - max(a[1], b[1])
    return max(wide, 0.0) * max(high, 0.0)
