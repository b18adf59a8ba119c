import ast

import numpy as np
import pyoxigraph as ox
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridgegen.scenario.language.expression import parse
from bridgegen.scenario.language.kinds import TOLERANCE
from bridgegen.scenario.ontology.sparql import binds, literal, variable

XSD_DOUBLE = "http://www.w3.org/2001/XMLSchema#double"


def evaluate(text, **columns):
    """Values of a formula as SPARQL has them; NaN where the result is unbound."""
    expression = parse(text)
    names = list(columns) or ["unused"]
    columns = columns or {"unused": [0.0]}
    rows = " ".join(
        "(" + " ".join(f'"{float(value)!r}"^^<{XSD_DOUBLE}>' for value in row) + ")"
        for row in zip(*columns.values(), strict=True)
    )
    heads = " ".join(variable(name) for name in names)
    query = f"SELECT ?r WHERE {{ VALUES ({heads}) {{ {rows} }} {binds(expression, 'r')} }}"
    return np.array(
        [np.nan if row["r"] is None else float(row["r"].value) for row in ox.Store().query(query)]
    )


def agree(text, **columns):
    ours = evaluate(text, **columns)
    expression = parse(text)
    theirs = expression.evaluate({name: np.asarray(value) for name, value in columns.items()})
    np.testing.assert_allclose(ours, np.broadcast_to(theirs, ours.shape), rtol=1e-11, atol=1e-13)


LARGE = np.logspace(-60, 60, 121)


@pytest.mark.parametrize(
    ("text", "x"),
    [
        ("sqrt(x)", np.r_[0.0, LARGE, -LARGE[:5], 2.0, 4.0, 0.25]),
        ("log(x)", np.r_[0.0, LARGE, -1.0, np.nextafter(1.0, 0.0), 1.0, 2.0]),
        ("exp(x)", np.r_[np.linspace(-700.0, 700.0, 141), 0.0, 1e-9, 800.0, -800.0]),
        ("sin(x)", np.linspace(-40.0, 40.0, 321)),
        ("cos(x)", np.linspace(-40.0, 40.0, 321)),
        ("acos(x)", np.r_[np.linspace(-1.0, 1.0, 201), 1 - 1e-9, 1.0 + 1e-9, -2.0]),
        ("atan(x)", np.r_[np.linspace(-5.0, 5.0, 201), 1e-9, -1e7, 1e9, -1e200, np.inf]),
        ("tan(x)", np.linspace(-1.5, 1.5, 201)),
        ("asin(x)", np.r_[np.linspace(-1.0, 1.0, 201), 0.5, -0.5, 1 - 1e-9, 1.0 + 1e-9, -2.0]),
        ("x**2 + x**7 + x**-3 + x**0.5 + x**-0.5", np.linspace(0.1, 5.0, 50)),
        ("x**2.5", np.r_[np.linspace(0.0, 9.0, 19), -1.0]),
        ("abs(x) + 10*floor(x) + 100*ceil(x) + 1e3*round(x) + 1e4*sign(x)", np.arange(-3, 3, 0.25)),
    ],
)
def test_functions_agree_with_numpy_on_a_grid(text, x):
    agree(text, x=x)


def test_known_values():
    text = "asin(x)"
    assert evaluate(text, x=[0.5])[0] == pytest.approx(np.pi / 6, abs=1e-14)
    assert evaluate("125/4 * (2/pi) * asin((x + 20)/70)", x=[50.0, -90.0, -20.0]) == pytest.approx(
        [31.25, -31.25, 0.0], abs=1e-12
    )


@pytest.mark.parametrize(
    "text", ["pow(x, y)", "x % y", "x / y", "min(x, y, 1)", "max(x, y)", "1 if x > y else 0"]
)
def test_functions_of_two(text):
    x, y = np.meshgrid([-2.5, -2.0, -1.0, 0.0, 0.5, 1.0, 3.0], [-3.0, -1.5, 0.0, 0.5, 2.0, 3.0])
    agree(text, x=x.ravel(), y=y.ravel())


@pytest.mark.parametrize(
    ("text", "x", "expected"),
    [
        ("1 if sqrt(x) > 1 else 2", [-1.0], [2.0]),  # NaN > 1 is false
        ("1 if sqrt(x) != 1 else 2", [-1.0], [1.0]),  # NaN differs from everything
        ("1 if not sqrt(x) > 1 else 2", [-1.0], [1.0]),
        ("1 if x > 0 and sqrt(x) > 1 else 2", [-1.0, 4.0], [2.0, 1.0]),
        ("1 if x < 0 or sqrt(x) > 1 else 2", [-1.0, 0.0], [1.0, 2.0]),
        ("x > 2", [3.0, 1.0], [1.0, 0.0]),
        ("sqrt(x) if x > 0 else 7", [-1.0, 9.0], [7.0, 3.0]),  # the other branch does not matter
    ],
)
def test_truth_values_are_numpys(text, x, expected):
    assert evaluate(text, x=x).tolist() == expected
    assert parse(text).evaluate({"x": np.array(x)}).tolist() == expected


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_literals_keep_every_bit(value):
    answer = next(iter(ox.Store().query(f"SELECT ({literal(value)} AS ?r) {{}}")))["r"]
    assert float(answer.value) == value
    assert answer.datatype.value == XSD_DOUBLE


def formulas():
    names = st.sampled_from(["x", "y"])
    leaf = names | st.floats(-9, 9).map(lambda value: repr(round(value, 2)))

    def larger(inner):
        pair = st.tuples(inner, inner)
        compare = st.tuples(inner, st.sampled_from(["<", "<=", ">", ">=", "=="]), inner)
        return (
            st.tuples(inner, st.sampled_from("+-*/"), inner).map(
                lambda p: f"({p[0]} {p[1]} {p[2]})"
            )
            | st.tuples(st.sampled_from(["sin", "abs", "floor", "sqrt", "sign"]), inner).map(
                lambda p: f"{p[0]}({p[1]})"
            )
            | pair.map(lambda p: f"max({p[0]}, {p[1]})")
            | st.tuples(compare, pair).map(
                lambda p: f"({p[1][0]} if {' '.join(p[0])} else {p[1][1]})"
            )
        )

    return st.recursive(leaf, larger, max_leaves=6)


@given(formulas(), st.floats(-5, 5), st.floats(-5, 5))
def test_any_formula_has_numpys_value(text, x, y):
    def theirs_of(part):
        return float(parse(part).evaluate({"x": np.array([x]), "y": np.array([y])}).ravel()[0])

    theirs = theirs_of(text)
    ours = evaluate(text, x=[x], y=[y])[0]
    # undefined, or the sine of so large a number that its argument's last bit decides
    calls = [one for one in ast.walk(ast.parse(text)) if isinstance(one, ast.Call)]
    turns = [theirs_of(ast.unparse(one.args[0])) for one in calls if ast.unparse(one.func) == "sin"]
    if np.isnan(theirs) or max(map(abs, [theirs, *turns])) > 1e8:
        return
    # a step (floor, a comparison) may fall the other way by the last bit of its argument
    steps = any(isinstance(node, ast.IfExp) for node in ast.walk(ast.parse(text)))
    steps = steps or any(word in text for word in ("floor", "sign"))
    assert steps or abs(ours - theirs) <= 1e-3 * TOLERANCE * (1 + abs(theirs))


def test_undefined_is_unbound_and_stays_so():
    assert np.isnan(evaluate("max(1, sqrt(x))", x=[-1.0])[0])
    assert np.isnan(evaluate("0/x + 5", x=[0.0])[0])
    assert np.isnan(evaluate("asin(x)", x=[1.001])[0])
