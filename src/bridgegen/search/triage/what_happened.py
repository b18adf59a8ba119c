"""What happened in rows, as coordinates in which equal events are near, whatever their parameters.

Two rows whose motion and contact agree are one finding: weather that the driver does not depend on
makes no other one of it.
"""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from bridgegen.assess.conflict.findings import Findings
from bridgegen.base.arrays import Float
from bridgegen.engine.evaluation import CODES, EVENT, MEASURES

LEAST = {
    "time": 1.0, "x": 5.0, "y": 5.0, "v_ego": 2.0, "v_other": 2.0, "closing_normal": 2.0,
    "closing_tangential": 2.0, "ttc": 0.5,
}  # fmt: skip
"""The least range of a quantity, in its unit: rows that differ by less are not spread further."""


def of_events(event: Float) -> Float:
    """Return coordinates of N events, whose distance is `bridgegen.search.triage.distinct.apart`.

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
    for one in labels:
        _, which = np.unique(one, return_inverse=True)
        columns.append(np.eye(int(which.max(initial=0)) + 1)[which.reshape(-1)] / np.sqrt(2.0))
    # ``apart`` takes the mean of all columns: that of the numbers is meant, and each label alone.
    total = sum(part.shape[1] for part in columns)
    weights = [np.sqrt(total / max(numbers.shape[1], 1)), *[np.sqrt(total)] * len(labels)]
    return np.hstack([part * w for part, w in zip(columns, weights, strict=True)])
