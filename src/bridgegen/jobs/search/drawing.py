"""A run as a figure: its critical scenarios in parameter space, and the worst one over time."""

import io
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure

from bridgegen.assess.metrics.metric import distance
from bridgegen.base.arrays import Bool, Float
from bridgegen.base.errors import BridgeGenError
from bridgegen.drivers import is_spec
from bridgegen.engine.simulate import simulate_file
from bridgegen.simulation.choice import EMBEDDED
from bridgegen.simulation.rollout import Rollout

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from bridgegen.jobs.search.run import Run

MOST_POINTS = 5000
"""Maximum number of evaluations drawn, evenly spread; all critical ones up to as many."""

GREY, RED, BLUE = "#9aa5b1", "#d55e00", "#0072b2"


class ShownFigure(Figure):
    """A figure that a notebook shows, whether it has set up matplotlib or not."""

    def _repr_png_(self) -> bytes:
        image = io.BytesIO()
        self.savefig(image, format="png", dpi=100)
        return image.getvalue()


def draw(run: "Run") -> ShownFigure:
    """Return the figure of a run; see `bridgegen.Run.plot`."""
    worst = worst_rollout(run)
    figure = ShownFigure(figsize=(9.0 if worst else 5.0, 3.8), layout="constrained")
    axes = figure.subplots(1, 2 if worst else 1, squeeze=False)[0]
    _draw_space(run, axes[0])
    if worst is not None:
        _draw_worst(worst, run.scenarios[0].stem, axes[1])
    return figure


def worst_rollout(run: "Run") -> Rollout | None:
    """Return the motion of the most critical exported scenario, simulated again.

    None where there is none, where another simulator ran it, or where a driver of the user's own
    would have to be imported, which happens only if it is asked for.
    """
    if not run.scenarios or is_spec(run.settings.ego) or run.settings.simulator != EMBEDDED:
        return None
    try:
        return simulate_file(run.scenarios[0]).rollout
    except BridgeGenError:
        return None  # files that were edited or moved: the rest of the figure stands


def _draw_space(run: "Run", axes: "Axes") -> None:
    """Draw the evaluations over the two parameters that matter most for their failures."""
    rows = run.rows()
    names = run.parameters
    first, second = _telling(rows.X, rows.critical, [names.index(name) for name in _needed(run)])
    for chosen, colour, label in (
        (~rows.critical, GREY, "not critical"),
        (rows.critical, RED, "critical"),
    ):
        at = np.flatnonzero(chosen)
        at = at[:: max(1, -(-len(at) // MOST_POINTS))]
        x, y = rows.X[at, first], rows.X[at, second]
        axes.plot(x, y, ".", color=colour, markersize=4, label=label)
    axes.set(xlabel=names[first], ylabel=names[second])
    n = int(rows.critical.sum())
    axes.set_title(f"{n} critical of {len(rows)} evaluations", fontsize="medium")
    axes.legend(fontsize="small", frameon=False)


def _needed(run: "Run") -> list[str]:
    """Return the parameters that the worst failure mode needs, most important first."""
    if not run.modes:
        return []
    worst = max(run.modes, key=lambda one: (one.severity, one.harm))
    return [] if worst.minimal is None else [one.name for one in worst.minimal.conditions]


def _telling(X: Float, critical: Bool, needed: Sequence[int]) -> tuple[int, int]:
    """Return two columns: those needed; then those whose critical values' mean differs most."""
    spread = X.std(axis=0)
    score = np.where(spread > 0.0, 0.0, -1.0)
    if critical.any() and not critical.all():
        apart = np.abs(X[critical].mean(axis=0) - X[~critical].mean(axis=0))
        score = np.where(spread > 0.0, apart / np.where(spread > 0.0, spread, 1.0), -1.0)
    score[needed] = np.inf
    first = [*needed, *np.argsort(-score, kind="stable").tolist()]
    columns = list(dict.fromkeys(first))
    return columns[0], columns[min(1, len(columns) - 1)]


def _draw_worst(rollout: Rollout, name: str, axes: "Axes") -> None:
    """Draw speeds and the distance to the nearest participant over time."""
    n = int(rollout.n_steps[0])
    time = np.arange(n) * rollout.time_step
    axes.plot(time, rollout.v[0, 0, :n], color=BLUE, label="speed of the ego [m/s]")
    gap = distance(rollout)[0, 1:, :n].min(axis=0, initial=np.inf)
    if np.isfinite(gap).any():
        axes.plot(time, np.where(np.isfinite(gap), gap, np.nan), color=RED, label="distance [m]")
    axes.set(xlabel="time [s]", ylim=(0.0, 1.5 * max(float(rollout.v[0, 0, :n].max()), 5.0)))
    axes.set_title(f"the worst scenario, {name}", fontsize="medium")
    axes.legend(fontsize="small", frameon=False)
