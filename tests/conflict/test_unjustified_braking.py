"""Braking hard where nothing asks for it: who is blamed, and, above all, who is not."""

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from bridgegen.assess.conflict import _limits as limits
from bridgegen.assess.conflict.analysis import CONTACT, VIOLATION, analyse
from bridgegen.assess.conflict.harm import decisive
from bridgegen.assess.conflict.summary import sentence
from bridgegen.assess.conflict.types import ConflictType, Responsible, Rule
from bridgegen.drivers.kinds import CAR, PEDESTRIAN

from .conftest import drive, meet, seconds

DRY = np.array([8.3])


def braking(v=20.0, rate=8.0, least=0.0):
    """Speeds of an ego that brakes from 1 s on down to ``least``, over 8 s."""
    end = 1.0 + (v - least) / rate
    return seconds((0.0, v), (1.0, v), (end, least), (8.0, least))


def follower(gap, v=20.0, rate=7.5, reaction=0.75, least=0.0):
    """A car ``gap`` m behind the ego's rear that brakes ``reaction`` s after it."""
    end = 1.0 + reaction + (v - least) / rate
    course = seconds((0.0, v), (1.0 + reaction, v), (end, least), (max(end + 1.0, 8.0), least))
    return drive(x=-gap - 4.0, v=course[: round(8.0 / 0.05) + 1], t=8.0)


def judged(*tracks, kinds=None, friction=DRY):
    found = analyse(meet(*tracks, kinds=kinds, friction=friction))
    return found, ConflictType(int(found.type[0, 1])), Responsible(int(found.responsible[0, 1]))


def ego(**how):
    return drive(v=braking(**how), t=8.0)


def test_who_must_brake_hard_behind_it_is_forced():
    found, kind, who = judged(ego(least=8.0), follower(22.0, least=8.0))
    assert (found.kind[0, 1], kind, who) == (
        VIOLATION,
        ConflictType.UNJUSTIFIED_BRAKING,
        Responsible.EGO,
    )
    # It keeps 20 m/s for 0.75 s; what is left of 22 m and of the ego's way asks for more than 3.
    assert limits.COMFORT < found.needed[0, 1] < limits.HARD
    assert 0.1 < decisive(found)[1][0] < 0.3
    assert found.breach[0, 1] == pytest.approx((found.needed[0, 1] - 3.0) / 2.0)
    text = sentence(found, 0, 1)
    assert "the ego is responsible: it braked hard although" in text
    assert "'bv' behind it had to brake by" in text


def test_a_follower_who_is_too_close_shares_it():
    found, kind, who = judged(ego(least=10.0), follower(15.0, reaction=0.0, least=10.0))
    assert (kind, who) == (ConflictType.UNJUSTIFIED_BRAKING, Responsible.SHARED)
    assert "'bv' was too close" in sentence(found, 0, 1)


def test_who_drives_far_behind_is_not_forced():
    found, *_ = judged(ego(), follower(90.0))
    assert found.type[0, 1] == ConflictType.NONE


def test_struck_though_nobody_could_have_stopped_is_the_egos_alone():
    # 19 m are 0.95 s: not too close by law; the careful driver needs 1.05 s behind 8 m/s².
    found, kind, who = judged(ego(), follower(19.0, reaction=1.5))
    assert (found.kind[0, 1], kind, who) == (
        CONTACT,
        ConflictType.UNJUSTIFIED_BRAKING,
        Responsible.EGO,
    )
    assert found.rule[0, 1] == Rule.BRAKED_WITHOUT_REASON
    assert found.at_fault[0, 1]
    assert decisive(found)[1][0] > 0.3


def test_an_ego_that_stands_after_it_is_not_excused_by_standing():
    found, kind, who = judged(ego(), follower(30.0, reaction=3.0))
    assert found.v_ego[0, 1] < limits.STANDS
    assert (kind, who) == (ConflictType.UNJUSTIFIED_BRAKING, Responsible.SHARED)


def test_a_recording_may_lack_what_was_braked_for():
    free = np.array([np.inf])
    assert judged(ego(), follower(19.0, reaction=1.5), friction=free)[2] == Responsible.SHARED
    assert judged(ego(least=8.0), follower(22.0, least=8.0), friction=free)[1] == ConflictType.NONE


@given(
    v=st.floats(6.0, 36.0),
    rate=st.floats(5.1, 9.0),
    gap=st.floats(0.5, 60.0),
    share=st.floats(0.0, 1.0),
    aside=st.floats(-2.4, 2.4),
    on_foot=st.booleans(),
)
@example(v=36.0, rate=9.0, gap=20.0, share=1.0, aside=2.4, on_foot=False)
@example(v=6.0, rate=5.1, gap=0.5, share=0.0, aside=-2.4, on_foot=True)
def test_a_body_in_the_way_within_the_stopping_distance_justifies(
    v, rate, gap, share, aside, on_foot
):
    """Law: whatever the follower does and wherever the body stands, the ego is not blamed."""
    stops = v * limits.REACTION + v * v / (2.0 * limits.HARD)
    ahead = 2.0 + max(share * stops, 0.1) + 2.0  # from the ego's middle at 1 s to the body's
    body = drive(x=v * 1.0 + ahead, y=aside, t=8.0)
    kinds = [CAR, CAR, PEDESTRIAN if on_foot else CAR]
    found, kind, _ = judged(ego(v=v, rate=rate), follower(gap, v=v), body, kinds=kinds)
    assert kind != ConflictType.UNJUSTIFIED_BRAKING
    assert found.rule[0, 1] != Rule.BRAKED_WITHOUT_REASON


@pytest.mark.parametrize(
    ("other", "is_reason"),
    [
        (drive(x=40.0, v=20.0, t=8.0), False),  # drives ahead, as fast, 1.8 s before it
        (drive(x=20.0, v=20.0, t=8.0), True),  # 0.8 s before it
        (drive(x=45.0, v=braking(rate=4.0), t=8.0), True),  # brakes itself
        (drive(x=60.0, y=3.5, t=8.0), False),  # stands on the next lane
        (drive(x=80.0, y=3.5, h=np.pi, v=15.0, t=8.0), False),  # comes on the next lane
        (drive(x=50.0, y=-9.0, h=np.pi / 2, v=3.0, t=8.0), True),  # comes from the side
        (drive(x=50.0, y=-9.0, h=-np.pi / 2, v=3.0, t=8.0), False),  # goes off to the side
        (drive(x=150.0, t=8.0), False),  # stands too far away to ask for it
    ],
)
def test_what_is_a_reason(other, is_reason):
    _, kind, _ = judged(ego(), follower(12.0), other)
    assert (kind != ConflictType.UNJUSTIFIED_BRAKING) == is_reason


def test_a_body_in_the_bend_ahead_is_a_reason():
    """80 m of radius from where the ego is; the body stands on the arc, turned along it."""
    angle = 30.0 / 80.0
    body = drive(x=22.0 + 80.0 * np.sin(angle), y=80.0 * (1.0 - np.cos(angle)), h=angle, t=8.0)
    assert judged(ego(), follower(12.0), body)[1] != ConflictType.UNJUSTIFIED_BRAKING
