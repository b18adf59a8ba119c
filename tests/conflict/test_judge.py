"""A row that is judged alone, in bundles, has what the analysis finds of it, to the last bit."""

import math
from dataclasses import replace

import numpy as np
import pytest

from bridgegen.assess.conflict._judge_kernels import judge_row
from bridgegen.assess.conflict._measure_kernels import (
    IOU,
    MEASURED,
    implausible_row,
    measure_row,
)
from bridgegen.assess.conflict.analysis import (
    CONTACT,
    IS_SO,
    NUMBERS,
    VIOLATION,
    WHOLES,
    ConflictType,
    analyse,
)
from bridgegen.assess.conflict.judging import facts_of, measuring_of
from bridgegen.assess.conflict.judging import verdict_of as room_of
from bridgegen.assess.conflict.plausibility import plausibility
from bridgegen.assess.metrics import evaluate
from bridgegen.assess.metrics.distances import closest
from bridgegen.base.compiled import bundled, bundled_row, kernel
from bridgegen.drivers.kinds import BICYCLE, CAR
from bridgegen.drivers.lane_tables import CORRIDOR
from bridgegen.engine.options import PipelineOptions
from bridgegen.engine.pipeline import Pipeline
from bridgegen.scenario.language.reader import load
from bridgegen.simulation.embedded._memory_kernels import Record


@kernel
def judge(n_steps, status, path, friction, facts, records, i, verdict):
    record = bundled_row(records, i)
    judge_row(n_steps, status, path, friction, bundled(facts), record, bundled(verdict))


@kernel
def measure(which, n_steps, facts, measuring, records, i, verdict):
    record = bundled_row(records, i)
    given = bundled(facts), bundled(measuring), record, bundled(verdict)
    if which < 0:
        return float(implausible_row(n_steps, *given))
    return measure_row(which, n_steps, *given)


def verdict_of(e, t):
    """A verdict full of what a row before may have left."""
    verdict = room_of(e, t)
    for array in verdict:
        array[...] = math.nan if array.dtype == float else 77
    return verdict


def record_of(rollout):
    """What a simulator records of a rollout."""
    n = rollout.shape[0]
    arrays = {name: getattr(rollout, name) for name in Record._fields}
    for name, number in (("present", np.bool_), ("lamps", np.int8)):
        if not arrays[name].size:
            arrays[name] = np.zeros((n, 0, 0), number)
    if not rollout.detections.size:
        arrays["detections"] = np.zeros((n, 0, 0, 8))
    return Record(**{name: np.ascontiguousarray(array) for name, array in arrays.items()})


def judged(rollout, row, records, corridor, path):
    friction = rollout.friction[row] if rollout.friction.size else math.inf
    facts, verdict = facts_of(rollout, row, corridor), verdict_of(*rollout.shape[1:])
    n_steps, status = int(rollout.n_steps[row]), int(rollout.status[row])
    judge(n_steps, status, path, friction, facts, records, row, verdict)
    assert verdict.is_judged[0] == (facts.own_bodies == 1)
    return verdict


def measured(rollout, row, records, verdict, names):
    """Measure a row that is judged, and compare; returns the code of what is implausible."""
    own = facts_of(rollout, row, np.zeros((0, CORRIDOR))), measuring_of(rollout, row)
    given = int(rollout.n_steps[row]), *own, records, row, verdict
    return measure(-1, *given), [measure(MEASURED.index(name), *given) for name in names]


def agree(rollout, records, corridors, paths):
    """Judge each row, and compare."""
    found = analyse(rollout)
    least, nearest = closest(rollout)
    names = MEASURED if rollout.detections.size else MEASURED[:IOU]
    measures, codes = evaluate(rollout, names), plausibility(rollout).code
    for row in range(rollout.shape[0]):
        verdict = judged(rollout, row, records, corridors[row], int(paths[row]))
        pairs = {name: verdict.whole[:, column] for name, column in WHOLES.items()}
        pairs |= {name: verdict.whole[:, column] > 0 for name, column in IS_SO.items()}
        pairs |= {name: verdict.real[:, column] for name, column in NUMBERS.items()}
        pairs |= {"delta_v_ego": verdict.changes[:, 0], "delta_v_other": verdict.changes[:, 1]}
        for name in ("potential", "severity", "aside", "breach", "at_fault"):
            pairs[name] = getattr(verdict, name)
        for name, array in pairs.items():
            same(array, getattr(found, name)[row], (row, name))
        same(verdict.distance, rollout.distance[row], (row, "distance"))
        same(verdict.least, least[row : row + 1], (row, "least"))
        touches = np.flatnonzero((verdict.distance == 0.0).any(axis=0))
        contact = touches[0] if touches.size and touches[0] < rollout.n_steps[row] else -1
        same(verdict.instants, np.array([contact, nearest[row]]), (row, "instants"))
        if rollout.status[row] == 0:
            code, values = measured(rollout, row, records, verdict, names)
            assert code == codes[row], row
            same(np.array(values) + 0.0, measures[row] + 0.0, (row, names))
    return found


def same(array, wanted, what):
    wanted = np.ascontiguousarray(wanted)
    assert (array.dtype, array.shape) == (wanted.dtype, wanted.shape), what
    assert np.ascontiguousarray(array).tobytes() == wanted.tobytes(), (what, array, wanted)


def corridors_of(rollout):
    nothing = np.zeros((0, CORRIDOR))
    known = rollout.corridor_of if len(rollout.corridor_of) else np.full(rollout.shape[0], -1)
    return [rollout.corridors[of] if of >= 0 else nothing for of in known.tolist()]


def agrees_alone(rollout):
    return agree(
        rollout, record_of(rollout), corridors_of(rollout), np.zeros(rollout.shape[0], int)
    )


@pytest.fixture(scope="module")
def driven():
    """Batches of a scenario's random rows that have run, with their rollouts and roads."""

    def run(name, ego, n=40):
        logical = load(name)
        space = logical.space()
        runner = Pipeline(logical, space, PipelineOptions(ego=ego)).runner
        X = space.decode(np.random.default_rng(3).random((n, space.n_var)))
        for at, one in runner.by_variant(X):
            roads, rows = one.roads_of(X[at])
            batch = one.embedded.batch(roads, rows, one.columns(X[at]))
            yield batch, batch.run(), [roads.corridors([p])[0] for p in rows.tolist()]

    return run


SCENARIOS = (
    "pedestrian-at-night", "cyclist-swings-out", "cyclist-right-turn", "left-across-path",
    "red-light-runner", "emergency-vehicle-on-red", "jam-tail-in-fog", "bus-pulls-out",
    "road-works", "wrong-way-driver", "crossroads-s3", "roundabout-entry",
    "pedestrian-behind-parked",
)  # fmt: skip


@pytest.mark.thorough
@pytest.mark.parametrize("ego", ["route-follower", "reference"])
@pytest.mark.parametrize("name", SCENARIOS)
def test_a_row_alone_has_the_bits_of_the_batch(driven, name, ego):
    """The corridor of its road is always given; a rollout has it only where it matters."""
    conflicts = 0
    for batch, rollout, corridors in driven(name, ego):
        found = agree(rollout, batch.record, corridors, batch.state.on[:, 0])
        conflicts += np.count_nonzero(found.kind)
    assert conflicts or ego == "reference"


def test_what_sensors_see_where_nothing_is_counts_as_in_the_batch(driven):
    ((batch, rollout, corridors),) = driven("phantom-braking", "reference", 10)
    assert rollout.ghosts.any()
    agree(rollout, batch.record, corridors, batch.state.on[:, 0])


@pytest.fixture(scope="module")
def cyclists(driven):
    """Rows in which the ego passes a cyclist, on a road whose corridor is known."""
    ((_, rollout, _),) = driven("cyclist-swings-out", "route-follower")
    return rollout


def test_bodies_that_reverse_for_a_while(cyclists):
    random = np.random.default_rng(0)
    n, e, t = cyclists.shape
    begin, end = np.sort(random.integers(0, t, (2, n, e, 1)), axis=0)
    begin[: n // 2] = 0
    back = (np.arange(t) >= begin) & (np.arange(t) < end) & (random.random((n, e, 1)) < 0.5)
    h, v = np.where(back, cyclists.h + np.pi, cyclists.h), np.where(back, -cyclists.v, cyclists.v)
    v[..., :20] = np.where(random.random((n, e, 1)) < 0.3, -0.02, v[..., :20])
    found = agrees_alone(replace(cyclists, h=h, v=v, a=np.where(back, -cyclists.a, cyclists.a)))
    assert (found.kind == CONTACT).any()


def test_an_ego_that_swerves(cyclists):
    """Off the lane and off the road, in rows that fail, too."""
    random = np.random.default_rng(1)
    n, _, t = cyclists.shape
    left = random.uniform(-6.0, 6.0, (n, 1)) * np.sin(np.arange(t) / random.uniform(20, 90, (n, 1)))
    x, y, offset = (array.copy() for array in (cyclists.x, cyclists.y, cyclists.offset))
    x[:, 0] -= np.sin(cyclists.h[:, 0]) * left
    y[:, 0] += np.cos(cyclists.h[:, 0]) * left
    offset[:, 0] += left
    swerved = replace(
        cyclists,
        x=x,
        y=y,
        offset=offset,
        n_steps=np.maximum(cyclists.n_steps - random.integers(0, 200, n), 1),
        status=(random.random(n) < 0.1).astype(np.int8),
    )
    found = agrees_alone(swerved)
    assert {ConflictType.LANE_DEPARTURE, ConflictType.ROAD_DEPARTURE} <= set(found.type[:, 0])
    assert not found.ok.all()


def test_bodies_that_come_and_go(cyclists):
    random = np.random.default_rng(2)
    n, e, t = cyclists.shape
    there = np.repeat(random.random((n, e, t // 50 + 1)) < 0.7, 50, axis=2)[:, :, :t]
    agrees_alone(replace(cyclists, present=there))


def test_another_path_than_that_of_the_corridor_knows_no_violation(track, meeting):
    """A hand-worked ego 3 m to the left of its route, on a straight road."""
    table = np.full((1, 400, CORRIDOR), 2.0)
    table[0, :, :3] = np.arange(400)[:, None] * (0.5, 0.0, 0.0)
    ego = track(v=10.0)
    ego["offset"] = ego["y"] = np.clip(np.arange(len(ego["x"])) * 0.05 - 1.0, 0.0, 3.0)
    rollout = meeting(
        ego,
        track(x=300.0, v=10.0),
        kinds=[CAR, BICYCLE],
        claims=[0],
        crosswalks=np.zeros((1, 0, 5)),
        corridors=table,
        corridor_of=np.zeros(1, np.int64),
        lights=np.zeros((1, 0, 121), np.int8),
        began=np.zeros((1, 0), np.int64),
    )
    rollout = replace(rollout, stop_lines=np.zeros((1, 0, 3)))
    assert agrees_alone(rollout).kind[0, 0] == VIOLATION
    unknown = replace(rollout, corridor_of=np.full(1, -1))
    agree(unknown, record_of(unknown), [table[0]], [1])


def test_an_ego_with_a_trailer_is_not_judged(cyclists):
    towed = np.array([-1, 0, *[-1] * (cyclists.shape[1] - 2)])
    rollout = replace(cyclists, towed_by=towed)
    verdict = judged(rollout, 0, record_of(rollout), corridors_of(rollout)[0], 0)
    assert not verdict.is_judged[0]
    assert (verdict.whole == 77).all()
