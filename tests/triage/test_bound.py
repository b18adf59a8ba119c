import numpy as np
import pytest
from scipy import stats
from tests.approval import approve

from bridgegen.assess.conflict.findings import Findings
from bridgegen.assess.conflict.happening import Happening, Share
from bridgegen.search.triage.bound import NotCounted, bound, estimate, least_margins

ALL_COUNT = NotCounted({}, {}, 0, 0)


def bounded(**given):
    nothing = {"evaluations": 1000, "besides": ALL_COUNT, "happening": Happening(0), "harmful": 0,
               "modes": 0, "space": estimate("random", 0, 1000), "least": (),
               "ego": "reference"}  # fmt: skip
    return bound(**nothing | given)


def text(**given):
    return bounded(**given).sentence


UNSAFE = ("contact", "unsafe start")


@pytest.mark.parametrize(
    ("besides", "verdict", "why"),
    [
        (ALL_COUNT, "no failure found", ""),
        (NotCounted({("contact", "cut in"): 900}, {}, 0, 0), "no failure found", ""),
        (NotCounted({}, {"jump": 500}, 0, 0), "no failure found", ""),
        (NotCounted({}, {"jump": 501}, 30, 0), "not judged", "only 499 of 1000"),
        (NotCounted({}, {"jump": 300}, 0, 201), "not judged", "only 499 of 1000"),
        (NotCounted({UNSAFE: 501}, {}, 0, 0), "not judged", "only 499 of 1000"),
        (NotCounted({}, {}, 0, 1000), "not judged", "no evaluation of reference has a result"),
    ],
)
def test_half_of_the_evaluations_must_be_judged(besides, verdict, why):
    found = bounded(besides=besides)
    assert (found.verdict, found.judged) == (verdict, verdict != "not judged")
    assert why in found.sentence
    assert found.sentence.startswith("Not judged: ") == (verdict == "not judged")
    if besides.failed < 1000:  # a failure is one, however little else could be judged
        assert bounded(besides=besides, harmful=1, modes=1).verdict == "fails"


def test_a_scenario_that_did_not_happen_is_not_judged():
    never = Happening(1000, events=(Share("cuts_in", 3, 1000),))
    assert bounded(happening=never).verdict == "not judged"
    approve(text(happening=never), "cuts_in", "1000")
    assert bounded(happening=never, harmful=1, modes=1).verdict == "fails"


def test_a_driver_outside_its_domain_is_not_judged_unless_it_fails():
    outside = Happening(1000, domain="outside the domain of un-r157 (motorway): x has a junction")
    assert bounded(happening=outside).verdict == "not judged"
    assert text(happening=outside) == f"Not judged: {outside.domain}."
    assert bounded(happening=outside, harmful=1, modes=1).verdict == "fails"


def test_what_does_not_count_is_named_with_its_reasons():
    """A failure, two excused contacts, a near miss, two implausible rows, one without a result."""
    rows = [
        ("contact", "rear distance", ""), ("contact", "cut in", ""),
        ("contact", "unsafe start", ""), ("near miss", "cut in", ""),
        ("contact", "cut in", "jump"), ("", "", "jump"), ("", "", ""),
        ("collision course", "", ""),
    ]  # fmt: skip
    columns = [np.array(column, dtype=object) for column in zip(*rows, strict=True)]
    blank = np.full(len(rows), "", dtype=object)
    findings = Findings(columns[0], blank, blank, columns[1], blank, columns[2])
    harm = np.array([0.7, 0.0, 0.0, 0.0, 0.8, 0.0, 0.0, 0.2])
    ok = np.arange(len(rows)) != 6
    found = NotCounted.of(findings, harm, ok)
    assert found.unsafe == 1
    approve(found.sentence)
    assert ALL_COUNT.sentence == ""
    # Of the two excused collisions, a careful driver avoids the second.
    found = NotCounted.of(findings, harm, ok, lambda rows: rows == 2)
    assert (found.avoided, found.driven_again) == (1, 2)
    collisions = "2 collisions (cut in 1, unsafe start 1; a careful driver avoids 1 of 2), 1 near"
    assert collisions in found.sentence
    approve(text(besides=found), "1000")


def test_nothing_in_a_thousand_draws_bounds_the_share_by_0_37_per_cent():
    """By hand: 1 − 0.025^(1/1000) = 0.00368."""
    space = estimate("random", 0, 1000)
    assert (space.share, space.low) == (0.0, 0.0)
    assert space.high == pytest.approx(1.0 - 0.025**0.001, abs=1e-12)
    approve(text(), "95", "0.37", "1000")


def test_an_upper_bound_is_rounded_up():
    """By hand: 1 − 0.025^(1/256) = 0.014306, which is more than 1.4 %."""
    approve(text(space=estimate("fresh", 0, 256)), "1.5")


def test_a_driver_that_fails_in_fresh_draws_alone_fails():
    found = bounded(space=estimate("fresh", 6, 256), evaluations=30)
    assert (found.verdict, found.failures, found.judged) == ("fails", 6, True)
    approve(found.sentence, "256", "30")
    approve(bounded(space=estimate("fresh", 0, 256)).verdict)


@pytest.mark.parametrize(("harmful", "rows"), [(0, 40), (3, 256), (17, 17)])
def test_shares_have_scipy_s_exact_interval(harmful, rows):
    ours = estimate("fresh", harmful, rows)
    theirs = stats.binomtest(harmful, rows).proportion_ci(0.95, "exact")
    assert (ours.low, ours.high) == pytest.approx((theirs.low, theirs.high), abs=1e-9)


def test_where_an_algorithm_chose_the_rows_no_share_is_stated():
    space = estimate("", 0, 0)
    assert (space.share, space.low, space.high) == (None, 0.0, 1.0)
    said = text(space=space, harmful=3, modes=2)
    approve(said, "1000")


def test_sobol_points_are_named_so():
    assert "Sobol points" in text(space=estimate("sobol", 0, 64), evaluations=64)


def test_nothing_is_known_where_every_evaluation_failed():
    approve(text(evaluations=7, besides=NotCounted({}, {}, 0, 7)))


NAMES = ("harm", "course_ttc", "course_braking")


def test_least_margins_are_those_of_conflicts_that_count():
    """Evaluation 1 is hit by another without its fault: harm 0, though the time to collision is."""
    metrics = np.array([[0.05, np.inf, 0.0], [0.0, 0.0, 60.0], [0.2, 1.9, 2.5], [0.15, 1.2, 1.0]])
    harm = metrics[:, 0]
    ids, fit = np.arange(10, 14), np.ones(4, bool)
    found = {one.quantity: one for one in least_margins(metrics, NAMES, harm, ids, fit)}
    assert {name: (one.value, one.evaluation) for name, one in found.items()} == {
        "harm": (0.2, 12), "course_ttc": (1.2, 13), "course_braking": (2.5, 12),
    }  # fmt: skip
    said = text(least=tuple(found.values()))
    approve(said, "0.20", "0.3")
    nobody = least_margins(metrics[:1], NAMES, harm[:1], ids[:1], fit[:1])
    assert [one.value for one in nobody] == [0.05, None, None]
    failed = least_margins(metrics, NAMES, harm, ids, np.zeros(4, bool))
    assert [one.value for one in failed] == [None, None, None]
