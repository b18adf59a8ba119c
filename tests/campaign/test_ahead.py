"""Searches that run ahead of their results: no worker is idle, and no bit depends on durations."""

import os
import re
import signal
from collections import deque
from contextlib import closing
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.approval import refuses

import bridgegen as bg
from bridgegen.base.arrays import Float
from bridgegen.base.errors import InputError, Interrupted
from bridgegen.engine.workers import Lost, Recipe
from bridgegen.engine.workers.pool import PoolStream, WorkerPool
from bridgegen.engine.workers.processes import Processes
from bridgegen.jobs.search import SearchCallbacks
from bridgegen.jobs.search.loop import LoopResult, Reason, run_loop
from bridgegen.results.store import Store
from bridgegen.search.algorithms import ALGORITHMS, Problem, get
from bridgegen.search.algorithms.algorithm import asynchronous

pytestmark = pytest.mark.thorough

RESULT = ("id", "batch", "U", "X", "metrics", "F", "status", "critical")


# ---------------------------------------------------------------------- workers with a clock


class Uneven:
    """A simulator with uneven durations, each fixed by its row; some rows fail."""

    runs_at_once = rows_at_once = 1
    device = "CPU"

    @property
    def recipe(self) -> Recipe:
        return Recipe.of(Uneven)

    def evaluate(self, X: Float) -> tuple[float, float]:
        """Return the objective, NaN in a failed row, and the duration [s], 0.02 to 0.2."""
        x = X[0]
        dice = np.random.default_rng(x.view(np.uint64))
        seconds = float(np.clip(0.06 * np.exp(0.8 * dice.standard_normal()), 0.02, 0.2))
        return (np.nan if x[0] > 0.9 else float(((x - 0.3) ** 2).sum())), seconds


class ClockStream(PoolStream[Any]):
    """A stream without a thread: the pool goes on when results are waited for."""

    def _started(self):
        return SimpleNamespace(join=lambda: None)

    def _wait(self):
        self._pool.step(self._job)


class ClockPool(WorkerPool[int]):
    """Workers in this thread, whose time is simulated; some of them end while they evaluate.

    Args:
        count: workers.
        killed: numbers of the calls in which the worker ends.
    """

    are_here = True

    def __init__(self, count: int, killed: frozenset[int] = frozenset()) -> None:
        super().__init__()
        self.workers, self.killed = count, killed
        self.now = self.busy = self.begun = 0.0
        self.calls = 0
        self.pending: dict[int, tuple[float, tuple[Any, ...]]] = {}
        self.names = iter(range(10**6))

    @property
    def count(self) -> int:
        return self.workers

    @property
    def idle(self) -> float:
        """The idle share of the workers' time."""
        return 1.0 - self.busy / (self.count * self.now)

    def stream(self, portable, work, *args):
        return ClockStream(self, portable.recipe, work, args)

    def wake(self): ...

    def _start_worker(self) -> int:
        name = next(self.names)
        self.pending[name] = self.now, ("started",)
        return name

    def _ping(self, worker):
        self.pending[worker] = self.now, ("answer", None)

    _prepare = lambda self, worker, recipe: self._ping(worker)  # noqa: E731

    def _run(self, worker, key, work, X, args):
        result = work(Uneven(), X, *args)
        self.busy += result[1]
        dies = self.calls in self.killed
        self.pending[worker] = self.now + result[1], ("died",) if dies else ("answer", result)
        self.calls += 1

    def _receive(self):
        worker = min(self.pending, key=lambda one: (self.pending[one][0], one))
        self.now, message = self.pending.pop(worker)
        return worker, message

    def _release(self, worker):
        self.pending.pop(worker, None)
        return "by test"


class Evaluated:
    """The stream of rows that a loop takes, of a pool."""

    def __init__(self, pool: ClockPool) -> None:
        self.rows = pool.stream(Uneven(), Uneven.evaluate)
        self.submitted = 0

    def submit(self, X: Float) -> None:
        self.submitted += len(X)
        self.rows.submit(X)

    def take(self, n: int) -> SimpleNamespace:
        results = [one.result for one in self.rows.take(n)]
        F = np.array([[np.nan if isinstance(one, Lost) else one[0]] for one in results])
        return recorded(F)


def recorded(F: Float) -> SimpleNamespace:
    return SimpleNamespace(
        messages={}, cause=None, findings=None, metrics=2.0 * F, F=F,
        critical=F[:, 0] < 0.05, status=np.where(np.isnan(F[:, 0]), 2, 0),
    )  # fmt: skip


def at_once(X: Float) -> SimpleNamespace:
    """Evaluate rows in this thread, a batch at a time."""
    return recorded(np.array([[Uneven().evaluate(x[np.newaxis])[0]] for x in X]))


# ---------------------------------------------------------------------- searches

N_VAR = 3
SMALL = {
    "random": {"population": 8},
    "sobol": {"population": 7},
    "map-elites": {"population": 8, "initial": 12},
    "es": {"children": 12},
    "ga": {"population": 12},
    "surrogate": {"initial": 8, "batch": 5},
}


def search(name: str, **more: Any):
    return get(name)(Problem.unnamed(N_VAR), 4, **SMALL[name] | more)


def decode(U: Float) -> Float:
    return np.round(U, 4)


@pytest.fixture
def store(tmp_path):
    """Return a function that opens a store by its name."""
    stores = []

    def opened(name: str) -> Store:
        folder = tmp_path / name
        if folder.exists():
            stores.append(Store.open(folder, write=True))
        else:
            names = [f"x{k}" for k in range(N_VAR)]
            stores.append(Store.create(folder, {}, names, ["m"], n_var=N_VAR, n_obj=1))
        return stores[-1]

    yield opened
    for one in stores:
        one.close()


def go(store: Store, algorithm, budget: int, ahead: int, evaluate=at_once, **more) -> LoopResult:
    return run_loop(algorithm, decode, evaluate, store, budget, ahead=ahead, **more)


def same(a: Store, b: Store) -> None:
    one, other = a.read(), b.read()
    for name in RESULT:
        assert getattr(one, name).tobytes() == getattr(other, name).tobytes(), name


class Scripted:
    """Asks for given batches, and keeps what it had been told when it was asked."""

    name = "scripted"

    def __init__(self, *batches):
        self.batches = deque(np.array(one, float).reshape(len(one), -1) for one in batches)
        self.told: list[list[float]] = []
        self.known: list[int] = []

    @property
    def rows(self) -> list[float]:
        return [x for one in self.told for x in one]

    def ask(self):
        self.known.append(len(self.rows))
        return self.batches.popleft() if self.batches else np.empty((0, N_VAR))

    def tell(self, U, results):
        expected = at_once(decode(U)).F[:, 0]
        assert np.array_equal(results.F[results.ok, 0], expected[results.ok])
        self.told.append(U[:, 0].tolist())


def batch(*first: float) -> list[list[float]]:
    return [[x, 0.5, 0.5] for x in first]


# ---------------------------------------------------------------------- the law


def test_a_batch_is_asked_for_when_all_but_so_many_rows_are_told(store):
    rows = [batch(*(0.01 * (4 * k + i) for i in range(4))) for k in range(6)]
    asked = Scripted(*rows)
    assert go(store("run"), asked, 100, ahead=6).reason is Reason.EXHAUSTED
    # The first batch is told as a whole; the last rows, when there is nothing more to ask.
    assert asked.known == [0, 4, 4, 6, 10, 14, 18, 24]
    assert asked.rows == [x[0] for one in rows for x in one]
    plain = Scripted(*rows)
    go(store("plain"), plain, 100, ahead=0)
    assert plain.known == [0, 4, 8, 12, 16, 20, 24]


def test_the_budget_is_exact_and_rows_are_recorded_as_they_are_told(store):
    rows = [batch(*(0.01 * (4 * k + i) for i in range(4))) for k in range(6)]
    run, said = store("run"), []
    result = go(run, Scripted(*rows), 18, ahead=5, on_batch=said.append)
    assert (result.reason, result.evaluations, result.batches) == (Reason.BUDGET, 18, 5)
    assert [one.evaluations for one in said] == [4, 7, 11, 18]
    assert run.read().batch.tolist() == [0] * 4 + [1] * 3 + [2] * 4 + [3] * 7


def test_a_row_that_is_being_evaluated_is_not_evaluated_twice(store):
    rows = [batch(0.1, 0.2), batch(0.3, 0.4), batch(0.3, 0.5, 0.5), batch(0.4, 0.6)]
    asked, rows_of = Scripted(*rows), Evaluated(ClockPool(2))
    result = go(store("run"), asked, 100, ahead=5, evaluate=rows_of)
    assert (result.evaluations, result.repeated, rows_of.submitted) == (6, 3, 6)
    assert asked.rows == [0.1, 0.2, 0.3, 0.4, 0.3, 0.5, 0.5, 0.4, 0.6]


def test_a_search_that_asks_for_nothing_new_ends_with_all_results(store):
    asked = Scripted(batch(0.1, 0.2), batch(0.3, 0.4), *[batch(0.2, 0.3)] * 200)
    result = go(store("run"), asked, 100, ahead=3)
    assert (result.reason, result.evaluations, result.batches) == (Reason.CONVERGED, 4, 102)
    assert len(asked.rows) == 204


def test_notes_are_of_all_rows(store):
    class Diarist(Scripted):
        def notes(self):
            return {"told": len(self.rows)}

    run = store("run")
    go(run, Diarist(*[batch(0.1 * k, 0.1 * k + 0.05) for k in range(9)]), 11, ahead=4)
    assert run.notes == {"told": 12}  # the last one has no place in the budget


# ---------------------------------------------------------------------- the same bits


@pytest.mark.parametrize("ahead", [1, 6, 30])
@pytest.mark.parametrize("name", SMALL)
def test_no_bit_depends_on_the_number_of_workers_or_on_which_of_them_end(name, ahead, store):
    """Nor on durations: with one worker rows end in their order, with four they do not."""
    whole = store("whole")
    go(whole, search(name), 120, ahead)
    for count, killed in ((1, ()), (2, (0, 7, 50)), (4, (3, 12, 40, 80))):
        run = store(f"{count}")
        evaluate = Evaluated(ClockPool(count, frozenset(killed)))
        assert go(run, search(name), 120, ahead, evaluate).reason is Reason.BUDGET
        same(run, whole)


def test_how_far_it_is_ahead_is_what_the_search_depends_on(store):
    runs = [store(f"{ahead}") for ahead in (0, 5, 10)]
    for run, ahead in zip(runs, (0, 5, 10), strict=True):
        go(run, search("surrogate"), 60, ahead)
    first, second, third = (one.read().X.tobytes() for one in runs)
    assert len({first, second, third}) == 3


class InterruptedAt(Evaluated):
    """Ctrl-C while the results of the n-th row are waited for."""

    def __init__(self, pool: ClockPool, n: int) -> None:
        super().__init__(pool)
        self.left = n

    def take(self, n: int) -> SimpleNamespace:
        self.left -= n
        if self.left < 0:
            raise KeyboardInterrupt
        return super().take(n)


@settings(max_examples=15, deadline=None)
@given(
    name=st.sampled_from(sorted(SMALL)),
    ahead=st.integers(0, 25),
    cuts=st.lists(st.tuples(st.integers(0, 40), st.integers(1, 4)), min_size=1, max_size=4),
)
def test_interrupted_anywhere_and_resumed_with_other_workers(tmp_path_factory, name, ahead, cuts):
    folder = tmp_path_factory.mktemp("runs")
    made = [f"x{k}" for k in range(N_VAR)], ["m"]
    with (
        Store.create(folder / "whole", {}, *made, n_var=N_VAR, n_obj=1) as whole,
        Store.create(folder / "run", {}, *made, n_var=N_VAR, n_obj=1) as run,
    ):
        go(whole, search(name), 80, ahead)
        for n, count in cuts:
            before = len(run)
            result = go(run, search(name), 80, ahead, InterruptedAt(ClockPool(count), n))
            assert before <= len(run) <= before + n
            first = run.read(), whole.read(0, len(run))
            assert first[0].X.tobytes() == first[1].X.tobytes()
            assert result.reason in (Reason.INTERRUPTED, Reason.BUDGET)
        go(run, search(name), 80, ahead, Evaluated(ClockPool(3)))
        same(run, whole)


@pytest.mark.parametrize("first", [1, 7, 8, 20, 33])
def test_a_larger_budget_continues_as_if_it_had_always_been(first, store):
    whole, parts = store("whole"), store("parts")
    go(whole, search("surrogate"), 60, 7)
    go(parts, search("surrogate"), first, 7)
    evaluate = Evaluated(ClockPool(2))
    go(parts, search("surrogate"), 60, 7, evaluate)
    assert evaluate.submitted == 60 - first
    a, b = whole.read(), parts.read()
    assert a.X.tobytes() == b.X.tobytes()
    assert a.F.tobytes() == b.F.tobytes()


# ---------------------------------------------------------------------- no worker waits


@pytest.mark.parametrize("count", [2, 4])
@pytest.mark.parametrize("name", ["random", "surrogate", "es"])
def test_less_than_a_twentieth_of_the_workers_time_is_idle(name, count, store):
    """Rows take 0.02 to 0.2 s; without running ahead, more than a twentieth is lost."""
    idle = {}
    for ahead in (0, 16):
        pool = ClockPool(count)
        go(store(f"{ahead}"), search(name), 200, ahead, Evaluated(pool))
        idle[ahead] = pool.idle
    assert idle[16] < 0.05 < idle[0]


# ---------------------------------------------------------------------- whole runs

SEARCH = {
    "scenario": "crossroads-s4", "algorithm": "surrogate", "budget": 60, "seed": 5, "keep": 0,
    "triage": "none", "ego": "route-follower", "ahead": 12,
}  # fmt: skip


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory):
    return bg.run_search(**SEARCH, out=tmp_path_factory.mktemp("threads") / "run")


@pytest.mark.parametrize("count", [1, 3])
def test_a_run_is_the_same_with_processes_of_which_one_is_killed(
    undisturbed, tmp_path, count, same_rows
):
    killed = []

    def kill(progress) -> None:
        if not killed:
            killed.append(pool.pids[-1])
            os.kill(killed[0], signal.SIGKILL)

    with closing(Processes(count)) as pool:
        how = SearchCallbacks(batch=kill)
        run = bg.run_search(**SEARCH, out=tmp_path / "run", workers=pool, callbacks=how)
        assert killed[0] not in pool.pids
    assert same_rows(run.folder, undisturbed.folder)
    assert run.settings == undisturbed.settings


def test_a_run_that_is_interrupted_is_resumed(undisturbed, tmp_path, same_rows):
    def interrupt(progress) -> None:
        if progress.evaluations >= 30:
            raise KeyboardInterrupt

    folder = tmp_path / "run"
    how = SearchCallbacks(batch=interrupt)
    with pytest.raises(Interrupted):
        bg.run_search(**SEARCH, out=folder, workers=2, callbacks=how)
    assert 30 <= bg.Run(folder).summary.evaluations < 60
    bg.resume(folder)
    assert same_rows(folder, undisturbed.folder)


def test_a_run_says_how_far_it_was_ahead(undisturbed):
    assert undisturbed.settings.ahead == 12
    assert " --ahead 12 " in undisturbed.settings.command(Path("again"))


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (
            {"algorithm": "pso"},
            "--ahead",
        ),
        ({"ahead": -1}, "10000"),
        (
            {
                "screen": bg.SimulatorChoice("embedded", {}),
                "simulator": bg.SimulatorChoice("esmini"),
            },
            "--ahead",
        ),
    ],
)
def test_who_cannot_run_ahead_is_refused(given, message, tmp_path):
    with refuses(InputError, message):
        bg.run_search(**SEARCH | given, out=tmp_path / "run")
    assert not (tmp_path / "run").exists()


def test_the_page_names_the_algorithms_that_can_run_ahead():
    page = (Path(__file__).parents[2] / "docs" / "scale.md").read_text()
    (line,) = (one for one in page.splitlines() if one.startswith("- **Which algorithms**"))
    able = line.split(". The others")[0]
    assert set(re.findall(r"`([\w-]+)`", able)) == {
        name for name, one in ALGORITHMS.items() if asynchronous(one)
    }


def test_ahead_by_none_is_a_plain_search(tmp_path, same_rows):
    """Also of an algorithm that cannot run ahead."""
    plain = SEARCH | {"algorithm": "pso", "ahead": None}
    run = bg.run_search(**plain, out=tmp_path / "plain")
    again = bg.run_search(**plain | {"ahead": 0}, out=tmp_path / "zero")
    assert same_rows(run.folder, again.folder)
    bg.resume(again.folder)
