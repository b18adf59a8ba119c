import math
from types import SimpleNamespace

import numpy as np
import pytest
from tests.approval import approve

from bridgegen.jobs.compare import words
from bridgegen.jobs.compare.measures import measures
from bridgegen.jobs.compare.plan import Cell
from bridgegen.jobs.compare.table import Line, summarise

MEASURES = {one.name: one for one in measures(1000)}


def line(p: float, a12: float, values=(1.0, 2.0, 3.0)) -> Line:
    from bridgegen.base.statistics import quartiles

    return Line("s", "pso", "to_50", 3, 0, quartiles(np.array(values)), p, p, a12)


def test_numbers_as_people_read_them():
    one = MEASURES["to_50"]
    assert words.median(line(0.5, 0.5), one) == "2"
    assert words.span(line(0.5, 0.5, (100.0, 200.0, 300.0)), one) == "150 to 250"
    late = line(0.5, 0.5, (100.0, 200.0, math.inf))
    assert (words.median(late, one), words.span(late, one)) == ("200", "150 to never")
    never = line(0.5, 0.5, (math.inf, math.inf))
    assert (words.median(never, one), words.span(never, one)) == ("never", "")
    assert words.number(math.nan, 2) == "–"
    assert words.number(12345.6, 0) == "12,346"
    assert [words.p_value(p) for p in (0.0004, 0.02, math.nan)] == ["< 0.001", "0.020", "–"]


@pytest.mark.parametrize(
    ("p", "a12", "said"),
    [(0.01, 0.9, "better"), (0.01, 0.1, "worse"), (0.05, 0.9, ""), (math.nan, 0.9, "")],
)
def test_a_verdict_needs_a_sure_test(p, a12, said):
    assert words.verdict(line(p, a12)) == said


def test_the_summary_tests_against_the_baseline_and_corrects_by_measure():
    shares = {"a": [0.1, 0.2, 0.3, 0.4], "b": [0.5, 0.6, 0.7, 0.8], "c": [0.1, 0.2, 0.3, 0.4]}
    values = {
        Cell("s", name, seed): {"r_critic": share}
        for name, row in shares.items()
        for seed, share in enumerate(row)
    }
    lines = summarise(values, ["s"], ["a", "b", "c"], "a", [MEASURES["r_critic"]])
    base, better, same = lines
    assert math.isnan(base.p)
    assert (better.a12, same.a12) == (1.0, 0.5)
    assert better.p == pytest.approx(2 / 70)  # the two outermost of C(8, 4) orders
    assert better.p_holm == pytest.approx(4 / 70)
    assert same.p == same.p_holm == 1.0
    with_gap = {cell: row for cell, row in values.items() if cell != Cell("s", "b", 3)}
    assert summarise(with_gap, ["s"], ["a", "b", "c"], "a", [MEASURES["r_critic"]])[1].runs == 3


def told(shares: dict[str, list[float]], critical: int = 1) -> list[str]:
    """The sentences of made-up runs."""
    values = {
        Cell("s", name, seed): {
            "modes": 2.0,
            "distinct": 5.0,
            "r_critic": share,
            "hypervolume": 0.5,
        }
        for name, row in shares.items()
        for seed, share in enumerate(row)
    }
    kinds = [MEASURES[name] for name in words.SENTENCE_STARTS]
    plan = SimpleNamespace(algorithms=list(shares), baseline="a", budget=1000)
    lines = summarise(values, ["s"], plan.algorithms, "a", kinds)

    def line(scenario, algorithm, measure):
        wanted = (scenario, algorithm, measure)
        return next(x for x in lines if (x.scenario, x.algorithm, x.measure) == wanted)

    records = dict.fromkeys(
        values, SimpleNamespace(critical=critical, evaluations=1000, failed=0, parameters=())
    )
    made = SimpleNamespace(
        plan=plan, measures=kinds, lines=lines, line=line, records=records, gaps={}
    )
    return words.sentences(made, "s")


def test_sentences_name_the_best_and_how_sure_that_is():
    seeds = np.arange(8) / 100.0
    modes, distinct, share, volume = told(
        {"a": [*(0.1 + seeds)], "b": [*(0.5 + seeds)], "c": [*(0.1 + seeds)]}
    )
    approve(modes, "largest")
    approve(share, "R_critic", "0.535")
    approve(distinct, "different")
    approve(volume, "difference")


def test_a_median_between_two_counts_is_no_whole_number():
    modes = MEASURES["modes"]
    for values, text in (([1.0, 2.0], "1.5"), ([2.0, 2.0], "2"), ([20.0, 21.0], "20")):
        rows = {Cell("s", "a", k): {"modes": value} for k, value in enumerate(values)}
        assert words.median(summarise(rows, ["s"], ["a"], "a", [modes])[0], modes) == text


def test_too_few_runs_are_said_to_be_too_few():
    """2 / C(6, 3) = 0.1, and twice that for two tests."""
    sentences = told({"a": [0.1, 0.2, 0.3], "b": [0.5, 0.6, 0.7], "c": [0.5, 0.6, 0.7]})
    approve(sentences[-1], "0.20")
    assert not any("no difference" in one.lower() for one in sentences)


def test_where_nothing_was_found_nobody_is_praised_for_it():
    first, second, *_ = told({"a": [0.0], "b": [0.0]}, critical=0)
    approve(first)
    approve(second, "hypervolume")
