"""Settings that runs recorded: each form is read, and is written as it was."""

import copy
import re
import shlex
from pathlib import Path

import pytest
from tests.approval import approve

from bridgegen.base.errors import StorageError
from bridgegen.engine.options import SearchOptions, options_of
from bridgegen.jobs.search.settings import DEFAULTS_BEFORE_FIELD, RECORDED_AS, Settings
from bridgegen.simulation.choice import EMBEDDED

PLACE = Path("runs/s3")
RECORDED = {
    "scenario": "crossroads-s3", "distribution": None, "fingerprint": "2be684d9",
    "algorithm": "pso", "algorithm_settings": {"population": 20, "w": 0.8, "mutate_best": True},
    "budget": 60, "seed": 3, "ego": "reference", "ideal": ["perception", "prediction"],
    "time_limit": None, "axes": ["participants", "weather"], "fixed": {"fog_density": 80.0},
    "map": "/maps/town.xodr", "map_digest": "ab12", "junction": "965", "keep": 2, "causes": True,
    "cause": "planning", "adversary": "bv", "others": "attentive", "simulator": "esmini",
    "simulator_settings": {"steps": 4},
    "objective": {
        "names": ["d_min", "ttc"], "weights": [0.5, 1.0], "scale": "raw", "objectives": "one",
        "thresholds": {"n_collision_above": 0.0, "d_min_below": 2.0, "v_d_at_least": 1.0},
        "low": [], "span": [], "rule": "thresholds", "count": "ego",
    },
    "chosen": {
        "objective": {"d_min": 0.5, "ttc": None}, "weights": "entropy", "scale": "raw",
        "objectives": "one", "count": "any", "metrics": ["pet"],
    },
}  # fmt: skip
"""As a run of the version before `SearchOptions` recorded its settings."""

NEWER = {one.name for one in options_of(SearchOptions)} - {
    *RECORDED, *RECORDED["chosen"], *RECORDED_AS
}  # fmt: skip
"""The options that came later."""


def record(**changes):
    return copy.deepcopy(RECORDED) | changes


def test_a_record_is_read_and_written_as_it_was():
    settings = Settings.from_dict(RECORDED, PLACE)
    assert settings.to_dict() == RECORDED | {
        name: list(one) if isinstance(one, tuple) else one
        for name, one in DEFAULTS_BEFORE_FIELD.items()
        if name in NEWER and name not in ("odd", "rate", "exposure", "repeats")  # where given
    } | {"driver_digest": ""}
    assert (settings.budget, settings.settings["w"], settings.road_map) == (
        60,
        0.8,
        "/maps/town.xodr",
    )
    assert settings.objective == {"d_min": 0.5, "ttc": None}
    assert settings.optimised["weights"] == [0.5, 1.0]
    assert (settings.simulator.name, settings.simulator.settings) == ("esmini", {"steps": 4})


def test_what_a_run_of_the_first_version_did_not_record_is_what_it_was_made_with():
    old = record(chosen={"objective": None})
    later = ("distribution", "ideal", "causes", "cause", "adversary", "others", "simulator",
             "simulator_settings")  # fmt: skip
    for name in later:
        del old[name]
    settings = Settings.from_dict(old, PLACE)
    assert (settings.others, settings.causes, settings.ideal) == ("scripted", False, ())
    assert settings.simulator == EMBEDDED
    assert (settings.weights, settings.count, settings.metrics) == (None, None, ())


def test_its_command_has_every_option():
    words = shlex.split(Settings.from_dict(RECORDED, PLACE).command(Path("again")))
    text = " ".join(words)
    approve(text, "--algorithm", "--set")
    for said in (
        "--set mutate_best=true", "--budget 60", "--seed 3", "--ego reference",
        "--ideal perception,prediction", "--axes participants,weather", "--fix fog_density=80.0",
        "--map /maps/town.xodr", "--place 965", "--keep 2", "--cause planning",
        "--adversary bv", "--others attentive", "--simulator esmini", "--simulator-set steps=4",
        "--objective d_min=0.5,ttc", "--weights entropy", "--scale raw", "--objectives one",
        "--count any", "--metrics pet",
    ):  # fmt: skip
        assert f" {said} " in text, said
    assert "--causes" not in text  # the default
    assert "--time-limit" not in text
    assert words[-2:] == ["--out", "again"]
    file = Settings.from_dict(record(ego="storyboard", causes=False, cause=None), PLACE)
    assert "--ego" not in file.command(PLACE)
    assert "--no-causes" in file.command(PLACE)


def test_a_screen_is_recorded_without_its_place():
    screen = {"name": "esmini", "settings": {"steps": 2}}
    found = Settings.from_dict(
        record(screen=screen, screen_budget=90, screen_batch=3, simulator="embedded",
               simulator_settings={}), PLACE,
    )  # fmt: skip
    assert (found.screen.name, found.screen.settings) == ("esmini", {"steps": 2})
    assert found.to_dict()["screen"] == screen
    said = "--screen esmini --screen-set steps=2 --screen-budget 90 --screen-batch 3 "
    assert said in found.command(PLACE)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"budget": None}, "budget: "),
        ({"budget": 0}, "1 <= budget <= 10000000 must hold, got 0"),
        ({"seed": 1.0}, "seed: "),
        ({"ideal": "perception"}, "ideal: "),
        ({"fixed": {"fog_density": float("nan")}}, "fixed.fog_density: "),
        ({"algorithm_settings": []}, "algorithm_settings: "),
        ({"map": 5}, "map"),
        ({"chosen": []}, "chosen: must be an object"),
        ({"chosen": {"objective": None, "count": 3}}, "count: "),
        ({"chosen": {"objective": None, "keep": 3}}, "unknown or missing: chosen.keep"),
        ({"road_map": "/other.xodr"}, "unknown or missing: 'road_map'"),
        ({"weights": "entropy"}, "unknown or missing: 'weights'"),
        ({"later": 1}, "unknown or missing: later"),
        ({"scenario": "a\0b"}, "a text holds NUL, or more than 4096 characters"),
        ({"ego": "x" * 5000}, "a text holds NUL, or more than 4096 characters"),
        ({"simulator": "esmini3"}, "unknown simulator 'esmini3'"),
        ({"screen": "embedded"}, "screen: "),
        ({"screen": {"name": "esmini", "settings": {}}}, "screen: its budget and its batch"),
        ({"screen": {"name": "esmini3", "settings": {}}, "screen_budget": 9, "screen_batch": 2},
         "unknown simulator 'esmini3'"),
        ({"screen": {"called": "esmini"}, "screen_budget": 9, "screen_batch": 1},
         "the run's settings are damaged: "),
        ({"screen": {"name": "esmini", "settings": "x"}, "screen_budget": 9, "screen_batch": 1},
         "the run's settings are damaged: "),
        ({"screen": {"name": "esmini", "settings": {}}, "screen_budget": 0, "screen_batch": 1},
         "1 <= screen_budget <= 10000000 must hold, got 0"),
    ],
)  # fmt: skip
def test_what_is_no_record_is_refused(changes, message):
    with pytest.raises(StorageError, match=f"^runs/s3: .*{re.escape(message)}"):
        Settings.from_dict(record(**changes), PLACE)


@pytest.mark.parametrize("name", ["budget", "time_limit", "chosen", "objective", "map_digest"])
def test_what_every_run_recorded_must_be_there(name):
    with pytest.raises(StorageError):
        Settings.from_dict({key: one for key, one in RECORDED.items() if key != name}, PLACE)
