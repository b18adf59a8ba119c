"""Criteria: what is read, what is refused, what they come to."""

import operator

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.approval import refuses

from bridgegen.base.errors import InputError
from bridgegen.cli.verdict.fail_if import Comparison, read_conditions

KNOWN = ("r_critic", "d_min", "v_d", "map", "and_x")
SIGNS = {
    "<": operator.lt, "<=": operator.le, ">": operator.gt,
    ">=": operator.ge, "==": operator.eq, "!=": operator.ne,
}  # fmt: skip
finite = st.floats(allow_nan=False, allow_infinity=False)


def one(text: str):
    (criterion,) = read_conditions([text], KNOWN)
    return criterion


spaces = st.text(" \t", max_size=2)
comparison = st.builds(Comparison, st.sampled_from(KNOWN), st.sampled_from(list(SIGNS)), finite)


@given(st.lists(st.tuples(comparison, spaces, spaces), min_size=1, max_size=4))
def test_what_is_written_is_read(written):
    text = " and ".join(
        f"{before}{one.figure}{after}{one.sign}{before}{one.number!r}"
        for one, before, after in written
    )
    assert one(text).comparisons == tuple(each for each, _, _ in written)


@given(st.text(max_size=30) | st.from_regex(r"[a-z_]{0,9} ?[<>=!]{0,3} ?[-+.0-9einfa]{0,8}"))
def test_everything_else_is_refused_in_one_clear_error(text):
    try:
        criterion = one(text)
    except InputError as error:
        criterion, problems = None, error.problems
    if criterion is None:
        assert all("--fail-if" in problem for problem in problems)
    else:
        assert {each.figure for each in criterion.comparisons} <= {*KNOWN}


@pytest.mark.parametrize(
    "text",
    [
        "r_crit > 0.1",
        "r_critic > 10%",
        "d_min < 2 m",
        "d_min = 2",
        "d_min < 1e999",
        "d_min < 2 or v_d > 1",
        "d_min < 2 and",
        "0.1 < r_critic",
        "",
    ],
)
def test_a_criterion_that_is_refused_is_named(text):
    with refuses(InputError, "--fail-if", text.partition(" >")[0]):
        one(text)


def test_all_that_is_wrong_is_told_at_once():
    with pytest.raises(InputError) as error:
        read_conditions(["dmin < 2", "d_min < 2", "v_d"], KNOWN)
    assert len(error.value.problems) == 2


@given(finite, st.sampled_from(list(SIGNS)), finite)
def test_a_comparison_is_python_s(value, sign, number):
    criterion = one(f"d_min {sign} {number!r}")
    failed = SIGNS[sign](value, number)
    assert criterion.judge({"d_min": value}).verdict == ("failed" if failed else "passed")


@pytest.mark.parametrize(
    ("d_min", "v_d", "verdict"),
    [
        (1.0, 5.0, "failed"),
        (1.0, 0.5, "passed"),
        (3.0, 5.0, "passed"),
        (float("nan"), 5.0, "unknown"),
        (float("nan"), 0.5, "passed"),  # one that does not hold is enough
        (float("nan"), float("nan"), "unknown"),
        (float("inf"), 5.0, "passed"),
    ],
)
def test_all_of_a_criterion_must_hold_and_what_nobody_knows_is_no_pass(d_min, v_d, verdict):
    outcome = one("d_min < 2 and v_d >= 1").judge({"d_min": d_min, "v_d": v_d})
    assert outcome.verdict == verdict
    assert outcome.test == "not d_min < 2 and v_d >= 1"
    assert outcome.figures == ("d_min", "v_d")
