"""The metrics of the ego's first contact, by hand. Boxes are 4 m × 2 m about their points."""

import numpy as np
import pytest

from bridgegen.assess.metrics.impact import impact_speed, relative_impact_speed, speed_reduction


def test_a_slower_car_is_hit_at_the_difference_of_speeds(rollout_of):
    rollout = rollout_of(x=[[0, 0, 0, 0], [9, 3, 0, 9]], v=[[12, 9, 7, 7], [2, 2, 2, 2]])
    assert impact_speed(rollout) == [9.0]  # at the first instant of the first contact
    assert relative_impact_speed(rollout) == [7.0]
    assert speed_reduction(rollout) == [3.0]


@pytest.mark.parametrize(
    ("heading", "relative"),
    [(0.0, 6.0), (np.pi / 2, 10.0), (np.pi, 14.0), (np.pi / 3, 8.0)],
)
def test_the_other_counts_by_its_speed_along_the_ego(rollout_of, heading, relative):
    h = [[0.0, 0.0], [heading, heading]]
    rollout = rollout_of(x=[[0, 0], [9, 1]], h=h, v=[[10, 10], [4, 4]])
    assert impact_speed(rollout) == [10.0]
    assert relative_impact_speed(rollout) == pytest.approx([relative])


def test_of_two_at_once_the_larger_counts(rollout_of):
    rollout = rollout_of(x=[[0, 0], [9, 1], [9, 1]], v=[[10, 10], [4, 4], [1, 1]])
    assert relative_impact_speed(rollout) == [9.0]


def test_who_is_hit_from_behind_hits_nobody(rollout_of):
    rollout = rollout_of(x=[[0, 0], [-9, -3]], v=[[5, 5], [9, 9]])
    assert relative_impact_speed(rollout) == [0.0]
    assert impact_speed(rollout) == [5.0]


def test_without_a_contact_there_is_no_impact(rollout_of):
    rollout = rollout_of(x=[[0, 0], [9, 5]], v=[[10, 4], [0, 0]], n_steps=[2])
    for metric in (impact_speed, relative_impact_speed):
        assert metric(rollout) == [0.0]
    assert speed_reduction(rollout) == [np.inf]


def test_a_contact_in_the_padding_is_none(rollout_of):
    rollout = rollout_of(x=[[0, 0, 0], [9, 9, 1]], v=[[10, 8, 8], [0, 0, 0]], n_steps=[2])
    assert impact_speed(rollout) == [0.0]
