"""Thumbnails: the decisive seconds of a scenario, kept with its results as numbers, drawn as SVG.

A result's folder keeps them as ``thumbnails.json``, so that other pages (a dashboard, say) show
them without simulating anything. A folder may come from others: what it holds is numbers within
bounds, and all SVG is made here.
"""

from collections.abc import Iterable
from pathlib import Path
from typing import Annotated, Self

import numpy as np
from markupsafe import Markup
from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from bridgegen.assess.conflict.analysis import CONTACT
from bridgegen.assess.conflict.findings import KINDS
from bridgegen.base.arrays import Bool, Float
from bridgegen.base.disk import write_whole
from bridgegen.base.errors import BridgeGenError, FileFormatError, StorageError
from bridgegen.base.records import read_model
from bridgegen.pages.birdseye import GROUND, HIT, PLAYERS, Camera, View, centre_of
from bridgegen.pages.charts import element
from bridgegen.pages.playback import AREA_KINDS, LINE_KINDS, Entity, Outline, Playback
from bridgegen.pages.svg import SvgDraw

FILE = "thumbnails.json"

SIZE = (180, 110)
"""Width and height [pixels]."""

BEFORE, AFTER, EVERY = 3.0, 1.0, 0.2
"""Time that is kept before and after the decisive instant, and between two states [s]."""

MARGIN, LEAST, MOST = 5.0, 24.0, 44.0
"""Space about both bodies, and least and largest width of what is seen [m]."""

LEAST_SCALE = 3.4
"""Least scale [pixels per metre]: a small picture shows less, and not smaller bodies."""

RING = 4.0
"""Radius of the ring where bodies touch [m]: both are seen in it."""

MOST_POINTS, MOST_BODIES, MOST_KEPT = 150, 3, 50
"""Largest numbers of points of the road, of bodies, and of thumbnails of a folder."""

MOST_BYTES = 8_000
"""Largest size of a thumbnail that is written; one of the catalogue's takes 1 to 4 kB."""

_DROPPED = frozenset({"edge", "route", "sign", "shoulder", "sidewalk"})
"""Outlines that a picture of this size is clearer without."""

_UNIT = 0.6  # pixels of a line that is one pixel wide in a picture of 960 pixels

FARTHEST = 1e6
"""Largest distance from the middle of the picture [m]."""

Metres = Annotated[float, Field(ge=-FARTHEST, le=FARTHEST, allow_inf_nan=False)]
Text = Annotated[str, Field(max_length=500)]


class _Model(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class Body(_Model):
    """A body, and where it is.

    Attributes:
        type: of the participant.
        box: length, width, and how far its middle is ahead of its reference point [m].
        poses: x [m], y [m] and heading [rad], every ``EVERY`` seconds.
    """

    type: Text
    box: tuple[
        Annotated[float, Field(gt=0.0, le=100.0)], Annotated[float, Field(gt=0.0, le=100.0)], Metres
    ]
    poses: Annotated[tuple[tuple[Metres, Metres, Metres], ...], Field(min_length=1, max_length=60)]


class Shape(_Model):
    """A part of the road.

    Attributes:
        kind: see `bridgegen.pages.playback.Outline`.
        points: x and y [m].
    """

    kind: Text
    points: Annotated[
        tuple[tuple[Metres, Metres], ...], Field(min_length=2, max_length=MOST_POINTS)
    ]

    @model_validator(mode="after")
    def _known(self) -> Self:
        if self.kind not in AREA_KINDS | LINE_KINDS:
            raise ValueError(f"kind must be one of {', '.join(sorted(AREA_KINDS | LINE_KINDS))}")
        return self


class Thumbnail(_Model):
    """The decisive seconds of a scenario: the middle of the picture is (0, 0), x to the right.

    Attributes:
        entry: of a suite, by name; "" of a run.
        ego: of a suite, as named; "" of a run.
        caption: what it shows.
        width: of what is seen [m].
        moment: the decisive instant, a number of a pose.
        contact: where bodies touch at that instant; None if they do not.
        bodies: the ego, then the one that it meets; all have the same number of poses.
        road: areas first.
    """

    entry: Text = ""
    ego: Text = ""
    caption: Text
    width: Annotated[float, Field(ge=1.0, le=1e3)]
    moment: Annotated[int, Field(ge=0)]
    contact: tuple[Metres, Metres] | None = None
    bodies: Annotated[tuple[Body, ...], Field(min_length=1, max_length=MOST_BODIES)]
    road: Annotated[tuple[Shape, ...], Field(max_length=MOST_POINTS)]

    @model_validator(mode="after")
    def _together(self) -> Self:
        lengths = {len(body.poses) for body in self.bodies}
        if len(lengths) > 1 or self.moment >= min(lengths):
            raise ValueError("bodies must have the same poses, and the moment must be one of them")
        if sum(len(shape.points) for shape in self.road) > MOST_POINTS:
            raise ValueError(f"the road must have at most {MOST_POINTS} points")
        return self


class _Thumbnails(_Model):
    thumbnails: Annotated[tuple[Thumbnail, ...], Field(max_length=MOST_KEPT)]


def write_thumbnails(folder: Path, some: Iterable[Thumbnail | None]) -> None:
    """Keep thumbnails with a result, or none: those that were kept before are removed.

    Raises:
        StorageError: they cannot be written.
    """
    found = [item for item in some if item is not None]
    found = [item for item in found if len(item.model_dump_json()) <= MOST_BYTES][:MOST_KEPT]
    if not found:
        try:
            (folder / FILE).unlink(missing_ok=True)
        except OSError as error:
            raise StorageError(f"{folder / FILE}: cannot be removed: {error.strerror}") from None
        return
    text = _Thumbnails(thumbnails=tuple(found)).model_dump_json(exclude_defaults=True)
    write_whole(folder / FILE, [text.encode()])


def read_thumbnails(folder: Path) -> tuple[Thumbnail, ...]:
    """Return the thumbnails of a result; none where there are none, or they are damaged.

    They are a saving, not a result: what is wrong with them costs a picture.
    """
    path = folder / FILE
    try:
        # A link may lead out of the project, and a dashboard reads many such files.
        if path.is_symlink() or path.stat().st_size > MOST_KEPT * MOST_BYTES:
            return ()
        found = read_model(path, _Thumbnails, _damaged)
    except (BridgeGenError, OSError, ValueError):
        return ()
    return found.thumbnails if found is not None else ()


def _damaged(path: Path, why: str) -> FileFormatError:
    return FileFormatError(f"{path}: is damaged: {why}")


# --- A playback → a thumbnail ---


def thumbnail(
    playback: Playback, caption: str, *, entry: str = "", ego: str = ""
) -> Thumbnail | None:
    """Return the thumbnail of a playback; None where the ego is not there at the decisive instant.

    None, too, where a number is beyond the bounds (a body of 300 m): it would not be read again.

    Args:
        playback: of the scenario.
        caption: what it shows; may be cut.
        entry: of a suite.
        ego: of a suite.
    """
    try:
        return _thumbnail(playback, caption, entry, ego)
    except ValidationError:
        return None


def _thumbnail(playback: Playback, caption: str, entry: str, ego: str) -> Thumbnail | None:
    poses = np.stack([playback.x, playback.y, playback.h], axis=-1)[:, : playback.n_steps]
    there = np.asarray(np.isfinite(poses).all(axis=-1))  # (E, T)
    conflict, distance = playback.conflict, playback.distance[: playback.n_steps]
    if conflict is not None:
        vehicle, partner, instant = conflict.vehicle, conflict.partner, conflict.instant
    else:  # the closest approach, and the one that is nearest then
        vehicle, instant = 0, int(np.nan_to_num(distance, nan=np.inf).argmin())
        far = np.hypot(*np.moveaxis(poses[:, instant, :2] - poses[0, instant, :2], -1, 0))
        partner = int(np.nan_to_num(far[1:], nan=np.inf).argmin()) + 1 if len(far) > 1 else 0
    both = there[vehicle] & there[partner]
    if instant >= len(both) or not both[instant]:
        return None
    step = max(1, round(EVERY / playback.time_step))
    at = _window(both, instant, step, playback.time_step)
    # The ego comes from the left: all pictures read alike.
    h = float(poses[vehicle, at[0], 2])
    turn = np.array([[np.cos(h), -np.sin(h)], [np.sin(h), np.cos(h)]])
    pair = list(dict.fromkeys([vehicle, partner]))
    middle = poses[pair, instant, :2].mean(axis=0)
    seen = (poses[pair][:, at, :2].reshape(-1, 2) - middle) @ turn
    reach = np.abs(seen).max(axis=0) + MARGIN
    width = float(np.clip(2.0 * max(reach[0], reach[1] * SIZE[0] / SIZE[1]), LEAST, MOST))
    near = np.hypot(*np.moveaxis(poses[:, instant, :2] - middle, -1, 0))
    others = [
        e
        for e in np.argsort(near).tolist()
        if e not in pair and there[e, at].all() and near[e] < 0.5 * width
    ]
    bodies = []
    for e in [*pair, *others][:MOST_BODIES]:
        body = playback.entities[e]
        xy = (poses[e, at, :2] - middle) @ turn
        turned = np.column_stack([xy, np.unwrap(poses[e, at, 2] - h)])
        box = (body.length, body.width, body.center_ahead)
        bodies.append(Body(type=body.type, box=box, poses=_rounded(turned, 2)))
    is_contact = (
        conflict is not None and partner != vehicle and conflict.summary.conflict == KINDS[CONTACT]
    )
    return Thumbnail(
        entry=entry[:500],
        ego=ego[:500],
        caption=caption[:500],
        width=round(width, 1),
        moment=int(np.searchsorted(at, instant)),
        contact=_contact(bodies, int(np.searchsorted(at, instant))) if is_contact else None,
        bodies=tuple(bodies),
        road=_road(playback.lanes, middle, turn, width),
    )


def _window(both: Bool, instant: int, step: int, time_step: float) -> list[int]:
    """Return the instants that are kept, the decisive one among them, while both are there."""
    absent = np.flatnonzero(~both)
    first = max([instant - round(BEFORE / time_step), 0, *(absent[absent < instant] + 1).tolist()])
    after = absent[absent > instant] - 1
    last = min([instant + round(AFTER / time_step), len(both) - 1, *after.tolist()])
    before = [*range(instant, first - 1, -step)][::-1]
    return [*before, *range(instant + step, last + 1, step)]


def _contact(bodies: list[Body], moment: int) -> tuple[float, float]:
    """Return the corner, of two bodies, that is nearest to both middles."""
    view = View(SvgDraw(SIZE, GROUND), Camera(0.0, 0.0, 100.0, (0.0, 0.0)))
    poses = [np.array(body.poses[moment]) for body in bodies[:2]]
    boxes = [_entity(body) for body in bodies[:2]]
    corners = np.concatenate([view.corners(*pair) for pair in zip(boxes, poses, strict=True)])
    middles = [centre_of(*pair) for pair in zip(boxes, poses, strict=True)]
    far = sum(np.hypot(*(corners - middle).T) for middle in middles)
    x, y = corners[int(np.argmin(far))].round(1).tolist()
    return x, y


def _road(lanes: Iterable[Outline], middle: Float, turn: Float, width: float) -> tuple[Shape, ...]:
    """Return what is seen of a road, simplified until it has few points, then without lines."""
    from bridgegen.pages.playbacks import thin

    camera = Camera(0.0, 0.0, SIZE[0] / width, (SIZE[0] / 2, SIZE[1] / 2))
    seen = [
        Outline(lane.kind, (lane.points - middle) @ turn)
        for lane in lanes
        if lane.kind not in _DROPPED
    ]
    seen = [lane for lane in seen if camera.sees(lane.points)]
    found: list[Outline] = []
    for tolerance in (0.1, 0.3, 1.0, 3.0):
        found = [Outline(lane.kind, thin(lane.points, tolerance)) for lane in seen]
        if sum(len(lane.points) for lane in found) <= MOST_POINTS:
            break
    found.sort(key=lambda lane: lane.kind not in AREA_KINDS)
    shapes, points = [], 0
    for lane in found:
        points += len(lane.points)
        if points > MOST_POINTS:
            break
        shapes.append(Shape(kind=lane.kind, points=_rounded(lane.points, 1)))
    return tuple(shapes)


def _rounded(table: Float, digits: int) -> tuple[tuple[float, ...], ...]:
    # Adding 0.0 makes -0.0 a 0.0, which is shorter.
    return tuple(map(tuple, (table.round(digits) + 0.0).tolist()))


def _entity(body: Body) -> Entity:
    return Entity("", *body.box, type=body.type)


# --- A thumbnail → SVG that plays without script ---


def drawn(shown: Thumbnail, id: str, size: tuple[int, int] = SIZE) -> Markup:
    """Return a thumbnail: still, until somebody points at it, taps it or moves the focus to it.

    It stands at the decisive instant; where a reader wants less motion, always
    (``web/still.css``).

    Args:
        shown: it.
        id: of the element, unique in the page.
        size: width and height [pixels].
    """
    draw = SvgDraw(size, GROUND)
    scale = max(size[0] / shown.width, LEAST_SCALE)
    camera = Camera(0.0, 0.0, scale, (size[0] / 2, size[1] / 2))
    view = View(draw, camera, _UNIT * size[0] / SIZE[0])
    view.road(Outline(shape.kind, np.array(shape.points)) for shape in shown.road)
    # The two that meet lie over all others, the ego over both.
    players = [*zip(shown.bodies, PLAYERS, strict=False)][::-1]
    still = [_body(body, colour, shown.moment, view, "") for body, colour in players]
    plays = [_body(body, colour, shown.moment, view, id) for body, colour in players]
    draw.add(element("g", *still, class_="still"))
    draw.add(element("g", *plays, class_="plays"))
    if shown.contact is not None:
        ((u, v),) = camera.of(np.array([shown.contact]))
        draw.circle((u, v), RING * camera.scale, outline=HIT, width=max(round(2.5 * view.unit), 1))
    more = {"id": id, "class": "birdseye thumbnail", "tabindex": "0"}
    return Markup(draw.svg(size, shown.caption, is_file=False, **more))


def _body(body: Body, colour: str, moment: int, view: View, plays: str) -> Markup:
    """Return a body at an instant, which an event at the element ``plays`` moves."""
    alone = SvgDraw((1, 1), GROUND)
    origin = Camera(0.0, 0.0, view.camera.scale, (0.0, 0.0))
    View(alone, origin, view.unit).body(_entity(body), np.zeros(3), colour)
    poses = np.array(body.poses)
    at = [f"{u:.1f} {v:.1f}" for u, v in view.camera.of(poses)]
    turns = [f"{value:.0f}" for value in np.degrees(-poses[:, 2])]
    moves = [Markup(), Markup()]
    if plays and len(at) > 1:
        timing = {
            "dur": f"{(len(at) - 1) * EVERY:.1f}s",
            "repeatCount": "indefinite",
            "restart": "whenNotActive",
            "begin": ";".join(f"{plays}.{event}" for event in ("mouseenter", "focusin", "click")),
            "end": ";".join(f"{plays}.{event}" for event in ("mouseleave", "focusout")),
            "attributeName": "transform",
        }
        moves = [
            element("animateTransform", type=kind, values=";".join(values), **timing)
            for kind, values in (("translate", at), ("rotate", turns))
        ]
    # A parent that does not turn: each animation replaces the whole transform of its element.
    turned = element("g", moves[1], alone.inside(), transform=f"rotate({turns[moment]})")
    return element("g", moves[0], turned, transform=f"translate({at[moment]})")
