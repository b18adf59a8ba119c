"""The events that are a scenario: its parameters in them, and what they say of its ranges."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bridgegen.base.arrays import Bool, Float
from bridgegen.base.errors import InputError
from bridgegen.recordings.events.event import NOT_WHOLE
from bridgegen.recordings.events.find import FoundEvents, named
from bridgegen.scenario.exposure.exposure import Encounters
from bridgegen.scenario.language.kinds import slack
from bridgegen.scenario.language.plain_yaml import Document
from bridgegen.scenario.language.reader import build, document_of, names, pack_names, shipped_text
from bridgegen.scenario.language.scenario import LogicalScenario
from bridgegen.scenario.language.storyboard import RecordedSpec, unmapped


@dataclass(frozen=True)
class Outside:
    """How far recorded values are outside a parameter's range.

    Attributes:
        parameter: its name.
        unit: its unit.
        low: the range's lower end.
        high: its upper end.
        below: how many values are less than ``low``.
        above: how many are more than ``high``.
        least: smallest value of all.
        most: largest value of all.
    """

    parameter: str
    unit: str
    low: float
    high: float
    below: int
    above: int
    least: float
    most: float


@dataclass(frozen=True)
class Broken:
    """A constraint that recorded events break.

    Attributes:
        rule: the constraint.
        events: names of the events that break it, in their order.
    """

    rule: str
    events: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class ScenarioEvents:
    """The events that are a scenario.

    Attributes:
        scenario: its name.
        kind: of the events.
        count: how many events are this scenario.
        rows: ``(N,)`` by parameter, of those that have a value of each, in the order of the events.
        names: ``(N,)`` of these events.
        incomplete: how many have not.
        outside: the parameters of which values are outside the declared range.
        broken: the constraints that rows break; what the events do not give has its default there.
        unmapped: the parameters of traffic participants that the events do not give.
        encounters: how often it was met; None if no vehicle that may be the ego was
            recorded where they can be.
    """

    scenario: str
    kind: str
    count: int
    rows: dict[str, Float]
    names: tuple[str, ...]
    incomplete: int
    outside: tuple[Outside, ...]
    broken: tuple[Broken, ...]
    unmapped: tuple[str, ...]
    encounters: Encounters | None

    @property
    def complete(self) -> int:
        """How many rows there are."""
        return self.count - self.incomplete


@dataclass(frozen=True)
class Sought:
    """A scenario whose events are looked for.

    Attributes:
        scenario: it.
        spec: its declaration of events.
        document: its file.
        path: of the file; None if it ships.
    """

    scenario: LogicalScenario
    spec: RecordedSpec
    document: Document
    path: Path | None


def recorded_scenarios(paths: Sequence[Path] = ()) -> tuple[Sought, ...]:
    """Return the scenarios that declare their events: those that ship, and a user's own.

    Raises:
        FileFormatError: a file is missing, unreadable, or no plain YAML.
        ScenarioError: it breaks rules.
        InputError: a file declares no events, or has the name of another scenario.
    """
    shipped = [item for item in (*names(), *pack_names()) if b"\nrecorded:" in shipped_text(item)]
    found = []
    sources: list[str | Path] = [*shipped, *paths]
    for source in sources:
        document, folder = document_of(source)
        scenario = build(document, folder)
        if scenario.recorded is None:
            raise InputError(
                f"{source}: a scenario to look for must have the key 'recorded', which says what "
                "its parameters are in recorded events"
            )
        found.append(
            Sought(
                scenario, scenario.recorded, document, source if isinstance(source, Path) else None
            )
        )
    twice = [
        name
        for name, count in Counter(sought.scenario.name for sought in found).items()
        if count > 1
    ]
    if twice:
        raise InputError(f"two scenarios to look for have the name '{twice[0]}': rename yours")
    return tuple(found)


def encounters_of(
    count: int, found: Sequence[FoundEvents], kind: str, *, needs_lights: bool = False
) -> Encounters | None:
    """Return how often events were met, in the driving in which they were looked for.

    Events that the recording cuts off are not among them, so the driving is scaled by the share
    that it does not (`whole_share`).

    Args:
        count: how many events there were.
        found: of all recordings.
        kind: of the events.
        needs_lights: whether only recordings with traffic lights say which events these are.

    Returns:
        None if there was no such driving.
    """
    share = whole_share(found, kind)
    driving = [events.driving(kind, needs_lights=needs_lights) for events in found]
    hours, km = (share * sum(pair[i] for pair in driving) for i in range(2))
    if hours <= 0.0:
        return None
    return Encounters(count, hours, km if km > 0.0 else None, "recorded traffic")


def whole_share(found: Sequence[FoundEvents], kind: str) -> float:
    """Return the share of the events of a kind that are recorded from begin to end."""
    same = [events for each in found for events in each.kinds if events.kind.name == kind]
    whole = sum(len(events) for events in same)
    cut_off = sum(events.refused.get(NOT_WHOLE, 0) for events in same)
    return whole / (whole + cut_off) if whole else 1.0


def scenario_events(
    scenario: LogicalScenario, spec: RecordedSpec, found: Sequence[FoundEvents]
) -> ScenarioEvents:
    """Return the events that are a scenario.

    Args:
        scenario: it.
        spec: its declaration.
        found: the events of all recordings.
    """
    counts, columns, names = 0, list[dict[str, Float]](), list[str]()
    for _, events, called in named(found):
        if events.kind.name == spec.event:
            kept = spec.counts(events.quantities)
            values = spec.values(events.quantities)
            counts += int(kept.sum())
            columns.append({name: column[kept] for name, column in values.items()})
            names += [
                name for name, counts_it in zip(called, kept.tolist(), strict=True) if counts_it
            ]
    table = {
        name: np.concatenate([np.empty(0), *(column[name] for column in columns)])
        for name in spec.parameters
    }
    whole = np.isfinite(np.array(list(table.values()))).all(axis=0)
    rows = {name: column[whole] for name, column in table.items()}
    called = tuple(name for name, is_whole in zip(names, whole.tolist(), strict=True) if is_whole)
    broken = tuple(
        Broken(rule, tuple(called[i] for i in np.flatnonzero(breaks)))
        for rule, breaks in broken_by(scenario, rows)
    )
    return ScenarioEvents(
        scenario.name,
        spec.event,
        counts,
        rows,
        called,
        int(counts - whole.sum()),
        tuple(_outside(scenario, rows)),
        broken,
        unmapped(spec, scenario.parameters),
        encounters_of(counts, found, spec.event, needs_lights=spec.needs_lights),
    )


def _outside(scenario: LogicalScenario, rows: dict[str, Float]) -> list[Outside]:
    found = []
    for name, values in rows.items():
        parameter = scenario.parameters[name]
        below, above = int((values < parameter.low).sum()), int((values > parameter.high).sum())
        if below or above:
            found.append(
                Outside(
                    name,
                    parameter.unit,
                    parameter.low,
                    parameter.high,
                    below,
                    above,
                    float(values.min()),
                    float(values.max()),
                )
            )
    return found


def broken_by(scenario: LogicalScenario, rows: dict[str, Float]) -> list[tuple[str, Bool]]:
    """Return the constraints that rows break, and which rows, ``(N,)``.

    Args:
        scenario: whose constraints.
        rows: ``(N,)`` by parameter; the others have their defaults.
    """
    count = len(next(iter(rows.values())))
    if not count:
        return []
    table = {name: np.full(count, value) for name, value in scenario.usual_values().items()} | rows
    for derived in scenario.derived:
        table[derived.name] = np.broadcast_to(derived.value.evaluate(table), (count,))
    found = []
    for bound in scenario.bounds:
        sides = [side for side in (bound.lo, bound.hi) if side is not None]
        if bound.target not in rows and not any(side.names & rows.keys() for side in sides):
            continue
        value, breaks = table[bound.target], np.zeros(count, np.bool_)
        if bound.lo is not None:
            limit = np.asarray(bound.lo.evaluate(table))
            breaks |= value < limit - slack(limit)
        if bound.hi is not None:
            limit = np.asarray(bound.hi.evaluate(table))
            breaks |= value > limit + slack(limit)
        if breaks.any():
            found.append((str(bound), breaks))
    return found
