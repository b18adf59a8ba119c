"""What is said of two rollouts that part."""

import numpy as np
import pytest
from tests.approval import approve

from bridgegen.results.confirmation.differences import (
    Approach,
    BoxSizes,
    Contact,
    Divergence,
    EntityDivergence,
    EventTimes,
    LightTimes,
    Offset,
)
from bridgegen.results.confirmation.record import Differences, Margin, Outcome
from bridgegen.results.confirmation.words import explanation
from bridgegen.scenario.language.thresholds import Thresholds
from bridgegen.scenario.stl import TINY

LIMITS = Thresholds()


def came_to(critical, d_min, v_d, contact=None):
    return Outcome(
        critical=critical, d_min=d_min, v_d=v_d, n_collision=float(contact is not None), F=(0.0,),
        contact=contact,
    )  # fmt: skip


NEAR = came_to(True, 1.0, 5.0)


def said(there, here=NEAR, **differences):
    return explanation(here, there, Differences(**differences), LIMITS)


def test_a_miss_says_by_how_much():
    approve(said(came_to(False, 2.04, 5.0)), "d_min", "2.04 m")
    approve(said(came_to(False, 2.002, 5.0)), "2.00 m", "1.00 m")
    approve(said(came_to(False, 3.5, 5.0)), "d_min", "3.50 m")
    approve(said(came_to(False, 1.5, 0.2)), "v_d", "1.50 m")
    approve(said(came_to(False, None, 0.0)), "alone")
    assert "threshold" not in said(came_to(True, 1.1, 5.0))


HARMFUL = Outcome(critical=True, d_min=0.0, v_d=5.0, n_collision=1.0, F=(-0.62,), harm=0.62,
                  severity=0.05, conflict="contact", conflict_type="crossing", responsible="ego",
                  partner="bv")  # fmt: skip


def of_harm(harm, conflict="", kind="", responsible=""):
    return Outcome(critical=False, d_min=1.0, v_d=5.0, n_collision=0.0, F=(-harm,), harm=harm,
                   conflict=conflict, conflict_type=kind, responsible=responsible,
                   partner="bv" if conflict else "")  # fmt: skip


@pytest.mark.parametrize(
    ("there", "text"),
    [
        (of_harm(0.05), "No collision course there: harm is 0.05 there, 0.62 here, below 0.3."),
        (
            of_harm(0.29, "collision course"),
            "Only a collision course with bv there: harm is 0.29 there, 0.62 here, narrowly, "
            "below 0.3.",
        ),
        (
            of_harm(0.0, "near miss", "crossing", "other"),
            "A near miss with bv (crossing) there, for which bv is responsible: harm is 0.00 "
            "there, 0.62 here, below 0.3.",
        ),
        (
            of_harm(0.0, "contact", "ego standing", "none"),
            "A contact with bv (ego standing) there, for which no participant is responsible: harm "
            "is 0.00 there, 0.62 here, below 0.3.",
        ),
    ],
)
def test_by_harm_a_miss_says_what_conflict_there_is(there, text):
    told = explanation(HARMFUL, there, Differences(), LIMITS, "harm")
    assert told.startswith(text)
    assert "threshold" not in told


def test_the_first_who_parts_is_told_with_what_came_before():
    parts = EntityDivergence("bv", 3.2, 0.52, -0.51, 0.1, -0.4, None, 2.6)
    ego = EntityDivergence("ego", 4.1, 0.6, 0.0, 0.6, 0.0, None, 4.0)
    text = said(
        came_to(False, 3.0, 5.0),
        partings=(parts, ego),
        events=(EventTimes("bv_changes_lanes", 2.5, 2.65), EventTimes("late", 5.0, 6.0)),
        lights=(LightTimes("s1", 1.0, 1, 4),),
    )
    order = [
        "The light s1 is green there and red here from 1.00 s on.",
        "bv_changes_lanes began 0.15 s later there, at 2.65 s.",
        "bv diverges first: at 3.20 s it is 0.52 m away there, behind, and 0.40 m/s slower; "
        "deviating since 2.60 s.",
        "Then ego at 4.10 s.",
    ]
    assert " ".join(order) in text
    assert "late began" not in text  # after they had parted: a consequence


@pytest.mark.parametrize(
    ("event", "words"),
    [
        (EventTimes("go", 1.0, None), "go began at 1.00 s here and never there."),
        (EventTimes("go", None, 1.0), "go began at 1.00 s there and never here."),
        (EventTimes("go", 1.0, 0.5), "go began 0.50 s earlier there, at 0.50 s."),
    ],
)
def test_events_are_told(event, words):
    parts = EntityDivergence("bv", 3.2, 0.6, 0.0, -0.6, 0.0, None, 3.0)
    text = said(came_to(True, 1.0, 5.0), partings=(parts,), events=(event,))
    assert words in text
    approve(text, "right")


@pytest.mark.parametrize(
    ("turn", "words"),
    [
        (None, "slower; deviating"),
        (0.1, "slower; deviating"),
        (np.pi / 2, "slower, moving 90° to the left of its direction here; deviating"),
        (-0.5, "slower, moving 29° to the right of its direction here; deviating"),
    ],
)
def test_another_way_is_told(turn, words):
    parts = EntityDivergence("walker", 3.2, 0.6, 0.0, -0.6, -0.1, turn, 3.0)
    assert words in said(came_to(True, 1.0, 5.0), partings=(parts,))


def test_who_was_off_before_is_told():
    parts = EntityDivergence("ego", 6.1, 0.52, -0.52, 0.0, -0.5, None, 5.15)
    text = said(came_to(False, 3.0, 0.0), partings=(parts,), offsets=(Offset("bv", 0.091),))
    approve(text, "5.15 s", "0.09 m")


def test_what_else_differs_is_told():
    text = said(
        came_to(True, 1.0, 5.0, Contact(3.0, "van")),
        here=came_to(True, 0.0, 5.0, Contact(2.0, "bv")),
        partings=(EntityDivergence("bv", 1.0, None, None, None, None, None, 0.9, "there"),),
        boxes=(BoxSizes("bv", (4.0, 2.0, 1.0), (4.5, 1.8, 1.2)),),
        only_here=("cone",),
        only_there=("walker",),
    )
    for part in (
        "The first contact is with van there, with bv here.",
        "cone does not exist there.",
        "walker exists only there.",
        "bv is a box of 4.50 m × 1.80 m, centre 1.20 m ahead, there; 4.00 m × 2.00 m, 1.00 m here.",
        "No event and no light differs before the first divergence.",
        "bv diverges first: at 1.00 s it is present only there.",
    ):
        assert part in text


def test_contacts_are_told_where_only_one_has_them():
    touch, none = came_to(True, 0.0, 5.0, Contact(2.0, "bv")), came_to(True, 0.5, 5.0)
    approve(said(none, here=touch), "2.00 s")
    approve(said(touch, here=none), "2.00 s")
    assert "contact" not in said(touch, here=touch)


def test_where_nobody_parts_that_is_said():
    approve(said(came_to(True, 1.0, 5.0)), "0.5 m")


CLOSEST = Approach(4.0, "bv", 1.0)
LATER = EntityDivergence("bv", 5.2, 0.52, -0.51, 0.1, -0.4, None, 4.6)


def test_a_miss_is_explained_by_what_differs_before_the_closest_approach():
    text = said(
        came_to(False, 2.1, 5.0),
        closest=CLOSEST,
        diverged=(
            Divergence("bv", 2.7, 4.0, 0.31, -0.3, 0.05, -0.4, None),
            Divergence("ego", 3.1, 3.5, 0.1, 0.01, -0.1, 0.0, 0.2),
        ),
        partings=(LATER,),
        events=(EventTimes("bv_sets_off", 2.5, 2.65), EventTimes("late", 4.5, 5.0)),
        lights=(LightTimes("s1", 4.1, 1, 4),),
    )
    approve(text, "d_min", "bv_sets_off")


def test_a_miss_names_nothing_that_comes_after_the_closest_approach():
    text = said(came_to(False, 2.1, 5.0), closest=CLOSEST, partings=(LATER,))
    approve(text, "1.00 m", "4.00 s")


def test_a_missed_contact_is_explained_by_what_differs_before_it():
    text = said(
        came_to(False, 2.1, 5.0),
        here=came_to(True, 0.0, 5.0, Contact(3.0, "bv")),
        closest=Approach(3.0, "bv", 0.0),
        diverged=(Divergence("bv", 1.0, 1.05, None, None, None, None, None, "here"),),
        only_here=("cone",),
    )
    approve(text, "3.00 s", "1.00 s")


def test_where_both_have_contacts_the_first_one_here_is_told():
    text = said(
        came_to(False, 0.0, 0.5, Contact(3.5, "bv")),
        here=came_to(True, 0.0, 5.0, Contact(3.0, "bv")),
        closest=Approach(3.0, "bv", 0.0),
    )
    approve(text, "3.00 s")


def test_what_is_critical_there_is_told_as_ever():
    text = said(came_to(True, 1.0, 5.0), closest=CLOSEST, partings=(LATER,))
    approve(text, "diverges")
    assert "closest approach" not in text


def test_a_criterion_that_is_met_there_is_named_with_both_margins():
    def of(critical, **margins):
        units = {"gap": "m", "ttc": "s", "crash": "1"}
        return Outcome(
            critical=critical, d_min=1.0, v_d=5.0, n_collision=0.0, F=(0.0,),
            margins={k: Margin(value=v, unit=units[k]) for k, v in margins.items()},
        )  # fmt: skip

    here = of(True, gap=-0.15, ttc=2.0, crash=-1.0)
    told = explanation(
        here, of(False, gap=0.35, ttc=1.0, crash=TINY), Differences(), LIMITS, "criteria"
    )
    approve(told, "0.35 m", "-0.15 m")
    assert "ttc" not in told  # it is met here, too
    assert "threshold" not in told
    assert "d_min" not in told
    kept = explanation(here, of(True, gap=-0.1, ttc=1.0, crash=-1.0), Differences(), LIMITS,
                       "criteria")  # fmt: skip
    assert "met there" not in kept
