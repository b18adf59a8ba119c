"""Coverage as the plain data that the page draws."""

from typing import Any

import numpy as np

from bridgegen.base.arrays import Bool, Int
from bridgegen.scenario.language.coverage import CoverageMap, PairBins, ParameterBins, Ways

IMPOSSIBLE = -1
"""Replaces the number of rows in a bin that is not feasible."""


def coverage_payload(found: CoverageMap) -> dict[str, Any]:
    """Return what the page needs to draw strips, matrix and grids.

    Parameters come axis by axis, in the order in which the axes first occur; a pair names them by
    their numbers here, the earlier first. Its cells are a list of the rows per pair of bins, the
    second parameter's bins running fastest, and one of the critical rows; None where there are
    too many to be drawn.
    """
    axes = list(dict.fromkeys(one.axis for one in found.total.parameters))
    parameters = sorted(found.total.parameters, key=lambda one: axes.index(one.axis))
    number = {one.name: k for k, one in enumerate(parameters)}
    return {
        "evaluations": found.total.evaluations,
        "critical": found.total.critical,
        "sample": found.total.sample,
        "ways": [{"strength": one.strength, **_ways(one)} for one in found.total.ways],
        "parameters": [_parameter(one) for one in parameters],
        "pairs": [_pair(one, number) for one in found.pairs],
    }


def _parameter(one: ParameterBins) -> dict[str, Any]:
    return {
        "name": one.name,
        "unit": one.unit,
        "axis": one.axis,
        "integer": one.integer,
        **one.labels,
        "edges": [float(f"{edge:.6g}") for edge in one.edges.tolist()],
        "evaluated": _counts(one.evaluated, one.feasible),
        "critical": one.critical.tolist(),
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
        evaluated, critical = (np.transpose(one) if turned else np.array(one) for one in grids)
        cells = {"evaluated": evaluated.ravel().tolist(), "critical": critical.ravel().tolist()}
    return {"of": sorted((first, second)), **_ways(pair.ways), "cells": cells}


def _counts(evaluated: Int, feasible: Bool) -> list[Any]:
    counts: list[Any] = np.where(feasible, evaluated, IMPOSSIBLE).tolist()
    return counts
