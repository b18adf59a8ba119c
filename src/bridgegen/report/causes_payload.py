"""How many scenarios have which cause, as the page shows it."""

from typing import Any

import numpy as np

from bridgegen.cause import CAUSES, Cause
from bridgegen.report.data import Evaluations


def causes_payload(e: Evaluations) -> dict[str, Any] | None:
    """Return how many evaluations have each cause; number 0 is none."""
    if e.cause is None:
        return None
    return {
        "labels": ["none", *(one.label for one in CAUSES)],
        "counts": [int(np.count_nonzero(e.cause == one)) for one in Cause],
    }
