"""Every action, condition, position and shape of OpenSCENARIO once, in a scenario that may run."""

from .storyboards import after, lane, scenario, speed_action, start, vehicle

HERE = '<LanePosition roadId="2" laneId="1" s="40"/>'
_DYNAMICS = 'dynamicsShape="linear" dynamicsDimension="time" value="1"'
_TWO = """<Waypoint routeStrategy="shortest"><Position><LanePosition roadId="2" laneId="1" s="90"/>
</Position></Waypoint><Waypoint routeStrategy="shortest"><Position><LanePosition roadId="4"
laneId="-1" s="50"/></Position></Waypoint>"""
_ROUTE = f'<Route name="r" closed="false">{_TWO}</Route>'
_LINE = """<Polyline><Vertex><Position><WorldPosition x="0" y="0"/></Position></Vertex>
<Vertex><Position><WorldPosition x="30" y="0"/></Position></Vertex></Polyline>"""
_CONTROLLER = """<Controller name="c"><Properties><Property name="a" value="b"/></Properties>
</Controller>"""


def _trajectory(shape: str) -> str:
    return f'<Trajectory name="t" closed="false"><Shape>{shape}</Shape></Trajectory>'


def _follow(shape: str) -> str:
    return f"""<RoutingAction><FollowTrajectoryAction><TrajectoryRef>{_trajectory(shape)}
</TrajectoryRef><TimeReference><None/></TimeReference>
<TrajectoryFollowingMode followingMode="position"/></FollowTrajectoryAction></RoutingAction>"""


def _routing(text: str) -> str:
    return f"<RoutingAction>{text}</RoutingAction>"


def _lateral(text: str) -> str:
    return f"<LateralAction>{text}</LateralAction>"


def _longitudinal(text: str) -> str:
    return f"<LongitudinalAction>{text}</LongitudinalAction>"


def _controller(text: str) -> str:
    return f"<ControllerAction>{text}</ControllerAction>"


def _entity(text: str) -> str:
    return f'<EntityAction entityRef="bv">{text}</EntityAction>'


def _traffic(text: str) -> str:
    return f'<TrafficAction trafficName="t">{text}</TrafficAction>'


_TRAFFIC = """<TrafficDefinition name="t"><VehicleCategoryDistribution>
<VehicleCategoryDistributionEntry category="car" weight="1"/></VehicleCategoryDistribution>
<ControllerDistribution><ControllerDistributionEntry weight="1"><Controller name="c"><Properties/>
</Controller></ControllerDistributionEntry></ControllerDistribution></TrafficDefinition>"""

PRIVATE_ACTIONS = {
    "SpeedAction": _longitudinal(speed_action(8, "linear time 1")),
    "SpeedProfileAction": _longitudinal(
        '<SpeedProfileAction followingMode="position"><SpeedProfileEntry speed="8" time="1"/>'
        "</SpeedProfileAction>"
    ),
    "LongitudinalDistanceAction": _longitudinal(
        '<LongitudinalDistanceAction entityRef="ego" continuous="true" freespace="true"'
        ' distance="10"/>'
    ),
    "LaneChangeAction": _lateral(
        f"<LaneChangeAction><LaneChangeActionDynamics {_DYNAMICS}/><LaneChangeTarget>"
        '<AbsoluteTargetLane value="2"/></LaneChangeTarget></LaneChangeAction>'
    ),
    "LaneOffsetAction": _lateral(
        '<LaneOffsetAction continuous="true"><LaneOffsetActionDynamics dynamicsShape="cubic"'
        ' maxLateralAcc="1"/><LaneOffsetTarget><AbsoluteTargetLaneOffset value="0.5"/>'
        "</LaneOffsetTarget></LaneOffsetAction>"
    ),
    "LateralDistanceAction": _lateral(
        '<LateralDistanceAction entityRef="ego" continuous="true" freespace="true" distance="1"/>'
    ),
    "SynchronizeAction": """<SynchronizeAction masterEntityRef="ego"><TargetPositionMaster>
<LanePosition roadId="3" laneId="1" s="90"/></TargetPositionMaster><TargetPosition>
<LanePosition roadId="2" laneId="1" s="90"/></TargetPosition></SynchronizeAction>""",
    "TeleportAction": f"<TeleportAction><Position>{HERE}</Position></TeleportAction>",
    "AssignRouteAction": _routing(f"<AssignRouteAction>{_ROUTE}</AssignRouteAction>"),
    "AcquirePositionAction": _routing(
        '<AcquirePositionAction><Position><LanePosition roadId="4" laneId="-1" s="50"/></Position>'
        "</AcquirePositionAction>"
    ),
    "FollowTrajectoryAction": _follow(_LINE),
    "RandomRouteAction": _routing("<RandomRouteAction/>"),
    "AssignControllerAction": _controller(
        f'<AssignControllerAction activateLateral="false" activateLongitudinal="false">'
        f"{_CONTROLLER}</AssignControllerAction>"
    ),
    "ActivateControllerAction": _controller(
        '<ActivateControllerAction lateral="false" longitudinal="false"/>'
    ),
    "OverrideControllerValueAction": _controller(
        '<OverrideControllerValueAction><Brake active="true"><BrakePercent value="0.5"/></Brake>'
        "</OverrideControllerValueAction>"
    ),
    "VisibilityAction": '<VisibilityAction graphics="true" sensors="true" traffic="true"/>',
    "LightStateAction": """<AppearanceAction><LightStateAction><LightType><VehicleLight
vehicleLightType="indicatorLeft"/></LightType><LightState mode="on"/></LightStateAction>
</AppearanceAction>""",
    "AnimationAction": """<AppearanceAction><AnimationAction><AnimationType><ComponentAnimation>
<VehicleComponent vehicleComponentType="doorFrontRight"/></ComponentAnimation></AnimationType>
<AnimationState state="1"/></AnimationAction></AppearanceAction>""",
    "ConnectTrailerAction": '<TrailerAction><ConnectTrailerAction trailerRef="trailer"/>'
    "</TrailerAction>",
    "DisconnectTrailerAction": "<TrailerAction><DisconnectTrailerAction/></TrailerAction>",
}

GLOBAL_ACTIONS = {
    "EnvironmentAction": """<EnvironmentAction><Environment name="e"><RoadCondition
frictionScaleFactor="0.5"/></Environment></EnvironmentAction>""",
    "AddEntityAction": _entity(f"<AddEntityAction><Position>{HERE}</Position></AddEntityAction>"),
    "DeleteEntityAction": _entity("<DeleteEntityAction/>"),
    "TrafficSignalStateAction": """<InfrastructureAction><TrafficSignalAction>
<TrafficSignalStateAction name="lamp" state="on;off;off"/></TrafficSignalAction>
</InfrastructureAction>""",
    "TrafficSignalControllerAction": """<InfrastructureAction><TrafficSignalAction>
<TrafficSignalControllerAction trafficSignalControllerRef="tc" phase="go"/></TrafficSignalAction>
</InfrastructureAction>""",
    "ParameterSetAction": '<ParameterAction parameterRef="p"><SetAction value="2"/>'
    "</ParameterAction>",
    "ParameterModifyAction": """<ParameterAction parameterRef="p"><ModifyAction><Rule>
<AddValue value="2"/></Rule></ModifyAction></ParameterAction>""",
    "VariableSetAction": '<VariableAction variableRef="w"><SetAction value="2"/></VariableAction>',
    "VariableModifyAction": """<VariableAction variableRef="w"><ModifyAction><Rule>
<AddValue value="2"/></Rule></ModifyAction></VariableAction>""",
    "SetMonitorAction": '<SetMonitorAction monitorRef="m" value="true"/>',
    "TrafficSourceAction": _traffic(
        f'<TrafficSourceAction rate="1" radius="5"><Position>{HERE}</Position>{_TRAFFIC}'
        "</TrafficSourceAction>"
    ),
    "TrafficSinkAction": _traffic(
        f'<TrafficSinkAction radius="5"><Position>{HERE}</Position></TrafficSinkAction>'
    ),
    "TrafficSwarmAction": _traffic(
        '<TrafficSwarmAction innerRadius="5" semiMajorAxis="50" semiMinorAxis="50" offset="0"'
        f' numberOfVehicles="3"><CentralObject entityRef="ego"/>{_TRAFFIC}</TrafficSwarmAction>'
    ),
    "TrafficStopAction": _traffic("<TrafficStopAction/>"),
    "TrafficAreaAction": _traffic(
        """<TrafficAreaAction numberOfEntities="2" continuous="false"><TrafficDistribution>
<TrafficDistributionEntry weight="1"><EntityDistribution><EntityDistributionEntry weight="1">
<ScenarioObjectTemplate><Pedestrian name="p" pedestrianCategory="pedestrian" mass="80">
<BoundingBox><Center x="0" y="0" z="0.9"/><Dimensions width="0.6" length="0.4" height="1.8"/>
</BoundingBox></Pedestrian></ScenarioObjectTemplate></EntityDistributionEntry></EntityDistribution>
<Properties/></TrafficDistributionEntry></TrafficDistribution><TrafficArea><Polygon><Position>
<WorldPosition x="0" y="0"/></Position><Position><WorldPosition x="9" y="0"/></Position><Position>
<WorldPosition x="9" y="9"/></Position></Polygon></TrafficArea></TrafficAreaAction>"""
    ),
}

AT_THE_START = ("TrafficSourceAction", "TrafficSinkAction", "TrafficSwarmAction")
"""They run there alone."""

ENTITY_CONDITIONS = {
    "EndOfRoadCondition": '<EndOfRoadCondition duration="1"/>',
    "CollisionCondition": '<CollisionCondition><EntityRef entityRef="ego"/></CollisionCondition>',
    "OffroadCondition": '<OffroadCondition duration="1"/>',
    "TimeHeadwayCondition": """<TimeHeadwayCondition entityRef="ego" value="1" freespace="true"
rule="lessThan" coordinateSystem="entity" relativeDistanceType="longitudinal"/>""",
    "TimeToCollisionCondition": """<TimeToCollisionCondition value="1" freespace="true"
rule="lessThan" coordinateSystem="entity" relativeDistanceType="longitudinal">
<TimeToCollisionConditionTarget><EntityRef entityRef="ego"/></TimeToCollisionConditionTarget>
</TimeToCollisionCondition>""",
    "AccelerationCondition": '<AccelerationCondition value="1" rule="greaterThan"/>',
    "StandStillCondition": '<StandStillCondition duration="1"/>',
    "SpeedCondition": '<SpeedCondition value="1" rule="greaterThan"/>',
    "RelativeSpeedCondition": '<RelativeSpeedCondition entityRef="ego" value="1"'
    ' rule="greaterThan"/>',
    "TraveledDistanceCondition": '<TraveledDistanceCondition value="5"/>',
    "ReachPositionCondition": f'<ReachPositionCondition tolerance="2"><Position>{HERE}</Position>'
    "</ReachPositionCondition>",
    "DistanceCondition": f"""<DistanceCondition value="5" freespace="false" rule="lessThan">
<Position>{HERE}</Position></DistanceCondition>""",
    "RelativeDistanceCondition": """<RelativeDistanceCondition entityRef="ego" value="5"
relativeDistanceType="euclidianDistance" freespace="false" rule="lessThan"/>""",
    "RelativeClearanceCondition": """<RelativeClearanceCondition freeSpace="true"
oppositeLanes="false" distanceForward="10" distanceBackward="10"><RelativeLaneRange from="-1"
to="1"/></RelativeClearanceCondition>""",
    "AngleCondition": '<AngleCondition angleType="heading" angle="0" angleTolerance="0.1"/>',
    "RelativeAngleCondition": '<RelativeAngleCondition entityRef="ego" angleType="heading"'
    ' angle="0" angleTolerance="0.1"/>',
}

VALUE_CONDITIONS = {
    "ParameterCondition": '<ParameterCondition parameterRef="p" value="1" rule="equalTo"/>',
    "VariableCondition": '<VariableCondition variableRef="w" value="1" rule="equalTo"/>',
    "TimeOfDayCondition": '<TimeOfDayCondition dateTime="2025-01-01T12:00:00" rule="greaterThan"/>',
    "SimulationTimeCondition": '<SimulationTimeCondition value="1" rule="greaterThan"/>',
    "StoryboardElementStateCondition": """<StoryboardElementStateCondition
storyboardElementType="event" storyboardElementRef="e" state="completeState"/>""",
    "UserDefinedValueCondition": '<UserDefinedValueCondition name="u" value="1" rule="equalTo"/>',
    "TrafficSignalCondition": '<TrafficSignalCondition name="lamp" state="on;off;off"/>',
    "TrafficSignalControllerCondition": """<TrafficSignalControllerCondition
trafficSignalControllerRef="tc" phase="go"/>""",
}

POSITIONS = {
    "WorldPosition": '<WorldPosition x="3" y="4" h="1"/>',
    "RelativeWorldPosition": '<RelativeWorldPosition entityRef="ego" dx="8" dy="8"/>',
    "RelativeObjectPosition": '<RelativeObjectPosition entityRef="ego" dx="8" dy="0"/>',
    "RoadPosition": '<RoadPosition roadId="2" s="40" t="2"/>',
    "RelativeRoadPosition": '<RelativeRoadPosition entityRef="ego" ds="8" dt="1"/>',
    "LanePosition": HERE,
    "RelativeLanePosition": '<RelativeLanePosition entityRef="ego" dLane="0" ds="8"/>',
    "RoutePosition": f"""<RoutePosition><RouteRef>{_ROUTE}</RouteRef><InRoutePosition>
<FromLaneCoordinates pathS="5" laneId="1"/></InRoutePosition></RoutePosition>""",
    "GeoPosition": '<GeoPosition latitudeDeg="49.0001" longitudeDeg="8.0001"/>',
    "TrajectoryPosition": f"""<TrajectoryPosition s="5"><TrajectoryRef>{_trajectory(_LINE)}
</TrajectoryRef></TrajectoryPosition>""",
}

SHAPES = {
    "Polyline": _LINE,
    "Clothoid": """<Clothoid curvature="0.01" curvaturePrime="0" length="30"><Position>
<WorldPosition x="0" y="0"/></Position></Clothoid>""",
    "ClothoidSpline": """<ClothoidSpline><ClothoidSplineSegment curvatureStart="0"
curvatureEnd="0.01" length="30"><PositionStart><WorldPosition x="0" y="0"/></PositionStart>
</ClothoidSplineSegment></ClothoidSpline>""",
    "Nurbs": """<Nurbs order="2"><ControlPoint><Position><WorldPosition x="0" y="0"/></Position>
</ControlPoint><ControlPoint><Position><WorldPosition x="9" y="0"/></Position></ControlPoint>
<Knot value="0"/><Knot value="0"/><Knot value="1"/><Knot value="1"/></Nurbs>""",
}


def _event(action: str, condition: str) -> str:
    return f"""<ManeuverGroup name="g" maximumExecutionCount="1"><Actors
selectTriggeringEntities="false"><EntityRef entityRef="bv"/></Actors><Maneuver name="m"><Event
name="e" priority="override" maximumExecutionCount="1"><Action name="a">{action}</Action>
<StartTrigger><ConditionGroup>{condition}</ConditionGroup></StartTrigger></Event></Maneuver>
</ManeuverGroup>"""


def _condition(text: str) -> str:
    return f'<Condition name="c" delay="0" conditionEdge="none">{text}</Condition>'


def examples() -> dict[str, str]:
    """Return by an element's name a scenario that has it in an event."""
    slower = f"<PrivateAction>{_longitudinal(speed_action(3))}</PrivateAction>"
    soon = after(0.2)
    found = {}
    for name, x in PRIVATE_ACTIONS.items():
        found[name] = _event(f"<PrivateAction>{x}</PrivateAction>", soon)
    for name, x in GLOBAL_ACTIONS.items():
        found[name] = _event(f"<GlobalAction>{x}</GlobalAction>", soon)
    found["CustomCommandAction"] = _event(
        '<UserDefinedAction><CustomCommandAction type="t">c</CustomCommandAction>'
        "</UserDefinedAction>", soon,
    )  # fmt: skip
    for name, x in ENTITY_CONDITIONS.items():
        of_bv = f"""<ByEntityCondition><TriggeringEntities triggeringEntitiesRule="any"><EntityRef
entityRef="bv"/></TriggeringEntities><EntityCondition>{x}</EntityCondition></ByEntityCondition>"""
        found[name] = _event(slower, _condition(of_bv))
    for name, x in VALUE_CONDITIONS.items():
        found[name] = _event(slower, _condition(f"<ByValueCondition>{x}</ByValueCondition>"))
    for name, x in POSITIONS.items():
        there = f"<TeleportAction><Position>{x}</Position></TeleportAction>"
        found[name] = _event(f"<PrivateAction>{there}</PrivateAction>", soon)
    for name, x in SHAPES.items():
        found[name] = _event(f"<PrivateAction>{_follow(x)}</PrivateAction>", soon)
    whole = {name: _whole(event) for name, event in found.items()}
    for name in AT_THE_START:
        first = f"<Init><Actions><GlobalAction>{GLOBAL_ACTIONS[name]}</GlobalAction>"
        whole[name] = _whole(_event(slower, soon)).replace("<Init><Actions>", first)
    return whole | {
        "ConnectTrailerAction": _with_a_trailer(whole["ConnectTrailerAction"]),
    }


def _with_a_trailer(text: str) -> str:
    """Return a file in which bv has a hitch, and a trailer stands somewhere."""
    body = vehicle("trailer").replace("</Vehicle>", '<TrailerCoupler dx="4"/></Vehicle>')
    at = text.index("</Vehicle>", text.index('<ScenarioObject name="bv">'))
    text = text[:at] + '<TrailerHitch dx="-1"/>' + text[at:]
    text = text.replace("</Entities>", body + "</Entities>")
    return text.replace("<Init><Actions>", f"<Init><Actions>{start('trailer', lane(1, 1, 9), 0)}")


def _whole(event: str) -> str:
    ego = start("ego", lane(3, 1, 40), 9.0, lane(3, 1, 40), lane(4, -1, 90))
    bv = start("bv", lane(2, 1, 20), 4.0, lane(2, 1, 20), lane(4, -1, 90))
    text = scenario(
        ("ego", "bv"), ego + bv, event,
        parameters='<ParameterDeclaration name="p" parameterType="double" value="1"/>',
    )  # fmt: skip
    text = text.replace(
        "<CatalogLocations/>",
        """<VariableDeclarations><VariableDeclaration name="w" variableType="double" value="1"/>
</VariableDeclarations><MonitorDeclarations><MonitorDeclaration name="m" value="false"/>
</MonitorDeclarations><CatalogLocations/>""",
    ).replace('revMinor="2"', 'revMinor="3"')
    return text.replace(
        '<LogicFile filepath="map.xodr"/>',
        """<LogicFile filepath="map.xodr"/><TrafficSignals><TrafficSignalController name="tc">
<Phase name="stop" duration="5"><TrafficSignalState trafficSignalId="lamp" state="on;off;off"/>
</Phase><Phase name="go" duration="5"><TrafficSignalState trafficSignalId="lamp"
state="off;off;on"/></Phase></TrafficSignalController></TrafficSignals>""",
    )
