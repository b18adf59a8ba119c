"""Verdicts on the paper's claims, from samples whose order is known."""

import numpy as np
import pytest

from bridgegen_reproduction.claims import CLAIMS, can_show, judge, table_claims
from bridgegen_reproduction.paper import GROUPS, SCENARIOS
from bridgegen_reproduction.results import Results


def made(seeds: int, ahead: float) -> Results:
    """Runs in which the method that the paper finds ahead is so, by so much."""
    rank = {"random": 0.0, "pso": 1.0, "ppo": 2.0, "nsga2-dt": 1.0}
    larger = {claim.quantity: claim.larger for claim in CLAIMS}
    noise = np.linspace(0.0, 0.3, seeds)
    samples = {
        (group, one.algorithm): {
            quantity: (1 if is_larger else -1) * ahead * rank[one.algorithm] + noise
            for quantity, is_larger in larger.items()
        }
        for group, methods in GROUPS.items()
        for one in methods
    }
    return Results("paper-crossroads-s4", samples, 50)


def fronts(results: Results) -> dict:
    return {name: dict(sample) for (group, name), sample in results.samples.items()
            if group == "many"}  # fmt: skip


@pytest.mark.parametrize(
    ("seeds", "ahead", "word"),
    [
        (10, 1.0, "holds"), (10, -1.0, "opposite"), (10, 0.0, "not shown"),
        (1, 1.0, "agrees"), (1, -1.0, "disagrees"), (5, 1.0, "agrees"), (6, 1.0, "holds"),
    ],
)  # fmt: skip
def test_what_runs_say_of_a_claim(seeds, ahead, word):
    results = made(seeds, ahead)
    verdicts = judge(results, fronts(results))
    assert len(verdicts) == len(CLAIMS) == 17
    assert {one.word for one in verdicts} == {word}
    for one in verdicts:
        assert one.a12 == {1.0: 1.0, -1.0: 0.0, 0.0: 0.5}[ahead]


def test_how_many_seeds_can_show_anything():
    assert [seeds for seeds in range(1, 12) if can_show(seeds)] == [6, 7, 8, 9, 10, 11]


def test_a_method_without_runs_has_no_verdict():
    results = made(10, 1.0)
    samples = {key: one for key, one in results.samples.items() if key[1] != "ppo"}
    verdicts = judge(Results("paper-crossroads-s4", samples, 50), fronts(results))
    for claim, one in zip(CLAIMS, verdicts, strict=True):
        assert one.word == ("–" if "ppo" in (claim.ahead, claim.behind) else "holds")


def test_the_table_has_every_claim_in_every_scenario():
    results = made(10, 1.0)
    verdicts = {name: judge(results, fronts(results)) for name in SCENARIOS}
    table = table_claims(verdicts, 10)
    assert len(table.rows) == 17
    assert table.head[-4:] == ("S4", "S1", "S2", "S3")
    assert table.data is not None
    assert len(table.data) == 1 + 4 * 17
    assert table.rows[0][:2] == ("PPO ahead of RS: R_critic", "0.852 : 0.530")
