"""Rows of a simulator: each by itself, whatever goes wrong in another; and how they end."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bridgegen import drivers as egos
from bridgegen.assess import metrics as measures
from bridgegen.base.errors import InputError
from bridgegen.drivers import DRIVERS
from bridgegen.openx.openscenario.read import read
from bridgegen.simulation.choice import EMBEDDED
from bridgegen.simulation.embedded.simulator import EmbeddedSimulator

from ..embedded.storyboards import (
    after,
    crossroads,
    event,
    friction,
    lane,
    near,
    reaches,
    scenario,
    speed_action,
    start,
)

EGO = Path(__file__).parents[2] / "ego"
FIELDS = ("x", "y", "h", "v", "a", "offset", "n_steps", "status", "began", "distance")
SOUTHBOUND = start("ego", lane(3, 1, 80.0), 10.0, lane(3, 1, 80.0), lane(1, -1, 90.0))
WAITING = start("bv", lane(2, 1, 50.0), 0.0, lane(2, 1, 50.0), lane(4, -1, 90.0))


def declared(**values):
    return "".join(
        f'<ParameterDeclaration name="{name}" parameterType="double" value="{value}"/>'
        for name, value in values.items()
    )


VARIED = scenario(
    ("ego", "bv"),
    start("ego", lane(3, 1, 40.0), "$v", lane(3, 1, 40.0), lane(4, -1, 90.0)) + WAITING,
    event("bv", speed_action("$w", "linear rate 2"), after("${$t + 0.25}"), near("bv", "ego", 30)),
    parameters=declared(v=8, w=4, t=2),
)


def some(n=5):
    rng = np.random.default_rng(7)
    return {"v": rng.uniform(4, 12, n), "w": rng.uniform(1, 8, n), "t": rng.uniform(0, 8, n)}


def taken(values, rows):
    return {name: column[rows] for name, column in values.items()}


@pytest.mark.parametrize("driver", ["route-follower", "reference"])
def test_a_row_is_the_same_to_the_last_bit_whatever_its_batch(contender, driver):
    values = some()
    simulator = contender.made(VARIED, driver)
    roads = simulator.roads([crossroads()] * 2)
    whole = simulator.run(roads, np.array([0, 1, 0, 1, 0]), values)
    for rows in (np.array([4, 2, 0]), np.array([3])):
        part = simulator.run(roads, rows % 2, taken(values, rows))
        for name in FIELDS:
            assert (getattr(part, name) == getattr(whole, name)[rows]).all(), name


@pytest.mark.parametrize(
    "driver", ["route-follower", "reference", "un-r157", "fsm", "careful", "careful-fsm"]
)
def test_metrics_are_those_of_the_embedded_one(contender, driver):
    """Where the bodies are within 0.2 m of each other's place, so are the distances."""
    values = some()
    out = contender.run(VARIED, driver, **values)
    expected = replace(contender, choose=lambda: EMBEDDED).run(VARIED, driver, **values)
    assert out.status.tolist() == expected.status.tolist() == [0] * 5
    names = ("d_min", "n_collision", "v_d", "l_offset")
    got, wanted = (measures.evaluate(one, names) for one in (out, expected))
    tolerance = np.array([0.01 + 10.0 * contender.per_change, 0.0, 0.1, 0.1])
    assert (np.abs(got - wanted) <= tolerance).all()
    assert np.abs(out.n_steps - expected.n_steps).max() <= contender.instants


@pytest.mark.parametrize(
    ("file", "name", "status"),
    [
        ("drivers.py", "FailsFast", 20),
        ("drivers.py", "DiesFast", 22),
        ("drivers.py", "NaNFast", 23),
        ("compiled_drivers.py", "raises_fast", 20),
    ],
)
def test_a_driver_that_fails_costs_its_row(contender, file, name, status):
    text = scenario(("ego",), SOUTHBOUND.replace('value="10.0"', 'value="$v"'), "",
                    parameters=declared(v=6))  # fmt: skip
    out = contender.run(text, f"{EGO / file}:{name}", v=[6.0, 9.0, 5.0])
    assert out.status.tolist() == [0, status, 0]
    assert set(out.messages) == {1}
    assert out.y[0, 0, 100] < out.y[0, 0, 0] - 20.0


def test_a_driver_that_hangs_costs_its_row(contender):
    text = scenario(("ego",), SOUTHBOUND.replace('value="10.0"', 'value="$v"'), "",
                    parameters=declared(v=6))  # fmt: skip
    driver = f"{EGO / 'drivers.py'}:HangsFast"
    storyboard = read(text.encode(), "test.xosc")
    embedded = EmbeddedSimulator(storyboard, "test.xosc", driver=egos.get(driver, time_limit=0.5))
    simulator = contender.choose().around(embedded, storyboard)
    rows = np.zeros(2, dtype=np.int64)
    out = simulator.run(simulator.roads([crossroads()]), rows, {"v": [9.0, 6.0]})
    assert out.status.tolist() == [21, 0]


def test_a_start_off_its_route_is_a_status(contender):
    ego = start("ego", lane(3, 1, "$s"), 10.0, lane(3, 1, 50.0), lane(1, -1, 90.0))
    text = scenario(("ego",), ego, parameters=declared(s=50))
    out = contender.run(text, s=[50.0, 140.0])
    assert out.status.tolist() == [0, 2]


def test_a_road_that_is_not_there_is_an_error(contender):
    lost = start("ego", lane(3, 1, 40.0), 9.0, lane(3, 1, 40.0), lane(77, -1, 50.0))
    with pytest.raises(InputError, match="77"):
        contender.run(scenario(("ego",), lost))


@pytest.mark.parametrize(("rows", "values"), [([1], {}), ([-1], {}), ([0], {"v": [np.nan]})])
def test_what_cannot_be_run_is_an_error(contender, rows, values):
    simulator = contender.made(VARIED)
    with pytest.raises(InputError):
        simulator.run(simulator.roads([crossroads()]), np.array(rows), values)


def test_no_rows_are_a_rollout_of_none(contender):
    out = contender.run(VARIED, v=[])
    assert out.shape[0] == 0


def test_it_stops_where_the_stop_trigger_says(contender):
    stop = reaches("ego", lane(3, 1, 30.0), 2.0)
    out = contender.run(scenario(("ego",), SOUTHBOUND, stop=(stop,)))
    assert abs(int(out.n_steps[0]) - 1 - round(48.0 / 10.0 / 0.05)) <= contender.instants


def test_it_stops_at_the_end_of_the_ego_s_way(contender):
    out = contender.run(scenario(("ego",), start("ego", lane(1, -1, 70.0), 10.0)))
    assert out.n_steps[0] == round(30.0 / 10.0 / 0.05) + 1


def test_an_ego_without_a_driver_is_the_storyboard_s(contender):
    go = event("ego", speed_action(4.0, "linear rate 3"), after(2.0))
    out = contender.run(scenario(("ego", "bv"), SOUTHBOUND + WAITING, go), driver=None)
    t = np.arange(201) * 0.05
    expected = np.clip(10.0 - 3.0 * (t - 2.0), 4.0, 10.0)
    np.testing.assert_allclose(out.v[0, 0], expected, atol=contender.speed)
    way = 10.0 * 2.0 + 14.0 + 4.0 * 6.0  # 2 s, 2 s of braking, 6 s
    assert out.y[0, 0, 0] - out.y[0, 0, -1] == pytest.approx(
        way, abs=contender.place + 6.0 * contender.per_change
    )


def test_another_driver_takes_the_wheel(contender):
    blocked = start("bv", lane(1, -1, 20.0), 0.0)
    text = scenario(("ego", "bv"), SOUTHBOUND.replace('s="80.0"', 's="30.0"') + blocked)
    assert contender.run(text).distance[0, 1].min() == 0.0
    careful = contender.run(text, replay={"driver": DRIVERS["reference"]})
    assert careful.distance[0, 1].min() > 0.5


def test_a_road_can_be_dry(contender):
    fast = start("ego", lane(3, 1, 40.0), 9.0, lane(3, 1, 40.0), lane(4, -1, 90.0))
    text = scenario(("ego",), fast, environment=friction(0.3))
    icy, dry = (contender.run(text, replay={"dry": dry}) for dry in (False, True))
    assert np.abs(icy.offset[0, 0]).max() > np.abs(dry.offset[0, 0]).max() + 0.5
