"""The contract of simulators: school physics, and rows that depend on themselves alone."""

import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from bridgegen import drivers as egos
from bridgegen.assess import metrics as measures
from bridgegen.base.arrays import Bool, Float, Int
from bridgegen.base.errors import InputError
from bridgegen.drivers import DRIVERS
from bridgegen.drivers.drivers import is_spec
from bridgegen.openx.opendrive.model import OpenDrive
from bridgegen.openx.openscenario.read import read
from bridgegen.openx.source import source_of
from bridgegen.scenario.language.reader import load
from bridgegen.simulation.choice import EMBEDDED, SimulatorChoice
from bridgegen.simulation.embedded.simulator import EmbeddedSimulator
from bridgegen.simulation.rollout import Rollout
from bridgegen.simulation.simulator import Simulator
from bridgegen.testing.storyboards import (
    after,
    condition,
    crossroads,
    event,
    events,
    friction,
    lane,
    lateral,
    near,
    reaches,
    scenario,
    speed_action,
    speeding,
    start,
)

DT = 0.05
T = np.arange(201) * DT
FAILING = Path(__file__).with_name("failing_drivers.py")
FIELDS = ("x", "y", "h", "v", "a", "offset", "n_steps", "status", "began", "distance")
# Road 1 is leg A (south), 2 B (west), 3 C (north), 4 D (east); lane 1 leads in, -1 out. Leg C
# leaves the junction at y = 13; its inner inbound lane's centre is at x = -1.75.
SOUTHBOUND = start("ego", lane(3, 1, 80.0), 10.0, lane(3, 1, 80.0), lane(1, -1, 90.0))
WAITING = start("bv", lane(2, 1, 50.0), 0.0, lane(2, 1, 50.0), lane(4, -1, 90.0))
CRUISING = start("bv", lane(2, 1, 90.0), 8.0, lane(2, 1, 90.0), lane(4, -1, 90.0))

Met = Callable[[Float, Float, Float], Bool]
"""The ego's way [m], its speed [m/s], its distance to the other [m] → where a condition is met."""


def ahead(rollout: Rollout, entity: int = 1) -> Float:
    """Return how far an entity has come eastwards [m]."""
    way: Float = rollout.x[0, entity] - rollout.x[0, entity, 0]
    return way


def lit() -> tuple[OpenDrive, str]:
    """Return the crossroads of a scenario with traffic lights, and the id of a light."""
    logical = load("red-light-runner")
    defaults = {name: parameter.default for name, parameter in logical.parameters.items()}
    roads = source_of(logical, "route-follower").roads(defaults)
    signal, *_ = (signal.id for road in roads.roads for signal in road.signals)
    return roads, signal


def declared(**values: float) -> str:
    """Return the declarations of parameters."""
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


def some(n: int = 5) -> dict[str, Any]:
    """Return n values of the parameters of VARIED."""
    rng = np.random.default_rng(7)
    return {"v": rng.uniform(4, 12, n), "w": rng.uniform(1, 8, n), "t": rng.uniform(0, 8, n)}


def taken(values: Mapping[str, Float], rows: Int) -> dict[str, Float]:
    """Return the values of some rows."""
    return {name: column[rows] for name, column in values.items()}


def is_sound(rollout: Rollout, embedded: EmbeddedSimulator, n: int) -> None:
    """Assert that a rollout is as `Rollout` says, whatever happened in it."""
    names = embedded.program.names
    e, t = len(names), round(embedded.duration / embedded.time_step) + 1
    assert rollout.names == names
    assert rollout.time_step == embedded.time_step
    for name in ("x", "y", "h", "v", "a", "offset"):
        array = getattr(rollout, name)
        assert array.shape == (n, e, t), name
        assert array.dtype == np.float64, name
        assert np.isfinite(array).all(), name
    assert (rollout.v >= 0.0).all()
    assert rollout.n_steps.shape == rollout.status.shape == (n,)
    assert rollout.n_steps.dtype == np.int64
    assert rollout.status.dtype == np.int8
    assert ((rollout.n_steps >= 1) & (rollout.n_steps <= t)).all()
    assert rollout.box.shape == (e, 3)
    assert rollout.began.shape == (n, len(rollout.event_names))
    assert (rollout.began < rollout.n_steps[:, np.newaxis]).all()
    assert rollout.lights.shape == (n, len(rollout.light_names), t)
    assert rollout.lights.dtype == np.int8
    assert set(rollout.messages) <= set(np.flatnonzero(rollout.status).tolist())
    for i, steps in enumerate(rollout.n_steps.tolist()):
        for name in ("x", "y", "h", "v", "offset"):
            last = getattr(rollout, name)[i, :, steps - 1 :]
            assert (last == last[:, :1]).all(), f"{name} after the end"
        assert np.abs(np.diff(rollout.h[i, :, :steps], axis=1)).max(initial=0.0) < np.pi


class SimulatorContract:
    """What every simulator must do; inherit from it, and pytest runs its tests.

    The embedded simulator is exact. Another one may be further from what is worked out by hand;
    how far, the attributes say.

    Attributes:
        simulator: under test; of a plug-in, ``SimulatorChoice("its name")``.
        place: [m] where everything is constant.
        per_change: [m] for each m/s by which a speed changes: half a step, where an entity moves by
            the speed at a step's end and not by the mean.
        speed: [m/s].
        heading: [rad].
        instants: by which an event may begin earlier or later.
    """

    simulator: SimulatorChoice
    place: float = 1e-6
    per_change: float = 1e-9
    speed: float = 1e-9
    heading: float = 1e-6
    instants: int = 0

    def made(
        self,
        text: str,
        driver: str | None = "route-follower",
        simulator: SimulatorChoice | None = None,
        time_limit: float = 5.0,
    ) -> tuple[Simulator[Any], EmbeddedSimulator]:
        """Return the simulator of a storyboard's text, and the embedded one."""
        storyboard = read(text.encode(), "test.xosc")
        limit = time_limit if driver and is_spec(driver) else None
        ego = egos.get(driver, time_limit=limit) if driver else None
        embedded = EmbeddedSimulator(storyboard, "test.xosc", driver=ego)
        return (simulator or self.simulator).around(embedded, storyboard), embedded

    def run(
        self,
        text: str,
        driver: str | None = "route-follower",
        roads: OpenDrive | None = None,
        replay: Mapping[str, Any] | None = None,
        simulator: SimulatorChoice | None = None,
        **values: npt.ArrayLike,
    ) -> Rollout:
        """Return the rollout of a storyboard's text on the crossroads, of sound form."""
        made, embedded = self.made(text, driver, simulator)
        n = len(np.atleast_1d(next(iter(values.values())))) if values else 1
        ready = made.roads([roads or crossroads()])
        rollout = made.run(ready, np.zeros(n, dtype=np.int64), values, **(replay or {}))
        is_sound(rollout, embedded, n)
        return rollout

    def test_constant_speeds(self) -> None:
        out = self.run(scenario(("ego", "bv"), SOUTHBOUND + CRUISING))
        np.testing.assert_allclose(out.x[0, 0], -1.75, atol=self.place)
        np.testing.assert_allclose(out.y[0, 0], 13.0 + 80.0 - 10.0 * T, atol=self.place)
        np.testing.assert_allclose(ahead(out), 8.0 * T, atol=self.place)
        np.testing.assert_allclose(out.y[0, 1], -1.75, atol=self.place)
        np.testing.assert_allclose(out.v[0, 1], 8.0, atol=self.speed)
        np.testing.assert_allclose(out.a[0, :, :-1], 0.0, atol=self.speed / DT)
        turn = np.array([-math.pi / 2, 0.0])
        np.testing.assert_allclose(np.cos(out.h[0, :, 100] - turn), 1.0, atol=self.heading)
        assert out.n_steps[0] == 201

    def test_a_constant_acceleration(self) -> None:
        go = event("bv", speed_action(6.0, "linear rate 3.0"), after(3.0))
        out = self.run(scenario(("ego", "bv"), SOUTHBOUND + WAITING, go))
        np.testing.assert_allclose(out.v[0, 1], np.clip(3.0 * (T - 3.0), 0.0, 6.0), atol=self.speed)
        rising, cruising = np.clip(T - 3.0, 0.0, 2.0), np.clip(T - 5.0, 0.0, None)
        expected = 0.5 * 3.0 * rising**2 + 6.0 * cruising
        np.testing.assert_allclose(ahead(out), expected, atol=self.place + 6.0 * self.per_change)
        np.testing.assert_allclose(out.a[0, 1, 61:99], 3.0, atol=2 * self.speed / DT)
        assert out.began.tolist() == [[60]]

    def test_braking_to_a_stand(self) -> None:
        stop = event("bv", speed_action(0.0, "linear rate 4.0"), after(2.0))
        out = self.run(scenario(("ego", "bv"), SOUTHBOUND + CRUISING, stop))
        assert ahead(out)[-1] == pytest.approx(
            8.0 * 2.0 + 8.0**2 / (2.0 * 4.0), abs=self.place + 8.0 * self.per_change
        )
        assert out.v[0, 1, 80] == pytest.approx(0.0, abs=self.speed)
        assert np.ptp(out.x[0, 1, 81:]) <= self.place
        assert (out.v[0, 1, 81:] <= self.speed).all()

    def test_a_lane_change(self) -> None:
        bv = start("bv", lane(2, 2, 90.0), 10.0)
        change = events(("change", "bv", lateral(1, "sinusoidal time 4.0"), after(1.0)))
        out = self.run(scenario(("ego", "bv"), SOUTHBOUND + bv, change))
        across = out.y[0, 1] - out.y[0, 1, 0]
        assert across[20] == pytest.approx(0.0, abs=0.05)
        assert across[60] == pytest.approx(
            1.75, abs=0.05
        )  # half of the width after half of the time
        assert across[110] == pytest.approx(3.5, abs=0.01)
        expected = 1.75 * (1.0 - np.cos(np.pi * np.clip(T[20:110] - 1.0, 0.0, 4.0) / 4.0))
        np.testing.assert_allclose(across[20:110], expected, atol=0.1)

    def test_a_timed_trajectory(self) -> None:
        def vertex(time: float, x: float, y: float) -> str:
            place = f'<Position><WorldPosition x="{x}" y="{y}" h="0"/></Position>'
            return f'<Vertex time="{time}">{place}</Vertex>'

        follow = f"""<RoutingAction><FollowTrajectoryAction><TimeReference>
<Timing domainAbsoluteRelative="absolute" scale="1" offset="0"/></TimeReference>
<TrajectoryFollowingMode followingMode="position"/><TrajectoryRef><Trajectory name="t"
closed="false"><Shape><Polyline>{vertex(1, -60, -1.75)}{vertex(3, -40, -1.75)}
{vertex(5, -34, -1.75)}</Polyline></Shape></Trajectory></TrajectoryRef></FollowTrajectoryAction>
</RoutingAction>"""
        bv = start("bv", lane(2, 1, 47.0), 0.0)  # x = -13 - 47
        out = self.run(
            scenario(("ego", "bv"), SOUTHBOUND + bv, events(("walk", "bv", follow, after(1.0))))
        )
        k = slice(21, 100)
        expected = np.interp(T, [1.0, 3.0, 5.0], [-60.0, -40.0, -34.0])
        np.testing.assert_allclose(out.x[0, 1, k], expected[k], atol=max(self.place, 1e-9))
        np.testing.assert_allclose(out.v[0, 1, 25:55], 10.0, atol=self.speed)
        np.testing.assert_allclose(out.v[0, 1, 65:95], 3.0, atol=self.speed)

    def test_a_route_through_the_crossroads(self) -> None:
        """Left into leg D: on its lane's centre afterwards, on a way of the expected length."""
        bv = start("bv", lane(1, 1, 40.0), 8.0, lane(1, 1, 40.0), lane(2, -1, 90.0))
        out = self.run(scenario(("ego", "bv"), SOUTHBOUND.replace("80.0", "99.0") + bv))
        way = np.hypot(np.diff(out.x[0, 1]), np.diff(out.y[0, 1])).sum()
        assert way == pytest.approx(80.0, abs=0.1)
        gone = out.x[0, 1] < -14.0  # on leg B
        assert gone.any()
        np.testing.assert_allclose(np.abs(out.y[0, 1, gone]), 1.75, atol=0.01)
        np.testing.assert_allclose(np.cos(out.h[0, 1, gone]), -1.0, atol=1e-3)

    def test_a_start_by_distance(self) -> None:
        go = event("bv", speed_action(5.0), near("bv", "ego", 80.0))
        out = self.run(scenario(("ego", "bv"), SOUTHBOUND + WAITING, go))
        gap = np.hypot(out.x[0, 0] - out.x[0, 1], out.y[0, 0] - out.y[0, 1])
        # bv stands at (-63, -1.75), the ego is at (-1.75, 93 - 10 t): 80 m apart at t = 4.33 s
        first = math.ceil((93.0 + 1.75 - math.sqrt(80.0**2 - 61.25**2)) / 10.0 / DT)
        assert abs(int(np.argmax(gap <= 80.0)) - first) <= self.instants
        assert abs(int(out.began[0, 0]) - first) <= self.instants
        assert abs(int(np.argmax(out.v[0, 1] > 0.0)) - 1 - first) <= self.instants

    @pytest.mark.parametrize(
        ("when", "met"),
        [
            (reaches("ego", lane(3, 1, 30.0), 2.0), lambda way, v, gap: way >= 48.0),
            (
                condition("ego", '<SpeedCondition value="12" rule="greaterThan"/>'),
                lambda way, v, gap: v > 12.0,
            ),
            (
                condition("ego", '<TraveledDistanceCondition value="25"/>'),
                lambda way, v, gap: way >= 25.0,
            ),
            (
                condition(
                    "ego",
                    '<TimeHeadwayCondition entityRef="bv" value="6" freespace="false" '
                    'rule="lessThan" relativeDistanceType="euclidianDistance"/>',
                ),
                lambda way, v, gap: gap / v < 6.0,
            ),
        ],
        ids=["position", "speed", "distance", "headway"],
    )
    def test_what_the_ego_does_is_seen(self, when: str, met: Met) -> None:
        """The ego goes faster from 2 s on, in the route follower's own way."""
        go = events(
            ("hurry", "ego", speeding(14.0, "step time 0"), after(2.0)),
            ("go", "bv", speeding(5.0, "step time 0"), when),
        )
        out = self.run(scenario(("ego", "bv"), SOUTHBOUND + WAITING, go))
        gap = np.hypot(out.x[0, 0] - out.x[0, 1], out.y[0, 0] - out.y[0, 1])
        is_met = met(93.0 - out.y[0, 0], out.v[0, 0], gap)
        assert is_met.any()
        assert abs(int(out.began[0, 1]) - int(np.argmax(is_met))) <= self.instants
        assert out.v[0, 0].max() == pytest.approx(14.0, abs=0.5)

    def test_lights_change(self) -> None:
        roads, signal = lit()

        def light(name: str, seconds: float, state: str) -> str:
            return f"""<ManeuverGroup name="g{name}" maximumExecutionCount="1"><Actors
selectTriggeringEntities="false"/><Maneuver name="m"><Event name="{name}" priority="override"
maximumExecutionCount="1"><Action name="a"><GlobalAction><InfrastructureAction>
<TrafficSignalAction><TrafficSignalStateAction name="{signal}" state="{state}"/>
</TrafficSignalAction></InfrastructureAction></GlobalAction></Action><StartTrigger>
<ConditionGroup>{after(seconds)}</ConditionGroup></StartTrigger></Event></Maneuver>
</ManeuverGroup>"""

        slow = start("ego", lane(3, 1, 30.0), 2.0)
        story = light("red", 1.0, "on;off;off") + light("green", 4.0, "off;off;on")
        out = self.run(scenario(("ego",), slow, story), roads=roads)
        assert out.light_names == (signal,)
        assert out.n_steps[0] == 201
        states = out.lights[0, 0].tolist()
        assert states[22:79] == [1] * 57
        assert states[82:] == [4] * 119
        assert np.abs(out.began[0] - [20, 80]).max() <= self.instants

    @pytest.mark.parametrize("driver", ["route-follower", "reference"])
    def test_a_row_is_the_same_to_the_last_bit_whatever_its_batch(self, driver: str) -> None:
        values = some()
        simulator, _ = self.made(VARIED, driver)
        roads = simulator.roads([crossroads()] * 2)
        whole = simulator.run(roads, np.array([0, 1, 0, 1, 0]), values)
        for rows in (np.array([4, 2, 0]), np.array([3])):
            part = simulator.run(roads, rows % 2, taken(values, rows))
            for name in FIELDS:
                assert (getattr(part, name) == getattr(whole, name)[rows]).all(), name

    @pytest.mark.parametrize(
        "driver", ["route-follower", "reference", "un-r157", "fsm", "careful", "careful-fsm"]
    )
    def test_metrics_are_those_of_the_embedded_one(self, driver: str) -> None:
        """Where the bodies are within 0.2 m of each other's place, so are the distances."""
        values = some()
        out = self.run(VARIED, driver, **values)
        expected = self.run(VARIED, driver, simulator=EMBEDDED, **values)
        assert out.status.tolist() == expected.status.tolist() == [0] * 5
        names = ("d_min", "n_collision", "v_d", "l_offset")
        got, wanted = (measures.evaluate(rollout, names) for rollout in (out, expected))
        tolerance = np.array([0.01 + 10.0 * self.per_change, 0.0, 0.1, 0.1])
        assert (np.abs(got - wanted) <= tolerance).all()
        assert np.abs(out.n_steps - expected.n_steps).max() <= self.instants

    @pytest.mark.parametrize(
        ("name", "status"),
        [("Raises", 20), ("EndsItsProcess", 22), ("AnswersNaN", 23), ("raises", 20)],
    )
    def test_a_driver_that_fails_costs_its_row(self, name: str, status: int) -> None:
        text = scenario(("ego",), SOUTHBOUND.replace('value="10.0"', 'value="$v"'), "",
                        parameters=declared(v=6))  # fmt: skip
        out = self.run(text, f"{FAILING}:{name}", v=[6.0, 9.0, 5.0])
        assert out.status.tolist() == [0, status, 0]
        assert set(out.messages) == {1}
        assert out.y[0, 0, 100] < out.y[0, 0, 0] - 20.0

    def test_a_driver_that_hangs_costs_its_row(self) -> None:
        text = scenario(("ego",), SOUTHBOUND.replace('value="10.0"', 'value="$v"'), "",
                        parameters=declared(v=6))  # fmt: skip
        simulator, _ = self.made(text, f"{FAILING}:Hangs", time_limit=0.5)
        rows = np.zeros(2, dtype=np.int64)
        out = simulator.run(simulator.roads([crossroads()]), rows, {"v": [9.0, 6.0]})
        assert out.status.tolist() == [21, 0]

    def test_a_start_off_its_route_is_a_status(self) -> None:
        ego = start("ego", lane(3, 1, "$s"), 10.0, lane(3, 1, 50.0), lane(1, -1, 90.0))
        text = scenario(("ego",), ego, parameters=declared(s=50))
        out = self.run(text, s=[50.0, 140.0])
        assert out.status.tolist() == [0, 2]

    def test_a_road_that_is_not_there_is_an_error(self) -> None:
        lost = start("ego", lane(3, 1, 40.0), 9.0, lane(3, 1, 40.0), lane(77, -1, 50.0))
        with pytest.raises(InputError, match="77"):
            self.run(scenario(("ego",), lost))

    @pytest.mark.parametrize(("rows", "values"), [([1], {}), ([-1], {}), ([0], {"v": [np.nan]})])
    def test_what_cannot_be_run_is_an_error(
        self, rows: list[int], values: dict[str, list[float]]
    ) -> None:
        simulator, _ = self.made(VARIED)
        with pytest.raises(InputError):
            simulator.run(simulator.roads([crossroads()]), np.array(rows), values)

    def test_no_rows_are_a_rollout_of_none(self) -> None:
        out = self.run(VARIED, v=[])
        assert out.shape[0] == 0

    def test_it_stops_where_the_stop_trigger_says(self) -> None:
        stop = reaches("ego", lane(3, 1, 30.0), 2.0)
        out = self.run(scenario(("ego",), SOUTHBOUND, stop=(stop,)))
        assert abs(int(out.n_steps[0]) - 1 - round(48.0 / 10.0 / 0.05)) <= self.instants

    def test_it_stops_at_the_end_of_the_ego_s_way(self) -> None:
        out = self.run(scenario(("ego",), start("ego", lane(1, -1, 70.0), 10.0)))
        assert out.n_steps[0] == round(30.0 / 10.0 / 0.05) + 1

    def test_an_ego_without_a_driver_is_the_storyboard_s(self) -> None:
        go = event("ego", speed_action(4.0, "linear rate 3"), after(2.0))
        out = self.run(scenario(("ego", "bv"), SOUTHBOUND + WAITING, go), driver=None)
        t = np.arange(201) * 0.05
        expected = np.clip(10.0 - 3.0 * (t - 2.0), 4.0, 10.0)
        np.testing.assert_allclose(out.v[0, 0], expected, atol=self.speed)
        way = 10.0 * 2.0 + 14.0 + 4.0 * 6.0  # 2 s, 2 s of braking, 6 s
        assert out.y[0, 0, 0] - out.y[0, 0, -1] == pytest.approx(
            way, abs=self.place + 6.0 * self.per_change
        )

    def test_another_driver_takes_the_wheel(self) -> None:
        blocked = start("bv", lane(1, -1, 20.0), 0.0)
        text = scenario(("ego", "bv"), SOUTHBOUND.replace('s="80.0"', 's="30.0"') + blocked)
        assert self.run(text).distance[0, 1].min() == 0.0
        careful = self.run(text, replay={"driver": DRIVERS["reference"]})
        assert careful.distance[0, 1].min() > 0.5

    def test_a_road_can_be_dry(self) -> None:
        fast = start("ego", lane(3, 1, 40.0), 9.0, lane(3, 1, 40.0), lane(4, -1, 90.0))
        text = scenario(("ego",), fast, environment=friction(0.3))
        icy, dry = (self.run(text, replay={"dry": dry}) for dry in (False, True))
        assert np.abs(icy.offset[0, 0]).max() > np.abs(dry.offset[0, 0]).max() + 0.5
