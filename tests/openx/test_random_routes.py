"""Random routes: where they lead, how evenly, and that they are driven."""

import math
from collections import Counter
from pathlib import Path

import pytest

from bridgegen.base.errors import FileFormatError
from bridgegen.engine.simulate import simulate_file
from bridgegen.openx.opendrive.from_owl import opendrive_from_owl
from bridgegen.openx.opendrive.write import to_xml
from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.element import walk
from bridgegen.openx.openscenario.read import read
from bridgegen.openx.prepared import LONGEST, with_random_routes
from bridgegen.scenario.ontology.individuals import build_static

STATIC = {"lane_width": 3.5, "lanes_per_direction": 1, "arm_length": 100.0,
          "intersection_size": 26.0}  # fmt: skip
ROADS = opendrive_from_owl(build_static(STATIC))
RANDOM = "<PrivateAction><RoutingAction><RandomRouteAction/></RoutingAction></PrivateAction>"
LANE = '<LanePosition roadId="1" laneId="1" s="60"/>'


def file(name: str, start: str = LANE, events: str = "", initial: str = RANDOM) -> bytes:
    return f"""<?xml version="1.0"?><OpenSCENARIO><FileHeader revMajor="1" revMinor="3"
date="2026-01-01T00:00:00" description="d" author="a"/><CatalogLocations/>
<RoadNetwork><LogicFile filepath="map.xodr"/></RoadNetwork><Entities><ScenarioObject name="{name}">
<Vehicle name="car" vehicleCategory="car"><BoundingBox><Center x="1.4" y="0" z="0.75"/>
<Dimensions width="2.0" length="4.0" height="1.5"/></BoundingBox>
<Performance maxSpeed="60" maxAcceleration="5" maxDeceleration="9"/>
<Axles><FrontAxle maxSteering="0.6" wheelDiameter="0.6" trackWidth="1.6" positionX="2.8"
positionZ="0.3"/><RearAxle maxSteering="0" wheelDiameter="0.6" trackWidth="1.6" positionX="0"
positionZ="0.3"/></Axles></Vehicle></ScenarioObject></Entities><Storyboard><Init><Actions>
<Private entityRef="{name}"><PrivateAction><TeleportAction><Position>{start}</Position>
</TeleportAction></PrivateAction><PrivateAction><LongitudinalAction><SpeedAction>
<SpeedActionDynamics dynamicsShape="step" dynamicsDimension="time" value="0"/><SpeedActionTarget>
<AbsoluteTargetSpeed value="10"/></SpeedActionTarget></SpeedAction></LongitudinalAction>
</PrivateAction>{initial}</Private></Actions></Init>{events}
<StopTrigger><ConditionGroup><Condition name="c" delay="0" conditionEdge="none">
<ByValueCondition><SimulationTimeCondition value="14" rule="greaterOrEqual"/></ByValueCondition>
</Condition></ConditionGroup></StopTrigger></Storyboard></OpenSCENARIO>""".encode()


def event(*actors: str) -> str:
    refs = "".join(f'<EntityRef entityRef="{one}"/>' for one in actors)
    now = """<StartTrigger><ConditionGroup><Condition name="c" delay="0" conditionEdge="none">
<ByValueCondition><SimulationTimeCondition value="1" rule="greaterOrEqual"/></ByValueCondition>
</Condition></ConditionGroup></StartTrigger>"""
    return f"""<Story name="s"><Act name="a"><ManeuverGroup name="g" maximumExecutionCount="1">
<Actors selectTriggeringEntities="false">{refs}</Actors><Maneuver name="m"><Event name="e"
priority="override" maximumExecutionCount="1"><Action name="a">{RANDOM}</Action>{now}</Event>
</Maneuver></ManeuverGroup></Act></Story>"""


def drawn(name: str, *args: str, **kwargs: str) -> tuple[str, ...]:
    """Return the roads that the drawn route names."""
    made = with_random_routes(read(file(name, *args, **kwargs), "s"), ROADS, "s")
    assert not any(isinstance(one, osc.RandomRouteAction) for one in walk(made))
    (route,) = (one for one in walk(made) if isinstance(one, osc.Route))
    return tuple(str(one.position.position.road_id) for one in route.waypoints)


def test_every_way_is_drawn_as_often_and_always_the_same_for_a_name():
    found = Counter(drawn(f"car{k}")[-1] for k in range(300))
    assert sorted(found) == ["2", "3", "4"]  # left, straight on, right; not back
    for count in found.values():
        assert abs(count - 100) < 3.5 * math.sqrt(300 * (1 / 3) * (2 / 3))
    assert drawn("car7") == drawn("car7")


@pytest.mark.parametrize("name", [f"car{k}" for k in range(6)])
@pytest.mark.parametrize("begins", ["at the start", "by an event"])
def test_it_is_driven(tmp_path, name, begins):
    (tmp_path / "map.xodr").write_bytes(to_xml(ROADS))
    given = {} if begins == "at the start" else {"initial": "", "events": event(name)}
    path: Path = tmp_path / "s.xosc"
    path.write_bytes(file(name, **given))
    rollout = simulate_file(path).rollout
    k = int(rollout.n_steps[0]) - 1
    h = math.degrees(rollout.h[0, 0, k]) % 360.0
    outwards = {"2": 180.0, "3": 90.0, "4": 0.0}[drawn(name)[-1]]
    assert h == pytest.approx(outwards, abs=1e-6)
    assert rollout.v[0, 0, k] == pytest.approx(10.0)


def test_where_nothing_branches_it_leads_to_the_end():
    alone = opendrive_from_owl(build_static(STATIC))
    made = with_random_routes(
        read(file("car", '<LanePosition roadId="2" laneId="-1" s="20"/>'), "s"), alone, "s"
    )
    (route,) = (one for one in walk(made) if isinstance(one, osc.Route))
    assert [one.position.position.s for one in route.waypoints] == [20.0, pytest.approx(99.9)]
    assert LONGEST > 100.0


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (
            file("car", '<WorldPosition x="500" y="500"/>'),
            "needs a start on a lane, 'car' has none",
        ),
        (file("car", initial="", events=event("car", "car")), "is for one entity"),
    ],
)
def test_what_cannot_be_drawn_is_refused_by_its_line(data, message):
    with pytest.raises(FileFormatError, match=rf"{message}.* \(line \d+\)"):
        with_random_routes(read(data, "s"), ROADS, "s")


def test_a_scenario_without_them_comes_back_as_it_is():
    scenario = read(file("car", initial=""), "s")
    assert with_random_routes(scenario, ROADS, "s") is scenario
