import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridgegen.drivers import _tracking_kernels as track
from bridgegen.drivers.kinds import CAR, TRUCK

DT = 0.1


class Tracker:
    """One track, fed by hand."""

    def __init__(self, settings: tuple = track.TRACKER) -> None:
        self.settings = settings
        self.tracks = np.zeros((2, track.TRACK))
        self.memory = np.zeros((2, track.MEMORY))

    @property
    def row(self) -> np.ndarray:
        return self.tracks[1]

    def frame(self, x=None, y=0.0, *, h=0.0, kind=CAR, confidence=0.9, variance=1.0) -> float:
        """Pass 0.1 s and a frame: a detection at (x, y), or none; return the state then."""
        track.advance(self.tracks, self.memory, 1, DT)
        if x is None:
            track.miss(self.tracks, self.memory, 1, self.settings)
        else:
            track.see(
                self.tracks, self.memory, 1, x, y, h, 4.5, 1.8, kind, confidence, variance,
                variance, self.settings,
            )  # fmt: skip
        return self.row[track.STATE]


def kalman(measured, variances):
    """The textbook's filter for one axis, with matrices; returns the states ``(n, 2)``."""
    q = track.MANOEUVRE
    F = np.array([[1.0, DT], [0.0, 1.0]])
    Q = q * np.array([[DT**3 / 3, DT**2 / 2], [DT**2 / 2, DT]])
    H = np.array([[1.0, 0.0]])
    state = np.array([measured[0], 0.0])
    P = np.diag([variances[0], track.FASTEST**2])
    states = [state]
    for z, r in zip(measured[1:], variances[1:], strict=True):
        state, P = F @ state, F @ P @ F.T + Q
        K = P @ H.T / (H @ P @ H.T + r)
        state = state + K[:, 0] * (z - state[0])
        P = (np.eye(2) - K @ H) @ P
        states.append(state)
    return np.array(states)


@given(
    st.lists(
        st.tuples(st.floats(-100, 100), st.floats(-100, 100), st.floats(0.01, 25.0)),
        min_size=2,
        max_size=30,
    )
)
def test_it_is_the_textbook_s_kalman_filter(rows):
    tracker, found = Tracker(), []
    for x, y, variance in rows:
        tracker.frame(x, y, variance=variance)
        found.append(tracker.row[[track.X, track.VX, track.Y, track.VY]])
    x, y, variances = np.array(rows).T
    expected = np.hstack([kalman(x, variances), kalman(y, variances)])
    assert np.array(found) == pytest.approx(expected, abs=1e-6, rel=1e-6)


def test_a_body_at_constant_velocity_is_followed_without_lag():
    tracker = Tracker()
    for i in range(60):
        tracker.frame(3.0 + 12.0 * i * DT, -2.0 * i * DT, variance=0.05)
    assert tracker.row[track.X] == pytest.approx(3.0 + 12.0 * 5.9, abs=1e-2)
    assert tracker.row[track.VX] == pytest.approx(12.0, abs=1e-2)
    assert tracker.row[track.VY] == pytest.approx(-2.0, abs=1e-2)
    assert tracker.row[track.AGE] == pytest.approx(5.9)


@pytest.mark.parametrize(
    ("frames", "confirmed_at"),
    [("ooo", 2), ("o.oo", 3), ("o..oo", 4), ("o...oo", None), ("oo.o", 3), ("o.o.o", 4)],
)
def test_three_of_five_frames_confirm(frames, confirmed_at):
    tracker = Tracker()
    states = [tracker.frame(5.0 if one == "o" else None) for one in frames]
    first = states.index(track.CONFIRMED) if track.CONFIRMED in states else None
    assert first == confirmed_at


def test_what_was_seen_once_is_forgotten_after_five_frames():
    tracker = Tracker()
    states = [tracker.frame(5.0)] + [tracker.frame() for _ in range(5)]
    assert states == [track.TENTATIVE] * 5 + [track.NONE]
    assert (tracker.row == 0.0).all()


def test_a_confirmed_track_coasts_for_a_second_at_its_velocity():
    tracker = Tracker()
    for i in range(30):
        tracker.frame(10.0 * i * DT, variance=0.01)
    x, v = tracker.row[track.X], tracker.row[track.VX]
    for i in range(1, 11):
        assert tracker.frame() == track.COASTING
        assert tracker.row[track.X] == pytest.approx(x + v * i * DT)
        assert tracker.row[track.VX] == v
        assert tracker.row[track.UNSEEN] == pytest.approx(i * DT)
    assert tracker.frame() == track.NONE


def test_a_track_that_coasts_is_confirmed_as_soon_as_it_is_seen():
    tracker = Tracker()
    for i in range(10):
        tracker.frame(10.0 * i * DT)
    for _ in range(8):
        tracker.frame()
    assert tracker.frame(18.0) == track.CONFIRMED
    assert tracker.row[track.UNSEEN] == 0.0


def test_headings_are_smoothed_the_short_way_round():
    tracker = Tracker()
    tracker.frame(0.0, h=3.1)
    for _ in range(60):
        tracker.frame(0.0, h=-3.1 + 2.0 * np.pi * 7)
    assert np.cos(tracker.row[track.H] + 3.1) == pytest.approx(1.0)
    assert 3.1 < tracker.row[track.H] < 3.3


def test_a_surer_detection_says_what_it_is():
    tracker = Tracker()
    tracker.frame(0.0, kind=TRUCK, confidence=0.5)
    tracker.frame(0.0, kind=CAR, confidence=0.4)
    assert tracker.row[track.KIND] == TRUCK
    tracker.frame(0.0, kind=CAR, confidence=0.9)
    assert tracker.row[track.KIND] == CAR


def test_variances_grow_alike_whatever_the_step():
    one, other = Tracker(), Tracker()
    for tracker in (one, other):
        tracker.frame(0.0)
    track.advance(one.tracks, one.memory, 1, 1.0)
    for _ in range(20):
        track.advance(other.tracks, other.memory, 1, 0.05)
    assert other.memory[1] == pytest.approx(one.memory[1])
