"""Number of scenarios by cause, as data of the page."""

from typing import Any

import numpy as np

from bridgegen.assess.cause import Cause
from bridgegen.pages.data import Evaluations


def causes_payload(e: Evaluations) -> dict[str, Any] | None:
    """Return the number of evaluations per cause; cause 0 is none.

    The vehicle's dynamics, the last one, is left out where no scenario is put down to it.
    """
    if e.cause is None:
        return None
    counts = [int(np.count_nonzero(e.cause == one)) for one in Cause]
    shown = len(counts) if counts[Cause.VEHICLE_DYNAMICS] else int(Cause.VEHICLE_DYNAMICS)
    return {
        "labels": ["none", *(one.label for one in Cause if one)][:shown],
        "counts": counts[:shown],
    }
