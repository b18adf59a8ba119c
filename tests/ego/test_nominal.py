"""The reference stack drives the whole catalogue without harm when nothing is adverse."""

import numpy as np
import pytest

from bridgegen.assess import metrics as measures
from bridgegen.engine.options import PipelineOptions
from bridgegen.engine.pipeline import Pipeline
from bridgegen.scenario.language.reader import load, names

IDEAL = {"perceiving": (), "all ideal": ("perception", "prediction", "control")}

ROUND = {
    "cut-out": (IDEAL, 1),
    "exit-reactions": (("perceiving",), 1),
    "follower-closes-in": (("all ideal",), 1),
    "jam-tail-in-fog": (("all ideal",), 1),
    "markings-end": (("perceiving",), 1),
    "object-on-road": (IDEAL, 1),
    "wrong-way-driver": (("perceiving",), -1),
}
"""By scenario: the drivers that pass somebody by another lane, and on which side (1 left)."""


@pytest.mark.thorough
@pytest.mark.parametrize("ideal", IDEAL)
@pytest.mark.parametrize("name", names())
def test_defaults_are_driven_without_harm(name: str, ideal: str) -> None:
    scenario = load(name)
    space = scenario.space()
    pipeline = Pipeline(scenario, space, PipelineOptions(ego="reference", ideal=IDEAL[ideal]))
    row = space.row({})
    rollout = pipeline.rollout(row[np.newaxis])
    wanted = ("n_collision", "r_red", "l_offset", "d_min")
    found = dict(zip(wanted, measures.evaluate(rollout, wanted)[0], strict=True))
    assert rollout.status[0] == 0
    assert found["n_collision"] == 0
    assert found["r_red"] == 0
    assert found["d_min"] > 0.3
    drivers, side = ROUND.get(name, ((), 1))
    if ideal in drivers:
        lane = space.values(row)["lane_width"]
        offset = side * rollout.offset[0, 0, : rollout.n_steps[0]]
        beside = offset > 0.5 * lane
        astray = np.minimum(np.abs(offset), np.abs(offset - lane)) > 0.5
        assert beside.any()
        assert np.diff(beside).sum() <= 2  # out, and back
        assert astray.sum() * rollout.time_step < 2 * 5.0  # s, between two lanes
        assert not astray[-1]
        assert -0.5 < offset.min() < offset.max() < lane + 0.5
    elif not scenario.ego.change and not scenario.story.ghosts:  # else it changes lanes
        assert found["l_offset"] < 0.5
    travelled = np.hypot(*np.diff([rollout.x[0, 0], rollout.y[0, 0]], axis=1)).sum()
    assert travelled > 20.0  # standing still would be harmless, too
