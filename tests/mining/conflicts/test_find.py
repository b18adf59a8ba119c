"""Conflicts of recorded traffic are those that a search would find in it."""

from dataclasses import replace

import numpy as np
import pytest
from tests.recordings.test_clean import drive, traffic

from bridgegen.assess.conflict.analysis import CONTACT, NEAR_MISS, analyse
from bridgegen.assess.conflict.harm import harm_of_pairs
from bridgegen.drivers.kinds import CAR, PEDESTRIAN
from bridgegen.engine.options import PipelineOptions
from bridgegen.engine.pipeline import Pipeline
from bridgegen.jobs.search.scenarios import load
from bridgegen.recordings.conflicts import find
from bridgegen.recordings.conflicts.find import candidates, conflicts_of
from bridgegen.recordings.excerpt import clock_of, excerpt
from bridgegen.recordings.readers.clean import clean
from bridgegen.recordings.readers.formats import read
from bridgegen.simulation.trace import write_trace


def braking(reaction, n=80):
    """Return a car that brakes after some seconds, and one that stands 0.4 m beyond its way."""
    t = 0.1 * np.arange(n)
    v = np.clip(15.0 - 8.0 * np.clip(t - reaction, 0.0, None), 0.0, None)
    x = np.append(0.0, np.cumsum(0.05 * (v[1:] + v[:-1])))
    stands = np.full(n, x[-1] + 4.6 + 0.4)
    return [{"time": t, "x": at, "y": np.zeros(n), "heading": np.zeros(n)} for at in (x, stands)]


def test_they_are_what_the_analysis_of_a_simulated_row_says(tmp_path):
    scenario = load("cut-in")
    pipeline = Pipeline(scenario, scenario.space(), PipelineOptions(ego="route-follower"))
    X = pipeline.space.decode(np.random.default_rng(3).random((500, pipeline.space.n_var)))
    rollout = pipeline.rollout(X)
    known = analyse(rollout)
    row = int(np.flatnonzero(known.kind.max(axis=1) == NEAR_MISS)[0])
    other = int(known.kind[row].argmax())
    write_trace(tmp_path / "row.csv", rollout, row)
    (recorded,) = read(tmp_path / "row.csv")
    cleaned = clean(recorded, rollout.time_step).traffic
    (found,) = conflicts_of(cleaned)
    assert {cleaned.names[found.ego], cleaned.names[found.other]} == {
        rollout.names[0], rollout.names[other]
    }  # fmt: skip
    assert found.found.harm >= harm_of_pairs(known, "any")[row, other] - 1e-9
    if cleaned.names[found.ego] == rollout.names[0]:
        assert found.found.ttc == pytest.approx(known.ttc[row, other], abs=1e-6)
        assert found.instant == known.instant[row, other]
    assert found.doubt == ""


def test_who_brakes_late_is_in_a_near_miss_and_who_stands_is_no_ego():
    moving, standing = braking(4.0)
    (found,) = conflicts_of(clean(traffic(moving, standing), 0.05).traffic)
    assert (found.ego, found.other, found.is_contact) == (0, 1, False)
    assert found.found.type == "front-to-rear striking"
    assert found.found.responsible == "ego"
    assert found.instant * 0.05 == pytest.approx(found.found.time)


@pytest.mark.parametrize("angle", [0.7, -2.5])
def test_neither_the_frame_nor_the_clock_nor_the_order_matters(angle):
    moving, standing = braking(1.0)
    (known,) = conflicts_of(clean(traffic(moving, standing), 0.05).traffic)
    c, s = np.cos(angle), np.sin(angle)

    def turned(one):
        x, y = one["x"], one["y"]
        return {"time": one["time"] + 700.0, "x": 9e3 + c * x - s * y, "y": -5e3 + s * x + c * y,
                "heading": one["heading"] + angle}  # fmt: skip

    (found,) = conflicts_of(clean(traffic(turned(standing), turned(moving)), 0.05).traffic)
    assert (found.ego, found.other) == (1, 0)
    assert found.instant - known.instant == pytest.approx(700 / 0.05)
    assert found.found.ttc == pytest.approx(known.found.ttc, abs=1e-5)
    assert found.found.needed_deceleration == pytest.approx(known.found.needed_deceleration, 1e-4)


def test_fragments_and_people_on_foot_are_no_egos():
    moving, standing = braking(1.0)
    short = {key: value[:9] for key, value in moving.items()}
    assert conflicts_of(clean(traffic(short, standing), 0.05).traffic) == ()
    walks = traffic(moving, standing, kind=[PEDESTRIAN, CAR])
    found = candidates(cleaned := clean(walks, 0.05).traffic, clock_of(cleaned))
    assert found == {}


def test_bodies_that_touch_hide_no_near_miss():
    """A box that is wrong ends the analysis of a pair, not that of its ego."""
    moving, standing = braking(1.0)
    beside = moving | {"x": moving["x"] - 1.0, "y": moving["y"] + 1.5}
    found = conflicts_of(clean(traffic(moving, standing, beside), 0.05).traffic)
    assert next((one.ego, one.other, one.is_contact) for one in found) == (0, 1, False)
    assert {(one.ego, one.other) for one in found if one.is_contact} <= {(0, 2), (2, 0), (2, 1)}
    assert any(one.is_contact for one in found)


def test_no_pair_in_conflict_is_left_out(monkeypatch):
    """Of many on crossing and common ways, the candidates hold all that conflict."""
    random = np.random.default_rng(0)
    tracks = []
    for _ in range(24):
        angle, v = random.uniform(-np.pi, np.pi), random.uniform(3.0, 20.0)
        one = drive(n=60, v=v, x=-3.0 * v)
        y = random.uniform(-6.0, 6.0)
        c, s = np.cos(angle), np.sin(angle)
        tracks.append({"time": one["time"], "x": c * one["x"] - s * y, "y": s * one["x"] + c * y})
    cleaned = clean(traffic(*tracks), 0.1).traffic
    clock = clock_of(cleaned)
    found = candidates(cleaned, clock)
    serious = 0
    for ego in range(len(tracks)):
        others = [p for p in range(len(tracks)) if p != ego]
        for other in others:
            motion = excerpt(cleaned, clock, ego, [other], 0, int(clock.end[ego]))
            if analyse(motion).kind[0, 1] >= NEAR_MISS:
                serious += 1
                assert other in found[ego]
    assert serious > 10
    monkeypatch.setattr(find, "BLOCK", 7)
    assert candidates(cleaned, clock) == found


def test_an_excerpt_is_what_was_recorded_and_who_comes_later_is_absent_first():
    early, late = drive(n=40, v=10.0), drive(n=20, v=5.0, y=30.0, start=2.0)
    cleaned = clean(traffic(early, late), 0.1).traffic
    clock = clock_of(cleaned)
    motion = excerpt(cleaned, clock, 0, [1], 5, 35)
    ahead = motion.box[0, 2]
    assert ahead == pytest.approx(1.4)
    assert motion.x[0, 0] + ahead == pytest.approx(10.0 * 0.1 * np.arange(5, 36))
    assert motion.v[0] == pytest.approx(np.repeat([[10.0], [5.0]], 31, axis=1), abs=1e-6)
    assert motion.present[0, 1].tolist() == [k >= 20 for k in range(5, 36)]
    assert replace(motion, present=np.zeros((0, 0, 0), bool)).shape == (1, 2, 31)
    assert CONTACT not in analyse(motion).kind


@pytest.mark.parametrize("span", [2.0, 7.0, 1e6])
def test_the_parts_in_which_an_ego_is_analysed_do_not_matter(monkeypatch, span):
    """In 200 s, an ego meets 20 who stand in its way and step aside late, and touches some."""
    rng, t = np.random.default_rng(5), 0.1 * np.arange(2000)
    v = 14.0 + 4.0 * np.sin(0.4 * t)
    x = np.append(0.0, np.cumsum(0.05 * (v[1:] + v[:-1])))
    tracks = [{"time": t, "x": x, "y": 0.0 * t, "heading": 0.0 * t}]
    for passes in rng.integers(60, 1960, 20):
        k = np.arange(passes - 60, min(passes + 30, 2000))
        aside = np.clip((t[k] - t[passes] + rng.uniform(0.6, 1.6)) / 1.2, 0.0, 1.0)
        tracks.append({"time": t[k], "x": np.full(len(k), x[passes]),
                       "y": 2.0 * (1.0 - np.cos(np.pi * aside)), "heading": 0.0 * k})  # fmt: skip
    cleaned = clean(traffic(*tracks), 0.1).traffic
    known = conflicts_of(cleaned)
    assert sum(not one.is_contact for one in known) >= 5
    assert any(one.is_contact for one in known)
    monkeypatch.setattr(find, "SPAN", span)
    found = conflicts_of(cleaned)
    facts = [[(one.ego, one.other, one.instant, one.found.type, one.found.responsible, one.doubt)
              for one in each] for each in (found, known)]  # fmt: skip
    assert facts[0] == facts[1]
    for one, other in zip(found, known, strict=True):
        assert one.found.ttc == pytest.approx(other.found.ttc, abs=2e-3)
        assert one.found.harm == pytest.approx(other.found.harm, abs=1e-3)
