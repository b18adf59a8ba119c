"""What several scenarios come to."""

import pytest
from tests.approval import approve

from bridgegen.base.statistics import wilson
from bridgegen.results.confirmation.differences import Contact, EntityDivergence
from bridgegen.results.confirmation.record import Change, Differences, Outcome, Scenario
from bridgegen.results.confirmation.summary import summarise, to_json
from bridgegen.results.confirmation.words import sentences


def outcome(critical=True, d_min=1.0, v_d=5.0, touch=None):
    contact = None if touch is None else Contact(touch, "bv")
    return Outcome(critical=critical, d_min=d_min, v_d=v_d, n_collision=float(contact is not None),
                   F=(d_min,), contact=contact)  # fmt: skip


def scenario(k, here=None, there=None, parted=None, failure=""):
    here = here or outcome()
    if there is None:
        return Scenario(evaluation=k, name=f"{k:04d}", row="", here=here, failure=failure)
    partings = (
        ()
        if parted is None
        else (EntityDivergence("bv", parted, 0.6, 0.6, 0.0, 0.0, None, parted),)
    )
    return Scenario(
        evaluation=k, name=f"{k:04d}", row="", here=here, there=there,
        change=Change.between(here, there), differences=Differences(partings=partings),
    )  # fmt: skip


THREE = [
    scenario(1, outcome(touch=2.0), outcome(d_min=1.25, v_d=4.0, touch=2.5), parted=3.0),
    scenario(2, outcome(), outcome(False, d_min=3.0, touch=None), parted=1.0),
    scenario(3, outcome(touch=4.0), outcome()),
    scenario(4, failure="the library said no"),
]


def test_failed_ones_count_neither_way():
    s = summarise(THREE)
    assert (s.scenarios, s.ran, s.confirmed, s.lost, s.not_run) == (4, 3, 2, 1, 1)
    assert s.share == pytest.approx(2 / 3)
    assert s.interval == wilson(2, 3)
    assert s.contacts == (1, 1, 0)
    assert (s.d_min.n, s.d_min.median, s.d_min.max) == (3, 0.25, 2.0)
    assert (s.v_d.median, s.v_d.max) == (0.0, 1.0)
    assert (s.contact.n, s.contact.max) == (1, 0.5)
    assert (s.parted.n, s.parted.median) == (2, 2.0)


def test_robust_and_knife_edge_are_counted_apart():
    shares = (0.9, 0.2, 0.6, 0.1)
    tested = [
        one.model_copy(update={"robustness": share})
        for one, share in zip(THREE, shares, strict=True)
    ]
    s = summarise(tested)
    assert s.robust == (2, 2)
    assert s.knife_edge == (1, 0)
    line, second, *_ = sentences("esmini 3.6", tested)
    approve(line, "0002", "knife-edge")
    approve(second, "knife-edge")
    assert summarise(THREE).robust == (0, 0)


def test_harm_changes_where_it_is_known():
    here = outcome().model_copy(update={"harm": 0.75})
    there = outcome().model_copy(update={"harm": 0.5})
    s = summarise([scenario(1, here, there), scenario(2, outcome(), outcome())])
    assert (s.harm.n, s.harm.max) == (1, 0.25)


def test_the_sentences_are_for_people():
    line, *rest = sentences("esmini 3.6", THREE)
    approve(line, "3.6", "95")
    assert rest == [
        "Differences, median (largest): d_min 0.250 (2.000) m, v_d 0.000 (1.000) m/s, first "
        "collision 0.500 (0.500) s.",
        "In 2 of 3 an entity deviates by more than 0.5 m, first at 2.00 s (median).",
        "Collisions: 1 in both, 1 only here, 0 only there.",
    ]


def test_where_nothing_ran_nothing_is_claimed():
    s = summarise(THREE[3:])
    assert (s.share, s.interval, s.d_min.median) == (None, (0.0, 1.0), None)
    assert to_json(s)["share"] is None
    assert sentences("esmini 3.6", THREE[3:]) == ["None of 1 scenarios ran in esmini 3.6."]


def test_where_all_is_the_same_that_is_said():
    (*_, last) = sentences("x", [scenario(1, outcome(), outcome())])
    approve(last, "0.5 m")
