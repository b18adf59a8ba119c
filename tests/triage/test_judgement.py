from dataclasses import replace

import numpy as np
import pytest
from tests.approval import approve

from bridgegen.assess.conflict.summary import ConflictSummary
from bridgegen.search.triage.judgement import judgement
from bridgegen.search.triage.neighbours import neighbourhoods

BRAKING = "braking 0.75 s after the risk arose"
NONE = "none of the fixes that were tried (perception is ideal, un-r157 drives, the road is dry)"


def near(space, world, fixed, harm):
    """The neighbours of a row of which all are harmful unless a fix helps."""
    (found,) = neighbourhoods(world(space, harm, fixed), space.row({})[np.newaxis],
                              np.array([3]), 0)  # fmt: skip
    return found


def by(fix):
    return lambda v, at: np.where(at != fix, 0.7, 0.0)


@pytest.mark.parametrize(
    ("fix", "preventable", "said"),
    [
        (1, True, "root cause planning: a careful driver (un-r157) prevents it in 32 of 32 nearby "
         "scenarios"),
        (1, False, f"root cause planning: {BRAKING} would not have avoided it; a driver that "
         "yields earlier (un-r157) does, in 32 of 32 nearby scenarios"),
        (0, None, "root cause perception: ideal perception prevents it in 32 of 32 nearby "
         "scenarios"),
        (0, False, f"root cause perception: {BRAKING} would not have avoided it; ideal perception "
         "does, in 32 of 32 nearby scenarios"),
        (9, False, f"root cause not found: the ego is responsible, but {NONE} prevents it in "
         f"a significant share of nearby scenarios, nor would {BRAKING}"),
        (9, True, f"root cause not found: {BRAKING} would have avoided it, but {NONE} does in "
         "a significant share of nearby scenarios"),
    ],
)  # fmt: skip
def test_where_judges_differ_the_sentence_says_which_says_what(
    space, world, fixed, fix, preventable, said
):
    tested = near(space, world, fixed, by(fix))
    assert judgement(tested.cause, tested, preventable=preventable, responsible="ego") == said


def test_only_what_the_ego_is_not_responsible_for_is_called_unavoidable(space, world, fixed):
    """Who must give way, or keep its distance, could have; that no fix does is another matter."""
    tested = near(space, world, fixed, by(9))
    text = judgement(tested.cause, tested, preventable=False, responsible="other")
    approve(text, NONE, BRAKING)
    passed = judgement(tested.cause, tested, preventable=None, responsible="ego")
    approve(passed, NONE)


def test_what_one_replay_says_is_no_more(space):
    text = judgement("planning", None, preventable=False, responsible="ego")
    approve(text, "earlier")
    text = judgement("unavoidable", None, preventable=None, responsible="other")
    approve(text)
    assert judgement("", None, preventable=True, responsible="ego") == ""


def test_one_that_is_not_known_names_no_cause(space, world, fixed):
    text = judgement("not known", None, preventable=False, responsible="ego")
    approve(text)


def test_a_sentence_on_braking_is_replaced_by_the_judgement():
    texts = dict.fromkeys(ConflictSummary.__dataclass_fields__, "")
    one = ConflictSummary(**texts)
    end = ", and a driver who brakes 0.75 s later would not have avoided it"
    said = replace(one, sentence=f"It struck; the risk arose 1.4 s before{end}.", avoidance=end)
    new = said.reconciled("root cause planning: careful does")
    approve(new.sentence, "1.4 s")
    approve(new.bare, "1.4 s")
    assert said.reconciled("") == said
