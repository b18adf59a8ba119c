"""Texts that are no formulas get one clear error; units are checked."""

from contextlib import suppress

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.approval import approve, refuses

from bridgegen.base.errors import InputError
from bridgegen.scenario.stl import check_units, dimension_of_unit, parse, readings
from bridgegen.scenario.stl.formula import Comparison, Constant
from bridgegen.scenario.stl.parser import MAX_DEPTH, MAX_TEXT, MAX_TOKENS


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "its"),
        ("ttc", "something"),
        ("ttc >= ", "quantity"),
        ("ttc >= 1.0 1", "formula"),
        ("ttc >= 1.0)", "formula"),
        ("(ttc >= 1.0", ")"),
        ("ego.v > 3", "column 1"),
        ("gap to bv > 3", "changes"),
        ("always(ttc > 1)", "column 8"),
        ("always(ego. > 1)", "reads ENTITY"),
        ('"Vehicle 1" > 2', "state"),
        ("min(gap to) > 1", "entity"),
        ("always[3, 1](ego.v > 0)", "interval"),
        ("always[1 m, 2](ego.v > 0)", "interval"),
        ("always[inf, inf](ego.v > 0)", "begins"),
        ("always[1](ego.v > 0)", "interval"),
        ("always(ego.v)", "always"),
        ("(ttc > 1) + 2 > 3", "+"),
        ("ttc > 1e31", "30"),
        ("ttc > 1e999", "30"),
        ("abs(ttc, d_min) > 1", "quantity"),
        ("first(ego.v, ego.x) > 1", "quantity"),
        ("ttc & 1", "&"),
        ("first(ego.v) > 1 while ego.x > 2", "stands"),
        ("min(ego.v) == 1 while ego.x > 2", "compared"),
        ("(ttc > 1 and d_min > 1) while ego.x > 2", "while"),
        ("always > 3", "needs '(' here"),
        ("(" * (MAX_DEPTH + 1), "60"),
        ("not " * (MAX_DEPTH + 1), "60"),
        ("ttc > 1" + "+1" * MAX_TOKENS, "500"),
        ("ttc > 1" + " " * MAX_TEXT, "2000"),
    ],
)
def test_what_is_no_formula(text, message):
    with refuses(InputError, message):
        parse(text)


@given(st.text(max_size=40))
def test_any_text_is_a_formula_or_refused(text):
    with suppress(InputError):
        parse(text)


WORDS = [
    "always", "until", "(", ")", "[0, 1]", "ego.v", "ttc", "gap to bv", "<", "and", "not", "3 m",
    "min", "while", ",", "-", "*", "implies", "1e3", '"a b".x',
]  # fmt: skip


@given(st.lists(st.sampled_from(WORDS), max_size=25).map(" ".join))
def test_any_words_are_a_formula_or_refused(text):
    with suppress(InputError):
        parse(text)


def test_what_is_read():
    found = [str(one) for one in readings(parse('min(gap to "Vehicle 1") > 2 while "A b".v < 3'))]
    assert found == ['"A b".v', 'gap to "Vehicle 1"']
    assert [str(one) for one in readings(parse("min(ttc to any) > 1"))] == ["ttc to any"]


@pytest.mark.parametrize(
    ("written", "value"),
    [
        ("36 km/h", 10.0),
        ("10", 10.0),
        ("180 deg", 3.141592653589793),
        ("180°", 3.141592653589793),
        ("2.5 m/s²", 2.5),
        ("2.5 m/s^2", 2.5),
        ("1 g", 9.80665),
        ("250 ms", 0.25),
        ("50 %", 0.5),
        ("-36 km/h", -10.0),
    ],
)
def test_units_are_converted(written, value):
    found = parse(f"v_d < {written}")
    assert isinstance(found, Comparison)
    assert isinstance(found.right, Constant)
    assert found.right.value == value


UNITS = {"v": "m/s", "a": "m/s²", "gap": "m", "h": "rad", "ttc": "s", "n_collision": "count"}


def units(text: str):
    return check_units(parse(text), lambda one: dimension_of_unit(UNITS.get(one.name, "?")))


@pytest.mark.parametrize(
    ("text", "unit"),
    [
        ("always(ego.v > 5)", "m/s"),
        ("ttc >= 1 s", "s"),
        ("n_collision == 0", "1"),
        ("always(ego.v * 2 s < gap to bv)", "m"),
        ("always(ego.v / 2 < 3 m/s)", "m/s"),
        ("always(ego.h < 10 deg)", "1"),
        ("always(gap to bv > ego.v * ego.v / (2 * 8 m/s²))", "m"),
        ("always(unknown to bv > ego.v)", "m/s"),
    ],
)
def test_margins_have_the_unit_of_their_comparison(text, unit):
    problems, dimension = units(text)
    assert problems == []
    assert str(dimension) == unit


@pytest.mark.parametrize(
    "text",
    [
        "ttc >= 1 m",
        "always(ego.v > gap to bv)",
        "always(ego.v + 1 s > 0)",
        "always(max(ego.v, ego.a) > 0)",
        "always(ego.h < 10 m)",
    ],
)
def test_units_must_agree(text):
    problems, _ = units(text)
    assert len(problems) == 1
    approve(problems[0], "quantities")


def test_a_mixture_has_no_unit():
    assert units("always(ego.v > 5 and gap to bv > 2)") == ([], None)
