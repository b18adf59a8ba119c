"""The contract of search algorithms."""

import warnings
from collections.abc import Callable, Iterator, Mapping
from dataclasses import fields, replace
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from bridgegen.base.arrays import Bool, Float
from bridgegen.base.errors import InputError, UnknownNameError
from bridgegen.jobs.search.loop import LoopResult, Reason, run_loop
from bridgegen.results.store import Rows, Store
from bridgegen.search.algorithms import Algorithm, Problem, Results
from bridgegen.search.algorithms.algorithm import Value, asynchronous, resolve


class Toy:
    """An arena without a simulator: what an agent sees is a sum of what it has decided."""

    n_observed = 3

    def __init__(self, n_var: int):
        own = 1 if n_var < 6 else 2  # of the last two thirds of the columns
        self.n_decisions = max(1, 2 * n_var // 3 // own)
        self.decisions = np.arange(n_var - own * self.n_decisions, n_var).reshape(-1, own)

    def play(self, U: Float, act: Callable[[Float, Bool], Float]) -> Float:
        """Return rows with the agent's decisions."""
        U, running = U.copy(), np.ones(len(U), dtype=bool)
        U[:, self.decisions.ravel()] = 0.5
        for columns in self.decisions:
            seen = np.column_stack([U.sum(axis=1), U[:, 0], np.ones(len(U))])
            U[np.ix_(running, columns)] = act(seen, running)[running]
            running &= U[:, columns[0]] < 0.9  # a tenth of them end early
            if not running.any():
                break
        return U


class Late:
    """An algorithm that gets results late, though it is told them after each batch.

    Args:
        search: the algorithm.
        ahead: how many rows are not told; all of the first batch are.
    """

    def __init__(self, search: Algorithm, ahead: int) -> None:
        self.search, self.ahead = search, ahead
        self.U: Float | None = None
        self.results: Results | None = None

    def ask(self) -> Float:
        """Return the next rows of the algorithm."""
        return self.search.ask()

    def tell(self, U: Float, results: Results) -> None:
        """Tell the algorithm the oldest results that it does not have, but for ``ahead``."""
        if self.U is None or self.results is None:
            self.search.tell(U, results)
            self.U, self.results = U[:0], _taken(results, slice(0))
            return
        self.U = np.concatenate([self.U, U])
        self.results = Results(
            *(
                np.concatenate([getattr(self.results, field.name), getattr(results, field.name)])
                for field in fields(Results)
            )
        )
        n = len(self.U) - self.ahead
        if n > 0:
            self.search.tell(self.U[:n], _taken(self.results, slice(n)))
            self.U, self.results = self.U[n:], _taken(self.results, slice(n, None))


def _taken(results: Results, rows: slice) -> Results:
    return Results(*(getattr(results, field.name)[rows] for field in fields(Results)))


Search = Algorithm | Late


def _n_obj(algorithm: type[Algorithm]) -> int:
    return 1 if algorithm.objectives == "one" else 2


def _made(
    algorithm: type[Algorithm], problem: Problem, seed: int, settings: Any = None
) -> Algorithm:
    """Return an algorithm with a problem; an adversary, with an arena, too."""
    if getattr(algorithm, "is_adversary", False) and problem.n_var:
        problem = replace(problem, arena=Toy(problem.n_var))
    return algorithm(problem, seed, **(settings or {}))


def _recorded(algorithm: type[Algorithm], names: list[str]) -> Algorithm:
    """Return an algorithm whose search is recorded: with names of parameters and a metric."""
    return _made(algorithm, Problem(tuple(names), ("m",), _n_obj(algorithm)), 3)


def _sphere(U: Float, n_obj: int = 1) -> Float:
    centres = np.linspace(0.3, 0.7, n_obj)
    return np.stack([((U - c) ** 2).sum(axis=1) for c in centres], axis=1)


def _global_generator() -> bytes:
    state: Any = np.random.get_state()  # noqa: NPY002
    return bytes(state[1].tobytes())


def _results(U: Float, ok: Bool, n_obj: int) -> Results:
    F = _sphere(U, n_obj)
    # Two of three rows in a ball: no decision tree can tell them apart.
    critical = ok & (F[:, 0] < 0.2) & (np.floor(U[:, 0] * 1e6) % 3 > 0)
    return replace(Results.of_F(np.where(ok[:, None], F, np.nan), ok), critical=critical)


def _batches(search: Search, n_batches: int, n_obj: int, ok: float = 1.0) -> Iterator[Float]:
    """Yield the rows of n batches; about a share 1 − ok of them fails, with NaN as result."""
    dice = np.random.default_rng(99)
    for _ in range(n_batches):
        U = search.ask()
        yield U.copy()
        good = dice.random(len(U)) < ok
        search.tell(U, _results(U, good, n_obj))


def _drive(search: Search, n_batches: int, n_obj: int, ok: float = 1.0) -> Float:
    """Return the rows of n batches, as `_batches`."""
    return np.concatenate(list(_batches(search, n_batches, n_obj, ok)))


def _in_cube(U: Float, n_var: int) -> bool:
    return U.dtype == np.float64 and U.shape[1] == n_var and bool(((U >= 0) & (U <= 1)).all())


def _evaluate(X: Float, n_obj: int) -> Any:
    F, m = _sphere(X, n_obj), _sphere(X)
    status = np.where(X[:, 0] > 0.9, 1, 0)  # a tenth of the cube cannot be simulated
    F[status == 1] = np.nan
    m[status == 1] = np.nan
    return SimpleNamespace(
        messages={},
        cause=None,
        findings=None,
        metrics=m,
        F=F,
        critical=m[:, 0] < 0.1,
        status=status,
    )


def _run(
    folder: Path, algorithm: type[Algorithm], budget: int, stop: Callable[[], bool] | None = None
) -> tuple[LoopResult, Rows]:
    """Run or resume a search of four parameters; return its result and all rows."""
    names, n_obj = [f"p{i}" for i in range(4)], _n_obj(algorithm)
    if folder.exists():
        store = Store.open(folder, write=True)
    else:
        store = Store.create(folder, {}, names, ["m"], n_var=4, n_obj=n_obj)
    with store:
        result = run_loop(
            _recorded(algorithm, names),
            lambda U: U,
            lambda X: _evaluate(X, n_obj),
            store,
            budget,
            stop=stop,
        )
        rows = store.read()
    return result, rows


@cache
def _uninterrupted(algorithm: type[Algorithm]) -> tuple[Rows, int, int]:
    """Return the rows of a search that is never interrupted, its budget, and rows per batch."""
    batch = max(40, len(_made(algorithm, Problem.unnamed(4, _n_obj(algorithm)), 3).ask()))
    budget = 5 * batch + 10
    with TemporaryDirectory() as folder:
        return _run(Path(folder) / "run", algorithm, budget)[1], budget, batch


class AlgorithmContract:
    """What every search algorithm must do; inherit from it, and pytest runs its tests.

    A test whose rule an algorithm cannot keep by design is overridden.

    Attributes:
        algorithm: the class under test, see `bridgegen.search.algorithms.Algorithm`. Its
            constructor checks its arguments by `bridgegen.search.algorithms.algorithm.resolve`.
        is_finite: whether it has a size of its own, as a design of experiments has, and may end
            before the budget.
    """

    algorithm: type[Algorithm]
    is_finite: bool = False

    @property
    def n_obj(self) -> int:
        """Number of objectives of the searches."""
        return _n_obj(self.algorithm)

    def search(
        self,
        n_var: int,
        seed: int,
        settings: Mapping[str, Value | None] | None = None,
        n_obj: int | None = None,
    ) -> Algorithm:
        """Return a search of n parameters, x0, x1 and so on."""
        problem = Problem.unnamed(n_var, self.n_obj if n_obj is None else n_obj)
        return _made(self.algorithm, problem, seed, settings)

    @pytest.mark.parametrize(("n_var", "ok"), [(1, 0.5), (3, 1.0), (3, 0.0), (30, 0.5)])
    @pytest.mark.parametrize("ahead", [1, 13, 100])
    def test_an_asynchronous_one_gets_results_late(self, n_var: int, ok: float, ahead: int) -> None:
        if not asynchronous(self.algorithm):
            pytest.skip("it needs all results before it is asked again")
        first, second = (
            _drive(Late(self.search(n_var, 3), ahead), 14, self.n_obj, ok) for _ in range(2)
        )
        assert _in_cube(first, n_var)
        assert len(first) >= 14 or self.is_finite
        assert first.tobytes() == second.tobytes()
        if not self.is_finite:
            assert len(np.unique(first, axis=0)) > 0.8 * len(first)

    def test_it_describes_itself(self) -> None:
        algorithm = self.algorithm
        assert algorithm.name
        assert algorithm.name == algorithm.name.lower()
        assert len(algorithm.description) > 10
        assert len(algorithm.source) > 10
        assert algorithm.objectives in ("one", "many", "any")
        for name, setting in algorithm.settings.items():
            assert name.isidentifier()
            assert len(setting.text) > 5
            if isinstance(setting.default, int | float) and setting.low is not None:
                assert setting.high is not None
                assert setting.low <= setting.default <= setting.high

    @pytest.mark.parametrize(("n_var", "ok"), [(1, 0.5), (2, 1.0), (2, 0.0), (30, 0.5)])
    def test_rows_stay_in_the_cube_whatever_fails(self, n_var: int, ok: float) -> None:
        search = self.search(n_var, 0)
        U = _drive(search, 12, self.n_obj, ok)
        assert _in_cube(U, n_var)
        assert len(U) >= 12 or (self.is_finite and len(search.ask()) == 0)

    @given(
        seed=st.integers(0, 2**63),
        n_var=st.integers(1, 6),
        scale=st.sampled_from([0.0, 1e-300, 1.0, -1e12, 1e307]),
        data=st.data(),
    )
    @settings(
        max_examples=15, deadline=None, suppress_health_check=[HealthCheck.differing_executors]
    )
    def test_any_finite_objective_and_any_failures(
        self, seed: int, n_var: int, scale: float, data: st.DataObject
    ) -> None:
        search = self.search(n_var, seed)
        for _ in range(4):
            U = search.ask()
            assert _in_cube(U, n_var)
            bits = data.draw(st.integers(0, 2 ** len(U) - 1))
            ok = np.array([bits >> k & 1 for k in range(len(U))], dtype=bool)
            F = np.where(ok[:, None], _sphere(U, self.n_obj) * scale, [[np.inf] * self.n_obj])
            search.tell(U, Results.of_F(F, ok))

    def test_one_seed_one_result_whatever_others_draw(self) -> None:
        np.random.seed(1)  # noqa: NPY002  (the global generator is the point)
        first = _drive(self.search(5, 7), 8, self.n_obj, 0.8)
        np.random.seed(2)  # noqa: NPY002
        second = _drive(self.search(5, 7), 8, self.n_obj, 0.8)
        assert first.tobytes() == second.tobytes()
        assert first.tobytes() != _drive(self.search(5, 8), 8, self.n_obj, 0.8).tobytes()

    def test_two_searches_do_not_disturb_each_other(self) -> None:
        alone = _drive(self.search(3, 5), 6, self.n_obj)
        a, b = self.search(3, 5), self.search(3, 6)
        beside = []
        for _ in range(6):
            beside.append(_drive(a, 1, self.n_obj))
            _drive(b, 1, self.n_obj)
        assert np.concatenate(beside).tobytes() == alone.tobytes()

    def test_the_global_generator_is_left_alone(self) -> None:
        np.random.seed(4)  # noqa: NPY002
        before = _global_generator()
        _drive(self.search(5, 7), 4, self.n_obj, 0.5)
        assert _global_generator() == before

    def test_it_says_nothing(self, capfd: pytest.CaptureFixture[str]) -> None:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            _drive(self.search(5, 7), 4, self.n_obj, 0.5)
        assert capfd.readouterr() == ("", "")

    def test_told_arrays_are_not_changed(self) -> None:
        search = self.search(3, 0)
        for _ in range(3):
            U = search.ask()
            F, ok = _sphere(U, self.n_obj), np.arange(len(U)) % 2 == 0
            F[~ok] = np.nan
            copies = U.copy(), F.copy(), ok.copy()
            search.tell(U, Results.of_F(F, ok))
            for array, copy in zip((U, F, ok), copies, strict=True):
                np.testing.assert_array_equal(array, copy)

    def test_rows_may_be_changed_by_who_asked(self) -> None:
        untouched, search = _drive(self.search(3, 2), 4, self.n_obj), self.search(3, 2)
        asked = []
        for _ in range(4):
            U = search.ask()
            kept = U.copy()
            asked.append(kept.tobytes())
            U[:] = 0.5
            search.tell(kept, _results(kept, np.ones(len(U), bool), self.n_obj))
        assert b"".join(asked) == untouched.tobytes()

    def test_constant_objective(self) -> None:
        search = self.search(3, 0, n_obj=1)
        for _ in range(10):
            U = search.ask()
            assert _in_cube(U, 3)
            search.tell(U, Results.of_F(np.zeros((len(U), 1))))

    @pytest.mark.parametrize("budget", [1, 39, 40, 137])
    def test_the_budget_is_exact(self, budget: int, tmp_path: Path) -> None:
        result, rows = _run(tmp_path / "run", self.algorithm, budget)
        if self.is_finite and result.reason is Reason.EXHAUSTED:
            assert len(rows) < budget
        else:
            assert result.reason is Reason.BUDGET
            assert len(rows) == budget
        assert len(np.unique(rows.X, axis=0)) == len(rows)
        assert _in_cube(rows.U, 4)

    def test_no_known_row_is_simulated_twice(self, tmp_path: Path) -> None:
        """Integer parameters: many rows of the cube are one scenario, which is run once."""
        n_obj, names, algorithm = self.n_obj, ["p", "q", "r"], self.algorithm
        simulated: list[bytes] = []
        seen: set[bytes] = set()
        told: dict[bytes, tuple[bytes, bool, bool]] = {}

        def simulate(X: Float) -> Any:
            simulated.extend(map(bytes, X))
            seen.update(map(bytes, X))
            return _evaluate(X, n_obj)

        class Told(algorithm):  # type: ignore[misc,valid-type]
            def tell(self, U: Float, results: Results) -> None:
                for k, x in enumerate(np.round(6 * U) / 6):
                    if bytes(x) not in seen:  # beyond the budget, which only note-takers hear of
                        assert not results.ok[k]
                        continue
                    once = results.F[k].tobytes(), bool(results.ok[k]), bool(results.critical[k])
                    assert told.setdefault(bytes(x), once) == once
                    assert results.ok[k] == (x[0] <= 0.9)
                super().tell(U, results)

        search = _recorded(Told, names)
        with Store.create(tmp_path / "run", {}, names, ["m"], n_var=3, n_obj=n_obj) as store:
            result = run_loop(search, lambda U: np.round(6 * U) / 6, simulate, store, 120)
            assert store.read().X.tobytes() == b"".join(simulated)
        assert len(seen) == len(simulated) == result.evaluations <= 120
        if not self.is_finite:
            assert result.evaluations == 120 or result.reason is Reason.CONVERGED
            assert result.repeated > 0

    @pytest.mark.parametrize("stops", [[1], [2, 3], [1, 1, 1, 1]])
    def test_resumed_anywhere_the_result_is_the_same(
        self, stops: list[int], tmp_path: Path
    ) -> None:
        whole, budget, batch = _uninterrupted(self.algorithm)
        parts = tmp_path / "parts"
        for n in stops:  # continue for n new batches, then stop
            before = len(Store.open(parts)) if parts.exists() else 0
            again = 0 if hasattr(self.algorithm, "restore") else before // batch  # are replayed
            left = iter([False] * (n + again) + [True])
            _run(parts, self.algorithm, budget, stop=lambda left=left: next(left))  # type: ignore[misc]
        result, rows = _run(parts, self.algorithm, budget)
        if self.is_finite and result.reason is Reason.EXHAUSTED:
            assert len(whole) < budget
        else:
            assert result.reason is Reason.BUDGET
            assert 0 < result.simulated < budget
        for name in ("id", "U", "X", "metrics", "F", "status", "critical"):
            assert getattr(rows, name).tobytes() == getattr(whole, name).tobytes(), name

    def test_wrong_arguments_are_named(self) -> None:
        with pytest.raises(InputError, match="n_var ≥ 1 must hold, got 0"):
            self.search(0, 0)
        with pytest.raises(InputError, match="n_obj"):
            self.search(3, 0, n_obj=2 if self.algorithm.objectives == "one" else 0)
        with pytest.raises(InputError, match="seed ≥ 0 must hold, got -1"):
            self.search(3, -1)
        known = next(iter(self.algorithm.settings), "")
        with pytest.raises(UnknownNameError, match=f"did you mean '{known}'" if known else None):
            self.search(3, 0, {known + "s": 1})

    def test_every_setting_is_checked_and_does_something(self) -> None:
        usual = list(_batches(self.search(3, 0), 8, self.n_obj))
        for name, setting in self.algorithm.settings.items():
            with pytest.raises(InputError, match=name):
                self.search(3, 0, {name: None})
            if isinstance(setting.default, bool):
                other: Value = not setting.default
            elif isinstance(setting.default, int | float):
                assert setting.low is not None, "numbers need a range"
                assert setting.high is not None, "numbers need a range"
                kind = type(setting.default)
                with pytest.raises(InputError, match=f"{name} must be in"):
                    self.search(3, 0, {name: kind(setting.high * 2 + 1)})
                other = kind((setting.default + min(setting.high, 100)) / 2)
                other = setting.low if other == setting.default else other
                assert other != setting.default
            else:
                continue
            changed = _batches(self.search(3, 0, {name: other}), 8, self.n_obj)
            assert any(
                rows.tobytes() != before.tobytes()
                for rows, before in zip(changed, usual, strict=True)
            ), f"{name} changes nothing"

    def test_defaults_are_what_is_resolved(self) -> None:
        values = resolve(self.algorithm, Problem.unnamed(3, self.n_obj), 0, {})
        assert values == {
            name: setting.default for name, setting in self.algorithm.settings.items()
        }
