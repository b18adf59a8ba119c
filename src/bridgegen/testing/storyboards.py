"""Small scenarios, written as OpenSCENARIO text on the generated crossroads."""

from bridgegen.openx.opendrive.from_owl import opendrive_from_owl
from bridgegen.openx.opendrive.model import OpenDrive
from bridgegen.scenario.ontology.individuals import build_static

STATIC = {
    "lane_width": 3.5,
    "lanes_per_direction": 2,
    "arm_length": 100.0,
    "intersection_size": 26.0,
}


def crossroads(**static: float) -> OpenDrive:
    """Return the crossroads; ``static``: parameters of it that differ from STATIC."""
    return opendrive_from_owl(build_static(STATIC | static))


WALKER = """<ScenarioObject name="{name}"><Pedestrian name="p" pedestrianCategory="pedestrian"
mass="80"><BoundingBox><Center x="0" y="0" z="0.9"/><Dimensions width="0.6" length="0.4"
height="1.8"/></BoundingBox></Pedestrian></ScenarioObject>"""


def vehicle(name: str) -> str:
    """Return an entity: a car, or a pedestrian if its name begins with "walker"."""
    if name.startswith("walker"):
        return WALKER.format(name=name)
    return f"""<ScenarioObject name="{name}"><Vehicle name="car" vehicleCategory="car">
<BoundingBox><Center x="1.4" y="0" z="0.75"/>
<Dimensions width="2.0" length="4.0" height="1.5"/></BoundingBox>
<Performance maxSpeed="60" maxAcceleration="5" maxDeceleration="9"/>
<Axles><FrontAxle maxSteering="0.6" wheelDiameter="0.6" trackWidth="1.6" positionX="2.8"
positionZ="0.3"/><RearAxle maxSteering="0" wheelDiameter="0.6" trackWidth="1.6" positionX="0"
positionZ="0.3"/></Axles></Vehicle></ScenarioObject>"""


def lane(road: int, lane_id: int, s: float | str) -> str:
    """Return a position on a lane."""
    return f'<Position><LanePosition roadId="{road}" laneId="{lane_id}" s="{s}"/></Position>'


def start(name: str, place: str, speed: float | str, *waypoints: str) -> str:
    """Return the initial actions of an entity: its place, its speed, and its route."""
    route = "".join(f'<Waypoint routeStrategy="shortest">{w}</Waypoint>' for w in waypoints)
    routing = (
        f"<PrivateAction><RoutingAction><AssignRouteAction><Route name='r' closed='false'>{route}"
        "</Route></AssignRouteAction></RoutingAction></PrivateAction>"
        if waypoints
        else ""
    )
    return f"""<Private entityRef="{name}">
<PrivateAction><TeleportAction>{place}</TeleportAction></PrivateAction>
<PrivateAction><LongitudinalAction>{speed_action(speed)}</LongitudinalAction></PrivateAction>
{routing}</Private>"""


def speed_action(speed: float | str, dynamics: str = "step time 0") -> str:
    """Return an action: a speed that is reached by "shape dimension value"."""
    shape, dimension, value = dynamics.split()
    return f"""<SpeedAction><SpeedActionDynamics dynamicsShape="{shape}"
dynamicsDimension="{dimension}" value="{value}"/><SpeedActionTarget>
<AbsoluteTargetSpeed value="{speed}"/></SpeedActionTarget></SpeedAction>"""


def after(seconds: float | str, *, edge: str = "none", delay: float = 0.0) -> str:
    """Return a condition: so many seconds of simulation."""
    return f"""<Condition name="c" delay="{delay}" conditionEdge="{edge}"><ByValueCondition>
<SimulationTimeCondition value="{seconds}" rule="greaterOrEqual"/></ByValueCondition>
</Condition>"""


def near(entity: str, other: str, metres: float, *, rule: str = "lessOrEqual") -> str:
    """Return a condition: two entities are so near each other."""
    return f"""<Condition name="c" delay="0" conditionEdge="none"><ByEntityCondition>
<TriggeringEntities triggeringEntitiesRule="any"><EntityRef entityRef="{entity}"/>
</TriggeringEntities><EntityCondition><RelativeDistanceCondition entityRef="{other}"
relativeDistanceType="euclidianDistance" value="{metres}" freespace="false" rule="{rule}"/>
</EntityCondition></ByEntityCondition></Condition>"""


def reaches(entity: str, place: str, tolerance: float) -> str:
    """Return a condition: an entity is at a place."""
    return f"""<Condition name="c" delay="0" conditionEdge="none"><ByEntityCondition>
<TriggeringEntities triggeringEntitiesRule="any"><EntityRef entityRef="{entity}"/>
</TriggeringEntities><EntityCondition><ReachPositionCondition tolerance="{tolerance}">{place}
</ReachPositionCondition></EntityCondition></ByEntityCondition></Condition>"""


def lateral(lanes: int, dynamics: str, actor: str = "bv") -> str:
    """Return an action: a change by so many lanes."""
    shape, dimension, value = dynamics.split()
    return f"""<LateralAction><LaneChangeAction><LaneChangeActionDynamics dynamicsShape="{shape}"
dynamicsDimension="{dimension}" value="{value}"/><LaneChangeTarget>
<RelativeTargetLane entityRef="{actor}" value="{lanes}"/></LaneChangeTarget></LaneChangeAction>
</LateralAction>"""


def condition(entity: str, text: str) -> str:
    """Return a condition on an entity, of its OpenSCENARIO text."""
    return f"""<Condition name="c" delay="0" conditionEdge="none"><ByEntityCondition>
<TriggeringEntities triggeringEntitiesRule="any"><EntityRef entityRef="{entity}"/>
</TriggeringEntities><EntityCondition>{text}</EntityCondition></ByEntityCondition></Condition>"""


def ended(name: str, delay: float = 0.0) -> str:
    """Return a condition: an event has ended."""
    return f"""<Condition name="c" delay="{delay}" conditionEdge="none"><ByValueCondition>
<StoryboardElementStateCondition storyboardElementType="event" storyboardElementRef="{name}"
state="completeState"/></ByValueCondition></Condition>"""


def events(*rows: tuple[str, str, str, str]) -> str:
    """Return events of (name, actor, private action, condition)."""
    return "".join(
        f"""<ManeuverGroup name="g{name}" maximumExecutionCount="1">
<Actors selectTriggeringEntities="false"><EntityRef entityRef="{actor}"/></Actors>
<Maneuver name="m"><Event name="{name}" priority="override" maximumExecutionCount="1">
<Action name="a"><PrivateAction>{action}</PrivateAction></Action><StartTrigger><ConditionGroup>
{when}</ConditionGroup></StartTrigger></Event></Maneuver></ManeuverGroup>"""
        for name, actor, action, when in rows
    )


def speeding(speed: float | str, dynamics: str) -> str:
    """Return `speed_action` as a private action."""
    return f"<LongitudinalAction>{speed_action(speed, dynamics)}</LongitudinalAction>"


def event(actor: str, action: str, *groups: str) -> str:
    """Return one event: a longitudinal action of an actor, at any of the groups of conditions."""
    trigger = "".join(f"<ConditionGroup>{group}</ConditionGroup>" for group in groups)
    return f"""<ManeuverGroup name="g" maximumExecutionCount="1">
<Actors selectTriggeringEntities="false"><EntityRef entityRef="{actor}"/></Actors>
<Maneuver name="m"><Event name="e" priority="override" maximumExecutionCount="1">
<Action name="a"><PrivateAction><LongitudinalAction>{action}</LongitudinalAction></PrivateAction>
</Action><StartTrigger>{trigger}</StartTrigger></Event></Maneuver></ManeuverGroup>"""


def scenario(
    names: tuple[str, ...], privates: str, events: str = "", stop: tuple[str, ...] = (),
    parameters: str = "", environment: str = "",
) -> str:  # fmt: skip
    """Return a scenario file of 10 s."""
    story = (
        f"""<Story name="s"><Act name="a">{events}<StartTrigger><ConditionGroup>{after(0.0)}
</ConditionGroup></StartTrigger></Act></Story>"""
        if events
        else ""
    )
    ends = "".join(f"<ConditionGroup>{end}</ConditionGroup>" for end in (after(10.0), *stop))
    return f"""<?xml version="1.0"?><OpenSCENARIO><FileHeader revMajor="1" revMinor="2"
date="2025-01-01T00:00:00" description="test" author="test"/>
<ParameterDeclarations>{parameters}</ParameterDeclarations><CatalogLocations/>
<RoadNetwork><LogicFile filepath="map.xodr"/></RoadNetwork>
<Entities>{"".join(vehicle(name) for name in names)}</Entities>
<Storyboard><Init><Actions>{environment}{privates}</Actions></Init>{story}
<StopTrigger>{ends}</StopTrigger></Storyboard></OpenSCENARIO>"""


def friction(factor: float | str) -> str:
    """Return an action: the friction of all roads."""
    return f"""<GlobalAction><EnvironmentAction><Environment name="e"><RoadCondition
frictionScaleFactor="{factor}"/></Environment></EnvironmentAction></GlobalAction>"""
