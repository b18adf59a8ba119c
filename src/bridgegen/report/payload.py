"""The report's data as the JSON that the page reads.

Numbers in bulk are rounded to what a screen can show; the handed-over files keep every bit. A
number that is NaN or infinite becomes null.
"""

import json
import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from bridgegen.arrays import Bool, Float
from bridgegen.cause import CAUSES, Cause
from bridgegen.report import convergence, sentences
from bridgegen.report.confirmation_payload import confirmations_payload
from bridgegen.report.coverage_payload import coverage_payload
from bridgegen.report.data import Column, Evaluations, ReportData
from bridgegen.report.findings_payload import (
    findings_payload,
    implausible_payload,
    triage_payload,
)
from bridgegen.report.packed import packed_files, packed_motions, road_key
from bridgegen.report.picture_payload import pictures_payload
from bridgegen.report.playback_payload import (
    ROAD_SCALE,
    SCALE,
    playback_payload,
    road_payload,
)
from bridgegen.report.regions_payload import regions_payload
from bridgegen.search.dominance import by_merit, non_dominated

DIGITS = 5
"""Significant digits of the largest value of a column in bulk."""

ROWS = 20_000
"""Rows of a longer run that the page holds, evenly spread; the iterations show all of it."""

TRENDS = {"d_min": False, "v_d": True}
"""The metrics shown over iterations, and whether a larger one is worse."""

TRENDS_OF_HARM = {"harm": True, "d_min": False}
"""Likewise, where harm makes a scenario critical."""


def to_json(data: ReportData, *, live: bool = False) -> str:
    """Return the page's data as JSON that is safe inside a ``<script>`` element.

    Args:
        data: what the page shows.
        live: whether the page may ask the server that it comes from for what is new.
    """
    return script_json({**payload(data), "live": live})


def script_json(value: Any) -> str:
    r"""Return plain data as JSON that is safe inside a ``<script>`` element.

    Every ``<`` is written as ``\u003c``, so that no text in it can close the element or open a
    comment; everything that is not ASCII is escaped, so that lone surrogates (from file names)
    do not break the encoding.
    """
    text = json.dumps(value, allow_nan=False, separators=(",", ":"))
    return text.replace("<", "\\u003c")


def payload(data: ReportData) -> dict[str, Any]:
    """Return the page's data as plain dicts, lists, numbers and strings."""
    elsewhere = confirmations_payload(data.confirmations)
    harm = data.summary.harm
    drawn = [playback for playback in data.kept if playback.picture is not None]
    number = {playback.name: k for k, playback in enumerate(drawn)}
    roads: list[list[dict[str, Any]]] = []
    index: dict[tuple[tuple[str, bytes], ...], int] = {}
    kept = []
    for playback in data.kept:
        key = road_key(playback)
        if key not in index:
            index[key] = len(roads)
            roads.append(road_payload(playback))
        kept.append(playback_payload(playback, index[key], number.get(playback.name)))
    motions = packed_motions(data.more, index)
    wanted = [*(one.evaluation for one in data.kept), *motions["evaluations"]]
    wanted += [one["evaluation"] for each in elsewhere for one in each["scenarios"]]
    modes = data.triage.modes if data.triage else ()
    wanted += [one.shown for one in modes]
    shown = _shown(data.evaluations, wanted)
    return {
        "live": False,
        "summary": _summary(data),
        "rows": _rows(data.evaluations, shown, harm=harm),
        "triage": triage_payload(data.triage) if data.triage else None,
        "minimal": packed_motions(data.minimal, index),
        "implausible": implausible_payload(data.evaluations.findings),
        "regions": regions_payload(data.regions, data.evaluations, shown) if data.regions else None,
        "confirmations": elsewhere,
        "batches": _batches(data.evaluations, TRENDS_OF_HARM if harm else TRENDS),
        "causes": _causes(data.evaluations),
        "scale": {**SCALE, "road": ROAD_SCALE},
        "roads": roads,
        "kept": kept,
        "packed": motions,
        "files": packed_files(data.files),
        "coverage": coverage_payload(data.coverage) if data.coverage else None,
        "notes": [
            {"title": t.title, "columns": t.columns, "rows": t.rows, "left_out": t.left_out}
            for t in data.notes
        ],
        "pictures": pictures_payload([p.picture for p in drawn if p.picture]),
    }


def news(data: ReportData, after: int) -> dict[str, Any]:
    """Return what a page lacks that knows the first ``after`` evaluations.

    Of the rows those that are new, and the ranks of all; or all of them anew, ``whole``, where a
    long run is thinned. Everything else as it is now.
    """
    e, harm = data.evaluations, data.summary.harm
    shown = _shown(e, [])
    whole = e.status.size > ROWS
    new = shown if whole else shown & (np.arange(shown.size) >= after)
    return {
        "summary": _summary(data),
        "whole": whole,
        "rows": {
            **_rows(e, new, harm=harm),
            "rank": _ranks(e, shown, harm=harm),
            "front": _front(e, shown),
        },
        "implausible": implausible_payload(e.findings),
        "batches": _batches(e, TRENDS_OF_HARM if harm else TRENDS),
        "causes": _causes(e),
        "regions": regions_payload(data.regions, e, shown) if data.regions else None,
        "confirmations": confirmations_payload(data.confirmations),
    }


def _summary(data: ReportData) -> dict[str, Any]:
    s = data.summary
    return {
        "title": s.title,
        "description": s.description,
        "facts": [s.scenario, s.road, f"ego {s.ego}", s.algorithm, f"seed {s.seed}"],
        "finished": s.finished,
        "budget": int(s.budget),
        "sentences": sentences.sentences(data),
        "table": sentences.summary_table(data),
        "note": sentences.interval_note(s),
        "provenance": sentences.provenance(s),
        "command": s.command,
        "view": s.view,
        "critical_distance": _number(s.critical_distance),
        "harm": s.harm,
    }


def _shown(e: Evaluations, kept: list[int]) -> Bool:
    """Return which rows the page holds, ``(N,)``: none that failed, and of a long run some."""
    ok: Bool = e.status == 0
    if ok.size > ROWS:
        some = np.zeros(ok.size, dtype=np.bool_)
        some[np.linspace(0, ok.size - 1, ROWS).round().astype(np.int64)] = True
        some[kept] = True
        ok &= some
    return ok


def _rows(e: Evaluations, ok: Bool, *, harm: str = "") -> dict[str, Any]:
    groups = [("parameter", e.parameters), ("metric", e.metrics), ("objective", e.objectives)]
    return {
        "n": int(e.status.size),
        "n_failed": int(np.count_nonzero(e.status)),
        "n_critical": int(np.count_nonzero(e.critical & (e.status == 0))),
        "evaluation": np.flatnonzero(ok).tolist(),
        "iteration": (e.iteration[ok] + 1).tolist(),
        "critical": e.critical[ok].astype(np.int64).tolist(),
        "cause": None if e.cause is None else e.cause[ok].tolist(),
        "findings": findings_payload(e.findings, ok) if e.findings else None,
        "rank": _ranks(e, ok, harm=harm),
        "front": _front(e, ok),
        "columns": [_column(c, group, ok) for group, columns in groups for c in columns],
        "telling": convergence.telling_parameters(e.parameters, e.critical, ok),
    }


def _ranks(e: Evaluations, ok: Bool, *, harm: str = "") -> list[int]:
    """Return each row's place among all critical ones, 1 for the most critical; 0 for others.

    By harm, so that no near miss is above a collision of the ego's responsibility, where harm makes
    a scenario critical; else by the objectives.
    """
    critical = np.flatnonzero(e.critical & (e.status == 0))
    rank = np.zeros(e.critical.size, dtype=np.int64)
    F = (
        np.stack([c.whole[critical] for c in e.objectives], axis=1)
        if e.objectives
        else np.zeros((critical.size, 1))
    )
    order = critical[by_merit(F)]
    for column in e.metrics:
        if column.name == harm:
            order = order[np.argsort(-column.whole[order], kind="stable")]
    rank[order] = np.arange(1, critical.size + 1)
    told: list[int] = rank[ok].tolist()
    return told


def _front(e: Evaluations, ok: Bool) -> list[int]:
    """Return the places, among the rows shown, of those that no other one dominates.

    Nothing where there are not several objectives.
    """
    if len(e.objectives) < 2 or not ok.any():
        return []
    F = np.stack([c.values[ok] for c in e.objectives], axis=1)
    places: list[int] = np.flatnonzero(non_dominated(F)).tolist()
    return places


def _causes(e: Evaluations) -> dict[str, Any] | None:
    """Return how many evaluations have each cause; number 0 is none."""
    if e.cause is None:
        return None
    return {
        "labels": ["none", *(one.label for one in CAUSES)],
        "counts": [int(np.count_nonzero(e.cause == one)) for one in Cause],
    }


def _column(column: Column, group: str, ok: Any) -> dict[str, Any]:
    return {
        "name": column.name,
        "unit": column.unit,
        "group": group,
        "description": column.description,
        "low": _number(column.low),
        "high": _number(column.high),
        "searched": column.searched,
        **column.labels,
        "values": significant(column.values[ok]),
    }


def _batches(e: Evaluations, trends_of: Mapping[str, bool] = TRENDS) -> dict[str, Any]:
    found = convergence.batches(e)
    n = found.first.size
    trends = {}
    for column in e.metrics:
        if column.name in trends_of:
            values = np.where(e.status == 0, column.whole, np.nan)
            t = convergence.trend(values, found.group, n, larger_is_worse=trends_of[column.name])
            trends[column.name] = {
                "unit": column.unit,
                "median": significant(t.median),
                "lower": significant(t.lower),
                "upper": significant(t.upper),
                "best": significant(t.best),
            }
    return {
        "first": found.first.tolist(),
        "last": found.last.tolist(),
        "evaluations": found.evaluations.tolist(),
        "share": significant(found.share),
        "cumulative": significant(found.cumulative),
        "trends": trends,
    }


def significant(values: Float, digits: int = DIGITS) -> list[float | None]:
    """Round to ``digits`` significant digits of the largest finite magnitude."""
    finite = np.abs(values[np.isfinite(values)])
    top = float(finite.max()) if finite.size else 0.0
    if top == 0.0:
        return decimals(values, 0)
    return decimals(values, digits - 1 - math.floor(math.log10(top)))


def decimals(values: Float, places: int) -> list[float | None]:
    """Round to decimal places; null for what is not finite, and no negative zero."""
    with np.errstate(over="ignore", invalid="ignore"):
        rounded = np.round(values, min(places, 300)) + 0.0  # 10**300: the last that float64 holds
    kept = np.where(np.isfinite(rounded), rounded, values)
    if np.isfinite(kept).all():
        return kept.tolist()  # type: ignore[no-any-return]
    return [value if math.isfinite(value) else None for value in kept.tolist()]


def _number(value: float | None) -> float | None:
    if value is None or not math.isfinite(value):
        return None
    return float(value)
