"""The report of a run on disk."""

import shlex
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from bridgegen.base.disk import read_inside, refuse_other, write_whole
from bridgegen.base.errors import InputError, UnknownNameError
from bridgegen.engine.pipeline import Pipeline
from bridgegen.engine.replays import Replays
from bridgegen.jobs.search.exported import FOLDER, MINIMAL, Exported
from bridgegen.jobs.search.restored import pipeline_of
from bridgegen.jobs.search.run import Run
from bridgegen.jobs.search.settings import Settings
from bridgegen.pages.build import build_report
from bridgegen.pages.data import WHOLE, ReportData, only
from bridgegen.pages.packed import packed_files
from bridgegen.pages.page import report_page, write_report
from bridgegen.pages.templates import Banner, joined
from bridgegen.pages.thumbnails import Thumbnail, thumbnail, write_thumbnails
from bridgegen.results.confirmation.record import read_records
from bridgegen.results.store import Recorded, Rows, Store
from bridgegen.search.regions.record import JSON_FILE, read_record
from bridgegen.search.triage.fresh import FRESH, failing_draws
from bridgegen.search.triage.record import JSON_FILE as TRIAGE_FILE
from bridgegen.search.triage.record import Triage
from bridgegen.search.triage.record import read_record as read_triage
from bridgegen.simulation.choice import EMBEDDED

SENSITIVITY = "sensitivity.html"
"""File of a run's folder: the page of the sensitivity of its verdicts."""

MOST_SENT = 1_000_000
"""Maximum length of a page that is sent [bytes]: what any mail and any tracker takes."""


def rewrite_report(run: Run, pipeline: Pipeline, stage: Callable[[str], None]) -> tuple[Path, ...]:
    """Write the report of a run again, as it stands, if there is one; return the file.

    Args:
        run: on disk.
        pipeline: the run's.
        stage: called with "report" before it begins.

    Raises:
        StorageError, FileFormatError: see `write_run_report`.
    """
    if not run.report.is_file():
        return ()
    stage("report")
    with Store.open(run.folder) as store:
        rows = Recorded(store, whole=(*WHOLE, *pipeline.monitor.names))
        return (write_run_report(pipeline, Run.of(store, rows), rows, run.exported(len(rows))),)


def write_run_report(
    pipeline: Pipeline,
    run: Run,
    rows: Rows | Recorded,
    exported: Sequence[Exported],
    replays: Replays | None = None,
) -> Path:
    """Write a run's report, its critical regions included if they are known; return its path.

    Args:
        pipeline: the run's.
        run: as these rows stand.
        rows: all of it, in order.
        exported: its exported scenarios, most critical first.
        replays: of these scenarios, if they have been simulated.

    Raises:
        StorageError: the page cannot be written.
        FileFormatError: the regions' file, or a confirmation's, is damaged, or another run's.
    """
    names = [*(name for item in exported for name in item.files), *further_files(run.folder)]
    files = {name: read_inside(run.folder, name) for name in names}
    data = run_data(pipeline, run, rows, exported, files=files, more=True, replays=replays)
    write_report(run.report, data)
    write_thumbnails(run.folder, [_thumbnail(data)])
    return run.report


def finding_page(pipeline: Pipeline, run: Run, rows: Rows | Recorded, name: str) -> bytes:
    """Return the report on one exported scenario: a file to send, with all that it is made of.

    Args:
        pipeline: the run's.
        run: as these rows stand.
        rows: all of it, in order.
        name: of the scenario ("0007").

    Raises:
        UnknownNameError: no such scenario was exported.
        InputError: the page would exceed `MOST_SENT`.
    """
    exported = run.exported(len(rows))
    files = {
        path: read_inside(run.folder, path)
        for item in exported
        if item.name == name
        for path in item.files
    }
    data = only(run_data(pipeline, run, rows, exported, coverage=True, files=files), name)
    if data is None:
        raise UnknownNameError(f"scenario of {run.folder}", name, [item.name for item in exported])
    (playback,) = data.kept
    given = ["--ego", pipeline.driver.name] if pipeline.driver.is_own else []
    simulator = run.settings.simulator.name
    given += ["--simulator", simulator] if simulator != EMBEDDED.name else []
    found = playback.conflict.summary.bare if playback.conflict else f"Scenario {name}"
    text = f"{found[:1].upper()}{found[1:]}. Save its files from this page and simulate them:"
    command = shlex.join(["bridgegen", "simulate", f"{name}.xosc", *given])
    banner = Banner(
        text, "fails" if playback.critical else "", "FAILS" * playback.critical, command
    )
    trail = ["crash", f"scenario {name} of {run.folder.resolve().name}"]
    page = report_page(data, verdict=banner, trail=trail)
    held = packed_files(files)["names"]
    if len(page) > MOST_SENT or len(held) < len(files):
        kinds = joined([f"{path} ({len(text):,} bytes)" for path, text in files.items()])
        raise InputError(
            f"{run.folder}: scenario {name} is too large for a page of {MOST_SENT:,} bytes: {kinds}"
            f"; send its files: bridgegen export {run.folder} --flavour resolved --scenario {name}"
        )
    return page


def write_finding_page(
    folder: Path, name: str | None = None, out: Path | None = None, *, ego: str | None = None
) -> Path:
    """Write the report on one exported scenario as one file that can be sent; return the file.

    Args:
        folder: of the run.
        name: of the scenario; by default the most critical one.
        out: the page (.html); by default ``RUN-SCENARIO.html``, here.
        ego: where a driver of the user's drives, that same driver.

    Raises:
        UnknownNameError: no such scenario was exported.
        InputError: the run has exported none, or the page would be too large.
        StorageError: not a run, or the file cannot be written.
    """
    run = Run(folder)
    if not (exported := run.exported()):
        raise InputError(f"{folder}: no critical scenario was exported, so there is none to send")
    name = name or exported[0].name
    out = out or Path(f"{run.folder.resolve().name}-{name}.html")
    refuse_other(out, "bridgegen search", "page")
    pipeline = pipeline_of(run, "export", ego=ego)
    with Store.open(run.folder) as store:
        rows = Recorded(store, whole=(*WHOLE, *pipeline.monitor.names))
        page = finding_page(pipeline, Run.of(store, rows), rows, name)
    write_whole(out, [page])
    return out


def _thumbnail(data: ReportData) -> Thumbnail | None:
    """Return the picture of the gravest failure mode that is exported, or of the worst scenario."""
    played = {playback.name: playback for playback in data.kept}
    modes = data.triage.modes if data.triage is not None else ()
    for mode in sorted(modes, key=lambda mode: -mode.severity):
        for name in mode.exports:
            if name in played:
                return thumbnail(played[name], mode.title)
    worst = next((playback for playback in data.kept if playback.critical), None)
    return thumbnail(worst, "the most critical scenario") if worst is not None else None


def run_data(
    pipeline: Pipeline,
    run: Run,
    rows: Rows | Recorded,
    exported: Sequence[Exported],
    *,
    coverage: bool = True,
    files: Mapping[str, bytes] | None = None,
    more: bool = False,
    replays: Replays | None = None,
) -> ReportData:
    """Return the data of a run's report.

    Args:
        pipeline: the run's.
        run: as these rows stand.
        rows: all of it, in order.
        exported: its exported scenarios, most critical first.
        coverage: whether to count the coverage of the search space.
        files: the exported files, by their paths in the run's folder, if the page holds them.
        more: whether the page holds the motion of other scenarios, too.
        replays: of the exported scenarios, if they have been simulated.

    Raises:
        FileFormatError: the file of the triage, the regions or a confirmation is damaged, or
            another run's.
    """
    settings, folder = run.settings, run.folder
    # The results of a run that is being searched change before they are read; digesting is slow.
    known = run.finished or (folder / TRIAGE_FILE).is_file()
    results = rows.digest() if known else None
    triage = _triage(folder, results)
    return build_report(
        pipeline, rows, run.summary,
        kept=[(item.name, item.evaluation, item.files) for item in exported], replays=replays,
        algorithm=settings.algorithm, seed=settings.seed, budget=settings.budget,
        command=settings.command(folder), finished=run.finished,
        version=run.version, notes=run.notes, view=view_command(folder),
        keep=settings.keep_command(folder),
        simulated=(settings.simulated(), settings.simulated(driver=False)),
        regions=read_record(folder / JSON_FILE),
        confirmations=read_records(folder, rows.X, rows.metrics), coverage=coverage,
        hashes=_hashes(settings, results), triage=triage,
        drawn=failing_draws(pipeline.space, triage, max(settings.keep, 1)),
        further_files=further_files(folder),
        files=files, more=more, happening=run.happening,
        # A page that is served or sent has no files beside it.
        beside=(SENSITIVITY,) if more and (folder / SENSITIVITY).is_file() else (),
    )  # fmt: skip


def further_files(folder: Path) -> tuple[str, ...]:
    """Return the files of a run's minimal scenarios and fresh draws, relative to its folder."""
    found = {
        path.name for kind in (MINIMAL, FRESH) for path in (folder / FOLDER).glob(f"{kind}*.*")
    }
    stems = sorted({name.partition(".")[0] for name in found})
    names = [f"{stem}.{kind}" for stem in stems for kind in ("owl", "xodr", "xosc", "json")]
    return tuple(f"{FOLDER}/{name}" for name in names if name in found)


def _triage(folder: Path, results: str | None) -> Triage | None:
    """Return the triage of these results; None where the run has grown since it was made."""
    found = read_triage(folder / TRIAGE_FILE)
    return found if found is not None and found.results == results else None


def _hashes(settings: Settings, results: str | None) -> dict[str, str]:
    found = {"Scenario, SHA-256": settings.fingerprint}
    if settings.map_digest is not None:
        found["Map, SHA-256"] = settings.map_digest
    if results is not None:
        found["Results, SHA-256"] = f"{results} (the command above gives the same)"
    return found


def view_command(folder: Path) -> str:
    """Return the command line that serves a run's page."""
    return shlex.join(["bridgegen", "open", str(folder)])
