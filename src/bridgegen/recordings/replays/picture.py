"""A recorded event as a moving picture: SVG that needs no script."""

import math
from collections.abc import Iterator
from dataclasses import replace
from html import escape

import numpy as np

from bridgegen.base.arrays import Bool, Float
from bridgegen.simulation.rollout import Rollout

WIDTH, HEIGHT = 900, 320
EVERY = 0.2  # s, between two states of the picture
SPACE = 12.0  # m, around both paths
LEAST = 30.0  # m, that the picture shows
STANDS = 1.0  # m; over a shorter way the ego's heading says where it goes


def moving_picture(motion: Rollout, other: int, when: float, caption: str) -> str:
    """Return the picture of an event, seen from above, over and over.

    Args:
        motion: N = 1; the ego is entity 0.
        other: the entity that the conflict is with.
        when: of the conflict [s].
        caption: what the picture says to those who do not see it.
    """
    motion = _turned(motion)
    step = max(1, round(EVERY / motion.time_step))
    at = np.arange(0, motion.shape[2], step)
    seconds = float((at[-1] - at[0]) * motion.time_step)
    x, y, h = (getattr(motion, name)[0][:, at] for name in ("x", "y", "h"))
    there = motion.present[0][:, at] if motion.present.size else np.ones(x.shape, np.bool_)
    view = _view(motion, other)
    moment = int(np.clip(round(when / motion.time_step), 0, motion.shape[2] - 1))
    parts = [
        f'<svg viewBox="{" ".join(f"{value:.1f}" for value in view)}" width="{WIDTH}" '
        f'height="{HEIGHT}" role="img" aria-label="{escape(caption, quote=True)}">',
        '<g transform="scale(1,-1)">',
        *(_path(motion, e, view[2]) for e in (other, 0)),
    ]
    order = [*(e for e in range(1, len(motion.names)) if e != other), other, 0]
    for e in order:
        looks = "ego" if e == 0 else "partner" if e == other else "by"
        outline = _box(motion.box[e])
        if e in (0, other):
            place = motion.x[0, e, moment], motion.y[0, e, moment], motion.h[0, e, moment]
            parts.append(
                f'<path class="{looks} then" d="{outline}" transform="translate({place[0]:.2f} '
                f'{place[1]:.2f}) rotate({np.degrees(place[2]):.1f})"/>'
            )
        parts += _moving(looks, outline, motion.names[e], (x[e], y[e], h[e]), there[e], seconds)
    return "".join((*parts, "</g></svg>"))


def _turned(motion: Rollout) -> Rollout:
    """Return the motion with the ego's way from left to right, from (0, 0) on."""
    x, y = motion.x[0, 0], motion.y[0, 0]
    dx, dy = float(x[-1] - x[0]), float(y[-1] - y[0])
    angle = math.atan2(dy, dx) if math.hypot(dx, dy) > STANDS else float(motion.h[0, 0, 0])
    cosine, sine = math.cos(angle), math.sin(angle)
    to_x, to_y = motion.x - x[0], motion.y - y[0]
    return replace(
        motion, x=to_x * cosine + to_y * sine, y=to_y * cosine - to_x * sine, h=motion.h - angle
    )


def _view(motion: Rollout, other: int) -> tuple[float, float, float, float]:
    """Return the part of the plane that is shown: left, top, width, height, y down."""
    x, y = motion.x[0][[0, other]], motion.y[0][[0, other]]
    if motion.present.size:
        there = motion.present[0][[0, other]]
        x, y = x[there], y[there]
    middle = 0.5 * (x.max() + x.min()), 0.5 * (y.max() + y.min())
    wide = max(float(np.ptp(x)) + 2.0 * SPACE, LEAST)
    high = max(float(np.ptp(y)) + 2.0 * SPACE, LEAST * HEIGHT / WIDTH)
    wide, high = max(wide, high * WIDTH / HEIGHT), max(high, wide * HEIGHT / WIDTH)
    return middle[0] - 0.5 * wide, -middle[1] - 0.5 * high, wide, high


def _path(motion: Rollout, e: int, wide: float) -> str:
    there = motion.present[0, e] if motion.present.size else np.ones(motion.shape[2], np.bool_)
    ahead = motion.box[e, 2]
    x = motion.x[0, e] + ahead * np.cos(motion.h[0, e])
    y = motion.y[0, e] + ahead * np.sin(motion.h[0, e])
    points = " ".join(f"{a:.2f},{b:.2f}" for a, b in zip(x[there], y[there], strict=True))
    looks = "ego" if e == 0 else "partner"
    return f'<polyline class="{looks}" points="{points}" style="stroke-width:{wide / 600.0:.3f}"/>'


def _box(box: Float) -> str:
    """Return the outline of a body around its reference point, its front a point."""
    length, width, ahead = box.tolist()
    rear, front, side = ahead - 0.5 * length, ahead + 0.5 * length, 0.5 * width
    nose = front - 0.25 * width
    return f"M{rear:.2f} {-side:.2f}H{nose:.2f}L{front:.2f} 0L{nose:.2f} {side:.2f}H{rear:.2f}Z"


def _moving(
    looks: str, outline: str, name: str, places: tuple[Float, Float, Float], there: Bool,
    seconds: float,
) -> Iterator[str]:  # fmt: skip
    timing = f'dur="{max(seconds, EVERY):.2f}s" repeatCount="indefinite"'
    x, y, h = places
    moves = ";".join(f"{a:.2f} {b:.2f}" for a, b in zip(x, y, strict=True))
    turns = ";".join(f"{value:.1f}" for value in np.degrees(np.unwrap(h)))
    yield f"<g><title>{escape(name)}</title>"
    if not there.all():
        shows = ";".join("visible" if one else "hidden" for one in there)
        yield f'<animate attributeName="visibility" calcMode="discrete" values="{shows}" {timing}/>'
    yield (
        f'<animateTransform attributeName="transform" type="translate" values="{moves}" {timing}/>'
        f'<g><animateTransform attributeName="transform" type="rotate" values="{turns}" {timing}/>'
        f'<path class="{looks}" d="{outline}"/></g></g>'
    )
