"""Several egos: the driver under test drives further vehicles, and all of them are judged."""

from pathlib import Path

import numpy as np
import pytest
from tests.approval import approve, refuses

from bridgegen.assess.conflict.analysis import CONTACT, Responsible, analyse
from bridgegen.assess.conflict.findings import Findings
from bridgegen.assess.conflict.harm import COURSE, NEAR_MISS, decisive
from bridgegen.assess.conflict.plausibility import plausibility
from bridgegen.assess.conflict.summary import summarise
from bridgegen.base.errors import InputError, ScenarioError
from bridgegen.engine.options import PipelineOptions
from bridgegen.engine.pipeline import Pipeline
from bridgegen.engine.simulate import simulate_file
from bridgegen.engine.trials import Trials
from bridgegen.jobs.search.scenario_files import write_scenario
from bridgegen.scenario.language.reader import load, shipped_text
from bridgegen.simulation.choice import SimulatorChoice

EXAMPLES = Path(__file__).parents[3] / "docs" / "examples"
FIRST = """\
  first:
    type: car
    driver: ego
    start: {distance: first_at}
    end: {distance: 780.0}
    speed: ego_speed
"""
AHEAD = """\
  gap_ahead:
    axis: participants
    unit: m
    low: 12.0
    high: 60.0
    default: 40.0
    description: From the lead car's rear to the front of the first test vehicle at the start.
    source: "As for gap."
"""
AT = """\
derived:
  first_at:
    axis: participants
    unit: m
    value: 50 + gap + 4.6
    description: Where the first test vehicle starts.
    why: Between two equal cars the reference points are a length farther apart than the bumpers.
    source: "As for gap."
"""
TEXT = shipped_text("lead-brakes").decode().replace("duration: 20.0", "duration: 6.0")
TEXT = TEXT[: TEXT.index("recorded:")] + TEXT[TEXT.index("objective:") :]
TEXT = TEXT.replace("value: 50 + gap + 4.6", "value: first_at + gap_ahead + 4.6")
TEXT = TEXT.replace("  lead:\n", FIRST + "  lead:\n").replace("derived:\n", AT)
TEXT = TEXT.replace("  deceleration:\n    axis", AHEAD + "  deceleration:\n    axis")
"""A platoon: the ego follows a second vehicle of its driver, which follows a car that brakes."""
MOTION = ("x", "y", "h", "v", "a")


@pytest.fixture
def made(tmp_path):
    def make(ego: str = "route-follower", text: str = TEXT, **options) -> Pipeline:
        path = tmp_path / "platoon.yaml"
        path.write_text(text, "utf-8")
        scenario = load(path)
        return Pipeline(scenario, scenario.space(), PipelineOptions(ego=ego, **options))

    return make


def rows(pipeline: Pipeline, n: int = 24) -> np.ndarray:
    return pipeline.space.decode(np.random.default_rng(3).random((n, pipeline.space.n_var)))


def test_one_may_run_into_the_other(made):
    slow = TEXT.replace(FIRST, FIRST.replace("speed: ego_speed", "speed: 2.0"))
    said = []
    for text in (slow, exchanged(slow)):
        rollout = (pipeline := made(text=text)).rollout(rows(pipeline, 8))
        found = analyse(rollout)
        row = int(np.flatnonzero(found.kind[:, 1] == CONTACT)[0])
        assert np.array_equal(decisive(found)[0][row], 1)
        summary = summarise(found, row)
        partner = Findings.of(found, [""] * 8).partner[row]
        assert partner == summary.partner == rollout.names[1 - len(said)]
        assert summary.vehicle == ("", "first")[len(said)]
        said.append(summary.sentence)
    approve("\n".join(said), "The ego's front", "'first'", "The ego first's front", "'ego'")


def exchanged(text: str) -> str:
    """Return a scenario in which the ego and the further vehicle have each other's names."""
    text = text.replace("  ego:\n", "  one:\n").replace("  first:\n", "  ego:\n")
    text = text.replace("  one:\n", "  first:\n").replace("    driver: ego\n", "")
    return text.replace("  first:\n    type: car\n", "  first:\n    type: car\n    driver: ego\n")


@pytest.mark.parametrize(("ego", "ideal"), [("route-follower", ()), ("reference", ("perception",))])
def test_two_that_change_places_change_motion_and_verdicts(made, ego, ideal):
    """Only the names differ; the ego of the first is the further vehicle of the second."""
    one = made(ego, ideal=ideal)
    X = rows(one)
    first, second = one.rollout(X), made(ego, exchanged(TEXT), ideal=ideal).rollout(X)
    assert (first.status == 0).all()
    assert first.egos[0].names == ("first", "ego", "lead")
    for name in MOTION:
        assert np.array_equal(getattr(first, name), getattr(second, name)[:, [1, 0, 2]])
        assert np.array_equal(getattr(first.egos[0], name), getattr(second, name))
        assert np.array_equal(getattr(second.egos[0], name), getattr(first, name))
    found, other = analyse(first), analyse(second)
    assert np.array_equal(decisive(found)[1], decisive(other)[1])
    column = decisive(found)[0]
    assert np.array_equal(column, decisive(other)[0])  # both have the lead, or each other
    at = np.arange(len(X)), column
    mine, its = found.parties(at[0], column)[0], other.parties(at[0], column)[0]
    course = decisive(found)[1] >= COURSE  # else both merely come as near to each other
    assert np.array_equal(mine[course], 1 - its[course])
    for name in ("kind", "type", "responsible", "rule", "instant", "severity", "ttc", "v_ego"):
        assert np.array_equal(getattr(found, name)[at], getattr(other, name)[at])


@pytest.mark.parametrize("ego", ["route-follower", "reference"])
def test_one_that_meets_nobody_leaves_the_ego_s_results(made, ego):
    text = TEXT.replace("value: 50 + gap + 4.6", "value: 600.0 + gap")
    text = text.replace("value: first_at + gap_ahead", "value: 50 + gap_ahead")
    tested, scripted = made(ego, text), made(ego, text.replace("    driver: ego\n", ""))
    X = rows(tested)
    alone, beside = scripted.rollout(X), tested.rollout(X)
    for name in (*MOTION, "offset"):
        assert np.array_equal(getattr(alone, name)[:, 0], getattr(beside, name)[:, 0])
    for name in ("n_steps", "progress", "began"):
        assert np.array_equal(getattr(alone, name), getattr(beside, name))
    assert np.array_equal(scripted.measure(alone), tested.measure(beside))


def test_a_row_fails_if_a_further_vehicle_does_and_says_which(made):
    pipeline = made()
    X = rows(pipeline)
    rollout = pipeline.rollout(X)
    found = analyse(rollout)
    other, harm = decisive(found)
    hit = np.flatnonzero(harm >= NEAR_MISS)
    assert (found.kind[hit, 2] == CONTACT).any()
    assert (
        found.parties(np.arange(len(X)), other)[0][hit] == 1
    ).all()  # it hits the lead first; the ego follows it
    assert (plausibility(rollout).code == 0).all()  # its contact is no implausible traffic
    summary = summarise(found, int(hit[0]))
    assert (summary.vehicle, summary.partner) == ("first", "lead")
    approve(summary.sentence, "The ego first's front", "'lead'")
    trials = Trials.of(rollout, *pipeline.runner.roads_of(X), "harm", "ego")
    assert {*trials.place[hit]} == {"on the route of first"}
    assert {*trials.findings.partner[hit]} == {"lead"}


def test_where_both_fail_it_is_the_conflict_of_the_one_responsible():
    scenario = load("two-at-crossroads")
    pipeline = Pipeline(scenario, scenario.space(), PipelineOptions(ego="route-follower"))
    rollout = pipeline.rollout(rows(pipeline, 40))
    found = analyse(rollout)
    hit = found.kind[:, 1] == CONTACT
    assert hit.sum() > 5
    assert (found.body[hit, 1] == 1).all()  # it turned left across the ego's path
    assert (found.responsible[hit, 1] == Responsible.EGO).all()
    assert (rollout.egos[0].n_steps <= rollout.n_steps).all()


@pytest.mark.parametrize("ego", ["reference", f"{EXAMPLES / 'my_driver.py'}:MyDriver"])
def test_a_row_is_the_same_in_any_batch(made, ego):
    pipeline = made(ego)
    X = rows(pipeline, 6)
    whole, alone = pipeline.rollout(X), pipeline.rollout(X[4:5])
    assert (whole.status == 0).all()
    for a, b in ((whole, alone), (whole.egos[0], alone.egos[0])):
        for name in (*MOTION, "detections"):
            assert np.array_equal(getattr(a, name)[4:5], getattr(b, name)), name
    assert np.array_equal(whole.x, whole.egos[0].x[:, [1, 0, 2]])
    pipeline.runner.embedded.stop()


def test_sensors_of_two_vehicles_err_independently(made):
    rollout = made("reference").rollout(rows(made("reference"), 4))
    seen, its = (each.detections[:, 2, ::2, 0] for each in (rollout, rollout.egos[0]))
    assert seen.shape == its.shape
    assert (seen != its).any()


def test_an_exported_file_gives_the_same_bits(made, tmp_path):
    pipeline = made("reference")
    X = rows(pipeline, 2)
    files = write_scenario(pipeline, X[1], tmp_path, "one")
    (source,) = (path for path in map(Path, files) if path.suffix == ".xosc")
    assert 'name="driver" value="ego"' in source.read_text("utf-8")
    result, rollout = simulate_file(source), pipeline.rollout(X)
    for name in (*MOTION, "detections"):
        assert np.array_equal(getattr(result.rollout, name)[0], getattr(rollout, name)[1])
        its = result.rollout.egos[0], rollout.egos[0]
        assert np.array_equal(getattr(its[0], name)[0], getattr(its[1], name)[1])


def test_what_cannot_be_driven_is_refused(made):
    with refuses(ScenarioError, "start and an end", "first"):
        made(text=TEXT.replace(FIRST, FIRST.replace("    end: {distance: 780.0}\n", "")))
    with refuses(ScenarioError, "under test"):
        made(text=TEXT.replace("    participant: lead", "    participant: first"))
    with refuses(InputError, "first", "one vehicle"):
        remote = made("connect:localhost:4711")
        remote.rollout(rows(remote, 1))
    with refuses(InputError, "first", "one vehicle"):
        compiled = made(f"{EXAMPLES / 'my_compiled_driver.py'}:drive")
        compiled.rollout(rows(compiled, 1))
    with refuses(InputError, "several egos", "esmini"):
        scenario = load("two-at-crossroads")
        Pipeline(scenario, scenario.space(), simulator=SimulatorChoice("esmini"))
