"""What the terminal and ``--json`` show of recordings that were mined."""

import math
from collections import Counter
from collections.abc import Iterator
from dataclasses import asdict
from typing import Any

from bridgegen.base.units import percent
from bridgegen.jobs.frame import Table
from bridgegen.jobs.mine.mine import Mined, Summary
from bridgegen.jobs.mine.near_misses import conflicts_as_json, recordings_in_words, screen_rows
from bridgegen.pages.templates import counted, joined
from bridgegen.recordings.events.of_scenarios import encounters_of
from bridgegen.recordings.events.tables import against_in_words, kind_rows, rates_in_words
from bridgegen.recordings.scenarios.files import FOLDER as SCENARIOS
from bridgegen.recordings.scenarios.files import made_as_json, made_row
from bridgegen.recordings.scenarios.mined import MinedScenario, Unmade
from bridgegen.recordings.scenarios.ranges import held_in_words
from bridgegen.recordings.scenarios.update import ENDING as DIFF
from bridgegen.recordings.scenarios.update import in_words
from bridgegen.scenario.exposure.exposure import Encounters
from bridgegen.scenario.language.event_kinds import EVENT_KINDS

CARRIAGEWAYS_SHOWN = 4


def warnings_of(mined: Mined) -> list[str]:
    """Return what was left out, and what to know of lanes and map."""
    notes = [
        note
        for recording in mined.recordings
        if recording.lanes.source == "map"
        for note in recording.lanes.notes
    ]
    found = [f"warning: not read: {text}" for text in mined.unread]
    if mined.others:
        names = joined([path.name for path in mined.others])
        found.append(f"note: {counted(len(mined.others), 'file')} without recording: {names}")
    return [*found, *(f"warning: {text}" for text in (*mined.warnings, *notes))]


def json_of(mined: Mined) -> dict[str, Any]:
    """Return what was recorded, found and written as JSON's types."""
    return {
        "recordings": [_facts(recording, mined.time_step) for recording in mined.recordings],
        "scenarios": [
            {
                "file": str(replay.scenario),
                "recording": replay.event.recording,
                "ego": replay.event.names[0],
                "other": replay.event.names[1],
                "position_off": None if replay.problem else replay.off,
                "speed_off": None if replay.problem else replay.too_fast,
                "problem": replay.problem or None,
                "ontology_lacks": replay.lacks,
            }
            for replay in mined.replays
        ],
        "skipped": [
            {"file": str(path), "reason": reason}
            for (path, _), reason in zip(mined.skipped, mined.unread, strict=True)
        ],
        "others": [str(path) for path in mined.others],
        **_events(mined),
        "mined": [made_as_json(scenario, mined.out) for scenario in mined.mined],
        "updates": [{**asdict(update), "path": str(update.path)} for update in mined.updates],
    }


def shown_of(mined: Mined) -> Iterator[str | Table]:
    """Yield what was recorded, then events, its quality, and the files."""
    yield Table(
        ("recording", "format", "participants", "h", "km", "step [s]", "frame"),
        [
            (
                recording.facts.name,
                recording.facts.format,
                ", ".join(f"{count:,} {kind}" for kind, count in recording.participants.items()),
                float(f"{recording.hours:.4g}"),
                float(f"{recording.kilometres:.4g}"),
                float(f"{recording.facts.time_step:.4g}"),
                recording.facts.frame,
            )
            for recording in mined.recordings
        ],
    )
    yield ""
    of_lanes = ("lanes of", "source", "carriageways", "lanes", "vehicles on", "RMS [m]")
    yield Table(of_lanes, [_lane_row(recording) for recording in mined.recordings])
    yield ""
    yield from _events_shown(mined)
    yield ""
    if found := [row for row in _quality(mined) if row[1]]:
        yield Table(("quality", "recordings", "participants", "count", "first"), found)
    else:
        yield "quality: nothing to clean"
    yield ""
    conflicts = recordings_in_words(mined)
    for name, text in conflicts:
        yield f"{name}: {text}"
    if none := len(mined.recordings) - len(conflicts):
        yield f"{counted(none, 'recording')} without near miss"
    if mined.replays:
        yield ""
        of_events = (
            "scenario",
            "recording",
            "ego and other",
            "type",
            "TTC [s]",
            "needed [m/s²]",
            "responsible",
        )
        yield Table(of_events, list(screen_rows(mined)))
    yield ""
    unmade: dict[str, list[str]] = {}
    for scenario in mined.mined:
        if isinstance(scenario, Unmade):
            unmade.setdefault(scenario.reason, []).append(scenario.source)
    for reason, sources in unmade.items():
        yield f"{', '.join(sources)}: no scenario: {reason}"
    made = [scenario for scenario in mined.mined if isinstance(scenario, MinedScenario)]
    if made:
        yield ""
        of_made = ("mined scenario", "events", "per hour (95 %)", "parameters beyond the source's")
        yield Table(of_made, [made_row(scenario) for scenario in made])
        for scenario in made:
            if scenario.fit is None:
                yield f"{scenario.name}: {held_in_words(scenario.events)}; no distribution"
    tables = ("recordings", "lanes", "quality", "events", "conflicts")
    yield f"\n{'page':<12}{mined.out / 'recordings.html'}"
    yield f"{'tables':<12}{', '.join(str(mined.out / f'{name}.csv') for name in tables)}"
    yield f"{'events':<12}{mined.out / 'events'}, a table per scenario"
    if made:
        yield f"{'mined':<12}{mined.out / SCENARIOS}, a scenario each, its fit and its distribution"
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
    found = [recording.events for recording in mined.recordings]
    kinds = list(kind_rows(found))
    if rows := [row[:4] for row in kinds if row[1]]:
        yield Table(("event", "count", "per hour (95 %)", "per 1000 km (95 %)"), rows)
    if none := [f"{kind} {per_hour}" for kind, count, per_hour, _, _ in kinds if not count]:
        yield f"none found, per hour (95 %): {', '.join(none)}; –: nothing to look in"
    for kind, _, _, _, refused in kinds:
        if refused:
            yield f"{kind}: refused {refused}"
    met = [scenario for scenario in mined.scenarios if scenario.count]
    if met:
        yield ""
        yield Table(
            ("scenario", "event", "rows", "incomplete", "per hour (95 %)"),
            [
                (
                    events.scenario,
                    events.kind,
                    events.complete,
                    events.incomplete,
                    rates_in_words(events.encounters)[0],
                )
                for events in met
            ],
        )
    for events in met:
        for text in against_in_words(events):
            yield f"{events.scenario}: {text}"


def _events(mined: Mined) -> dict[str, object]:
    """Return the events by kind and by scenario, with rates and all that is refused."""
    found = [recording.events for recording in mined.recordings]
    by_kind = {
        kind: [events for each in found for events in each.kinds if events.kind.name == kind]
        for kind in EVENT_KINDS
    }
    kinds = {}
    for kind, events in by_kind.items():
        count = sum(len(event) for event in events)
        refused = Counter[str]()
        for event in events:
            refused.update(event.refused)
        kinds[kind] = {
            "count": count,
            **_rates(encounters_of(count, found, kind)),
            "refused": dict(refused),
        }
    return {
        "hours_on_lanes": sum(found_events.hours for found_events in found),
        "km_on_lanes": sum(found_events.kilometres for found_events in found),
        "hours_driven": sum(found_events.all_hours for found_events in found),
        "km_driven": sum(found_events.all_kilometres for found_events in found),
        "events": kinds,
        "parameters": {
            scenario.scenario: {
                "event": scenario.kind,
                "count": scenario.count,
                "rows": scenario.complete,
                **_rates(scenario.encounters),
                "outside": [asdict(each) for each in scenario.outside],
                "broken": {each.rule: each.events for each in scenario.broken},
                "not_given": scenario.unmapped,
            }
            for scenario in mined.scenarios
        },
    }


def _rates(met: Encounters | None) -> dict[str, object]:
    rates = {"per_hour": met.per_hour, "per_km": met.per_km} if met else {}
    return {name: asdict(rate) for name, rate in rates.items() if rate is not None}


def _lane_row(summary: Summary) -> tuple[str, str, int, str, str, str]:
    """Return a recording's lanes: their number by carriageway, the fit of the one used most."""
    found, share = summary.lanes, summary.lanes.vehicle_share
    shown = found.carriageways[:CARRIAGEWAYS_SHOWN]
    more = ", …" if len(found.carriageways) > len(shown) else ""
    return (
        summary.facts.name,
        "none: give --map" if found.source == "none" else found.source,
        len(found.carriageways),
        ", ".join(str(each.lanes) for each in shown) + more,
        "–" if math.isnan(share) else f"{percent(share)}",
        f"{shown[0].rms:.2f}" if shown else "–",
    )


def _quality(mined: Mined) -> Iterator[tuple[str, int, int, int, str]]:
    """Yield what cleaning did, rule by rule, of all recordings together."""
    for same in zip(*(recording.findings for recording in mined.recordings), strict=True):
        applied = [each for each in same if each.count]
        yield (
            same[0].rule.value,
            len(applied),
            sum(each.participants for each in applied),
            sum(each.count for each in applied),
            applied[0].examples[0] if applied else "",
        )


def _facts(summary: Summary, time_step: float) -> dict[str, object]:
    facts = summary.facts
    return {
        "name": facts.name,
        "format": facts.format,
        "file": facts.source,
        "frame": facts.frame,
        "map": facts.map,
        "time_step": facts.time_step,
        "duration": summary.duration,
        "participants": summary.participants,
        "states": summary.states,
        "tracks": summary.tracks,
        "hours": summary.hours,
        "km": summary.kilometres,
        "hours_read": summary.read_hours,
        "km_read": summary.read_kilometres,
        "notes": facts.notes,
        "lanes": {
            "source": summary.lanes.source,
            "km_on": summary.lanes.km_on,
            "km_off": summary.lanes.km_off,
            "vehicle_share": None
            if math.isnan(summary.lanes.vehicle_share)
            else summary.lanes.vehicle_share,
            "carriageways": [asdict(each) for each in summary.lanes.carriageways],
            "notes": summary.lanes.notes,
        },
        "conflicts": conflicts_as_json(summary, time_step),
        "quality": [
            {
                "rule": each.rule.value,
                "participants": each.participants,
                "count": each.count,
                "examples": each.examples,
            }
            for each in summary.findings
        ],
    }
