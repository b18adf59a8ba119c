"""MetaDrive's PPO expert: the network that ships in the wheel of ``metadrive-simulator``.

Only the weights are read, with NumPy: MetaDrive itself, which needs panda3d, is not imported, and
``pip install --no-deps metadrive-simulator==0.4.3`` is enough. The network decides each 0.1 s, as
there; its mean action is taken (MetaDrive's ``expert(vehicle, deterministic=True)``). It computes
in float64 where MetaDrive rounds to float32, which changes an action by some 1e-6.

Its actions are steering and throttle or brake, in [-1, 1]. They become a control by the parameters
of MetaDrive's default vehicle (``pg_space.py``, ``vehicle_type.py``) and by the rules of Bullet's
raycast vehicle, with which MetaDrive moves it:

- curvature of the rear axle's path: tan(40° * steering) / 2.469 m;
- throttle: 4 wheels * 800 N * throttle / 1100 kg; above 80 km/h none;
- without any throttle: its brake of 2 N s per wheel and step of 0.02 s, 0.36 m/s²;
- brake: 4 wheels * 150 N s * brake per 0.02 s / 1100 kg: a third of the pedal locks the wheels.

These are what its engine does, measured: 0.87, 2.91, -0.36, -2.73 m/s² for the pedal at 0.3, 1, 0
and -0.1; curvature within 4 % after 0.5 s at 5 m/s. Beyond the tyres' grip ours decide.

It knows neither the speed that the scenario asks of the ego, nor lights, stop lines and right of
way: nothing in MetaDrive's observation stands for them.

`export` has the keys ``time`` (K,) [s], ``speed`` (K,) [m/s] and ``observation`` (K, 275), one row
for each decision; see `bridgegen.adapters.planners._metadrive_observation`.
"""

import math
from collections.abc import Sequence
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from bridgegen.adapters.planners import _metadrive_observation as its
from bridgegen.base.arrays import Float
from bridgegen.base.errors import InputError
from bridgegen.drivers.batches import FixedBatch
from bridgegen.drivers.interface import Control, Observation, Scene
from bridgegen.drivers.planners import Planner, require

PACKAGE, VERSION = "metadrive-simulator", "0.4.3"

PLANNER = Planner(
    name="metadrive-expert",
    description="MetaDrive's PPO expert, a network of two layers that sees 240 beams, four "
    "vehicles and its road; steers, accelerates and brakes; knows no target speed, "
    "at most 80 km/h.",
    spec="bridgegen.adapters.planners.metadrive_expert:MetadriveExpert",
    requires=(f"{PACKAGE}=={VERSION}",),
    licence="Apache-2.0",
    source="Li et al. 2022, MetaDrive: Composing Diverse Driving Scenarios for Generalizable "
    "Reinforcement Learning, IEEE TPAMI; github.com/metadriverse/metadrive",
    how_to_get="--no-deps is enough, for only its weights are read; on Python 3.12 and later add "
    "--ignore-requires-python",
    domain=frozenset({"motorway"}),
)

MAX_BYTES = 8 * 2**20
LAYERS = {"fc_1": (its.SIZE, 256), "fc_2": (256, 256), "fc_out": (256, 4)}

# MetaDrive's default vehicle.
WHEELBASE = 1.05234 + 1.4166  # m
MAX_STEERING = math.radians(40.0)
MASS = 1100.0  # kg
ENGINE_FORCE, BRAKE_IMPULSE = 800.0, 150.0  # N, N s, of a wheel
IDLE_BRAKE_IMPULSE = 2.0  # N s, of a wheel
PHYSICS_STEP = 0.02  # s


class MetadriveExpert:
    """The expert as a driver.

    Attributes:
        seen: ``(N, 275)``, what the network was shown last.

    Raises:
        InputError: the package is not installed, of another version, or without its weights.
    """

    wants = ("lanes",)
    period = its.DECISION
    seen: Float

    def __init__(self) -> None:
        self._network = FixedBatch(Network(weights()))

    def reset(self, n: int, scene: Scene) -> None:
        """See `BatchDriver`."""
        self._scene = scene
        self._action = np.zeros((n, 2))
        self._last_heading: Float | None = None
        self._turned, self._bend = np.zeros(n), np.zeros(n, dtype=np.int64)

    def act(self, observation: Observation) -> Control:
        """See `BatchDriver`."""
        self.seen = self._observe(observation)
        self._action = np.clip(self._network(self.seen), -1.0, 1.0)
        return control(self._action, observation.v)

    def _observe(self, o: Observation) -> Float:
        """Return what the network is shown ``(N, 275)`` at a decision, and remember it."""
        if self._last_heading is None:
            self._last_heading = o.h
        bend, _, _ = its.bends(o.route)
        passed = np.abs(o.route[:, 1, 3]) * o.v * self.period
        self._turned = np.where((bend != 0) & (bend == self._bend), self._turned + passed, 0.0)
        self._bend = bend
        seen = its.observed(o, self._scene.centre, self._turned, self._last_heading, self._action)
        self._last_heading = o.h.copy()
        return seen


class Network:
    """The expert's network, ``(B, 275)`` to the means of its actions ``(B, 2)``."""

    def __init__(self, layers: dict[str, Float]) -> None:
        self._layers = layers

    def __call__(self, seen: Float) -> Float:
        """Return steering and throttle, not yet limited to [-1, 1]."""
        w, x = self._layers, seen.copy()
        x[:, 10], x[:, 15] = 1.0 - x[:, 10], 1.0 - x[:, 15]
        for name in ("fc_1", "fc_2"):
            x = np.tanh(x @ w[f"{name}/kernel"] + w[f"{name}/bias"])
        found: Float = x @ w["fc_out/kernel"] + w["fc_out/bias"]
        return found[:, :2]


def control(action: Float, speed: Float) -> Control:
    """Return the control for actions ``(N, 2)`` at speeds ``(N,)`` [m/s]."""
    steering, pedal = action[:, 0], action[:, 1]
    engine = np.where(speed * 3.6 > its.TOP_SPEED, 0.0, 4 * ENGINE_FORCE * pedal / MASS)
    idle = -4 * IDLE_BRAKE_IMPULSE / PHYSICS_STEP / MASS
    brake = 4 * BRAKE_IMPULSE / PHYSICS_STEP * pedal / MASS
    demanded = np.where(pedal < 0.0, brake, np.where(engine > 0.0, engine, idle))
    return Control(demanded, np.tan(MAX_STEERING * steering) / WHEELBASE)


def weights_file() -> Path:
    """Return where the weights are.

    Raises:
        InputError: the package is not installed, of another version, or without its weights.
    """
    require(PLANNER)
    for file in metadata.files(PACKAGE) or ():
        if file.name == "expert_weights.npz":
            return Path(str(file.locate()))
    raise InputError(f"{PACKAGE} {VERSION} must have the file expert_weights.npz: reinstall it")


def weights() -> dict[str, Float]:
    """Return the network's layers in float64, by names as "fc_1/kernel".

    Raises:
        InputError: as `weights_file`, or the file holds something else.
    """
    path = weights_file()
    layers: dict[str, Float] = {}
    try:
        if path.stat().st_size > MAX_BYTES:
            raise ValueError(f"more than {MAX_BYTES} bytes")
        # Weights are arrays; a pickle among them would be code.
        with np.load(path, allow_pickle=False) as file:
            for name, (rows, columns) in LAYERS.items():
                for part, shape in (("kernel", (rows, columns)), ("bias", (columns,))):
                    layer = file[f"default_policy/{name}/{part}"].astype(np.float64)
                    if layer.shape != shape:
                        raise ValueError(f"{name}/{part} must be {shape}, got {layer.shape}")
                    layers[f"{name}/{part}"] = layer
    except (OSError, ValueError, KeyError) as error:
        raise InputError(f"{path.name} of {PACKAGE} cannot be read: {error}") from error
    return layers


def export(observations: Sequence[Observation], scene: Scene) -> dict[str, npt.NDArray[Any]]:
    """Return what the network was shown in one row, at each of its decisions.

    Args:
        observations: of one row, one for each call of ``act``, with `Lanes`.
        scene: of that row.

    Raises:
        InputError: the package is not installed.
    """
    driver = MetadriveExpert()
    driver.reset(1, scene)
    decisions = []
    for observation in observations:
        driver.act(observation)
        decisions.append((observation.time, observation.v[0], driver.seen[0]))
    times, speeds, seen = zip(*decisions, strict=True)
    return {"time": np.array(times), "speed": np.array(speeds), "observation": np.array(seen)}


def reproduction(observations_path: str) -> str:
    """Return a Python script that prints the expert's actions, without BridgeGen."""
    return _SCRIPT.format(path=observations_path, package=PACKAGE)


_SCRIPT = '''\
"""The actions of MetaDrive's PPO expert for exported observations: steering, throttle.

pip install --no-deps metadrive-simulator==0.4.3
"""

from importlib.metadata import files

import numpy as np

seen = np.load({path!r})
weights = np.load(next(f.locate() for f in files({package!r}) if f.name == "expert_weights.npz"))
x = seen["observation"].copy()
x[:, 10], x[:, 15] = 1 - x[:, 10], 1 - x[:, 15]  # obs_correction
for layer in ("fc_1", "fc_2"):
    name = f"default_policy/{{layer}}/"
    x = np.tanh(x @ weights[name + "kernel"] + weights[name + "bias"])
x = x @ weights["default_policy/fc_out/kernel"] + weights["default_policy/fc_out/bias"]
for time, (steering, throttle) in zip(seen["time"], np.clip(x[:, :2], -1, 1)):
    print(f"{{time:.2f}} s: steering {{steering:.12f}}, throttle {{throttle:.12f}}")
'''
