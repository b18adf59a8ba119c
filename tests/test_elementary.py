"""The elementary functions against mpmath, and against what they promise.

``python tests/test_elementary.py 100000000`` measures the errors on that many arguments a function:
against the extended precision of the C library, then the largest against mpmath.
"""

import math
import os
import re
import subprocess
import sys
from pathlib import Path

import mpmath
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from llvmlite import binding as llvm

from bridgegen.base import _elementary_kernels as kernels
from bridgegen.base import elementary
from bridgegen.base.compilation.library import KernelLibrary
from bridgegen.engine.options import PipelineOptions
from bridgegen.engine.pipeline import Pipeline
from bridgegen.scenario.language.reader import load

SOURCES = Path(kernels.__file__).parents[1]
FINITE = st.floats(allow_nan=False, allow_infinity=False)

# name: bound [ulp], and the ranges of its arguments: even, or of even exponents ("2^").
RANGES = {
    "acos": (1.0, [((-1.0, 1.0),)]),
    "asin": (1.0, [((-1.0, 1.0),), (("2^", -60.0, 0.0),)]),
    "atan": (1.0, [((-5.0, 5.0),), (("2^", -60.0, 60.0),)]),
    "atan2": (2.0, [((-5.0, 5.0), (-5.0, 5.0)), (("2^", -30.0, 30.0), ("2^", -30.0, 30.0))]),
    "cos": (1.0, [((-4.0, 4.0),), ((-1e6, 1e6),), (("2^", -60.0, 1023.0),)]),
    "exp": (1.0, [((-2.0, 2.0),), ((-700.0, 700.0),)]),
    "expm1": (2.0, [((-2.0, 2.0),), (("2^", -60.0, 9.0),)]),
    "hypot": (2.0, [((-5.0, 5.0), (-5.0, 5.0)), (("2^", -400.0, 400.0), ("2^", -400.0, 400.0))]),
    "log": (1.0, [((0.5, 2.0),), (("2^", -1000.0, 1000.0),)]),
    "log2": (2.0, [((0.5, 2.0),), (("2^", -1000.0, 1000.0),)]),
    "power": (1.5, [((0.5, 2.0), (-700.0, 700.0)), (("2^", -300.0, 300.0), (-3.0, 3.0))]),
    "sin": (1.0, [((-4.0, 4.0),), ((-1e6, 1e6),), (("2^", -60.0, 1023.0),)]),
    "tan": (3.0, [((-4.0, 4.0),), (("2^", -60.0, 1023.0),)]),
    "tanh": (3.0, [((-2.0, 2.0),), (("2^", -60.0, 4.0),)]),
}
POSITIVE = ("log", "log2", "power")
EXTENDED = {"acos": "arccos", "asin": "arcsin", "atan": "arctan", "atan2": "arctan2"}


def drawn(rng, name, spread, n):
    columns = []
    for low, *rest in spread:
        if low == "2^":
            column = np.exp2(rng.uniform(*rest, n)) * rng.choice([-1.0, 1.0], n)
        else:
            column = rng.uniform(low, *rest, n)
        columns.append(np.abs(column) if name in POSITIVE and not columns else column)
    return columns


def exact(name, *values):
    if name == "log2":
        return mpmath.log(values[0], 2)
    return getattr(mpmath, name)(*values)


def error(name, *values):
    """Return the error in ulp against 1,200 bits: the largest angles need them."""
    with mpmath.workprec(1200):
        want = exact(name, *map(mpmath.mpf, values))
        got = getattr(elementary, name)(*values)
        return float(abs(mpmath.mpf(got) - want) / math.ulp(float(want)))


def worst(name, n, seed=0, block=1_000_000):
    """Return the largest error [ulp] of n arguments of each range, and where."""
    rng, found = np.random.default_rng(seed), (0.0, ())
    extended = getattr(np, EXTENDED.get(name, name))
    for spread in RANGES[name][1]:
        for size in [block] * (n // block) + [n % block]:
            columns = drawn(rng, name, spread, size)
            with np.errstate(all="ignore"):
                want = extended(*(column.astype(np.longdouble) for column in columns))
                off = np.abs(getattr(elementary, name)(*columns) - want)
                off = np.nan_to_num(off / np.spacing(np.abs(want.astype(np.float64))))
            for at in np.argsort(off)[-3:]:
                values = tuple(float(column[at]) for column in columns)
                found = max(found, (error(name, *values), values))
    return found


@pytest.mark.parametrize("name", RANGES)
def test_the_error_is_within_its_bound(name):
    bound, _ = RANGES[name]
    assert re.search(rf"within {bound:g} ulp", getattr(kernels, name).py_func.__doc__)
    assert worst(name, 30_000)[0] < bound


@pytest.mark.parametrize(
    ("name", "values"),
    [
        # Nearest to a multiple of π/2 of all float64. Source: Muller, Elementary Functions (2006).
        ("cos", (6381956970095103.0 * 2.0**797,)),
        ("sin", (6381956970095103.0 * 2.0**797,)),
        ("tan", (6381956970095103.0 * 2.0**797,)),
        ("sin", (1e22,)),
        ("sin", (math.pi,)),
        ("cos", (math.pi / 2.0,)),
        ("sin", (math.pi * 1e5,)),
        ("cos", (sys.float_info.max,)),
        # Hardest to round. Source: Lefèvre and Muller, Worst cases for correct rounding (2001).
        ("exp", (float.fromhex("0x1.8172a0e02f90ep-2"),)),
        ("exp", (float.fromhex("0x1.fffffffffffffp-54"),)),
        ("log", (float.fromhex("0x1.0ac9fe74a3d5dp+0"),)),
        ("log", (math.nextafter(1.0, 0.0),)),
        ("log", (5e-324,)),
        ("acos", (math.nextafter(1.0, 0.0),)),
        ("acos", (math.nextafter(-1.0, 0.0),)),
        ("power", (math.nextafter(1.0, 2.0), 3e18)),
    ],
)
def test_hard_arguments(name, values):
    assert error(name, *values) < RANGES[name][0]


@pytest.mark.parametrize(
    ("name", "values", "want"),
    [
        ("sin", (-0.0,), -0.0),
        ("cos", (0.0,), 1.0),
        ("sin", (math.inf,), math.nan),
        ("atan", (math.inf,), math.pi / 2.0),
        ("atan2", (0.0, -1.0), math.pi),
        ("atan2", (-0.0, -1.0), -math.pi),
        ("atan2", (0.0, 0.0), 0.0),
        ("atan2", (-1.0, 0.0), -math.pi / 2.0),
        ("atan2", (math.inf, -math.inf), 0.75 * math.pi),
        ("acos", (1.0,), 0.0),
        ("acos", (-1.0,), math.pi),
        ("asin", (1.0000001,), math.nan),
        ("exp", (0.0,), 1.0),
        ("exp", (710.0,), math.inf),
        ("exp", (-746.0,), 0.0),
        ("expm1", (-50.0,), -1.0),
        ("tanh", (-30.0,), -1.0),
        ("log", (1.0,), 0.0),
        ("log", (0.0,), -math.inf),
        ("log", (-1.0,), math.nan),
        ("log2", (64.0,), 6.0),
        ("hypot", (3.0, -4.0), 5.0),
        ("hypot", (3e300, 4e300), 5e300),
        ("hypot", (math.inf, math.nan), math.inf),
        ("power", (0.0, 0.0), 1.0),
        ("power", (0.0, -1.0), math.inf),
        ("power", (-2.0, 3.0), -8.0),
        ("power", (-8.0, 1.0 / 3.0), math.nan),
        ("power", (2.0, -1074.0), 5e-324),
        ("power", (10.0, 400.0), math.inf),
        ("power", (math.inf, -2.0), 0.0),
    ],
)
def test_exact_values(name, values, want):
    got = getattr(elementary, name)(*values)
    assert (got == want and math.copysign(1.0, got) == math.copysign(1.0, want)) or (
        math.isnan(got) and math.isnan(want)
    )


def test_whole_powers_are_exact():
    for base in range(1, 60):
        for exponent in range(10):
            if base**exponent < 2**53:
                assert elementary.power(base, exponent) == base**exponent


@given(FINITE)
def test_left_is_the_mirror_of_right(x):
    for name in ("sin", "tan", "atan", "tanh", "asin"):
        assert repr(getattr(elementary, name)(-x)) == repr(-getattr(elementary, name)(x)) or (
            name == "asin" and abs(x) > 1.0
        )
    assert elementary.cos(-x) == elementary.cos(x)


@given(FINITE, FINITE)
def test_a_length_has_no_order_and_no_sign(x, y):
    assert elementary.hypot(x, y) == elementary.hypot(-y, x) >= max(abs(x), abs(y))
    assert elementary.hypot(x, 0.0) == abs(x)
    assert elementary.atan2(-y, x) == -elementary.atan2(y, x)


def test_an_array_gives_the_bits_of_its_numbers_and_keeps_its_shape():
    x = np.linspace(-9.0, 9.0, 60).reshape(3, 4, 5)[:, ::2]
    found = elementary.hypot(x, 2.0)
    assert found.shape == x.shape
    assert found.ravel().tolist() == [elementary.hypot(value, 2.0) for value in x.ravel().tolist()]
    assert elementary.sin(np.zeros((0, 2))).shape == (0, 2)
    assert isinstance(elementary.sin(1), float)


def test_compiled_or_not_the_bits_are_the_same():
    script = (
        "import numpy as np\n"
        "from bridgegen.base import elementary\n"
        "from bridgegen.base._elementary_kernels import FUNCTIONS\n"
        "rng = np.random.default_rng(5)\n"
        "x = rng.normal(size=300) * 10.0 ** rng.uniform(-3, 3, 300)\n"
        "for name in FUNCTIONS:\n"
        "    f = getattr(elementary, name)\n"
        "    print(name, np.nan_to_num(f(x, x[::-1])).tobytes().hex())\n"
    )
    texts = [
        subprocess.run(
            [sys.executable, "-c", script],
            env=os.environ | {"NUMBA_DISABLE_JIT": interpreted},
            capture_output=True,
            text=True,
            check=True,
        ).stdout
        for interpreted in ("0", "1")
    ]
    assert texts[0] == texts[1]


def test_kernels_call_no_function_that_a_machine_rounds_as_it_likes():
    names = (
        "sin|cos|tan|a(?:rc)?(?:sin|cos|tan)2?|exp2?|expm1|log(?:2|10|1p)?|pow(?:er)?|hypot|tanh"
    )
    own = re.compile(rf"\b(?:math|np)\.(?:{names}|sinh|cosh|cbrt|float_power|dist)\b")
    for path in SOURCES.rglob("_*kernels.py"):
        assert not own.findall(path.read_text("utf-8")), path


def test_compiled_kernels_need_no_mathematical_library():
    logical = load("cut-in")
    pipeline = Pipeline(logical, logical.space(), PipelineOptions(ego="reference"))
    pipeline.choose_objective()
    pipeline.evaluate(pipeline.space.row({})[np.newaxis])
    declared = {
        function.name
        for library in KernelLibrary.by_symbol.values()
        for function in llvm.parse_bitcode(library._bitcode).functions
        if function.is_declaration
    }
    rounded = re.compile(
        r"(llvm\.)?(a?(sin|cos|tan)h?2?|sincos\w*|exp\w*|log\w*|pow\w*|hypot|cbrt|fma|fmuladd)(\.|$)"
    )
    assert "sqrt" in declared  # exact by IEEE 754
    assert not [name for name in declared if rounded.match(name)]


if __name__ == "__main__":
    for name in RANGES:
        print(name, *worst(name, int(sys.argv[1])), flush=True)
