"""The contract of metrics."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from bridgegen.assess.metrics import Metric
from bridgegen.base.arrays import Float
from bridgegen.simulation.rollout import Rollout
from bridgegen.testing.scenes import drive_around, scene_moved

BY_INSTANT = ("x", "y", "h", "v", "a", "offset", "lights", "detections")
BY_ENTITY = ("x", "y", "h", "v", "a", "offset", "detections")


def lengthened(scene: Rollout, steps: int) -> Rollout:
    """Return a scene with more padding after its end: the last instant, again and again."""
    longer: dict[str, Any] = {}
    for name in BY_INSTANT:
        array = getattr(scene, name)
        longer[name] = np.concatenate([array, np.repeat(array[:, :, -1:], steps, axis=2)], axis=2)
    return replace(scene, **longer)


class MetricContract:
    """What every metric must do; inherit from it, and pytest runs its tests.

    A test whose rule a metric cannot keep by design is overridden.

    Attributes:
        metric: under test.
    """

    metric: Metric

    def scene(
        self, n: int = 12, e: int = 3, t: int = 50, seed: int = 0, within: float = 15.0
    ) -> Rollout:
        """Return a rollout in which the metric finds something; by default, random motion.

        Override it if the metric needs what random motion does not have.

        Args:
            n: scenarios.
            e: entities, the ego among them.
            t: instants; scenarios end after 1 to t of them.
            seed: of the chance.
            within: [m] around the origin, where all start.
        """
        return drive_around(n, e, t, seed, within)

    def values(self, rollout: Rollout) -> Float:
        """Return the metric of each scenario, (N,) float64."""
        values = np.asarray(self.metric.compute(rollout), dtype=np.float64)
        assert values.shape == (len(rollout.n_steps),)
        return values

    def test_it_describes_itself(self) -> None:
        assert self.metric.name
        assert self.metric.unit
        assert len(self.metric.description) > 5

    def test_padding_is_not_read(self) -> None:
        before, spoiled = self.values(self.scene()), self.scene()
        for i, n in enumerate(spoiled.n_steps):
            for name in BY_ENTITY:
                getattr(spoiled, name)[i, :, n:] = 1e3 * (i + 1)
            spoiled.lights[i, :, n:] = 1
        np.testing.assert_array_equal(self.values(spoiled), before)

    def test_more_padding_changes_nothing(self) -> None:
        """But for rounding: NumPy adds up more numbers in another order."""
        scene = self.scene()
        here, there = self.values(scene), self.values(lengthened(scene, 30))
        np.testing.assert_allclose(there, here, rtol=1e-12, atol=1e-12)

    def test_it_finds_something_in_the_scenes_of_these_tests(self) -> None:
        values = self.values(self.scene(200))
        finite = values[np.isfinite(values)]
        assert len(finite)
        assert np.ptp(finite) > 0

    def test_a_row_does_not_depend_on_its_batch(self) -> None:
        scene = self.scene(19, 4, 45)
        whole = self.values(scene)
        for rows in ([4], [18, 0, 7, 7], list(range(18, -1, -1))):
            part = self.values(scene.take(np.array(rows)))
            assert part.tobytes() == whole[rows].tobytes()

    def test_failed_scenarios_and_no_others_are_nan(self) -> None:
        good, scene = self.values(self.scene()), self.scene()
        scene.status[[2, 7]] = [1, 2]
        values, failed = self.values(scene), scene.status != 0
        assert np.isnan(values[failed]).all()
        np.testing.assert_array_equal(values[~failed], good[~failed])
        assert not np.isnan(good).any()

    @given(turn=st.floats(-7, 7), dx=st.floats(-1e3, 1e3), dy=st.floats(-1e3, 1e3))
    @settings(deadline=None, suppress_health_check=[HealthCheck.differing_executors])
    def test_turning_and_moving_the_scene_changes_nothing(
        self, turn: float, dx: float, dy: float
    ) -> None:
        scene = self.scene(30)
        here, there = self.values(scene), self.values(scene_moved(scene, turn, dx, dy))
        np.testing.assert_allclose(there, here, rtol=1e-6, atol=1e-9)

    def test_an_absent_entity_does_not_count(self) -> None:
        """Whatever its states are then; and one that is never present, is as good as left out."""
        scene = self.scene(40, 4, within=10.0)
        present = absent_now_and_then(scene)
        expected = self.values(present)
        gone = {
            name: np.where(present.present, getattr(scene, name), 0.7 + 0.1 * getattr(scene, name))
            for name in ("x", "y", "h", "v", "a")
        }
        somewhere = replace(present, **gone)
        np.testing.assert_array_equal(self.values(somewhere), expected)
        first = {name: getattr(somewhere, name)[:, :3] for name in (*BY_ENTITY, "present")}
        without = replace(
            somewhere, **first, box=scene.box[:3], kinds=scene.kinds[:3], names=scene.names[:3]
        )
        np.testing.assert_array_equal(self.values(without), expected)

    @pytest.mark.parametrize("seed", range(4))
    def test_the_order_of_the_others_does_not_matter(self, seed: int) -> None:
        scene = self.scene(40, 5, seed=seed)
        order = np.r_[0, 1 + np.random.default_rng(seed).permutation(4)]
        arrays = {name: getattr(scene, name)[:, order] for name in BY_ENTITY}
        other = replace(scene, box=scene.box[order], kinds=scene.kinds[order], **arrays)
        np.testing.assert_allclose(self.values(other), self.values(scene), rtol=1e-12)


def absent_now_and_then(scene: Rollout) -> Rollout:
    """Return a scene of four entities: the ego, two that come and go, and one that never comes."""
    rng = np.random.default_rng(1)
    n, e, t = scene.x.shape
    present = np.repeat(rng.random((n, e, t // 10)) < 0.7, 10, axis=2)
    present[:, 0] = True
    present[:, 3] = False
    detections = scene.detections.copy()
    detections[~present & (detections[..., 0] > 0), 0] = 0.0  # nothing is seen where nothing is
    return replace(scene, present=present, detections=detections)
