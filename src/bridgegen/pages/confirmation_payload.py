"""Cross-simulator validation as the plain data that the page shows."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from bridgegen.base.arrays import Float
from bridgegen.pages.series import packed
from bridgegen.results.confirmation.schema import Course, Outcome, Record, Scenario
from bridgegen.results.confirmation.verdict import name_of, sentences

MOST_NUMBERS = 150_000
"""Maximum count of numbers in all tracks together: well under a megabyte of the page."""


def confirmations_payload(records: Sequence[Record]) -> list[dict[str, Any]]:
    """Return the results of each simulator, with the tracks of all participants.

    ``without_tracks`` is the number of scenarios whose tracks exceed the room; those of the most
    critical scenarios of every simulator come first.

    Args:
        records: one for each simulator.
    """
    simulators = [_simulator(record) for record in records]
    tracks = [[_tracks(record, one) for one in record.scenarios] for record in records]
    room = MOST_NUMBERS
    for rank in range(max(map(len, tracks), default=0)):
        for one, each in zip(simulators, tracks, strict=True):
            if rank >= len(each) or not each[rank]:
                continue
            room -= _size(each[rank])
            if room < 0:
                one["without_tracks"] += 1
            else:
                one["scenarios"][rank]["tracks"] = each[rank]
    return simulators


def _simulator(record: Record) -> dict[str, Any]:
    return {
        "simulator": record.simulator,
        "label": record.label,
        "reference": record.reference,
        "rule": record.rule,
        "sentences": sentences(record.label, record.scenarios),
        "parted_at": record.parted_at,
        "scale": dict(record.scale),
        "without_tracks": 0,
        "scenarios": [_scenario(one) for one in record.scenarios],
    }


def _scenario(one: Scenario) -> dict[str, Any]:
    found = one.differences
    first = found.partings[0] if found and found.partings else None
    return {
        "evaluation": one.evaluation,
        "name": name_of(one),
        "confirmed": one.confirmed,
        "here": _outcome(one.here),
        "there": None if one.there is None else _outcome(one.there),
        "parts": None if first is None else {"entity": first.entity, "time": first.time},
        "text": one.explanation or one.failure,
        "tracks": [],
    }


def _outcome(one: Outcome) -> dict[str, Any]:
    contact = None if one.contact is None else one.contact.time
    margins = {name: shown.value for name, shown in one.margins.items()}
    return {
        "harm": one.harm, "d_min": one.d_min, "v_d": one.v_d, "contact": contact,
        "margins": margins,
    }  # fmt: skip


def _tracks(record: Record, one: Scenario) -> list[dict[str, Any]]:
    return [
        {
            "entity": each.entity,
            "first": each.first,
            "n": each.first + len(each.x),
            **{name: packed(_values(each, name), 1) for name in record.scale},
        }
        for each in one.tracks
    ]


def _values(one: Course, name: str) -> Float:
    values = [np.nan if value is None else float(value) for value in getattr(one, name)]
    return np.concatenate([np.full(one.first, np.nan), np.array(values)])


def _size(tracks: Sequence[Mapping[str, Any]]) -> int:
    return sum(len(run) for one in tracks for name in ("x", "y", "h") for run in one[name])
