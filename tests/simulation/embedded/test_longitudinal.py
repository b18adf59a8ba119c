"""Actions along the road, from file to motion: hand-worked cases for each of them."""

import math

import numpy as np
import pytest
from tests.approval import approve

from bridgegen.base.errors import UnsupportedError

from .storyboards import (
    after,
    crossroads,
    events,
    lane,
    run,
    scenario,
    simulator,
    speed_action,
    start,
)

DT = 0.05
ROADS = crossroads(arm_length=300.0)


def longitudinal(inner: str) -> str:
    return f"<LongitudinalAction>{inner}</LongitudinalAction>"


def relative(ref: str, value: float, kind: str = "delta", *, continuous: bool = False,
             dynamics: str = "linear rate 2") -> str:  # fmt: skip
    shape, dimension, number = dynamics.split()
    return longitudinal(
        f'<SpeedAction><SpeedActionDynamics dynamicsShape="{shape}" '
        f'dynamicsDimension="{dimension}" value="{number}"/><SpeedActionTarget>'
        f'<RelativeTargetSpeed entityRef="{ref}" value="{value}" speedTargetValueType="{kind}" '
        f'continuous="{str(continuous).lower()}"/></SpeedActionTarget></SpeedAction>'
    )


def constraints(**limits: float) -> str:
    words = " ".join(f'{name}="{value}"' for name, value in limits.items())
    return f"<DynamicConstraints {words}/>" if limits else ""


def profile(*entries: tuple[float, float | None], mode: str = "position", ref: str = "",
            **limits: float) -> str:  # fmt: skip
    rows = "".join(
        f'<SpeedProfileEntry speed="{speed}"/>'
        if time is None
        else f'<SpeedProfileEntry speed="{speed}" time="{time}"/>'
        for speed, time in entries
    )
    of = f' entityRef="{ref}"' if ref else ""
    return longitudinal(
        f'<SpeedProfileAction followingMode="{mode}"{of}>{constraints(**limits)}{rows}'
        "</SpeedProfileAction>"
    )


def distance(ref: str, *, metres: float | None = None, seconds: float | None = None,
             freespace: bool = False, continuous: bool = True, side: str = "",
             system: str = "lane", **limits: float) -> str:  # fmt: skip
    what = f'distance="{metres}"' if metres is not None else f'timeGap="{seconds}"'
    beside = f' displacement="{side}"' if side else ""
    return longitudinal(
        f'<LongitudinalDistanceAction entityRef="{ref}" {what} freespace="{str(freespace).lower()}"'
        f' continuous="{str(continuous).lower()}" coordinateSystem="{system}"{beside}>'
        f"{constraints(**limits)}</LongitudinalDistanceAction>"
    )


# Two cars one behind the other on one lane, the ego on another leg.
def story(*rows: tuple[str, str, str, str], speeds=(0.0, 10.0, 10.0), gap: float = 20.0,
          first: str = ""):  # fmt: skip
    names = ("ego", "bv", "lead")
    places = (lane(3, -1, 5.0), lane(1, -1, 5.0), lane(1, -1, 5.0 + gap))
    private = [
        start(name, place, speed) for name, place, speed in zip(names, places, speeds, strict=True)
    ]
    if first:  # what bv begins with, besides
        more = f"<PrivateAction>{first}</PrivateAction></Private>"
        private[1] = private[1].replace("</Private>", more)
    privates = "".join(private)
    return run(scenario(names, privates, events(*rows)), roads=ROADS)


def at(rollout, name: str, seconds: float) -> float:
    return float(rollout.v[0, rollout.names.index(name), round(seconds / DT)])


def travelled(rollout, name: str) -> np.ndarray:
    e = rollout.names.index(name)
    return np.hypot(rollout.x[0, e] - rollout.x[0, e, 0], rollout.y[0, e] - rollout.y[0, e, 0])


def apart(rollout) -> np.ndarray:
    bv, lead = (rollout.names.index(name) for name in ("bv", "lead"))
    return np.hypot(
        rollout.x[0, lead] - rollout.x[0, bv], rollout.y[0, lead] - rollout.y[0, bv]
    )  # fmt: skip


def speeding(speed: float, dynamics: str) -> str:
    return longitudinal(speed_action(speed, dynamics))


# Speeds one, two and four seconds after an action begins at 1 s and 4 m/s.
ABSOLUTE = {
    "step time 0": (8.0, 8.0, 8.0),
    "linear time 4": (5.0, 6.0, 8.0),
    "linear rate 2": (6.0, 8.0, 8.0),
    "linear distance 24": (5.0, 6.0, 8.0),  # 6 m/s on average for 4 s
    "cubic time 4": (4.625, 6.0, 8.0),
    "cubic rate 1.5": (4.625, 6.0, 8.0),  # the steepest is 1.5·4/4 m/s²
    "sinusoidal time 4": (4.0 + 2.0 * (1.0 - np.sqrt(0.5)), 6.0, 8.0),
    "sinusoidal distance 24": (4.0 + 2.0 * (1.0 - np.sqrt(0.5)), 6.0, 8.0),
    # The car's own most is 5 m/s².
    "linear rate 50": (8.0, 8.0, 8.0),
    "linear time 0.1": (8.0, 8.0, 8.0),
}


@pytest.mark.parametrize("dynamics", ABSOLUTE)
def test_speeds_by_shape_and_dimension(dynamics):
    rollout = story(("e", "bv", speeding(8.0, dynamics), after(1.0)), speeds=(0.0, 4.0, 4.0))
    found = [at(rollout, "bv", t) for t in (2.0, 3.0, 5.0)]
    assert found == pytest.approx(list(ABSOLUTE[dynamics]), abs=1e-9)


@pytest.mark.parametrize("dynamics", ["linear rate 50", "linear time 0.1", "cubic time 0.1"])
def test_no_car_is_faster_off_than_it_can(dynamics):
    rollout = story(("e", "bv", speeding(8.0, dynamics), after(1.0)), speeds=(0.0, 4.0, 4.0))
    assert rollout.a[0, 1].max() <= 5.0 + 1e-9
    rollout = story(("e", "bv", speeding(0.0, dynamics), after(1.0)), speeds=(0.0, 9.0, 4.0))
    assert rollout.a[0, 1].min() >= -9.0 - 1e-9


@pytest.mark.parametrize("shape", ["linear", "cubic", "sinusoidal"])
def test_braking_over_a_distance_stops_there(shape):
    rollout = story(("e", "bv", speeding(0.0, f"{shape} distance 20"), after(1.0)))
    assert travelled(rollout, "bv")[-1] == pytest.approx(10.0 + 20.0, abs=0.01)
    assert rollout.v[0, 1, -1] == 0.0


def test_an_initial_change_begins_at_once():
    rollout = story(first=speeding(6.0, "linear rate 1"), speeds=(0.0, 10.0, 10.0))
    # Both are given by the file: 10 m/s at the start, and on from there.
    assert [at(rollout, "bv", t) for t in (0.0, 1.0, 3.0, 9.0)] == pytest.approx([10, 9, 7, 6])


def test_a_new_change_ends_the_former():
    rollout = story(
        ("up", "bv", speeding(20.0, "linear rate 1"), after(1.0)),
        ("down", "bv", speeding(8.0, "linear rate 2"), after(3.0)),
        ("then", "bv", speeding(9.0, "step time 0"),
         '<Condition name="c" delay="0" conditionEdge="none"><ByValueCondition>'
         '<StoryboardElementStateCondition storyboardElementType="action" '
         'storyboardElementRef="up::a" state="completeState"/></ByValueCondition></Condition>'),
    )  # fmt: skip
    assert at(rollout, "bv", 3.0) == pytest.approx(12.0)
    assert at(rollout, "bv", 3.0 + 2 * DT) == 9.0  # the first is complete as the second begins


@pytest.mark.parametrize(("kind", "value", "speed"), [("delta", -3.0, 7.0), ("factor", 1.5, 15.0)])
def test_a_speed_relative_to_another_s(kind, value, speed):
    rollout = story(("e", "bv", relative("lead", value, kind), after(1.0)), gap=40.0)
    assert at(rollout, "bv", 2.0) == pytest.approx(8.0 if value < 0.0 else 12.0)
    assert at(rollout, "bv", 4.5) == pytest.approx(speed)


def test_a_continuous_relative_speed_goes_on_with_the_other_s():
    rows = (
        ("e", "bv", relative("lead", -2.0, continuous=True), after(1.0)),
        ("brake", "lead", speeding(4.0, "linear rate 1"), after(4.0)),
    )
    rollout = story(*rows)
    assert at(rollout, "bv", 3.0) == pytest.approx(8.0)
    assert at(rollout, "bv", 7.0) == pytest.approx(5.0)  # at the same instant as the other's 7
    assert at(rollout, "bv", 10.0) == pytest.approx(2.0)
    once = story(("e", "bv", relative("lead", -2.0), after(1.0)), rows[1])
    assert at(once, "bv", 10.0) == pytest.approx(8.0)  # it has been reached


@pytest.mark.parametrize("gap", [20.0, -20.0])
def test_the_ego_without_a_driver_goes_by_others_as_others_do(gap):
    """Whoever is written first: it is moved after the one by whom it goes."""
    names = ("ego", "lead")
    privates = start("ego", lane(1, 1, 200.0), 4.0) + start("lead", lane(1, 1, 200.0 - gap), 5.0)
    rows = (
        ("go", "ego", relative("lead", 1.0, dynamics="linear rate 2", continuous=True), after(1.0)),
        ("e", "lead", speeding(9.0, "linear rate 1"), after(2.0)),
    )
    rollout = run(scenario(names, privates, events(*rows)), None, ROADS)
    assert at(rollout, "ego", 1.5) == pytest.approx(5.0)
    for seconds in (2.0, 3.0, 4.5, 8.0):
        assert at(rollout, "ego", seconds) == pytest.approx(at(rollout, "lead", seconds) + 1.0)


@pytest.mark.parametrize("speeds", [(0.0, 4.0, 10.0), (10.0, 4.0, 0.0)])
def test_a_step_to_a_relative_speed_acts_from_its_instant(speeds):
    """As a step to an absolute one: 1 s at 4 m/s, then 1 s at 1.5 times 10 m/s."""
    other = "lead" if speeds[2] else "ego"
    to = relative(other, 1.5, "factor", dynamics="step time 0", continuous=True)
    rollout = story(("e", "bv", to, after(1.0)), speeds=speeds, gap=100.0)
    way = travelled(rollout, "bv")
    assert way[round(1.0 / DT)] == pytest.approx(4.0)
    assert way[round(2.0 / DT)] == pytest.approx(4.0 + 15.0)


@pytest.mark.parametrize(("kind", "value"), [("delta", 0.0), ("factor", 1.0)])
@pytest.mark.parametrize(("after_step", "at_3", "at_6"), [(20.0, 15.0, 20.0), (0.0, 1.0, 0.0)])
def test_who_keeps_a_relative_speed_accelerates_as_the_vehicle_can(
    kind, value, after_step, at_3, at_6
):
    """The other's speed steps at 2 s; the car accelerates by 5 m/s² and brakes by 9 m/s² at most.

    The step of its own action is one: at 1 s, to the other's 10 m/s.
    """
    to = relative("lead", value, kind, dynamics="step time 0", continuous=True)
    jump = ("jump", "lead", speeding(after_step, "step time 0"), after(2.0))
    rollout = story(("e", "bv", to, after(1.0)), jump, speeds=(0.0, 4.0, 10.0), gap=100.0)
    assert at(rollout, "bv", 1.0 + DT) == 10.0
    assert at(rollout, "bv", 3.0) == pytest.approx(at_3)
    assert at(rollout, "bv", 6.0) == at_6


@pytest.mark.parametrize("dynamics", ["linear time 0", "cubic distance 0"])
def test_a_change_over_no_time_is_there_at_the_start(dynamics):
    places = start("ego", lane(3, -1, 5.0), 0.0) + start("bv", lane(1, 1, 200.0), 0.0).replace(
        speed_action(0.0), speed_action(8.0, dynamics)
    )
    rollout = run(scenario(("ego", "bv"), places), roads=ROADS)
    assert rollout.v[0, 1] == pytest.approx(8.0)


def test_a_relative_speed_over_a_time():
    dynamics = "sinusoidal time 4"
    rollout = story(("e", "bv", relative("lead", -4.0, dynamics=dynamics), after(1.0)))
    assert at(rollout, "bv", 3.0) == pytest.approx(8.0)
    assert at(rollout, "bv", 5.0) == pytest.approx(6.0)


def test_an_initial_speed_may_be_relative():
    rollout = story(first=relative("ego", 3.0, dynamics="step time 0"), speeds=(6.0, 1.0, 1.0))
    assert at(rollout, "bv", 0.0) == 9.0


def test_a_speed_profile():
    rollout = story(("e", "bv", profile((14.0, 2.0), (14.0, 1.0), (8.0, None)), after(1.0)))
    times = (1.0, 2.0, 3.0, 4.0, 4.5)
    expected = [10.0, 12.0, 14.0, 14.0, 9.5]  # at last as hard as the car can: 9 m/s²
    assert [at(rollout, "bv", t) for t in times] == pytest.approx(expected)
    assert at(rollout, "bv", 6.0) == pytest.approx(8.0)


def test_a_speed_profile_within_limits():
    rollout = story(
        ("e", "bv", profile((14.0, 1.0), maxAcceleration=2.0, maxDeceleration=3.0), after(1.0))
    )
    assert [at(rollout, "bv", t) for t in (2.0, 3.0, 5.0)] == pytest.approx([12.0, 14.0, 14.0])


def test_a_smooth_speed_profile_is_in_time():
    limits = {"maxAcceleration": 2.0, "maxDeceleration": 2.0, "maxAccelerationRate": 1.0,
              "maxDecelerationRate": 1.0}  # fmt: skip
    rollout = story(("e", "bv", profile((14.0, 6.0), mode="follow", **limits), after(1.0)))
    assert at(rollout, "bv", 4.0) == pytest.approx(12.0, abs=1e-6)  # symmetric
    assert at(rollout, "bv", 7.0) == pytest.approx(14.0, abs=1e-6)
    jerk = np.diff(rollout.a[0, 1]) / DT
    assert np.abs(jerk).max() <= 1.0 + 1e-6


def test_a_profile_relative_to_another_s_speed():
    rollout = story(
        ("e", "bv", profile((2.0, 2.0), ref="lead"), after(1.0)), speeds=(0.0, 10.0, 6.0)
    )
    assert at(rollout, "bv", 3.0) == pytest.approx(8.0)


def test_what_hangs_across_another_is_carried_along_the_road():
    """A bicycle on a car's rack: its nose points aside, and it goes where the car goes."""
    turned = (
        '<Position><RelativeObjectPosition entityRef="lead" dx="0" dy="-0.6">'
        '<Orientation type="relative" h="1.57"/></RelativeObjectPosition></Position>'
    )
    names = ("ego", "bv", "lead")
    privates = [start("ego", lane(3, -1, 5.0), 0.0), start("lead", lane(1, 1, 200.0), 10.0)]
    keep = distance("lead", metres=1.2, system="road")
    privates.append(
        f'<Private entityRef="bv"><PrivateAction><TeleportAction>{turned}</TeleportAction>'
        f"</PrivateAction><PrivateAction>{keep}</PrivateAction></Private>"
    )
    rollout = run(scenario(names, "".join(privates), events()), roads=ROADS)
    bv, lead = rollout.names.index("bv"), rollout.names.index("lead")
    assert rollout.v[0, bv] == pytest.approx(10.0)  # from the first instant on
    assert apart(rollout) == pytest.approx(math.hypot(1.2, 0.6), abs=1e-6)
    turn = rollout.h[0, bv] - rollout.h[0, lead]
    assert turn == pytest.approx(1.57, abs=1e-6)
    assert travelled(rollout, "bv") == pytest.approx(travelled(rollout, "lead"), abs=1e-6)


def test_a_distance_without_limits_is_kept_at_once():
    rows = (
        ("keep", "bv", distance("lead", metres=12.0), after(1.0)),
        ("brake", "lead", speeding(2.0, "linear rate 2"), after(3.0)),
    )
    rollout = story(*rows, gap=20.0)
    assert apart(rollout)[round(1.0 / DT)] == pytest.approx(20.0)
    assert apart(rollout)[round(1.0 / DT) + 1 :] == pytest.approx(12.0, abs=1e-6)
    assert at(rollout, "bv", 5.0) == pytest.approx(at(rollout, "lead", 5.0))


@pytest.mark.parametrize("system", ["entity", "lane", "road"])
def test_a_distance_between_bodies(system):
    rows = [("keep", "bv", distance("lead", metres=9.0, freespace=True, system=system), after(1.0))]
    rollout = story(*rows, gap=20.0)
    assert apart(rollout)[-1] == pytest.approx(9.0 + 4.0, abs=1e-6)  # and a car's length


def test_a_time_gap():
    rollout = story(("keep", "bv", distance("lead", seconds=1.5), after(1.0)), gap=30.0)
    assert apart(rollout)[-1] == pytest.approx(15.0, abs=1e-6)


def test_a_distance_within_limits_is_reached_by_a_spring():
    limits = {"maxAcceleration": 2.0, "maxDeceleration": 2.0, "maxSpeed": 13.0}
    rows = [("keep", "bv", distance("lead", metres=10.0, **limits), after(1.0))]
    rollout = story(*rows, gap=20.0, speeds=(0.0, 5.0, 5.0))
    assert apart(rollout)[-1] == pytest.approx(10.0, abs=0.05)
    assert np.abs(rollout.a[0, 1]).max() <= 2.0 + 1e-9
    assert at(rollout, "bv", 10.0) == pytest.approx(5.0, abs=0.05)


@pytest.mark.parametrize(("side", "expected"), [("any", 12.0), ("leadingReferencedEntity", -12.0)])
def test_the_side_of_a_distance(side, expected):
    rollout = story(("keep", "bv", distance("lead", metres=12.0, side=side), after(1.0)), gap=20.0)
    ahead = rollout.x[0, 2] - rollout.x[0, 1], rollout.y[0, 2] - rollout.y[0, 1]
    h = rollout.h[0, 1]
    signed = ahead[0] * np.cos(h) + ahead[1] * np.sin(h)
    assert signed[-40:] == pytest.approx(expected, abs=1e-6)


def test_a_distance_that_is_reached_once_is_over():
    rollout = story(
        ("keep", "bv", distance("lead", metres=12.0, continuous=False), after(1.0)),
        ("brake", "lead", speeding(2.0, "linear rate 2"), after(3.0)),
    )
    # It does not brake with the other: in 7 s it goes 70 m, the other 24 + 6, and is overtaken.
    assert apart(rollout)[-1] == pytest.approx(70.0 - 30.0 - 12.0, abs=0.05)


def test_a_relative_speed_over_a_time_is_kept_from_then_on():
    """The standard has none that is continuous over a time; a note says what is made of it."""
    keep = relative("lead", 1.0, continuous=True, dynamics="linear time 2")
    rows = (
        ("e", "bv", keep, after(1.0)),
        ("f", "lead", speeding(6.0, "linear rate 2"), after(5.0)),
    )
    rollout = story(*rows, speeds=(0.0, 5.0, 10.0))
    assert at(rollout, "bv", 2.0) == pytest.approx(8.0)
    for seconds in (3.0, 5.0, 6.0, 9.0):
        assert at(rollout, "bv", seconds) == pytest.approx(at(rollout, "lead", seconds) + 1.0)
    names = ("ego", "lead", "bv")
    places = "".join(start(name, lane(1, 1, 90.0 - 20.0 * i), 0.0) for i, name in enumerate(names))
    (note,) = simulator(scenario(names, places, events(*rows)), None).program.notes
    approve(note, "continuous")


UNSUPPORTED = {
    "LongitudinalDistanceAction without distance or timeGap": longitudinal(
        '<LongitudinalDistanceAction entityRef="lead" freespace="false" continuous="true"/>'
    ),
}


@pytest.mark.parametrize("message", UNSUPPORTED)
def test_what_is_not_supported_is_said(message):
    with pytest.raises(UnsupportedError) as caught:
        story(("e", "bv", UNSUPPORTED[message], after(1.0)))
    assert message in str(caught.value)


def synchronise(own: float, master: float, final: str = "", tolerance: str = "") -> str:
    speed = f"<FinalSpeed>{final}</FinalSpeed>" if final else ""
    places = lane(3, -1, master), lane(1, -1, own)
    tags = "TargetPositionMaster", "TargetPosition"
    inner = "".join(
        place.replace("<Position>", f"<{tag}>").replace("</Position>", f"</{tag}>")
        for place, tag in zip(places, tags, strict=True)
    )
    return f'<SynchronizeAction masterEntityRef="ego"{tolerance}>{inner}{speed}</SynchronizeAction>'


def final_speed(value: float, steady: str = "") -> str:
    return f'<AbsoluteSpeed value="{value}">{steady}</AbsoluteSpeed>'


# The ego is at 85 m on its leg after 8 s; by then, the other one is to be at 105 m, and starts at
# 5 m and 10 m/s. Speeds after 4 and after 8 s, by hand.
MEETINGS = {
    "by constant acceleration": ("", (12.5, 15.0)),  # 2·(100 − 80)/64 = 0.625 m/s²
    "rush": (final_speed(10.0), (15.0, 10.0)),  # 1.25 m/s² up, and down again
    "at the final speed": (final_speed(15.0), (12.5, 15.0)),
    "relative": (
        '<RelativeSpeedToMaster speedTargetValueType="factor" value="1.5"/>', (12.5, 15.0),
    ),
    # 10 m/s over the last 20 m: 80 m in 6 s, so apex 40/3 + 10/3.
    "steady": (
        final_speed(10.0, '<TargetDistanceSteadyState distance="20"/>'),
        (10.0 + 20.0 / 3 * 2 / 3, 10.0),
    ),
    "steady for a time": (
        final_speed(10.0, '<TargetTimeSteadyState time="2"/>'),
        (10.0 + 20.0 / 3 * 2 / 3, 10.0),
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", MEETINGS)
def test_being_there_when_the_master_is_there(name):
    final, speeds = MEETINGS[name]
    rollout = story(
        ("e", "bv", synchronise(105.0, 85.0, final), after(0.0)), speeds=(10.0, 10.0, 20.0)
    )
    assert [at(rollout, "bv", t) for t in (4.0, 7.95)] == pytest.approx(list(speeds), abs=0.1)
    way = travelled(rollout, "bv")[round(8.0 / DT)]
    assert way == pytest.approx(100.0, abs=0.02)


def test_the_speed_is_asked_anew_when_the_master_s_changes():
    rollout = story(
        ("e", "bv", synchronise(55.0, 65.0), after(0.0)),
        ("slow", "ego", speeding(5.0, "linear rate 5"), after(2.0)),
        speeds=(10.0, 10.0, 20.0),
    )
    arrives = int(np.argmax(travelled(rollout, "ego") >= 60.0))
    assert arrives * DT > 8.0  # not after 6 s, as it seemed at first
    assert travelled(rollout, "bv")[arrives] == pytest.approx(50.0, abs=0.5)


def test_tolerances_make_the_places_larger():
    tolerance = ' targetTolerance="4" targetToleranceMaster="0"'
    rollout = story(
        ("e", "bv", synchronise(105.0, 85.0, final_speed(3.0), tolerance), after(0.0)),
        speeds=(10.0, 10.0, 20.0),
    )
    way = travelled(rollout, "bv")[round(8.0 / DT)]
    assert way == pytest.approx(96.0, abs=0.1)
    assert at(rollout, "bv", 9.0) == pytest.approx(3.0)
