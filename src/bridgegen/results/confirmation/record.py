"""The record of a confirmation in a run's folder: JSON, from which it can be resumed."""

from collections.abc import Iterable
from hashlib import sha256
from pathlib import Path

from bridgegen.base.arrays import Float, Numbers
from bridgegen.base.disk import write_whole
from bridgegen.base.errors import FileFormatError
from bridgegen.base.records import read_model
from bridgegen.results.confirmation.schema import Record, Scenario

PREFIX, SUFFIX = "confirmation-", ".json"


def file_name(simulator: str) -> str:
    """Return the name of a simulator's record in a run's folder."""
    return f"{PREFIX}{simulator}{SUFFIX}"


def digest_of(x: Float, metrics: Float) -> str:
    """Return the digest of an evaluation's parameters and metrics, which identifies it."""
    digest = sha256()
    for array in (x, metrics):
        digest.update(array.astype("<f8").tobytes())
    return digest.hexdigest()[:16]


def write_record(folder: Path, record: Record) -> Path:
    """Write a record into a run's folder atomically; return its path.

    Raises:
        StorageError: it cannot be written.
    """
    path = folder / file_name(record.simulator)
    write_whole(path, [record.model_dump_json(indent=1).encode(), b"\n"])
    return path


def read_record(path: Path) -> Record | None:
    """Return a record of `write_record`; None if the file does not exist.

    Raises:
        FileFormatError: the file is not such a record.
        StorageError: it cannot be read.
    """
    record = read_model(path, Record, _not_ours)
    if record is not None and file_name(record.simulator) != path.name:
        raise _not_ours(path, f"simulator is {record.simulator[:40]!r}")
    return record


def _not_ours(path: Path, why: str) -> FileFormatError:
    return FileFormatError(
        f"{path}: must be what 'bridgegen confirm' writes, and is not: {why}; "
        "run that with --again, or delete the file"
    )


def read_records(folder: Path, X: Numbers, metrics: Numbers) -> tuple[Record, ...]:
    """Return the records of all simulators in a run's folder, by their names.

    Args:
        folder: of the run.
        X: ``(N, n)`` of the run.
        metrics: ``(N, M)`` of the run.

    Raises:
        FileFormatError: a file is not such a record, or belongs to another run.
        StorageError: one cannot be read.
    """
    records = []
    for path in sorted(folder.glob(f"{PREFIX}*{SUFFIX}")):
        record = read_record(path)
        if record is not None:
            check_rows(path, record.scenarios, X, metrics)
            records.append(record)
    return tuple(records)


def check_rows(path: Path, scenarios: Iterable[Scenario], X: Numbers, metrics: Numbers) -> None:
    """Check that a record belongs to these evaluations.

    Args:
        path: of the record, for the message.
        scenarios: of the record.
        X: see ``read_records``.
        metrics: see ``read_records``.

    Raises:
        FileFormatError: it belongs to another run.
    """
    for one in scenarios:
        k = one.evaluation
        if k >= len(X) or one.row != digest_of(X[k], metrics[k]):
            raise FileFormatError(
                f"{path}: is of another run: evaluation {k + 1} is not the one that was "
                "confirmed; confirm it with --again, or delete the file"
            )
