"""Indicators and brake lights: what shows at which instant, who sees it, and what drivers do."""

import numpy as np
import pytest
from tests.approval import approve

from bridgegen.drivers._tracking_kernels import LAMPS
from bridgegen.drivers.kinds import BRAKE, BRAKE_LIGHTS_FROM, HAZARD, LEFT, RIGHT
from bridgegen.pages.scenery import vehicle_lamps

from .storyboards import after, crossroads, events, lane, run, scenario, simulator, speeding, start

EGO = start("ego", lane(3, -1, 50.0), 5.0)
STEP = 0.05


def switch(light: str, mode: str) -> str:
    return f"""<AppearanceAction><LightStateAction><LightType><VehicleLight
vehicleLightType="{light}"/></LightType><LightState mode="{mode}"/></LightStateAction>
</AppearanceAction>"""


def bv(speed: float, *initial: str) -> str:
    actions = "".join(f"<PrivateAction>{one}</PrivateAction>" for one in initial)
    return start("bv", lane(1, 1, 95.0), speed).replace("</Private>", f"{actions}</Private>")


def shown(privates: str, *script: tuple[str, str, str, str]) -> np.ndarray:
    found = run(scenario(("ego", "bv"), EGO + privates, events(*script)), None)
    assert found.lamps.dtype == np.int8
    return found.lamps[0, 1]


def test_what_is_switched_shows_from_that_instant_on():
    found = shown(
        bv(3.0, switch("indicatorRight", "on")),
        ("a", "bv", switch("indicatorRight", "off"), after(1.0)),
        ("b", "bv", switch("indicatorLeft", "flashing"), after(2.0)),
        ("c", "bv", switch("warningLights", "on"), after(3.0)),
        ("d", "bv", switch("warningLights", "off"), after(4.0)),
    )
    wanted = np.repeat([RIGHT, 0, LEFT, HAZARD, 0], 20)
    assert found[: len(wanted)].tolist() == wanted.tolist()


def test_a_light_that_nobody_here_sees_is_noted_and_records_nothing():
    made = simulator(scenario(("ego", "bv"), EGO + bv(3.0, switch("lowBeam", "on"))), None)
    approve(made.program.notes, "bv")
    assert not made.run(made.roads([crossroads()]), np.zeros(1, np.int64), {}).lamps.size


@pytest.mark.parametrize(("rate", "lit"), [(1.29, 0), (1.31, BRAKE)])
def test_brake_lights_light_by_themselves(rate, lit):
    """UN R13-H: from 1.3 m/s² on."""
    slows = ("a", "bv", speeding(4.0, f"linear rate {rate}"), after(1.0))
    found = shown(bv(8.0, switch("indicatorLeft", "off")), slows)
    assert not found[:21].any()
    assert (found[21:40] == lit).all()
    assert not found[100:].any()  # it drives at 4 m/s again


def test_brake_lights_that_are_switched_stay_so():
    slows = ("a", "bv", speeding(4.0, "linear rate 4"), after(1.0))
    assert not shown(bv(8.0, switch("brakeLights", "off")), slows).any()
    assert (shown(bv(8.0, switch("brakeLights", "on")), slows) == BRAKE).all()


def test_the_page_shows_brake_lights_of_all_that_brake():
    slows = events(("a", "bv", speeding(4.0, "linear rate 4"), after(1.0)))
    found = run(scenario(("ego", "bv"), EGO + bv(8.0), slows), None)
    assert not found.lamps.size
    lit = np.flatnonzero(vehicle_lamps(found, np.zeros(2))[0, 1])
    assert lit.tolist() == list(range(21, 41))
    assert (found.a[0, 1, 20:40] <= -BRAKE_LIGHTS_FROM).all()


def test_sensors_see_them():
    text = scenario(
        ("ego", "bv"),
        start("ego", lane(1, 1, 60.0), 3.0) + start("bv", lane(1, 1, 40.0), 3.0),
        events(("a", "bv", switch("indicatorLeft", "on"), after(2.0))),
    )
    made = simulator(text, "reference")
    batch = made.batch(made.roads([crossroads()]), np.zeros(1, np.int64), {})
    batch.start()
    seen = []
    for k in range(60):
        batch.before_driver(k)
        demanded, curvature = batch.demand(k)
        seen.append(int(batch.state.tracks[0, 1, LAMPS]))
        batch.after_driver(k, demanded, curvature)
    assert not any(seen[:40])
    assert all(one == LEFT for one in seen[42:])  # the next frame of 10 Hz


def beside(way: str, ego: str | None) -> np.ndarray:
    """Return the speeds of who drives 15 m behind a slower one on the lane to its right."""
    script = [("a", "bv", switch(way, "flashing"), after(1.0))] if way else []
    who = start("ego", lane(1, 1, 95.0), 9.0) + start("bv", lane(1, 2, 75.0), 6.0)
    if ego is None:  # the other way round: an attentive one behind the ego's storyboard
        who = start("bv", lane(1, 1, 95.0), 9.0) + start("ego", lane(1, 2, 75.0), 6.0)
        script = [(name, "ego", action, when) for name, _, action, when in script]
    text = scenario(("ego", "bv"), who, events(*script) if script else "")
    found = run(text, ego, crossroads(arm_length=100.0), others="attentive")
    return found.v[0, 0 if ego else 1, :80]


@pytest.mark.parametrize("ego", ["reference", None])
def test_who_indicates_a_change_to_ones_lane_is_let_in_in_comfort(ego):
    alone, away, here = (beside(way, ego) for way in ("", "indicatorRight", "indicatorLeft"))
    np.testing.assert_array_equal(alone, away)
    np.testing.assert_array_equal(alone, beside("warningLights", ego))
    np.testing.assert_array_equal(alone[:20], here[:20])
    assert here[79] < alone[79] - 0.5
    assert np.diff(here).min() / STEP > -2.0 - 0.1
