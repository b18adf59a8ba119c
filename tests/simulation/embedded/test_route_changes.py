"""Egos whose routes change lanes: where they do, and that drivers who look wait for a gap."""

import numpy as np
import pytest

from bridgegen.assess.conflict.analysis import analyse
from bridgegen.assess.conflict.types import ConflictType, Responsible, Rule
from bridgegen.base.errors import ScenarioError
from bridgegen.drivers._gap_kernels import leaves_room
from bridgegen.drivers.kinds import LEFT
from bridgegen.engine.options import PipelineOptions
from bridgegen.engine.runner import Runner
from bridgegen.scenario.language.reader import load

SCENARIO = """
scenario: changes
title: The ego changes lanes
description: A car drives on the lane that the ego changes to.
source: Ours.
template: road
roads: {lanes: 2, length: 800.0, speed_limit: 27.8, road_type: motorway, lane_width: 3.5}
duration: 24.0 # s
time_step: 0.05 # s
axes: [participants]
include: [weather]
driver: reference
participants:
  ego:
    type: car
    start: {lane: 2, distance: 40.0}
    end: {lane: 1, distance: 790.0}
    lane_change: {lanes: 1, at: 160.0, within: 320.0}
    speed: 18.0
  other:
    type: car
    start: {lane: 1, distance: other_at}
    speed: other_speed
parameters:
  other_at: {axis: participants, unit: m, low: 0.0, high: 600.0, default: 40.0,
    description: Where the other is, source: Ours.}
  other_speed: {axis: participants, unit: m/s, low: 0.0, high: 27.0, default: 18.0,
    description: The other's, source: Ours.}
objective: harm
"""
LANE = 3.5


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    path = tmp_path_factory.mktemp("changes") / "changes.yaml"
    path.write_text(SCENARIO)
    scenario = load(str(path))
    space = scenario.space()
    made = {}

    def driven(ego, *rows):
        if ego not in made:
            made[ego] = Runner(scenario, space, PipelineOptions(ego=ego, ideal=()))
        return made[ego].run(np.array([space.row(row) for row in rows]))

    return driven


def begins(rollout, row=0):
    """Return where the ego has moved 0.2 m across [m], and its lateral offsets."""
    offset = rollout.offset[row, 0, : rollout.n_steps[row]]
    return rollout.x[row, 0, int(np.argmax(offset > 0.2))], offset


def test_one_that_does_not_look_changes_at_the_start_of_the_stretch(run):
    rollout = run("route-follower", {"other_at": 40.0})
    where, offset = begins(rollout)
    # 4.6 s at the limit are 128 m; a cubic has come 0.2 of 3.5 m after a seventh of that
    assert where == pytest.approx(160.0 + 128.0 / 6.9, abs=4.0)
    assert offset[0] == 0.0
    assert offset[-1] == pytest.approx(LANE, abs=0.05)
    assert not rollout.lamps[0, 0].any()
    assert rollout.v[0, 0].min() > 17.9


@pytest.mark.parametrize("ego", ["reference", "careful"])
def test_one_that_looks_waits_for_a_gap_and_indicates(run, ego):
    rollout = run(ego, {"other_at": 40.0}, {"other_at": 600.0, "other_speed": 27.0})
    where, offset = begins(rollout)
    free, _ = begins(rollout, 1)
    assert free < 190.0 < where < 480.0
    assert offset[-1] == pytest.approx(LANE, abs=0.1)
    gap = np.hypot(
        *(rollout.x[0, :2] - rollout.x[0, 1::-1], rollout.y[0, :2] - rollout.y[0, 1::-1])
    )
    assert gap.min() > 2.0
    moves = int(np.argmax(rollout.offset[1, 0] > 0.2))
    lit = np.flatnonzero(rollout.lamps[1, 0] & LEFT)
    assert (moves - lit[0]) * rollout.time_step >= 3.0  # UN R79, 5.6.4.6
    assert not rollout.lamps[1, 0, -1] & LEFT


def test_it_joins_a_queue_on_the_other_lane_in_comfort(run):
    """It brakes for the one that stands there before it changes lanes."""
    rollout = run("careful", {"other_at": 200.0, "other_speed": 0.0})
    where, _ = begins(rollout)
    assert where < 200.0
    assert rollout.v[0, 0, -1] < 0.1
    assert 1.0 < rollout.x[0, 1, -1] - rollout.x[0, 0, -1] - 4.6 < 4.0
    assert rollout.a[0, 0].min() > -3.0


def test_a_row_has_the_same_bits_in_any_batch(run):
    rows = [{"other_at": at, "other_speed": v} for at in (0.0, 30.0, 90.0) for v in (10.0, 25.0)]
    together = run("reference", *rows)
    for i, row in enumerate(rows):
        alone = run("reference", row)
        for name in ("x", "y", "h", "v", "a", "offset", "lamps"):
            assert np.array_equal(getattr(alone, name)[0], getattr(together, name)[i])


@pytest.mark.parametrize(
    ("ahead", "behind", "needed"),
    [(20.0, 20.0, 20.0), (20.0, 29.0, 0.4 * 9.0 + 81.0 / 6.0 + 20.0), (25.0, 15.0, 15.0)],
)
def test_the_gap_is_the_one_of_un_r79(ahead, behind, needed):
    """UN R79, 5.6.4.7: 0.4 s of the closing speed, its square by 2 · 3 m/s², 1 s of one's own."""
    assert leaves_room(needed + 0.01, ahead, behind, 8.0, 1.0)
    assert not leaves_room(needed - 0.01, ahead, behind, 8.0, 1.0)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("at: 160.0", "at: 30.0", ("30 to 350 m", "its start may be at 40 m")),
        ("within: 320.0", "within: 700.0", ("160 to 860 m", "its end may be at 790 m")),
        ("within: 320.0", "within: 5.0", ("lane_change.within", "15")),
        ("lanes: 1, at", "lanes: 2, at", ("lane_change.lanes",)),
        ("end: {lane: 1,", "end: {lane: 2,", ("a route changes no lane but by lane_change",)),
        ("lanes: 1, at", "lanes: -1, at", ("lane 0 out of leg main",)),
        ("at: 160.0", "at: other_at", ("lane_change.at",)),
        ("type: car\n    start: {lane: 1,", "type: car\n    lane_change: {lanes: 1, within: 50}\n"
         "    start: {lane: 1,", ("for the route of the ego",)),
    ],
)  # fmt: skip
def test_mistakes(tmp_path, old, new, words):
    path = tmp_path / "wrong.yaml"
    assert old in SCENARIO
    path.write_text(SCENARIO.replace(old, new))
    with pytest.raises(ScenarioError) as caught:
        load(str(path))
    for word in words:
        assert word in str(caught.value)
    assert "wrong.yaml, line" in str(caught.value)


PASSES = """
scenario: passes
title: The ego passes a van
description: A van stands in the ego's lane, and one comes.
source: Ours.
template: road
roads:
  {lanes: 1, lanes_against: 1, length: 700.0, speed_limit: 13.9, road_type: town, lane_width: 3.5}
duration: 40.0 # s
time_step: 0.05 # s
axes: [participants]
include: [weather]
driver: reference
others: scripted
participants:
  ego:
    type: car
    start: {lane: 1, distance: 60.0}
    end: {lane: 1, distance: 300.0}
    passes: {around: van}
    speed: 9.0
  van:
    type: van
    start: {lane: 1, distance: 180.0}
    speed: 0.0
  other:
    type: car
    start: {way: in, lane: 1, distance: other_at}
    speed: other_speed
parameters:
  other_at: {axis: participants, unit: m, low: 100.0, high: 650.0, default: 400.0,
    description: Where the other is, source: Ours.}
  other_speed: {axis: participants, unit: m/s, low: 0.0, high: 9.0, default: 9.0,
    description: The other's, source: Ours.}
objective: harm
"""


@pytest.fixture(scope="module")
def passing(tmp_path_factory):
    path = tmp_path_factory.mktemp("passes") / "passes.yaml"
    path.write_text(PASSES)
    scenario = load(str(path))
    space = scenario.space()

    def driven(ego, *rows):
        made = Runner(scenario, space, PipelineOptions(ego=ego, ideal=()))
        return made.run(np.array([space.row(row) for row in rows]))

    return driven


def test_one_that_looks_lets_oncoming_traffic_pass_the_van_first(passing):
    """StVO § 6: it is on the other lane only when the other is past, or so far that it is back."""
    rollout = passing("careful", {"other_at": 330.0}, {"other_at": 110.0}, {"other_at": 650.0})
    x, offset = rollout.x, rollout.offset[:, 0]
    aside = offset > 1.2
    assert not (aside & (x[:, 1] > x[:, 0]) & (x[:, 1] < x[:, 0] + 60.0)).any()
    first, last = aside.argmax(axis=1), rollout.n_steps - 1
    assert x[0, 1, first[0]] < x[0, 0, first[0]]  # it waited
    assert rollout.v[0, 0].min() < 0.1 < 3.0 < rollout.v[1:, 0].min()
    for row in range(3):
        assert offset[row].max() == pytest.approx(LANE, abs=0.1)
        assert offset[row, last[row]] == pytest.approx(0.0, abs=0.1)  # it is back
        assert rollout.x[row, 0, last[row]] > 290.0
    assert not analyse(rollout).kind.any()  # nor is the way round a departure from its lane


def test_one_that_meets_oncoming_traffic_beside_the_van_is_responsible(passing):
    rollout = passing("route-follower", {"other_at": 290.0}, {"other_at": 650.0})
    found = analyse(rollout)
    assert found.type[0, 1] == ConflictType.HEAD_ON
    assert found.responsible[0, 1] == Responsible.EGO
    assert found.rule[0, 1] == Rule.OBSTRUCTION_WAITS
    assert found.preventable[0, 1]
    assert found.at_fault[0].any()
    assert not found.kind[1].any()


def test_one_that_comes_into_the_egos_lane_is_responsible_though_the_ego_passes(passing):
    """The ego, shifted back to its own lane, is not on the other's."""
    rollout = passing("route-follower", {"other_at": 290.0})
    rollout.offset[:] = 0.0
    rollout.y[:, 0] = rollout.y[:, 0, :1]
    rollout.y[:, 1] = rollout.y[:, 0]
    rollout.y[:, 2] = 99.0  # no van
    found = analyse(rollout)
    assert found.responsible[0, 1] == Responsible.OTHER
    assert found.rule[0, 1] == Rule.WRONG_SIDE


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("around: van", "around: vann", ("stands on a lane", "'vann'")),
        ("around: van", "around: other", ("stands on a lane", "'other'")),
        ("around: van", "around: van, before: 200 m", ("its start may be at 60 m",)),
        ("around: van", "around: van, lanes: -1", ("has 1 lanes out, got lane 2",)),
        ("lanes_against: 1", "lanes_against: 0", ("has 0 lanes in, got lane 1",)),
        ("distance: 180.0", "distance: other_at", ("stands on a lane", "'van'")),
    ],
)
def test_mistakes_of_a_way_round(tmp_path, old, new, words):
    path = tmp_path / "wrong.yaml"
    path.write_text(PASSES.replace(old, new))
    with pytest.raises(ScenarioError) as caught:
        load(str(path))
    for word in words:
        assert word in str(caught.value)
