"""Sources, sinks and swarms: who is where and when, and that traffic does not crash by itself."""

import math
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from tests.approval import refuses

from bridgegen.base.errors import FileFormatError
from bridgegen.engine.simulate import simulate_file
from bridgegen.jobs.search.export import export
from bridgegen.openx.opendrive.from_owl import opendrive_from_owl
from bridgegen.openx.opendrive.write import to_xml
from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.read import read
from bridgegen.openx.traffic import APART, MOST, populated
from bridgegen.scenario.ontology.individuals import build_static

from .opendrive.kinds import usual

ROADS = opendrive_from_owl(build_static({}, usual("road", lanes=3, lanes_against=3, length=1000.0)))
LANE = 3.5
WEIGHTS = """<TrafficDefinition name="d"><VehicleCategoryDistribution>{}
</VehicleCategoryDistribution><ControllerDistribution><ControllerDistributionEntry weight="1">
<Controller name="c"><Properties/></Controller></ControllerDistributionEntry>
</ControllerDistribution></TrafficDefinition>"""


def made_of(**weights: float) -> str:
    return WEIGHTS.format("".join(
        f'<VehicleCategoryDistributionEntry category="{kind}" weight="{weight}"/>'
        for kind, weight in weights.items()
    ))  # fmt: skip


def swarm(number: int = 20, inner: float = 50.0, major: float = 300.0, offset: float = 0.0,
          more: str = made_of(car=1), ways: str = "1 1", speed: str = "10 14") -> str:  # fmt: skip
    same, opposite = ways.split()
    low, high = speed.split()
    return f"""<TrafficSwarmAction innerRadius="{inner}" semiMajorAxis="{major}" semiMinorAxis="80"
offset="{offset}" numberOfVehicles="{number}"><CentralObject entityRef="ego"/>{more}
<InitialSpeedRange lowerLimit="{low}" upperLimit="{high}"/><DirectionOfTravelDistribution
same="{same}" opposite="{opposite}"/></TrafficSwarmAction>"""


def place(s: float, lane: int = -2) -> str:
    return f'<Position><LanePosition roadId="1" laneId="{lane}" s="{s}"/></Position>'


def source(rate: float, s: float = 100.0, radius: float = 6.0, more: str = made_of(car=1)) -> str:
    return f"""<TrafficSourceAction radius="{radius}" rate="{rate}" speed="12">{place(s)}{more}
</TrafficSourceAction>"""


def sink(s: float, radius: float = 8.0, rate: str = "") -> str:
    return f'<TrafficSinkAction radius="{radius}"{rate}>{place(s)}</TrafficSinkAction>'


def file(*traffic: str, ends: float = 10.0, where: float = 500.0) -> bytes:
    actions = "".join(
        f'<GlobalAction><TrafficAction trafficName="t{k}">{one}</TrafficAction></GlobalAction>'
        for k, one in enumerate(traffic)
    )
    return f"""<?xml version="1.0"?><OpenSCENARIO><FileHeader revMajor="1" revMinor="2"
date="2026-01-01T00:00:00" description="d" author="a"/><CatalogLocations/>
<RoadNetwork><LogicFile filepath="map.xodr"/></RoadNetwork><Entities><ScenarioObject name="ego">
<Vehicle name="car" vehicleCategory="car"><BoundingBox><Center x="1.4" y="0" z="0.75"/>
<Dimensions width="2.0" length="4.0" height="1.5"/></BoundingBox>
<Performance maxSpeed="60" maxAcceleration="5" maxDeceleration="9"/>
<Axles><FrontAxle maxSteering="0.6" wheelDiameter="0.6" trackWidth="1.6" positionX="2.8"
positionZ="0.3"/><RearAxle maxSteering="0" wheelDiameter="0.6" trackWidth="1.6" positionX="0"
positionZ="0.3"/></Axles><Properties/></Vehicle></ScenarioObject></Entities><Storyboard><Init>
<Actions>{actions}<Private entityRef="ego"><PrivateAction><TeleportAction>{place(where)}
</TeleportAction></PrivateAction><PrivateAction><LongitudinalAction><SpeedAction>
<SpeedActionDynamics dynamicsShape="step" dynamicsDimension="time" value="0"/><SpeedActionTarget>
<AbsoluteTargetSpeed value="12"/></SpeedActionTarget></SpeedAction></LongitudinalAction>
</PrivateAction></Private></Actions></Init>
<StopTrigger><ConditionGroup><Condition name="c" delay="0" conditionEdge="none">
<ByValueCondition><SimulationTimeCondition value="{ends}" rule="greaterOrEqual"/></ByValueCondition>
</Condition></ConditionGroup></StopTrigger></Storyboard></OpenSCENARIO>""".encode()


def starts(*traffic: str, **kwargs: float) -> tuple[np.ndarray, np.ndarray]:
    """Return where vehicles start, ``(V, 2)`` s and lane, and their speeds ``(V,)``."""
    made = populated(read(file(*traffic, **kwargs), "s"), ROADS, "s")
    found, speeds = [], []
    for private in made.storyboard.init.actions.privates[1:]:
        for one in private.private_actions:
            if isinstance(one.action, osc.TeleportAction):
                at = one.action.position.position
                found.append((at.s, int(str(at.lane_id))))
            elif isinstance(one.action, osc.LongitudinalAction):
                speeds.append(one.action.action.speed_action_target.target.value)
    return np.array(found), np.array(speeds)


def rollout(tmp_path: Path, data: bytes):
    (tmp_path / "map.xodr").write_bytes(to_xml(ROADS))
    (tmp_path / "s.xosc").write_bytes(data)
    return simulate_file(tmp_path / "s.xosc").rollout


def test_a_swarm_is_between_circle_and_ellipse_and_nobody_is_near_another():
    at, speeds = starts(swarm(offset=40.0))
    assert len(at) == len(speeds) == 20
    t = -np.sign(at[:, 1]) * -(np.abs(at[:, 1]) - 0.5) * LANE
    x, y = at[:, 0] - 500.0 - 40.0, t - -1.5 * LANE
    assert (np.hypot(x, y) >= 50.0 - 1e-9).all()
    assert ((x / 300.0) ** 2 + (y / 80.0) ** 2 <= 1.0 + 1e-9).all()
    apart = np.hypot(*(one[:, None] - one[None, :] for one in (x, y)))
    assert apart[~np.eye(20, dtype=bool)].min() >= APART
    assert ((speeds >= 10.0) & (speeds <= 14.0)).all()
    assert np.ptp(speeds) > 1.0


def test_a_swarm_goes_the_ways_that_are_asked_for():
    for ways, sides in (("1 0", {-1.0}), ("0 1", {1.0}), ("1 1", {-1.0, 1.0})):
        at, _ = starts(swarm(ways=ways))
        assert set(np.sign(at[:, 1])) == sides
    many = [np.sign(starts(swarm(40, major=450.0, ways="3 1"))[0][:, 1])]
    share = (np.concatenate(many) < 0.0).mean()
    assert abs(share - 0.75) < 3.5 * math.sqrt(0.75 * 0.25 / 40)


def test_the_same_name_gives_the_same_traffic_and_another_one_other_traffic():
    one, again = starts(swarm()), starts(swarm())
    assert np.array_equal(one[0], again[0])
    assert np.array_equal(one[1], again[1])
    other, _ = starts(sink(5.0), swarm())  # its name is t1
    assert not np.array_equal(one[0], other)


def test_traffic_drives_and_does_not_crash_by_itself(tmp_path):
    found = rollout(tmp_path, file(swarm(40, major=450.0, speed="5 20"), ends=15.0))
    assert found.status.tolist() == [0]
    k = np.arange(0, int(found.n_steps[0]), 10)
    x, y = (getattr(found, one)[0][:, k] for one in "xy")
    there = found.present[0][:, k] if found.present.size else np.ones_like(x, dtype=bool)
    for i in range(1, len(x)):
        for j in range(i):
            beside = np.abs(y[i] - y[j]) > 2.5
            apart = np.abs(x[i] - x[j]) >= 4.0
            assert (beside | apart | ~there[i] | ~there[j]).all(), (i, j)
    assert (np.abs(x[1:, 5] - x[1:, 0]) > 5.0).all()


def test_a_source_gives_vehicles_one_after_the_other(tmp_path):
    found = rollout(tmp_path, file(source(0.5), ends=10.0))
    assert len(found.names) == 1 + 6  # at 0, 2, 4, 6, 8 and 10 s
    present = found.present[0, 1:]
    comes = [int(np.flatnonzero(one)[0]) for one in present if one.any()]
    assert [0.05 * k for k in comes] == pytest.approx([0.0, 2.0, 4.0, 6.0, 8.0, 10.0], abs=0.051)
    x = np.array([found.x[0, e + 1, k] for e, k in enumerate(comes)])
    y = np.array([found.y[0, e + 1, k] for e, k in enumerate(comes)])
    assert (np.hypot(x - 100.0, y + 1.5 * LANE) <= 6.0 + 1e-6).all()
    assert found.v[0, 1, comes[0] + 1] == pytest.approx(12.0)


def test_a_sink_takes_them_away(tmp_path):
    found = rollout(tmp_path, file(source(0.2, radius=1.0), sink(160.0, radius=9.0), ends=14.0))
    first = np.flatnonzero(found.present[0, 1])
    left = int(first[-1])
    gap = math.hypot(found.x[0, 1, left] - 160.0, found.y[0, 1, left] + 1.5 * LANE)
    assert 9.0 < gap <= 9.0 + 12.0 * 0.05 + 1e-6  # its last instant; at the next it is near
    assert found.present[0, 0].all()  # the ego stays


@pytest.mark.parametrize("flavour", ["1.3", "resolved", "recorded"])
def test_it_is_exported_vehicle_by_vehicle(tmp_path, flavour):
    before = rollout(tmp_path, file(swarm(6), source(0.5), sink(300), ends=6.0))
    path, _ = export(tmp_path / "s.xosc", flavour, out=tmp_path / "export")
    assert b"TrafficAction" not in path.read_bytes()
    after = simulate_file(path).rollout
    assert after.names == before.names
    n = int(before.n_steps[0])
    there = before.present[0, :, :n]
    for field in ("x", "y", "h"):
        one, other = (getattr(run, field)[0, :, :n] for run in (before, after))
        assert np.array_equal(np.where(there, one, 0.0), np.where(there, other, 0.0))


def test_what_it_is_made_of():
    made = populated(read(file(swarm(30, more=made_of(bus=1, car=0, truck=2))), "s"), ROADS, "s")
    kinds = Counter(str(one.entity_object.vehicle_category)
                    for one in made.entities.scenario_objects[1:])  # fmt: skip
    assert set(kinds) == {"bus", "truck"}
    assert kinds["truck"] > kinds["bus"]


@pytest.mark.parametrize(
    ("traffic", "message"),
    [
        (source(20.0), rf"gives 200 vehicles in 10 s, {MOST} at most"),
        (source(0.0), r"rate \[1/s\] of a source must be greater than 0, got 0"),
        (source(1.0, more=made_of(tram=1)), "vehicles of traffic must be of car, .*got tram"),
        (source(1.0, more=made_of(car=0)), "must not all be 0"),
        (swarm(101), rf"a swarm may have {MOST} vehicles, got 101"),
        (swarm(speed="5 1e3"), r"speeds of traffic \[m/s\] must be 0 to 100, got 1000"),
        (swarm(speed="-1 5"), r"speeds of traffic \[m/s\] must be 0 to 100, got -1"),
        (swarm(offset=1e308), "no lane is where the swarm around 'ego' is"),
        (swarm(inner=400.0), "no lane is where the swarm around 'ego' is"),
        (sink(5.0, rate=' rate="0.2"'), r"rate \[1/s\] must be 1 at least, got 0.2"),
    ],
)
def test_what_cannot_be_is_refused_by_its_line(traffic, message):
    with pytest.raises(FileFormatError, match=rf"s: .*{message}.*\(line \d+\)"):
        populated(read(file(traffic), "s"), ROADS, "s")


def test_numbers_that_rows_could_not_vary_are_refused():
    """They are drawn once: a searched rate would change nothing."""
    declared = """<ParameterDeclarations><ParameterDeclaration name="r" parameterType="double"
value="0.5"/></ParameterDeclarations><CatalogLocations/>"""
    data = file(source(0.5)).replace(b'rate="0.5"', b'rate="$r"')
    data = data.replace(b"<CatalogLocations/>", declared.encode())
    with refuses(FileFormatError, "parameter"):
        populated(read(data, "s"), ROADS, "s")


def test_all_traffic_together_is_bounded():
    with refuses(FileFormatError, MOST):
        populated(read(file(source(6.0), source(6.0, s=300.0)), "s"), ROADS, "s")


def test_a_scenario_without_traffic_comes_back_as_it_is():
    scenario = read(file(), "s")
    assert populated(scenario, ROADS, "s") is scenario
