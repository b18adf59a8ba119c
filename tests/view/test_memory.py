"""The page of a long run is made in memory that hardly grows with the run."""

import tracemalloc
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from bridgegen.jobs.search import Run
from bridgegen.jobs.search.restored import pipeline_of
from bridgegen.jobs.search.settings import Settings
from bridgegen.jobs.view.run_view import RunView
from bridgegen.pages import payload
from bridgegen.results.store import Store

A_ROW = 300
"""Bytes; 500 where all columns of a row are held."""


def repeated(source, folder, n):
    """A run of n random rows with the results of another run's rows, in turn."""
    with Store.open(source) as store:
        rows, names = store.read(), (store.parameters, store.metrics)
        settings = replace(Settings.from_dict(store.settings, source), budget=n)
        space = pipeline_of(Run(source), "open").space
    at = np.arange(n) % len(rows)
    U = np.random.default_rng(0).random((n, space.n_var))
    some = rows.take(at)
    kept = ("metrics", "F", "critical", "status", "cause", "findings")
    result = SimpleNamespace(messages={}, **{name: getattr(some, name) for name in kept})
    with Store.create(folder, settings.to_dict(), *names, n_var=space.n_var, n_obj=1) as store:
        store.append(U, space.decode(U) + 0.0, result, 1.0)
        store.finish("budget")
    return folder


def peak(run):
    view = RunView(run)
    tracemalloc.start()
    try:
        page = view.page()
        return tracemalloc.get_traced_memory()[1], len(page)
    finally:
        tracemalloc.stop()


@pytest.mark.thorough
def test_memory_a_row_of_a_page(finished, tmp_path, monkeypatch):
    monkeypatch.setattr(payload, "ROWS", 500)
    monkeypatch.setattr(payload, "SIZE_OF_ROW", 0)  # no motions
    peak(repeated(finished, tmp_path / "first", 500))  # what is made once
    sizes = (10_000, 30_000)
    (small, page), (large, same) = (peak(repeated(finished, tmp_path / str(n), n)) for n in sizes)
    assert abs(same - page) < 0.1 * page
    assert (large - small) / (sizes[1] - sizes[0]) < A_ROW
