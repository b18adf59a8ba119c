"""What the playback of one scenario is made of: the motion, the road, and what is around it.

All in SI units; NaN or an infinity stands where a quantity does not exist.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import inf, isfinite

import numpy as np
import numpy.typing as npt

from bridgegen.assess.conflict.summary import ConflictSummary
from bridgegen.base.arrays import Bool, Float, Int, as_float
from bridgegen.pages.picture import Picture

AREA_KINDS = frozenset({"driving", "junction", "shoulder", "sidewalk", "median", "stripe"})
LINE_KINDS = frozenset({"edge", "solid", "broken", "centre", "stop", "route", "sign"})

NO_ROW = -1
"""The evaluation of a playback that is no row of the run."""


@dataclass(frozen=True)
class Entity:
    """A body on the road; its position is its reference point, the rear axle's of a vehicle.

    Attributes:
        name: "ego", "bv" …
        length: box length [m].
        width: box width [m].
        center_ahead: how far the box's centre lies ahead of the reference point [m].
        type: what it is: "car", "truck", "bicycle", "pedestrian", "cone" …
    """

    name: str
    length: float
    width: float
    center_ahead: float
    type: str = "car"

    def __post_init__(self) -> None:
        if not (0.0 < self.length < inf and 0.0 < self.width < inf and isfinite(self.center_ahead)):
            raise ValueError(
                f"box of '{self.name}' [m] must have length > 0, width > 0 and a finite centre, "
                f"got {self.length}, {self.width}, {self.center_ahead}"
            )


@dataclass(frozen=True)
class Lamp:
    """A traffic light and what it shows.

    Attributes:
        x: [m].
        y: [m].
        h: the direction of the traffic that it is for [rad].
        states: ``(T,)``: 0 off, 1 red, 2 red and yellow, 3 yellow, 4 green; others are words of
            the file that are no state of three lamps.
        name: its id in the road network; may be empty.
    """

    x: float
    y: float
    h: float
    states: npt.NDArray[np.int8]
    name: str = ""


@dataclass(frozen=True)
class Outline:
    """One polyline of the road's picture.

    Attributes:
        kind: an area (closed by itself, filled): one of ``AREA_KINDS``; or a line: "edge" (border
            of the asphalt), "solid" and "broken" (between lanes of one direction), "centre"
            (between the directions), "stop" (stop line), "sign" (seen from above), "route" (where
            an entity wants to go).
        points: ``(n, 2)`` float64 [m], n ≥ 2, x east and y north, in the entities' frame.
    """

    kind: str
    points: Float

    def __post_init__(self) -> None:
        if self.kind not in AREA_KINDS | LINE_KINDS:
            known = ", ".join(sorted(AREA_KINDS | LINE_KINDS))
            raise ValueError(f"kind of an outline must be one of {known}; got '{self.kind}'")
        as_float(f"points of a '{self.kind}' outline [m]", self.points, (None, 2))
        if len(self.points) < 2:
            raise ValueError(f"a '{self.kind}' outline needs 2 points, got {len(self.points)}")


@dataclass(frozen=True)
class Weather:
    """The weather from an instant on, as sensors and tyres feel it.

    Attributes:
        step: the instant.
        stated: the physical quantities of `bridgegen.scenario.weather.COLUMNS`, by name.
        sight: how far one sees: meteorological optical range in fog, rain and snow [m].
        background: luminance of the ground [cd/m²].
    """

    step: int
    stated: Mapping[str, float]
    sight: float
    background: float


@dataclass(frozen=True)
class Sensed:
    """The ego's detections of the others, in the F instants with a frame.

    Attributes:
        steps: ``(F,)`` int64, these instants, ascending.
        seen_by: ``(E, F)`` int64: -1 not applicable (the ego, an absent entity), 0 missed, then
            the sensor, as `bridgegen.drivers.kinds` numbers it.
        counts: ``(E, F)`` bool, whether the metrics of perception count it: it is within the range
            of its class.
        x: ``(E, F)`` float64 [m], of the detected box's centre, NaN where nothing was detected.
        y: ``(E, F)`` float64 [m], likewise; and so all that follow.
        h: ``(E, F)`` float64 [rad].
        length: ``(E, F)`` float64 [m].
        width: ``(E, F)`` float64 [m].
        confidence: ``(E, F)`` float64, 0 to 1.
        kind: ``(E, F)`` int64, what it was taken for, an index of ``kinds``; -1 for nothing.
        kinds: the words for it.
        kind_of: ``(E,)`` int64, what each is, likewise.
        tolerance: a detection whose centre is farther off than this is displaced [m].
        ghosts: ``(G, F, 8)`` float64, false positives, where nothing is; see `Rollout.ghosts`.
    """

    steps: Int
    seen_by: Int
    counts: Bool
    x: Float
    y: Float
    h: Float
    length: Float
    width: Float
    confidence: Float
    kind: Int
    kinds: tuple[str, ...]
    kind_of: Int
    tolerance: float
    ghosts: Float = field(default_factory=lambda: np.zeros((0, 0, 8)))


@dataclass(frozen=True)
class Course:
    """Where the ego means to go, and how fast, at P instants.

    Attributes:
        ways: lines ``(n, 2)`` [m] that its reference point follows.
        steps: ``(P,)`` int64, the instants, ascending.
        way: ``(P,)`` int64, which of the ways; -1 where it follows none.
        station: ``(P,)`` float64, how far along it [m].
        acceleration: ``(P,)`` float64 [m/s²], as planned; NaN where unknown.
        shift: ``(P, 4)`` float64: how far left of the way it means to be [m] before and after a
            change of lanes, where that begins along the way, and its length [m].
    """

    ways: tuple[Float, ...]
    steps: Int
    way: Int
    station: Float
    acceleration: Float
    shift: Float


@dataclass(frozen=True)
class Planned:
    """A trajectory that the ego's driver planned.

    Attributes:
        step: the instant at which it planned it.
        seconds: how far it looks ahead [s].
        points: ``(n, 2)`` float64 [m], of the reference point, at equal intervals of that time.
    """

    step: int
    seconds: float
    points: Float


@dataclass(frozen=True)
class Conflict:
    """The decisive conflict of a scenario, and where it is in the motion.

    Attributes:
        summary: what happened, with all figures.
        partner: number of the other participant; of a departure that of the vehicle itself.
        instant: of contact, or of the least time to collision.
        decided: instant at which the risk arose that decides on responsibility.
        zones: of the ego and of the other, `bridgegen.assess.conflict.types.Zone` each.
        vehicle: number of the ego, or of the further vehicle of its driver whose conflict it is.
    """

    summary: ConflictSummary
    partner: int
    instant: int
    decided: int
    zones: tuple[int, int]
    vehicle: int = 0


@dataclass(frozen=True)
class Beside:
    """The motion of the same scenario with another driver of the ego.

    Attributes:
        label: of that driver.
        entities: ``(n,)`` whose motion differs, numbers of the playback's entities.
        x: ``(n, T)`` float64 [m], rear axle; NaN where an entity is not there.
        y: ``(n, T)`` float64 [m], likewise.
        h: ``(n, T)`` float64 [rad].
    """

    label: str
    entities: tuple[int, ...]
    x: Float
    y: Float
    h: Float


@dataclass(frozen=True)
class Playback:
    """One kept scenario, recorded: E entities over T instants, instant k at ``k · time_step``.

    Attributes:
        name: its name in the run folder ("0001").
        rank: 1 for the most critical.
        evaluation: its row in ``Evaluations``, from 0; `NO_ROW` of a fresh random draw.
        parameters: all parameters' values, in the units of the columns of the same name.
        metrics: all metrics' values, likewise.
        critical: whether it counts as critical.
        time_step: seconds between two instants.
        entities: E bodies, the ego first.
        x: ``(E, T)`` float64 [m], rear axle; NaN where an entity is not there.
        y: ``(E, T)`` float64 [m], likewise.
        h: ``(E, T)`` float64 [rad], heading, counter-clockwise from +x, continuous.
        v: ``(E, T)`` float64 [m/s].
        distance: ``(T,)`` float64 [m], from the ego's box to the nearest other, 0 at contact;
            +inf if there is no other.
        lanes: the road, drawn in the order given (areas first). Playbacks on the same road should
            share one tuple: the page then holds it once.
        n_steps: in 1..T, how many instants are real.
        files: paths of its files relative to the page ("critical/0001.xosc").
        picture: its individuals in five columns, if they are to be shown.
        lamps: the traffic lights.
        cause: the quick label of its cause; may be empty.
        a: ``(E, T)`` float64 [m/s²], forward acceleration from each instant on; None: not known.
        ttc: ``(T,)`` float64 [s], the ego's least time to collision; None: not known.
        sensed: what the ego's sensors made of the others; None where it perceives nothing.
        course: of the ego, as planned; None where unknown.
        plans: the trajectories that its driver planned, ascending; empty where it plans none.
        weather: from the start on, and whenever it changes; empty: not known.
        street_lights: ``(n, 2)`` float64 [m].
        conflict: the decisive one; None if there is none, or it was not analysed.
        shows: ``(E, T)`` int8, indicators and brake lights, see `bridgegen.drivers.kinds`; None:
            not known.
        beside: the same scenario with other drivers, drawn in outline.
    """

    name: str
    rank: int
    evaluation: int
    parameters: Mapping[str, float]
    metrics: Mapping[str, float]
    critical: bool
    time_step: float
    entities: tuple[Entity, ...]
    x: Float
    y: Float
    h: Float
    v: Float
    distance: Float
    lanes: tuple[Outline, ...]
    n_steps: int
    files: tuple[str, ...] = ()
    picture: Picture | None = None
    lamps: tuple[Lamp, ...] = ()
    cause: str = ""
    a: Float | None = None
    ttc: Float | None = None
    sensed: Sensed | None = None
    course: Course | None = None
    plans: tuple[Planned, ...] = ()
    weather: tuple[Weather, ...] = ()
    street_lights: Float | None = None
    conflict: Conflict | None = None
    shows: npt.NDArray[np.int8] | None = None
    beside: tuple[Beside, ...] = ()

    def __post_init__(self) -> None:
        place = f"playback '{self.name}'"
        if not self.entities:
            raise ValueError(f"{place} needs an entity, the ego")
        shape = (len(self.entities), self.x.shape[-1] if self.x.ndim else 0)
        for axis, unit in (("x", "m"), ("y", "m"), ("h", "rad"), ("v", "m/s")):
            as_float(f"{axis} [{unit}] of {place}", getattr(self, axis), shape, finite=False)
        as_float(f"distance [m] of {place}", self.distance, shape[1:], finite=False)
        if self.a is not None:
            as_float(f"a [m/s²] of {place}", self.a, shape, finite=False)
        if self.ttc is not None:
            as_float(f"ttc [s] of {place}", self.ttc, shape[1:], finite=False)
        if not 1 <= self.n_steps <= shape[1]:
            raise ValueError(f"n_steps of {place} must be in 1..{shape[1]}, got {self.n_steps}")
        if not 0.0 < self.time_step < inf:
            raise ValueError(f"time_step [s] of {place} must be > 0, got {self.time_step}")
