"""Margins of formulas: hand-worked numbers, laws, and rtamt's answers."""

import warnings
from math import inf

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bridgegen.scenario.stl import horizon, parse, robustness
from bridgegen.scenario.stl.robustness import TINY

STEP = 0.5


def margin(text: str, step: float = STEP, **signals) -> float:
    """Return the margin of one recording: ego.NAME per signal, metrics as numbers."""
    steps = max(len(one) for one in signals.values() if isinstance(one, list))

    def read(one):
        values = signals[one.name]
        return np.array([values if isinstance(values, list) else [values]], dtype=np.float64)

    return float(robustness(parse(text), read, np.array([steps]), step)[0])


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("always(ego.x > 1)", -TINY),  # the least is 1, and 1 > 1 does not hold
        ("always(ego.x >= 1)", TINY),
        ("not always(ego.x >= 1)", -TINY),
        ("not always(ego.x > 1)", TINY),
        ("always(ego.x >= 0.25)", 0.75),
        ("eventually(ego.x > 3)", 2.0),
        ("eventually[0, 0.5](ego.x > 3)", -1.0),  # of 2 and 1
        ("eventually[1 s, 1.5 s](ego.x > 3)", 2.0),  # of 5 and 3
        ("always[500 ms, 1](ego.x > 0)", 1.0),  # of 1 and 5
        ("always[3, 4](ego.x > 0)", inf),  # beyond the end
        ("eventually[3, 4](ego.x > 0)", -inf),
        ("always[1, inf](ego.x > 0)", 2.0),  # of 5, 3 and 2
        ("min(ego.x) > 0.5 and max(ego.x) < 7", 0.5),
        ("first(ego.x) == 2 and last(ego.x) == 2", TINY),
        ("last(ego.x) != 2", -TINY),
        ("last(ego.x) == 5", -3.0),
        ("0 < last(ego.x) < 5", 2.0),
        ("ttc >= 1.5", 0.25),
        ("ttc >= 1.5 implies max(ego.x) > 9", -0.25),
        ("always(ego.x > 0) -> ttc < 2", 0.25),
        ("max(abs(ego.x - 3)) < 2.5", 0.5),
        ("always(max(ego.x, 2) >= 2)", TINY),
        ("always(-ego.x * 2 + 1 < 0)", 1.0),
        ("max(ego.x / 2) <= 2", -0.5),
        ("min(ego.x) > 0.5 while ego.y > 1", 0.5),  # where y is 0, y counts: 1 by 1
        ("ego.x > 2 while ego.y > 1", -1.0),
        ("max(ego.x) > 4 while ego.y > 1", -1.0),  # 5 is there where y is 0
        ("always((ego.x < 4) until[0, 1] (ego.x > 2.5))", -0.5),
        ("always(ego.x < 6) and eventually(historically[0, 1](ego.x >= 2))", TINY),
        ("always[1, 1.5](once[0, 0.5](ego.x > 4))", 1.0),
    ],
)
def test_by_hand(text, expected):
    x, y = [2.0, 1.0, 5.0, 3.0, 2.0], [2.0, 2.0, 0.0, 2.0, 2.0]
    assert margin(text, x=x, y=y, ttc=1.75) == pytest.approx(expected, rel=1e-12, abs=1e-300)


def test_until_by_hand():
    # x stays below 4 until y is 1 at 1.0 s, where it is 5: only what lies before counts.
    x, y = [2.0, 3.0, 5.0, 9.0], [0.0, 0.0, 1.0, 0.0]
    text = "always[0, 0]((ego.x < 4) until{} (ego.y > 0.5))"
    assert margin(text.format(""), x=x, y=y) == 0.5
    assert margin(text.format("[0, 1]"), x=x, y=y) == 0.5
    assert margin(text.format("[0, 0.5]"), x=x, y=y) == -0.5
    assert margin(text.format("[1.5, 2]"), x=x, y=y) == -1.0  # y is 0, x is 5 before
    since = "eventually[1.5, 1.5]((ego.x > 4) since (ego.y > 0.5))"
    assert margin(since, x=x, y=y) == 0.5


def test_what_lies_behind_a_recording_has_no_part():
    rng = np.random.default_rng(1)
    x = rng.normal(size=(7, 40))
    n_steps = np.array([40, 1, 13, 2, 40, 25, 8])
    formulas = [
        "always[0.5, 4](ego.x > -1)",
        "eventually[3, 30](ego.x > 0)",
        "always(eventually[0, 2](ego.x > 0) or historically[1, 3](ego.x < 0))",
        "always((ego.x > -2) until[0.5, 6] (ego.x > 1))",
        "eventually((ego.x > -2) since (ego.x > 1))",
        "max(ego.x) < 2 and last(ego.x) < 1",
    ]
    for text in formulas:
        formula = parse(text)
        whole = robustness(formula, lambda _: x, n_steps, STEP)
        for i, n in enumerate(n_steps.tolist()):
            alone = robustness(
                formula, lambda _, i=i, n=n: x[i : i + 1, :n], n_steps[i : i + 1], STEP
            )
            assert alone[0] == whole[i], text  # to the last bit


def test_binary_fractions_of_times_are_instants():
    assert margin("eventually[0.15, 0.15](ego.x > 0)", step=0.05, x=[0.0, 0.0, 0.0, 1.0]) == 1.0
    assert margin("always[0, 0.3](ego.x < 1)", step=0.1, x=[0.0, 0.0, 0.0, 5.0, 9.0]) == -4.0


@pytest.mark.parametrize(
    ("text", "seconds"),
    [
        ("ttc > 1", 0.0),
        ("always(ego.x > 0)", 0.0),
        ("always[2, inf](ego.x > 0)", 2.0),
        ("always[0, 5](eventually[1, 3](ego.x > 0)) or once[0, 99](ego.x > 0)", 8.0),
        ("always((ego.x > 0) until[0, 4] (ego.x > 0))", 4.0),
    ],
)
def test_how_far_a_formula_looks(text, seconds):
    assert horizon(parse(text)) == seconds


# Against rtamt, on formulas at random.

NUMBERS = st.integers(-20, 20).map(lambda n: n / 4)
SIGNALS = st.sampled_from(["ego.x", "ego.y", "(ego.x - ego.y)", "abs(ego.x)"])
COMPARED = st.builds(
    lambda signal, sign, number: f"({signal} {sign} {number})",
    SIGNALS, st.sampled_from(["<", "<=", ">", ">="]), NUMBERS,
)  # fmt: skip
INTERVALS = st.one_of(
    st.just(""),
    st.tuples(st.integers(0, 6), st.integers(0, 6)).map(lambda ab: f"[{min(ab)}, {max(ab)}]"),
)
FORMULAS = st.recursive(
    COMPARED,
    lambda inner: st.one_of(
        st.builds(
            lambda word, interval, one: f"({word}{interval}({one}))",
            st.sampled_from(["always", "eventually", "historically", "once"]), INTERVALS, inner,
        ),
        st.builds(
            lambda left, word, interval, right: f"(({left}) {word}{interval} ({right}))",
            inner, st.sampled_from(["until", "since"]), INTERVALS, inner,
        ),
        st.builds(
            lambda left, word, right: f"(({left}) {word} ({right}))",
            inner, st.sampled_from(["and", "or", "implies"]), inner,
        ),
        inner.map(lambda one: f"(not ({one}))"),
    ),
    max_leaves=6,
)  # fmt: skip


def by_rtamt(text: str, x: list[float], y: list[float]) -> float:
    """Return rtamt's margin at the first instant; steps of 1 s, names without dots."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        import rtamt

        monitor = rtamt.StlDiscreteTimeSpecification()
        for name in ("x", "y"):
            monitor.declare_var(name, "float")
        monitor.spec = text.replace("ego.", "")
        monitor.parse()
        found = monitor.evaluate({"time": list(range(len(x))), "x": x, "y": y})
    return float(found[0][1])


@settings(max_examples=150, deadline=None)
@given(FORMULAS, st.lists(st.tuples(NUMBERS, NUMBERS), min_size=2, max_size=12))  # rtamt wants two
def test_rtamt_agrees(text, points):
    pytest.importorskip("rtamt")
    x, y = ([one[k] for one in points] for k in range(2))
    ours = margin(f"always[0, 0]({text})", step=1.0, x=x, y=y)
    theirs = by_rtamt(text, x, y)
    assert ours == pytest.approx(theirs, rel=1e-12, abs=1e-300)


@settings(max_examples=100, deadline=None)
@given(FORMULAS, st.lists(st.tuples(NUMBERS, NUMBERS), min_size=1, max_size=9))
def test_the_sign_says_whether_a_formula_holds(text, points):
    x, y = ([one[k] for one in points] for k in range(2))
    found = margin(f"always[0, 0]({text})", step=1.0, x=x, y=y)
    against = margin(f"always[0, 0](not {text})", step=1.0, x=x, y=y)
    assert found == -against
    assert found != 0.0
