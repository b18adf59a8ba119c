"""Who drives the participants other than the ego, as scenario files say it."""

from importlib.resources import files

import pytest
from tests.approval import refuses

from bridgegen.base.errors import ScenarioError
from bridgegen.scenario.language.adversary import with_others
from bridgegen.scenario.language.reader import load, names

PAPERS = ("crossroads-s1", "crossroads-s2", "crossroads-s3", "crossroads-s4")


def drivers(scenario):
    return {one.name: one.driver for one in scenario.participants if one.driver}


CARELESS = {
    "wrong-way-driver": ["ghost"], "bus-pulls-out": ["bus"], "cyclist-swings-out": ["cyclist"],
    "cyclist-crosses": ["cyclist"], "oncoming-overtaker": ["overtaker"],
    "drifts-over-line": ["drifting"], "turns-across-from-left": ["turner"],
    "crosses-to-exit": ["crosser"], "evades-into-lane": ["evading"],
    "exit-reactions": ["lead", "follower"], "merge-reactions": ["lead", "follower", "truck"],
    "follower-closes-in": ["follower"], "goes-wide-in-bend": ["sliding"],
    "oncoming-drifts": ["drifting"], "overtaker-loses-control": ["overtaker"],
}  # fmt: skip
"""Who does not look, for that is what the scenario is about."""

INSISTENT = {
    "red-light-runner": ["runner"], "emergency-vehicle-on-red": ["ambulance"],
    "stop-sign-runner": ["runner"], "oncoming-left-at-signals": ["turner"],
    "right-turn-on-red": ["turner"], "crosses-on-red": ["walker"],
    **{name: ["bv"] for name in PAPERS},
}  # fmt: skip
"""Who gives way to none, likewise, and stops for what stands in its way."""


def test_vehicles_look_ahead_but_for_those_of_the_paper():
    for name in PAPERS:
        assert drivers(load(f"paper/{name}")) == {"bv": "scripted"}
    for name in names():
        scenario = load(name)
        moving = {
            one.name
            for one in scenario.participants
            if one.name != "ego"
            and one.conduct in ("vehicle", "bicycle", "pedestrian")
            and (one.speed != 0.0 or one.name in {event.participant for event in scenario.events})
        }
        moving -= {key for key, driver in drivers(scenario).items() if driver in ("ego", "lawful")}
        kept = {
            key: driver
            for key, driver in drivers(scenario).items()
            if driver not in ("ego", "lawful")
        }
        assert kept == (
            dict.fromkeys(moving, "attentive")
            | dict.fromkeys(CARELESS.get(name, ()), "scripted")
            | dict.fromkeys(INSISTENT.get(name, ()), "insistent")
        )


def text_of(tmp_path, *changes):
    text = files("bridgegen.scenario.catalogue").joinpath("cut-in.yaml").read_text(encoding="utf-8")
    for old, new in changes:
        assert old in text
        text = text.replace(old, new, 1)
    path = tmp_path / "cut-in.yaml"
    path.write_text(text, encoding="utf-8")
    return path


def test_a_participants_own_driver_goes_before_that_of_all(tmp_path):
    path = text_of(
        tmp_path, ("    speed: bv_speed\n", "    speed: bv_speed\n    driver: scripted\n")
    )
    assert drivers(load(path)) == {"bv": "scripted"}
    path = text_of(tmp_path, ("others: attentive\n", ""))
    assert drivers(load(path)) == {"bv": "scripted"}


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (
            "    speed: bv_speed\n",
            "    speed: bv_speed\n    driver: attentiv\n",
            "the driver of bv must be one of attentive, insistent, lawful, scripted, ego (others "
            "are for the ego), got 'attentiv'; did you mean 'attentive'?",
        ),
        (
            "    speed: bv_speed\n",
            "    speed: bv_speed\n    driver: reference\n",
            "the driver of bv must be one of attentive, insistent, lawful, scripted, ego (others "
            "are for the ego), got 'reference'",
        ),
        (
            "    speed: ego_speed\n",
            "    speed: ego_speed\n    driver: reference\n",
            "the ego's driver is named once, by the scenario's own key 'driver'; got 'reference'",
        ),
        ("others: attentive\n", "others: attentively\n", "others"),
    ],
)
def test_a_driver_that_does_not_fit_is_refused_at_its_line(tmp_path, old, new, message):
    path = text_of(tmp_path, (old, new))
    with pytest.raises(ScenarioError) as caught:
        load(path)
    (problem,) = caught.value.problems
    assert message in problem
    line = 1 + path.read_text(encoding="utf-8").splitlines().index(new.splitlines()[-1])
    assert problem.endswith(f"{path}, line {line})")


def test_an_obstacle_has_no_driver(tmp_path):
    path = text_of(
        tmp_path,
        (
            "events:\n",
            "  box:\n    type: obstacle\n    start: {lane: 1, distance: 500.0}\n"
            "    driver: attentive\nevents:\n",
        ),
    )
    with refuses(ScenarioError):
        load(path)


def test_the_fingerprint_of_a_scenario_without_drivers_is_what_it_was(tmp_path):
    scripted = with_others(load("cut-in"), "scripted")
    assert scripted.fingerprint == load(text_of(tmp_path, ("others: attentive\n", ""))).fingerprint
    assert scripted.fingerprint != load("cut-in").fingerprint
    assert with_others(scripted, "attentive").fingerprint == load("cut-in").fingerprint
