import json
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.approval import refuses

from bridgegen.base.arrays import Float
from bridgegen.base.errors import InputError, UnknownNameError
from bridgegen.search.algorithms import Problem, Results
from bridgegen.search.algorithms.map_elites import MAPElites, _Archive
from bridgegen.search.algorithms.sampling import Random

PROBLEM = Problem(("speed", "gap", "fog"), ("d_min", "ttc"))


def results_of(U: Float) -> Results:
    """A ttc that is the gap, or infinite for half of the speeds; failures at much fog."""
    F = ((U - 0.6) ** 2).sum(axis=1, keepdims=True)
    ok = U[:, 2] < 0.95
    ttc = np.where(U[:, 0] > 0.5, np.inf, 10 * U[:, 1])
    metrics = np.where(ok[:, None], np.stack([F[:, 0], ttc], axis=1), np.nan)
    told = replace(Results.of_F(np.where(ok[:, None], F, np.nan), ok), metrics=metrics)
    return replace(told, critical=ok & (F[:, 0] < 0.1))


def drive(search, n_batches: int) -> tuple[Float, Results]:
    """Return all rows, and what they came to."""
    batches = []
    for _ in range(n_batches):
        batches.append(search.ask())
        search.tell(batches[-1], results_of(batches[-1]))
    U = np.concatenate(batches)
    return U, results_of(U)


def test_each_cell_has_its_most_critical_row():
    search = MAPElites(PROBLEM, 1, descriptors="speed,gap", cells=4)
    U, results = drive(search, 25)
    best: dict[tuple[int, int], float] = {}
    for row, f, ok in zip(U, results.F[:, 0], results.ok, strict=True):
        cell = tuple(np.minimum((row[:2] * 4).astype(int), 3).tolist())
        if ok:
            best[cell] = min(best.get(cell, np.inf), f)
    notes = search.notes()
    assert notes["cells"] == 16
    assert notes["cells filled"] == len(best) == 16
    assert notes["coverage"] == 1.0
    found = {
        tuple(min(int(one[name] * 4), 3) for name in ("speed", "gap")): one["objective"]
        for one in notes["elites"]
    }
    assert found == best
    assert [one["objective"] for one in notes["elites"]] == sorted(best.values())
    critical = sum(one["critical"] for one in notes["elites"])
    assert (
        critical == notes["cells with a critical scenario"] == sum(f < 0.1 for f in best.values())
    )
    worst = results.F[results.ok].max()
    score = notes["QD score, above the worst row"]
    assert score == pytest.approx(sum(worst - f for f in best.values()))


@given(
    st.lists(
        st.tuples(st.floats(-3, 3), st.integers(0, 4), st.booleans()), min_size=1, max_size=40
    ),
    st.integers(1, 5),
)
def test_an_archive_in_one_go_is_an_archive_row_by_row(rows, per_descriptor):
    behaviour = np.array([[value] for value, _, _ in rows])
    F = np.array([float(f) for _, f, _ in rows])
    U = np.arange(len(rows), dtype=np.float64)[:, None]
    critical = np.array([one for _, _, one in rows])
    spans = np.array([[-1.0, 1.0]])
    once, by_row = (_Archive(spans, per_descriptor, 1) for _ in range(2))
    once.add(U, F, behaviour, critical)
    for k in range(len(rows)):
        at = slice(k, k + 1)
        by_row.add(U[at], F[at], behaviour[at], critical[at])
    assert once.filled.tolist() == by_row.filled.tolist()
    for name in ("F", "U", "behaviour", "critical"):
        kept = getattr(once, name)[once.filled]
        np.testing.assert_array_equal(kept, getattr(by_row, name)[by_row.filled])


def test_no_collision_ever_is_a_kind_of_its_own_and_no_value_is_none():
    search = MAPElites(PROBLEM, 0, descriptors="ttc=0:10", cells=5)
    drive(search, 10)
    elites = {one["ttc"] for one in search.notes()["elites"]}
    assert 10.0 in elites  # infinite ones are in the last cell
    assert len(elites) == 5
    nothing = MAPElites(PROBLEM, 0, descriptors="ttc")
    for _ in range(3):
        U = nothing.ask()
        told = results_of(U)
        nothing.tell(U, replace(told, metrics=np.full((len(U), 2), np.nan)))
    assert nothing.notes()["cells filled"] == 0


def test_ranges_are_the_user_s_the_parameter_s_or_the_first_rows():
    search = MAPElites(PROBLEM, 0, descriptors="d_min, gap = 0.2:0.4, speed")
    U = search.ask()
    results = results_of(U)
    search.tell(U, results)
    F = results.F[results.ok]
    assert search.notes()["descriptors"] == [
        f"d_min {F.min():.4g} … {F.max():.4g}",
        "gap 0.2 … 0.4",
        "speed 0 … 1",
    ]


def test_a_constant_descriptor_has_room_around_it():
    search = MAPElites(PROBLEM, 0, descriptors="d_min")
    U = search.ask()
    told = results_of(U)
    search.tell(U, replace(told, metrics=np.full((len(U), 2), 7.0)))
    assert search.notes()["descriptors"] == ["d_min 3.5 … 10.5"]
    assert search.notes()["cells filled"] == 1


def test_by_default_the_first_two_parameters_tell_kinds_apart():
    search = MAPElites(PROBLEM, 0)
    assert search.notes() == {"descriptors": ["speed", "gap"], "cells filled": 0}
    assert MAPElites(Problem.unnamed(1), 0).notes()["descriptors"] == ["x0"]


@pytest.mark.parametrize(
    ("descriptors", "error", "message"),
    [
        ("d_mim", UnknownNameError, "d_min"),
        ("speed,speed", InputError, "descriptors"),
        ("gap=1", InputError, "range"),
        ("gap=1:0", InputError, "1:0"),
        ("gap=0:inf", InputError, "got '0:inf'"),
        ("d_min=a:b", InputError, "got 'a:b'"),
    ],
)
def test_a_wrong_descriptor_is_named(descriptors, error, message):
    with refuses(error, message):
        MAPElites(PROBLEM, 0, descriptors=descriptors)


def test_too_many_cells_are_refused():
    with refuses(InputError, "100", "100000"):
        MAPElites(PROBLEM, 0, descriptors="speed,gap,fog", cells=100)


def test_it_finds_more_kinds_than_chance():
    """Critical only within a narrow band of fog, in every cell of speed and gap."""

    def kinds(search) -> int:
        cells = set()
        for _ in range(25):
            U = search.ask()
            F = np.abs(U[:, 2:] - 0.3)
            critical = F[:, 0] < 0.01
            search.tell(U, replace(Results.of_F(F), critical=critical))
            cells |= set(map(tuple, (U[critical, :2] * 10).astype(int).tolist()))
        return len(cells)

    problem = Problem.unnamed(3)
    found = [kinds(MAPElites(problem, seed)) for seed in range(3)]
    by_chance = [kinds(Random(problem, seed)) for seed in range(3)]
    assert min(found) > 2 * max(by_chance)


def test_its_notes_are_json():
    search = MAPElites(PROBLEM, 0, descriptors="d_min,ttc")
    json.dumps(search.notes(), allow_nan=False)
    drive(search, 5)
    json.dumps(search.notes(), allow_nan=False)
