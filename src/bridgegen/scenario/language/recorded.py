"""Which recorded events a scenario is, and what its parameters are in them."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from bridgegen.base.arrays import Bool, Float
from bridgegen.base.errors import InputError
from bridgegen.scenario.language.event_kinds import EVENT_KINDS, EventKind
from bridgegen.scenario.language.expression import Expression, parse
from bridgegen.scenario.language.parameters import Axis, Derived, Parameter, at, nearest
from bridgegen.scenario.language.plain_yaml import Document
from bridgegen.scenario.language.shape import Formula, ShapedSection, Text, section


@dataclass(frozen=True)
class RecordedSpec:
    """What of recorded traffic is this scenario.

    Attributes:
        event: one of `EVENT_KINDS`.
        parameters: a formula of the event's quantities, by parameter.
        where: which events count; None for all.
        place: file and line that declare it, for messages.
    """

    event: str
    parameters: Mapping[str, Expression]
    where: Expression | None = None
    place: str = field(default="", compare=False, repr=False)

    @property
    def needs_lights(self) -> bool:
        """Whether only recordings with traffic lights say which events count."""
        kind = EVENT_KINDS[self.event]
        return kind.needs_lights or (
            self.where is not None and not self.where.names.isdisjoint(kind.of_lights)
        )

    def counts(self, quantities: Mapping[str, Float]) -> Bool:
        """Return which events count, ``(N,)``; not where a quantity that decides is missing.

        Args:
            quantities: ``(N,)`` by name.
        """
        n = len(next(iter(quantities.values())))
        if self.where is None:
            return np.ones(n, np.bool_)
        missing = [np.isnan(quantities[name]) for name in sorted(self.where.names)]
        true = np.broadcast_to(self.where.evaluate(quantities) != 0.0, (n,))
        return np.asarray(true & ~np.any(missing, axis=0)) if missing else np.array(true)

    def values(self, quantities: Mapping[str, Float]) -> dict[str, Float]:
        """Return the parameters of events, ``(N,)`` each; NaN where a quantity is missing."""
        n = len(next(iter(quantities.values())))
        return {
            name: np.broadcast_to(one.evaluate(quantities), (n,)).copy()
            for name, one in self.parameters.items()
        }


class RecordedSection(ShapedSection):
    """The recorded events that are this scenario, and its parameters in them."""

    event: Text
    """The kind of event; see docs/recordings.md."""
    parameters: dict[str, Formula]
    """By parameter of the scenario: a formula of the event's quantities."""
    where: Text | None = None
    """Which events count: a condition on their quantities."""


def read_recorded(
    document: Document, parameters: Mapping[str, Parameter], derived: Mapping[str, Derived]
) -> tuple[RecordedSpec | None, list[str]]:
    """Return the block ``recorded`` of a scenario file, and what is wrong with it.

    What has not the shape of the block is left to the check of the file's shape.
    """
    data = document.data.get("recorded") if isinstance(document.data, dict) else None
    given = section(RecordedSection, data) if data is not None else None
    if given is None:
        return None, []
    place = document.at(("recorded",))
    kind = EVENT_KINDS.get(given.event)
    if kind is None:
        known = nearest(given.event, EVENT_KINDS) or f"; known: {', '.join(EVENT_KINDS)}"
        where = at(document.at(("recorded", "event")))
        return None, [f"recorded.event names the unknown event '{given.event}'{known}{where}"]
    problems: list[str] = []
    formulas: dict[str, Expression] = {}
    if not given.parameters:
        problems.append(f"recorded.parameters must name a parameter{at(place)}")
    for name, formula in given.parameters.items():
        line = document.at(("recorded", "parameters", name))
        problems += [
            f"recorded.parameters{problem}{at(line)}"
            for problem in _target_problems(name, parameters, derived)
        ]
        one = _formula(str(formula), f"recorded.parameters.{name}", kind, line, problems)
        if one is not None:
            formulas[name] = one
    condition = None
    if given.where is not None:
        line = document.at(("recorded", "where"))
        condition = _formula(given.where, "recorded.where", kind, line, problems)
    return RecordedSpec(given.event, formulas, condition, place), problems


def unmapped(
    spec: RecordedSpec, parameters: Mapping[str, Parameter], axis: Axis = Axis.PARTICIPANTS
) -> tuple[str, ...]:
    """Return the parameters of an axis that the events do not give."""
    return tuple(
        name for name, one in parameters.items() if one.axis is axis and name not in spec.parameters
    )


def _target_problems(
    name: str, parameters: Mapping[str, Parameter], derived: Mapping[str, Derived]
) -> list[str]:
    if name in derived:
        return [f".{name} is derived: state the parameters that it follows from"]
    if name not in parameters:
        return [f" names the unknown parameter '{name}'{nearest(name, parameters)}"]
    if parameters[name].kind.names:
        return [f".{name} is a category, and events give numbers"]
    return []


def _formula(
    text: str, label: str, kind: EventKind, line: str, problems: list[str]
) -> Expression | None:
    try:
        one = parse(text, line)
    except InputError as error:
        problems += error.problems
        return None
    problems += [
        f"{label} names '{name}', which is no quantity of '{kind.name}'"
        f"{nearest(name, kind.quantities) or '; it has ' + ', '.join(kind.quantities)}{at(line)}"
        for name in sorted(one.names - kind.quantities.keys())
    ]
    return one
