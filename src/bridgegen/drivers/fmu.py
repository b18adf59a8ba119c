"""A co-simulation unit (FMI 2.0 or 3.0) as a driver, one instance per scenario.

One that is a traffic participant of OSMP is `bridgegen.drivers.osmp`'s.

Needs the extra ``fmi``. The inputs that the unit has are set by name:

- ``x y h v a target_speed offset stop_distance light`` as in `Observation`; ``stop_distance`` is
  1e9 where there is no stop line;
- ``route_K_x``, ``route_K_y``, ``route_K_h``, ``route_K_curvature`` for K = 0 … P − 1;
- ``track_K_state``, ``track_K_x`` … for K = 1 … M, the other participants in the order of the
  file, with the names of ``TRACK``; a K beyond M reads 0, which is the state "none".

Its outputs ``acceleration`` [m/s²] and ``curvature`` [1/m] are the control; one that it does not
have is 0.

Source: Modelica Association, Functional Mock-up Interface 2.0.5 and 3.0.2.
"""

import re
import shutil
from pathlib import Path
from typing import Any

import numpy as np

from bridgegen.base.arrays import Float
from bridgegen.base.errors import FileFormatError, InputError
from bridgegen.base.extras import require
from bridgegen.drivers.interface import ROUTE_POINTS, Control, Observation, Scene, Trajectory

TRACK = (
    "state",
    "x",
    "y",
    "h",
    "vx",
    "vy",
    "length",
    "width",
    "class",
    "confidence",
    "unseen",
    "age",
    "lamps",
)
_PLAIN = ("x", "y", "h", "v", "a", "target_speed", "offset", "stop_distance", "light")
_ROUTE = ("x", "y", "h", "curvature")
_INDEXED = re.compile(r"(route|track)_(\d{1,4})_([a-z]+)")
_FAR = 1e9
_OUTPUTS = ("acceleration", "curvature")


class FmuDriver:
    """Drives by a co-simulation unit.

    Args:
        path: of the ``.fmu`` file. It holds compiled code, which runs with your rights.

    Raises:
        InputError: the extra is missing, or the name of an input or output is unknown.
        FileFormatError: not a co-simulation unit of FMI 2.0 or 3.0.
    """

    def __init__(self, path: Path | str) -> None:
        self._description = _described(path)
        import fmpy

        try:
            self._folder = fmpy.extract(str(path))
        except Exception as error:
            raise FileFormatError(f"{path}: not a co-simulation unit: {error}") from None
        about = self._description
        if about.coSimulation is None or about.fmiVersion.split(".")[0] not in ("2", "3"):
            raise FileFormatError(
                f"{path}: a co-simulation unit of FMI 2.0 or 3.0 is needed, got FMI "
                f"{about.fmiVersion}{'' if about.coSimulation else ' without co-simulation'}"
            )
        self._units: list[Any] = []
        self._bind(path)

    def _bind(self, path: Path | str) -> None:
        """Find the inputs and outputs that the unit has; raise `InputError`."""
        about = self._description
        self._inputs = {
            variable.name: variable.valueReference
            for variable in about.modelVariables
            if variable.causality == "input"
        }
        outputs = {
            variable.name: variable.valueReference
            for variable in about.modelVariables
            if variable.causality == "output" and variable.name in _OUTPUTS
        }
        self._outputs = outputs
        unknown = [name for name in self._inputs if not _is_known(name)]
        problems = [
            f"{path}: input '{name}' is not one that a driver gets; see bridgegen.drivers.fmu"
            for name in unknown
        ]
        if not outputs:
            problems.append(f"{path}: it must have an output named acceleration or curvature")
        if problems:
            raise InputError(*problems)

    def reset(self, n: int, scene: Scene) -> None:
        """See `BatchDriver`."""
        self._step = scene.time_step
        self._free()
        self._units = [self._instance(i) for i in range(n)]

    def act(self, observation: Observation) -> Control | Trajectory:
        """See `BatchDriver`."""
        n = len(observation.x)
        given = np.array([_values(observation, name) for name in self._inputs]).reshape(-1, n)
        out = np.zeros((2, n))
        for i, unit in enumerate(self._units):
            if observation.running[i]:
                answer = self._one(unit, observation.time, given[:, i])
                for name, value in zip(self._outputs, answer, strict=True):
                    out[_OUTPUTS.index(name), i] = value
        return Control(out[0], out[1])

    def __del__(self) -> None:
        self._free()
        shutil.rmtree(getattr(self, "_folder", ""), ignore_errors=True)

    def _one(self, unit: Any, time: float, values: Float) -> list[float]:
        is_two = hasattr(unit, "setReal")
        write, read = (unit.setReal, unit.getReal) if is_two else (unit.setFloat64, unit.getFloat64)
        if self._inputs:
            write(list(self._inputs.values()), values.tolist())
        unit.doStep(time, self._step)
        return list(read(list(self._outputs.values())))

    def _instance(self, number: int) -> Any:
        from fmpy.fmi2 import FMU2Slave
        from fmpy.fmi3 import FMU3Slave

        about = self._description
        is_two = about.fmiVersion.startswith("2")
        unit = (FMU2Slave if is_two else FMU3Slave)(
            guid=about.guid,
            unzipDirectory=self._folder,
            modelIdentifier=about.coSimulation.modelIdentifier,
            instanceName=f"scenario{number}",
        )
        unit.instantiate()
        if is_two:
            unit.setupExperiment(startTime=0.0)
        unit.enterInitializationMode()
        self._initialise(unit, number)
        unit.exitInitializationMode()
        return unit

    def _initialise(self, unit: Any, number: int) -> None:
        """Set the parameters of the unit of a scenario."""

    def _free(self) -> None:
        for unit in getattr(self, "_units", ()):
            unit.terminate()
            unit.freeInstance()
        self._units = []


def fmu_driver(path: Path | str) -> FmuDriver:
    """Return the driver that a unit is: by messages of OSI if it gives one, else by numbers.

    Raises:
        InputError: the extra is missing, or an input or output is unknown or missing.
        FileFormatError: not a co-simulation unit of FMI 2.0 or 3.0.
    """
    from bridgegen.drivers.osmp import UPDATE, OsmpDriver

    names = [variable.name for variable in _described(path).modelVariables]
    return (OsmpDriver if any(name.startswith(UPDATE) for name in names) else FmuDriver)(path)


def _described(path: Path | str) -> Any:
    """Return a unit's description."""
    require("fmi", "a driver in a .fmu")
    import fmpy

    try:
        return fmpy.read_model_description(str(path), validate=False)
    except Exception as error:
        raise FileFormatError(f"{path}: not a co-simulation unit: {error}") from None


def _is_known(name: str) -> bool:
    match = _INDEXED.fullmatch(name)
    if match is None:
        return name in _PLAIN
    kind, number, column = match.groups()
    if kind == "route":
        return int(number) < ROUTE_POINTS and column in _ROUTE
    return int(number) >= 1 and column in TRACK


def _values(observation: Observation, name: str) -> Float:
    """Return one input of all scenarios, ``(N,)``."""
    match = _INDEXED.fullmatch(name)
    if match is None:
        value = np.asarray(getattr(observation, name), dtype=np.float64)
        return np.where(np.isfinite(value), value, _FAR)
    kind, number, column = match.groups()
    if kind == "route":
        return observation.route[:, int(number), _ROUTE.index(column)]
    if int(number) > observation.tracks.shape[1]:
        return np.zeros(len(observation.x))
    return observation.tracks[:, int(number) - 1, TRACK.index(column)]
