"""Frames of a playback: the report's bird's-eye view, drawn with Pillow."""

from functools import cached_property

import numpy as np
from PIL import Image

from bridgegen.assess.metrics.distances import first_closest
from bridgegen.base.arrays import Float
from bridgegen.pages.birdseye import (
    GROUND,
    HIT,
    INK,
    MOVES,
    PAPER,
    PLAYERS,
    Camera,
    Pixels,
    Point,
    View,
    centre_of,
)
from bridgegen.pages.playback import Playback
from bridgegen.pages.svg import SvgDraw
from bridgegen.scenario.weather import in_words

FINE = 2
"""Pixels drawn for each pixel of the picture, in each direction; averaging smooths edges."""

_FLASHES = 1.5  # a second; UN R48: 60 to 120 a minute
_SCALE = (18.0, 30.0)  # pixels per metre of a picture 960 pixels wide; below, the camera follows
_MARGIN = 7.0  # m around the paths
_FLAG = 1.0  # s, for which a contact is announced


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
        self._ground: tuple[Camera, Image.Image] | None = None
        path = self._pair[:, first : last + 1].reshape(-1, 2)
        path = path[np.isfinite(path).all(axis=1)]
        low, high = path.min(axis=0) - _MARGIN, path.max(axis=0) + _MARGIN
        fit = min(self._big[0] / (high[0] - low[0]), 0.8 * self._big[1] / (high[1] - low[1]))
        # A scale at which cars can be told apart matters more than the whole path: then the camera
        # follows.
        self._follows = bool(fit < _SCALE[0] * self._unit)
        self._scale = float(np.clip(fit, _SCALE[0] * self._unit, _SCALE[1] * self._unit))
        self._middle = 0.5 * (low + high)

    @cached_property
    def _poses(self) -> Float:
        p = self.playback
        return np.stack([p.x, p.y, p.h], axis=-1)

    @cached_property
    def centres(self) -> Float:
        """``(E, T, 2)`` the middle of each body [m]."""
        pairs = zip(self.playback.entities, self._poses, strict=True)
        return np.stack([centre_of(body, poses) for body, poses in pairs])

    @cached_property
    def closest(self) -> int:
        """The instant of the minimum distance; 0 if there is no other participant."""
        gap = self.playback.distance[: self.playback.n_steps]
        return first_closest(gap) if np.isfinite(gap).any() else 0

    @property
    def vehicle(self) -> int:
        """The ego, or the further vehicle of its driver whose conflict it is."""
        return self.playback.conflict.vehicle if self.playback.conflict else 0

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
        return self.centres[[self.vehicle, self.partner]]

    @cached_property
    def _players(self) -> list[int]:
        p = self.playback
        moves = [e for e in range(1, len(p.entities)) if (p.v[e, : p.n_steps] > MOVES).any()]
        return list(dict.fromkeys([0, self.vehicle, *moves, self.partner]))

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
        view = View(SvgDraw(self._big, GROUND), self._camera(k))
        ego, other = (
            view.corners(self.playback.entities[e], self._poses[e, k])
            for e in (self.vehicle, self.partner)
        )
        # Points on all edges: the cross stands between the two that are nearest, wherever the
        # bodies touch.
        grid = np.linspace(0.0, 1.0, 21)[:, np.newaxis]
        edges = [
            np.concatenate([a + grid * (b - a) for a, b in zip(c, np.roll(c, 1, 0), strict=True)])
            for c in (ego, other)
        ]
        gap = np.hypot(*(edges[0][:, np.newaxis] - edges[1]).transpose(2, 0, 1))
        i, j = np.unravel_index(int(gap.argmin()), gap.shape)
        return k, 0.5 * (edges[0][i] + edges[1][j])

    def _camera(self, k: int) -> Camera:
        middle = self._middle
        if self._follows:
            here = self._pair[:, k]
            middle = here[np.isfinite(here).all(axis=1)].mean(axis=0)
            reach = 0.3 * np.array(self._big) / self._scale
            middle = np.clip(middle, self._pair[0, k] - reach, self._pair[0, k] + reach)
            middle = np.where(np.isfinite(middle), middle, self._middle)
        half = (self._big[0] / 2.0, self._big[1] / 2.0)
        return Camera(float(middle[0]), float(middle[1]), self._scale, half)

    def frame(self, k: int) -> Image.Image:
        """Return the picture of an instant."""
        camera = self._camera(k)
        # The road is drawn anew only where the camera moves.
        if self._ground is None or self._ground[0] != camera:
            ground = Image.new("RGB", self._big, GROUND)
            View(Pixels(ground), camera, self._unit).road(self.playback.lanes)
            self._ground = camera, ground
        image = self._ground[1].copy()
        self._draw_instant(View(Pixels(image), camera, self._unit), k)
        return image.reduce(FINE)

    def drawing(self, k: int) -> str:
        """Return the picture of an instant as SVG."""
        draw = SvgDraw(self._big, GROUND)
        view = View(draw, self._camera(k), self._unit)
        view.road(self.playback.lanes)
        self._draw_instant(view, k)
        return draw.svg(self.size)

    def _draw_instant(self, view: View, k: int) -> None:
        p = self.playback
        there = [bool(np.isfinite(at).all()) for at in self.centres[:, k]]
        view.lamps(p.lamps, k)
        every = max(1, round(1.0 / p.time_step))
        for e in self._players:
            view.trail(self.centres[e, : k + 1], self._colour(e), every)
        is_lit = k * p.time_step * _FLASHES % 1.0 < 0.5
        bodies = np.flatnonzero(there).tolist()
        for e in bodies:
            shows = 0 if p.shows is None else int(p.shows[e, k])
            view.body(p.entities[e], self._poses[e, k], self._colour(e), shows, is_lit=is_lit)
        self._draw_contact(view, k)
        self._draw_clock(view, k)
        view.labels(
            [view.corners(p.entities[e], self._poses[e, k]) for e in bodies],
            [
                (bodies.index(e), f"{p.entities[e].name}  {p.v[e, k]:.1f} m/s", self._colour(e))
                for e in self._players
                if there[e]
            ],
        )

    def _colour(self, e: int) -> str:
        place = self._players.index(e) if e in self._players else 3
        return PLAYERS[0] if e == 0 else PLAYERS[(place - 1) % 3 + 1]

    def _draw_contact(self, view: View, k: int) -> None:
        where = self._contact
        if where is None or where[0] > k:
            return
        ((u, v),), r = view.camera.of(where[1][np.newaxis]), 7 * self._unit
        for colour, width in ((PAPER, 5.5), (HIT, 3.0)):
            for turn in (-1, 1):
                ends = [(u - r, v - turn * r), (u + r, v + turn * r)]
                view.draw.line(ends, fill=colour, width=round(width * self._unit))
        view.taken.append((u - 2 * r, v - 2 * r, u + 2 * r, v + 2 * r))

    def _draw_clock(self, view: View, k: int) -> None:
        p, u = self.playback, self._unit
        words = [f"{k * p.time_step:.1f} s"]
        hit = self._contact
        if hit is not None and 0 <= (k - hit[0]) * p.time_step <= _FLAG:
            words.append("collision")
        view.pill("   ".join(words), (10 * u, 10 * u), HIT if len(words) > 1 else INK)
        now = [weather for weather in p.weather if weather.step <= k]
        if now:
            view.pill(in_words(now[-1].stated), (10 * u, self._big[1] - 32 * u), INK)
        view.scale_bar()
