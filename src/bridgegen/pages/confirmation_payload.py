"""Pass criteria and cross-simulator validation as the plain data that the page shows."""

from collections.abc import Mapping, Sequence
from math import ceil, floor, log10
from typing import Any

import numpy as np

from bridgegen.assess.criteria import CriterionSummary, headline
from bridgegen.assess.criteria.monitor import LARGEST
from bridgegen.base.arrays import Float
from bridgegen.pages.data import ReportData
from bridgegen.pages.playback_payload import number
from bridgegen.pages.series import packed
from bridgegen.results.confirmation.record import Course, Outcome, Record, Scenario
from bridgegen.results.confirmation.words import name_of, sentences

# --- Cross-simulator validation as the plain data that the page shows ---


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
    tracks = [[_tracks(record, scenario) for scenario in record.scenarios] for record in records]
    room = MOST_NUMBERS
    for rank in range(max(map(len, tracks), default=0)):
        for simulator, each in zip(simulators, tracks, strict=True):
            if rank >= len(each) or not each[rank]:
                continue
            room -= _size(each[rank])
            if room < 0:
                simulator["without_tracks"] += 1
            else:
                simulator["scenarios"][rank]["tracks"] = each[rank]
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
        "scenarios": [_scenario(scenario) for scenario in record.scenarios],
    }


def _scenario(scenario: Scenario) -> dict[str, Any]:
    found = scenario.differences
    first = found.partings[0] if found and found.partings else None
    return {
        "evaluation": scenario.evaluation,
        "name": name_of(scenario),
        "confirmed": scenario.confirmed,
        "here": _outcome(scenario.here),
        "there": None if scenario.there is None else _outcome(scenario.there),
        "parts": None if first is None else {"entity": first.entity, "time": first.time},
        "text": scenario.explanation or scenario.failure,
        "tracks": [],
    }


def _outcome(outcome: Outcome) -> dict[str, Any]:
    contact = None if outcome.contact is None else outcome.contact.time
    margins = {name: shown.value for name, shown in outcome.margins.items()}
    return {
        "harm": outcome.harm,
        "d_min": outcome.d_min,
        "v_d": outcome.v_d,
        "contact": contact,
        "margins": margins,
    }


def _tracks(record: Record, scenario: Scenario) -> list[dict[str, Any]]:
    return [
        {
            "entity": each.entity,
            "first": each.first,
            "n": each.first + len(each.x),
            **{name: packed(_values(each, name), 1) for name in record.scale},
        }
        for each in scenario.tracks
    ]


def _values(course: Course, name: str) -> Float:
    values = [np.nan if value is None else float(value) for value in getattr(course, name)]
    return np.concatenate([np.full(course.first, np.nan), np.array(values)])


def _size(tracks: Sequence[Mapping[str, Any]]) -> int:
    return sum(len(run) for track in tracks for name in ("x", "y", "h") for run in track[name])


# --- Pass criteria as the plain data that the page shows: verdicts, and the spread of margins ---


BINS = 24
"""Maximum number of a histogram's bins."""

OUTER = 0.05
"""Share of the margins at each end that a histogram's outermost bins take up."""

DIGITS = 5
LEAST = 1e-9
"""Least magnitude of a margin; nearer ones are shown as this, so that their sign, which is the
verdict, is kept."""


def criteria_payload(data: ReportData) -> dict[str, Any] | None:
    """Return the criteria of a run, in their order, and the result in a clause; None without any.

    The evaluation with the least margin is counted from 0, as everywhere in the page's data.
    """
    if not data.criteria:
        return None
    columns = {metric.name: metric for metric in data.evaluations.metrics}
    return {
        "headline": headline(data.summary.ego, data.criteria),
        "violated": any(criterion.violated for criterion in data.criteria),
        "critical": list(data.summary.criteria),
        "list": [
            _criterion(criterion, columns[criterion.criterion.quantity].whole)
            for criterion in data.criteria
        ],
    }


def _criterion(criterion_summary: CriterionSummary, margins: Float) -> dict[str, Any]:
    return {
        "id": criterion_summary.criterion.id,
        "quantity": criterion_summary.criterion.quantity,
        "text": criterion_summary.criterion.text,
        "formula": criterion_summary.criterion.states,
        "severity": criterion_summary.criterion.severity,
        "tags": list(criterion_summary.criterion.tags),
        "met": criterion_summary.met,
        "violated": criterion_summary.violated,
        "failed": criterion_summary.unknown,
        "unit": criterion_summary.unit,
        "worst": number(criterion_summary.worst),
        "at": None if criterion_summary.at is None else criterion_summary.at - 1,
        "histogram": histogram(margins),
    }


def histogram(margins: Float) -> dict[str, Any] | None:
    """Return how many margins lie in bins of equal width, of which 0 is an edge.

    Margins without a value, and those at the limit, which stand for infinity, have no part; None
    where no other is left. The outermost bins also count what lies beyond them, on their side of 0.

    Args:
        margins: ``(N,)``, NaN where an evaluation failed.
    """
    values = margins[np.abs(margins) < LARGEST]
    if not values.size:
        return None
    low, high = np.quantile(values, [OUTER, 1.0 - OUTER]).tolist()
    low, high = min(low, 0.0), max(high, 0.0)
    width = _step((high - low) / (BINS - 2)) if high - low > 2.0 * LEAST else 1.0
    violated = values < 0.0
    first = min(floor(low / width), -1 if violated.any() else 0)
    last = max(ceil(high / width), 0 if violated.all() else 1)
    bins = np.clip(np.floor(values / width), first, last - 1).astype(np.int64) - first
    counts: list[int] = np.bincount(bins, minlength=last - first).tolist()
    return {"first": first, "width": width, "counts": counts}


def margins_shown(margins: Float) -> list[float | None]:
    """Return margins rounded to what a page can show, none of them to 0; None for NaN."""
    return [None if np.isnan(item) else _rounded(item) for item in margins.tolist()]


def _rounded(margin: float) -> float:
    if abs(margin) < LEAST:
        return LEAST if margin > 0.0 else -LEAST
    return float(f"{margin:.{DIGITS}g}")


def _step(least: float) -> float:
    """Return the least of 1, 2 and 5 times a power of ten that is not below a number > 0."""
    power = 10.0 ** floor(log10(least))
    steps: Sequence[float] = (1.0, 2.0, 5.0, 10.0)
    return next(step * power for step in steps if step * power >= least * (1.0 - 1e-9))
