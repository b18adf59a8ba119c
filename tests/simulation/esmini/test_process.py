"""Processes in which a stand-in of esmini runs rows: what goes wrong costs the row, and no more."""

import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest
from tests.approval import refuses

from bridgegen.base.errors import InputError
from bridgegen.base.processes.isolated import CallError
from bridgegen.drivers import DRIVERS
from bridgegen.engine.simulate import simulate_file
from bridgegen.openx.opendrive.write import to_xml
from bridgegen.openx.openscenario.read import read
from bridgegen.simulation.embedded.simulator import EmbeddedSimulator
from bridgegen.simulation.esmini import process
from bridgegen.simulation.esmini.simulator import EsminiSimulator

from ..embedded.storyboards import (
    crossroads,
    event,
    lane,
    near,
    reaches,
    scenario,
    speed_action,
    start,
)

pytestmark = pytest.mark.thorough

LOGS, REFUSES, HANGS, DIES, NAN, HANGS_AT_ONCE = 1.0, 2.0, 3.0, 4.0, 5.0, 6.0  # see the stand-in
TEXT = scenario(
    ("ego", "bv"),
    start("ego", lane(3, 1, 40.0), "$v", lane(3, 1, 40.0), lane(4, -1, 90.0))
    + start("bv", lane(2, 1, 50.0), 0.0, lane(2, 1, 50.0), lane(4, -1, 90.0)),
    event("bv", speed_action("${$v / 2}", "linear rate 2"), near("bv", "ego", 60.0)),
    stop=(reaches("ego", lane(4, -1, 30.0), 5.0),),
    parameters="".join(
        f'<ParameterDeclaration name="{name}" parameterType="double" value="{value}"/>'
        for name, value in (("v", 8), ("fault", 0))
    ),
)


def made(library, steps=1, seconds=30.0, others=None, text=TEXT):
    storyboard = read(text.encode(), "test.xosc")
    embedded = EmbeddedSimulator(
        storyboard, "test.xosc", driver=DRIVERS["route-follower"], others=others
    )
    return EsminiSimulator(embedded, storyboard, library, steps=steps, seconds=seconds)


@pytest.fixture
def library(monkeypatch, tmp_path):
    monkeypatch.syspath_prepend(str(Path(__file__).parent))
    monkeypatch.setattr(process, "PROGRAM", "stand_in_esmini")
    warm = tmp_path / "warm.xosc"
    warm.write_text(TEXT)
    (tmp_path / "map.xodr").write_bytes(to_xml(crossroads()))
    assert simulate_file(warm, ego="route-follower").status == "ok"  # compiles, where need be
    return tmp_path / "stand-in.so"


@pytest.mark.parametrize("steps", [1, 4])
def test_what_it_plays_is_what_is_recorded(library, steps):
    """Its participants, the ego that is driven here, events and the end: as in the embedded one."""
    simulator = made(library, steps)
    assert simulator.version == "stand-in 3.0"
    roads, rows = simulator.roads([crossroads()] * 2), np.array([0, 1, 0])
    values = {"v": [8.0, 6.0, 10.0]}
    out = simulator.run(roads, rows, values)
    expected = simulator.embedded.run(roads.network, rows, values)
    assert out.status.tolist() == [0, 0, 0], out.messages
    for name in ("n_steps", "began"):
        np.testing.assert_array_equal(getattr(out, name), getattr(expected, name), name)
    for name in ("x", "y", "h", "v", "a", "offset"):
        np.testing.assert_allclose(
            getattr(out, name), getattr(expected, name), atol=1e-6, err_msg=name
        )


def test_an_attentive_participant_is_driven_as_the_ego_is(library):
    """The stand-in moves it as its script says; what is recorded is what our driver does."""
    text = TEXT.replace("${$v / 2}", "${1.2 * $v}").replace('value="60.0"', 'value="200.0"')
    simulator = made(library, others="attentive", text=text)
    roads = simulator.roads([crossroads()])
    rows, values = np.zeros(2, dtype=np.int64), {"v": [8.0, 11.0]}
    found = simulator.run(roads, rows, values)
    expected = simulator.embedded.run(roads.network, rows, values)
    scripted = made(library, others="scripted", text=text)
    scripted = scripted.embedded.run(roads.network, rows, values)
    assert found.status.tolist() == [0, 0], found.messages
    for name in ("x", "y", "h", "v", "began", "n_steps"):
        assert np.array_equal(getattr(found, name), getattr(expected, name)), name
    assert np.abs(scripted.x[:, 1] - expected.x[:, 1]).max() > 1.0


def test_what_goes_wrong_costs_the_row(library):
    simulator = made(library, seconds=2.0)
    roads = simulator.roads([crossroads()])
    faults = [0.0, LOGS, 0.0, REFUSES, DIES, NAN, HANGS, 0.0]
    out = simulator.run(roads, np.zeros(len(faults), dtype=np.int64), {"fault": faults})
    assert out.status.tolist() == [0, 40, 0, 40, 41, 40, 42, 0]
    assert out.messages == {
        1: "Unexpected",
        3: "esmini did not take the scenario: Failed to load OpenDRIVE file",
        4: "its process ended with status 7",
        5: "a state of 'bv' became NaN or infinite",
        6: "no answer within 2 s",
    }
    for i in (2, 7):
        np.testing.assert_array_equal(out.x[i], out.x[0])
    assert np.isfinite(out.x).all()


def test_who_stops_it_waits_no_longer(library):
    simulator = made(library)
    roads = simulator.roads([crossroads()])
    threading.Timer(1.0, simulator.stop).start()
    with pytest.raises(CallError, match="ended"):
        simulator.run(roads, np.zeros(1, dtype=np.int64), {"fault": [HANGS_AT_ONCE]})


def test_whoever_is_killed_leaves_nothing_behind(library, tmp_path):
    """The processes of a killed one end by themselves, and take their files with them."""
    temporary = tmp_path / "temporary"
    temporary.mkdir()
    script = tmp_path / "killed.py"
    script.write_text(
        "import os, signal\n"
        "from pathlib import Path\n"
        "import numpy as np\n"
        "from bridgegen.drivers import DRIVERS\n"
        "from bridgegen.openx.prepared import roads_of\n"
        "from bridgegen.openx.openscenario.read import read\n"
        "from bridgegen.simulation.embedded.simulator import EmbeddedSimulator\n"
        "from bridgegen.simulation.esmini import process\n"
        "from bridgegen.simulation.esmini.simulator import EsminiSimulator\n"
        "process.PROGRAM = 'stand_in_esmini'\n"
        f"path = Path({str(tmp_path / 'warm.xosc')!r})\n"
        "scenario = read(path)\n"
        "embedded = EmbeddedSimulator(scenario, 'x', driver=DRIVERS['route-follower'])\n"
        f"one = EsminiSimulator(embedded, scenario, Path({str(library)!r}), steps=1)\n"
        "roads = one.roads([roads_of(scenario, path)])\n"
        "assert one.run(roads, np.zeros(1, dtype=np.int64), {}).status[0] == 0\n"
        f"assert len(os.listdir({str(temporary)!r})) == 3\n"
        "os.killpg(0, signal.SIGKILL)\n"
    )
    path = os.pathsep.join(["", *sys.path])
    done = subprocess.run(
        [sys.executable, str(script)], start_new_session=True, timeout=120,
        env=os.environ | {"PYTHONPATH": path, "TMPDIR": str(temporary)},
    )  # fmt: skip
    assert done.returncode == -signal.SIGKILL
    for _ in range(100):
        if not os.listdir(temporary):
            return
        time.sleep(0.1)
    pytest.fail(f"it leaves {os.listdir(temporary)}")


def test_a_library_that_is_none_is_refused_before_any_row(library):
    with refuses(InputError, "stand-in"):
        made(library.with_name("other.so"))
