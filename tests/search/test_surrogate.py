"""What both searches with surrogates do beyond the contract of all algorithms."""

import json
import os
import subprocess
import sys

import numpy as np
import pytest
from tests.approval import refuses

from bridgegen.jobs.compare.record import distinct
from bridgegen.search.algorithms import Problem, Results
from bridgegen.search.algorithms.surrogate import Surrogate
from bridgegen.search.algorithms.turbo import TuRBO

both = pytest.mark.parametrize("kind", [TuRBO, Surrogate])


def results(F: np.ndarray, critical: np.ndarray, ok: np.ndarray | None = None) -> Results:
    plain = Results.of_F(F[:, None], ok)
    return Results(plain.F, plain.ok, critical, plain.metrics, plain.cause)


def pockets(U: np.ndarray) -> Results:
    """Two critical pockets in a flat plain, of some 0.3 % of the cube of four columns."""
    centres = np.array([[0.2, 0.3, 0.5, 0.7], [0.8, 0.7, 0.4, 0.2]])
    off = np.sqrt(((U[:, None] - centres) ** 2).mean(axis=2)).min(axis=1)
    return results(-np.exp(-4.0 * off), off < 0.1)


def drive(search, evaluate, budget: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the rows of a search and which are critical."""
    rows, critical = [], []
    while sum(map(len, rows)) < budget:
        U = search.ask()
        if not len(U):
            break
        found = evaluate(U)
        rows.append(U.copy())
        critical.append(found.critical)
        search.tell(U, found)
    return np.concatenate(rows), np.concatenate(critical)


@both
@pytest.mark.parametrize("ahead", [0, 5, 16])
def test_it_closes_in_on_a_pocket(kind, ahead, late):
    _, critical = drive(late(kind(Problem.unnamed(4), 0), ahead), pockets, 120)
    assert critical.sum() > (5 if ahead else 10)  # chance: less than one


def test_surrogate_finds_both_pockets():
    U, critical = drive(Surrogate(Problem.unnamed(4), 0), pockets, 120)
    assert (U[critical, 0] < 0.5).any()
    assert (U[critical, 0] > 0.5).any()


def test_surrogate_finds_distinct_scenarios():
    def half(U):
        return results(U[:, 0] - 0.3, U[:, 0] < 0.3)

    U, critical = drive(Surrogate(Problem.unnamed(8), 0), half, 200)
    assert critical.mean() > 0.6
    assert distinct(U[critical]).sum() > 0.9 * critical.sum()


@both
def test_categories_alone_are_searched_to_the_last_row(kind):
    problem = Problem(("a", "b", "c"), levels=(2, 3, 5))
    U, _ = drive(kind(problem, 0), lambda U: results(U.sum(axis=1), U[:, 0] < 0.5), 1000)
    assert len(np.unique(np.floor(U * [2, 3, 5]), axis=0)) == 30
    assert len(U) <= 60  # first rows, drawn before anything is known, may be equal


@both
def test_rows_that_are_not_told_are_not_asked_for_again(kind):
    """Eight rows there are, and the first of them is told last."""
    search = kind(Problem(("a", "b"), levels=(4, 2)), 0, initial=2, batch=2)
    rows = [search.ask()]
    search.tell(rows[0], results(rows[0][:, 0], rows[0][:, 0] < 0.0))
    while len(U := search.ask()):
        rows.append(U)
        assert len(rows) <= 8
    asked = np.concatenate(rows)
    assert len(asked) == len(np.unique(asked, axis=0)) == 8


def test_surrogate_keeps_off_rows_that_are_not_told():
    search = Surrogate(Problem.unnamed(4), 0, initial=20, batch=5, explore=0.0, apart=0.1)
    U = search.ask()
    search.tell(U, pockets(U))
    untold = np.concatenate([search.ask() for _ in range(4)])
    off = np.sqrt(((untold[:, None] - untold) ** 2).mean(axis=2))
    assert off[~np.eye(len(off), dtype=bool)].min() >= 0.1


@both
def test_mixed_spaces_never_ask_for_one_scenario_twice(kind):
    problem = Problem(("a", "b"), levels=(4, 50))
    search = kind(problem, 0)
    first = search.ask()
    search.tell(first, results(first[:, 1], first[:, 1] < 0.1))
    known = {tuple(row) for row in np.floor(first * [4, 50])}
    for _ in range(8):
        U = search.ask()
        numbers = [tuple(row) for row in np.floor(U * [4, 50])]
        if len(U) > 10:  # a region begins
            continue
        assert not known.intersection(numbers)
        assert len(set(numbers)) == len(numbers)
        known.update(numbers)
        search.tell(U, results(U[:, 1], U[:, 1] < 0.1))


@both
@pytest.mark.parametrize("n_var", [1, 30])
def test_one_parameter_and_thirty(kind, n_var):
    U, critical = drive(
        kind(Problem.unnamed(n_var), 0),
        lambda U: results(U[:, 0], U[:, 0] < 0.2),
        120,
    )
    assert len(np.unique(U, axis=0)) == len(U)
    assert critical.mean() > 0.15  # of one parameter, a fifth is soon full of distinct ones


@both
@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 0.0])
@pytest.mark.parametrize("ok", [True, False])
def test_all_rows_alike(kind, value, ok):
    def same(U):
        return results(np.full(len(U), value), np.zeros(len(U), bool), np.full(len(U), ok))

    U, _ = drive(kind(Problem.unnamed(2), 0), same, 80)
    assert np.isfinite(U).all()
    assert len(np.unique(U, axis=0)) == len(U)


@both
def test_all_rows_critical(kind):
    U, critical = drive(
        kind(Problem.unnamed(3), 0), lambda U: results(U[:, 0], np.ones(len(U), bool)), 100
    )
    assert critical.all()
    assert len(np.unique(U, axis=0)) == len(U)


@both
def test_a_region_that_always_fails_is_left(kind):
    """The best objectives lie where the simulation fails."""

    def failing(U):
        return results(U[:, 0], np.zeros(len(U), bool), U[:, 0] > 0.3)

    U, _ = drive(kind(Problem.unnamed(2), 1), failing, 150)
    assert np.mean(U[60:, 0] > 0.3) > 0.5


@both
def test_restored_anywhere_the_next_rows_are_the_same(kind):
    search = kind(Problem.unnamed(3), 2)
    for _ in range(8):
        U = search.ask()
        search.tell(U, pockets(np.column_stack([U, U[:, :1]])))
        other = kind(Problem.unnamed(3), 2)
        other.restore(search.state())
        assert other.state() == search.state()
        asked = other.ask()
    assert asked.tobytes() == search.ask().tobytes()


def changed(state: bytes, change) -> bytes:
    line, _, rows = state.partition(b"\n")
    head = json.loads(line)
    change(head)
    return json.dumps(head).encode() + b"\n" + rows


@both
def test_a_damaged_state_is_refused(kind):
    search = kind(Problem.unnamed(3), 2)
    for _ in range(3):
        U = search.ask()
        search.tell(U, pockets(np.column_stack([U, U[:, :1]])))
    state = search.state()
    nan = np.full(5, np.nan).tobytes()
    damaged = [
        b"", b"\n", b"[]\n", b"{", state[:-1], state[:-40] + nan, b"\x80" + state,
        b"[" * 100_000 + b"\n",
        changed(state, lambda head: head.update(name="random")),
        changed(state, lambda head: head.update(more=None)),
        changed(state, lambda head: head.update(more=[[1.0], [2.0]])),
        changed(state, lambda head: head.update(more=[[99.0] * 5] * 2)),
        changed(state, lambda head: head.update(generator={"bit_generator": "MT19937"})),
        changed(state, lambda head: head["generator"]["state"].update(state="x")),
        changed(state, lambda head: head["generator"]["state"].update(state=2**200)),
    ]  # fmt: skip
    for one in damaged:
        with pytest.raises(ValueError):  # noqa: PT011
            kind(Problem.unnamed(3), 2).restore(one)
    with refuses(ValueError):
        kind(Problem.unnamed(3), 2, batch=11).restore(state)


@both
def test_a_region_with_rows_that_are_not_known_is_refused(kind):
    if kind is Surrogate:
        pytest.skip("it has no regions")
    search = kind(Problem.unnamed(3), 2)
    U = search.ask()
    search.tell(U, Results.of_F(U[:, :1]))
    for key, value in [
        ("own", [99]), ("own", [-1]), ("own", []), ("length", -1.0), ("length", float("nan")),
        ("successes", -1), ("avoided", 0.5), ("parameters", [0.0]), ("more", 1),
    ]:  # fmt: skip
        bad = changed(search.state(), lambda head, k=key, v=value: head["more"][0].update({k: v}))
        with pytest.raises(ValueError):  # noqa: PT011
            kind(Problem.unnamed(3), 2).restore(bad)


SCRIPT = """
import numpy as np
from bridgegen.search.algorithms import Problem, Results, get
for name in ("turbo", "surrogate"):
    search = get(name)(Problem.unnamed(10), 0)
    for _ in range(6):
        U = search.ask()
        F = ((U - 0.3) ** 2).sum(axis=1)
        plain = Results.of_F(F[:, None])
        search.tell(U, Results(plain.F, plain.ok, F < 0.5, plain.metrics, plain.cause))
    print(U.tobytes().hex())
"""


@pytest.mark.thorough
def test_the_number_of_threads_of_linear_algebra_does_not_matter():
    told = []
    for n in ("1", "2"):
        threads = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"), n)
        done = subprocess.run(
            [sys.executable, "-c", SCRIPT],
            env=os.environ | threads,
            capture_output=True,
            check=True,
        )
        told.append(done.stdout)
    assert len(told[0]) > 1000
    assert told[0] == told[1]
