"""Rows on a GPU."""

from pathlib import Path

import numpy as np

from bridgegen.assess.conflict import _codes as codes
from bridgegen.assess.conflict._measure_kernels import MEASURED
from bridgegen.engine._device_kernels import Found, Given

PATH = Path(__file__).with_name("kernels.ptx.gz")
INTERLEAVED = ("state", "record", "verdict")
JOB = (
    *("ROWS", "ASKED", "HEAP", "HEAP_BYTES", "LANES", "RECORD_LANES", "TEMPLATE"),
    *("networks", "plan", "roads", "roads_bytes", "state", "state_bytes", "record"),
    *("record_bytes", "facts", "facts_bytes", "measuring", "measuring_bytes", "verdict"),
    *("verdict_bytes", "given", "given_bytes", "found", "found_bytes"),
)


def given_of(n: int, slots: int, e: int) -> Given:
    """Return arrays of N rows."""
    return Given(
        np.zeros((n, slots)), np.zeros((n, e)), np.zeros((n, e)), np.zeros((n, 1), np.uint64)
    )


def found_of(n: int, e: int) -> Found:
    """Return arrays of N rows."""
    whole = {"done": (1,), "ending": (4,), "wanted": (2,), "transitions": (2,), "on": (1,)}
    whole |= {"code": (1,), "worst": (1,), "whole": (e, codes.INTEGERS), "instants": (2,)}
    real = {"way": (3,), "metrics": (len(MEASURED),), "real": (e, codes.FLOATS)}
    real |= dict.fromkeys(("potential", "severity", "aside", "breach"), (e,)) | {"changes": (e, 2)}
    arrays = {name: np.zeros((n, *shape), np.int64) for name, shape in whole.items()}
    arrays |= {name: np.zeros((n, *shape)) for name, shape in real.items()}
    return Found(**arrays)
