"""An event as a moving picture: SVG that needs no script."""

import math
from collections.abc import Iterable
from dataclasses import replace

import numpy as np
from markupsafe import Markup

from bridgegen.base.arrays import Bool, Float
from bridgegen.drivers.kinds import NAMES
from bridgegen.pages.birdseye import ASPHALT, GROUND, INK, PLAYERS, Camera, View, centre_of
from bridgegen.pages.charts import element
from bridgegen.pages.playback import Entity, Outline
from bridgegen.pages.scenery import bodies
from bridgegen.pages.svg import SvgDraw
from bridgegen.simulation.rollout import Rollout

SIZE = 900, 320
SMALL = 560, 250
"""Size of a picture in a gallery [pixels]: two stand side by side, and a phone shows one."""
EVERY = 0.2  # s, between two states of the picture
SPACE = 12.0  # m, around both paths
LEAST = 30.0  # m, that the picture shows
BORDER = "#7d8790"  # seen on light and dark ground
STANDS = 1.0  # m; over a shorter way the ego's heading says where it goes


def moving_picture(
    motion: Rollout,
    other: int,
    when: float,
    caption: str,
    *,
    every: float = EVERY,
    most: int | None = None,
    follow: float | None = None,
    size: tuple[int, int] = SIZE,
    road: Iterable[Outline] = (),
    lines: Iterable[Float] = (),
) -> Markup:
    """Return the picture of an event, seen from above, over and over.

    Args:
        motion: N = 1; the ego is entity 0.
        other: the entity that the conflict is with; 0 if there is none.
        when: of the conflict [s].
        caption: what the picture says to those who do not see it.
        every: time between two states of the picture [s].
        most: participants that are shown, the first ones; by default all.
        follow: metres from top to bottom of a view that follows the ego; by default the view holds
            the whole paths of both.
        size: of the picture [pixels].
        road: below all, of a view that does not follow.
        lines: likewise where no road is known, such as borders of lanes, ``(n, 2)`` each [m].
    """
    motion = motion.as_driven()
    # From left to right: the picture is wide.
    start, turn = np.array([motion.x[0, 0, 0], motion.y[0, 0, 0]]), _turn(motion)
    motion = _turned(motion, start, turn)
    kinds = [NAMES[code] for code in motion.kinds.tolist()] or ["car"] * len(motion.names)
    entities = bodies(motion, dict(zip(motion.names, kinds, strict=True)))[:most]
    n = min(int(motion.n_steps[0]), motion.shape[2])
    poses = np.stack([motion.x[0], motion.y[0], motion.h[0]], axis=-1)[:most, :n]  # (E, T, 3)
    is_there = np.ones(motion.x[0].shape, np.bool_)
    there = (motion.present[0] if motion.present.size else is_there)[:most, :n]
    draw = SvgDraw(size, GROUND)
    camera = _camera(poses[[0, other]][there[[0, other]]], size)
    if follow is not None:
        camera = Camera(0.0, 0.0, size[1] / follow, (size[0] / 2, size[1] / 2))
    view = View(draw, camera, 1.2)
    view.road(Outline(one.kind, (one.points - start) @ turn) for one in road)
    for line in filter(camera.sees, ((line - start) @ turn for line in lines)):
        draw.line(camera.of(line), fill=BORDER)
    colours = {**dict.fromkeys(range(len(entities)), ASPHALT), other: PLAYERS[1], 0: PLAYERS[0]}
    moment = int(np.clip(round(when / motion.time_step), 0, n - 1))
    step = max(1, round(every / motion.time_step))
    for e in dict.fromkeys((other, 0)):
        path = centre_of(entities[e], poses[e, there[e]])[::step]
        view.trail(path, colours[e], max(1, round(1.0 / step / motion.time_step)))
        view.start(entities[e], poses[e, moment], colours[e])
    at = np.arange(0, n, step)
    timing = {
        "dur": f"{max((len(at) - 1) * step * motion.time_step, every):.2f}s",
        "repeatCount": "indefinite",
    }
    for e in sorted(colours, key=lambda e: (e == 0, e == other)):  # these two over all others
        given = (entities[e], colours[e], poses[e, at], there[e, at], view, timing)
        # In a small picture, names of those who are not concerned hide those who are.
        is_named = size != SMALL or e in (0, other)
        draw.add(_carried(*given, above=e == 0, is_named=is_named))
    if follow is not None:
        ways = [f"{size[0] / 2 - u:.1f} {size[1] / 2 - v:.1f}" for u, v in camera.of(poses[0, at])]
        draw.carry(_moves("translate", ways, timing))
    view.scale_bar()
    return Markup(draw.svg(title=caption, is_file=False))


def _turn(motion: Rollout) -> Float:
    """Return the matrix ``(2, 2)`` that turns points so that the ego goes from left to right."""
    x, y = motion.x[0, 0], motion.y[0, 0]
    dx, dy = float(x[-1] - x[0]), float(y[-1] - y[0])
    angle = math.atan2(dy, dx) if math.hypot(dx, dy) > STANDS else float(motion.h[0, 0, 0])
    cosine, sine = math.cos(angle), math.sin(angle)
    return np.array([[cosine, -sine], [sine, cosine]])


def _turned(motion: Rollout, start: Float, turn: Float) -> Rollout:
    """Return the motion with the ego's way from left to right, from (0, 0) on."""
    points = (np.stack([motion.x, motion.y], axis=-1) - start) @ turn
    angle = math.atan2(turn[1, 0], turn[0, 0])
    return replace(motion, x=points[..., 0], y=points[..., 1], h=motion.h - angle)


def _camera(poses: Float, size: tuple[int, int]) -> Camera:
    """Return the view that holds poses (·, 3)."""
    low, high = poses[:, :2].min(axis=0), poses[:, :2].max(axis=0)
    wide, high_ = np.maximum(high - low + 2.0 * SPACE, LEAST * np.array([1.0, size[1] / size[0]]))
    x, y = (0.5 * (low + high)).tolist()
    return Camera(x, y, float(min(size[0] / wide, size[1] / high_)), (size[0] / 2, size[1] / 2))


def _moves(kind: str, values: list[str], timing: dict[str, str]) -> Markup:
    given = {"attributeName": "transform", "type": kind, "values": ";".join(values)}
    return element("animateTransform", **given, **timing)


def _carried(
    body: Entity,
    colour: str,
    poses: Float,
    there: Bool,
    view: View,
    timing: dict[str, str],
    *,
    above: bool,
    is_named: bool,
) -> Markup:
    """Return a body that goes through poses ``(n, 3)``, hidden while it is not there."""
    # The body is drawn at the origin, heading to the right; the animation carries it from there.
    alone, name = SvgDraw(SIZE, GROUND), SvgDraw(SIZE, GROUND)
    camera = Camera(0.0, 0.0, view.camera.scale, (0.0, 0.0))
    View(alone, camera, view.unit).body(body, np.zeros(3), colour)
    # Names of the ego and of who meets it would hide each other on one side of their bodies.
    off = 0.5 * body.length * camera.scale + 4.0 * view.unit
    place, anchor = (-off, "mb") if above else (off, "ma")
    if is_named:
        name.text((0.0, place), body.name, INK, view.font, anchor=anchor)
    at = [f"{u:.1f} {v:.1f}" for u, v in view.camera.of(poses)]
    turns = [f"{value:.1f}" for value in np.degrees(-np.unwrap(poses[:, 2]))]
    parts = [_moves("translate", at, timing)]
    if not there.all():
        values = ";".join("visible" if item else "hidden" for item in there)
        shows = {"attributeName": "visibility", "calcMode": "discrete", "values": values}
        parts.append(element("animate", **shows, **timing))
    turned = element("g", _moves("rotate", turns, timing), alone.inside())
    return element("g", *parts, turned, name.inside())
