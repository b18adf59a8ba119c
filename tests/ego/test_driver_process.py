from pathlib import Path

import numpy as np
import pytest
from tests.approval import refuses

from bridgegen.base.errors import InputError
from bridgegen.drivers.driver_process import DriverError, DriverProcess
from bridgegen.drivers.drivers import is_spec
from bridgegen.drivers.interface import ROUTE_POINTS, Observation, Scene

DRIVERS = Path(__file__).with_name("drivers.py")
N = 3


def scene():
    return Scene(0.05, 400, ("bv",), np.zeros(1, np.int64), 4.5, 1.8, 1.4, 50.0, 3.0, 8.0, 0.2)


def observation(running=(True, True, True)):
    one = np.arange(N, dtype=np.float64)
    return Observation(
        time=0.0, running=np.array(running), x=one, y=one, h=one, v=one, a=one,
        target_speed=one + 1.0, offset=one, route=np.zeros((N, ROUTE_POINTS, 4)),
        tracks=np.zeros((N, 1, 12)), stop_distance=np.full(N, np.inf), light=np.zeros(N, np.int8),
    )  # fmt: skip


@pytest.fixture
def process():
    made = []

    def make(name, **kwargs):
        made.append(DriverProcess(f"{DRIVERS}:{name}", **kwargs))
        return made[-1]

    yield make
    for one in made:
        one.close()


@pytest.mark.parametrize("name", ["Cruises", "Prints"])
def test_a_driver_answers_again_and_again(process, name):
    driver = process(name)
    driver.reset(N, scene())
    for _ in range(3):
        acceleration, curvature = driver.act(observation())
        assert acceleration.tolist() == [1.0, 1.0, 1.0]
        assert curvature.tolist() == [0.0, 0.0, 0.0]


@pytest.mark.parametrize(("set_to", "taken"), [(None, 1.0), ("3", 3.0)])
def test_libraries_take_one_thread_unless_the_user_says_otherwise(
    process, monkeypatch, set_to, taken
):
    monkeypatch.delenv("OPENBLAS_NUM_THREADS", raising=False)
    if set_to:
        monkeypatch.setenv("OPENBLAS_NUM_THREADS", set_to)
    driver = process("TellsThreads")
    driver.reset(N, scene())
    assert driver.act(observation())[0].tolist() == [taken] * N


@pytest.mark.parametrize(
    ("name", "kind", "message"),
    [
        ("Raises", "raised", "ValueError"),
        ("Hangs", "timed out", "0.5 s"),
        ("Dies", "died", "status"),
        ("AnswersNaN", "answered nonsense", "acceleration"),
        ("AnswersOneNumber", "answered nonsense", "shape"),
        ("AnswersNothing", "answered nonsense", "Control"),
    ],
)
def test_a_bad_driver_costs_an_error_and_can_be_asked_again(process, name, kind, message):
    driver = process(name, time_limit=0.5)
    for _ in range(2):
        driver.reset(N, scene())
        with refuses(DriverError, message) as error:
            driver.act(observation())
        assert error.value.kind == kind


def test_what_is_answered_for_an_ended_scenario_is_not_looked_at(process):
    driver = process("AnswersNaN")
    driver.reset(N, scene())
    acceleration, _ = driver.act(observation(running=(False, False, False)))
    assert acceleration.tolist() == [0.0, 0.0, 0.0]


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("CannotBeMade", "drivers.py"),
        ("LacksAct", "methods"),
        ("NoSuch", "NoSuch"),
    ],
)
def test_a_driver_that_cannot_be_made_is_an_error_of_the_users(process, name, message):
    with refuses(InputError, message):
        process(name).start()


@pytest.mark.parametrize("spec", ["no.such.module:Driver", "no_such.py:Driver", "no_such.fmu"])
def test_a_module_that_is_not_there(spec):
    if spec.endswith(".fmu"):
        pytest.importorskip("fmpy")
    with refuses(InputError):
        DriverProcess(spec).start()


@pytest.mark.parametrize("spec", ["", "reference", "a.b", ":Driver", "a:", "a:b c", "a:1"])
def test_what_is_no_name_of_a_driver(spec):
    assert not is_spec(spec)
    with pytest.raises(InputError, match="is named"):
        DriverProcess(spec)


@pytest.mark.parametrize("limit", [0.0, -1.0, float("inf"), float("nan")])
def test_a_time_limit_is_a_time(limit):
    with pytest.raises(InputError, match="time limit"):
        DriverProcess("a:B", time_limit=limit)


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("WantsWrong", "mop"),
        ("WantsAString", "wants"),
    ],
)
def test_what_a_driver_wants_must_be_known(name, message):
    driver = DriverProcess(f"{DRIVERS.with_name('wanting_drivers.py')}:{name}")
    with refuses(InputError, message):
        driver.start()
    driver.close()


def test_a_driver_says_what_it_wants(process):
    driver = DriverProcess(f"{DRIVERS.with_name('wanting_drivers.py')}:Lanes")
    driver.start()
    assert driver.traits.wants == ("lanes",)
    assert driver.traits.memory is None
    driver.close()
    plain = process("Cruises")
    plain.start()
    assert plain.traits.wants == ()
