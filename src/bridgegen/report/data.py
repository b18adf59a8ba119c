"""What the report is made of: plain data in SI units, checked for shape when it is made.

Numbers may be NaN or infinite wherever a quantity does not exist (no critical scenario yet, no
time to collision); the page shows a dash there.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from math import inf, isfinite
from typing import Any

import numpy as np
import numpy.typing as npt

from bridgegen.arrays import Bool, Float, Int, as_float
from bridgegen.odd.coverage import CoverageMap
from bridgegen.report.notes import NoteTable
from bridgegen.report.picture import Picture

AREA_KINDS = frozenset({"driving", "junction", "shoulder", "sidewalk", "median", "stripe"})
LINE_KINDS = frozenset({"edge", "solid", "broken", "centre", "stop", "route", "sign"})


@dataclass(frozen=True)
class RunSummary:
    """What was searched, how, and what came of it.

    Attributes:
        scenario: the logical scenario's name ("crossroads-s4").
        title: the same for people ("Left turn into the path of a crossing car").
        description: one or two sentences more; may be empty.
        road: where it was searched ("generated crossroads", "Town05, junction 965").
        ego: the system under test ("route-follower").
        algorithm: the search algorithm's name ("pso").
        seed: the seed of the whole run.
        budget: evaluations that were asked for.
        n_evaluations: evaluations done, failed ones included.
        n_critical: how many of them are critical.
        r_critic: critical evaluations / all evaluations, in [0, 1]; NaN before the first.
        critical_rule: what counts as critical, in words that finish "critical means …"
            ("a collision, or d_min below 2 m while v_d is at least 1 m/s").
        critical_distance: the rule's threshold on d_min [m], drawn in the distance curve; None
            draws no line.
        first_critical: evaluations until the first critical one (1 = the very first), or None.
        fiftieth_critical: evaluations until the 50th, or None.
        d_min_best: smallest d_min of the run [m].
        d_min_median: median d_min [m].
        v_d_best: largest v_d of the run [m/s].
        v_d_median: median v_d [m/s].
        wall_seconds: time that the search took [s], all sessions of a resumed run together.
        finished: False if the run was interrupted before its budget.
        version: BridgeGen's version.
        command: the exact command line that starts this run again.
        started: when the run began, as ISO 8601 text; may be empty.
        view: the command line that shows this run's page with the motion of every scenario.
        settings: further settings worth keeping, name → text, in display order.
    """

    scenario: str
    title: str
    description: str
    road: str
    ego: str
    algorithm: str
    seed: int
    budget: int
    n_evaluations: int
    n_critical: int
    r_critic: float
    critical_rule: str
    critical_distance: float | None
    first_critical: int | None
    fiftieth_critical: int | None
    d_min_best: float
    d_min_median: float
    v_d_best: float
    v_d_median: float
    wall_seconds: float
    finished: bool
    version: str
    command: str
    started: str = ""
    view: str = ""
    settings: Mapping[str, str] | None = None


@dataclass(frozen=True)
class Column:
    """One quantity of every evaluation.

    Attributes:
        name: the parameter's, metric's or objective's name, unique over all columns.
        unit: "m", "m/s", "%", "deg", "s", "count" …; "1" or "" for a pure number.
        values: ``(N,)`` float64 in that unit; NaN or ±inf where it does not exist.
        description: one line for people; may be empty.
        low: lower end of the declared range, in the unit; None where there is none.
        high: upper end.
        searched: a parameter that the algorithm varied; False for fixed and derived ones.
    """

    name: str
    unit: str
    values: Float
    description: str = ""
    low: float | None = None
    high: float | None = None
    searched: bool = False


@dataclass(frozen=True)
class Evaluations:
    """All N evaluations of a run, in the order in which they were made.

    Attributes:
        iteration: ``(N,)`` int64, the batch that each row belongs to, counted from 0, ascending.
        parameters: all parameters, searched, fixed and derived.
        metrics: all recorded metrics; the page's charts and lists expect ``d_min`` [m] and
            ``v_d`` [m/s] among them and show ``n_collision`` and ``ttc`` where they exist.
        objectives: columns of F, minimised.
        critical: ``(N,)`` bool.
        status: ``(N,)`` int64, 0 is success; every other row is counted but not drawn.
        cause: ``(N,)``, a `bridgegen.cause.Cause` each; None where causes were not sought.
    """

    iteration: Int
    parameters: tuple[Column, ...]
    metrics: tuple[Column, ...]
    objectives: tuple[Column, ...]
    critical: Bool
    status: Int
    cause: npt.NDArray[np.int8] | None = None

    def __post_init__(self) -> None:
        n = self.iteration.size
        names = [column.name for column in self.columns]
        if len(set(names)) != len(names):
            twice = sorted({name for name in names if names.count(name) > 1})
            raise ValueError(f"column names must be unique, got {', '.join(twice)} twice")
        for column in self.columns:
            as_float(f"{column.name} [{column.unit}]", column.values, (n,), finite=False)
        arrays = {"critical": self.critical, "status": self.status, "cause": self.cause}
        for name, array in arrays.items():
            if array is not None and array.shape != (n,):
                raise ValueError(f"{name} must have shape {(n,)}, got {array.shape}")
        if n and (self.iteration[1:] < self.iteration[:-1]).any():
            raise ValueError("iteration must ascend")

    @property
    def columns(self) -> tuple[Column, ...]:
        """Parameters, metrics and objectives, in this order."""
        return self.parameters + self.metrics + self.objectives


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
        states: ``(T,)``: 0 off, 1 red, 2 red and yellow, 3 yellow, 4 green.
    """

    x: float
    y: float
    h: float
    states: npt.NDArray[np.int8]


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
class Playback:
    """One kept scenario, recorded: E entities over T instants, instant k at ``k · time_step``.

    Attributes:
        name: its name in the run folder ("0001").
        rank: 1 for the most critical.
        evaluation: its row in ``Evaluations``, from 0.
        parameters: all parameters' values, in the units of the columns of the same name.
        metrics: all metrics' values, likewise.
        critical: whether it counts as critical.
        cause: what its harm is put down to; may be empty.
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

    def __post_init__(self) -> None:
        place = f"playback '{self.name}'"
        if not self.entities:
            raise ValueError(f"{place} needs an entity, the ego")
        shape = (len(self.entities), self.x.shape[-1] if self.x.ndim else 0)
        for axis, unit in (("x", "m"), ("y", "m"), ("h", "rad"), ("v", "m/s")):
            as_float(f"{axis} [{unit}] of {place}", getattr(self, axis), shape, finite=False)
        as_float(f"distance [m] of {place}", self.distance, shape[1:], finite=False)
        if not 1 <= self.n_steps <= shape[1]:
            raise ValueError(f"n_steps of {place} must be in 1..{shape[1]}, got {self.n_steps}")
        if not 0.0 < self.time_step < inf:
            raise ValueError(f"time_step [s] of {place} must be > 0, got {self.time_step}")


@dataclass(frozen=True)
class ReportData:
    """All that ``page.write_report`` needs.

    Attributes:
        summary: the run in figures.
        evaluations: every row.
        kept: the scenarios that were handed over, most critical first; may be empty.
        coverage: which bins and pairs of bins were evaluated, if it is to be shown.
        notes: what the algorithm learnt.
        regions: the critical ones, as `bridgegen.regions.record` has them, if they are known.
    """

    summary: RunSummary
    evaluations: Evaluations
    kept: tuple[Playback, ...] = ()
    coverage: CoverageMap | None = None
    notes: tuple[NoteTable, ...] = ()
    regions: Mapping[str, Any] | None = None

    def __post_init__(self) -> None:
        n = self.evaluations.iteration.size
        for playback in self.kept:
            if not 0 <= playback.evaluation < n:
                raise ValueError(
                    f"evaluation of playback '{playback.name}' must be in 0..{n - 1}, "
                    f"got {playback.evaluation}"
                )
