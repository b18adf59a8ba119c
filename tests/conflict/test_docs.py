"""docs/conflicts.md and its figure name what the code has."""

import importlib.util
from pathlib import Path

import pytest

from bridgegen.assess.conflict import _limits as limits
from bridgegen.assess.conflict.types import ConflictType, Rule

DOCS = Path(__file__).parents[2] / "docs"
PAGE = (DOCS / "conflicts.md").read_text(encoding="utf-8")


def test_the_figure_is_the_one_that_the_script_draws():
    """Otherwise: python docs/make_conflicts.py."""
    spec = importlib.util.spec_from_file_location("make_conflicts", DOCS / "make_conflicts.py")
    script = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(script)
    assert set(script.PICTURES) == set(ConflictType) - {ConflictType.NONE}
    assert script.picture() == (DOCS / "conflicts.svg").read_text(encoding="utf-8")


@pytest.mark.parametrize("one", [*ConflictType, *Rule], ids=lambda one: one.label or "none")
def test_every_type_and_rule_is_on_the_page(one):
    assert one.label in PAGE


@pytest.mark.parametrize(
    "said",
    [
        f"TTC ≤ {limits.SERIOUS_TTC:g} s",
        f"≥ {limits.SERIOUS_DECELERATION:g} m/s²",
        f"more than {limits.BRISK_SLOW[1]:g} m/s² at {limits.BRISK_SLOW[0]:g} m/s",
        f"{limits.BRISK_FAST[1]:g} m/s² at {limits.BRISK_FAST[0]:g} m/s",
        f"nearer than {limits.CLOSE_CALL:g} m",
        f"within {limits.HORIZON:g} s",
        f"for {limits.REACTION:g} s",
        f"{limits.BRAKING / 9.81:.3f} g",
        f"{limits.JERK:g} m/s³",
        f"comfortable braking of {limits.COMFORT:g} m/s²",
        f"widened by {limits.MARGIN:g} m",
        f"more than {limits.ASIDE:g} m across",
        f"has stood for {limits.STOOD:g} s",
        f"by {limits.HARD:g} m/s² or more",
    ],
)
def test_the_page_has_the_limits_of_the_code(said):
    assert said in PAGE
