"""Conflicts of recordings: read, analysed, summarised, printed."""

import json

import numpy as np
import pytest
from tests.approval import approve

from bridgegen.assess.conflict.recorded import NO_KINDS, NO_MAP, NO_OFFSET, measure_recording
from bridgegen.assess.conflict.summary import UNITS, summarise
from bridgegen.engine.simulate import simulate_file
from bridgegen.simulation.trace import write_trace

HEADER = "time,entity,x,y,h,speed,length,width"


@pytest.fixture
def recording(tmp_path):
    """Write a table of two cars of 4 m × 2 m whose x is given per instant of 0.1 s."""

    def write(ego, other, speed, other_speed=0.0, y=0.0):
        lines = [HEADER]
        for k, (a, b) in enumerate(zip(ego, other, strict=True)):
            lines.append(f"{0.1 * k:.1f},ego,{a},0,0,{speed},4,2")
            lines.append(f"{0.1 * k:.1f},parked,{b},{y},0,{other_speed},4,2")
        path = tmp_path / "recording.csv"
        path.write_text("\n".join(lines) + "\n")
        return path

    return write


@pytest.fixture
def crash(recording):
    """The ego at 10 m/s drives into a car that stands 52 m ahead: 48 m to go, 4.8 s."""
    return recording([k * 1.0 for k in range(60)], [52.0] * 60, 10.0)


def test_driving_into_a_standing_car_by_hand(crash):
    measured = measure_recording(crash)
    one = summarise(measured.conflicts)
    assert (one.conflict, one.type, one.partner) == ("contact", "front-to-rear striking", "parked")
    assert (one.zone_ego, one.zone_other) == ("front", "rear")
    assert one.time == pytest.approx(4.8)
    assert (one.responsible, one.preventable) == ("ego", True)
    assert one.closing_normal == pytest.approx(10.0)
    assert one.closing_tangential == pytest.approx(0.0)
    assert one.delta_v_ego == pytest.approx(5.0)  # plastic, equal masses: half of 10 m/s each
    assert one.delta_v_other == pytest.approx(5.0)
    assert 0.0 < one.severity < 1.0
    assert one.ttc == 0.0
    assert "parked" in one.sentence
    assert measured.metrics["severity"] == one.severity
    worth = 0.3 + 0.7 * np.log1p(one.severity / 1e-4) / np.log1p(1e4)
    assert measured.metrics["harm"] == one.harm == pytest.approx(worth)


def test_what_a_recording_does_not_say_is_assumed(crash):
    assert measure_recording(crash).assumptions == (NO_MAP, NO_KINDS, NO_OFFSET)


def test_passing_on_another_lane_is_no_conflict(recording):
    path = recording([k * 1.0 for k in range(60)], [30.0] * 60, 10.0, y=3.5)
    measured = measure_recording(path)
    assert summarise(measured.conflicts) is None
    assert measured.metrics["harm"] < 0.1


def test_a_summary_as_json_has_no_infinite_number_and_all_units(crash):
    facts = summarise(measure_recording(crash).conflicts).to_dict()
    json.dumps(facts, allow_nan=False)
    assert {name: facts[name]["unit"] for name in UNITS} == dict(UNITS)
    assert facts["rule_source"]


def test_metrics_prints_the_conflict(cli, crash):
    status, out, _ = cli("analyse", "recording", crash)
    assert status == 0
    approve(out, "front-to-rear", "10.0 m/s", "5.0 m/s", "delta-v")
    status, out, _ = cli("analyse", "recording", crash, "--json")
    facts = json.loads(out)["conflict"]
    assert facts["time"] == {"value": pytest.approx(4.8), "unit": "s"}
    assert facts["assumptions"] == [NO_MAP, NO_KINDS, NO_OFFSET]


def test_only_harm_can_be_asked_for(cli, crash):
    status, out, _ = cli("analyse", "recording", crash, "--metrics", "harm", "--json")
    assert status == 0
    assert list(json.loads(out)["metrics"]) == ["harm"]


@pytest.fixture(scope="module")
def xosc(tmp_path_factory):
    import bridgegen as bg

    folder = tmp_path_factory.mktemp("run")
    run = bg.run_search("pedestrian-behind-parked", budget=30, keep=1, triage="none",
                        out=folder / "run",
                        algorithm="random", ego="route-follower")  # fmt: skip
    return run.scenarios[0]


def test_simulate_says_the_same_as_the_recording_of_it(cli, xosc, tmp_path):
    result = simulate_file(xosc)
    one = summarise(result.conflicts)
    assert one is not None
    assert result.metrics["harm"] >= 0.3
    trace = tmp_path / "trace.csv"
    write_trace(trace, result.rollout)
    measured = measure_recording(trace, boxes=xosc)
    again = summarise(measured.conflicts)
    for name in ("conflict", "type", "partner", "time", "zone_ego", "severity"):
        assert getattr(again, name) == getattr(one, name)
    assert NO_KINDS not in measured.assumptions  # the file says that it is a pedestrian
    status, out, _ = cli("simulate", xosc)
    assert status == 0
    assert f"conflict: {one.sentence}" in out
    status, out, _ = cli("simulate", xosc, "--json")
    told = json.loads(out)["conflict"]
    assert told["sentence"] == one.sentence
    assert told["assumptions"] == []
