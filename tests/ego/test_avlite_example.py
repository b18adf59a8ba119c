"""The example of AVLite's planner: its plans as trajectories; and AVLite itself, if it is there."""

import runpy
from pathlib import Path

import numpy as np
import pytest

from bridgegen.engine.options import PipelineOptions
from bridgegen.engine.pipeline import Pipeline
from bridgegen.scenario.language.reader import load

EXAMPLE = Path(__file__).parents[2] / "docs" / "examples" / "avlite_driver.py"
PATH = np.array([[0.0, 0.0], [2.0, 0.0], [4.0, 0.0], [4.0, 2.0]])


@pytest.mark.parametrize(
    ("speed", "time", "x"),
    [
        # 2 m at 4 m/s, 2 m at 3 m/s on average, and it stands; the rest is not driven.
        ([4.0, 4.0, 2.0, 0.0], [0.0, 0.5, 0.5 + 2 / 3, 2.5 + 2 / 3], [0.0, 2.0, 4.0, 4.0]),
        ([4.0, 0.0, 0.0, 0.0], [0.0, 1.0], [0.0, 2.0]),
        ([0.0, 4.0, 4.0, 4.0], [0.0], [0.0]),
    ],
)
def test_a_path_with_speeds_is_a_trajectory(speed, time, x):
    found = runpy.run_path(str(EXAMPLE))["timed"](PATH, np.array(speed), 0.1)
    n = len(time)
    np.testing.assert_allclose(found.time[:n], time)
    np.testing.assert_allclose(found.x[0, :n], x)
    assert len(found.time) == n + 1
    assert found.v[0, -1] == 0.0
    assert found.h[0, 0] == 0.1


def test_avlite_stops_behind_the_lead():
    pytest.importorskip("avlite")
    logical = load("lead-brakes")
    pipeline = Pipeline(logical, logical.space(), PipelineOptions(ego=f"{EXAMPLE}:Avlite"))
    rollout = pipeline.rollout(pipeline.space.row({})[np.newaxis])
    assert rollout.status.tolist() == [0]
    assert rollout.v[0, 0, int(rollout.n_steps[0]) - 1] < 0.1
