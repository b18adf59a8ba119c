"""The report of a run on disk, as it stands."""

import shlex
from collections.abc import Mapping, Sequence
from pathlib import Path

from bridgegen.campaign.handover import FOLDER, MINIMAL, Kept
from bridgegen.campaign.run import REPORT
from bridgegen.campaign.settings import Settings
from bridgegen.confirmation.record import read_records
from bridgegen.disk import read_inside
from bridgegen.pipeline import Pipeline
from bridgegen.regions.record import JSON_FILE, read_record
from bridgegen.report.build import build_report
from bridgegen.report.data import ReportData
from bridgegen.report.page import write_report
from bridgegen.store import Recorded, Rows, Store
from bridgegen.store.summary import summarise
from bridgegen.triage.record import JSON_FILE as TRIAGE_FILE
from bridgegen.triage.record import Triage
from bridgegen.triage.record import read_record as read_triage


def write_run_report(
    pipeline: Pipeline,
    store: Store,
    settings: Settings,
    rows: Rows | Recorded,
    kept: Sequence[Kept],
) -> Path:
    """Write a run's report, its critical regions included if they are known; return its path.

    Args:
        pipeline: the run's.
        store: the run's.
        settings: of the run.
        rows: all of it, in order.
        kept: what was handed over, most critical first.

    Raises:
        StorageError: the page cannot be written.
        FileFormatError: the regions' file, or a confirmation's, is not one, or another run's.
    """
    path = store.folder / REPORT
    names = [*(name for one in kept for name in one.files), *minimal_files(store.folder)]
    files = {name: read_inside(store.folder, name) for name in names}
    data = run_data(pipeline, store, settings, rows, kept, files=files, more=True)
    write_report(path, data)
    return path


def run_data(
    pipeline: Pipeline,
    store: Store,
    settings: Settings,
    rows: Rows | Recorded,
    kept: Sequence[Kept],
    *,
    coverage: bool = True,
    files: Mapping[str, bytes] | None = None,
    more: bool = False,
) -> ReportData:
    """Return what the report of a run says.

    Args:
        pipeline: the run's.
        store: the run's.
        settings: of the run.
        rows: all of it, in order.
        kept: what was handed over, most critical first.
        coverage: whether to count what was covered.
        files: that were handed over, by their paths in the run's folder, if the page holds them.
        more: whether the page holds the motion of more than ``kept``.

    Raises:
        FileFormatError: the file of the triage, the regions or a confirmation is not one, or is
            another run's.
    """
    metric = store.metrics.index
    # Of a run that goes on, results change before they are read; they take time to digest.
    known = store.finished is not None or (store.folder / TRIAGE_FILE).is_file()
    results = rows.digest() if known else None
    summary = summarise(
        rows.critical, rows.status == 0,
        rows.metrics[:, metric("d_min")], rows.metrics[:, metric("v_d")], rows.cause,
        store.seconds,
    )  # fmt: skip
    return build_report(
        pipeline, rows, summary,
        kept=[(one.name, one.evaluation, one.files) for one in kept],
        algorithm=settings.algorithm, seed=settings.seed, budget=settings.budget,
        command=settings.command(store.folder), finished=store.finished is not None,
        version=store.version, notes=store.notes, view=view_command(store.folder),
        regions=read_record(store.folder / JSON_FILE),
        confirmations=read_records(store.folder, rows.X, rows.metrics), coverage=coverage,
        hashes=_hashes(settings, results), triage=_triage(store.folder, results),
        minimal_files=minimal_files(store.folder),
        files=files, more=more,
    )  # fmt: skip


def minimal_files(folder: Path) -> tuple[str, ...]:
    """Return the files of a run's minimal scenarios, relative to its folder."""
    found = {one.name for one in (folder / FOLDER).glob(f"{MINIMAL}*.*")}
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
    return shlex.join(["bridgegen", "view", str(folder)])
