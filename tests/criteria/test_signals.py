"""Signals of rollouts: hand-worked numbers, and what does not depend on other rows."""

import numpy as np
import pytest
from tests.metrics.conftest import drive_around, make_rollout

from bridgegen.assess.criteria.signals import SIGNALS, read


def test_states_by_hand():
    # 10 m/s for 0.1 s, then 2 m/s² more in each step of 0.05 s; the heading turns by 0.01 rad.
    rollout = make_rollout(
        x=[[[0.0, 0.5, 1.0, 1.5]]], y=[[[0.0, 0.0, 0.0, 2.0]]], v=[[[10.0, 10.0, 10.0, 8.0]]],
        a=[[[0.0, 2.0, 4.0, 9.0]]], h=[[[0.0, 0.01, 0.02, 0.02]]],
    )  # fmt: skip
    assert read(rollout, "jerk", ("ego",))[0] == pytest.approx([40.0, 40.0, 100.0, 100.0])
    assert read(rollout, "yaw_rate", ("ego",))[0] == pytest.approx([0.2, 0.2, 0.0, 0.0])
    assert read(rollout, "a_lat", ("ego",))[0] == pytest.approx([2.0, 2.0, 0.0, 0.0])
    way = [0.0, 0.5, 1.0, 1.0 + np.hypot(0.5, 2.0)]
    assert read(rollout, "travelled", ("ego",))[0] == pytest.approx(way)


def test_relations_by_hand():
    # Bodies of 4 m: 10 m between the reference points are 6 m of gap, closed at 3 m/s in 2 s.
    rollout = make_rollout(x=[[[0.0], [10.0], [30.0]]], v=[[[8.0], [5.0], [8.0]]])
    assert read(rollout, "gap", ("ego", "bv1"))[0] == pytest.approx([6.0])
    assert read(rollout, "ttc", ("ego", "bv1"))[0] == pytest.approx([2.0])
    assert read(rollout, "thw", ("ego", "bv1"))[0] == pytest.approx([6.0 / 8.0])
    assert read(rollout, "ttc", ("ego", "bv2"))[0] == pytest.approx([np.inf])
    for name, least in {"gap": 6.0, "ttc": 2.0, "thw": 0.75}.items():
        assert read(rollout, name, ("ego", "any"))[0] == pytest.approx([least])


def test_the_least_over_time_and_others_is_the_metric():
    from bridgegen.assess import metrics

    rollout = drive_around()
    expected = metrics.evaluate(rollout, ["d_min", "ttc", "thw"])
    real = np.arange(rollout.shape[2]) < rollout.n_steps[:, np.newaxis]
    for j, name in enumerate(["gap", "ttc", "thw"]):
        over_time = np.where(real, read(rollout, name, ("ego", "any")), np.inf)
        assert over_time.min(axis=1) == pytest.approx(expected[:, j]), name


def test_a_row_s_signals_do_not_depend_on_other_rows():
    rollout = drive_around()
    for name, signal in SIGNALS.items():
        of = ("ego", "bv2") if signal.pair else ("bv1",)
        whole = read(rollout, name, of)
        for i in range(rollout.shape[0]):
            n = int(rollout.n_steps[i])
            alone = read(rollout.take(np.array([i])), name, of)
            assert alone[0, :n].tobytes() == whole[i, :n].tobytes(), name


def test_who_is_absent_has_its_nearest_state_and_no_gap():
    from dataclasses import replace

    rollout = make_rollout(x=[[[0.0] * 4, [9.0] * 4]], v=[[[1.0] * 4, [7.0, 1.0, 2.0, 8.0]]])
    present = np.array([[[True] * 4, [False, True, True, False]]])
    rollout = replace(rollout, present=present)
    assert read(rollout, "v", ("bv1",))[0].tolist() == [1.0, 1.0, 2.0, 2.0]
    gap = read(rollout, "gap", ("ego", "bv1"))[0]
    assert np.isinf(gap).tolist() == [True, False, False, True]
