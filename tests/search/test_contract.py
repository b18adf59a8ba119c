"""What every search algorithm must do; a new one passes by being registered."""

import warnings
from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bridgegen.base.arrays import Float
from bridgegen.base.errors import InputError, UnknownNameError
from bridgegen.base.extras import is_installed
from bridgegen.jobs.search.loop import Reason, run_loop
from bridgegen.results.store import Store
from bridgegen.search.algorithms import ALGORITHMS, Algorithm, Problem, Results
from bridgegen.search.algorithms.algorithm import asynchronous, resolve

Kind = type[Algorithm]

SMALL = {
    "dqn": {
        **{"epochs": 4, "width": 8, "memory": 200},
        **{"gamma": 0.5, "lr_critic": 0.05, "explore": 2},
    },
    "ddpg": {"epochs": 1, "width": 8, "memory": 200, "noise": 1.0},
    "ppo": {"epochs": 4, "width": 8, "lr_actor": 0.03},
    "ppo-adversary": {"epochs": 2, "width": 8, "lr_actor": 0.03, "minibatch": 16},
    "turbo": {"length": 0.4, "successes": 2, "failures": 3, "shortest": 0.15},
}
"""Other defaults: networks that are trained in no time, settings that show in a few batches."""


def small(algorithm: Kind) -> Any:
    """Return an algorithm with the defaults of SMALL, skipped where its extra is missing."""
    if algorithm.name not in SMALL:
        return pytest.param(algorithm, id=algorithm.name)
    changed = {
        key: replace(algorithm.settings[key], default=value)
        for key, value in SMALL[algorithm.name].items()
    }
    kind = type(algorithm.__name__, (algorithm,), {"settings": {**algorithm.settings, **changed}})
    extra = getattr(algorithm, "extra", None)
    missing = extra is not None and not is_installed(extra)
    skip = pytest.mark.skipif(missing, reason=f"the extra {extra} is not installed")
    return pytest.param(kind, id=algorithm.name, marks=skip)


pytestmark = pytest.mark.parametrize("algorithm", [small(one) for one in ALGORITHMS.values()])


class Toy:
    """An arena without a simulator: what an agent sees is a sum of what it has decided."""

    n_observed = 3

    def __init__(self, n_var: int):
        own = 1 if n_var < 6 else 2  # of the last two thirds of the columns
        self.n_decisions = max(1, 2 * n_var // 3 // own)
        self.decisions = np.arange(n_var - own * self.n_decisions, n_var).reshape(-1, own)

    def play(self, U: Float, act) -> Float:
        U, running = U.copy(), np.ones(len(U), dtype=bool)
        U[:, self.decisions.ravel()] = 0.5
        for columns in self.decisions:
            seen = np.column_stack([U.sum(axis=1), U[:, 0], np.ones(len(U))])
            U[np.ix_(running, columns)] = act(seen, running)[running]
            running &= U[:, columns[0]] < 0.9  # a tenth of them end early
            if not running.any():
                break
        return U


def problem(algorithm: Kind, n_var: int, n_obj: int = 1, names: list[str] | None = None) -> Problem:
    made = Problem.unnamed(n_var, n_obj)
    if names is not None:
        made = Problem(tuple(names), ("m",), n_obj)
    is_adversary = getattr(algorithm, "is_adversary", False)
    return replace(made, arena=Toy(n_var)) if is_adversary and n_var else made


DESIGNS = ("grid", "pairwise")
"""The algorithms that have a size of their own, and end with it."""


def sphere(U: Float, n_obj: int = 1) -> Float:
    centres = np.linspace(0.3, 0.7, n_obj)
    return np.stack([((U - c) ** 2).sum(axis=1) for c in centres], axis=1)


def n_obj_of(algorithm: Kind) -> int:
    return 1 if algorithm.objectives == "one" else 2


def batches(search: Algorithm, n_batches: int, n_obj: int, ok: float = 1.0) -> Iterator[Float]:
    """Yield the rows of n batches; about a share 1 − ok of them fails, with NaN as result."""
    dice = np.random.default_rng(99)
    for _ in range(n_batches):
        U = search.ask()
        yield U.copy()
        good = dice.random(len(U)) < ok
        search.tell(U, results_of(U, good, n_obj))


def drive(search: Algorithm, n_batches: int, n_obj: int, ok: float = 1.0) -> Float:
    """Return the rows of n batches, as `batches`."""
    return np.concatenate(list(batches(search, n_batches, n_obj, ok)))


def results_of(U: Float, ok: np.ndarray, n_obj: int) -> Results:
    F = sphere(U, n_obj)
    # Two of three rows in a ball: no decision tree can tell them apart.
    critical = ok & (F[:, 0] < 0.2) & (np.floor(U[:, 0] * 1e6) % 3 > 0)
    return replace(Results.of_F(np.where(ok[:, None], F, np.nan), ok), critical=critical)


def in_cube(U: Float, n_var: int) -> bool:
    return U.dtype == np.float64 and U.shape[1] == n_var and bool(((U >= 0) & (U <= 1)).all())


def evaluate(X: Float, n_obj: int = 1) -> SimpleNamespace:
    F, m = sphere(X, n_obj), sphere(X)
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


def run(folder, algorithm: Kind, budget: int, *, stop=None, n_var: int = 4, seed: int = 3):
    names, n_obj = [f"p{i}" for i in range(n_var)], n_obj_of(algorithm)
    if folder.exists():
        store = Store.open(folder, write=True)
    else:
        store = Store.create(folder, {}, names, ["m"], n_var=n_var, n_obj=n_obj)
    with store:
        result = run_loop(
            algorithm(problem(algorithm, n_var, n_obj, names), seed),
            lambda U: U,
            lambda X: evaluate(X, n_obj),
            store,
            budget,
            stop=stop,
        )
        rows = store.read()
    return result, rows


@pytest.mark.parametrize(("n_var", "ok"), [(1, 0.5), (3, 1.0), (3, 0.0), (30, 0.5)])
@pytest.mark.parametrize("ahead", [1, 13, 100])
def test_an_asynchronous_one_gets_results_late(algorithm: Kind, n_var, ok, ahead, late):
    if not asynchronous(algorithm):
        pytest.skip("it needs all results before it is asked again")
    n_obj = n_obj_of(algorithm)
    first, second = (
        drive(late(algorithm(problem(algorithm, n_var, n_obj), 3), ahead), 14, n_obj, ok)
        for _ in range(2)
    )
    assert in_cube(first, n_var)
    assert len(first) >= 14 or algorithm.name in DESIGNS
    assert first.tobytes() == second.tobytes()
    if algorithm.name not in DESIGNS:
        assert len(np.unique(first, axis=0)) > 0.8 * len(first)


def test_it_describes_itself(algorithm: Kind):
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
def test_rows_stay_in_the_cube_whatever_fails(algorithm: Kind, n_var: int, ok: float):
    n_obj = n_obj_of(algorithm)
    search = algorithm(problem(algorithm, n_var, n_obj), 0)
    U = drive(search, 12, n_obj, ok)
    assert in_cube(U, n_var)
    assert len(U) >= 12 or (algorithm.name in DESIGNS and len(search.ask()) == 0)


@given(
    seed=st.integers(0, 2**63),
    n_var=st.integers(1, 6),
    scale=st.sampled_from([0.0, 1e-300, 1.0, -1e12, 1e307]),
    data=st.data(),
)
@settings(max_examples=15, deadline=None)
def test_any_finite_objective_and_any_failures(algorithm: Kind, seed, n_var, scale, data):
    n_obj = n_obj_of(algorithm)
    search = algorithm(problem(algorithm, n_var, n_obj), seed)
    for _ in range(4):
        U = search.ask()
        assert in_cube(U, n_var)
        bits = data.draw(st.integers(0, 2 ** len(U) - 1))
        ok = np.array([bits >> k & 1 for k in range(len(U))], dtype=bool)
        F = np.where(ok[:, None], sphere(U, n_obj) * scale, [[np.inf] * n_obj])
        search.tell(U, Results.of_F(F, ok))


def test_one_seed_one_result_whatever_others_draw(algorithm: Kind):
    n_obj = n_obj_of(algorithm)
    np.random.seed(1)  # noqa: NPY002  (the global generator is the point)
    first = drive(algorithm(problem(algorithm, 5, n_obj), 7), 8, n_obj, 0.8)
    np.random.seed(2)  # noqa: NPY002
    second = drive(algorithm(problem(algorithm, 5, n_obj), 7), 8, n_obj, 0.8)
    assert first.tobytes() == second.tobytes()
    assert (
        first.tobytes()
        != drive(algorithm(problem(algorithm, 5, n_obj), 8), 8, n_obj, 0.8).tobytes()
    )


def test_two_searches_do_not_disturb_each_other(algorithm: Kind):
    n_obj = n_obj_of(algorithm)
    alone = drive(algorithm(problem(algorithm, 3, n_obj), 5), 6, n_obj)
    a, b = algorithm(problem(algorithm, 3, n_obj), 5), algorithm(problem(algorithm, 3, n_obj), 6)
    beside = []
    for _ in range(6):
        beside.append(drive(a, 1, n_obj))
        drive(b, 1, n_obj)
    assert np.concatenate(beside).tobytes() == alone.tobytes()


def test_the_global_generator_is_left_alone(algorithm: Kind):
    n_obj = n_obj_of(algorithm)
    np.random.seed(4)  # noqa: NPY002
    before = np.random.get_state()[1].tobytes()  # noqa: NPY002
    drive(algorithm(problem(algorithm, 5, n_obj), 7), 4, n_obj, 0.5)
    assert np.random.get_state()[1].tobytes() == before  # noqa: NPY002


def test_it_says_nothing(algorithm: Kind, capfd):
    n_obj = n_obj_of(algorithm)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        drive(algorithm(problem(algorithm, 5, n_obj), 7), 4, n_obj, 0.5)
    assert capfd.readouterr() == ("", "")


def test_told_arrays_are_not_changed(algorithm: Kind):
    n_obj = n_obj_of(algorithm)
    search = algorithm(problem(algorithm, 3, n_obj), 0)
    for _ in range(3):
        U = search.ask()
        F, ok = sphere(U, n_obj), np.arange(len(U)) % 2 == 0
        F[~ok] = np.nan
        copies = U.copy(), F.copy(), ok.copy()
        search.tell(U, Results.of_F(F, ok))
        for array, copy in zip((U, F, ok), copies, strict=True):
            np.testing.assert_array_equal(array, copy)


def test_rows_may_be_changed_by_who_asked(algorithm: Kind):
    n_obj = n_obj_of(algorithm)

    def vandal(search: Algorithm) -> list[bytes]:
        asked = []
        for _ in range(4):
            U = search.ask()
            kept = U.copy()
            asked.append(kept.tobytes())
            U[:] = 0.5
            search.tell(kept, results_of(kept, np.ones(len(U), bool), n_obj))
        return asked

    untouched = drive(algorithm(problem(algorithm, 3, n_obj), 2), 4, n_obj)
    assert b"".join(vandal(algorithm(problem(algorithm, 3, n_obj), 2))) == untouched.tobytes()


def test_constant_objective(algorithm: Kind):
    search = algorithm(problem(algorithm, 3), 0)
    for _ in range(10):
        U = search.ask()
        assert in_cube(U, 3)
        search.tell(U, Results.of_F(np.zeros((len(U), 1))))


@pytest.mark.parametrize("budget", [1, 39, 40, 137])
def test_the_budget_is_exact(algorithm: Kind, budget: int, tmp_path):
    result, rows = run(tmp_path / "run", algorithm, budget)
    if algorithm.name in DESIGNS and result.reason is Reason.EXHAUSTED:
        assert len(rows) < budget
    else:
        assert result.reason is Reason.BUDGET
        assert len(rows) == budget
    assert len(np.unique(rows.X, axis=0)) == len(rows)
    assert in_cube(rows.U, 4)


def test_no_known_row_is_simulated_twice(algorithm: Kind, tmp_path):
    """Integer parameters: many rows of the cube are one scenario, which is run once."""
    n_obj, simulated, seen, told = n_obj_of(algorithm), [], set(), {}

    def simulate(X: Float) -> SimpleNamespace:
        simulated.extend(map(bytes, X))
        seen.update(map(bytes, X))
        return evaluate(X, n_obj)

    class Told(algorithm):  # type: ignore[misc,valid-type]
        def tell(self, U: Float, results: Results) -> None:
            for k, x in enumerate(np.round(6 * U) / 6):
                if bytes(x) not in seen:  # no place in the budget, which only note-takers hear of
                    assert not results.ok[k]
                    continue
                once = results.F[k].tobytes(), bool(results.ok[k]), bool(results.critical[k])
                assert told.setdefault(bytes(x), once) == once
                assert results.ok[k] == (x[0] <= 0.9)
            super().tell(U, results)

    search = Told(problem(algorithm, 3, n_obj, ["p", "q", "r"]), 3)
    with Store.create(tmp_path / "run", {}, ["p", "q", "r"], ["m"], n_var=3, n_obj=n_obj) as store:
        result = run_loop(search, lambda U: np.round(6 * U) / 6, simulate, store, 120)
        assert store.read().X.tobytes() == b"".join(simulated)
    assert len(seen) == len(simulated) == result.evaluations <= 120
    if algorithm.name not in DESIGNS:
        assert result.evaluations == 120 or result.reason is Reason.CONVERGED
        assert result.repeated > 0


@pytest.fixture(scope="module")
def whole_of(tmp_path_factory):
    """Return what gives the rows of an algorithm that is never interrupted."""

    @cache
    def whole_of(algorithm: Kind):
        return run(tmp_path_factory.mktemp("whole") / "run", algorithm, 210)[1]

    return whole_of


@pytest.mark.parametrize("stops", [[1], [2, 3], [1, 1, 1, 1]])
def test_resumed_anywhere_the_result_is_the_same(
    algorithm: Kind, stops: list[int], whole_of, tmp_path
):
    whole = whole_of(algorithm)
    for n in stops:  # go on for n new batches, then stop
        before = len(Store.open(tmp_path / "parts")) if (tmp_path / "parts").exists() else 0
        again = 0 if hasattr(algorithm, "restore") else before // 40  # batches that are replayed
        left = iter([False] * (n + again) + [True])
        run(tmp_path / "parts", algorithm, 210, stop=lambda left=left: next(left))
    result, parts = run(tmp_path / "parts", algorithm, 210)
    if algorithm.name in DESIGNS and result.reason is Reason.EXHAUSTED:
        assert len(whole) < 210
    else:
        assert result.reason is Reason.BUDGET
        assert 0 < result.simulated < 210
    for name in ("id", "U", "X", "metrics", "F", "status", "critical"):
        assert getattr(parts, name).tobytes() == getattr(whole, name).tobytes(), name


def test_wrong_arguments_are_named(algorithm: Kind):
    with pytest.raises(InputError, match="n_var ≥ 1 must hold, got 0"):
        algorithm(problem(algorithm, 0), 0)
    with pytest.raises(InputError, match="n_obj"):
        algorithm(problem(algorithm, 3, 2 if algorithm.objectives == "one" else 0), 0)
    with pytest.raises(InputError, match="seed ≥ 0 must hold, got -1"):
        algorithm(problem(algorithm, 3), -1)
    some = next(iter(algorithm.settings))
    with pytest.raises(UnknownNameError, match=f"did you mean '{some}'"):
        algorithm(problem(algorithm, 3), 0, **{some + "s": 1})


def test_every_setting_is_checked_and_does_something(algorithm: Kind):
    n_obj = n_obj_of(algorithm)
    usual = list(batches(algorithm(problem(algorithm, 3, n_obj), 0), 8, n_obj))
    for name, setting in algorithm.settings.items():
        with pytest.raises(InputError, match=name):
            algorithm(problem(algorithm, 3, n_obj), 0, **{name: None})
        if isinstance(setting.default, bool):
            other: object = not setting.default
        elif isinstance(setting.default, int | float):
            assert setting.low is not None, "numbers need a range"
            assert setting.high is not None, "numbers need a range"
            with pytest.raises(InputError, match=f"{name} must be in"):
                algorithm(
                    problem(algorithm, 3, n_obj),
                    0,
                    **{name: type(setting.default)(setting.high * 2 + 1)},
                )
            other = type(setting.default)((setting.default + min(setting.high, 100)) / 2)
            other = setting.low if other == setting.default else other
            assert other != setting.default
        else:
            continue
        changed = algorithm(problem(algorithm, 3, n_obj), 0, **{name: other})
        pairs = zip(batches(changed, 8, n_obj), usual, strict=True)
        assert any(one.tobytes() != other.tobytes() for one, other in pairs), (
            f"{name} changes nothing"
        )


def test_defaults_are_what_is_resolved(algorithm: Kind):
    values = resolve(algorithm, problem(algorithm, 3), 0, {})
    assert values == {name: setting.default for name, setting in algorithm.settings.items()}
