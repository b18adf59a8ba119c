"""A run that is made once, and grows again row by row as if a search were going on."""

import shutil
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import bridgegen as bg
from bridgegen.results.store import Store

BUDGET, KEEP = 120, 2


@pytest.fixture(scope="session")
def finished(tmp_path_factory) -> Path:
    """A run that has ended, with two scenarios handed over and a report."""
    folder = tmp_path_factory.mktemp("view") / "s4"
    bg.run_search("crossroads-s4", budget=BUDGET, seed=1, keep=KEEP, triage="short", out=folder)
    return folder


class Growing:
    """The same run in another folder, held by its writer, with none of its rows yet.

    Attributes:
        folder: where.
    """

    def __init__(self, source: Path, folder: Path) -> None:
        self.folder, self._source = folder, source
        with Store.open(source) as store:
            self.rows = store.read()
            n_var = self.rows.U.shape[1]
            self._store = Store.create(
                folder, store.settings, store.parameters, store.metrics, n_var=n_var, n_obj=1
            )

    def grow(self, n: int) -> None:
        """Record the next n rows."""
        start = len(self._store)
        rows = self.rows.take(np.arange(start, start + n))
        names = ("metrics", "F", "critical", "status", "cause", "findings")
        result = SimpleNamespace(messages={}, **{name: getattr(rows, name) for name in names})
        self._store.append(rows.U, rows.X, result, seconds=0.1 * (start + n))

    def end(self) -> None:
        """End the run, and export."""
        self._store.finish("budget")
        self._store.close()
        shutil.copytree(self._source / "critical", self.folder / "critical", dirs_exist_ok=True)

    def close(self) -> None:
        """Let go of it."""
        self._store.close()


@pytest.fixture
def growing(finished, tmp_path) -> Iterator[Any]:
    growing = Growing(finished, tmp_path / "grows")
    yield growing
    growing.close()
