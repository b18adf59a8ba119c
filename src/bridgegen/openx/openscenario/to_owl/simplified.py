"""OpenSCENARIO2OWL, before it: other people's files, said as the ontology says the same.

- Places and speeds relative to an entity at the start become absolute (`starts`).
- An act that starts later hands its conditions on to its events, where these last.
- Who waits for the only action of an event waits for the event.
- A lane that is named, or counted from another entity's, is counted from the actor's own, where
  both keep to their lanes otherwise.
- Actions on which nothing depends that happens are left out.
"""

from collections import Counter
from collections.abc import Iterator
from dataclasses import replace
from functools import partial

from bridgegen.openx.opendrive.model import OpenDrive
from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario import parameters
from bridgegen.openx.openscenario.element import Element, rewritten, walk
from bridgegen.openx.openscenario.pruning import is_empty
from bridgegen.openx.openscenario.to_owl.build import Lost
from bridgegen.openx.openscenario.to_owl.differences import is_detail
from bridgegen.openx.openscenario.to_owl.events import named_elements
from bridgegen.openx.openscenario.to_owl.lights import known_light
from bridgegen.openx.openscenario.to_owl.starts import Starts

_LEAST = (osc.Rule.GREATER_THAN, osc.Rule.GREATER_OR_EQUAL)
_BEGUN = ("startTransition", "runningState")
_ENDED = ("endTransition", "completeState")
_ON_MAP = osc.RoutePosition | osc.RoadPosition | osc.LanePosition
Wrapped = osc.PrivateAction | osc.GlobalAction | osc.UserDefinedAction
_ONCE = osc.StoryboardElementType.EVENT


def simplified(scenario: osc.OpenScenario, roads: OpenDrive) -> tuple[osc.OpenScenario, list[Lost]]:
    """Return a scenario of which more can be said in the ontology, and what it lacks then."""
    made = _Simplified(scenario, roads)
    return made.scenario, made.lost


class _Simplified:
    def __init__(self, scenario: osc.OpenScenario, roads: OpenDrive) -> None:
        self.lost: list[Lost] = []
        storyboard = scenario.storyboard
        self._read = set(_variables(storyboard))
        declared = scenario.variable_declarations
        if declared is not None and not self._read:
            self.lost.append(Lost(declared.line, "VariableDeclarations", is_detail=True))
            scenario = replace(scenario, variable_declarations=None)
        elif declared is not None:
            kept = tuple(variable for variable in declared.variables if variable.name in self._read)
            scenario = replace(scenario, variable_declarations=replace(declared, variables=kept))
        self._named = named_elements(
            storyboard, partial(parameters.text_of, parameters.values(scenario))
        )
        self._starts = Starts(scenario, _placed(storyboard.init.actions), roads)
        events = list(_events(storyboard))
        names = Counter(str(action.name) for _, event in events for action in event.actions)
        self._only = {
            str(event.actions[0].name): str(event.name)
            for _, event in events
            if len(event.actions) == 1
            and event.maximum_execution_count in (None, 1)
            and names[str(event.actions[0].name)] == 1
        }
        self._changes = Counter(
            name
            for group, event in events
            for wrapped in event.actions
            if isinstance(_inner(wrapped.action), osc.LaneChangeAction)
            for name in self._actors(group)
        )
        initial = _placed(storyboard.init.actions)
        privates = tuple(self._begun(private) for private in initial.privates)
        stories = [self._story(story) for story in storyboard.stories]
        actions = replace(storyboard.init.actions, privates=privates)
        init = replace(storyboard.init, actions=actions)
        told = replace(storyboard, init=init, stories=tuple(stories))
        self.scenario = replace(scenario, storyboard=rewritten(told, self._on_map))

    def _on_map(self, element: Element) -> Element:
        """Return a place along a route, or by a road's coordinates, as one the ontology knows.

        And a trajectory without the times that do not count.
        """
        if isinstance(element, osc.FollowTrajectoryAction) and not isinstance(
            element.time_reference.reference, osc.Timing
        ):
            return replace(element, trajectory_ref=rewritten(element.trajectory_ref, _untimed))
        if not isinstance(element, osc.Position) or not isinstance(element.position, _ON_MAP):
            return element
        found = self._starts.place(element)
        if found is None:
            return element
        where = found.position
        if element.position.orientation is None and isinstance(where, osc.LanePosition):
            return replace(found, position=replace(where, orientation=None))
        if element.position.orientation is None and isinstance(where, osc.WorldPosition):
            return replace(found, position=replace(where, h=None))
        return found

    # -- the start ---------------------------------------------------------------------------------

    def _begun(self, private: osc.Private) -> osc.Private:
        """Return what an entity does at the start."""
        kept = []
        for wrapped in private.private_actions:
            inner = _inner(wrapped)
            is_lit = known_light(inner, self._starts.text) is not None
            if is_detail(inner) and not is_lit:
                what = f"an initial {type(inner).__name__}"
                self.lost.append(Lost(wrapped.line, what, is_detail=True))
            else:
                kept.append(self._starts.absolute(wrapped))
        return replace(private, private_actions=tuple(kept))

    # -- what follows ------------------------------------------------------------------------------

    def _story(self, story: osc.Story) -> osc.Story:
        return replace(story, acts=tuple(self._act(act) for act in story.acts))

    def _act(self, act: osc.Act) -> osc.Act:
        stop = act.stop_trigger
        if stop is not None and stop.condition_groups:  # it says when one looks no further
            self.lost.append(Lost(stop.line, "StopTrigger of Act", is_detail=True))
            act = replace(act, stop_trigger=None)
        begins = _lasting(act.start_trigger)
        if ("act", self._starts.text(act.name)) in self._named:
            begins = None
        if begins is not None:
            act = replace(act, start_trigger=None)
        groups = [
            replace(
                group,
                maneuvers=tuple(
                    self._maneuver(group, maneuver, begins) for maneuver in group.maneuvers
                ),
            )
            for group in act.maneuver_groups
        ]
        return replace(act, maneuver_groups=tuple(groups))

    def _maneuver(
        self, group: osc.ManeuverGroup, maneuver: osc.Maneuver, begins: osc.ConditionGroup | None
    ) -> osc.Maneuver:
        events = []
        alike = len({_domain(item) for event in maneuver.events for item in event.actions}) == 1
        for event in maneuver.events:
            actions = []
            for action in event.actions:
                inner = _inner(action.action)
                is_lit = known_light(inner, self._starts.text) is not None
                if (is_detail(inner) and not is_lit) or self._is_unread(action):
                    self.lost.append(Lost(action.line, type(inner).__name__, is_detail=True))
                else:
                    actions.append(
                        replace(action, action=self._counted(group, self._put(action.action)))
                    )
            if not actions and ("event", self._starts.text(event.name)) not in self._named:
                continue
            actions = actions or list(event.actions)  # somebody waits for them
            if alike and event.priority in (osc.Priority.OVERRIDE, osc.Priority.OVERWRITE):
                # An action of the same kind ends the one before in any case.
                event = replace(event, priority=osc.Priority.PARALLEL)
            trigger = self._trigger(event.start_trigger)
            event = replace(event, actions=tuple(actions), start_trigger=trigger)
            events.append(event if begins is None else _after(event, begins))
        return replace(maneuver, events=tuple(events))

    def _put(self, wrapped: Wrapped) -> Wrapped:
        """Return an action that teleports to a place with the heading there."""
        if (
            isinstance(wrapped, osc.PrivateAction)
            and isinstance(wrapped.action, osc.TeleportAction)
            and isinstance(wrapped.action.position.position, _ON_MAP)
        ):
            return self._starts.absolute(wrapped)
        return wrapped

    def _is_unread(self, action: osc.Action) -> bool:
        """Return whether an action sets a variable that no event waits for."""
        wrapped = action.action
        environment_action = wrapped.action if isinstance(wrapped, osc.GlobalAction) else None
        return (
            isinstance(environment_action, osc.VariableAction)
            and str(environment_action.variable_ref) not in self._read
        )

    def _trigger(self, trigger: osc.Trigger | None) -> osc.Trigger | None:
        if trigger is None:
            return None
        groups = []
        for group in trigger.condition_groups:
            alone = len(group.conditions) == 1
            conditions = tuple(self._condition(condition, alone) for condition in group.conditions)
            groups.append(replace(group, conditions=conditions))
        return replace(trigger, condition_groups=tuple(groups))

    def _condition(self, condition: osc.Condition, alone: bool) -> osc.Condition:
        """Return a condition on an event where it is one on the event's only action.

        A transition is a moment, a state lasts: one stands for the other where nothing else must
        be true at that moment.
        """
        wrapped = condition.condition
        if not isinstance(wrapped, osc.ByValueCondition):
            return condition
        storyboard_element_state_condition = wrapped.condition
        if not isinstance(storyboard_element_state_condition, osc.StoryboardElementStateCondition):
            return condition
        name, state = (
            str(storyboard_element_state_condition.storyboard_element_ref),
            str(storyboard_element_state_condition.state),
        )
        if (
            str(storyboard_element_state_condition.storyboard_element_type) == "action"
            and name in self._only
        ):
            name = self._only[name]
        elif str(storyboard_element_state_condition.storyboard_element_type) != "event":
            return condition
        at = osc.StoryboardElementState
        known = at.COMPLETE_STATE if state in _ENDED else at.START_TRANSITION
        if state not in (*_ENDED, *_BEGUN) or not (alone or state == _ENDED[-1]):
            return condition
        edge = condition.condition_edge
        if edge is osc.ConditionEdge.RISING and alone:
            edge = osc.ConditionEdge.NONE
        changed = replace(
            storyboard_element_state_condition,
            storyboard_element_ref=name,
            storyboard_element_type=_ONCE,
            state=known,
        )
        return replace(
            condition,
            condition=replace(wrapped, condition=changed),
            condition_edge=edge,
        )

    # -- lanes -------------------------------------------------------------------------------------

    def _actors(self, group: osc.ManeuverGroup) -> list[str]:
        return [self._starts.text(ref.entity_ref) for ref in group.actors.entity_refs]

    def _counted(
        self,
        group: osc.ManeuverGroup,
        wrapped: Wrapped,
    ) -> Wrapped:
        """Return a lane change whose lanes count from the actor's own, where both are known."""
        action = _inner(wrapped)
        actors = self._actors(group)
        if (
            not isinstance(action, osc.LaneChangeAction)
            or not isinstance(wrapped, osc.PrivateAction)
            or not isinstance(wrapped.action, osc.LateralAction)
            or len(actors) != 1
            or self._changes[actors[0]] != 1
        ):
            return wrapped
        (actor,) = actors
        target = action.lane_change_target.target
        own, way = self._starts.lane(actor), self._starts.way(actor)
        if own is None or not way:
            return wrapped
        if isinstance(target, osc.AbsoluteTargetLane):
            try:
                lane = int(self._starts.text(target.value))
            except ValueError:
                return wrapped
        else:
            other = self._starts.text(target.entity_ref)
            there = self._starts.lane(other)
            if other == actor or self._changes[other] or there is None or there[0] != own[0]:
                return wrapped
            lane = there[1] + round(self._starts.number(target.value)) * self._starts.way(other)
        if lane * own[1] <= 0:
            return wrapped
        count = (lane - own[1]) * way
        if count == 0:
            return wrapped
        said = f"{type(target).__name__} (counted from the lane that {actor} starts on)"
        self.lost.append(Lost(target.line, said, is_detail=True))
        relative = osc.RelativeTargetLane(actor, count, line=target.line)
        changed = replace(action, lane_change_target=osc.LaneChangeTarget(relative))
        return replace(wrapped, action=replace(wrapped.action, action=changed))


def _placed(actions: osc.InitActions) -> osc.InitActions:
    """Return initial actions in which who is added is put there."""
    kept, added = [], []
    for global_action in actions.global_actions:
        action = global_action.action
        if isinstance(action, osc.EntityAction) and isinstance(action.action, osc.AddEntityAction):
            put = osc.PrivateAction(
                osc.TeleportAction(action.action.position), line=global_action.line
            )
            added.append(osc.Private(action.entity_ref, (put,), line=global_action.line))
        else:
            kept.append(global_action)
    privates = tuple(map(_at_its_trajectory, actions.privates))
    return replace(actions, global_actions=tuple(kept), privates=(*added, *privates))


def _untimed(element: Element) -> Element:
    return replace(element, time=None) if isinstance(element, osc.Vertex) else element


def _at_its_trajectory(private: osc.Private) -> osc.Private:
    """Return the start of an entity that follows a trajectory, and so is at its first vertex."""
    first: osc.Position | None = None
    for wrapped in private.private_actions:
        inner = _inner(wrapped)
        if isinstance(wrapped.action, osc.TeleportAction):
            return private
        if isinstance(inner, osc.FollowTrajectoryAction):
            first = _first(inner.trajectory_ref.trajectory.shape.shape)
    if first is None:
        return private
    put = osc.PrivateAction(osc.TeleportAction(first), line=private.line)
    return replace(private, private_actions=(put, *private.private_actions))


def _first(
    line: osc.Polyline | osc.Clothoid | osc.ClothoidSpline | osc.Nurbs,
) -> osc.Position | None:
    """Return where a line begins, if it says so."""
    if isinstance(line, osc.Polyline):
        return line.vertices[0].position
    if isinstance(line, osc.Nurbs):
        return line.control_points[0].position
    return line.position if isinstance(line, osc.Clothoid) else line.segments[0].position_start


def _events(storyboard: osc.Storyboard) -> Iterator[tuple[osc.ManeuverGroup, osc.Event]]:
    for story in storyboard.stories:
        for act in story.acts:
            for group in act.maneuver_groups:
                for maneuver in group.maneuvers:
                    for event in maneuver.events:
                        yield group, event


def _variables(storyboard: osc.Storyboard) -> Iterator[str]:
    """Yield the names of the variables that acts, events and the end wait for."""
    acts = [act for story in storyboard.stories for act in story.acts]
    triggers = [storyboard.stop_trigger, *(act.start_trigger for act in acts)]
    triggers += [event.start_trigger for _, event in _events(storyboard)]
    for trigger in triggers:
        for group in () if trigger is None else trigger.condition_groups:
            for condition in group.conditions:
                variable_condition = getattr(condition.condition, "condition", None)
                if isinstance(variable_condition, osc.VariableCondition):
                    yield str(variable_condition.variable_ref)


def _inner(wrapped: object) -> object:
    """Return the innermost element that says what is done."""
    action = getattr(wrapped, "action", wrapped)
    return getattr(action, "action", action)


def _domain(action: osc.Action) -> type[object]:
    """Return what an action moves: along the lane, across it, or what else it is."""
    wrapped = action.action
    return type(wrapped.action) if isinstance(wrapped, osc.PrivateAction) else type(wrapped)


def _lasting(trigger: osc.Trigger | None) -> osc.ConditionGroup | None:
    """Return the conditions of a trigger if they stay true once they are; None otherwise."""
    if trigger is None or len(trigger.condition_groups) != 1:
        return None
    (group,) = trigger.condition_groups
    if not group.conditions or not all(map(_lasts, group.conditions)):
        return None
    return group


def _lasts(condition: osc.Condition) -> bool:
    wrapped = condition.condition
    value: object = None
    if isinstance(wrapped, osc.ByValueCondition):
        value = wrapped.condition
    elif isinstance(wrapped, osc.ByEntityCondition):
        value = wrapped.entity_condition.condition
    edges = (osc.ConditionEdge.NONE, osc.ConditionEdge.RISING)
    if condition.condition_edge not in edges or condition.delay != 0.0:
        return False
    if isinstance(value, osc.SimulationTimeCondition):
        return value.rule in _LEAST
    return isinstance(value, osc.TraveledDistanceCondition)


def _after(event: osc.Event, begins: osc.ConditionGroup) -> osc.Event:
    """Return an event that needs some lasting conditions besides its own."""
    if all(map(_is_start, begins.conditions)) and (event.start_trigger or _at_zero(begins)):
        return event
    none = osc.ConditionEdge.NONE
    lasting = tuple(replace(condition, condition_edge=none) for condition in begins.conditions)
    own = event.start_trigger
    groups = own.condition_groups if own is not None else ()
    found = tuple(replace(group, conditions=(*group.conditions, *lasting)) for group in groups)
    return replace(event, start_trigger=osc.Trigger(found or (osc.ConditionGroup(lasting),)))


def _at_zero(begins: osc.ConditionGroup) -> bool:
    """Return whether times are true at 0, and not just after it."""
    return all(
        isinstance(condition.condition, osc.ByValueCondition)
        and isinstance(condition.condition.condition, osc.SimulationTimeCondition)
        and condition.condition.condition.rule is osc.Rule.GREATER_OR_EQUAL
        for condition in begins.conditions
    )


def _is_start(condition: osc.Condition) -> bool:
    """Return whether a condition is true from the start."""
    wrapped = condition.condition
    parameter_condition = wrapped.condition if isinstance(wrapped, osc.ByValueCondition) else None
    return (
        isinstance(parameter_condition, osc.SimulationTimeCondition)
        and parameter_condition.value == 0.0
    )


# --- OpenSCENARIO2OWL, before it: what a file's parameters and empty triggers decide beforehand ---
# A condition on a parameter that no action sets is always true or never; what has an empty
# StartTrigger never begins. The ontology's scenarios are concrete: what never happens is left out.


_AT_ONCE = osc.ConditionGroup(
    (
        osc.Condition(
            "at_once",
            0.0,
            osc.ConditionEdge.NONE,
            osc.ByValueCondition(osc.SimulationTimeCondition(0.0, osc.Rule.GREATER_OR_EQUAL)),
        ),
    )
)


def without_foregone(scenario: osc.OpenScenario) -> tuple[osc.OpenScenario, list[Lost]]:
    """Return a scenario without conditions that are decided, and what it lacks then."""
    made = _Foregone(scenario)
    stories = tuple(made.story(story) for story in scenario.storyboard.stories)
    kept = tuple(story for story in stories if story is not None)
    return replace(scenario, storyboard=replace(scenario.storyboard, stories=kept)), made.lost


class _Foregone:
    def __init__(self, scenario: osc.OpenScenario) -> None:
        self.lost: list[Lost] = []
        declared = scenario.parameter_declarations
        self._declared = (
            {parameter.name: parameter for parameter in declared.parameters} if declared else {}
        )
        self._values = parameters.values(scenario)
        self._set = {
            str(node.parameter_ref)
            for node in walk(scenario.storyboard)
            if isinstance(node, osc.ParameterAction)
        }

    def story(self, story: osc.Story) -> osc.Story | None:
        acts = tuple(item for act in story.acts if (item := self._act(act)) is not None)
        return replace(story, acts=acts) if acts else None

    def _act(self, act: osc.Act) -> osc.Act | None:
        if self._never(act):
            return None
        groups = tuple(
            replace(group, maneuvers=maneuvers)
            for group in act.maneuver_groups
            if (maneuvers := tuple(self._maneuvers(group)))
        )
        if not groups:
            return None
        return replace(act, maneuver_groups=groups, start_trigger=self._trigger(act.start_trigger))

    def _maneuvers(self, group: osc.ManeuverGroup) -> list[osc.Maneuver]:
        found = []
        for maneuver in group.maneuvers:
            events = tuple(
                replace(event, start_trigger=self._trigger(event.start_trigger))
                for event in maneuver.events
                if not self._never(event)
            )
            if events:
                found.append(replace(maneuver, events=events))
        return found

    def _never(self, element: osc.Act | osc.Event) -> bool:
        """Return whether an act or event never begins; it is noted then."""
        trigger, what = element.start_trigger, f"{type(element).__name__} {element.name}"
        if is_empty(trigger):
            text = f"the {what}, which never begins: its StartTrigger is empty"
            self.lost.append(Lost(element.line, text, is_detail=True))
            return True
        if trigger is None or any(self._may_hold(group) for group in trigger.condition_groups):
            return False
        text = f"the {what}, which never begins: a ParameterCondition of its trigger is false"
        self.lost.append(Lost(element.line, text, is_detail=True))
        return True

    def _may_hold(self, group: osc.ConditionGroup) -> bool:
        return all(self._decided(condition) is not False for condition in group.conditions)

    def _trigger(self, trigger: osc.Trigger | None) -> osc.Trigger | None:
        if trigger is None:
            return None
        groups = []
        for group in trigger.condition_groups:
            if not self._may_hold(group):
                continue
            left = tuple(
                condition for condition in group.conditions if self._decided(condition) is None
            )
            groups.append(replace(group, conditions=left) if left else _AT_ONCE)
        return replace(trigger, condition_groups=tuple(groups))

    def _decided(self, condition: osc.Condition) -> bool | None:
        """Return whether a condition is always true, or never; None where it may change."""
        wrapped = condition.condition
        parameter_condition = (
            wrapped.condition if isinstance(wrapped, osc.ByValueCondition) else None
        )
        if not isinstance(parameter_condition, osc.ParameterCondition):
            return None
        declaration = self._declared.get(str(parameter_condition.parameter_ref))
        unmoved = condition.condition_edge is osc.ConditionEdge.NONE and condition.delay == 0.0
        if declaration is None or not unmoved or declaration.name in self._set:
            return None
        rule = osc.Rule(parameters.text_of(self._values, parameter_condition.rule))
        said = (
            str(parameter_condition.value).lower()
            if isinstance(parameter_condition.value, bool)
            else str(parameter_condition.value)
        )
        limit = replace(
            declaration,
            constraint_groups=(osc.ValueConstraintGroup((osc.ValueConstraint(rule, said),)),),
        )
        return not parameters.broken(limit, self._values[declaration.name], self._values)
