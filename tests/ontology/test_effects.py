"""A user's own function in a scenario, and what it does when it is wrong."""

from pathlib import Path

import pytest
from tests.approval import refuses

from bridgegen.base.errors import InputError
from bridgegen.scenario.language.reader import load
from bridgegen.scenario.language.starter import start_scenario
from bridgegen.scenario.ontology.individuals import build

GOOD = """
def apply(builder, values):
    node = builder.node("crate", "Misc")
    builder.put(node, "has_name", "crate")
    builder.put(builder.iri("scenario"), "has_participant", node)
"""


def scenario_with(folder: Path, code: str, spec: str = "mine.py:apply"):
    own = start_scenario("own", folder=folder)
    text = own.read_text("utf-8").replace(
        '# effects: [{function: "my_effect.py:apply"}]', f'effects: [{{function: "{spec}"}}]'
    )
    own.write_text(text, "utf-8")
    (folder / "mine.py").write_text(code, "utf-8")
    return load(own)


def individuals(scenario):
    space = scenario.space()
    return build(scenario, space.values(space.row({})), driver="reference")


def test_it_adds_what_it_says(tmp_path):
    found = individuals(scenario_with(tmp_path, GOOD))
    assert [found.text(one, "has_name") for one in found.of_class("Misc")] == ["crate"]


@pytest.mark.parametrize(
    ("code", "spec", "text"),
    [
        (GOOD, "mine.py:aply", "mine.py:aply"),
        (GOOD, "other.py:apply", "such"),
        (GOOD, "../mine.py:apply", "file.py:function"),
        (GOOD, "os:system", "file.py:function"),
        (GOOD, "nobodys", "nobodys"),
        ("def apply(:", "mine.py:apply", "mine.py"),
        ("1 / 0", "mine.py:apply", "ZeroDivisionError"),
        (
            "def apply(builder, values):\n    return values['speeed']",
            "mine.py:apply",
            "mine.py:apply",
        ),
    ],
)
def test_mistakes_are_one_clear_error(tmp_path, code, spec, text):
    scenario = scenario_with(tmp_path, code, spec)
    with refuses(InputError, text):
        individuals(scenario)
