"""A run as a notebook shows it: figures, a few sentences, and the worst scenario's playback."""

import base64
import html
import io
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from markupsafe import Markup
from matplotlib.figure import Figure

from bridgegen.assess.criteria import headline as judged
from bridgegen.assess.metrics.metric import distance
from bridgegen.base.arrays import Bool, Float
from bridgegen.base.errors import BridgeGenError
from bridgegen.drivers import is_spec
from bridgegen.engine.simulate import simulate_file
from bridgegen.pages.moving import EVERY, moving_picture
from bridgegen.simulation.choice import EMBEDDED
from bridgegen.simulation.rollout import Rollout

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from bridgegen.jobs.search.run import Run

# --- A run as a figure: its critical scenarios in parameter space, and the worst one over time ---


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
    path, worst = _worst(run), worst_rollout(run)
    figure = ShownFigure(figsize=(9.0 if worst else 5.0, 3.8), layout="constrained")
    axes = figure.subplots(1, 2 if worst else 1, squeeze=False)[0]
    _draw_space(run, axes[0])
    if path is not None and worst is not None:
        _draw_worst(worst, path.stem, axes[1])
    return figure


def _worst(run: "Run") -> Path | None:
    """Return the file of the most critical exported scenario: a draw where these alone fail."""
    return next(iter((*run.fresh_scenarios, *run.scenarios)), None)


def worst_rollout(run: "Run") -> Rollout | None:
    """Return the motion of the most critical exported scenario, simulated again.

    None where there is none, where another simulator ran it, or where a driver of the user's own
    would have to be imported, which happens only if it is asked for.
    """
    path = _worst(run)
    # A notebook that shows a run must not import code that the run's folder names.
    if not path or is_spec(run.settings.ego) or run.settings.simulator != EMBEDDED:
        return None
    try:
        return simulate_file(path).rollout
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
        # Evenly over the run: the same figure each time.
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
    worst = max(run.modes, key=lambda mode: (mode.severity, mode.harm))
    return (
        [] if worst.minimal is None else [condition.name for condition in worst.minimal.conditions]
    )


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


MOST_STATES = 300
MOST_ENTITIES = 30
"""Largest number of entities of a playback, so that a notebook stays small."""

_PLAYER = """<!doctype html><meta charset="utf-8"><style>
body{margin:0;font:13px system-ui,sans-serif;color:#17202c;background:#fff}
svg{display:block;width:100%;height:260px;background:#dfe5da}
div{display:flex;gap:.6em;align-items:center;padding:.4em}input{flex:1}
</style>PICTURE<div><button id="b">Play</button>
<input id="t" type="range" min="0" max="SECONDS" step="any" value="FIRST" aria-label="time">
<span id="s"></span></div>
<script>
const v=document.querySelector("svg"),t=document.getElementById("t");
const b=document.getElementById("b"),s=document.getElementById("s");let timer=0;
function say(){s.textContent=(+t.value).toFixed(2)+" s"}
t.oninput=()=>{v.setCurrentTime(+t.value);say()};
b.onclick=()=>{if(timer){clearInterval(timer);timer=0;v.pauseAnimations();b.textContent="Play";return}
v.unpauseAnimations();b.textContent="Stop";
timer=setInterval(()=>{t.value=v.getCurrentTime()%t.max;say()},50)};
v.pauseAnimations();t.oninput()</script>"""


def run_html(run: "Run") -> str:
    """Return a run as HTML: its size is bounded whatever the run's is."""
    from bridgegen.search.triage.words import headline, shortly

    s, found = run.summary, run.triage
    parts = [f"<p><b>{html.escape(run.settings.scenario)}</b>, ego {html.escape(run.settings.ego)}"]
    parts.append(f": {s.critical} critical of {s.evaluations} evaluations.</p>")
    if text := judged(run.settings.ego, run.criteria):
        parts.append(f"<p><b>{html.escape(text)}</b></p>")
    if found is not None:
        parts.append(f"<p>{html.escape(headline(found))}</p>")
        modes = [f"<li>{html.escape(shortly(mode))}</li>" for mode in found.modes[:10]]
        parts.append(f"<ul>{''.join(modes)}</ul>" if modes else "")
    data = base64.b64encode(draw(run)._repr_png_()).decode()
    parts.append(f'<img alt="The run in figures" src="data:image/png;base64,{data}">')
    worst = worst_rollout(run)
    if worst is not None:
        page = html.escape(player(worst), quote=True)
        parts.append(
            '<iframe sandbox="allow-scripts" title="Playback of the worst scenario" '
            f'style="width:100%;height:310px;border:1px solid #ccc" srcdoc="{page}"></iframe>'
        )
    parts.append(f"<p>Whole report: <code>{html.escape(str(run.report))}</code></p>")
    return "".join(parts)


def player(rollout: Rollout) -> str:
    """Return a page that plays the first scenario of a rollout, seen from above."""
    n = int(rollout.n_steps[0])
    seconds = (n - 1) * rollout.time_step
    closest = _closest(rollout, n)
    gaps = rollout.distance[0, :, min(closest, n - 1)]
    picture = moving_picture(
        rollout,
        int(gaps[:MOST_ENTITIES].argmin()) if np.isfinite(gaps[:MOST_ENTITIES]).any() else 0,
        closest * rollout.time_step,
        "the worst scenario, from above",
        every=max(EVERY, seconds / MOST_STATES),
        most=MOST_ENTITIES,
        follow=40.0,
    )
    first = f"{closest * rollout.time_step:.2f}"
    page = _PLAYER.replace("SECONDS", f"{seconds:.2f}").replace("FIRST", first)
    # The picture fills the frame, whatever its width: on a phone its ends are cut, not its scale.
    filling = picture.replace("<svg", Markup('<svg preserveAspectRatio="xMidYMid slice"'), 1)
    return page.replace("PICTURE", filling)


def _closest(rollout: Rollout, n: int) -> int:
    """Return the instant at which another participant is closest to the ego."""
    return int(distance(rollout)[0, 1:, :n].min(axis=0, initial=np.inf).argmin())
