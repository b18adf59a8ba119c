"""A rollout as a table that other programs read: one line per instant and entity; or as OSI."""

from collections.abc import Callable, Iterator
from pathlib import Path

from bridgegen.base.disk import write_whole
from bridgegen.base.errors import InputError, StorageError
from bridgegen.simulation.osi.trace import Surroundings, write_osi
from bridgegen.simulation.rollout import Rollout

COLUMNS = ("time", "entity", "x", "y", "h", "speed")
"""Columns of a trace: [s], name, [m], [m], [rad], [m/s]; positions are OpenSCENARIO's reference
points."""

MORE = ("acceleration", "offset", "length", "width", "centre")
"""Further columns that the metrics need: [m/s²] along the heading, [m] from the lane's centre, and
the box [m] with its centre's distance ahead of the reference point."""


def write_trace(
    path: Path,
    rollout: Rollout,
    row: int = 0,
    around: Callable[[], Surroundings] = Surroundings,
) -> None:
    """Write one scenario of a rollout as CSV or OSI, whole or not at all; every number in full.

    Columns of a table are `COLUMNS` and `MORE`; who is not present at an instant has no line then.

    Args:
        path: a new file, its name ends in .csv, or in .mcap, see `write_osi`.
        rollout: N scenarios.
        row: which of them.
        around: returns the map and the weather, for OSI.

    Raises:
        InputError: the name does not end so.
        StorageError: the file exists, or cannot be written.
    """
    kind = path.suffix.lower()
    if kind not in (".csv", ".mcap"):
        raise InputError(
            f"{path}: a trace is a table or ASAM OSI, its name must end in .csv or .mcap"
        )
    if path.exists():
        raise StorageError(f"{path}: exists already, and is not overwritten")
    if kind == ".mcap":
        write_osi([path], rollout, around(), row)
        return
    write_whole(path, (line.encode() for line in _lines(rollout, row)))


def _lines(rollout: Rollout, row: int) -> Iterator[str]:
    rollout = rollout.as_driven()
    yield ",".join((*COLUMNS, *MORE)) + "\r\n"
    names = [_quoted(name) for name in rollout.names]
    boxes = [",".join(repr(size) for size in box) for box in rollout.box.tolist()]
    states = [getattr(rollout, name)[row].tolist() for name in ("x", "y", "h", "v", "a", "offset")]
    present = rollout.present[row] if rollout.present.size else None
    for k in range(int(rollout.n_steps[row])):
        time = repr(k * rollout.time_step)
        for e, name in enumerate(names):
            if present is None or present[e, k]:
                values = ",".join(repr(array[e][k]) for array in states)
                yield f"{time},{name},{values},{boxes[e]}\r\n"


def _quoted(name: str) -> str:
    """Return a name as RFC 4180 has it."""
    if any(sign in name for sign in ',"\r\n'):
        return '"' + name.replace('"', '""') + '"'
    return name
