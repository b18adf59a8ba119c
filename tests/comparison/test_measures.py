"""Hand-worked measures of made-up runs."""

import math
from collections import Counter

import numpy as np
import pytest

from bridgegen.assess.conflict.findings import Findings
from bridgegen.jobs.compare.measures import counts, measure, measures, ordinal, others, waited_for
from bridgegen.jobs.compare.plan import Cell
from bridgegen.jobs.compare.record import Record, modes_of

INF = math.inf


def record(
    reached: float, front: list[list[float]], *, critical=60, searched=("a",), modes="aaabc"
) -> Record:
    x = np.array(front, np.float64).reshape(-1, 2)
    return Record(
        terms=("d_min", "v_d"), parameters=searched, command="", ended="budget",
        evaluations=1000, failed=0,
        critical=critical, reached={1: 2.0, 10: 20.0, 50: reached}, seconds=4.0,
        seconds_reached={1: 0.1, 10: 0.2, 50: reached / 100.0}, distinct=5,
        distinct_reached={5: 30.0}, distinct_found=np.array([1, 5]), modes_reached={2: 7.0},
        critical_bins=7,
        critical_pairs=9, modes=Counter(modes), found=np.array([1, critical]), fronts=(x[:0], x),
        low=x.min(axis=0) if len(x) else None, high=x.max(axis=0) if len(x) else None,
    )  # fmt: skip


def test_by_hand():
    """d_min of −10 to 0 and v_d of 0 to 8: the run at (−5, 8) and (0, 4) dominates 3/4."""
    one, two = Cell("s", "pso", 0), Cell("s", "random", 0)
    found = measure(
        {one: record(200.0, [[-5.0, 8.0], [0.0, 4.0]]), two: record(INF, [[-10.0, 0.0]])},
        1000,
        "random",
    )
    best, other = found.values[one], found.values[two]
    assert (best["r_critic"], best["to_50"], best["t_critic"]) == (0.06, 200.0, 1.0)
    assert (other["to_50"], other["t_critic"]) == (INF, INF)
    assert (best["t_critic_seconds"], best["seconds_to_50"]) == (1.0, 2.0)
    assert best["hypervolume"] == pytest.approx(0.75)
    assert found.curves[one].tolist() == pytest.approx([0.0, 0.75])
    assert found.reference.tolist() == [[0.0, 0.5], [0.5, 0.0]]
    assert best["gd"] == 0.0
    assert best["modes"] == 3.0
    assert other["hypervolume"] == 0.0
    assert math.isnan(best["covered"])  # the random run has the same seed
    # From (1, 1) to (½, 0) as to (0, ½).
    assert other["gd"] == pytest.approx(math.sqrt(1.25))
    assert other["spread"] == 1.0


def test_what_is_covered_is_the_share_of_random_conflicts_that_were_found():
    few, drawn = record(2.0, [[0.0, 0.0]], modes="ad"), record(2.0, [[0.0, 0.0]], modes="aaab")
    records = {Cell("s", "pso", 0): few, Cell("s", "random", 1): drawn}
    values = measure(records, 1000, "random").values
    assert values[Cell("s", "pso", 0)]["covered"] == 0.75
    assert math.isnan(values[Cell("s", "random", 1)]["covered"])


def test_the_best_method_is_that_of_the_least_median():
    cells = [Cell("s", name, seed) for name in ("a", "b") for seed in range(3)]
    times = [100.0, 300.0, INF, 50.0, 400.0, 500.0]
    records = {c: record(t, [[0.0, 0.0]]) for c, t in zip(cells, times, strict=True)}
    values = measure(records, 1000, "a").values
    assert [values[c]["t_critic"] for c in cells] == pytest.approx([t / 300.0 for t in times])


def test_where_nobody_gets_there_nobody_is_the_best():
    values = measure({Cell("s", "a", 0): record(INF, [])}, 1000, "a").values[Cell("s", "a", 0)]
    assert math.isnan(values["t_critic"])
    assert math.isnan(values["gd"])
    assert (values["to_50"], values["hypervolume"]) == (INF, 0.0)


def test_those_who_search_something_else_are_not_compared_by_parameters():
    one, two = Cell("s", "random", 0), Cell("s", "ppo-adversary", 0)
    records = {two: record(200.0, [[0.0, 1.0]], searched=("b",)), one: record(50.0, [[0.0, 1.0]])}
    assert others(records, "random") == {"ppo-adversary"}
    assert others({two: records[two]}, "random") == set()
    values = measure(records, 1000, "random").values
    names = ("distinct", "critical_bins", "critical_pairs")
    assert [values[one][name] for name in names] == [5.0, 7.0, 9.0]
    assert all(math.isnan(values[two][name]) for name in names)
    assert values[two]["t_critic"] == 4.0


def test_five_per_cent_of_the_budget():
    assert [waited_for(budget) for budget in (1, 20, 21, 100, 1000, 10_000)] == [
        1, 1, 2, 5, 50, 500,
    ]  # fmt: skip
    assert counts(1000) == (1, 10, 50)
    assert counts(200) == (1, 10, 50)
    assert counts(10_000) == (1, 10, 50, 500)
    assert {"to_500", "seconds_to_500"} < {one.name for one in measures(10_000)}


def test_ordinals():
    assert [ordinal(n) for n in (1, 2, 3, 4, 10, 11, 12, 13, 21, 50, 111)] == [
        "1st", "2nd", "3rd", "4th", "10th", "11th", "12th", "13th", "21st", "50th", "111th",
    ]  # fmt: skip


def test_modes_are_different_conflicts_and_passing_by_is_none():
    def texts(*values):
        return np.array(values, dtype=object)

    none = texts("", "", "", "", "")
    found = Findings(
        conflict=none, conflict_type=texts("crossing", "crossing", "crossing", "", "turning"),
        responsible=texts("ego", "ego", "shared", "", "ego"),
        rule=texts("signs", "signs", "signs", "", "signs"),
        partner=texts("bv", "bv", "bv", "", "bv"), implausible=none,
    )  # fmt: skip
    assert [rows[0] for rows in modes_of(found).values()] == [0, 2, 4]
    assert modes_of(Findings.none(4)) == {}
