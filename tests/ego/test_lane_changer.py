"""The example that changes lane drives the motorway scenarios, and passes where it pays."""

from pathlib import Path

import numpy as np
import pytest

from .wanting import pipeline_of

DRIVER = Path(__file__).parents[2] / "docs/examples/my_lane_changer.py"


@pytest.mark.parametrize(
    ("scenario", "changes"),
    [
        ("cut-in", True), ("cut-out", True), ("jam-tail-in-fog", True), ("motorway-merge", True),
        ("road-works", True), ("lead-brakes", False), ("stopped-after-curve", False),
    ],
)  # fmt: skip
def test_it_drives_and_changes_lane_where_it_pays(scenario, changes):
    pipeline = pipeline_of(scenario, ego=f"{DRIVER}:MyLaneChanger")
    X = pipeline.space.decode(np.random.default_rng(4).random((16, pipeline.space.n_var)))
    rollout = pipeline.rollout(X)
    assert (rollout.status == 0).all()
    offset = np.abs(rollout.offset[:, 0])
    # A lane is 3.5 to 3.75 m wide; lead-brakes and stopped-after-curve have one.
    assert (offset.max(axis=1) > 3.0).any() == changes
    assert offset.max() < 4.5
    assert np.abs(rollout.a[:, 0]).max() < 10.0
