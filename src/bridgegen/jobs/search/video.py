"""A scenario of a run, or of a file, as a film."""

from pathlib import Path

import numpy as np

from bridgegen.base.errors import InputError
from bridgegen.engine.options import PipelineOptions
from bridgegen.engine.pipeline import Pipeline
from bridgegen.jobs.search.restored import pipeline_of
from bridgegen.jobs.search.run import Run
from bridgegen.jobs.search.scenarios import load
from bridgegen.openx.openscenario.tier4 import is_storyboard
from bridgegen.pages.data import WHOLE
from bridgegen.pages.playback import Playback
from bridgegen.pages.playbacks import nominal_playback, playbacks
from bridgegen.pages.video import check_look, refuse_path, write_video
from bridgegen.results.store import Recorded, Store


def film(
    source: Path,
    out: Path | None = None,
    *,
    evaluation: int | None = None,
    size: tuple[int, int] = (960, 540),
    fps: int = 20,
    start: float | None = None,
    end: float | None = None,
    ego: str | None = None,
) -> Path:
    """Write a scenario as a film; return the file.

    Args:
        source: folder of a run, or an OpenSCENARIO file.
        out: the file; by default a GIF with the run's and the scenario's name, here.
        evaluation: which of a run, from 1; the worst exported scenario by default.
        size: of the picture, width and height [pixels].
        fps: frames per second.
        start: of the film [s]; see `write_video`.
        end: likewise.
        ego: of a run where a driver of the user's drives, that same driver; of a file any one.

    Raises:
        InputError: no such evaluation, it failed, none was exported, or a value out of bounds.
        StorageError: not a run, or the file cannot be written.
        FileFormatError: not a scenario file, or one that cannot be simulated.
    """
    check_look(size, fps)
    if out is not None:
        refuse_path(out)
    if is_storyboard(source):
        if evaluation is not None:
            raise InputError(f"{source}: is one scenario: --evaluation is for a run")
        out = out or Path(f"{source.stem}.gif")
        refuse_path(out)
        playback = _of_file(source, ego)
    else:
        playback, out = _of_run(source, out, evaluation, ego)
    write_video(playback, out, size=size, fps=fps, start=start, end=end)
    return out


def _of_file(path: Path, ego: str | None) -> Playback:
    scenario = load(path)
    options = PipelineOptions(ego=ego, causes=False)
    return nominal_playback(Pipeline(scenario, scenario.space(), options), path.stem)


def _of_run(
    folder: Path, out: Path | None, evaluation: int | None, ego: str | None
) -> tuple[Playback, Path]:
    """Return a scenario of a run, and the file to write."""
    run = Run(folder)
    with Store.open(run.folder) as store:
        rows = Recorded(store, whole=WHOLE)
        n, failed = len(rows), rows.status != 0
        if evaluation is not None and not 1 <= evaluation <= n:
            raise InputError(f"1 <= evaluation <= {n} must hold in {folder}, got {evaluation}")
        known = run.exported(n)
        if evaluation is None:
            if not known:
                raise InputError(_nothing(folder, run.metrics, rows))
            evaluation = known[0].evaluation + 1
        if failed[evaluation - 1]:
            raise InputError(f"{folder}: evaluation {evaluation} failed: it has no motion")
        names = {exported.evaluation: exported.name for exported in known}
        name = names.get(evaluation - 1, f"evaluation-{evaluation}")
        out = out or Path(f"{run.folder.resolve().name}-{name}.gif")
        refuse_path(out)
        pipeline = pipeline_of(run, "export --flavour video", ego=ego)
        (playback,) = playbacks(pipeline, rows, [(name, evaluation - 1, ())], brief=True)
    return playback, out


def _nothing(folder: Path, names: tuple[str, ...], rows: Recorded) -> str:
    """Return what to do where no scenario was exported."""
    problem = f"{folder}: no scenario was exported"
    gap = rows.metrics[:, names.index("d_min")] if "d_min" in names else np.empty(0)
    if not np.isfinite(gap).any():
        return f"{problem}; choose one with --evaluation"
    nearest = int(np.nanargmin(gap))
    return f"{problem}; the minimum distance is {gap[nearest]:.2f} m: --evaluation {nearest + 1}"
