"""A scenario file such as users have: a lead vehicle that brakes, and how its parameters vary."""

from pathlib import Path

from bridgegen.openx.opendrive.from_owl import opendrive_from_owl
from bridgegen.openx.opendrive.write import to_xml as road_xml
from bridgegen.scenario.language.roads import usual
from bridgegen.scenario.ontology.individuals import build_static

_VEHICLE = """<ScenarioObject name="{name}"><Vehicle name="car" vehicleCategory="car">
<BoundingBox><Center x="1.4" y="0" z="0.75"/>
<Dimensions width="2.0" length="4.0" height="1.5"/></BoundingBox>
<Performance maxSpeed="60" maxAcceleration="5" maxDeceleration="9"/>
<Axles><FrontAxle maxSteering="0.6" wheelDiameter="0.6" trackWidth="1.6" positionX="2.8"
positionZ="0.3"/><RearAxle maxSteering="0" wheelDiameter="0.6" trackWidth="1.6" positionX="0"
positionZ="0.3"/></Axles><Properties/></Vehicle></ScenarioObject>"""

_START = """<Private entityRef="{name}"><PrivateAction><TeleportAction><Position>
<LanePosition roadId="{road}" laneId="-1" s="{s}"/></Position></TeleportAction></PrivateAction>
<PrivateAction><LongitudinalAction><SpeedAction><SpeedActionDynamics dynamicsShape="step"
dynamicsDimension="time" value="0"/><SpeedActionTarget><AbsoluteTargetSpeed value="{speed}"/>
</SpeedActionTarget></SpeedAction></LongitudinalAction></PrivateAction></Private>"""

_PARAMETERS = (
    ("EgoSpeed", "double", "15"),
    ("Gap", "double", "30"),
    ("BrakeTime", "double", "2"),
    ("StopAfter", "int", "12"),
    ("RoadId", "string", "1"),
    ("Deceleration", "double", "6"),
)


def scenario_text() -> str:
    declared = "".join(
        f'<ParameterDeclaration name="{name}" parameterType="{kind}" value="{value}"/>'
        for name, kind, value in _PARAMETERS
    )
    return f"""<?xml version="1.0"?><OpenSCENARIO><FileHeader revMajor="1" revMinor="2"
date="2025-01-01T00:00:00" description="A lead vehicle brakes" author="test"/>
<ParameterDeclarations>{declared}</ParameterDeclarations><CatalogLocations/>
<RoadNetwork><LogicFile filepath="roads/straight.xodr"/></RoadNetwork>
<Entities>{_VEHICLE.format(name="Lead")}{_VEHICLE.format(name="Ego")}</Entities>
<Storyboard><Init><Actions>{_START.format(name="Ego", road="$RoadId", s="10", speed="$EgoSpeed")}
{_START.format(name="Lead", road="$RoadId", s="${10 + $Gap}", speed="$EgoSpeed")}</Actions></Init>
<Story name="s"><Act name="a"><ManeuverGroup name="g" maximumExecutionCount="1">
<Actors selectTriggeringEntities="false"><EntityRef entityRef="Lead"/></Actors>
<Maneuver name="m"><Event name="brake" priority="overwrite" maximumExecutionCount="1">
<Action name="a"><PrivateAction><LongitudinalAction><SpeedAction>
<SpeedActionDynamics dynamicsShape="linear" dynamicsDimension="rate" value="$Deceleration"/>
<SpeedActionTarget><AbsoluteTargetSpeed value="0"/></SpeedActionTarget></SpeedAction>
</LongitudinalAction></PrivateAction></Action><StartTrigger><ConditionGroup>
<Condition name="c" delay="0" conditionEdge="none"><ByValueCondition>
<SimulationTimeCondition value="$BrakeTime" rule="greaterOrEqual"/></ByValueCondition></Condition>
</ConditionGroup></StartTrigger></Event></Maneuver></ManeuverGroup><StartTrigger><ConditionGroup>
<Condition name="c" delay="0" conditionEdge="none"><ByValueCondition>
<SimulationTimeCondition value="0" rule="greaterOrEqual"/></ByValueCondition></Condition>
</ConditionGroup></StartTrigger></Act></Story><StopTrigger><ConditionGroup>
<Condition name="c" delay="0" conditionEdge="none"><ByValueCondition>
<SimulationTimeCondition value="$StopAfter" rule="greaterThan"/></ByValueCondition></Condition>
</ConditionGroup></StopTrigger></Storyboard></OpenSCENARIO>"""


def distribution_text(body: str, scenario: str = "brake.xosc", minor: int = 2) -> str:
    return f"""<?xml version="1.0"?><OpenSCENARIO><FileHeader revMajor="1" revMinor="{minor}"
date="2025-01-01T00:00:00" description="ranges" author="test"/><ParameterValueDistribution>
<ScenarioFile filepath="{scenario}"/>{body}</ParameterValueDistribution></OpenSCENARIO>"""


def stochastic(*rows: tuple[str, str], runs: int = 60, seed: str = "") -> str:
    inner = "".join(
        f'<StochasticDistribution parameterName="{name}">{one}</StochasticDistribution>'
        for name, one in rows
    )
    return f'<Stochastic numberOfTestRuns="{runs}"{seed}>{inner}</Stochastic>'


def deterministic(*rows: tuple[str, str]) -> str:
    inner = "".join(
        f'<DeterministicSingleParameterDistribution parameterName="{name}">{one}'
        "</DeterministicSingleParameterDistribution>"
        for name, one in rows
    )
    return f"<Deterministic>{inner}</Deterministic>"


def value_sets(*sets: dict[str, float | str]) -> str:
    inner = "".join(
        "<ParameterValueSet>"
        + "".join(
            f'<ParameterAssignment parameterRef="{name}" value="{value}"/>'
            for name, value in one.items()
        )
        + "</ParameterValueSet>"
        for one in sets
    )
    return (
        "<Deterministic><DeterministicMultiParameterDistribution><ValueSetDistribution>"
        f"{inner}</ValueSetDistribution></DeterministicMultiParameterDistribution></Deterministic>"
    )


def limits(low: float, high: float) -> str:
    return f'<Range lowerLimit="{low}" upperLimit="{high}"/>'


USUAL = stochastic(
    ("EgoSpeed", f'<NormalDistribution expectedValue="14" variance="9">{limits(5, 25)}'
     "</NormalDistribution>"),
    ("Gap", f"<UniformDistribution>{limits(10, 60)}</UniformDistribution>"),
    ("Deceleration", '<ProbabilityDistributionSet><Element value="3" weight="3"/>'
     '<Element value="8" weight="1"/></ProbabilityDistributionSet>'),
    runs=60, seed=' randomSeed="7"',
)  # fmt: skip


def write_pair(folder: Path, body: str = USUAL, text: str | None = None) -> tuple[Path, Path]:
    """Write scenario, map and distribution; return the scenario's path and the distribution's."""
    (folder / "roads").mkdir(parents=True, exist_ok=True)
    roads = opendrive_from_owl(build_static({}, usual("road")))
    (folder / "roads" / "straight.xodr").write_bytes(road_xml(roads))
    scenario, ranges = folder / "brake.xosc", folder / "ranges.xosc"
    scenario.write_text(text or scenario_text(), "utf-8")
    ranges.write_text(distribution_text(body), "utf-8")
    return scenario, ranges
