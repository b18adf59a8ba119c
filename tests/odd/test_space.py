import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from tests.approval import approve, refuses

from bridgegen.base.errors import ScenarioError, UnknownNameError
from bridgegen.scenario.language.kinds import FLOAT, INTEGER, TOLERANCE
from bridgegen.scenario.language.parameters import Axis
from bridgegen.scenario.language.reader import load
from bridgegen.scenario.language.space import probes

EVERY = tuple(Axis)
_unit = st.one_of(st.sampled_from([0.0, 1.0, 0.5]), st.floats(0.0, 1.0))


def cubes(width):
    shape = st.tuples(st.integers(1, 12), st.just(width))
    return hnp.arrays(np.float64, shape, elements=_unit)


SPACES = {
    "default": load("crossroads-s4").space(),
    "every": load("crossroads-s3").space(EVERY),
    "static": load("crossroads-s1").space(["static"]),
    "static, wide": load("crossroads-s1").space(
        ["static"], {"lanes_per_direction": 3, "lane_width": 4.0}
    ),
    "weather, night": load("crossroads-s2").space(["weather"], {"sun_altitude_angle": -30.0}),
}


@pytest.mark.parametrize("name", SPACES)
@given(data=st.data())
@settings(deadline=None)
def test_every_point_of_the_cube_is_feasible(name, data):
    space = SPACES[name]
    X = space.decode(data.draw(cubes(space.n_var)))
    assert space.violations(X) == []


@st.composite
def chains(draw):
    """Parameters, each limited by those before it to some part of its range, never to nothing."""
    count = draw(st.integers(2, 6))
    lows = draw(st.lists(st.integers(-50, 50), min_size=count, max_size=count))
    widths = draw(st.lists(st.integers(1, 40), min_size=count, max_size=count))
    kinds = draw(st.lists(st.sampled_from([FLOAT, INTEGER]), min_size=count, max_size=count))
    bounds = []
    for number in range(1, count):
        before = draw(st.integers(0, number - 1))
        # 0 at the earlier parameter's low, 1 at its high; then lo <= middle <= hi, all inside.
        share = f"((p{before} - {lows[before]})/{widths[before]})"
        low, width = lows[number], widths[number]
        middle = low + width // 2
        if draw(st.booleans()):
            bounds.append((f"p{number}", f"{low} + {middle - low}*{share}", None))
        if draw(st.booleans()):
            bounds.append((f"p{number}", None, f"{low + width} - {low + width - middle}*{share}"))
        if draw(st.booleans()):
            rule = f"{low} if {share} > 0.5 else {middle}"
            bounds.append((f"p{number}", rule, None))
    return list(zip(lows, widths, kinds, strict=True)), draw(st.permutations(bounds))


@given(chain=chains(), data=st.data())
@settings(deadline=None)
def test_random_constraints_leave_every_point_feasible(build, make_parameter, chain, data):
    ranges, bounds = chain
    parameters = [
        make_parameter(f"p{number}", low, low + width, kind=kind)
        for number, (low, width, kind) in enumerate(ranges)
    ]
    space = build(reversed(parameters), bounds).space()
    X = space.decode(data.draw(cubes(space.n_var)))
    assert space.violations(X) == []
    assert np.abs(space.decode(space.encode(X)) - X).max() <= 1e-9


@pytest.mark.parametrize("name", SPACES)
@given(data=st.data())
@settings(deadline=None)
def test_encode_inverts_decode(name, data):
    space = SPACES[name]
    U = data.draw(cubes(space.n_var))
    X = space.decode(U)
    again = space.encode(X)
    assert again.min(initial=0.0) >= 0.0
    assert again.max(initial=1.0) <= 1.0
    np.testing.assert_allclose(space.decode(again), X, rtol=1e-9, atol=1e-9)


def test_encode_gives_the_point_back_where_intervals_have_width():
    space = load("paper/crossroads-s4").space()  # even: "dry" is one value of many shares
    U = np.random.default_rng(3).uniform(0.0, 0.95, (500, space.n_var))
    np.testing.assert_allclose(space.encode(space.decode(U)), U, atol=1e-9)


def test_encode_gives_whole_numbers_the_middle_of_their_share():
    space = SPACES["static"]
    lanes = space.variables.index("lanes_per_direction")
    X = [space.row({"lanes_per_direction": count}) for count in (1, 2, 3)]
    assert space.encode(X)[:, lanes] == pytest.approx([1 / 6, 3 / 6, 5 / 6])


def test_encode_stays_in_the_cube_for_values_within_the_tolerance():
    space = SPACES["default"]
    X = np.tile(space.row({}), (2, 1))
    X[:, space.index("bv_trigger_time")] = [-0.5 * TOLERANCE, 10.0 + TOLERANCE]
    U = space.encode(X)[:, space.variables.index("bv_trigger_time")]
    assert U.tolist() == [0.0, 1.0]


def test_rounding_takes_no_whole_number_away(build, make_parameter):
    parameters = [make_parameter("a", 0.2, 0.2), make_parameter("n", kind=INTEGER)]
    assert (0.1 + 0.2) * 10 > 3  # in floating point
    space = build(parameters, [("n", "(0.1 + a)*10", "(0.1 + a)*10")]).space()
    assert space.decode([[0.5]])[0].tolist() == [0.2, 3.0]


def test_a_row_has_the_same_bits_alone_in_a_batch_and_from_any_memory():
    space = SPACES["every"]
    U = np.random.default_rng(4).random((1003, space.n_var))
    whole = space.decode(U)
    for row in range(0, 1003, 17):
        assert space.decode(U[row : row + 1]).tobytes() == whole[row : row + 1].tobytes()
    assert space.decode(np.asfortranarray(U)).tobytes() == whole.tobytes()
    assert space.decode(U[::-3]).tobytes() == whole[::-3].copy().tobytes()
    wide = np.repeat(U, 2, axis=1)[:, ::2]
    assert not wide.flags.c_contiguous
    assert space.decode(wide).tobytes() == whole.tobytes()
    assert space.decode(U.tolist()).tobytes() == whole.tobytes()


def test_the_result_belongs_to_the_caller():
    space = SPACES["default"]
    U = np.full((3, space.n_var), 0.5)
    first = space.decode(U)
    kept = first.copy()
    space.decode(U * 0.1)
    assert first.flags.c_contiguous
    assert (first == kept).all()
    assert (U == 0.5).all()


def test_integers_are_spread_evenly():
    space = load("crossroads-s1").space(["static"])
    U = np.full((3000, space.n_var), 0.5)
    U[:, space.variables.index("lanes_per_direction")] = (np.arange(3000) + 0.5) / 3000
    lanes = space.decode(U)[:, space.index("lanes_per_direction")]
    assert np.unique(lanes, return_counts=True)[1].tolist() == [1000, 1000, 1000]


def test_ends_of_the_cube_are_ends_of_the_interval(build, make_parameter):
    scenario = build(
        [
            make_parameter("a", 0, 4),
            make_parameter("b", 1, 9),
            make_parameter("n", 0, 9, kind=INTEGER),
        ],
        [("b", "a", "2*a + 1"), ("n", "a/2 + 0.1", "a + 3.5")],
    )
    space = scenario.space()
    X = space.decode([[0.5, 0, 0], [0.5, 1, 1], [0, 0, 0], [1, 1, 1]])
    assert X.tolist() == [[2, 2, 2], [2, 5, 5], [0, 1, 1], [4, 9, 7]]


def test_derived_quantities_follow(build, make_parameter):
    scenario = build([make_parameter("a", 0, 4)], derived=[("d", "e + 1"), ("e", "a*a")])
    space = scenario.space()
    assert space.names == ("a", "d", "e")
    assert space.decode([[0.5]]).tolist() == [[2.0, 5.0, 4.0]]


def test_bounds_by_derived_quantities(build, make_parameter):
    parameters = [make_parameter("speed", 0, 30), make_parameter("wet", 0, 100)]
    scenario = build(parameters, [("speed", None, "30*grip")], [("grip", "1 - wet/200")])
    assert scenario.space().decode([[1.0, 1.0]]).tolist() == [[15.0, 100.0, 0.5]]


def test_fixed_parameters_stand_and_yield_to_bounds():
    space = SPACES["static, wide"]
    assert space.variables == ("arm_length", "intersection_size")
    X = space.decode([[0.0, 0.0]])
    assert X[0, space.index("lanes_per_direction")] == 3.0
    assert X[0, space.index("intersection_size")] == 30.0  # 2·3·4 + 2·3
    clipped = load("crossroads-s1").space([], {"lanes_per_direction": 3, "lane_width": 4.0})
    assert clipped.n_var == 0
    row = clipped.decode(np.empty((1, 0)))[0]
    assert row[clipped.index("intersection_size")] == 30.0  # its default is 26


def test_axes_choose_what_is_searched(s4):
    assert {p.axis for p in s4.parameters.values() if p.name in s4.space().variables} == {
        Axis.PARTICIPANTS,
        Axis.WEATHER,
    }
    static = s4.space("static")
    assert static.variables == (
        "lane_width", "lanes_per_direction", "arm_length", "intersection_size"
    )  # fmt: skip
    assert static.names == s4.space().names
    assert len(static.units) == len(static.names)
    assert static.units[static.index("arm_length")] == "m"


def test_low_equal_high_is_not_searched(build, make_parameter):
    space = build([make_parameter("a", 2, 2), make_parameter("b")]).space()
    assert space.variables == ("b",)
    assert space.decode([[0.5]]).tolist() == [[2.0, 5.0]]


def test_limits_that_cross_within_the_tolerance_meet_inside_the_range(build, make_parameter):
    space = build([make_parameter("a", 0, 10)], [("a", "10.0004", None)]).space()
    assert space.decode([[0.0], [1.0]]).tolist() == [[10.0], [10.0]]
    below = build([make_parameter("a", 0, 10)], [("a", None, "-0.00005")]).space()
    assert below.decode([[0.0], [1.0]]).tolist() == [[0.0], [0.0]]


@pytest.mark.parametrize(
    ("bound", "message"),
    [
        (("b", "11 + a", None), "11"),
        (("b", "6", "5"), "leaves"),
        (("b", "a", "5"), "10"),  # shows at a corner only
        (("b", "11 if a > 4.9 and a < 5.1 else 0", None), "leaves"),
        (("b", "1/a", None), "leaves"),
        (("b", "sqrt(a - 1)", None), "leaves"),
        (("n", "a/100 + 2.3", "2.6"), "leaves"),  # no whole number in between
    ],
)
def test_empty_interval_is_refused_at_build(build, make_parameter, bound, message):
    parameters = [make_parameter("a"), make_parameter("b"), make_parameter("n", kind=INTEGER)]
    with refuses(ScenarioError, message):
        build(parameters, [bound]).space()


def test_empty_interval_that_building_missed_is_refused_at_the_row(build, make_parameter):
    bound = ("b", "11 if abs(a - 3.1415) < 1e-7 else 0", None)
    space = build([make_parameter("a"), make_parameter("b")], [bound]).space()
    with refuses(ScenarioError, "3.1415"):
        space.decode([[0.1, 0.1], [0.31415, 0.1]])


def test_derived_without_a_value_is_refused(build, make_parameter):
    with refuses(ScenarioError):
        build([make_parameter("a")], derived=[("d", "log(a)")]).space()


@pytest.mark.parametrize(
    ("fixed", "message"),
    [
        ({"ego_sped": 5.0}, "ego_sped"),
        ({"ego_speed": 50.0}, "ego_speed"),
        ({"ego_speed": np.nan}, "nan"),
        ({"lanes_per_direction": 1.5}, "1.5"),
        ({"friction": 0.5}, "friction"),
    ],
)
def test_wrong_fixed_values(s4, fixed, message):
    with refuses(ScenarioError, message):
        s4.space(fixed=fixed)


@pytest.mark.parametrize(
    ("U", "message"),
    [
        (np.zeros((2, 3)), "shape"),
        (np.zeros(10), "shape"),
        (np.full((1, 10), np.nan), "finite"),
        (np.full((1, 10), 1.1), "1.1"),
        (np.full((1, 10), -1e-300), "0 <= U <= 1"),
    ],
)
def test_wrong_points(s4, U, message):
    with refuses(ValueError, message):
        s4.space().decode(U)


def test_no_rows_is_no_error():
    space = SPACES["default"]
    assert space.decode(np.empty((0, space.n_var))).shape == (0, len(space.names))
    assert space.encode(np.empty((0, len(space.names)))).shape == (0, space.n_var)
    assert space.violations(np.empty((0, len(space.names)))) == []


def test_encode_refuses_rows_of_no_point(s4):
    space = s4.space()
    X = space.decode(np.full((3, space.n_var), 0.5))
    X[1, space.index("ego_speed")] = 12.0
    X[2, space.index("lane_width")] = 3.0  # fixed at 3.5 here
    with pytest.raises(ScenarioError) as caught:
        space.encode(X)
    assert len(caught.value.problems) == 2
    approve(caught.value.problems[0], "ego_speed", "12")
    approve(caught.value.problems[1], "lane_width", "row 2")


PLANTED = {  # column: (a value that is wrong there at the defaults, part of the reason)
    "ego_speed": (8.902, "4.9 <= ego_speed <= 8.9 must hold for ego_speed [m/s], got 8.902"),
    "bv_trigger_time": (-0.001, "0 <= bv_trigger_time <= 10"),
    "lanes_per_direction": (2.5, "a whole number must hold for lanes_per_direction [count]"),
    "intersection_size": (19.9, "intersection_size >= 2*lanes_per_direction*lane_width"),
    "precipitation": (20.0, "cloudiness >= precipitation (= 20)"),
    "wind_intensity": (np.nan, "0 <= wind_intensity <= 100"),
    "sun_altitude_angle": (np.inf, "-90 <= sun_altitude_angle <= 50"),
    "friction": (0.99, "friction = 1 - wetness/200 if wetness < 40 else 0.6"),
    "fog_distance": (99.0, "fog_distance = 100 - fog_density"),
}


@pytest.mark.parametrize("name", PLANTED)
def test_planted_violation_is_found_with_row_and_reason(s4, name):
    value, reason = PLANTED[name]
    space = s4.space()
    X = np.tile(space.row({}), (5, 1))
    assert space.violations(X) == []
    X[3, space.index(name)] = value
    found = space.violations(X)
    assert {one.row for one in found} == {3}
    (planted,) = [one for one in found if reason in one.reason]
    assert planted.parameter in (name, "cloudiness")


def test_violations_name_the_reason_and_the_source(s4):
    space = s4.space()
    row = space.row({"wind_intensity": 10.0})
    row[space.index("wind_intensity")] = 80.0
    row[space.index("fog_density")] = 60.0
    reasons = [
        one.reason for one in space.violations(row[None, :]) if one.parameter == "fog_density"
    ]
    assert len(reasons) == 1
    approve(reasons[0], "fog_density", "10", "Section")


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_tolerance_is_one_for_all(build, make_parameter, sign):
    scenario = build(
        [make_parameter("a", -1, 1), make_parameter("b", -1, 1)], [("b", "a", "a")], [("d", "b")]
    )
    space = scenario.space()
    for share, count in ((0.99, 0), (1.01, 2)):  # b misses its bound; d, which follows b, keeps it
        row = np.array([[0.0, sign * share * TOLERANCE, 0.0]])
        row[0, 2] = 0.0 if count else row[0, 1]
        names = [one.parameter for one in space.violations(row)]
        assert names == (["b", "d"] if count else [])


def test_what_misses_a_limit_by_the_tolerance_itself_keeps_it(build, make_parameter):
    """1e-4 of 0: a parameter's range and a bound take it; a hair more, neither."""
    scenario = build([make_parameter("a", 0.0, 1.0), make_parameter("b", 0.0, 1.0)])
    space = scenario.space()
    assert space.violations([[-1e-4, 0.5]]) == []
    assert [one.parameter for one in space.violations([[-1.0001e-4, 0.5]])] == ["a"]
    bounded = build([make_parameter("a", -1, 1), make_parameter("b", -1, 1)], [("b", "a", "a")])
    assert bounded.space().violations([[0.0, -1e-4], [0.0, 1e-4]]) == []
    assert len(bounded.space().violations([[0.0, -1.0001e-4], [0.0, 1.0001e-4]])) == 2


def test_encode_refuses_what_is_off_by_more_than_the_tolerance(build, make_parameter):
    space = build([make_parameter("a", 0.0, 1.0)]).space()
    assert space.encode([[-1e-4]]) == [[0.0]]
    with refuses(ScenarioError, "row 1"):
        space.encode([[0.5], [-1.0001e-4]])


@pytest.mark.parametrize("wrong", [-0.25, 1.25])
def test_a_point_outside_the_cube_is_named_by_parameter_and_row(wrong, s4):
    space = s4.space()
    U = np.full((3, space.n_var), 0.5)
    U[0, 0], U[0, 1], U[2, 4] = 0.0, 1.0, wrong
    name = space.variables[4]
    with refuses(ValueError, name, wrong, "row 2"):
        space.decode(U)


def test_row_from_names(s4):
    space = s4.space()
    speed = np.nextafter(7.0, 8.0)
    row = space.row({"ego_speed": speed, "lanes_per_direction": 3})
    values = space.values(row)
    assert values["ego_speed"] == speed
    assert values["lanes_per_direction"] == 3.0  # not searched, but given
    assert values["bv_speed"] == 1.8
    assert values["friction"] == 1.0
    assert space.row(values).tobytes() == row.tobytes()
    # The given rain moves the default cloud and sun to where they may be.
    rainy = space.values(space.row({"precipitation": 80.0}))
    assert rainy["cloudiness"] == 80.0
    assert rainy["sun_altitude_angle"] == pytest.approx(50 * (1 - 0.75 * 0.8**3))
    assert rainy["friction"] == 0.6


def test_row_agrees_with_decode_to_the_bit(s4):
    space = s4.space()
    X = space.decode(np.random.default_rng(9).random((50, space.n_var)))
    for row in X:
        given = {name: value for name, value in space.values(row).items() if name in s4.parameters}
        assert space.row(given).tobytes() == row.tobytes()


def test_row_refuses(s4):
    space = s4.space()
    with refuses(UnknownNameError, "bv_sped", "bv_speed"):
        space.row({"bv_sped": 1.0})
    with pytest.raises(ScenarioError) as caught:
        space.row({"bv_speed": 9.0, "precipitation": 50.0, "cloudiness": 0.0, "friction": 1.0})
    assert len(caught.value.problems) == 3
    with pytest.raises(ScenarioError, match="got nan"):
        space.row({"bv_trigger_time": float("nan")})


def test_rows_are_decoded_together(s4):
    """The work in Python is that of one row, however many there are: NumPy does the rest."""
    space = s4.space()

    def calls(rows):
        U, found = np.random.default_rng(2).random((rows, space.n_var)), []
        sys.setprofile(lambda frame, event, _: found.append(event))
        try:
            space.decode(U)
        finally:
            sys.setprofile(None)
        return len(found)

    calls(1)  # what is made once
    assert calls(1000) == calls(1) > 0


def test_a_space_is_tried_at_all_its_corners_while_they_are_few():
    """2^11 = 2048 corners and as many other points; of more parameters as many corners."""
    assert len({tuple(one) for one in probes(11)[:2048].tolist()}) == 2048
    for n_var in (11, 12, 40):
        found = probes(n_var)
        assert found.shape == (4096, n_var)
        assert set(np.unique(found[:2048])) == {0.0, 1.0}
        assert ((found[2048:] > 0.0) & (found[2048:] < 1.0)).all()
    assert probes(3).shape == (8 + 2048, 3)
