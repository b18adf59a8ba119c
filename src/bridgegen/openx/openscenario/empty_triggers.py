"""Empty StartTriggers: by the standard they never fire, esmini starts what has one at once.

Source: ASAM OpenSCENARIO XML 1.1, ``Trigger``: "an empty trigger", that is one without a group of
conditions, evaluates to false; esmini's own scenarios rely on the other reading.
"""

from dataclasses import replace

from bridgegen.base.errors import UnknownNameError
from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.element import Element, rewritten

NEVER, NOW = "never", "now"
READINGS = (NEVER, NOW)

_AT_ONCE = osc.Trigger(
    (
        osc.ConditionGroup(
            (
                osc.Condition(
                    "at_once",
                    0.0,
                    osc.ConditionEdge.NONE,
                    osc.ByValueCondition(
                        osc.SimulationTimeCondition(0.0, osc.Rule.GREATER_OR_EQUAL)
                    ),
                ),
            )
        ),
    )
)


def is_empty(trigger: osc.Trigger | None) -> bool:
    """Return whether a trigger is there and has no condition."""
    return trigger is not None and not trigger.condition_groups


def read_empty_triggers(scenario: osc.OpenScenario, reading: str) -> osc.OpenScenario:
    """Return a scenario file whose acts and events with an empty StartTrigger start as one says.

    Args:
        scenario: the file.
        reading: "never", by the standard, or "now", as esmini does.

    Raises:
        UnknownNameError: no such reading.
    """
    if reading not in READINGS:
        raise UnknownNameError("reading of empty triggers", reading, READINGS)
    return scenario if reading == NEVER else rewritten(scenario, _started)


def _started(element: Element) -> Element:
    if isinstance(element, osc.Act | osc.Event) and is_empty(element.start_trigger):
        return replace(element, start_trigger=_AT_ONCE)
    return element
