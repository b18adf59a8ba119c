"""Recorded events beside their parameterised twins: which verdicts change, and by what."""

import json
from collections import Counter
from dataclasses import replace
from functools import lru_cache
from html import escape

import numpy as np
import pytest
import yaml
from tests.approval import approve, refuses
from tests.mining.events.simulated import located, recorded, simulated, tracks_of
from tests.recordings.writers import write_states

from bridgegen.base.errors import BridgeGenError, InputError
from bridgegen.engine.options import PipelineOptions
from bridgegen.engine.runner import Runner
from bridgegen.openx.opendrive.write import to_xml
from bridgegen.recordings.events.find import find_events
from bridgegen.recordings.events.scene import Scene
from bridgegen.recordings.twins import Track, _composed, compare, met_of, twins_of
from bridgegen.scenario.exposure import read_exposure
from bridgegen.scenario.language.parameterisation import ELEMENTS, NOT_KNOWN, Parameterisation
from bridgegen.scenario.language.reader import load

pytestmark = pytest.mark.thorough

ROWS, DRIVER = 60, "un-r157"


def moved(rollout, other, along=None, across=None):
    """The rollout with another's motion changed by a function of the time since its event [s]."""
    e, n = rollout.names.index(other), rollout.x.shape[2]
    x, y, v = rollout.x.copy(), rollout.y.copy(), rollout.v.copy()
    for row in range(len(x)):
        u = (np.arange(n) - rollout.began[row, 0]) * rollout.time_step
        if along is not None:
            x[row, e] = np.maximum.accumulate(x[row, e] + along(u))
            v[row, e] = np.gradient(x[row, e], rollout.time_step)
        if across is not None:
            y[row, e] += across(u)
    return replace(rollout, x=x, y=y, v=v)


def met(name, rollout, lanes):
    traffic, where = located(recorded(rollout, range(len(rollout.x))), lanes)
    scenario, left_out = load(name), Counter()
    (events,) = (
        kind for kind in find_events(traffic, where).kinds
        if kind.kind.name == scenario.recorded.event
    )  # fmt: skip
    return met_of(scenario, Scene(traffic, where), events, left_out), left_out


@lru_cache
def agreement(name, ego, change, drivers=(DRIVER,)):
    _, _, rollout, lanes = simulated(name, ROWS, ego)
    changed = CHANGES[change]
    events, left_out = met(name, moved(rollout, *changed) if changed else rollout, lanes)
    return compare(load(name), events, drivers, "simulated", left_out)


def pulling_away(u):
    """It accelerates by 2 m/s² from 1.2 s before the lane change on, for 5 s."""
    t = np.clip(u + 1.2, 0.0, 5.0)
    return t * t + 10.0 * np.maximum(u - 3.8, 0.0)


def late_braking(u):
    """It brakes by 6 m/s² for 2 s, a second after the lane change began."""
    t = np.clip(u - 1.0, 0.0, 2.0)
    return -3.0 * t * t - 12.0 * np.maximum(u - 3.0, 0.0)


CHANGES = {"none": None, "pulling away": ("bv", pulling_away), "late braking": ("bv", late_braking)}


def test_the_parameterised_form_itself_agrees_with_its_twin():
    found = agreement("cut-in", DRIVER, "none")
    assert found.events >= 50
    assert found.pooled("contact").both >= 10
    for verdict in ("failure", "contact", "collision course"):
        assert (found.pooled(verdict).replay, found.pooled(verdict).twin) == (0, 0)
    assert found.figures() | {"f1": 1.0, "changed": 0.0, "costs_most": None} == found.figures()
    assert "changes none of the verdicts" in found.figures()["says"]


def test_an_acceleration_that_no_parameter_has_is_named():
    figures = agreement("cut-in", DRIVER, "pulling away").figures()
    assert figures["events"] >= 40
    assert figures["changed"] > 0.1
    assert figures["recall"] == 1.0  # who pulls away is less of a danger than its twin
    assert figures["precision"] < 0.7
    assert figures["costs_most"] == "initial acceleration"
    assert figures["changed_with_it"] < 0.3 * figures["changed"]
    assert "Leaving out the initial acceleration costs most" in figures["says"]


def test_hard_braking_after_the_begin_is_named():
    figures = agreement("cut-in", DRIVER, "late braking").figures()
    assert figures["changed"] > 0.1
    assert figures["costs_most"] == "shape of braking"


@pytest.mark.parametrize(
    ("name", "ego"), [("cut-out", "route-follower"), ("lead-brakes", "route-follower")]
)
def test_other_events_agree_with_their_twins(name, ego):
    figures = agreement(name, ego, "none").figures()
    assert figures["events"] >= 40
    assert figures["f1"] > 0.9
    assert figures["changed"] < 0.1  # at the edge of a collision course


@pytest.fixture(scope="module")
def drive(tmp_path_factory):
    """A folder with a recording, its map, and a table of the events' parameters."""
    folder = tmp_path_factory.mktemp("drive")
    _, P, rollout, _ = simulated("cut-in", ROWS, DRIVER)
    rollout = moved(rollout, *CHANGES["late braking"])
    tracks, _ = tracks_of(rollout, range(len(rollout.x)))
    (folder / "recordings").mkdir()
    write_states(folder / "recordings", tracks, 0.05)
    runner = Runner(load("cut-in"), load("cut-in").space(), PipelineOptions(ego=DRIVER))
    model = runner.concrete(runner.space.row({})).roads
    (folder / "place.xodr").write_bytes(to_xml(model))
    names = ("ego_speed", "speed_difference", "gap", "cut_in_distance", "change_time")
    lines = [",".join(names), *(",".join(f"{P[n][i]:.6g}" for n in names) for i in range(ROWS))]
    (folder / "events.csv").write_text("\n".join(lines), "utf-8")
    return folder


def fit(cli, drive, out, *more):
    return cli(
        "fit", "cut-in", drive / "events.csv", "--without-column", "default", "--replicates", 20,
        "--out", out, "--recordings", drive / "recordings", "--map", drive / "place.xodr", *more,
    )  # fmt: skip


def test_fit_writes_what_the_parameterisation_changes_and_risk_says_it(cli, drive, tmp_path):
    out = tmp_path / "exposure.yaml"
    code, text, err = fit(cli, drive, out, "--replay-drivers", DRIVER, "--json")
    assert code == 0, err
    stated = json.loads(text)["parameterisation"]
    assert stated["costs_most"] == "shape of braking"
    assert stated["changed"] > 0.3
    page = out.with_suffix(".html").read_text("utf-8")
    assert escape(stated["says"], quote=False) in page
    assert "given back" in page
    exposure = read_exposure(out)
    assert exposure.parameterisation.figures() == stated

    code, text, err = cli(
        "risk", "cut-in", "--exposure", out, "--budget", 200, "--method", "mc", "--out",
        tmp_path / "risk",
    )  # fmt: skip
    assert code in (0, 3), err
    assert stated["says"] in text
    assert escape(stated["says"], quote=False) in (tmp_path / "risk" / "risk.html").read_text(
        "utf-8"
    )
    said = json.loads((tmp_path / "risk" / "risk.json").read_text("utf-8"))
    assert said["exposure"]["parameterisation"] == stated


def test_without_replays_it_says_that_it_is_not_known(cli, drive, tmp_path):
    out = tmp_path / "exposure.yaml"
    code, text, err = fit(cli, drive, out, "--replay-drivers", "none")
    assert code == 0, err
    assert NOT_KNOWN in text
    assert escape(NOT_KNOWN, quote=False) in out.with_suffix(".html").read_text("utf-8")
    assert "parameterisation" not in out.read_text("utf-8")


def test_what_cannot_be_replayed_is_refused_in_a_line(cli, drive, tmp_path):
    out = tmp_path / "exposure.yaml"
    code, _, err = fit(cli, drive, out, "--replay-drivers", "../mine.py:Driver")
    assert code == 2
    approve(err, "driver", "mine.py")
    (tmp_path / "broken.csv").write_text("time,entity,x\n1,a,nonsense\n", "utf-8")
    code, _, err = fit(cli, drive, out, "--recordings", tmp_path / "broken.csv")
    assert code == 2
    approve(err, "broken.csv")
    (tmp_path / "empty").mkdir()
    code, _, err = fit(cli, drive, out, "--recordings", tmp_path / "empty")
    assert code == 2
    approve(err, "empty")
    code, _, err = fit(cli, drive, tmp_path / "nowhere" / "exposure.yaml")
    assert code == 2
    approve(err, "nowhere")
    with refuses(InputError, "crossroads-s4", "cut-in, cut-out"):
        twins_of(load("crossroads-s4"), [drive / "recordings"], [DRIVER])
    assert not out.exists()


def test_elements_are_put_back_one_at_a_time():
    """By hand: 20 m/s and 2 m/s² more than the twin's 18 m/s, a lane change from the right."""
    u = np.arange(-20, 60) / 10
    twin = np.array([18.0 * u, 3.75 * np.clip(1.0 - u / 4.0, 0.0, 1.0), 0.0 * u, 18.0 + 0.0 * u])
    time = np.arange(0, 31) / 10
    recorded = np.array([
        time, 20.0 * time + time**2, np.clip(time / 3.0, 0.0, 1.0) - 1.0, 0.1 + 0.0 * time,
        20.0 + 2.0 * time,
    ])  # fmt: skip
    track, at = Track(recorded, 20.0, 2.0, 3.0), 50  # u = 3 s
    assert u[at] == pytest.approx(3.0)
    expected = {
        (): 54.0, ("initial speed",): 60.0, ("initial acceleration",): 63.0,
        ("shape of braking",): 54.0, ELEMENTS: 69.0,
    }  # fmt: skip
    for elements, way in expected.items():
        s, d, h = _composed(u, twin, track, 3.75, elements)
        assert s[at] == pytest.approx(way), elements
        assert s[:11] == pytest.approx(18.0 * u[:11] - ("initial speed" in elements))
        assert (np.diff(s) >= 0.0).all()
        aside = (0.0, -0.1) if elements == ELEMENTS else (3.75 / 4.0, 0.0)
        assert (d[at], h[at]) == pytest.approx(aside)  # mirrored: there is no lane on the right
    assert d[20] == pytest.approx(3.75)


def test_no_event_leaves_it_unknown():
    found = compare(load("cut-in"), [], [DRIVER], "nothing", Counter())
    figures = found.figures()
    assert (figures["f1"], figures["changed"], figures["costs_most"]) == (None, None, None)
    assert "is not known" in figures["says"]


COUNTS = {"both": 3, "replay": 1, "twin": 0, "neither": 8}
BLOCK = {
    "source": "by hand", "events": 12, "left_out": {"<script>": 2},
    "agreement": {"failure": {"reference": COUNTS}},
    "given_back": {"failure": {"initial acceleration": 0, "lateral profile": 1}},
}  # fmt: skip


def test_figures_are_those_of_the_counts_by_hand():
    found = Parameterisation.model_validate(BLOCK)
    shares = found.pooled("failure").shares()
    assert shares["recall"] == pytest.approx((3 / 4, 0.194120, 0.993691), abs=1e-5)
    assert shares["precision"] == pytest.approx((1.0, 0.292402, 1.0), abs=1e-5)
    assert shares["f1"][0] == pytest.approx(6 / 7)
    assert shares["changed"][0] == pytest.approx(1 / 12)
    assert found.figures()["costs_most"] == "initial acceleration"


@pytest.mark.parametrize(
    "change",
    [
        {"events": 13},
        {"events": -1},
        {"agreement": {"luck": {"reference": COUNTS}}},
        {"agreement": {"failure": {"reference": COUNTS | {"both": 1.5}}}},
        {"recall": 1.0},
    ],
)
def test_a_block_that_contradicts_itself_is_refused(tmp_path, change):
    path = tmp_path / "exposure.yaml"
    data = {
        "exposure_of": "cut-in",
        "exposure": {"source": "by hand", "others": "default", "parameterisation": BLOCK | change},
    }
    path.write_text(yaml.safe_dump(data), "utf-8")
    with refuses(BridgeGenError, "parameterisation", "exposure.yaml"):
        read_exposure(path)
