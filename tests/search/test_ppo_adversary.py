from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from tests.approval import refuses

import bridgegen as bg
from bridgegen.assess.cause import Cause
from bridgegen.base.errors import InputError
from bridgegen.base.extras import is_installed
from bridgegen.search.algorithms import Problem, Results, get

pytestmark = pytest.mark.skipif(not is_installed("rl"), reason="the extra rl is not installed")


class Chase:
    """Six steps in which an agent should be where a target is that it sees."""

    n_decisions, n_observed = 6, 2
    decisions = np.arange(1, 13).reshape(6, 2)

    def play(self, U, act):
        U, running = U.copy(), np.ones(len(U), dtype=bool)
        for k, columns in enumerate(self.decisions):
            seen = np.column_stack([2.0 * U[:, 0] - 1.0, np.full(len(U), k / 6)])
            U[:, columns] = act(seen, running)
        return U

    @staticmethod
    def miss(U):
        return np.abs(U[:, 1:13:2] - U[:, :1]).mean(axis=1)


@cache
def driven(n_batches, cause=Cause.PLANNING, **settings):
    """Return how far from the target the agent was, batch by batch."""
    problem = replace(Problem.unnamed(13), arena=Chase())
    search, missed = get("ppo-adversary")(problem, 1, **settings), []
    for _ in range(n_batches):
        U = search.ask()
        miss = Chase.miss(U)
        told = Results.of_F(miss[:, None])
        critical = miss < 0.2
        found = np.where(critical, cause, Cause.NONE).astype(np.int8)
        search.tell(U, replace(told, critical=critical, cause=found))
        missed.append(miss.mean())
    return missed


def test_it_learns_to_be_where_what_it_sees_tells_it_to_be():
    missed = driven(20, lr_actor=3e-3)
    assert np.mean(missed[-4:]) < 0.8 * np.mean(missed[:4])


def test_unavoidable_harm_is_not_worth_looking_for():
    avoidable = driven(20, lr_actor=3e-3)
    unavoidable = driven(20, Cause.UNAVOIDABLE, lr_actor=3e-3)
    assert np.mean(avoidable[-4:]) < 0.9 * np.mean(unavoidable[-4:])


def test_it_needs_somebody_to_drive():
    with refuses(InputError):
        get("ppo-adversary")(Problem.unnamed(5), 0)


def test_a_search_hands_over_what_it_drove(tmp_path):
    run = bg.run_search(
        "crossroads-s2",
        algorithm="ppo-adversary",
        ego="route-follower",
        settings={"population": 8, "epochs": 2},
        budget=30,
        keep=1,
        triage="short",
        out=tmp_path / "run",
    )
    assert run.settings.adversary == "bv"
    table = run.frame()
    assert len(table) == 30
    for path in run.scenarios:
        assert "FollowTrajectoryAction" in path.read_text("utf-8")
    assert bg.resume(run.folder).frame().equals(table)
