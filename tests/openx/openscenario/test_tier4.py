"""TIER IV's scenario files: read as the XML that they stand for, on Lanelet2 maps."""

from pathlib import Path

import pytest
from tests.approval import approve, refuses
from tests.openx.lanelet2.test_lanelet2 import LANES, TWO_WAY, osm

from bridgegen.base.errors import FileFormatError, UnsupportedError
from bridgegen.engine.simulate import simulate_file
from bridgegen.jobs.search.scenarios import load
from bridgegen.openx.openscenario.read import read
from bridgegen.openx.openscenario.tier4 import is_storyboard, root_of

SCENARIO = """
ScenarioModifiers:
  ScenarioModifier: []
OpenSCENARIO:
  FileHeader: {revMajor: 0, revMinor: 0, date: '2021-09-06T09:09:41', description: '', author: ''}
  CatalogLocations: {CatalogLocation: []}
  RoadNetwork:
    LogicFile: {filepath: $(find-pkg-share town_map)/map}
  Entities:
    ScenarioObject:
      - name: npc
        Vehicle: &car
          name: ''
          vehicleCategory: car
          BoundingBox:
            Center: {x: 0, y: 0, z: 0}
            Dimensions: {width: 2.25, length: 4.77, height: 2.5}
          Performance: {maxSpeed: INF, maxAcceleration: INF, maxDeceleration: INF}
          Axles:
            FrontAxle: &axle
              {maxSteering: 3.1415, wheelDiameter: 0.6, trackWidth: 4, positionX: 1, positionZ: 0.3}
            RearAxle: {<<: *axle, positionX: -1}
          Properties: {Property: []}
      - name: ego
        Vehicle: *car
  Storyboard:
    Init:
      Actions:
        Private:
          - entityRef: npc
            PrivateAction:
              - TeleportAction:
                  Position:
                    LanePosition: {roadId: '', laneId: '13', s: 30, offset: 0.5}
          - entityRef: ego
            PrivateAction:
              - TeleportAction:
                  Position:
                    LanePosition: {roadId: '', laneId: '11', s: 20}
    Story:
      - name: ''
        Act:
          - name: _EndCondition
            ManeuverGroup:
              - name: ''
                maximumExecutionCount: 1
                Actors: {selectTriggeringEntities: false, EntityRef: [{entityRef: ego}]}
                Maneuver:
                  - name: ''
                    Event:
                      - name: ''
                        priority: parallel
                        Action:
                          - name: ''
                            UserDefinedAction: {CustomCommandAction: {type: exitSuccess}}
                        StartTrigger:
                          ConditionGroup:
                            - Condition:
                                - name: ''
                                  delay: 0
                                  conditionEdge: none
                                  ByValueCondition:
                                    SimulationTimeCondition: {value: 2, rule: greaterThan}
            StartTrigger: {ConditionGroup: []}
"""


@pytest.fixture
def file(tmp_path: Path) -> Path:
    """A scenario with its map in a ROS package beside it."""
    folder = tmp_path / "town_map" / "map"
    folder.mkdir(parents=True)
    (folder / "lanelet2_map.osm").write_text(osm(TWO_WAY, LANES))
    path = tmp_path / "scenario.yaml"
    path.write_text(SCENARIO)
    return path


def test_positions_on_lanelets_are_positions_on_roads(file: Path) -> None:
    found = {
        private.entity_ref: private.private_actions[0].action.position.position
        for private in read(file).storyboard.init.actions.privates
    }
    # Lanelet 13 runs against the road: 30 m from its start are 70 m along the road, and its left
    # is the road's right.
    npc, ego = found["npc"], found["ego"]
    assert (npc.lane_id, npc.s, npc.offset) == ("1", pytest.approx(70.0), pytest.approx(-0.5))
    assert (ego.lane_id, ego.s) == ("-1", pytest.approx(20.0))


def test_it_runs_and_an_exit_ends_it(file: Path) -> None:
    rollout = simulate_file(file).rollout
    ended = (rollout.n_steps[0] - 1) * rollout.time_step
    assert ended == pytest.approx(2.0, abs=0.2)
    assert load(file).name


def test_exits_are_said_to_give_no_verdict(file: Path) -> None:
    warnings: list[str] = []
    read(file, warnings=warnings)
    approve(warnings, "exitSuccess")


def test_a_logical_scenario_in_yaml_is_none(tmp_path: Path) -> None:
    path = tmp_path / "cut-in.yaml"
    path.write_text("scenario: cut-in\n")
    assert not is_storyboard(path)
    assert is_storyboard("any.xosc")


@pytest.mark.parametrize(
    ("old", "new", "named"),
    [
        ("laneId: '11'", "laneId: '99'", "99"),
        ("s: 20}", "s: $start}", "$start"),
        ("town_map)", "village_map)", "village_map"),
        ("Vehicle: *car", "Vehicle: *bus", "bus"),
        ("name: ego", "name: ego\n        name: ego", "name"),
        ("entityRef: npc", "entityRef: [npc]", "entityRef"),
        ("OpenSCENARIO:", "OpenSCENARIO: []\nOther:", "OpenSCENARIO"),
        ("Vehicle: *car", "Vehicle: !!python/name:os.system", "python"),
        ("Vehicle: *car", "Vehicle: {", "YAML"),
    ],
)
def test_what_is_wrong_is_refused_with_its_place(
    old: str, new: str, named: str, file: Path
) -> None:
    file.write_text(SCENARIO.replace(old, new))
    with refuses(FileFormatError, named):
        root_of(file)


def test_aliases_that_multiply_are_refused(tmp_path: Path) -> None:
    lines = ["OpenSCENARIO:", "  A: &a0 {B: [{}]}"]
    lines += [f"  A{k}: &a{k} {{B: [*a{k - 1}, *a{k - 1}]}}" for k in range(1, 30)]
    path = tmp_path / "bomb.yaml"
    path.write_text("\n".join(lines))
    with refuses(FileFormatError, "50000"):
        root_of(path)


def test_modifiers_are_refused_by_name(file: Path) -> None:
    new = "ScenarioModifier: [{name: SPEED, list: [1, 2]}]"
    file.write_text(SCENARIO.replace("ScenarioModifier: []", new))
    with refuses(UnsupportedError, "SPEED"):
        root_of(file)
