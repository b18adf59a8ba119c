"""The evaluations of an estimate on disk, batch by batch, so that a stopped one goes on.

An estimator asks for the same batches each time. Those that are there, whole and of the same
points, are read; from the first that is not, rows are simulated.
"""

import hashlib
import io
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from bridgegen.base.arrays import Float
from bridgegen.base.disk import write_whole
from bridgegen.base.records import read_bytes
from bridgegen.jobs.risk.outcomes import Column, Outcomes
from bridgegen.results.folder import claim

SETTINGS = "settings.json"
BATCHES = "batches"
RESULTS = ("risk.json", "risk.html", "harmful.csv")
MOST_LIKELY = "most-likely-"
"""Prefix of the names of scenario files; a number follows."""
ELSEWHERE = "elsewhere-"
"""Prefix of the folder with another simulator's results; the simulator's name follows."""
_LONGEST_MODE = 400
_DAMAGED = (
    ValueError,
    TypeError,
    LookupError,
    EOFError,
    MemoryError,
    RuntimeError,
    zipfile.BadZipFile,
)
"""Exceptions that reading a damaged or hostile batch may raise."""


class Ledger:
    """The batches of an estimate, a file each.

    Args:
        folder: of the estimate; made if it does not exist.
        settings: what the batches depend on, as JSON's types.

    Raises:
        StorageError: the folder holds another estimate or something else, or cannot be written.
    """

    def __init__(self, folder: Path, settings: Mapping[str, Any]) -> None:
        self.folder = folder
        claim(folder, settings, file=SETTINGS, pieces=BATCHES, belongs=_is_result, what="risk")
        self._number = 0

    def next(self, Z: Float, least: float) -> Outcomes | None:
        """Return the outcomes of the next batch if they are kept; None: simulate it, `keep` it.

        Args:
            Z: ``(N, d)`` its points.
            least: score from which outcomes are whole.
        """
        try:
            data = io.BytesIO(read_bytes(self._path()))
            with zipfile.ZipFile(data) as members:
                # A compressed member may be any size when it is read; ours are stored.
                if any(info.compress_type != zipfile.ZIP_STORED for info in members.infolist()):
                    return None
            # A pickle would be code, and the folder may come from others.
            found = np.load(data, allow_pickle=False)
            # An estimate that is resumed asks for the same points, batch by batch, by its seed;
            # other points are simulated.
            if str(found["digest"]) != _digest(Z, least):
                return None
            at, held = found["at"], found["values"]
            modes = tuple(str(item) for item in found["modes"].tolist())
            shape = (len(at), len(Column))
            if held.shape != shape or held.dtype != np.float64 or at.dtype != np.int64:
                return None
            values = Outcomes.lost(len(Z)).values
            values[:, Column.RESULT] = 1.0
            values[found["without"], Column.RESULT] = found["why"]
            values[at] = held
        except (OSError, *_DAMAGED):
            return None
        numbers = values[:, Column.MODE]
        # A number of a mode is an index later on: a damaged file must not make it one that is not
        # there.
        if not np.isfinite(values).all() or numbers.max(initial=-1.0) >= len(modes):
            return None
        self._number += 1
        return Outcomes(values, modes)

    def keep(self, Z: Float, least: float, outcomes: Outcomes) -> None:
        """Keep the outcomes of the next batch, whole or not at all.

        Raises:
            StorageError: they cannot be written.
        """
        # Of 10⁵ to 10¹⁰ rows only those near the event are kept, by five numbers each; a row of a
        # search's store has some 700 bytes.
        at = np.flatnonzero(outcomes.values[:, Column.SCORE] >= least)
        data = io.BytesIO()
        without = np.flatnonzero(outcomes.values[:, Column.RESULT] != 1.0)
        np.savez(
            data,
            digest=np.array(_digest(Z, least)),
            at=at,
            values=outcomes.values[at],
            without=without,
            why=outcomes.values[without, Column.RESULT],
            modes=np.array([mode[:_LONGEST_MODE] for mode in outcomes.modes] or [""]),
        )
        write_whole(self._path(), [data.getvalue()])
        self._number += 1

    def _path(self) -> Path:
        return self.folder / BATCHES / f"{self._number:06d}.npz"


def _is_result(name: str) -> bool:
    return name in RESULTS or name.startswith((MOST_LIKELY, ELSEWHERE))


def _digest(Z: Float, least: float) -> str:
    return hashlib.sha256(np.ascontiguousarray(Z).tobytes() + repr(least).encode()).hexdigest()
