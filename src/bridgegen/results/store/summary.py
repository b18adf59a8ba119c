"""The key figures of a run."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from bridgegen.assess.cause import CAUSES, Cause
from bridgegen.base.arrays import Bool, Float


@dataclass(frozen=True)
class Summary:
    """The key figures of a run; NaN if there is no evaluation yet.

    Attributes:
        evaluations: how many, failed ones included.
        critical: how many of them are critical.
        failed: how many have no result.
        r_critic: critical / evaluations (the paper's R_critic).
        first: evaluations until the first critical one, or None.
        fiftieth: evaluations until the 50th, or None.
        d_min_best: smallest d_min [m].
        d_min_median: [m].
        v_d_best: largest v_d [m/s].
        v_d_median: [m/s].
        seconds: duration of the search, of all sessions together [s].
        causes: the number of scenarios of each cause, in the order in which causes are tested,
            including those that do not count as critical; empty if none was determined.
    """

    evaluations: int
    critical: int
    failed: int
    r_critic: float
    first: int | None
    fiftieth: int | None
    d_min_best: float
    d_min_median: float
    v_d_best: float
    v_d_median: float
    seconds: float
    causes: Mapping[str, int]


def summarise(
    critical: Bool,
    ok: Bool,
    d_min: Float,
    v_d: Float,
    cause: npt.NDArray[np.int8],
    seconds: float,
) -> Summary:
    """Return a run's figures from ``(N,)`` columns in the order of evaluation."""
    counts = {item.label: int(np.count_nonzero(cause == item)) for item in CAUSES}
    if not counts[Cause.VEHICLE_DYNAMICS.label]:  # of vehicles with dynamics alone
        del counts[Cause.VEHICLE_DYNAMICS.label]
    n, hits = len(critical), np.flatnonzero(critical)
    d, v = (d_min[ok], v_d[ok]) if ok.any() else (np.array([np.nan]), np.array([np.nan]))
    return Summary(
        evaluations=n,
        critical=len(hits),
        failed=int(n - ok.sum()),
        r_critic=len(hits) / n if n else float("nan"),
        first=int(hits[0]) + 1 if len(hits) else None,
        fiftieth=int(hits[49]) + 1 if len(hits) >= 50 else None,
        d_min_best=float(d.min()),
        d_min_median=float(np.median(d)),
        v_d_best=float(v.max()),
        v_d_median=float(np.median(v)),
        seconds=seconds,
        causes=counts if any(counts.values()) else {},
    )
