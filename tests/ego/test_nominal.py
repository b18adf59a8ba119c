"""The reference stack drives the whole catalogue without harm when nothing is adverse."""

import numpy as np
import pytest

from bridgegen import metrics as measures
from bridgegen.odd.reader import load, names
from bridgegen.pipeline import Pipeline

IDEAL = {"perceiving": (), "all ideal": ("perception", "prediction", "control")}


@pytest.mark.parametrize("ideal", IDEAL)
@pytest.mark.parametrize("name", names())
def test_defaults_are_driven_without_harm(name: str, ideal: str) -> None:
    scenario = load(name)
    space = scenario.space()
    pipeline = Pipeline(scenario, space, ego="reference", ideal=IDEAL[ideal])
    rollout = pipeline.rollout(space.row({})[np.newaxis])
    wanted = ("n_collision", "r_red", "l_offset", "d_min")
    found = dict(zip(wanted, measures.evaluate(rollout, wanted)[0], strict=True))
    assert rollout.status[0] == 0
    assert found["n_collision"] == 0
    assert found["r_red"] == 0
    assert found["l_offset"] < 0.5
    assert found["d_min"] > 0.3
    travelled = np.hypot(*np.diff([rollout.x[0, 0], rollout.y[0, 0]], axis=1)).sum()
    assert travelled > 20.0  # standing still would be harmless, too
