"""OpenSCENARIO2OWL, before it: what a file's parameters and empty triggers decide beforehand.

A condition on a parameter that no action sets is always true or never; what has an empty
StartTrigger never begins. The ontology's scenarios are concrete: what never happens is left out.
"""

from dataclasses import replace

from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario import parameters
from bridgegen.openx.openscenario.element import walk
from bridgegen.openx.openscenario.empty_triggers import is_empty
from bridgegen.openx.openscenario.to_owl.build import Lost

_AT_ONCE = osc.ConditionGroup(
    (
        osc.Condition(
            "at_once", 0.0, osc.ConditionEdge.NONE,
            osc.ByValueCondition(osc.SimulationTimeCondition(0.0, osc.Rule.GREATER_OR_EQUAL)),
        ),
    )
)  # fmt: skip


def without_foregone(scenario: osc.OpenScenario) -> tuple[osc.OpenScenario, list[Lost]]:
    """Return a scenario without conditions that are decided, and what it lacks then."""
    made = _Foregone(scenario)
    stories = tuple(made.story(one) for one in scenario.storyboard.stories)
    kept = tuple(one for one in stories if one is not None)
    return replace(scenario, storyboard=replace(scenario.storyboard, stories=kept)), made.lost


class _Foregone:
    def __init__(self, scenario: osc.OpenScenario) -> None:
        self.lost: list[Lost] = []
        declared = scenario.parameter_declarations
        self._declared = {one.name: one for one in declared.parameters} if declared else {}
        self._values = parameters.values(scenario)
        self._set = {
            str(one.parameter_ref)
            for one in walk(scenario.storyboard)
            if isinstance(one, osc.ParameterAction)
        }

    def story(self, story: osc.Story) -> osc.Story | None:
        acts = tuple(one for act in story.acts if (one := self._act(act)) is not None)
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
        if trigger is None or any(self._may_hold(one) for one in trigger.condition_groups):
            return False
        text = f"the {what}, which never begins: a ParameterCondition of its trigger is false"
        self.lost.append(Lost(element.line, text, is_detail=True))
        return True

    def _may_hold(self, group: osc.ConditionGroup) -> bool:
        return all(self._decided(one) is not False for one in group.conditions)

    def _trigger(self, trigger: osc.Trigger | None) -> osc.Trigger | None:
        if trigger is None:
            return None
        groups = []
        for group in trigger.condition_groups:
            if not self._may_hold(group):
                continue
            left = tuple(one for one in group.conditions if self._decided(one) is None)
            groups.append(replace(group, conditions=left) if left else _AT_ONCE)
        return replace(trigger, condition_groups=tuple(groups))

    def _decided(self, condition: osc.Condition) -> bool | None:
        """Return whether a condition is always true, or never; None where it may change."""
        wrapped = condition.condition
        one = wrapped.condition if isinstance(wrapped, osc.ByValueCondition) else None
        if not isinstance(one, osc.ParameterCondition):
            return None
        declaration = self._declared.get(str(one.parameter_ref))
        unmoved = condition.condition_edge is osc.ConditionEdge.NONE and condition.delay == 0.0
        if declaration is None or not unmoved or declaration.name in self._set:
            return None
        rule = osc.Rule(parameters.text_of(self._values, one.rule))
        said = str(one.value).lower() if isinstance(one.value, bool) else str(one.value)
        limit = replace(declaration, constraint_groups=(
            osc.ValueConstraintGroup((osc.ValueConstraint(rule, said),)),
        ))  # fmt: skip
        return not parameters.broken(limit, self._values[declaration.name], self._values)
