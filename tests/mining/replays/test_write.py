"""Recorded events as files: played again, they are what was recorded."""

import itertools
from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest
from tests.mining.conflicts.test_find import braking
from tests.recordings.test_clean import drive, traffic

from bridgegen.engine.simulate import simulate_file
from bridgegen.openx.opendrive.geometry import pose
from bridgegen.pages.moving import moving_picture
from bridgegen.recordings.conflicts.find import conflicts_of
from bridgegen.recordings.excerpt import clock_of
from bridgegen.recordings.readers.clean import clean
from bridgegen.recordings.replays.scenario import BEFORE, along
from bridgegen.recordings.replays.write import prepare, write


def bend(n=80, v=8.0, radius=25.0, y=0.0):
    """Return a car that turns left on an arc."""
    t = 0.1 * np.arange(n)
    angle = v * t / radius
    x, y = radius * np.sin(angle) - 20.0, y + radius * (1 - np.cos(angle))
    return {"time": t, "x": x, "y": y, "heading": angle}


@pytest.fixture(scope="module")
def prepared():
    """A near miss, with one who turns, and one who comes later and leaves earlier."""
    moving, standing = braking(1.0)
    comes = drive(n=25, v=10.0, y=5.0, x=-20.0, start=1.5) | {"heading": np.zeros(25)}
    cleaned = clean(traffic(moving, standing, bend(y=8.0), comes), 0.05).traffic
    (event, *_) = conflicts_of(cleaned)
    return prepare(cleaned, clock_of(cleaned), event)


@pytest.fixture(scope="module")
def replay(prepared, tmp_path_factory):
    return write(prepared, tmp_path_factory.mktemp("critical") / "0001")


def test_it_is_simulated_as_it_was_recorded(prepared, replay):
    assert replay.problem == ""
    assert replay.off < 1e-6
    assert replay.too_fast < 0.1
    assert len(prepared.motion.names) == 4
    assert prepared.motion.present.size  # one comes and goes
    found = simulate_file(replay.scenario)
    near = found.conflicts
    partner = near.names.index(prepared.motion.names[1])
    assert near.kind[0].argmax() == partner
    assert near.ttc[0, partner] == pytest.approx(prepared.event.found.ttc, abs=0.05)


def test_its_files_are_valid(cli, replay):
    code, _, err = cli("validate", replay.scenario)
    assert (code, err) == (0, "")
    assert replay.scenario.with_suffix(".owl").exists()


def test_it_says_so_where_it_is_not(prepared, tmp_path):
    """The proof compares with the recording, not with itself."""
    x, v = prepared.states.x.copy(), prepared.states.v.copy()
    x[1, 40:] += 0.3
    v[0, 7] += 0.7
    other = replace(prepared, states=replace(prepared.states, x=x, v=v))
    made = write(other, tmp_path / "0001")
    assert made.off == pytest.approx(0.3, abs=1e-6)
    assert made.too_fast == pytest.approx(0.7, abs=0.1)


def test_a_driver_takes_the_ego_s_place_where_and_as_fast_as_it_was(prepared, tmp_path):
    made = write(prepared, tmp_path / "0001", ego="reference")
    assert made.off < 1e-6  # of what was recorded, not of what is driven
    found = simulate_file(made.scenario)
    assert found.driver == "reference"
    own, was = found.rollout, prepared.motion
    assert own.x[0, 0, 0] == pytest.approx(was.x[0, 0, 0], abs=1e-6)
    assert own.y[0, 0, 0] == pytest.approx(was.y[0, 0, 0], abs=1e-6)
    assert own.v[0, 0, 0] == pytest.approx(was.v[0, 0, 0], abs=1e-6)
    assert found.metrics["n_collision"] == 0
    assert found.metrics["harm"] < prepared.event.found.harm
    for e, name in enumerate(was.names[1:], 1):
        k = own.names.index(name)
        there = slice(None) if not was.present.size else was.present[0, e]
        n = min(own.shape[2], was.shape[2])
        apart = np.hypot(own.x[0, k, :n] - was.x[0, e, :n], own.y[0, k, :n] - was.y[0, e, :n])
        assert apart[there[:n] if was.present.size else there].max() < 1e-6


def test_a_driver_is_to_reach_the_speed_that_was_recorded(tmp_path):
    """A car that stood at first drives off, too, if a driver is in its place."""
    t = 0.1 * np.arange(100)
    starts = {"time": t, "x": 0.5 * 1.5 * np.clip(t - 1.0, 0, None) ** 2, "y": np.zeros(100),
              "heading": np.zeros(100)}  # fmt: skip
    stands = {"time": t, "x": np.full(100, 40.0), "y": np.zeros(100), "heading": np.zeros(100)}
    cleaned = clean(traffic(starts, stands), 0.05).traffic
    (event,) = conflicts_of(cleaned)
    made = write(prepare(cleaned, clock_of(cleaned), event), tmp_path / "0001", ego="reference")
    assert simulate_file(made.scenario).rollout.v[0, 0].max() > 3.0


@pytest.mark.parametrize("way", [bend(), drive(n=60, v=12.0), bend(radius=9.0, v=4.0)])
def test_the_road_is_where_the_ego_went(way):
    cleaned = clean(traffic(way), 0.05).traffic
    x, y, h = cleaned.x, cleaned.y, np.unwrap(cleaned.heading)
    roads, start = along(x, y, h)
    (road,) = roads.roads
    assert start == BEFORE
    pieces = road.plan_view
    points = np.array([pose(one, u)[:3] for one in pieces
                       for u in np.linspace(0.0, one.length, 60)])  # fmt: skip
    apart = np.hypot(points[:, 0] - x[:, None], points[:, 1] - y[:, None]).min(axis=1)
    assert apart.max() < 0.1
    for one, two in itertools.pairwise(pieces):
        end = pose(one, one.length)
        assert end[:2] == pytest.approx((two.x, two.y), abs=1e-4)
        assert np.cos(end[2] - two.hdg) == pytest.approx(1.0, abs=1e-4)
        assert one.s + one.length == pytest.approx(two.s)


def test_who_stands_has_a_road_too():
    roads, _ = along(np.full(9, 3.0), np.full(9, 4.0), np.full(9, 0.5))
    assert len(roads.roads[0].plan_view) == 2


def test_the_picture_moves_everyone_and_names_are_text(prepared):
    picture = moving_picture(prepared.motion, 1, prepared.when, 'a "<b>" & c')
    root = ElementTree.fromstring(picture)
    moves = root.findall(".//animateTransform[@type='translate']")
    assert len(moves) == len(prepared.motion.names)
    assert root.find("title").text == 'a "<b>" & c'
    counts = {len(one.get("values").split(";")) for one in moves}
    assert len(counts) == 1
    first, *_, last = moves[-1].get("values").split(";")
    (x, y), (further, same) = (map(float, at.split()) for at in (first, last))
    assert further > x + 50.0  # the ego goes to the right
    assert same == y
