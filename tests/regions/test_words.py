import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.approval import approve

from bridgegen.scenario.language.parameters import Axis
from bridgegen.scenario.language.reader import load
from bridgegen.search.regions.box import (
    ANYWHERE,
    Box,
    Evidence,
    number,
    percent,
    rule,
    sentence,
    whole,
)

EVERY = load("crossroads-s4").space(tuple(Axis))
OUTER = whole(EVERY)


def box(**edges):
    low, high = OUTER.low.copy(), OUTER.high.copy()
    for name, (a, b) in edges.items():
        k = EVERY.variables.index(name)
        low[k] = low[k] if a is None else a
        high[k] = high[k] if b is None else b
    return Box(low, high)


def test_rules_read_as_people_say_them():
    one = box(
        fog_density=(61, None), bv_speed=(1.2, 2.0), lanes_per_direction=(2, 2), ego_speed=(None, 7)
    )
    approve(rule(one, EVERY), "lanes_per_direction", "fog_density")
    assert rule(OUTER, EVERY) == ANYWHERE
    approve(rule(box(lanes_per_direction=(1, 1)), EVERY), "lanes_per_direction")
    approve(rule(box(lanes_per_direction=(1, 2)), EVERY), "lanes_per_direction")


def test_a_sentence_says_what_is_known():
    fresh = Evidence(300, 252, 3)
    approve(sentence(box(fog_density=(61, None)), EVERY, "reference", fresh), "fog_density", "61")
    approve(sentence(OUTER, EVERY, "fsm", Evidence(0, 0)), "scenarios")


CONDITION = re.compile(r"(\w+) (?:(≥|≤|=) (\S+)|in (\S+) \.\. (\S+))(?: \S+)?")


def read(text):
    """What a printed rule says: per parameter the lowest and the highest value."""
    found = {}
    for condition in text.split(" and "):
        name, sign, value, low, high = CONDITION.fullmatch(condition).groups()
        if sign is None:
            found[name] = (float(low), float(high))
        else:
            least = -np.inf if sign == "≤" else float(value)
            found[name] = (least, np.inf if sign == "≥" else float(value))
    return found


@given(
    st.dictionaries(
        st.sampled_from(EVERY.variables),
        st.tuples(st.floats(0, 1), st.floats(0, 1)).map(sorted),
        min_size=1,
    ),
    st.integers(0, 2**32 - 1),
)
def test_the_rule_that_is_printed_is_the_one_that_is_checked(shares, seed):
    low, high = OUTER.low.copy(), OUTER.high.copy()
    for name, ends in shares.items():
        k = EVERY.variables.index(name)
        low[k], high[k] = OUTER.low[k] + np.array(ends) * (OUTER.high - OUTER.low)[k]
    one = Box(low, np.minimum(high, OUTER.high))
    text = rule(one, EVERY)
    said = {} if text == ANYWHERE else read(text)
    X = EVERY.decode(np.random.default_rng(seed).random((200, EVERY.n_var)))
    X = X[:, [EVERY.index(name) for name in EVERY.variables]]
    edges = [low, high, np.nextafter(low, -1e9), np.nextafter(high, 1e9)]
    rows = np.clip(np.concatenate([X, edges]), OUTER.low, OUTER.high)
    held = np.ones(len(rows), bool)
    for name, (a, b) in said.items():
        column = rows[:, EVERY.variables.index(name)]
        held &= (a <= column) & (column <= b)
    assert np.array_equal(held, one.holds(rows))


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_a_number_is_read_as_it_was(value):
    assert float(number(value)) == value


@pytest.mark.parametrize(
    ("share", "text"),
    [
        (0.0, "0 %"), (1.0, "100 %"), (0.84, "84 %"), (0.996, "99.6 %"), (0.99999, "99.9 %"),
        (0.0932, "9.3 %"), (0.00431, "0.43 %"), (0.0003, "0.03 %"),
    ],
)  # fmt: skip
def test_a_share_is_told_from_none_and_from_all(share, text):
    assert percent(share) == text
