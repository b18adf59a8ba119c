"""The metrics of motion by hand and against plain NumPy, and the laws that all metrics keep."""

import os
import subprocess
import sys

import numpy as np
import pytest
from tests.approval import approve, refuses

from bridgegen.assess import metrics
from bridgegen.assess.metrics.braking import a_change, n_brake
from bridgegen.assess.metrics.distances import d_min, v_d
from bridgegen.assess.metrics.impact import n_collision
from bridgegen.assess.metrics.metric import Metric, in_steps
from bridgegen.assess.metrics.road import l_offset
from bridgegen.base.errors import InputError, UnknownNameError
from bridgegen.testing import MetricContract
from bridgegen.testing.metrics import absent_now_and_then, lengthened

ALL = list(metrics.METRICS)


# By hand. Boxes are 4 m × 2 m about the reference point; the other drives along the ego's axis, so
# the distance is |x| − 4.


def test_d_min_and_the_speed_at_its_first_instant(rollout_of):
    rollout = rollout_of(
        x=[[0, 0, 0, 0], [20, 7, 12, 7]],  # 16, 3, 8, 3 m
        v=[[8, 7, 6, 5], [1, 1, 1, 1]],
    )
    assert d_min(rollout) == [3.0]
    assert v_d(rollout) == [7.0]


def test_the_first_instant_counts_over_all_entities(rollout_of):
    rollout = rollout_of(
        x=[[0, 0, 0], [20, 20, 9], [20, 9, 20]],  # both come to 5 m, the second one earlier
        v=[[8, 7, 6], [1, 1, 1], [1, 1, 1]],
    )
    assert d_min(rollout) == [5.0]
    assert v_d(rollout) == [7.0]


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_rounding_does_not_choose_the_instant(rollout_of, sign):
    """At a constant gap, d_min is reached when it is first reached, whatever the last bits say."""
    last_bits = sign * 5e-14 * np.arange(4)
    rollout = rollout_of(x=[[0, 0, 0, 0], 9.0 + last_bits], v=[[4, 3, 2, 1], [0, 0, 0, 0]])
    assert d_min(rollout) == pytest.approx([5.0], abs=1e-12)
    assert v_d(rollout) == [4.0]
    nearer = rollout_of(x=[[0, 0, 0, 0], [9.0, 9.0 - 2e-9, 9, 9]], v=[[4, 3, 2, 1], [0] * 4])
    assert v_d(nearer) == [3.0]


def test_on_a_collision_v_d_is_the_speed_at_first_contact(rollout_of):
    rollout = rollout_of(x=[[0, 0, 0, 0], [5, 3, 0, 9]], v=[[9, 8, 1, 1], [0, 0, 0, 0]])
    assert d_min(rollout) == [0.0]
    assert v_d(rollout) == [8.0]
    assert n_collision(rollout) == [1.0]


def test_alone_on_the_road(rollout_of):
    rollout = rollout_of(x=[[[0.0, 1.0]]], v=5.0)
    assert d_min(rollout) == [np.inf]
    assert v_d(rollout) == [0.0]
    assert n_collision(rollout) == [0.0]
    assert metrics.get("ttc").compute(rollout) == [np.inf]


def contact_at(rollout_of, *instants, of=400, **settings):
    """One other vehicle, 10 m off but at the given instants, when it touches."""
    x = np.full(of, 14.0)
    x[list(instants)] = 3.0
    return rollout_of(x=np.stack([np.zeros(of), x]), **settings)


@pytest.mark.parametrize(
    ("instants", "expected"),
    [
        ((), 0),
        ((0,), 1),
        ((399,), 1),
        ((10, 11, 12, 13), 1),  # one lasting contact
        ((10, 12), 1),
        ((10, 110), 1),  # 5 s later: the same
        ((10, 111), 2),  # 5.05 s later: another
        ((10, 100, 190, 280), 1),  # each within 5 s of the one before
        ((10, 120, 230), 3),
        ((*range(10, 150), 200), 1),  # 5 s count from the end of a contact
        ((0, 101, 150, 350), 3),
    ],
)
def test_contacts_within_five_seconds_are_one(rollout_of, instants, expected):
    assert n_collision(contact_at(rollout_of, *instants)) == [expected]


def test_contacts_with_two_actors_are_two(rollout_of):
    near, far = [3.0, 3.0, 3.0], [14.0, 14.0, 14.0]
    assert n_collision(rollout_of(x=[[0.0] * 3, near, near])) == [2.0]
    assert n_collision(rollout_of(x=[[0.0] * 3, near, far])) == [1.0]


def test_the_merging_time_is_an_argument_in_seconds(rollout_of):
    rollout = contact_at(rollout_of, 10, 31)  # 1.05 s
    assert n_collision(rollout, merge_within=1.0) == [2.0]
    assert n_collision(rollout, merge_within=1.05) == [1.0]
    slower = contact_at(rollout_of, 10, 31, time_step=0.1)  # 2.1 s
    assert n_collision(slower, merge_within=2.0) == [2.0]
    assert n_collision(slower, merge_within=2.1) == [1.0]


@pytest.mark.parametrize(
    ("a", "expected"),
    [
        ([0, 0, 0], 0),
        ([0, -4.9, 0], 1),  # reaching the threshold counts
        ([0, -4.89, 0], 0),
        ([0, -5, -9, -5, 0], 1),  # one long braking
        ([0, -5, -4, -5, 0], 2),
        ([-6, -6, 0], 1),  # braking from the first instant on
        ([0, 0, -6], 1),
        ([6, 6, 6], 0),  # accelerating is not braking
        ([0, -5, 5, -5, 5, -5], 3),
    ],
)
def test_hard_braking_is_counted_by_its_rising_edges(rollout_of, a, expected):
    assert n_brake(rollout_of(a=[[a]])) == [expected]


def test_the_braking_threshold_is_an_argument(rollout_of):
    rollout = rollout_of(a=[[[0, -3.5, 0, -5.0, 0, -2.9]]])
    assert n_brake(rollout) == [1.0]
    assert n_brake(rollout, threshold=3.0) == [2.0]


def test_acceleration_change_within_half_a_second(rollout_of):
    ramp = np.linspace(0, -8, 41)  # 0.2 m/s² per step of 0.05 s
    assert a_change(rollout_of(a=ramp[None, None])) == pytest.approx([2.0])
    step = np.r_[np.full(20, 1.0), np.full(20, -5.0)]
    assert a_change(rollout_of(a=step[None, None])) == [6.0]
    assert a_change(rollout_of(a=np.full((1, 1, 30), -3.0))) == [0.0]
    assert a_change(rollout_of(a=[[[-3.0]]])) == [0.0]


@pytest.mark.parametrize(("apart", "expected"), [(9, 7.0), (10, 7.0), (11, 4.0)])
def test_ten_steps_are_half_a_second(rollout_of, apart, expected):
    a = np.zeros(60)
    a[20], a[20 + apart] = 4.0, -3.0
    assert a_change(rollout_of(a=a[None, None])) == [expected]


def test_the_window_is_an_argument_in_seconds(rollout_of):
    a = np.zeros(60)
    a[20], a[25] = 4.0, -3.0
    rollout = rollout_of(a=a[None, None])
    assert a_change(rollout, window=0.2) == [4.0]
    assert a_change(rollout, window=0.25) == [7.0]
    assert a_change(rollout_of(a=a[None, None], time_step=0.1), window=0.25) == [4.0]
    assert a_change(rollout, window=1e3) == [7.0]  # longer than the recording


def test_offset_counts_to_either_side_and_only_the_egos(rollout_of):
    assert l_offset(rollout_of(offset=[[0.1, -0.7, 0.3], [9, 9, 9]])) == [0.7]
    assert l_offset(rollout_of(offset=[[0.1, -0.2, 0.3], [9, 9, 9]])) == [0.3]


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda r: n_collision(r, merge_within=0.0), "merge_within"),
        (lambda r: a_change(r, window=np.nan), "window"),
        (lambda r: n_brake(r, threshold=-3.0), "threshold"),
        (lambda r: n_brake(r, threshold=0.0), "threshold"),
    ],
)
def test_senseless_arguments_are_refused(rollout_of, call, message):
    with refuses(ValueError, message):
        call(rollout_of(x=np.zeros((1, 2, 3))))


def test_a_small_threshold_is_one(rollout_of):
    a = np.array([[[0.0, -0.4, 0.0, -0.2, 0.0, -0.4]]])
    assert n_brake(rollout_of(a=a), threshold=0.3) == [2.0]


@pytest.mark.parametrize("field", ["x", "v", "a", "offset"])
def test_a_state_that_is_not_finite_is_refused(driven, field):
    rollout = driven(2, 2, 5)
    getattr(rollout, field)[1, 0, 2] = np.nan
    with refuses(ValueError, field, "nan"):
        metrics.evaluate(rollout, ALL)


# Laws that hold for every metric.


class TestRegistered(MetricContract):
    @pytest.fixture(autouse=True, params=ALL)
    def each(self, request):
        self.metric = metrics.get(request.param)


def test_more_padding_changes_no_bit(driven):
    here, there = (metrics.evaluate(r, ALL) for r in (driven(), lengthened(driven(), 30)))
    assert there.tobytes() == here.tobytes()


def test_every_metric_finds_something_in_the_rollouts_of_these_tests(driven):
    values = metrics.evaluate(driven(200), ALL)
    assert (np.where(np.isfinite(values), values, -1.0).max(axis=0) > 0).all()


def test_absence_changes_something(driven):
    scene = driven(40, 4, within=10.0)
    here, there = (metrics.evaluate(r, ALL) for r in (scene, absent_now_and_then(scene)))
    assert not np.array_equal(there, here)


# Parity with plain NumPy.


def plain(rollout, i):
    """The metrics of motion of scenario i, the slow and obvious way."""
    n = rollout.n_steps[i]
    gap = rollout.distance[i, 1:, :n]
    a, step = rollout.a[i, 0, :n], rollout.time_step
    k = int((gap.min(axis=0) <= gap.min() + 1e-9).argmax())
    count = 0
    for row in gap:
        touching = np.flatnonzero(row == 0) * step
        count += bool(len(touching)) + int((np.diff(touching) > 5 + 1e-6).sum())
    lag = np.abs(np.subtract.outer(np.arange(n), np.arange(n))) * step
    hard = np.r_[False, a <= -4.9]
    return {
        "d_min": gap.min(),
        "v_d": rollout.v[i, 0, k],
        "n_collision": count,
        "l_offset": np.abs(rollout.offset[i, 0, :n]).max(),
        "a_change": np.abs(np.subtract.outer(a, a))[lag <= 0.5 + 1e-6].max(),
        "n_brake": (hard[1:] & ~hard[:-1]).sum(),
    }


@pytest.mark.parametrize("shape", [(40, 2, 120), (10, 5, 33), (3, 64, 7), (5, 2, 1)])
def test_kernels_agree_with_plain_numpy(driven, shape):
    rollout = driven(*shape, seed=shape[1])
    names = ["d_min", "v_d", "n_collision", "l_offset", "a_change", "n_brake"]
    got = metrics.evaluate(rollout, names)
    expected = [[plain(rollout, i)[name] for name in names] for i in range(shape[0])]
    np.testing.assert_array_equal(got, np.array(expected, dtype=float))


def test_acceleration_change_agrees_with_comparing_every_pair(rollout_of):
    """For windows of every length, the doubling of windows has no seam."""
    rng = np.random.default_rng(0)
    for n in (1, 2, 7, 40):
        lag = np.abs(np.subtract.outer(np.arange(n), np.arange(n)))
        a = np.cumsum(rng.normal(0, 1, (25, 1, n)), axis=-1)
        pairs = np.abs(a[:, 0, :, None] - a[:, 0, None, :])
        for window in range(1, 45):
            expected = np.where(lag <= window, pairs, 0.0).max(axis=(1, 2))
            got = a_change(rollout_of(a=a), window=window * 0.05)
            np.testing.assert_array_equal(got, expected)


@pytest.mark.parametrize(
    ("seconds", "time_step", "expected"),
    [(0.5, 0.05, 10), (0.3, 0.1, 3), (5.0, 0.05, 100), (0.28, 0.05, 5), (0.04, 0.05, 0)],
)
def test_whole_steps_of_a_duration(seconds, time_step, expected):
    """0.3 / 0.1 is 2.9999999999999996."""
    assert in_steps("window", seconds, time_step) == expected


# The registry.


def test_unknown_metric_suggests_the_nearest(driven):
    for call in (lambda: metrics.get("dmin"), lambda: metrics.evaluate(driven(1), ["ttc", "dmin"])):
        with refuses(UnknownNameError, "dmin", "d_min"):
            call()


def test_the_paper_s_eleven_and_their_units():
    assert {name: metrics.get(name).unit for name in metrics.TABLE_I} == {
        "r_red": "count", "n_collision": "count", "ttc": "s", "d_min": "m", "v_d": "m/s",
        "l_offset": "m", "iou": "1", "e_position": "m", "map": "1", "a_change": "m/s²",
        "n_brake": "count",
    }  # fmt: skip
    assert all(m.name == name and m.description for name, m in metrics.METRICS.items())
    smaller = {name for name in metrics.TABLE_I if metrics.get(name).sense == "smaller"}
    assert smaller == {"ttc", "d_min", "iou", "map"}


@pytest.mark.parametrize(
    ("name", "unit", "sense", "cap"),
    [
        ("r_red", "count", "larger", 0.0),
        ("n_collision", "count", "larger", 0.0),
        ("ttc", "s", "smaller", 20.0),
        ("d_min", "m", "smaller", 200.0),
        ("v_d", "m/s", "larger", 0.0),
        ("l_offset", "m", "larger", 0.0),
        ("iou", "1", "smaller", 1.0),
        ("e_position", "m", "larger", 0.0),
        ("map", "1", "smaller", 1.0),
        ("a_change", "m/s²", "larger", 0.0),
        ("n_brake", "count", "larger", 0.0),
        ("pet", "s", "smaller", 10.0),
        ("drac", "m/s²", "larger", 0.0),
        ("btn", "1", "larger", 0.0),
        ("thw", "s", "smaller", 10.0),
        ("tet", "s", "larger", 0.0),
        ("tit", "s²", "larger", 0.0),
        ("rss", "1", "larger", 0.0),
        ("impact_speed", "m/s", "larger", 0.0),
        ("relative_impact_speed", "m/s", "larger", 0.0),
        ("speed_reduction", "m/s", "smaller", 60.0),
    ],
)
def test_what_counts_as_critical_and_as_not_at_all(name, unit, sense, cap):
    """What an objective makes of a metric: a change here changes what every search looks for."""
    one = metrics.get(name)
    assert (one.unit, one.sense, one.cap) == (unit, sense, cap)
    assert one.sign == (-1.0 if sense == "smaller" else 1.0)


def test_who_asks_for_what_is_not_perceived_is_told_who_perceives():
    with pytest.raises(InputError) as error:
        metrics.require(("ttc", "iou", "r_red"), (), "the recording")
    first, second = error.value.problems
    approve(first, "iou", "--ego")
    approve(second, "r_red")


def test_which_metrics_exist_depends_on_what_a_rollout_holds():
    table = metrics.TABLE_I
    assert metrics.existing(table, ("detections", "lights", "offset")) == table
    blind = metrics.existing(table, ("lights", "offset"))
    assert set(table) - set(blind) == {"iou", "e_position", "map"}
    assert set(blind) - set(metrics.existing(table, ())) == {"r_red", "l_offset"}


def test_what_a_rollout_does_not_hold_is_refused(rollout_of):
    for name in ("iou", "e_position", "map"):
        with refuses(ValueError):
            metrics.get(name).compute(rollout_of(x=np.zeros((1, 2, 3))))


def test_columns_come_in_the_order_asked_for(driven):
    rollout = driven()
    values = metrics.evaluate(rollout, ["v_d", "d_min", "v_d"])
    np.testing.assert_array_equal(
        values, np.column_stack([v_d(rollout), d_min(rollout), v_d(rollout)])
    )
    assert metrics.evaluate(rollout, []).shape == (12, 0)


def test_a_metric_needs_a_sense_and_a_finite_cap():
    with refuses(ValueError, "sense"):
        Metric("x", "m", "", "higher", 0.0, d_min)  # type: ignore[arg-type]
    with refuses(ValueError, "inf"):
        Metric("x", "m", "", "smaller", np.inf, d_min)


def run_python(code: str, **environment: str) -> str:
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", code],
        env=os.environ | environment, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_importing_metrics_does_not_import_the_compiler():
    run_python(
        "import sys, bridgegen.assess.metrics, bridgegen.assess.objective\n"
        "assert not {'numba', 'pandas', 'scipy'} & set(sys.modules)"
    )


def test_kernels_give_the_same_bits_without_compilation(driven):
    code = (
        "import numba\n"
        "from bridgegen.assess import metrics\n"
        "from bridgegen.testing.scenes import drive_around\n"
        "assert numba.config.DISABLE_JIT\n"
        "values = metrics.evaluate(drive_around(8, 3, 21), list(metrics.METRICS))\n"
        "print(values.tobytes().hex())"
    )
    got = run_python(code, NUMBA_DISABLE_JIT="1").strip()
    assert got == metrics.evaluate(driven(8, 3, 21), ALL).tobytes().hex()
