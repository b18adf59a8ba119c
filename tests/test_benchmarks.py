"""The benchmarks run as they are documented; what they measure is not tested here."""

import importlib.util
from pathlib import Path

import pytest
from tests.approval import approve

from bridgegen.base.extras import EXTRAS, Extra

RUN = Path(__file__).parents[1] / "benchmarks" / "run.py"


@pytest.fixture
def benchmarks(monkeypatch):
    monkeypatch.syspath_prepend(str(RUN.parent))
    spec = importlib.util.spec_from_file_location("benchmarks_run", RUN)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_without_the_extra_rl_its_algorithms_are_skipped_with_one_line(benchmarks, monkeypatch):
    measured = []

    def taken(name):
        measured.append(name)
        return 1e-3

    monkeypatch.setattr(benchmarks, "seconds_a_row", taken)
    monkeypatch.setitem(EXTRAS, "rl", Extra(("a_module_that_is_not_there",), ""))
    rows = benchmarks.algorithms()
    (line,) = [name for name, *_ in rows if "skipped" in name]
    approve(line)
    assert "random" in measured
    assert not {"dqn", "ddpg", "ppo"} & set(measured)
