"""The pass criteria that a scenario file states: those of CARLA's ScenarioRunner.

It writes them as conditions of the stop trigger on parameters, named ``criteria_…``.
"""

from collections.abc import Callable

from bridgegen.base.errors import InputError
from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.element import walk
from bridgegen.scenario.language.criteria import Criterion

_FORMULAS: dict[str, tuple[str, Callable[[float], str]]] = {
    "CollisionTest": ("The ego does not collide.", lambda _: "n_collision == 0"),
    "RunningRedLightTest": ("The ego runs no red light.", lambda _: "r_red == 0"),
    "DrivenDistanceTest": (
        "The ego travels at least this distance.",
        lambda value: f"last(ego.travelled) >= {value:g} m",
    ),
}
"""Descriptions of ScenarioRunner's criteria, and functions from a condition's value to our
formula."""


def stated_criteria(scenario: osc.OpenScenario) -> tuple[tuple[Criterion, ...], tuple[str, ...]]:
    """Return the criteria that a file states, and a sentence for those that are not evaluated.

    Source: ScenarioRunner 0.9.16, names of its criteria (``atomic_criteria``).
    """
    trigger = getattr(scenario.storyboard, "stop_trigger", None)
    found: dict[str, Criterion] = {}
    unknown: list[str] = []
    for node in walk(trigger) if trigger is not None else ():
        if not (isinstance(node, osc.Condition) and node.is_criterion):
            continue
        name = str(node.name).removeprefix(osc.CRITERIA)
        made = _criterion(name, node)
        if made is None:
            unknown.append(name)
        else:
            found.setdefault(name, made)
    notes: tuple[str, ...] = ()
    if unknown:
        names = ", ".join(dict.fromkeys(unknown))
        notes = (f"criteria of ScenarioRunner that are not evaluated here: {names}",)
    return tuple(found.values()), notes


def _criterion(name: str, condition: osc.Condition) -> Criterion | None:
    """Return our criterion for one of ScenarioRunner's; None if it is not evaluated here."""
    if name not in _FORMULAS:
        return None
    text, formula = _FORMULAS[name]
    value = getattr(getattr(condition.condition, "condition", None), "value", "")
    try:
        number = float(str(value) or "0")
        return Criterion(name, formula(number), text, tags=("ScenarioRunner",))
    except (ValueError, InputError):
        return None
