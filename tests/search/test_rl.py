"""What is particular to deep reinforcement learning; the contract is in test_contract.py."""

import os
import signal
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from tests.approval import refuses

from bridgegen.base.errors import InputError
from bridgegen.base.extras import EXTRAS, Extra
from bridgegen.jobs.search.loop import Reason, run_loop
from bridgegen.results.store import Store
from bridgegen.search.algorithms import Problem, Results, get
from bridgegen.search.algorithms.observation import Observer, Reward, step_from
from bridgegen.search.rl.agent import Walkers

NAMES = ("dqn", "ddpg", "ppo")
SMALL = {"epochs": 2, "width": 8, "population": 10}
PROBLEM = Problem(("a", "b", "c"), ("d_min", "v_d", "ttc", "mine"))


def evaluate(X):
    F = ((X - 0.3) ** 2).sum(axis=1, keepdims=True)
    status = np.where(X[:, 0] > 0.9, 1, 0)
    F[status == 1] = np.nan
    critical = F[:, 0] < 0.05
    metrics = np.hstack([F, F * 2, 1.0 / F, -F])
    return SimpleNamespace(
        messages={},
        cause=None,
        findings=None,
        metrics=metrics,
        F=F,
        critical=critical,
        status=status,
    )


def results_of(U):
    found = evaluate(U)
    ok = found.status == 0
    return replace(Results.of_F(found.F, ok), critical=found.critical & ok, metrics=found.metrics)


def drive(search, n):
    asked = []
    for _ in range(n):
        U = search.ask()
        search.tell(U, results_of(U))
        asked.append(U)
    return np.concatenate(asked)


# ---------------------------------------------------------------------- observation, reward, step


def test_what_is_observed_by_hand():
    observe = Observer(PROBLEM)
    metrics = np.array([[0.0, 999.0, np.inf, -1.0], [np.nan, np.nan, np.nan, np.nan]])
    seen = observe(np.array([[0.0, 0.5, 1.0], [0.25, 0.25, 0.25]]), metrics)
    assert seen.dtype == np.float32
    # A time to collision that never comes counts as its cap, 20 s: ln 21 / ln 1001.
    by_hand = [-1, 0, 1, 0.0, np.log(1000) / np.log(1001), 0.4406761, -0.1003288]
    np.testing.assert_allclose(seen[0], by_hand, rtol=1e-6)
    np.testing.assert_allclose(seen[1], [-0.5, -0.5, -0.5, 0, 0, 0, 0])


@given(arrays(np.float64, (3, 4), elements=st.floats(allow_nan=True, allow_infinity=True)))
def test_whatever_the_metrics_observations_are_in_their_box(metrics):
    seen = Observer(PROBLEM)(np.full((3, 3), 0.5), metrics)
    assert np.isfinite(seen).all()
    assert (np.abs(seen) <= 1.0).all()


def test_the_first_results_set_the_scale_of_rewards():
    reward = Reward()
    assert reward(np.array([7.0, np.nan]), np.array([False, True])).tolist() == [-5.0, -5.0]
    F = np.array([2.0, 4.0, 6.0, 8.0, 10.0])
    # Median 6, quartiles 4 and 8.
    assert reward(F, np.ones(5, bool)).tolist() == [1.0, 0.5, 0.0, -0.5, -1.0]
    assert reward(np.array([-94.0, 6.0]), np.array([True, False])).tolist() == [5.0, -5.0]


def test_equal_results_are_rewarded_by_their_sign():
    reward = Reward()
    assert reward(np.zeros(3), np.ones(3, bool)).tolist() == [0.0] * 3
    assert reward(np.array([-1e-9, 1e-9]), np.ones(2, bool)).tolist() == [5.0, -5.0]
    reward = Reward()
    reward(np.array([-0.0, 0.0, -0.0, -0.0]), np.ones(4, bool))
    assert reward(np.array([-1e-9, 1e-9]), np.ones(2, bool)).tolist() == [5.0, -5.0]


@given(
    arrays(np.float64, 6, elements=st.floats(allow_nan=True, allow_infinity=True)),
    arrays(np.float64, 6, elements=st.floats(allow_nan=True, allow_infinity=True)),
)
def test_rewards_are_finite_and_larger_for_smaller_F(first, second):
    reward, ok = Reward(), np.ones(6, bool)
    reward(first, ok)
    r = reward(second, ok)
    assert (np.abs(r) <= 5.0).all()
    finite = np.isfinite(second)
    order = np.argsort(second[finite])
    assert (np.diff(r[finite][order]) <= 0.0).all()


def test_steps_are_reflected():
    moved = step_from(np.array([[0.9, 0.1, 0.5]]), np.array([[0.2, -0.3, 2.0]]))
    np.testing.assert_allclose(moved, [[0.9, 0.2, 0.5]])


# ---------------------------------------------------------------------- episodes


def results(F, ok=None):
    return Results.of_F(np.array(F, float)[:, np.newaxis], ok)


def test_episodes_end_out_of_step_and_begin_at_the_best_rows():
    walkers = Walkers(Problem.unnamed(1), 4, horizon=2, elite=2)
    rng = np.random.default_rng(0)
    U = np.array([[0.1], [0.2], [0.3], [0.4]])
    reward, seen = walkers.step(U, results([4.0, 3.0, 2.0, 1.0]), rng)
    assert reward.tolist() == sorted(reward.tolist())
    np.testing.assert_allclose(seen[:, 0], [-0.8, -0.6, -0.4, -0.2], rtol=1e-6)
    assert walkers.U[[0, 2], 0].tolist() == [0.1, 0.3]
    assert set(walkers.U[[1, 3], 0]) <= {0.3, 0.4}  # the two best
    np.testing.assert_allclose(walkers.observation[:, 0], 2 * walkers.U[:, 0] - 1, rtol=1e-6)
    walkers.step(walkers.U.copy(), results([9.0, 9.0, 9.0, 9.0]), rng)
    assert set(walkers.U[[0, 2], 0]) <= {0.3, 0.4}


def test_who_fails_begins_anew():
    walkers = Walkers(Problem.unnamed(1), 3, horizon=100, elite=1)
    U = np.array([[0.1], [0.2], [0.3]])
    ok = np.array([True, False, True])
    walkers.step(U, results([1.0, np.nan, 0.5], ok), np.random.default_rng(0))
    assert walkers.U[:, 0].tolist() == [0.1, 0.3, 0.3]


# ---------------------------------------------------------------------- the algorithms


@pytest.fixture
def learners():
    pytest.importorskip("torch")
    pytest.importorskip("stable_baselines3")


@pytest.mark.parametrize("name", NAMES)
def test_without_the_extra_one_sentence(name, monkeypatch):
    monkeypatch.setitem(EXTRAS, "rl", Extra(("json", "no_such_module"), ""))
    with pytest.raises(InputError) as error:
        get(name)(PROBLEM, 0)
    said = f"algorithm '{name}' needs the extra 'rl': pip install 'bridgegen[rl]'"
    assert str(error.value) == said


def test_nobody_else_pays_for_torch():
    code = (
        "import sys; from bridgegen.search.algorithms import ALGORITHMS, Problem, get; "
        "get('random')(Problem.unnamed(3), 0).ask(); [one.settings for one in ALGORITHMS.values()];"
        "sys.exit(any(one in sys.modules for one in ('torch', 'gymnasium', 'stable_baselines3')))"
    )
    assert subprocess.run([sys.executable, "-c", code]).returncode == 0


def test_torchs_generator_and_threads_are_left_alone(learners):
    import torch

    before, threads = torch.get_rng_state(), torch.get_num_threads()
    for name in NAMES:
        drive(get(name)(PROBLEM, 0, **SMALL), 3)
    assert torch.equal(torch.get_rng_state(), before)
    assert torch.get_num_threads() == threads


def test_actor_and_critic_have_rates_of_their_own(learners):
    """At rate 0 a network stays as it is; the paper's are the defaults."""
    for name in ("ddpg", "ppo"):
        assert get(name).settings["lr_actor"].default == 3e-4
        assert get(name).settings["lr_critic"].default == 1e-3
        for still, moving in (("lr_actor", "critic"), ("lr_critic", "actor")):
            search = get(name)(PROBLEM, 0, **SMALL, **{still: 0.0})
            before = networks(search)
            drive(search, 3)
            after = networks(search)
            assert before["actor"] == after["actor"] or still == "lr_critic"
            assert before["critic"] == after["critic"] or still == "lr_actor"
            assert before[moving] != after[moving]


def networks(search):
    """Return the bytes of the networks, without those that only follow."""
    parts = {"actor": b"", "critic": b""}
    for key, array in search._arrays.items():
        if key.startswith("net ") and "target" not in key and "log_std" not in key:
            critic = "critic" in key or "value" in key
            parts["critic" if critic else "actor"] += array.tobytes()
    return parts


@pytest.mark.parametrize("name", NAMES)
def test_restored_it_is_what_it_was(name, learners):
    whole = get(name)(PROBLEM, 5, **SMALL)
    for n in (1, 1, 2):
        drive(whole, n)
        other = get(name)(PROBLEM, 5, **SMALL)
        other.restore(whole.state())
        assert other.state() == whole.state()
        following = drive(other, 3)
        again = get(name)(PROBLEM, 5, **SMALL)
        again.restore(whole.state())
        assert drive(again, 3).tobytes() == following.tobytes()
    undisturbed = get(name)(PROBLEM, 5, **SMALL)
    assert drive(undisturbed, 7)[40:].tobytes() == following.tobytes()


@pytest.mark.parametrize("name", NAMES)
def test_what_is_no_state_is_refused_and_changes_nothing(name, learners):
    search = get(name)(PROBLEM, 5, **SMALL)
    drive(search, 2)
    state = search.state()
    nan = np.float32(np.nan).tobytes()
    at = state.index(b"\n") + 1 + sum(
        array.nbytes for key, array in search._arrays.items() if not key.startswith(("net", "adam"))
        and not key.startswith("memory")
    )  # fmt: skip
    wrong = {
        "not a state": [b"", b"{}\n", state[:50], b"\x80\x04" + state],
        "wrong length": [state[:-1], state + b"0"],
        "NaN": [state[:at] + nan + state[at + 4 :]],
    }
    for message, states in wrong.items():
        for one in states:
            with pytest.raises(ValueError, match=message):
                search.restore(one)
            assert search.state() == state
    other = get(name)(PROBLEM, 5, **{**SMALL, "width": 9})
    with refuses(ValueError, name):
        other.restore(state)


@pytest.mark.parametrize("name", NAMES)
def test_its_state_is_bounded(name, learners):
    search = get(name)(Problem(tuple("abcdefghij"), PROBLEM.metrics), 0)
    assert len(search.state()) < 1_000_000


def test_ppo_that_has_learnt_nothing_is_random_sampling(learners):
    """u = Φ(a): means and variances of uniform numbers."""
    settings = {"action": "row", "population": 2000, "lr_actor": 0.0, "lr_std": 0.0, "epochs": 1}
    search = get("ppo")(Problem.unnamed(3), 1, **settings)
    U = drive_sphere(search, 2)[2000:]
    np.testing.assert_allclose(U.mean(axis=0), 0.5, atol=0.02)
    np.testing.assert_allclose(U.var(axis=0), 1 / 12, atol=0.005)


def drive_sphere(search, n):
    asked = []
    for _ in range(n):
        U = search.ask()
        search.tell(U, Results.of_F(((U - 0.8) ** 2).sum(axis=1, keepdims=True)))
        asked.append(U)
    return np.concatenate(asked)


@pytest.mark.parametrize("name", ["ddpg", "ppo"])
def test_rows_alone_are_learnt(name, learners):
    """With rows as actions nothing but the policy can bring it nearer."""
    search = get(name)(Problem.unnamed(4), 1, action="row")
    distance = np.abs(drive_sphere(search, 14) - 0.8).mean(axis=1)
    still = get(name)(Problem.unnamed(4), 1, action="row", lr_actor=0.0)
    unlearnt = np.abs(drive_sphere(still, 14) - 0.8).mean(axis=1)
    assert distance[-80:].mean() < 0.8 * unlearnt[-80:].mean()


def test_dqn_learns_which_way_to_step(learners):
    """Episodes that never begin anew: only what it has learnt leads it."""
    settings = {"horizon": 1000, "step": 0.05, "explore": 5}
    distance = [
        np.abs(drive_sphere(get("dqn")(Problem.unnamed(2), 1, **settings, **one), 20) - 0.8)[-80:]
        for one in ({}, {"lr_critic": 0.0})
    ]
    assert distance[0].mean() < 0.6 * distance[1].mean()


def test_an_action_is_a_step_or_a_row():
    with refuses(InputError, "jump", "action"):
        get("ppo")(PROBLEM, 0, action="jump")


# ---------------------------------------------------------------------- SIGKILL

KILLED = f"""
import os, signal, sys
sys.path.insert(0, {str(Path(__file__).parent)!r})
import test_rl as t

def deadly(X, left=[35]):
    left[0] -= len(X)
    if left[0] <= 0:
        os.kill(os.getpid(), signal.SIGKILL)
    return t.evaluate(X)

t.go(t.Path(sys.argv[1]), sys.argv[2], deadly)
"""


def go(folder, name, simulate=evaluate, budget=73):
    if folder.exists():
        store = Store.open(folder, write=True)
    else:
        store = Store.create(folder, {}, PROBLEM.parameters, PROBLEM.metrics, n_var=3, n_obj=1)
    with store:
        search = get(name)(PROBLEM, 9, **SMALL)
        return run_loop(search, lambda U: U, simulate, store, budget), store.read()


def test_killed_and_gone_on_with(tmp_path, learners):
    command = [sys.executable, "-c", KILLED, str(tmp_path / "killed"), "ppo"]
    assert subprocess.run(command, env=os.environ).returncode == -signal.SIGKILL
    result, rows = go(tmp_path / "killed", "ppo")
    assert result.reason is Reason.BUDGET
    assert result.simulated < 50
    assert result.batches < 6  # the first ones were not asked again
    _, whole = go(tmp_path / "whole", "ppo")
    for field in ("U", "X", "F", "metrics"):
        assert getattr(rows, field).tobytes() == getattr(whole, field).tobytes()
