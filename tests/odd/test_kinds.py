"""Categories and angles, from the scenario file to what people read."""

import math
import pickle
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.approval import approve, refuses

from bridgegen.base.errors import InputError, ScenarioError
from bridgegen.jobs.compare.record import normalised
from bridgegen.scenario.language.coverage import coverage
from bridgegen.scenario.language.expression import parse
from bridgegen.scenario.language.kinds import FLOAT, INTEGER, KINDS, Angle, Category
from bridgegen.scenario.language.parameters import Axis, Parameter
from bridgegen.scenario.language.reader import load
from bridgegen.search.triage.minimal import Ladder
from bridgegen.search.triage.moves import around, nearest

EXAMPLE = Path(__file__).parents[2] / "docs/examples/braking-manner.yaml"
MANNER = """    kind: category
    values: [gentle, firm, emergency]
    default: firm
"""
WIND = """    low: 300.0
    high: 60.0
    default: 0.0
"""


@pytest.fixture(scope="module")
def scenario():
    return load(EXAMPLE)


@pytest.fixture(scope="module")
def space(scenario):
    return scenario.space()


def changed(tmp_path, old, new):
    text = EXAMPLE.read_text("utf-8")
    assert old in text
    path = tmp_path / "braking-manner.yaml"
    path.write_text(text.replace(old, new, 1), "utf-8")
    return path


def category(*names, default=0.0):
    return Parameter(
        "c", Axis.EXTENSION, "1", 0.0, len(names) - 1.0, default, Category(names)
    )  # fmt: skip


def angle(low, high, default):
    kind = Angle.declared((), low, high)
    return Parameter("a", Axis.EXTENSION, "deg", low, high, default, kind)


# -- what a file says ------------------------------------------------------------------------------


def test_a_row_holds_the_number_of_a_name_and_the_angle_beyond_the_turn(scenario):
    manner, wind = scenario.parameters["manner"], scenario.parameters["wind_from"]
    assert (manner.low, manner.high, manner.default) == (0.0, 2.0, 1.0)
    assert manner.kind == Category(("gentle", "firm", "emergency"))
    assert (wind.low, wind.high, wind.default) == (300.0, 420.0, 360.0)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (MANNER, MANNER.replace("default: firm", "default: soft"),
         "parameters.manner.default must be one of gentle, firm, emergency, got 'soft'"),
        (MANNER, MANNER.replace("firm", "gentle"), "must have each value once, got 'gentle'"),
        (MANNER, MANNER.replace("firm", "if"), "means nothing else in formulas, got 'if'"),
        (MANNER, MANNER.replace("firm", "gap"), "'gap' is a value of the category manner"),
        (MANNER, MANNER + "    low: 0.0\n", "parameters.manner of kind category has no key 'low'"),
        (MANNER, MANNER.replace("    values: [gentle, firm, emergency]\n", ""),
         "parameters.manner must have the key 'values'"),
        (WIND, WIND.replace("default: 0.0", "default: 90.0"),
         "the default of the angle wind_from [deg] must lie from 300 to 60, got 90"),
        (WIND, WIND.replace("high: 60.0", "high: 700.0"), "not more than a turn apart"),
        (WIND, WIND + "    values: [a, b]\n", "of kind angle has no key 'values'"),
        ("    unit: deg\n", "    unit: m\n", "of kind angle must have the unit deg"),
        ("    high: 25.0\n", "", "parameters.ego_speed must have the key 'high'"),
        ("    default: 13.9\n", "    default: fast\n",
         "parameters.ego_speed.default must be a number, got 'fast'"),
        ("manner == gentle", "manner == wild",
         "'manner' is one of gentle, firm, emergency, got 'wild'"),
        ("manner == gentle", "manner > gentle", "the values of 'manner' have no order"),
        ("(2 if manner == gentle", "(manner if manner == gentle",
         "'manner' is a category and no number"),
        ("target: gap\n    lo: 20 if manner == emergency else 12", "target: manner\n    lo: 1",
         "a category: its values have no order"),
        ("    rate: deceleration\n", "    rate: manner\n",
         "events.lead_brakes.rate needs a number, 'manner' is a category"),
    ],
)  # fmt: skip
def test_mistakes_are_named(tmp_path, old, new, message):
    with pytest.raises(ScenarioError) as caught:
        load(changed(tmp_path, old, new))
    (problem,) = [one for one in caught.value.problems if message in one]
    assert "braking-manner.yaml, line" in problem


def test_an_included_category_takes_another_default_by_name(tmp_path):
    text = EXAMPLE.read_text("utf-8")
    start, end = text.index("  manner:\n"), text.index("  wind_from:\n")
    manners = "fragment: manners\ndescription: One.\nparameters:\n" + text[start:end]
    (tmp_path / "manners.yaml").write_text(manners, "utf-8")
    text = text[:start] + text[end:]
    text = text.replace("include: [rural, weather]", "include: [rural, weather, manners.yaml]")
    path = tmp_path / "braking-manner.yaml"
    path.write_text(f"{text}\ndefaults: {{manner: emergency}}\n", "utf-8")
    assert load(path).parameters["manner"].default == 2.0
    path.write_text(f"{text}\ndefaults: {{manner: 0.5}}\n", "utf-8")
    with refuses(ScenarioError):
        load(path)


def test_every_kind_is_in_the_language_and_in_its_schema():
    from bridgegen.scenario.language.json_schema import schema
    from bridgegen.scenario.language.schema import ParameterSection

    known = schema()["definitions"]["ParameterSection"]
    assert known["properties"]["kind"]["enum"] == list(KINDS)
    conditions = [one["if"]["properties"]["kind"]["const"] for one in known["allOf"]]
    assert conditions == list(KINDS)
    assert "values" in ParameterSection.model_fields


# -- formulas --------------------------------------------------------------------------------------


def test_a_formula_compares_a_category_with_its_names():
    formula = parse("9 if wet != surface else 2*x", categories={"surface": ("dry", "wet")})
    columns = {"surface": np.array([0.0, 1.0]), "x": 3.0}
    assert formula.evaluate(columns).tolist() == [9.0, 6.0]
    assert formula.names == {"surface", "x"}
    assert str(formula) == "9 if wet != surface else 2*x"
    again = pickle.loads(pickle.dumps(formula))
    assert again == formula
    assert again.evaluate(columns).tolist() == [9.0, 6.0]


def test_a_formula_of_categories_is_no_number_by_itself():
    with refuses(InputError, "surface"):
        parse("surface + 1", categories={"surface": ("dry", "wet")})


# -- the decoder -----------------------------------------------------------------------------------


def test_each_name_comes_equally_often_and_the_bound_follows_it(scenario, space):
    X = space.decode(np.random.default_rng(0).random((9000, space.n_var)))
    manner, gap = X[:, space.index("manner")], X[:, space.index("gap")]
    assert np.unique(manner).tolist() == [0.0, 1.0, 2.0]
    counts = np.bincount(manner.astype(int))
    assert np.abs(counts - 3000).max() < 200  # four standard deviations of a binomial are 179
    assert gap[manner == 2.0].min() >= 20.0
    assert gap[manner < 2.0].min() < 13.0
    assert not space.violations(X)


def test_levels_divide_the_cube_into_intervals_of_one_value_each(space):
    assert max(space.levels) == 3
    column = space.levels.index(3)
    assert space.variables[column] == "manner"
    U = np.full((6, space.n_var), 0.5)
    U[:, column] = [0.0, 0.33, 0.34, 0.66, 0.67, 1.0]
    found = space.decode(U)[:, space.index("manner")]
    assert found.tolist() == [0.0, 0.0, 1.0, 1.0, 2.0, 2.0]


@given(st.integers(2, 40), st.floats(-360, 360), st.floats(0, 360), st.integers(0, 2**32 - 1))
def test_decode_and_encode_are_each_other_s_inverse(build, size, low, width, seed):
    high = low + width
    if high > 360.0:
        high -= 360.0
    parameters = [category(*(f"w{k}" for k in range(size))), angle(low, high, low)]
    space = build(parameters).space()
    X = space.decode(np.random.default_rng(seed).random((20, space.n_var)))
    assert not space.violations(X)
    np.testing.assert_allclose(space.decode(space.encode(X)), X, atol=1e-9)
    shown = [parameters[1].kind.shown(value) for value in X[:, space.index("a")].tolist()]
    np.testing.assert_allclose(np.cos(np.radians(shown)), np.cos(np.radians(X[:, 1])), atol=1e-6)
    assert max(shown) <= 360.0
    for one in parameters:  # what files hold is read again
        for value in X[:, space.index(one.name)].tolist():
            assert one.read(one.kind.written(value)) == pytest.approx(value, abs=1e-6)


@pytest.mark.parametrize("value", [2.0, "emergency"])
def test_a_category_is_fixed_by_its_name(scenario, value):
    space = scenario.space(fixed={"manner": value, "wind_from": 10.0})
    assert space.fixed == {"manner": 2.0, "wind_from": 370.0}
    X = space.decode(np.full((1, space.n_var), 0.5))
    assert X[0, space.index("manner")] == 2.0
    assert X[0, space.index("wind_from")] == 370.0


def test_a_category_is_not_fixed_at_anything_else(scenario):
    with refuses(ScenarioError, "manner"):
        scenario.space(fixed={"manner": "wild"})
    with refuses(ScenarioError, "wind_from", "90"):
        scenario.space(fixed={"wind_from": 90.0})
    with refuses(ScenarioError, "wide", "gap"):
        scenario.space(fixed={"gap": "wide"})


def test_violations_name_the_names(space):
    x = space.row({})
    x[space.index("manner")] = 3.0
    reasons = [one.reason for one in space.violations(x[np.newaxis])]
    approve(reasons, "emergency")


# -- coverage, distances, neighbours ---------------------------------------------------------------


def test_a_category_has_a_bin_for_each_name_and_an_angle_bins_that_wrap(space):
    X = space.decode(np.random.default_rng(1).random((60, space.n_var)))
    found = {
        one.name: one
        for one in coverage(space, X, np.zeros(60, bool), strength=1, sample=100).parameters
    }
    assert found["manner"].evaluated.tolist() == np.bincount(
        X[:, space.index("manner")].astype(int), minlength=3
    ).tolist()  # fmt: skip
    assert found["manner"].labels == {"words": ["gentle", "firm", "emergency"]}
    approve(found["manner"].span)
    assert found["wind_from"].edges.tolist() == [300.0, 324.0, 348.0, 372.0, 396.0, 420.0]
    assert found["wind_from"].span == "300 to 60 deg"
    assert found["wind_from"].evaluated.sum() == 60


def test_different_names_are_equally_far_apart_and_a_whole_turn_closes(build):
    space = build([category("x", "y", "z"), angle(0.0, 360.0, 0.0)]).space()
    rows = [[0.0, 1.0], [1.0, 1.0], [2.0, 1.0], [0.0, 359.0], [0.0, 3.0]]
    points = normalised(space, np.array(rows))
    far = np.linalg.norm(points[:, np.newaxis] - points, axis=2)
    assert far[0, 1] == far[0, 2] == far[1, 2] == pytest.approx(1.0)
    assert far[0, 3] == pytest.approx(far[0, 4])  # 2° each, across north or not
    assert far[0, 3] == pytest.approx(2.0 / 360.0, rel=1e-4)


def test_neighbours_keep_the_name_and_go_round_a_whole_turn(build):
    names = [f"w{k}" for k in range(90)]  # 2.5 % of so many is two
    space = build([category(*names), angle(0.0, 360.0, 0.0)]).space()
    first, second = around(space, np.array([45.0, 1.0]), 0, 0, 200, 0.025)
    assert set(first[:, 0]) == set(second[:, 0]) == {45.0}
    assert first[:, 1].min() < 10.0 < 351.0 < first[:, 1].max()
    off = np.abs((first[:, 1] - 1.0 + 180.0) % 360.0 - 180.0)
    assert off.max() <= 9.0


@given(st.floats(-360, 360), st.floats(0, 360), st.floats(-720, 720))
def test_the_nearest_angle_is_the_nearest_round_the_circle(low, width, wanted):
    low_, high_ = low, low + width
    found = float(Angle().nearest(np.array([wanted]), low_, high_)[0])
    assert low_ <= found <= high_

    def off(value):
        return abs((value - wanted + 180.0) % 360.0 - 180.0)

    best = min(off(value) for value in np.linspace(low_, high_, 200))
    assert off(found) <= best + 1e-9 if width == 0 else off(found) <= best + 1e-6


def test_a_category_goes_to_nominal_in_one_step(space):
    x = space.row({"manner": 0.0})
    ladder = Ladder.of(space, x)
    k = space.variables.index("manner")
    assert ladder.rungs[k] == 1
    assert ladder.values(np.ones(space.n_var, np.int64))[k] == 1.0
    row = nearest(space, ladder.values(np.zeros((1, space.n_var), np.int64)))
    assert row[0, space.index("manner")] == 0.0


# -- words -----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("kind", "low", "high", "text"),
    [
        (FLOAT, 1.0, 2.5, "in 1 .. 2.5"),
        (INTEGER, 2.0, 2.0, "= 2"),
        (Category(("dry", "damp", "wet")), 1.0, 2.0, "in {damp, wet}"),
        (Category(("dry", "damp", "wet")), 1.0, 1.0, "= damp"),
        (Angle(), 355.0, 370.0, "in 355 .. 10"),
        (Angle(180.0), 170.0, 190.0, "in 170 .. -170"),
    ],
)
def test_ranges_in_words(kind, low, high, text):
    show = "{:g}".format
    assert kind.range_text(low, high, show, low_counts=True, high_counts=True) == text


def test_what_harm_needs_in_words():
    show = "{:.3g}".format
    assert FLOAT.need_text(">=", 3.0, 0.0, 9.0, show) == ""  # sign and limit say it
    assert Category(("dry", "wet")).need_text(">=", 1.0, 0.0, 1.0, show) == "= wet"
    assert Angle().need_text(">=", 365.0, 350.0, 370.0, show) == "in 5 .. 10"
    assert Angle().need_text("<=", 355.0, 350.0, 370.0, show) == "in 350 .. 355"


def test_kinds_are_plain_data():
    for kind in (FLOAT, INTEGER, Category(("a", "b")), Angle(180.0)):
        assert pickle.loads(pickle.dumps(kind)) == kind
    assert repr(FLOAT) == "'float'"  # a scenario's fingerprint is made of it
    assert math.isnan(FLOAT.limits(None, 1.0)[0])
