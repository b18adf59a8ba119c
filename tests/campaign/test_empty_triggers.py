"""Acts whose StartTrigger is empty: never, by the standard; at once, as esmini has it."""

import re

import pytest
from tests.approval import approve, refuses

import bridgegen as bg
from bridgegen.base.errors import InputError, UnknownNameError
from bridgegen.jobs.search import SearchCallbacks

from .braking import USUAL, scenario_text, write_pair


@pytest.fixture
def pair(tmp_path):
    """The braking scenario, whose act has an empty StartTrigger."""
    whole = re.sub(
        r"(</ManeuverGroup>)<StartTrigger>.*?</StartTrigger>", r"\1<StartTrigger/>",
        scenario_text(), flags=re.DOTALL,
    )  # fmt: skip
    assert whole.count("<StartTrigger/>") == 1
    return write_pair(tmp_path, USUAL, text=whole)


def test_never_unless_asked_and_it_is_said(pair):
    """The lead vehicle brakes from 15 m/s by 6 m/s² from 2 s on, or does not."""
    path, _ = pair
    still = bg.simulate_file(path)
    assert still.rollout.v[0, 1, -1] == 15.0
    approve(still.notes[0], "StartTrigger")
    begun = bg.simulate_file(path, empty_trigger="now")
    assert begun.rollout.v[0, 1, 80] == pytest.approx(15.0 - 6.0 * 2.0)
    assert not begun.notes
    with refuses(UnknownNameError, "soon"):
        bg.simulate_file(path, empty_trigger="soon")


def test_a_search_remembers_the_reading(pair, tmp_path):
    path, ranges = pair
    said: list[str] = []
    given = {
        "distribution": ranges, "algorithm": "random", "budget": 24, "keep": 2,
        "callbacks": SearchCallbacks(warning=said.append),
    }  # fmt: skip
    never = bg.run_search(path, triage="short", out=tmp_path / "never", **given)
    assert any("never starts" in one for one in said)
    now = bg.run_search(path, triage="short", out=tmp_path / "now", empty_trigger="now", **given)
    assert now.report.exists()
    assert (now.settings.empty_trigger, never.settings.empty_trigger) == ("now", None)
    assert "--empty-trigger now" in now.settings.command(tmp_path / "again")
    assert bg.resume(now.folder).failures == {}
    for one in now.scenarios:  # what is exported starts everywhere
        assert "<StartTrigger/>" not in one.read_text("utf-8")


def test_it_is_for_scenario_files(tmp_path):
    with refuses(InputError):
        bg.run_search("cut-in", empty_trigger="now", triage="short", out=tmp_path / "run")
