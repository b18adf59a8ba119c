"""The sections of the report: the data of each, and the module of ``web`` that draws it.

A section is a module that registers itself (``addSection`` in ``web/sections.js``) with its style
beside it, a function here that returns its data, and its line in `SECTIONS`.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from bridgegen.assess.cause import Cause
from bridgegen.assess.conflict.happening import Happening, Share
from bridgegen.base.arrays import Bool, Int
from bridgegen.pages import convergence
from bridgegen.pages.confirmation_payload import confirmations_payload, criteria_payload
from bridgegen.pages.data import Evaluations, ReportData
from bridgegen.pages.findings_payload import triage_payload
from bridgegen.pages.notes import notes_payload
from bridgegen.pages.series import significant
from bridgegen.scenario.language.coverage import CoverageMap, PairBins, ParameterBins, Ways

# --- Data of the charts over the iterations ---


TRENDS = {"d_min": False, "v_d": True}
"""The metrics shown over iterations, and whether a larger one is worse."""

TRENDS_OF_HARM = {"harm": True, "d_min": False}
"""Metrics shown over iterations where harm makes a scenario critical, and whether a larger one is
worse."""


def batches_payload(e: Evaluations, trends_of: Mapping[str, bool] = TRENDS) -> dict[str, Any]:
    """Return shares and trends, batch by batch.

    Args:
        e: all evaluations.
        trends_of: the metrics, and whether a larger one is worse.
    """
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


# --- Number of scenarios by cause, as data of the page ---


def causes_payload(e: Evaluations) -> dict[str, Any] | None:
    """Return the number of evaluations per cause; cause 0 is none.

    The vehicle's dynamics, the last one, is left out where no scenario is put down to it.
    """
    if e.cause is None:
        return None
    counts = [int(np.count_nonzero(e.cause == cause)) for cause in Cause]
    shown = len(counts) if counts[Cause.VEHICLE_DYNAMICS] else int(Cause.VEHICLE_DYNAMICS)
    return {
        "labels": ["none", *(cause.label for cause in Cause if cause)][:shown],
        "counts": counts[:shown],
    }


# --- Critical regions as the plain data that the page draws ---


def regions_payload(
    record: Mapping[str, Any], evaluations: Evaluations, shown: Bool
) -> dict[str, Any]:
    """Return the data to describe, draw and filter by regions.

    Args:
        record: in the form of `bridgegen.search.regions.record`.
        evaluations: of the run.
        shown: ``(N,)``, the rows that the page holds; a region names the rows in it by their
            indices among these.
    """
    columns = {parameter.name: parameter.values for parameter in evaluations.parameters}
    keys = ("evaluations", "critical", "critical_held", "space_share", "confidence", "at_least")
    regions = []
    for item in record["regions"]:
        box = {name: item["box"][name] for name in item["named"]}
        inside = np.ones(int(shown.sum()), np.bool_)
        for name, ends in box.items():
            x = columns[name][shown] if name in columns else np.full(inside.size, np.nan)
            inside &= (ends["low"] <= x) & (x <= ends["high"])
        regions.append(
            {
                **{key: item[key] for key in ("number", "confirmed", "rule", "sentence")},
                "narrowed": bool(item.get("narrowed")),
                "space_share": item["space_share"],
                "box": {name: [ends["low"], ends["high"]] for name, ends in box.items()},
                "fresh": _evidence(item["fresh"]),
                "search": _evidence(item["search"]),
                "exposure": item.get("exposure"),
                "rows": np.flatnonzero(inside).tolist(),
            }
        )
    return {
        **{key: record[key] for key in keys},
        "exposure": record.get("exposure_share"),
        "exposure_source": record.get("exposure", ""),
        "regions": regions,
    }


def _evidence(record: Mapping[str, Any]) -> dict[str, Any]:
    return {"rows": record["rows"], "critical": record["critical"], "interval": record["interval"]}


# --- Coverage as the plain data that the page draws ---


IMPOSSIBLE = -1
"""Value in place of the number of rows in a bin that is not feasible."""


def coverage_payload(found: CoverageMap) -> dict[str, Any]:
    """Return what the page needs to draw strips, matrix and grids.

    Parameters come axis by axis, in the order in which the axes first occur; a pair names them by
    their numbers here, the earlier first. Its cells are a list of the rows per pair of bins, the
    second parameter's bins running fastest, and one of the critical rows; None where there are
    too many to be drawn.
    """
    axes = list(dict.fromkeys(parameter.axis for parameter in found.total.parameters))
    parameters = sorted(found.total.parameters, key=lambda parameter: axes.index(parameter.axis))
    number = {parameter.name: k for k, parameter in enumerate(parameters)}
    return {
        "evaluations": found.total.evaluations,
        "critical": found.total.critical,
        "sample": found.total.sample,
        "ways": [{"strength": way.strength, **_ways(way)} for way in found.total.ways],
        "parameters": [_parameter(parameter) for parameter in parameters],
        "pairs": [_pair(pair, number) for pair in found.pairs],
    }


def _parameter(parameter_bins: ParameterBins) -> dict[str, Any]:
    return {
        "name": parameter_bins.name,
        "unit": parameter_bins.unit,
        "axis": parameter_bins.axis,
        "integer": parameter_bins.integer,
        **parameter_bins.labels,
        "edges": [float(f"{edge:.6g}") for edge in parameter_bins.edges.tolist()],
        "evaluated": _counts(parameter_bins.evaluated, parameter_bins.feasible),
        "critical": parameter_bins.critical.tolist(),
    }


def _ways(ways: Ways) -> dict[str, int]:
    return {
        "total": ways.total,
        "feasible": ways.feasible,
        "evaluated": ways.evaluated,
        "critical": ways.critical,
    }


def _pair(pair: PairBins, number: dict[str, int]) -> dict[str, Any]:
    first, second = number[pair.first], number[pair.second]
    turned = first > second
    cells = None
    if pair.evaluated is not None and pair.critical is not None and pair.feasible is not None:
        grids = (_counts(pair.evaluated, pair.feasible), pair.critical.tolist())
        evaluated, critical = (np.transpose(grid) if turned else np.array(grid) for grid in grids)
        cells = {"evaluated": evaluated.ravel().tolist(), "critical": critical.ravel().tolist()}
    return {"of": sorted((first, second)), **_ways(pair.ways), "cells": cells}


def _counts(evaluated: Int, feasible: Bool) -> list[Any]:
    counts: list[Any] = np.where(feasible, evaluated, IMPOSSIBLE).tolist()
    return counts


@dataclass(frozen=True)
class Section:
    """A section of the report.

    Attributes:
        module: of ``web``.
        key: of its data in the page's data.
        payload: returns them, as plain data, from the report's data and the rows that the page
            holds, ``(N,)`` bool; None where there is nothing to draw. Without it the section draws
            the rows, which every page holds.
        grows: whether a served page updates it with every batch.
    """

    module: str
    key: str = "rows"
    payload: Callable[[ReportData, Bool], Any] | None = None
    grows: bool = False


def _criteria(data: ReportData, _shown: Bool) -> Any:
    return criteria_payload(data)


def _triage(data: ReportData, _shown: Bool) -> Any:
    return triage_payload(data.triage) if data.triage else None


def _causes(data: ReportData, _shown: Bool) -> Any:
    return causes_payload(data.evaluations)


def _confirmations(data: ReportData, _shown: Bool) -> Any:
    return confirmations_payload(data.confirmations)


def _batches(data: ReportData, _shown: Bool) -> Any:
    return batches_payload(data.evaluations, TRENDS_OF_HARM if data.summary.harm else TRENDS)


def _regions(data: ReportData, shown: Bool) -> Any:
    return regions_payload(data.regions, data.evaluations, shown) if data.regions else None


def _coverage(data: ReportData, _shown: Bool) -> Any:
    return coverage_payload(data.coverage) if data.coverage else None


def _happening(data: ReportData, _shown: Bool) -> Any:
    found = data.happening
    if found is None or not found.rows:
        return None
    groups = [("Events that began", found.events), ("Who came near the ego", found.near)]
    if found.end is not None and found.stuck is not None:
        whole = (replace(found.end, name="the end of its route"),)
        groups.append(("What the ego reached", whole))
        groups.append(("Stuck", (Share("the ego stands for no reason", found.stuck, found.rows),)))
    return {
        "lead": [name for name in (_verdict(found), found.stuck_in_words, found.domain) if name],
        "groups": [
            {"title": title, "shares": [vars(share) for share in shares]}
            for title, shares in groups
            if shares
        ],
    }


def _verdict(found: Happening) -> str:
    if found.happened:
        return ""
    return f"The scenario did not happen: {'; '.join(found.reasons)}."


def _screened(data: ReportData, _shown: Bool) -> Any:
    return data.screened


def _notes(data: ReportData, _shown: Bool) -> Any:
    return notes_payload(data.notes)


SECTIONS = (
    Section("criteria.js", "criteria", _criteria, grows=True),
    Section("modes.js", "triage", _triage),
    Section("causes.js", "causes", _causes, grows=True),
    Section("elsewhere.js", "confirmations", _confirmations, grows=True),
    Section("screened.js", "screened", _screened),
    Section("happening.js", "happening", _happening, grows=True),
    Section("trends.js", "batches", _batches, grows=True),
    Section("regions.js", "regions", _regions, grows=True),
    Section("importance.js"),
    Section("scatter.js"),
    Section("parallel.js"),
    Section("coverage.js", "coverage", _coverage),
    Section("notes.js", "notes", _notes),
)


def sections_payload(data: ReportData, shown: Bool, *, grown: bool = False) -> dict[str, Any]:
    """Return the sections' data, by key.

    Args:
        data: of the report.
        shown: ``(N,)``, the rows that the page holds.
        grown: only those of the sections that a served page updates.
    """
    return {
        section.key: section.payload(data, shown)
        for section in SECTIONS
        if section.payload is not None and (section.grows or not grown)
    }
