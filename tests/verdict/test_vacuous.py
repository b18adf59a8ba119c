"""A search whose scenario never occurs says so, and ends with status 3."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import pytest
import yaml
from tests.approval import approve

from bridgegen.cli.verdict.of_run import PassFailCriteria
from bridgegen.jobs.search import Run, run_search

EGO = {"type": "car", "start": {"distance": 50.0}, "end": {"distance": 780.0}, "speed": "ego_speed"}
ROAD = {
    "lanes": 1, "lanes_against": 1, "length": 800.0, "speed_limit": 27.8, "road_type": "rural",
    "sidewalk_width": 2.5, "crosswalk_at": 300,
}  # fmt: skip
SIDEWALK = {"lane": "sidewalk", "distance": 300.0}
CROSSING = (SIDEWALK, {"way": "in", **SIDEWALK})


def parameter(low: float, high: float) -> dict[str, Any]:
    return {
        "axis": "participants", "unit": "m/s", "low": low, "high": high, "default": low,
        "description": "Ours.", "source": "Ours.",
    }  # fmt: skip


def car(at: float, speed: "float | str" = "ego_speed", **more: Any) -> dict[str, Any]:
    return {"type": "car", "start": {"distance": at, **more}, "speed": speed}


def brakes(who: str, when: float, to: float = 0.0, rate: float = 5.0) -> dict[str, Any]:
    what = {"participant": who, "speed": to, "rate": rate}
    return {"brakes": what | {"when": [{"kind": "time", "value": when}]}}


def walker(when: float) -> dict[str, Any]:
    walks = {"participant": "walker", "speed": 1.4, "rate": 3.0}
    return {
        "participants": {"walker": {"type": "pedestrian", "path": [*CROSSING], "speed": 0.0}},
        "events": {"walks": walks | {"when": [{"kind": "time", "value": when}]}},
    }


VACUOUS: Mapping[str, tuple[dict[str, Any], str]] = {
    "its trigger is after the end": (
        {"participants": {"lead": car(110.0)}, "events": brakes("lead", 25.0)},
        "the event brakes began in 0 of 30",
    ),
    "the ego stands behind a jam, and the walker is 180 m ahead": (
        walker(8.0)
        | {"jams": {"jam": {"tail": {"distance": 120.0}, "vehicles": ["car", "van"], "gap": 3.0}}},
        "a participant that acts came near the ego in at most 0 of 30",
    ),
    "the oncoming car acts when it has long passed": (
        {"participants": {"bv": car(120.0, 15.0, way="in")}, "events": brakes("bv", 12.0, 5.0)},
        "a participant that acts came near the ego in at most 0 of 30",
    ),
    "the ego is struck from behind before anything happens": (
        {
            "participants": {"bv": car(35.0, 19.0), "lead": car(250.0)},
            "events": brakes("lead", 10.0),
        },
        "the event brakes began in 0 of 30",
    ),
    "the ego is parked, and struck there": (
        {"participants": {"ego": EGO | {"speed": 0.0}, "bv": car(20.0)}},
        "stuck in 30 of 30: 0 m of 750 m driven",
    ),
    "the lead brakes as no car does": (
        {
            "participants": {"lead": car(110.0) | {"body": {"max_deceleration": 30.0}}},
            "events": brakes("lead", 2.0, rate=25.0),
        },
        "none of 30 evaluations could be judged",
    ),
    "there is no time to act from the start on": (
        {"participants": {"lead": car(58.0, 0.0)}},
        "none of 30 evaluations could be judged",
    ),
    "the driver is made for motorways, and people cross": (
        walker(0.0)
        | {"driver": "un-r157", "participants": walker(0.0)["participants"] | {"lead": car(100.0)}},
        "outside the domain of un-r157 (motorway)",
    ),
}

ORDINARY: Mapping[str, dict[str, Any]] = {
    "a lead brakes": {"participants": {"lead": car(110.0)}, "events": brakes("lead", 2.0)},
    "the ego stops behind a jam, which is the point": {
        "jams": {"jam": {"tail": {"distance": 150.0}, "vehicles": ["car", "van"], "gap": 3.0}}
    },
    "another acts far away, too": {
        "participants": {"lead": car(110.0), "bv": car(700.0)},
        "events": brakes("lead", 2.0) | {"turns_slow": brakes("bv", 3.0, 5.0)["brakes"]},
    },
}


@pytest.fixture
def searched(tmp_path: Path) -> Callable[[Mapping[str, Any]], Run]:
    def search(given: Mapping[str, Any]) -> Run:
        scenario = {
            "scenario": "planted", "title": "Planted", "description": "Ours.", "source": "Ours.",
            "template": "road", "roads": ROAD, "duration": 20.0, "time_step": 0.05,
            "axes": ["participants"], "include": ["rural", "weather"], "driver": "careful",
            "others": "scripted", "parameters": {"ego_speed": parameter(10.0, 14.0)},
            "objective": "harm",
            **given, "participants": {"ego": EGO, **given.get("participants", {})},
        }  # fmt: skip
        file = tmp_path / "planted.yaml"
        file.write_text(yaml.safe_dump(scenario, sort_keys=False))
        return run_search(
            file, algorithm="random", budget=30, seed=5, causes=False, triage="none",
            out=tmp_path / "run",
        )  # fmt: skip

    return search


@pytest.mark.parametrize("name", VACUOUS)
def test_a_vacuous_run_is_not_judged(searched, name):
    given, why = VACUOUS[name]
    run = searched(given)
    assert run.verdict == "not judged"
    assert run.triage is not None
    assert why in run.triage.bound.sentence
    (outcome,) = PassFailCriteria.read([], None).judge(run)
    assert outcome.verdict == "unknown"  # the command ends with status 3


@pytest.mark.parametrize("name", ORDINARY)
def test_an_ordinary_run_without_failures_is_judged(searched, name):
    approve(searched(ORDINARY[name]).verdict)
