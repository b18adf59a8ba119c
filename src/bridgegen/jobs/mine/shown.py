"""What the terminal and ``--json`` show of recordings that were mined."""

import math
from collections import Counter
from collections.abc import Iterator
from dataclasses import asdict
from typing import Any

from bridgegen.jobs.frame import Table
from bridgegen.jobs.mine.mine import Mined, Summary
from bridgegen.jobs.mine.near_misses import conflicts_as_json, recordings_in_words, screen_rows
from bridgegen.recordings.events.of_scenarios import encounters_of
from bridgegen.recordings.events.tables import against_in_words, kind_rows, rates_in_words
from bridgegen.recordings.scenarios.files import FOLDER as SCENARIOS
from bridgegen.recordings.scenarios.files import made_as_json, made_row
from bridgegen.recordings.scenarios.mined import MinedScenario, Unmade
from bridgegen.recordings.scenarios.update import ENDING as DIFF
from bridgegen.recordings.scenarios.update import in_words
from bridgegen.scenario.exposure.exposure import Encounters
from bridgegen.scenario.language.event_kinds import EVENT_KINDS

CARRIAGEWAYS_SHOWN = 4


def warnings_of(mined: Mined) -> list[str]:
    """Return what was left out, and what to know of lanes and map."""
    notes = [
        note for one in mined.recordings if one.lanes.source == "map" for note in one.lanes.notes
    ]
    found = [f"warning: skipped: {text}" for _, texts in mined.skipped for text in texts]
    if mined.others:
        found.append(f"note: {len(mined.others)} files are no recordings")
    return [*found, *(f"warning: {text}" for text in (*mined.warnings, *notes))]


def json_of(mined: Mined) -> dict[str, Any]:
    """Return what was recorded, found and written as JSON's types."""
    return {
        "recordings": [_facts(one, mined.time_step) for one in mined.recordings],
        "scenarios": [
            {"file": str(one.scenario), "recording": one.event.recording,
             "ego": one.event.names[0], "other": one.event.names[1],
             "position_off": None if one.problem else one.off,
             "speed_off": None if one.problem else one.too_fast,
             "problem": one.problem or None, "ontology_lacks": one.lacks}
            for one in mined.replays
        ],
        "skipped": [str(path) for path, _ in mined.skipped],
        "others": [str(path) for path in mined.others],
        **_events(mined),
        "mined": [made_as_json(one, mined.out) for one in mined.mined],
        "updates": [{**asdict(one), "path": str(one.path)} for one in mined.updates],
    }  # fmt: skip


def shown_of(mined: Mined) -> Iterator[str | Table]:
    """Yield what was recorded, then events, its quality, and the files."""
    yield Table(
        ("recording", "format", "participants", "h", "km", "step [s]", "frame"),
        [
            (
                one.facts.name,
                one.facts.format,
                ", ".join(f"{count:,} {kind}" for kind, count in one.participants.items()),
                float(f"{one.hours:.4g}"),
                float(f"{one.kilometres:.4g}"),
                float(f"{one.facts.time_step:.4g}"),
                one.facts.frame,
            )
            for one in mined.recordings
        ],
    )
    yield ""
    of_lanes = ("lanes of", "source", "carriageways", "lanes", "vehicles on", "RMS [m]")
    yield Table(of_lanes, [_lane_row(one) for one in mined.recordings])
    yield ""
    yield from _events_shown(mined)
    yield ""
    if found := [row for row in _quality(mined) if row[1]]:
        yield Table(("quality", "recordings", "participants", "count", "first"), found)
    else:
        yield "quality: nothing to clean"
    yield ""
    for name, text in recordings_in_words(mined):
        yield f"{name}: {text}"
    if mined.replays:
        yield ""
        of_events = (
            "scenario", "recording", "ego and other", "type", "TTC [s]", "needed [m/s²]",
            "responsible",
        )  # fmt: skip
        yield Table(of_events, list(screen_rows(mined)))
    yield ""
    unmade: dict[str, list[str]] = {}
    for one in mined.mined:
        if isinstance(one, Unmade):
            unmade.setdefault(one.reason, []).append(one.source)
    for reason, sources in unmade.items():
        yield f"{', '.join(sources)}: no scenario: {reason}"
    made = [one for one in mined.mined if isinstance(one, MinedScenario)]
    if made:
        yield ""
        of_made = ("mined scenario", "events", "per hour (95 %)", "parameters beyond the source's")
        yield Table(of_made, [made_row(one) for one in made])
    tables = ("recordings", "lanes", "quality", "events", "conflicts")
    yield f"\n{'page':<12}{mined.out / 'recordings.html'}"
    yield f"{'tables':<12}{', '.join(str(mined.out / f'{name}.csv') for name in tables)}"
    yield f"{'events':<12}{mined.out / 'events'}, a table per scenario"
    if made:
        yield f"{'mined':<12}{mined.out / SCENARIOS}, a scenario, its fit and its distribution each"
    for update in mined.updates:
        yield ""
        for text in in_words(update):
            yield f"{update.path.name}: {text}"
        if not update.diff:
            yield f"{update.path.name}: nothing to propose"
            continue
        place = mined.out / f"{update.path.name}{DIFF}"
        yield f"{update.path.name}: apply it by: patch {update.path} {place}\n"
        yield update.diff


def _events_shown(mined: Mined) -> Iterator[str | Table]:
    """Yield the events by kind, those that are a scenario, and what they say against it."""
    found = [one.events for one in mined.recordings]
    kinds = list(kind_rows(found))
    if rows := [row[:4] for row in kinds if row[1]]:
        yield Table(("event", "count", "per hour (95 %)", "per 1000 km (95 %)"), rows)
    if none := [f"{kind} {per_hour}" for kind, count, per_hour, _, _ in kinds if not count]:
        yield f"none found, per hour (95 %): {', '.join(none)}; –: nothing to look in"
    for kind, _, _, _, refused in kinds:
        if refused:
            yield f"{kind}: refused {refused}"
    met = [one for one in mined.scenarios if one.count]
    if met:
        yield ""
        yield Table(
            ("scenario", "event", "rows", "incomplete", "per hour (95 %)"),
            [
                (one.scenario, one.kind, one.complete, one.incomplete,
                 rates_in_words(one.encounters)[0])
                for one in met
            ],
        )  # fmt: skip
    for one in met:
        for text in against_in_words(one):
            yield f"{one.scenario}: {text}"


def _events(mined: Mined) -> dict[str, object]:
    """Return the events by kind and by scenario, with rates and all that is refused."""
    found = [one.events for one in mined.recordings]
    by_kind = {
        kind: [one for each in found for one in each.kinds if one.kind.name == kind]
        for kind in EVENT_KINDS
    }
    kinds = {}
    for kind, events in by_kind.items():
        count = sum(len(one) for one in events)
        refused = Counter[str]()
        for one in events:
            refused.update(one.refused)
        kinds[kind] = {
            "count": count, **_rates(encounters_of(count, found, kind)), "refused": dict(refused),
        }  # fmt: skip
    return {
        "hours_on_lanes": sum(one.hours for one in found),
        "km_on_lanes": sum(one.kilometres for one in found),
        "hours_driven": sum(one.all_hours for one in found),
        "km_driven": sum(one.all_kilometres for one in found),
        "events": kinds,
        "parameters": {
            one.scenario: {
                "event": one.kind, "count": one.count, "rows": one.complete,
                **_rates(one.encounters), "outside": [asdict(each) for each in one.outside],
                "broken": {each.rule: each.events for each in one.broken},
                "not_given": one.unmapped,
            }
            for one in mined.scenarios
        },
    }  # fmt: skip


def _rates(met: Encounters | None) -> dict[str, object]:
    rates = {"per_hour": met.per_hour, "per_km": met.per_km} if met else {}
    return {name: asdict(one) for name, one in rates.items() if one is not None}


def _lane_row(one: Summary) -> tuple[str, str, int, str, str, str]:
    """Return a recording's lanes: their number by carriageway, the fit of the one used most."""
    found, share = one.lanes, one.lanes.vehicle_share
    shown = found.carriageways[:CARRIAGEWAYS_SHOWN]
    more = ", …" if len(found.carriageways) > len(shown) else ""
    return (
        one.facts.name,
        "none: give --map" if found.source == "none" else found.source,
        len(found.carriageways),
        ", ".join(str(each.lanes) for each in shown) + more,
        "–" if math.isnan(share) else f"{share:.1%}",
        f"{shown[0].rms:.2f}" if shown else "–",
    )


def _quality(mined: Mined) -> Iterator[tuple[str, int, int, int, str]]:
    """Yield what cleaning did, rule by rule, of all recordings together."""
    for same in zip(*(one.findings for one in mined.recordings), strict=True):
        applied = [each for each in same if each.count]
        yield (
            same[0].rule.value,
            len(applied),
            sum(each.participants for each in applied),
            sum(each.count for each in applied),
            applied[0].examples[0] if applied else "",
        )


def _facts(one: Summary, time_step: float) -> dict[str, object]:
    facts = one.facts
    return {
        "name": facts.name, "format": facts.format, "file": facts.source, "frame": facts.frame,
        "map": facts.map, "time_step": facts.time_step, "duration": one.duration,
        "participants": one.participants, "states": one.states, "tracks": one.tracks,
        "hours": one.hours, "km": one.kilometres, "hours_read": one.read_hours,
        "km_read": one.read_kilometres, "notes": facts.notes,
        "lanes": {
            "source": one.lanes.source, "km_on": one.lanes.km_on, "km_off": one.lanes.km_off,
            "vehicle_share":
                None if math.isnan(one.lanes.vehicle_share) else one.lanes.vehicle_share,
            "carriageways": [asdict(each) for each in one.lanes.carriageways],
            "notes": one.lanes.notes,
        },
        "conflicts": conflicts_as_json(one, time_step),
        "quality": [
            {"rule": each.rule.value, "participants": each.participants, "count": each.count,
             "examples": each.examples}
            for each in one.findings
        ],
    }  # fmt: skip
