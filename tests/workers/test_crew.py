"""Whoever dies, and whenever: every row is done once, and only what kills is lost."""

from collections import deque
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridgegen.errors import WorkersError
from bridgegen.workers import Lost, Recipe
from bridgegen.workers.bench import Bench, Unprepared
from bridgegen.workers.crew import FALSE_STARTS, Chunk, Crew


class Tripler:
    """Says which rows were asked for; rows of poison kill."""

    runs_at_once = 1
    device = "CPU"

    def __init__(self, rows_at_once: int) -> None:
        self.rows_at_once = rows_at_once

    @property
    def recipe(self) -> Recipe:
        return Recipe.of(Tripler, self.rows_at_once)

    def triple(self, X: np.ndarray, poison: frozenset[float]) -> list[float]:
        if poison & set(X.tolist()):
            raise SystemExit
        return [3.0 * x for x in X.tolist()]


class Simulated(Crew[int]):
    """A crew in this thread: who speaks next, and who dies, is drawn.

    Args:
        count: workers.
        fates: numbers, asked one after the other; then nobody dies any more.
    """

    are_here = True

    def __init__(self, count: int, fates: list[int]) -> None:
        super().__init__()
        self.count_, self.fates = count, deque(fates)
        self.hired = self.deaths = 0
        self.benches: dict[int, Bench] = {}
        self.pending: dict[int, Any] = {}

    @property
    def count(self) -> int:
        return self.count_

    def _hire(self) -> int:
        self.hired += 1
        self.benches[self.hired] = Bench()
        self.pending[self.hired] = lambda: ("begun",)
        return self.hired

    def _greet(self, hand):
        self.pending[hand] = lambda: ("answer", self.benches[hand].holds(""))

    def _prepare(self, hand, recipe):
        self.pending[hand] = lambda: ("answer", self.benches[hand].prepare(recipe))

    def _work(self, hand, key, work, X, given):
        self.pending[hand] = lambda: ("answer", self.benches[hand].work(key, work, X, given))

    def _hear(self):
        fate = self.fates.popleft() if self.fates else 0
        hand = sorted(self.pending)[fate % len(self.pending)]
        say = self.pending.pop(hand)
        if fate >= 100:  # killed by somebody
            self.deaths += 1
            return hand, ("died",)
        try:
            return hand, say()
        except SystemExit:
            self.deaths += 1
            return hand, ("died",)
        except Unprepared as error:
            return hand, ("raised", error)

    def _dismiss(self, hand):
        self.pending.pop(hand, None)
        del self.benches[hand]
        return "by decree"


rows = st.lists(st.integers(0, 50).map(float), max_size=40)


def outcome(crew: Simulated, X: list[float], at_once: int, poison: frozenset[float]):
    parts = crew.map(Tripler(at_once), "triple", np.array(X), poison)
    assert sum(part.rows for part in parts) == len(X)
    found: list[float | None] = []
    for part in parts:
        found += [None] * part.rows if isinstance(part.came, Lost) else part.came
    return found


@given(rows, st.integers(1, 9), st.integers(1, 5), st.lists(st.integers(0, 99), max_size=60))
def test_what_is_lost_is_what_kills(X, at_once, workers, fates):
    poison = frozenset({7.0, 30.0})
    crew = Simulated(workers, fates)
    expected = [None if x in poison else 3.0 * x for x in X]
    assert outcome(crew, X, at_once, poison) == expected
    killers = sum(x in poison for x in X)
    # One or two for the chunk, one for each half of it, two for the row; one that was not greeted.
    assert crew.deaths <= killers * (5 + at_once.bit_length())


@given(rows, st.integers(1, 9), st.integers(1, 5), st.lists(st.integers(0, 9), max_size=30))
def test_who_is_killed_now_and_then_costs_nothing(X, at_once, workers, before):
    crew = Simulated(workers, [])
    for k in range(3):
        crew.fates.clear()
        crew.fates += [*before, 100 + k]
        assert outcome(crew, X, at_once, frozenset()) == [3.0 * x for x in X]
    assert len(crew.benches) <= workers


@given(rows, st.integers(1, 9), st.integers(1, 5), st.lists(st.integers(0, 140), max_size=200))
def test_whatever_happens_no_row_is_done_wrong_or_twice(X, at_once, workers, fates):
    crew = Simulated(workers, fates)
    try:
        found = outcome(crew, X, at_once, frozenset())
    except WorkersError:
        return
    assert len(found) == len(X)
    assert all(y in (None, 3.0 * x) for x, y in zip(X, found, strict=True))


def test_a_chunk_is_suspected_after_two_ends():
    chunk = Chunk(0, 5)
    for _ in range(9):  # nobody knows whether it had begun
        assert chunk.after_end(was_there=False) == [chunk]
    assert chunk.after_end(was_there=True) == [chunk]
    first, second = chunk.after_end(was_there=True)
    assert (first.start, first.stop, second.start, second.stop) == (0, 2, 2, 5)
    a, b = first.after_end(was_there=True)  # once is enough now
    c, d = second.after_end(was_there=True)
    assert [(one.start, one.stop) for one in (a, b, c, d)] == [(0, 1), (1, 2), (2, 3), (3, 5)]
    assert a.after_end(was_there=True) == [a]  # a row alone has two ends of its own
    assert a.after_end(was_there=True) == []


@given(rows, st.integers(1, 9), st.integers(2, 5))
def test_a_machine_that_fails_takes_idle_workers_with_it(X, at_once, workers):
    """All die while they are idle, or have just been given something: nobody has heard of it."""
    crew = Simulated(workers, [])
    outcome(crew, X + X, at_once, frozenset())
    dead = set(crew.benches)

    class Gone:
        def work(self, *_):
            raise SystemExit

        holds = prepare = work

    crew.benches = dict.fromkeys(dead, Gone())
    assert outcome(crew, X, at_once, frozenset()) == [3.0 * x for x in X]


def test_workers_that_never_begin_are_given_up():
    crew = Simulated(2, [100] * 10)
    with pytest.raises(WorkersError, match=r"3 workers in a row .* ready: by decree"):
        crew.map(Tripler(1), "triple", np.array([1.0]), frozenset())
    assert crew.deaths == FALSE_STARTS
    assert not crew.benches  # all have been let go


def test_a_worker_keeps_its_bench_between_batches():
    crew, portable = Simulated(2, []), Tripler(1)
    for _ in range(5):
        crew.map(portable, "triple", np.arange(4.0), frozenset())
    assert crew.hired == 2


def test_what_a_bench_has_not_kept_is_made_again():
    crew, portable = Simulated(1, []), Tripler(1)
    crew.map(portable, "triple", np.arange(2.0), frozenset())
    crew.benches[1] = Bench()  # it has been begun again by others, say
    assert outcome(crew, [5.0], 1, frozenset()) == [15.0]
    assert crew.hired == 1
