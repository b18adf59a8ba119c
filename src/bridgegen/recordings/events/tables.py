"""Events as tables, and in words."""

import csv
import io
import math
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

from bridgegen.base.disk import write_whole
from bridgegen.base.errors import StorageError
from bridgegen.recordings.cells import cell
from bridgegen.recordings.events.event import ABSENT
from bridgegen.recordings.events.find import FoundEvents, named
from bridgegen.recordings.events.of_scenarios import Broken, ScenarioEvents, encounters_of
from bridgegen.scenario.exposure.exposure import Encounters
from bridgegen.scenario.language.event_kinds import EVENT_KINDS

TABLE, FOLDER = "events.csv", "events"
NAMES_SHOWN = 3
"""Number of events that break a constraint and are named."""
QUANTITIES = tuple(dict.fromkeys(name for kind in EVENT_KINDS.values() for name in kind.quantities))
ROLES = tuple(dict.fromkeys(role for kind in EVENT_KINDS.values() for role in kind.roles))
HEAD = ("name", "recording", "file", "event", "ego", *ROLES, "begin", "end", *QUANTITIES)


def write_events(
    out: Path, found: Sequence[FoundEvents], scenarios: Sequence[ScenarioEvents]
) -> None:
    """Write the table of all events, and that of each scenario in a folder beside it.

    Raises:
        StorageError: they cannot be written.
    """
    write_whole(out / TABLE, _csv(HEAD, _rows(found)))
    try:
        (out / FOLDER).mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise StorageError(f"{out / FOLDER}: cannot be made: {error.strerror}") from None
    for scenario in scenarios:
        rows = zip(*(values.tolist() for values in scenario.rows.values()), strict=True)
        path = out / FOLDER / f"{scenario.scenario}.csv"
        write_whole(path, _csv(scenario.rows, ([f"{v:.7g}" for v in row] for row in rows)))


def _rows(found: Sequence[FoundEvents]) -> Iterator[list[object]]:
    for found_events, events, names in named(found):
        for i, (name, ego) in enumerate(zip(names, events.ego.tolist(), strict=True)):
            others = {role: int(who[i]) for role, who in events.others.items()}
            yield [
                name,
                found_events.recording,
                found_events.source,
                events.kind.name,
                found_events.names[ego],
                *(_name(found_events.names, others.get(role, ABSENT)) for role in ROLES),
                f"{events.begin[i]:.10g}",
                f"{events.end[i]:.10g}",
                *(
                    _number(events.quantities[name][i]) if name in events.quantities else ""
                    for name in QUANTITIES
                ),
            ]


def _name(names: Sequence[str], who: int) -> str:
    return names[who] if who != ABSENT else ""


def _number(value: float) -> str:
    return "" if math.isnan(value) else f"{value:.7g}"


def _csv(head: Iterable[str], rows: Iterable[Iterable[object]]) -> Iterator[bytes]:
    text = io.StringIO()
    writer = csv.writer(text)
    writer.writerow(head)
    writer.writerows([cell(value) for value in row] for row in rows)
    yield text.getvalue().encode("utf-8", "replace")


def kind_rows(found: Sequence[FoundEvents]) -> Iterator[tuple[str, int, str, str, str]]:
    """Yield per kind: its name, how many, rates per hour and per 1000 km, what was refused."""
    for kind in EVENT_KINDS:
        same = [events for each in found for events in each.kinds if events.kind.name == kind]
        count = sum(len(events) for events in same)
        refused: Counter[str] = Counter()
        for events in same:
            refused.update(events.refused)
        yield (
            kind,
            count,
            *rates_in_words(encounters_of(count, found, kind)),
            "; ".join(f"{number:,} {reason}" for reason, number in refused.items()),
        )


def rates_in_words(met: Encounters | None) -> tuple[str, str]:
    """Return how often something was met, per hour and per 1000 km, with the 95 % interval."""
    if met is None:
        return "–", "–"
    texts = []
    for rate, scale in ((met.per_hour, 1.0), (met.per_km, 1000.0)):
        if rate is None:
            texts.append("–")
        else:
            estimate, low, high = (
                _three_digits(scale * value) for value in (rate.estimate, rate.low, rate.high)
            )
            texts.append(f"{estimate} ({low} to {high})")
    return texts[0], texts[1]


def _three_digits(value: float) -> str:
    return f"{value:,.0f}" if value >= 999.5 else f"{value:.3g}"


def against_in_words(scenario_events: ScenarioEvents) -> tuple[str, ...]:
    """Return what events say against the ranges and constraints of a scenario, a text each."""
    texts = [
        f"{each.parameter} [{each.unit}]: {each.below:,} below {each.low:g}, {each.above:,} above "
        f"{each.high:g}; seen {each.least:.4g} to {each.most:.4g}"
        for each in scenario_events.outside
    ]
    return (*texts, *(broken_in_words(each) for each in scenario_events.broken))


def broken_in_words(broken: Broken) -> str:
    """Return how many events break a constraint, and the first of them."""
    more = ", …" if len(broken.events) > NAMES_SHOWN else ""
    first = ", ".join(broken.events[:NAMES_SHOWN])
    return f"{len(broken.events):,} break {broken.rule} ({first}{more})"
