"""The constants that several stages share, by value, and what is made of them."""

import ast
from pathlib import Path

import pytest
from tests.approval import approve

import bridgegen
from bridgegen.assess.conflict import _limits
from bridgegen.assess.conflict.plausibility import LIMITS
from bridgegen.assess.conflict.summary import CAREFUL_DRIVER
from bridgegen.assess.conflict.types import RULES, Rule
from bridgegen.assess.metrics import METRICS
from bridgegen.base import physics
from bridgegen.drivers.drivers import CAREFUL, OTHERS, UN_R157
from bridgegen.drivers.kinds import CAR
from bridgegen.scenario.language.expression import parse
from bridgegen.scenario.language.rules import GRIP_FORMULA
from bridgegen.scenario.ontology.conduct import conduct_rules
from bridgegen.scenario.ontology.sparql import literal

SOURCES = Path(bridgegen.__file__).parent


def test_the_constants_are_those_of_their_sources():
    assert physics.GRAVITY == 9.81
    assert physics.DRY_FRICTION == 0.85  # Wong, table 1.3: 0.8 to 0.9
    assert physics.GRIP == 0.85 * 9.81
    assert physics.HARD_BRAKING == 4.9  # paper, Table I
    # UN R157, Annex 3
    assert physics.CAREFUL_REACTION == 0.75
    assert physics.CAREFUL_BRAKING == 0.774 * 9.81
    assert physics.CAREFUL_JERK == 12.65
    assert pytest.approx(0.6, abs=1e-3) == physics.CAREFUL_BRAKING / physics.CAREFUL_JERK


def test_formulas_and_limits_have_the_same_numbers():
    assert GRIP_FORMULA == "0.85*9.81"
    assert float(parse(GRIP_FORMULA).evaluate({})) == 0.85 * 9.81
    assert (_limits.REACTION, _limits.BRAKING, _limits.JERK) == (0.75, 0.774 * 9.81, 12.65)
    assert LIMITS[CAR, 3] == 9.81  # a car's lateral acceleration: 1 g


def test_texts_have_the_same_numbers():
    bends = [one for one in conduct_rules() if one.key.startswith("bend-")]
    assert len(bends) == 3
    for one in bends:
        approve(one.message, "0.85", "9.81")
        assert f"({literal(0.85 * 9.81)} * COALESCE(MIN(?friction)" in one.select
    assert "0.75 s, 0.774 g" in CAREFUL_DRIVER
    assert "0.75 s, 0.774 g" in RULES[Rule.UNSAFE_START][1]
    approve(OTHERS["attentive"], "0.75 s", "0.774")
    assert "after 0.75 s, by up to 0.774 g" in UN_R157.description
    assert "0.4 s of perception and 0.75 s" in CAREFUL.description
    assert "through 4.9 m/s²" in METRICS["n_brake"].description


@pytest.mark.parametrize("number", ["9.81", "0.774", "4.9"])
def test_no_other_module_states_them(number):
    stating = {
        path.relative_to(SOURCES).as_posix()
        for path in SOURCES.rglob("*.py")
        if number in (text := path.read_text("utf-8"))  # parsing all takes long
        for node in ast.walk(ast.parse(text))
        if isinstance(node, ast.Constant) and node.value == float(number)
    }
    # Known answers state what they expect: a wrong constant must not agree with itself.
    assert stating - {"jobs/credibility/known_answers.py"} == {"base/physics.py"}
