import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridgegen.base.errors import FileFormatError
from bridgegen.openx.openscenario.values import (
    Expr,
    Kind,
    ParameterRef,
    format_double,
    format_value,
    parse_literal,
    parse_value,
    resolve,
)


@given(st.floats(allow_nan=False))
def test_a_double_reads_back_to_the_bit(value):
    assert parse_literal(Kind.DOUBLE, format_double(value)) == value


@given(st.floats(min_value=1e-15, max_value=1e21))
def test_common_doubles_have_no_exponent(value):
    assert "e" not in format_double(value)
    assert "e" not in format_double(-value)


def test_no_nan_is_written():
    with pytest.raises(ValueError, match="NaN"):
        format_double(math.nan)


@pytest.mark.parametrize(
    ("kind", "text", "value"),
    [
        (Kind.DOUBLE, " 1.5\n", 1.5),
        (Kind.DOUBLE, "-.5e1", -5.0),
        (Kind.DOUBLE, "INF", math.inf),
        (Kind.DOUBLE, "-INF", -math.inf),
        (Kind.BOOLEAN, "1", True),
        (Kind.BOOLEAN, "false", False),
        (Kind.INT, "-2147483648", -(2**31)),
        (Kind.UNSIGNED_SHORT, "65535", 65535),
        (Kind.STRING, " kept ", " kept "),
        (Kind.STRING, "${not an expression here}", "${not an expression here}"),
        (Kind.DATE_TIME, "2024-02-29T12:00:00", "2024-02-29T12:00:00"),
        (Kind.DATE_TIME, "2020-10-01T18:30:30.5+02:00", "2020-10-01T18:30:30.5+02:00"),
    ],
)
def test_literals_by_their_xsd_type(kind, text, value):
    assert parse_value(kind, text) == value


@pytest.mark.parametrize(
    ("kind", "text"),
    [
        (Kind.DOUBLE, ""),
        (Kind.DOUBLE, "NaN"),
        (Kind.DOUBLE, "inf"),
        (Kind.DOUBLE, "1_000"),
        (Kind.DOUBLE, "1,5"),
        (Kind.DOUBLE, "1e999"),
        (Kind.DOUBLE, "٣"),
        (Kind.DOUBLE, "0x10"),
        (Kind.BOOLEAN, "True"),
        (Kind.INT, "2147483648"),
        (Kind.INT, "1.0"),
        (Kind.INT, "9" * 5000),
        (Kind.UNSIGNED_INT, "-1"),
        (Kind.UNSIGNED_SHORT, "65536"),
        (Kind.DATE_TIME, "2023-02-29T12:00:00"),
        (Kind.DATE_TIME, "2023-02-28"),
        (Kind.DATE_TIME, "2023-02-28T25:00:00"),
        (Kind.DOUBLE, "$"),
        (Kind.DOUBLE, "$1"),
        (Kind.DOUBLE, "${1+}"),
        (Kind.DOUBLE, "${1"),
        (Kind.DOUBLE, "${a+1}"),
        (Kind.DOUBLE, "${__import__(1)}"),
        (Kind.DOUBLE, "${$max+1}"),
        (Kind.DOUBLE, "${$true}"),
        (Kind.DOUBLE, "${1 if true else 2}"),
        (Kind.BOOLEAN, "${1 < 2}"),
        (Kind.BOOLEAN, "${True}"),
        (Kind.DOUBLE, "${pow(2)}"),
        (Kind.DOUBLE, "${" + "(" * 500 + "1" + ")" * 500 + "}"),
        (Kind.DOUBLE, "${" + "1+" * 5000 + "1}"),
    ],
)
def test_malformed_values_are_refused(kind, text):
    with pytest.raises(FileFormatError):
        parse_value(kind, text)


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("${54.9 - $d}", 34.9),
        ("${-($d)}", -20.0),
        ("${pow($d,2)/4}", 100.0),
        ("${sqrt($d*5)+floor(1.9)+ceil(1.1)+round(2.6)}", 16.0),
        ("${$d % 7}", 6.0),
        ("${2.1E-7*0+$d}", 20.0),
        ("${sin($d/20)+cos(0)+tan(0)}", math.sin(1.0) + 1.0),
        ("${asin(1)+acos(1)+4*atan(1)}", 1.5 * math.pi),
        ("${sign(-$d)+abs(-3)+max(1,2)+min(1,$d)}", 5.0),
        ("${not true or $d and true}", 1.0),
        ("${not (true or false)}", 0.0),
        ("${8/4/2-1+2*3%4}", 2.0),
    ],
)
def test_expressions_by_hand(text, value):
    expression = parse_value(Kind.DOUBLE, text)
    assert expression == Expr(text)
    assert float(expression.resolve({"d": 20.0})) == pytest.approx(value, abs=1e-12)


def test_an_expression_names_what_it_needs():
    assert Expr("${$a*2-$b_1}").names == {"a", "b_1"}
    assert ParameterRef("$a").names == {"a"}
    with pytest.raises(KeyError):
        Expr("${$a+1}").resolve({"b": 1.0})


def test_columns_resolve_row_by_row():
    columns = {"a": np.array([0.0, 2.5, -90.0]), "b": np.array([1.0, 2.0, 3.0])}
    expression = Expr("${0.1*pow(500,$b/100)-$a}")
    rows = expression.resolve(columns)
    assert rows.shape == (3,)
    for k in range(3):
        alone = expression.resolve({name: float(column[k]) for name, column in columns.items()})
        assert float(alone) == rows[k]
    assert resolve(ParameterRef("$a"), columns) is columns["a"]
    assert resolve(3.0, columns) == 3.0


@pytest.mark.parametrize(
    ("kind", "value", "error"),
    [
        (Kind.STRING, "$looks_like_a_reference", ValueError),
        (Kind.STRING, 3.0, TypeError),
        (Kind.DOUBLE, "3", TypeError),
        (Kind.DOUBLE, True, TypeError),
        (Kind.BOOLEAN, 1, TypeError),
        (Kind.INT, 2.0, TypeError),
    ],
)
def test_values_of_another_type_are_not_written(kind, value, error):
    with pytest.raises(error):
        format_value(kind, value)


@pytest.mark.parametrize("text", ["name", "${$a}", "$a b", "$"])
def test_a_reference_is_a_name(text):
    with pytest.raises(FileFormatError):
        ParameterRef(text)
