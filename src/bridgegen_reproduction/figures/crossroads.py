"""Where the ego and the background vehicle collide, on the crossroads: the paper's C1 to C4."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from bridgegen.base.arrays import Float
from bridgegen.jobs import search as campaign
from bridgegen.jobs.search.restored import pipeline_of
from bridgegen.pages.playback import AREA_KINDS, Outline
from bridgegen.pages.scenery import Scenery
from bridgegen.scenario.language.scenario import LogicalScenario
from bridgegen.simulation.accidents import accidents
from bridgegen_reproduction.figures.look import SIZE, WIDE, Theme, blank, legend
from bridgegen_reproduction.paper import DESIGNS, POINTS
from bridgegen_reproduction.runs import Run

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MOST = 240
"""Collisions of a scenario that are drawn, evenly taken from all."""

HALF = 31.0
"""Half of a panel's side [m]."""


@dataclass(frozen=True)
class Crossing:
    """A scenario on its crossroads.

    Attributes:
        scenario: name.
        road: the drawing of its roads.
        ways: of the ego and of the background vehicle, ``(T, 2)`` float64 [m] each.
        ends: the names of their first and last points.
        collisions: ``(n, 2)`` float64 [m], the middle of the overlap at each first contact.
        of: how many critical scenarios with a collision these were taken from.
        middle: of the crossroads [m].
    """

    scenario: str
    road: tuple[Outline, ...]
    ways: tuple[Float, Float]
    ends: tuple[tuple[str, str], tuple[str, str]]
    collisions: Float
    of: int
    middle: tuple[float, float]


def crossing_of(folder: Path, runs: Sequence[Run]) -> Crossing:
    """Return where the collisions of some runs happened, by replaying an even choice of them.

    Args:
        folder: of any run of the scenario: how it was made.
        runs: of the scenario, in any order that is always the same.

    Raises:
        StorageError: the run cannot be read.
    """
    pipeline = pipeline_of(campaign.Run(folder), "reproduce")
    scenario = pipeline.scenario
    assert isinstance(scenario, LogicalScenario)
    X = np.concatenate([run.X[run.collision] for run in runs])
    chosen = X[np.unique(np.linspace(0, len(X) - 1, MOST).astype(np.int64))] if len(X) else X
    places = []
    if len(chosen):
        rollout = pipeline.rollout(chosen)
        for row in range(len(chosen)):
            found = [
                accident
                for accident in accidents(rollout, row)
                if accident.who[0] == rollout.names[0]
            ]
            places += [(accident.x, accident.y) for accident in found[:1]]
    x = pipeline.space.row({})
    # How they drive while the other is not in the way: each gets as far as it can.
    limits = scenario.parameters
    when, near = limits["bv_trigger_time"], limits["bv_trigger_distance"]
    bv, ego = limits["bv_speed"], limits["ego_speed"]
    alone = [
        {"ego_speed": ego.high, "bv_trigger_time": when.high, "bv_trigger_distance": near.low},
        {"ego_speed": ego.low, "bv_trigger_time": when.low, "bv_speed": bv.high},
    ]
    nominal = pipeline.rollout(np.stack([pipeline.space.row(values) for values in alone]))
    ways = tuple(
        np.column_stack([array[e, e, : nominal.n_steps[e]] for array in (nominal.x, nominal.y)])
        for e in (0, 1)
    )
    road = Scenery(pipeline.runner).road(x).outlines
    junction = [outline.points for outline in road if outline.kind == "junction"]
    middle = np.concatenate(junction).mean(axis=0) if junction else ways[0].mean(axis=0)
    ends = tuple(_points(scenario, name) for name in nominal.names[:2])
    return Crossing(
        scenario.name,
        road,
        (ways[0], ways[1]),
        (ends[0], ends[1]),
        np.array(places).reshape(-1, 2),
        len(X),
        (float(middle[0]), float(middle[1])),
    )


def _points(scenario: LogicalScenario, name: str) -> tuple[str, str]:
    participant = scenario.participant(name)
    assert participant.end is not None
    return POINTS[participant.start.leg, participant.start.way], POINTS[
        participant.end.leg, participant.end.way
    ]


def collision_points(crossings: Mapping[str, Crossing], theme: Theme) -> "Figure":
    """Draw each scenario's roads, routes and collisions in a panel of its own, S1 first."""
    from matplotlib.lines import Line2D

    across = min(2, len(crossings))
    down = -(-len(crossings) // across)
    figure = blank(WIDE if across > 1 else WIDE / 2, 3.5 * down + 0.35, theme)
    for k, name in enumerate(sorted(crossings)):
        axes = figure.add_subplot(down, across, k + 1)
        _panel(axes, crossings[name], theme)
    ego, bv, hit = theme.colours[0], theme.colours[4], theme.colours[1]
    legend(
        figure,
        [
            Line2D([], [], color=ego, linewidth=2, label="ego"),
            Line2D(
                [], [], color=bv, linewidth=2, linestyle=(0, (4, 1.5)), label="background vehicle"
            ),
            Line2D(
                [], [], color=hit, marker="o", linestyle="none", markersize=4, label="collision"
            ),
            Line2D(
                [],
                [],
                color=theme.ink,
                marker="X",
                linestyle="none",
                markersize=6,
                label="their median",
            ),
        ],
        theme,
    )
    return figure


def _panel(axes: "Axes", crossing: Crossing, theme: Theme) -> None:
    design = DESIGNS[crossing.scenario]
    axes.set_facecolor(theme.paper)
    _road(axes, crossing, theme)
    colours, lines = (theme.colours[0], theme.colours[4]), ("-", (0, (4, 1.5)))
    edges = (2.5, 7.0)  # m; the names of points on neighbouring lanes do not hide each other
    for way, colour, line, ends, edge in zip(
        crossing.ways, colours, lines, crossing.ends, edges, strict=True
    ):
        x, y = (way - crossing.middle).T
        axes.plot(x, y, color=colour, linestyle=line, linewidth=2)
        inside = np.flatnonzero((np.abs(x) < HALF - edge) & (np.abs(y) < HALF - edge))
        if len(inside):
            for at, label in zip((inside[0], inside[-1]), ends, strict=True):
                axes.text(
                    x[at],
                    y[at],
                    label,
                    ha="center",
                    va="center",
                    fontsize=SIZE,
                    color=theme.paper,
                    fontweight="bold",
                    zorder=6,
                    bbox={"boxstyle": "round,pad=0.25", "facecolor": colour, "edgecolor": "none"},
                )
    told = "no collision"
    if len(crossing.collisions):
        x, y = (crossing.collisions - crossing.middle).T
        axes.plot(
            x,
            y,
            "o",
            color=theme.colours[1],
            markersize=3.4,
            alpha=0.5,
            markeredgewidth=0,
            zorder=4,
        )
        cx, cy = np.median(x), np.median(y)
        axes.plot(cx, cy, "X", color=theme.ink, markersize=7, markeredgecolor=theme.paper, zorder=7)
        axes.annotate(
            design.conflict,
            (cx, cy),
            (9, 9),
            textcoords="offset points",
            fontsize=SIZE + 3,
            fontweight="bold",
            color=theme.ink,
            zorder=7,
            bbox={
                "boxstyle": "round,pad=0.15",
                "facecolor": theme.paper,
                "alpha": 0.8,
                "edgecolor": "none",
            },
        )
        told = f"{len(crossing.collisions):,} of {crossing.of:,} collisions"
    axes.set_title(f"S{crossing.scenario[-1]}: {told}", fontsize=SIZE + 1, color=theme.ink)
    axes.set_xlim(-HALF, HALF)
    axes.set_ylim(-HALF, HALF)
    axes.set_aspect("equal")
    axes.tick_params(colors=theme.muted, labelsize=SIZE - 1)
    axes.set_xlabel("east of the middle [m]", fontsize=SIZE, color=theme.ink)
    axes.set_ylabel("north [m]", fontsize=SIZE, color=theme.ink)
    for spine in axes.spines.values():
        spine.set_color(theme.muted)


def _road(axes: "Axes", crossing: Crossing, theme: Theme) -> None:
    for shape in crossing.road:
        x, y = (shape.points - crossing.middle).T
        if shape.kind in AREA_KINDS:
            if shape.kind in ("driving", "junction", "shoulder"):
                axes.fill(x, y, color=theme.grid, linewidth=0.5, zorder=0)
            continue
        style = "--" if shape.kind == "broken" else "-"
        width = {"edge": 0.9, "stop": 2.0}.get(shape.kind, 0.6)
        axes.plot(x, y, color=theme.muted, linestyle=style, linewidth=width, zorder=1)
