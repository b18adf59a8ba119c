"""The evaluations of runs for other tools: a Parquet file for each run, whole or a sample.

DuckDB, Polars, pandas and Spark read a folder of such files as one table. A run of any length is
written in row groups.
"""

import json
from collections.abc import Sequence
from hashlib import blake2b
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from bridgegen.assess.cause import Cause
from bridgegen.assess.conflict.findings import COLUMNS
from bridgegen.base.arrays import Float, Int
from bridgegen.base.disk import writing_whole
from bridgegen.base.errors import InputError, StorageError
from bridgegen.base.extras import require
from bridgegen.jobs.search.run import Run
from bridgegen.jobs.search.settings import Settings
from bridgegen.results.store import Rows, Store

if TYPE_CHECKING:
    import pyarrow as pa

CHUNK = 65_536
"""Number of rows that are written at a time: a row group of the file."""

RUN = ("run", "scenario", "algorithm", "seed", "ego", "simulator")
"""Columns of the run: the name of its folder, and its settings."""

WEIGHT = "weight"
"""The column with the number of the run's rows that a row represents."""


def write_tables(
    runs: Sequence[Path | str], out: Path | str, *, sample: float = 1.0
) -> tuple[Path, ...]:
    """Write the evaluations of runs, finished or not; a file that is there is replaced.

    A sample contains all critical and all failed rows, and others by a pseudo-random choice that
    depends on the row alone.

    Args:
        runs: folders with distinct names.
        out: a folder; ``out/NAME.parquet`` is written for each.
        sample: the share of the other rows, in (0, 1].

    Returns:
        The files.

    Raises:
        InputError: two runs of one name, a share out of range, or no package pyarrow.
        StorageError: not a run, or a file that cannot be written.
    """
    if not 0.0 < sample <= 1.0:
        raise InputError(f"0 < sample <= 1 must hold, got {sample:g}")
    require("parquet", "a table in Parquet")
    folders = {Path(run).resolve().name: Path(run) for run in runs}
    if len(folders) < len(runs):
        names = [Path(run).resolve().name for run in runs]
        twice = sorted({name for name in names if names.count(name) > 1})
        raise InputError(f"runs must have names that differ, got twice: {', '.join(twice)}")
    target = Path(out)
    try:
        target.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise StorageError(f"{target}: cannot be made: {error.strerror}") from None
    return tuple(
        _write(name, folder, target / f"{name}.parquet", sample) for name, folder in folders.items()
    )


def _write(name: str, folder: Path, path: Path, sample: float) -> Path:
    import pyarrow as pa
    import pyarrow.parquet as parquet

    with Store.open(folder) as store:
        settings = Run.of(store).settings
        of_run = dict(zip(RUN, _run_values(name, settings), strict=True))
        schema = _schema(store, of_run, settings, sample)
        with (
            writing_whole(path) as file,
            parquet.ParquetWriter(file, schema, compression="zstd") as writer,
        ):
            for rows in store.rows(chunk=CHUNK):
                kept, weight = _kept(rows, sample)
                columns = _columns(store, of_run, rows.take(kept), weight)
                writer.write_table(pa.table(columns, schema=schema))
    return path


def _run_values(name: str, settings: Settings) -> tuple[str | int, ...]:
    scenario = Path(settings.scenario).stem
    simulator = settings.simulator.name
    return name, scenario, settings.algorithm, settings.seed, settings.ego, simulator


def _schema(store: Store, of_run: dict[str, Any], settings: Settings, sample: float) -> "pa.Schema":
    import pyarrow as pa

    columns, text = store.columns, pa.dictionary(pa.int32(), pa.string())
    fields = [
        (name, pa.int64() if isinstance(item, int) else text) for name, item in of_run.items()
    ]
    fields += [("id", pa.int64()), ("batch", pa.int64()), ("seconds", pa.float64())]
    named = {name for name, label in _labels(store) if "words" in label}
    fields += [(name, text if name in named else pa.float64()) for name in columns.X]
    fields += [(name, pa.float64()) for name in (*columns.metrics, *columns.F)]
    fields += [("status", pa.int16()), ("critical", pa.bool_())]
    fields += [*((name, text) for name in ("cause", *COLUMNS)), (WEIGHT, pa.float64())]
    made = {"settings": settings.to_dict(), "version": store.version, "sample": sample}
    own = {*RUN, WEIGHT} & {*columns.X, *columns.metrics}
    if own:
        raise InputError(
            f"{store.folder}: a column of the table cannot be called as a parameter or a metric: "
            f"{', '.join(sorted(own))}"
        )
    return pa.schema(fields, metadata={"bridgegen": json.dumps(made)})


def _labels(store: Store) -> list[tuple[str, dict[str, Any]]]:
    """Return the columns of the parameters that are no plain numbers, and how they are read."""
    columns = dict(zip(store.parameters, store.columns.X, strict=True))
    return [(columns[name], label) for name, label in store.labels.items()]


def _worded(store: Store, name: str, values: Float, words: Sequence[str]) -> list[str]:
    """Return the names of the values of a category.

    Raises:
        StorageError: a row holds the number of none.
    """
    if len(values) and not (values.min() >= 0.0 and values.max() <= len(words) - 1):
        raise StorageError(f"{store.folder}: {name} must be one of {', '.join(words)} in every row")
    return [words[round(value)] for value in values.tolist()]


def _kept(rows: Rows, sample: float) -> tuple[Int, Float]:
    """Return which rows are kept, and how many each stands for."""
    whole = rows.critical | (rows.status != 0)
    drawn = whole | (_chances(rows.X) < sample)
    weight = np.where(whole, 1.0, 1.0 / sample)
    return np.flatnonzero(drawn), weight[drawn]


def _chances(X: Float) -> Float:
    """Return a number in [0, 1) of each row, by what it holds."""
    digests = b"".join(blake2b(row.tobytes(), digest_size=8).digest() for row in X)
    return (np.frombuffer(digests, "<u8") >> np.uint64(11)).astype(np.float64) * 2.0**-53


def _columns(store: Store, of_run: dict[str, Any], rows: Rows, weight: Float) -> dict[str, Any]:
    n, columns = len(rows), store.columns
    found: dict[str, Any] = {name: [item] * n for name, item in of_run.items()}
    found |= {"id": rows.id, "batch": rows.batch, "seconds": rows.seconds}
    for names, values in (
        (columns.X, rows.X),
        (columns.metrics, rows.metrics),
        (columns.F, rows.F),
    ):
        found |= dict(zip(names, values.T, strict=True))
    for name, label in _labels(store):
        if words := label.get("words"):
            found[name] = _worded(store, name, found[name], words)
        elif turn := label.get("turn"):
            found[name] = np.where(found[name] > turn, found[name] - 360.0, found[name])
    found |= {"status": rows.status.astype(np.int16), "critical": rows.critical}
    labels = {int(item): Cause(item).label or None for item in np.unique(rows.cause)}
    found["cause"] = [labels[item] for item in rows.cause.tolist()]
    found |= {
        name: [text or None for text in texts.tolist()]
        for name, texts in rows.findings.columns().items()
    }
    return found | {WEIGHT: weight}
