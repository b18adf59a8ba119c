"""What happened in rows, as coordinates in which equal events are near, whatever their parameters.

Two rows whose motion and contact agree are one finding: weather that the driver does not depend on
makes no other one of it.
"""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from bridgegen.assess.conflict.findings import Findings
from bridgegen.base.arrays import Float, Int
from bridgegen.engine.trials import CODES, EVENT, MEASURES

LEAST = {
    "time": 1.0,
    "x": 5.0,
    "y": 5.0,
    "v_ego": 2.0,
    "v_other": 2.0,
    "closing_normal": 2.0,
    "closing_tangential": 2.0,
    "ttc": 0.5,
}
"""The least range of a quantity, in its unit: rows that differ by less are not spread further."""


def of_events(event: Float) -> Float:
    """Return coordinates of N events, which `apart` compares.

    Args:
        event: ``(N, len(EVENT))``, see ``Trials.event``. Their numbers are scaled to 0 to 1; events
            of different partners, types or zones are 1 apart or more.
    """
    measures = event[:, [EVENT.index(name) for name in MEASURES]]
    least = np.array([LEAST[name] for name in MEASURES])
    return _coordinates(measures, least, [event[:, EVENT.index(name)] for name in CODES])


def of_results(metrics: Float, findings: Findings) -> Float:
    """Return coordinates of N rows by their recorded results, where events are not known.

    Args:
        metrics: ``(N, M)``; what is infinite or NaN counts as far.
        findings: of the rows.
    """
    texts = (findings.conflict, findings.conflict_type, findings.partner)
    return _coordinates(metrics, np.zeros(metrics.shape[1]), texts)


def _coordinates(numbers: Float, least: Float, labels: Sequence[npt.NDArray[np.generic]]) -> Float:
    finite = np.isfinite(numbers)
    low = np.where(finite, numbers, np.inf).min(axis=0, initial=np.inf)
    high = np.where(finite, numbers, -np.inf).max(axis=0, initial=-np.inf)
    low, high = np.where(low > high, 0.0, low), np.where(low > high, 0.0, high)
    width = np.maximum(high - low, least)
    shares = np.divide(numbers - low, width, out=np.zeros_like(numbers), where=finite & (width > 0))
    columns = [np.where(finite, shares, 2.0)]
    for label in labels:
        _, which = np.unique(label, return_inverse=True)
        columns.append(np.eye(int(which.max(initial=0)) + 1)[which.reshape(-1)] / np.sqrt(2.0))
    # ``apart`` takes the mean of all columns: that of the numbers is meant, and each label alone.
    total = sum(part.shape[1] for part in columns)
    weights = [np.sqrt(total / max(numbers.shape[1], 1)), *[np.sqrt(total)] * len(labels)]
    return np.hstack([part * w for part, w in zip(columns, weights, strict=True)])


# --- Rows that differ from each other ---


# At 0.1 alone, ten exported scenarios of PSO on S4 were one scenario in ten weathers.
DISTINCT = (0.2, 0.1)
"""Least distances between two kept scenarios: root mean square over what happened in them, or over
the searched parameters, each scaled to 0..1. The second distance counts where too few differ by the
first."""

COPY = 1e-3
"""Distance below which rows are the same."""


def apart(U: Float, u: Float) -> Float:
    """Return the distance of rows ``(N, n_var)`` from one ``(n_var,)``, ``(N,)`` in [0, 1]."""
    if not U.shape[1]:
        return np.zeros(len(U))
    distance: Float = np.sqrt(((U - u) ** 2).mean(axis=1))
    return distance


def distinct(U: Float, order: Int, keep: int, kept: Sequence[int] = ()) -> list[int]:
    """Return the first rows of an order that differ from each other, and from those kept already.

    Args:
        U: ``(N, n)`` coordinates, scaled to 0..1.
        order: positions in U, the best first.
        keep: how many at most, those kept already included.
        kept: positions of rows that are kept in any case.

    Returns:
        The positions of the further rows, those that differ most first.
    """
    chosen = list(kept)
    for distance in DISTINCT:
        near = np.zeros(len(order), dtype=bool)
        for row in chosen:
            near |= apart(U[order], U[row]) < distance
        rest = order[~near]
        while len(rest) and len(chosen) < keep:
            best = int(rest[0])
            chosen.append(best)
            rest = rest[apart(U[rest], U[best]) >= distance]
    return chosen[len(kept) :]
