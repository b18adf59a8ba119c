"""Units are built on the spot, by other people's exporters of FMI 2 and 3."""

import importlib.util
import subprocess
import sys

import numpy as np
import pytest
from tests.approval import refuses

from bridgegen.base.errors import FileFormatError, InputError
from bridgegen.drivers.interface import ROUTE_POINTS, Observation, Scene

missing = importlib.util.find_spec("fmpy") is None
pytestmark = [pytest.mark.fmi, pytest.mark.skipif(missing, reason="the extra 'fmi' is missing")]

UNIT_2 = """
from pythonfmu import Fmi2Causality, Fmi2Slave, Real

class Unit(Fmi2Slave):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.{input} = self.target_speed = self.acceleration = 0.0
        for name in ("{input}", "target_speed"):
            self.register_variable(Real(name, causality=Fmi2Causality.input))
        self.register_variable(Real("{output}", causality=Fmi2Causality.output))

    def do_step(self, time, step):
        self.acceleration = self.target_speed - self.{input}
        return True
"""
UNIT_3 = """
from pythonfmu3 import Float64, Fmi3Causality, Fmi3Slave

class Unit(Fmi3Slave):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.time = self.{input} = self.target_speed = self.acceleration = 0.0
        self.register_variable(Float64("time", causality=Fmi3Causality.independent))
        for name in ("{input}", "target_speed"):
            self.register_variable(Float64(name, causality=Fmi3Causality.input))
        self.register_variable(Float64("{output}", causality=Fmi3Causality.output))

    def do_step(self, time, step):
        self.acceleration = self.target_speed - self.{input}
        return True
"""


@pytest.fixture(scope="module")
def unit(tmp_path_factory):
    def build(version, given="v", output="acceleration"):
        folder = tmp_path_factory.mktemp("unit")
        module = folder.name  # units in Python share one interpreter, and its modules
        text = {2: UNIT_2, 3: UNIT_3}[version].format(input=given, output=output)
        (folder / f"{module}.py").write_text(text)
        exporter = {2: "pythonfmu", 3: "pythonfmu3"}[version]
        command = [sys.executable, "-m", exporter, "build", "-f", f"{module}.py"]
        subprocess.run(command, cwd=folder, check=True, capture_output=True)
        return folder / "Unit.fmu"

    return build


def driven(path, m=1):
    from bridgegen.drivers.fmu import FmuDriver

    one = np.arange(3.0)
    observation = Observation(
        0.0, np.array([True, True, False]), one, one, one, one, one, 2.0 * one + 1.0, one,
        np.zeros((3, ROUTE_POINTS, 4)), np.full((3, m, 13), 7.0), np.full(3, np.inf),
        np.zeros(3, np.int8),
    )  # fmt: skip
    scene = Scene(0.05, 9, ("bv",), np.zeros(m, np.int64), 4.5, 1.8, 1.4, 50.0, 3.0, 8.0, 0.2)
    driver = FmuDriver(path)
    for _ in range(2):
        driver.reset(3, scene)
        control = driver.act(observation)
    return control


@pytest.mark.parametrize("version", [2, 3])
def test_a_unit_drives(unit, version):
    control = driven(unit(version))
    assert control.acceleration.tolist() == [1.0, 2.0, 0.0]  # the last one has ended
    assert control.curvature.tolist() == [0.0, 0.0, 0.0]


def test_a_unit_is_told_of_tracks_and_of_none(unit):
    path = unit(2, given="track_1_vx")
    assert driven(path).acceleration.tolist() == [-6.0, -4.0, 0.0]
    assert driven(path, m=0).acceleration.tolist() == [1.0, 3.0, 0.0]


def test_no_stop_line_is_far_away(unit):
    assert driven(unit(2, given="stop_distance")).acceleration[0] == 1.0 - 1e9


def test_an_unknown_input_or_output_is_refused(unit):
    with refuses(InputError, "speed"):
        driven(unit(2, given="speed"))
    with refuses(InputError):
        driven(unit(2, output="curb"))


def test_what_is_no_unit_is_refused(tmp_path):
    from bridgegen.drivers.fmu import FmuDriver

    path = tmp_path / "unit.fmu"
    for content in (None, b"", b"PK\x03\x04 nonsense"):
        if content is not None:
            path.write_bytes(content)
        with refuses(FileFormatError, "co-simulation"):
            FmuDriver(path)
