"""Clauses of a regulation in scenario files: read, checked, part of the fingerprint."""

from importlib import resources

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.approval import approve, refuses

from bridgegen.base.errors import InputError, ScenarioError
from bridgegen.scenario.language.protocols import Clause, read_clause
from bridgegen.scenario.language.reader import load, pack_names

R157 = [name for name in pack_names() if name.startswith("r157/")]
FOLLOWING = (resources.files("bridgegen.scenario.packs.r157") / "following.yaml").read_text("utf-8")


def edited(folder, old: str, new: str):
    assert old in FOLLOWING
    path = folder / "mine.yaml"
    path.write_text(FOLLOWING.replace(old, new), "utf-8")
    return path


@pytest.mark.parametrize("name", R157)
def test_each_scenario_of_the_pack_states_a_clause_that_its_source_names(name):
    scenario = load(name)
    assert scenario.clauses
    for one in scenario.clauses:
        assert one.id.startswith("R157-5.2")
        assert one.collisions or one.criteria


def test_what_is_wrong_is_named_with_its_line(tmp_path):
    path = edited(
        tmp_path, "    criteria: [following-distance]",
        "    criteria: [following-distanc]\n"
        "  - {id: R157-5.2.3.3, text: again, collisions: any}\n"
        "  - {id: R157-5.2, text: nothing}",
    )  # fmt: skip
    with pytest.raises(ScenarioError) as error:
        load(path)
    said = "\n".join(error.value.problems)
    approve(said, "following-distanc", "5.2", "collisions", "criteria")
    assert said.count("mine.yaml, line") == 3


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ("{id: 5 2, text: a, collisions: any}", "clauses"),
        ("{id: A-1, collisions: any}", "text"),
        ("{id: A-1, text: a, collisions: all}", "collisions"),
        ("{id: A-1, text: a, collision: any}", "collision"),
    ],
)
def test_the_shape_is_checked(tmp_path, given, message):
    start = FOLLOWING.index("  - id: R157-5.2.3.3")
    stop = FOLLOWING.index("objective:")
    path = tmp_path / "mine.yaml"
    path.write_text(FOLLOWING[:start] + f"  - {given}\n\n" + FOLLOWING[stop:], "utf-8")
    with refuses(ScenarioError, message):
        load(path)


def test_another_clause_is_another_scenario(tmp_path):
    """So a suite runs it again."""
    path = edited(tmp_path, "id: R157-5.2.3.3", "id: R157-5.2.3.4")
    assert load(path).fingerprint != load("r157/following").fingerprint


IDS = st.from_regex(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,63}", fullmatch=True)
TEXTS = st.text(st.characters(codec="ascii", categories=["L", "N"]), min_size=1, max_size=30)


@given(IDS, TEXTS, st.sampled_from([None, "any", "preventable"]), st.lists(IDS, max_size=3))
def test_a_clause_is_read_again_as_it_is_recorded(id, text, collisions, criteria):
    one = Clause(id, text, collisions, tuple(criteria))
    assert read_clause(one.to_dict()) == one


def test_a_record_that_is_no_clause_is_refused():
    with refuses(InputError):
        read_clause({"id": "A-1", "text": "a", "collisions": "none"})
