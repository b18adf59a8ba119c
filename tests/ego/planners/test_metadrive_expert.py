"""MetaDrive's expert: its vehicle, its network, and a package that lacks."""

import importlib.util
import subprocess
import sys
from importlib import metadata
from types import ModuleType, SimpleNamespace

import numpy as np
import pytest

from bridgegen.adapters.planners import metadrive_expert
from bridgegen.adapters.planners.metadrive_expert import MetadriveExpert, control
from bridgegen.base.errors import InputError

from .two_lane_road import observation, scene, track


def has_planner() -> bool:
    try:
        return metadata.version(metadrive_expert.PACKAGE) == metadrive_expert.VERSION
    except metadata.PackageNotFoundError:
        return False


# Measured in metadrive-simulator 0.4.3, headless, its vehicle "static_default".
@pytest.mark.parametrize(
    ("pedal", "speed", "acceleration"),
    [(0.3, 10, 0.87), (1.0, 10, 2.91), (0.0, 10, -0.36), (-0.1, 15, -2.73), (0.5, 23, -0.36)],
)
def test_the_pedal_does_what_metadrives_vehicle_does(pedal, speed, acceleration):
    found = control(np.array([[0.0, pedal]]), np.array([float(speed)]))
    assert found.acceleration == pytest.approx([acceleration], abs=0.01)


def test_steering_to_the_left_bends_the_path_as_metadrives_vehicle():
    found = control(np.array([[0.1, 0.0], [-0.1, 0.0]]), np.full(2, 5.0))
    assert found.curvature == pytest.approx([0.0277, -0.0277], rel=0.04)


def test_a_package_that_lacks_is_one_sentence(monkeypatch):
    def none(name):
        raise metadata.PackageNotFoundError(name)

    monkeypatch.setattr("bridgegen.drivers.planners.version", none)
    with pytest.raises(InputError, match=r"metadrive-simulator==0\.4\.3.*pip install") as error:
        MetadriveExpert()
    assert "\n" not in str(error.value)
    monkeypatch.setattr("bridgegen.drivers.planners.version", lambda name: "0.3.0")
    with pytest.raises(InputError, match=r"is 0\.3\.0"):
        MetadriveExpert()


def authors_function(monkeypatch, seen):
    """Return MetaDrive's own expert for observations; its engine is stood in for."""
    stands = {
        "metadrive.engine.logger": {"get_logger": lambda: None},
        "metadrive.engine.engine_utils": {"get_global_config": dict},
        "metadrive.obs.state_obs": {"LidarStateObservation": None},
    }
    for name, content in stands.items():
        module = ModuleType(name)
        vars(module).update(content)
        monkeypatch.setitem(sys.modules, name, module)
    for name in ("metadrive", "metadrive.engine", "metadrive.obs"):
        monkeypatch.setitem(sys.modules, name, ModuleType(name))
    file = metadrive_expert.weights_file().with_name("numpy_expert.py")
    spec = importlib.util.spec_from_file_location("numpy_expert", file)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    with np.load(module.ckpt_path) as weights:
        module._expert_weights = dict(weights)
    found = []
    for one in seen:
        module._expert_observation = SimpleNamespace(observe=lambda vehicle, one=one: one.copy())
        found.append(module.expert(SimpleNamespace(config={}), deterministic=True))
    return np.array(found)


def drive(n: int = 3, calls: int = 5):
    """Return the driver after some calls, and what it saw of the first row."""
    driver = MetadriveExpert()
    driver.reset(n, scene(n))
    tracks = np.array([[track(30.0 + 5.0 * k, 0.5 * k, v=6.0)] for k in range(n)])
    observations = [
        observation(
            *[(0.6 * k, 0.2 * i, 12.0 - 0.1 * k) for i in range(n)], tracks=tracks, time=0.1 * k
        )
        for k in range(calls)
    ]
    controls = [driver.act(one) for one in observations]
    return observations, controls


@pytest.mark.planners
@pytest.mark.skipif(not has_planner(), reason="metadrive-simulator is not installed")
class TestWithItsWeights:
    def test_the_network_is_the_authors_function(self, monkeypatch):
        seen = np.random.default_rng(0).uniform(0.0, 1.0, (70, 275))
        ours = MetadriveExpert()._network(seen)
        theirs = authors_function(monkeypatch, seen)
        assert ours == pytest.approx(theirs, abs=1e-9)
        single = authors_function(monkeypatch, seen.astype(np.float32))
        assert ours == pytest.approx(single, abs=1e-4)  # as MetaDrive rounds

    def test_the_script_prints_what_our_driver_does(self, tmp_path):
        observations, controls = drive(n=1)
        path = tmp_path / "seen.npz"
        np.savez(path, **metadrive_expert.export(observations, scene(1)))
        script = tmp_path / "alone.py"
        script.write_text(metadrive_expert.reproduction(str(path)))
        assert "bridgegen" not in script.read_text()
        done = subprocess.run([sys.executable, script], capture_output=True, text=True, check=True)
        printed = [
            [float(word.strip(",")) for word in line.split()[3::2]]
            for line in done.stdout.splitlines()
        ]
        alone = control(np.array(printed), np.array([one.v[0] for one in observations]))
        assert len(printed) == 5 == len(controls)
        for name in ("acceleration", "curvature"):
            ours = np.array([getattr(one, name)[0] for one in controls])
            assert getattr(alone, name) == pytest.approx(ours, abs=1e-9)

    def test_a_row_does_not_depend_on_the_batch(self):
        observations, controls = drive(n=3)
        alone = MetadriveExpert()
        alone.reset(1, scene(1))
        for one, whole in zip(observations, controls, strict=True):
            found = alone.act(one.take(slice(2, 3)))
            assert np.asarray(found.curvature).tobytes() == whole.curvature[2:].tobytes()
            assert np.asarray(found.acceleration).tobytes() == whole.acceleration[2:].tobytes()
