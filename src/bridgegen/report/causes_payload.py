"""Number of scenarios by cause, as data of the page."""

from typing import Any

import numpy as np

from bridgegen.cause import CAUSES, Cause
from bridgegen.report.data import Evaluations


def causes_payload(e: Evaluations) -> dict[str, Any] | None:
    """Return the number of evaluations per cause; cause 0 is none."""
    if e.cause is None:
        return None
    return {
        "labels": ["none", *(one.label for one in CAUSES)],
        "counts": [int(np.count_nonzero(e.cause == one)) for one in Cause],
    }
