"""esmini's library: where it is, and that it is it."""

from pathlib import Path

import pytest
from tests.approval import refuses

from bridgegen.base.errors import InputError
from bridgegen.engine.pipeline import Pipeline
from bridgegen.scenario.language.reader import load
from bridgegen.simulation.choice import SimulatorChoice


def made(access=None, settings=None):
    logical = load("crossroads-s1")
    choice = SimulatorChoice("esmini", settings or {}, access or {})
    return Pipeline(logical, logical.space(), simulator=choice)


def test_it_must_be_named(monkeypatch):
    monkeypatch.delenv("ESMINI_LIB", raising=False)
    with refuses(InputError, "--esmini-lib"):
        made()


def test_it_must_be_there(tmp_path):
    missing = str(tmp_path / "libesminiLib.so")
    with refuses(InputError):
        made({"--esmini-lib": missing})


def test_it_must_be_a_library(tmp_path):
    text = tmp_path / "libesminiLib.so"
    text.write_text("not a library")
    with refuses(InputError):
        made({"--esmini-lib": str(text)})


def test_it_must_be_esmini_s():
    import _ctypes

    if not getattr(_ctypes, "__file__", None):
        pytest.skip("no other library at hand")
    with pytest.raises(InputError, match="is not esmini's library: it has no function SE_Init"):
        made({"--esmini-lib": str(Path(_ctypes.__file__))})


@pytest.mark.parametrize("steps", [0, 101, 1.5, True, "many"])
def test_its_steps_are_few_whole_ones(steps):
    with refuses(InputError, "100"):
        made({"--esmini-lib": "any"}, {"steps": steps})
