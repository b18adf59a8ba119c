"""The report of a run on disk, as it stands."""

import shlex
from collections.abc import Mapping, Sequence
from pathlib import Path

from bridgegen.campaign.handover import Kept
from bridgegen.campaign.run import REPORT
from bridgegen.campaign.settings import Settings
from bridgegen.confirmation.record import read_records
from bridgegen.pipeline import Pipeline
from bridgegen.regions.record import JSON_FILE, read_record
from bridgegen.report.build import build_report
from bridgegen.report.data import ReportData
from bridgegen.report.page import write_report
from bridgegen.store import Rows, Store
from bridgegen.store.summary import summarise


def write_run_report(
    pipeline: Pipeline, store: Store, settings: Settings, rows: Rows, kept: Sequence[Kept]
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
    files = {name: (store.folder / name).read_bytes() for one in kept for name in one.files}
    data = run_data(pipeline, store, settings, rows, kept, files=files, more=True)
    write_report(path, data)
    return path


def run_data(
    pipeline: Pipeline,
    store: Store,
    settings: Settings,
    rows: Rows,
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
        FileFormatError: the regions' file, or a confirmation's, is not one, or another run's.
    """
    metric = store.metrics.index
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
        hashes=_hashes(settings, rows), files=files, more=more,
    )  # fmt: skip


def _hashes(settings: Settings, rows: Rows) -> dict[str, str]:
    found = {"Scenario, SHA-256": settings.fingerprint}
    if settings.map_digest is not None:
        found["Map, SHA-256"] = settings.map_digest
    return {**found, "Results, SHA-256": f"{rows.digest()} (the command above gives the same)"}


def view_command(folder: Path) -> str:
    """Return the command line that serves a run's page."""
    return shlex.join(["bridgegen", "view", str(folder)])
