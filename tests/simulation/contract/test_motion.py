"""What every simulator makes of small scenarios: school physics."""

import math

import numpy as np
import pytest

from bridgegen.openx.source import source_of
from bridgegen.scenario.language.reader import load

from ..embedded.storyboards import (
    after,
    condition,
    event,
    events,
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
# Road 1 is leg A (south), 2 B (west), 3 C (north), 4 D (east); lane 1 leads in, -1 out. Leg C
# leaves the junction at y = 13; its inner inbound lane's centre is at x = -1.75.
SOUTHBOUND = start("ego", lane(3, 1, 80.0), 10.0, lane(3, 1, 80.0), lane(1, -1, 90.0))
WAITING = start("bv", lane(2, 1, 50.0), 0.0, lane(2, 1, 50.0), lane(4, -1, 90.0))
CRUISING = start("bv", lane(2, 1, 90.0), 8.0, lane(2, 1, 90.0), lane(4, -1, 90.0))


def ahead(rollout, entity=1):
    """How far somebody has come eastwards [m]."""
    return rollout.x[0, entity] - rollout.x[0, entity, 0]


def test_constant_speeds(contender):
    out = contender.run(scenario(("ego", "bv"), SOUTHBOUND + CRUISING))
    np.testing.assert_allclose(out.x[0, 0], -1.75, atol=contender.place)
    np.testing.assert_allclose(out.y[0, 0], 13.0 + 80.0 - 10.0 * T, atol=contender.place)
    np.testing.assert_allclose(ahead(out), 8.0 * T, atol=contender.place)
    np.testing.assert_allclose(out.y[0, 1], -1.75, atol=contender.place)
    np.testing.assert_allclose(out.v[0, 1], 8.0, atol=contender.speed)
    np.testing.assert_allclose(out.a[0, :, :-1], 0.0, atol=contender.speed / DT)
    turn = np.array([-math.pi / 2, 0.0])
    np.testing.assert_allclose(np.cos(out.h[0, :, 100] - turn), 1.0, atol=contender.heading)
    assert out.n_steps[0] == 201


def test_a_constant_acceleration(contender):
    go = event("bv", speed_action(6.0, "linear rate 3.0"), after(3.0))
    out = contender.run(scenario(("ego", "bv"), SOUTHBOUND + WAITING, go))
    np.testing.assert_allclose(
        out.v[0, 1], np.clip(3.0 * (T - 3.0), 0.0, 6.0), atol=contender.speed
    )
    rising, cruising = np.clip(T - 3.0, 0.0, 2.0), np.clip(T - 5.0, 0.0, None)
    expected = 0.5 * 3.0 * rising**2 + 6.0 * cruising
    np.testing.assert_allclose(
        ahead(out), expected, atol=contender.place + 6.0 * contender.per_change
    )
    np.testing.assert_allclose(out.a[0, 1, 61:99], 3.0, atol=2 * contender.speed / DT)
    assert out.began.tolist() == [[60]]


def test_braking_to_a_stand(contender):
    stop = event("bv", speed_action(0.0, "linear rate 4.0"), after(2.0))
    out = contender.run(scenario(("ego", "bv"), SOUTHBOUND + CRUISING, stop))
    assert ahead(out)[-1] == pytest.approx(
        8.0 * 2.0 + 8.0**2 / (2.0 * 4.0), abs=contender.place + 8.0 * contender.per_change
    )
    assert out.v[0, 1, 80] == pytest.approx(0.0, abs=contender.speed)
    assert np.ptp(out.x[0, 1, 81:]) <= contender.place
    assert (out.v[0, 1, 81:] <= contender.speed).all()


def test_a_lane_change(contender):
    bv = start("bv", lane(2, 2, 90.0), 10.0)
    change = events(("change", "bv", lateral(1, "sinusoidal time 4.0"), after(1.0)))
    out = contender.run(scenario(("ego", "bv"), SOUTHBOUND + bv, change))
    across = out.y[0, 1] - out.y[0, 1, 0]
    assert across[20] == pytest.approx(0.0, abs=0.05)
    assert across[60] == pytest.approx(1.75, abs=0.05)  # half of the width after half of the time
    assert across[110] == pytest.approx(3.5, abs=0.01)
    expected = 1.75 * (1.0 - np.cos(np.pi * np.clip(T[20:110] - 1.0, 0.0, 4.0) / 4.0))
    np.testing.assert_allclose(across[20:110], expected, atol=0.1)


def test_a_timed_trajectory(contender):
    def vertex(time, x, y):
        place = f'<Position><WorldPosition x="{x}" y="{y}" h="0"/></Position>'
        return f'<Vertex time="{time}">{place}</Vertex>'

    follow = f"""<RoutingAction><FollowTrajectoryAction><TimeReference>
<Timing domainAbsoluteRelative="absolute" scale="1" offset="0"/></TimeReference>
<TrajectoryFollowingMode followingMode="position"/><TrajectoryRef><Trajectory name="t"
closed="false"><Shape><Polyline>{vertex(1, -60, -1.75)}{vertex(3, -40, -1.75)}
{vertex(5, -34, -1.75)}</Polyline></Shape></Trajectory></TrajectoryRef></FollowTrajectoryAction>
</RoutingAction>"""
    bv = start("bv", lane(2, 1, 47.0), 0.0)  # x = -13 - 47
    out = contender.run(
        scenario(("ego", "bv"), SOUTHBOUND + bv, events(("walk", "bv", follow, after(1.0))))
    )
    k = slice(21, 100)
    expected = np.interp(T, [1.0, 3.0, 5.0], [-60.0, -40.0, -34.0])
    np.testing.assert_allclose(out.x[0, 1, k], expected[k], atol=max(contender.place, 1e-9))
    np.testing.assert_allclose(out.v[0, 1, 25:55], 10.0, atol=contender.speed)
    np.testing.assert_allclose(out.v[0, 1, 65:95], 3.0, atol=contender.speed)


def test_a_route_through_the_crossroads(contender):
    """Left into leg D: on its lane's centre afterwards, and the way is as long as it was driven."""
    bv = start("bv", lane(1, 1, 40.0), 8.0, lane(1, 1, 40.0), lane(2, -1, 90.0))
    out = contender.run(scenario(("ego", "bv"), SOUTHBOUND.replace("80.0", "99.0") + bv))
    way = np.hypot(np.diff(out.x[0, 1]), np.diff(out.y[0, 1])).sum()
    assert way == pytest.approx(80.0, abs=0.1)
    gone = out.x[0, 1] < -14.0  # on leg B
    assert gone.any()
    np.testing.assert_allclose(np.abs(out.y[0, 1, gone]), 1.75, atol=0.01)
    np.testing.assert_allclose(np.cos(out.h[0, 1, gone]), -1.0, atol=1e-3)


def test_a_start_by_distance(contender):
    go = event("bv", speed_action(5.0), near("bv", "ego", 80.0))
    out = contender.run(scenario(("ego", "bv"), SOUTHBOUND + WAITING, go))
    gap = np.hypot(out.x[0, 0] - out.x[0, 1], out.y[0, 0] - out.y[0, 1])
    # bv stands at (-63, -1.75), the ego is at (-1.75, 93 - 10 t): 80 m apart at t = 4.33 s
    first = math.ceil((93.0 + 1.75 - math.sqrt(80.0**2 - 61.25**2)) / 10.0 / DT)
    assert abs(int(np.argmax(gap <= 80.0)) - first) <= contender.instants
    assert abs(int(out.began[0, 0]) - first) <= contender.instants
    assert abs(int(np.argmax(out.v[0, 1] > 0.0)) - 1 - first) <= contender.instants


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
                '<TimeHeadwayCondition entityRef="bv" value="6" freespace="false" rule="lessThan" '
                'relativeDistanceType="euclidianDistance"/>',
            ),
            lambda way, v, gap: gap / v < 6.0,
        ),
    ],
    ids=["position", "speed", "distance", "headway"],
)
def test_what_the_ego_does_is_seen(contender, when, met):
    """The ego goes faster from 2 s on, in the route follower's own way."""
    go = events(
        ("hurry", "ego", speeding(14.0, "step time 0"), after(2.0)),
        ("go", "bv", speeding(5.0, "step time 0"), when),
    )
    out = contender.run(scenario(("ego", "bv"), SOUTHBOUND + WAITING, go))
    gap = np.hypot(out.x[0, 0] - out.x[0, 1], out.y[0, 0] - out.y[0, 1])
    is_met = met(93.0 - out.y[0, 0], out.v[0, 0], gap)
    assert is_met.any()
    assert abs(int(out.began[0, 1]) - int(np.argmax(is_met))) <= contender.instants
    assert out.v[0, 0].max() == pytest.approx(14.0, abs=0.5)


def test_lights_change(contender):
    roads, signal = lit()

    def light(name, seconds, state):
        return f"""<ManeuverGroup name="g{name}" maximumExecutionCount="1"><Actors
selectTriggeringEntities="false"/><Maneuver name="m"><Event name="{name}" priority="override"
maximumExecutionCount="1"><Action name="a"><GlobalAction><InfrastructureAction>
<TrafficSignalAction><TrafficSignalStateAction name="{signal}" state="{state}"/>
</TrafficSignalAction></InfrastructureAction></GlobalAction></Action><StartTrigger>
<ConditionGroup>{after(seconds)}</ConditionGroup></StartTrigger></Event></Maneuver>
</ManeuverGroup>"""

    slow = start("ego", lane(3, 1, 30.0), 2.0)
    story = light("red", 1.0, "on;off;off") + light("green", 4.0, "off;off;on")
    out = contender.run(scenario(("ego",), slow, story), roads=roads)
    assert out.light_names == (signal,)
    assert out.n_steps[0] == 201
    states = out.lights[0, 0].tolist()
    assert states[22:79] == [1] * 57
    assert states[82:] == [4] * 119
    assert np.abs(out.began[0] - [20, 80]).max() <= contender.instants


def lit():
    """The crossroads of a scenario with traffic lights, and the id of one."""
    logical = load("red-light-runner")
    defaults = {name: one.default for name, one in logical.parameters.items()}
    roads = source_of(logical, "route-follower").roads(defaults)
    signal, *_ = (one.id for road in roads.roads for one in road.signals)
    return roads, signal
