"""Critical regions as the plain data that the page draws."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from bridgegen.base.arrays import Bool
from bridgegen.pages.data import Evaluations


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
    columns = {one.name: one.values for one in evaluations.parameters}
    keys = ("evaluations", "critical", "critical_held", "space_share", "confidence", "at_least")
    regions = []
    for one in record["regions"]:
        box = {name: one["box"][name] for name in one["named"]}
        inside = np.ones(int(shown.sum()), np.bool_)
        for name, ends in box.items():
            x = columns[name][shown] if name in columns else np.full(inside.size, np.nan)
            inside &= (ends["low"] <= x) & (x <= ends["high"])
        regions.append(
            {
                **{key: one[key] for key in ("number", "confirmed", "rule", "sentence")},
                "narrowed": bool(one.get("narrowed")),
                "space_share": one["space_share"],
                "box": {name: [ends["low"], ends["high"]] for name, ends in box.items()},
                "fresh": _evidence(one["fresh"]),
                "search": _evidence(one["search"]),
                "exposure": one.get("exposure"),
                "rows": np.flatnonzero(inside).tolist(),
            }
        )
    return {
        **{key: record[key] for key in keys},
        "exposure": record.get("exposure_share"),
        "exposure_source": record.get("exposure", ""),
        "regions": regions,
    }


def _evidence(one: Mapping[str, Any]) -> dict[str, Any]:
    return {"rows": one["rows"], "critical": one["critical"], "interval": one["interval"]}
