"""The events that are a scenario: its parameters in them, and what they say of its ranges."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bridgegen.arrays import Float
from bridgegen.errors import InputError
from bridgegen.exposure.rates import Encounters
from bridgegen.mining.events.event import Events
from bridgegen.mining.events.find import FoundEvents
from bridgegen.odd.kinds import slack
from bridgegen.odd.reader import load, names, pack_names, shipped_text
from bridgegen.odd.recorded import RecordedSpec, unmapped
from bridgegen.odd.scenario import LogicalScenario


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


@dataclass(frozen=True, eq=False)
class ScenarioEvents:
    """The events that are a scenario.

    Attributes:
        scenario: its name.
        kind: of the events.
        count: how many events are this scenario.
        rows: ``(N,)`` by parameter, of those that have a value of each, in the order of the events.
        incomplete: how many have not.
        outside: the parameters of which values are outside the declared range.
        broken: the constraints that rows break, each with their number; what the events do not
            give has its default there.
        unmapped: the parameters of traffic participants that the events do not give.
        encounters: how often it was met; None if no vehicle that may be the ego was on lanes.
    """

    scenario: str
    kind: str
    count: int
    rows: dict[str, Float]
    incomplete: int
    outside: tuple[Outside, ...]
    broken: tuple[tuple[str, int], ...]
    unmapped: tuple[str, ...]
    encounters: Encounters | None

    @property
    def complete(self) -> int:
        """How many rows there are."""
        return self.count - self.incomplete


def recorded_scenarios(paths: Sequence[Path] = ()) -> tuple[LogicalScenario, ...]:
    """Return the scenarios that declare their events: those that ship, and a user's own.

    Raises:
        FileFormatError: a file is missing, unreadable, or no plain YAML.
        ScenarioError: it breaks rules.
        InputError: a file declares no events, or has the name of another scenario.
    """
    shipped = [one for one in (*names(), *pack_names()) if b"\nrecorded:" in shipped_text(one)]
    found = [load(name) for name in shipped]
    for path in paths:
        one = load(path)
        if one.recorded is None:
            raise InputError(
                f"{path}: a scenario to look for must have the key 'recorded', which says what "
                "its parameters are in recorded events"
            )
        found.append(one)
    twice = [name for name, count in Counter(one.name for one in found).items() if count > 1]
    if twice:
        raise InputError(f"two scenarios to look for have the name '{twice[0]}': rename yours")
    return tuple(found)


def encounters_of(count: int, found: Sequence[FoundEvents]) -> Encounters | None:
    """Return how often events were met, in the driving in which they were looked for."""
    hours, km = (sum(getattr(one, name) for one in found) for name in ("hours", "kilometres"))
    if hours <= 0.0:
        return None
    return Encounters(count, hours, km if km > 0.0 else None, "recorded traffic")


def scenario_events(
    scenario: LogicalScenario, spec: RecordedSpec, found: Sequence[FoundEvents]
) -> ScenarioEvents:
    """Return the events that are a scenario.

    Args:
        scenario: it.
        spec: its declaration.
        found: the events of all recordings.
    """
    counts, columns = 0, list[dict[str, Float]]()
    for events in (one for each in found for one in each.kinds if one.kind.name == spec.event):
        values, kept = _values(spec, events)
        counts += kept
        columns.append(values)
    table = {
        name: np.concatenate([np.empty(0), *(one[name] for one in columns)])
        for name in spec.parameters
    }
    whole = np.isfinite(np.array(list(table.values()))).all(axis=0)
    rows = {name: column[whole] for name, column in table.items()}
    return ScenarioEvents(
        scenario.name, spec.event, counts, rows, int(counts - whole.sum()),
        tuple(_outside(scenario, rows)), tuple(_broken(scenario, rows)),
        unmapped(spec, scenario.parameters), encounters_of(counts, found),
    )  # fmt: skip


def _values(spec: RecordedSpec, events: Events) -> tuple[dict[str, Float], int]:
    kept = spec.counts(events.quantities)
    values = spec.values(events.quantities)
    return {name: column[kept] for name, column in values.items()}, int(kept.sum())


def _outside(scenario: LogicalScenario, rows: dict[str, Float]) -> list[Outside]:
    found = []
    for name, values in rows.items():
        one = scenario.parameters[name]
        below, above = int((values < one.low).sum()), int((values > one.high).sum())
        if below or above:
            found.append(Outside(
                name, one.unit, one.low, one.high, below, above, float(values.min()),
                float(values.max()),
            ))  # fmt: skip
    return found


def _broken(scenario: LogicalScenario, rows: dict[str, Float]) -> list[tuple[str, int]]:
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
            found.append((str(bound), int(breaks.sum())))
    return found
