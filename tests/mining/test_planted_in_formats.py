"""Events that are planted in files of each format are found, as `benchmarks/recordings.py` does."""

import importlib.util
import sys
from pathlib import Path

import numpy as np
import pytest

PLACE = Path(__file__).parents[2] / "benchmarks/recordings.py"


def benchmark():
    spec = importlib.util.spec_from_file_location("benchmarks_recordings", PLACE)
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # its dataclasses look themselves up
    spec.loader.exec_module(module)
    return module


recordings = benchmark()


@pytest.mark.parametrize("name", recordings.FORMATS)
def test_events_come_back_through_files(name, monkeypatch):
    monkeypatch.setattr(recordings, "ROWS", 12)
    found = recordings.piece(("cut-out", name, 1, 0.0))
    assert len(found["found"]) >= 8
    assert all(found["found"])
    assert all(found["true"])
    for key, width in found["ranges"].items():
        error = np.abs(np.subtract(found["mined"][key], found["planted"][key])) / width
        assert error.max() <= 0.03, key
