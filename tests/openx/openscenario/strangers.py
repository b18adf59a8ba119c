"""A scenario file as other people write them, for tests of its way into the ontology."""

from pathlib import Path

import numpy as np

from bridgegen.engine.simulate import simulate_file
from bridgegen.openx.convert import convert_file

CAR = """
      <Vehicle name="car" vehicleCategory="car"><ParameterDeclarations/>
        <BoundingBox><Center x="1.4" y="0.0" z="0.75"/>
          <Dimensions width="1.9" length="4.6" height="1.5"/></BoundingBox>
        <Performance maxSpeed="60" maxAcceleration="5" maxDeceleration="9"/>
        <Axles>
          <FrontAxle maxSteering="0.6" wheelDiameter="0.65" trackWidth="1.6" positionX="2.8"
            positionZ="0.325"/>
          <RearAxle maxSteering="0" wheelDiameter="0.65" trackWidth="1.6" positionX="0"
            positionZ="0.325"/>
        </Axles><Properties/>
      </Vehicle>"""


def starts(name: str, road: int, s: str, speed: str) -> str:
    return f"""
      <Private entityRef="{name}">
        <PrivateAction><LongitudinalAction><SpeedAction>
          <SpeedActionDynamics dynamicsShape="step" dynamicsDimension="time" value="0"/>
          <SpeedActionTarget><AbsoluteTargetSpeed value="{speed}"/></SpeedActionTarget>
        </SpeedAction></LongitudinalAction></PrivateAction>
        <PrivateAction><TeleportAction><Position>
          <LanePosition roadId="{road}" laneId="1" s="{s}" offset="0"/>
        </Position></TeleportAction></PrivateAction>
      </Private>"""


def over_time(seconds: str) -> str:
    return f"""<ConditionGroup><Condition name="over" delay="0" conditionEdge="none">
      <ByValueCondition><SimulationTimeCondition value="{seconds}" rule="greaterOrEqual"/>
      </ByValueCondition></Condition></ConditionGroup>"""


FILE = f"""<?xml version="1.0"?>
<OpenSCENARIO>
  <FileHeader revMajor="1" revMinor="0" date="2020-02-29T10:00:00" description="a stranger's"
    author="somebody"/>
  <ParameterDeclarations>
    <ParameterDeclaration name="Speed" parameterType="double" value="8"/>
    <ParameterDeclaration name="Unused" parameterType="double" value="1.5"/>
  </ParameterDeclarations>
  <CatalogLocations/>
  <RoadNetwork><LogicFile filepath="map.xodr"/></RoadNetwork>
  <Entities>
    <ScenarioObject name="Hero">{CAR}</ScenarioObject>
    <ScenarioObject name="the other one">{CAR}</ScenarioObject>
  </Entities>
  <Storyboard>
    <Init><Actions>
      <GlobalAction><EnvironmentAction><Environment name="Sky">
        <TimeOfDay animation="false" dateTime="2025-03-20T10:00:00"/>
        <Weather cloudState="free">
          <Sun intensity="0.8" azimuth="1.5" elevation="0.5"/>
          <Fog visualRange="1000"/>
          <Precipitation precipitationType="dry" intensity="0"/>
        </Weather>
        <RoadCondition frictionScaleFactor="0.8"/>
      </Environment></EnvironmentAction></GlobalAction>
      {starts("Hero", 1, "30", "$Speed")}
      {starts("the other one", 2, "12.25", "4")}
    </Actions></Init>
    <Story name="S"><ParameterDeclarations/>
      <Act name="A">
        <ManeuverGroup name="G" maximumExecutionCount="1">
          <Actors selectTriggeringEntities="false"><EntityRef entityRef="the other one"/></Actors>
          <Maneuver name="M">
            <Event name="sets off!" priority="overwrite" maximumExecutionCount="1">
              <Action name="a1"><PrivateAction><LongitudinalAction><SpeedAction>
                <SpeedActionDynamics dynamicsShape="linear" dynamicsDimension="rate" value="2"/>
                <SpeedActionTarget><AbsoluteTargetSpeed value="$Speed"/></SpeedActionTarget>
              </SpeedAction></LongitudinalAction></PrivateAction></Action>
              <StartTrigger><ConditionGroup>
                <Condition name="near" delay="0" conditionEdge="none"><ByEntityCondition>
                  <TriggeringEntities triggeringEntitiesRule="any">
                    <EntityRef entityRef="Hero"/></TriggeringEntities>
                  <EntityCondition><RelativeDistanceCondition entityRef="the other one"
                    relativeDistanceType="cartesianDistance" value="20" freespace="false"
                    rule="lessThan"/></EntityCondition>
                </ByEntityCondition></Condition>
              </ConditionGroup></StartTrigger>
            </Event>
          </Maneuver>
        </ManeuverGroup>
        <StartTrigger>{over_time("0")}</StartTrigger>
      </Act>
    </Story>
    <StopTrigger>{over_time("12")}</StopTrigger>
  </Storyboard>
</OpenSCENARIO>
"""

# what the ontology has no words for in it: the sun's share, and half a class of clouds
KNOWN = ('cloudState="free" of Weather', 'intensity="0.8" of Sun', "dateTime=")


def line_of(text: str) -> int:
    return FILE[: FILE.index(text)].count("\n") + 1


def changed(folder: Path, *edits: tuple[str, str]) -> Path:
    text = FILE
    for old, new in edits:
        assert old in text, old
        text = text.replace(old, new, 1)
    (folder / "their.xosc").write_text(text)
    return folder / "their.xosc"


def moves_as(file: Path, owl: Path, folder: Path) -> None:
    """The individuals, written again, move as the file does: nobody drives, in either."""
    (_, again), _ = convert_file(owl, folder / "again")
    one, other = simulate_file(file).rollout, simulate_file(again).rollout
    count = min(int(one.n_steps[0]), int(other.n_steps[0]))
    for name in one.names:
        a, b = one.names.index(name), other.names.index("ego" if name == "Hero" else name)
        for ours, theirs in ((one.x, other.x), (one.y, other.y), (one.v, other.v)):
            np.testing.assert_allclose(ours[0, a, :count], theirs[0, b, :count], atol=1e-6)
