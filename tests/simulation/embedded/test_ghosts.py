"""False positives: what the ego's sensors report and is not there."""

from dataclasses import replace

import numpy as np
import pytest
from tests.approval import approve, refuses

from bridgegen.base.errors import InputError, ScenarioError
from bridgegen.drivers.kinds import GHOST, MISSED, NO_FRAME, SEEN_BY, X
from bridgegen.engine.options import PipelineOptions
from bridgegen.engine.pipeline import Pipeline
from bridgegen.openx.openscenario.from_owl import openscenario_from_owl
from bridgegen.openx.openscenario.read import read
from bridgegen.openx.openscenario.to_owl import individuals_from_openscenario
from bridgegen.openx.openscenario.write import to_xml
from bridgegen.openx.prepared import prepared
from bridgegen.pages.scenario_page import story_lines
from bridgegen.scenario.language.reader import load, shipped_text
from bridgegen.scenario.ontology.check import check
from bridgegen.simulation.embedded.simulator import EmbeddedSimulator

TEXT = shipped_text("phantom-braking").decode()
GHOSTS = TEXT[TEXT.index("ghosts:") : TEXT.index("parameters:")]
AT_RANDOM = f"""{GHOSTS.rstrip()}
  clutter: {{type: car, rate: 20 1/km, appears: 60.0, vanishes: 10.0, lifetime: 0.5}}

"""


@pytest.fixture
def made(tmp_path):
    def make(ghosts: str = GHOSTS, **options) -> Pipeline:
        path = tmp_path / "phantom-braking.yaml"
        path.write_text(TEXT.replace(GHOSTS, ghosts), "utf-8")
        scenario = load(path)
        return Pipeline(scenario, scenario.space(), PipelineOptions(ego="reference", **options))

    return make


def rows(pipeline: Pipeline, n: int = 32) -> np.ndarray:
    return pipeline.space.decode(np.random.default_rng(7).random((n, pipeline.space.n_var)))


def test_it_is_reported_where_it_seems_to_stand_and_only_there(made):
    pipeline = made()
    X_rows = rows(pipeline)
    rollout = pipeline.rollout(X_rows)
    bridge, near, far = (
        X_rows[:, pipeline.space.index(name)] for name in ("bridge_at", "vanishes", "appears")
    )
    assert rollout.detections.shape[1] == 2
    seen = rollout.ghosts[:, 0, :, SEEN_BY] == GHOST
    front = rollout.x[:, 0] + rollout.box[0, 2] + 0.5 * rollout.box[0, 0]
    left = rollout.x[:, 0, :1] + bridge[:, None] - front
    assert seen.any(axis=1).all()
    assert (left[seen] <= np.broadcast_to(far[:, None], left.shape)[seen] + 0.01).all()
    assert (left[seen] >= np.broadcast_to(near[:, None], left.shape)[seen] - 0.01).all()
    middle = rollout.ghosts[:, 0, :, X] - 0.5 * 4.6 - rollout.x[:, 0, :1] - bridge[:, None]
    assert np.abs(middle[seen]).max() < 0.5  # 0.1 m, one standard deviation
    frames = rollout.ghosts[:, 0, :, SEEN_BY]
    assert np.isin(frames, (NO_FRAME, MISSED, GHOST)).all()


def test_a_row_is_the_same_in_any_batch(made):
    pipeline = made(AT_RANDOM)
    X_rows = rows(pipeline)
    whole = pipeline.rollout(X_rows)
    order = np.random.default_rng(0).permutation(len(X_rows))
    again = pipeline.rollout(X_rows[order])
    assert np.array_equal(again.ghosts, whole.ghosts[order])
    assert np.array_equal(again.x, whole.x[order])
    alone = pipeline.rollout(X_rows[5:6])
    assert np.array_equal(alone.ghosts[0], whole.ghosts[5])


def test_ideal_perception_and_a_driver_who_sees_the_truth_meet_none(made):
    for options in ({"ideal": ("perception",)}, {}):
        pipeline = made(**options)
        if not options:
            pipeline = Pipeline(pipeline.scenario, pipeline.space, PipelineOptions(ego="careful"))
        rollout = pipeline.rollout(rows(pipeline))
        assert not (rollout.ghosts[..., SEEN_BY] == GHOST).any()
        assert rollout.a[:, 0].min() > -1.0


def test_what_is_there_is_seen_as_without_ghosts(made):
    """Random numbers are drawn by address, so a ghost does not shift those of others."""
    with_one, without = made(), made()
    embedded = without.runner.embedded
    embedded.program = replace(embedded.program, ghosts=np.zeros((0, 8), np.int64))
    X_rows = rows(with_one)
    a, b = with_one.rollout(X_rows), without.rollout(X_rows)
    k = 10  # before any ghost
    assert np.array_equal(a.detections[:, :, :k], b.detections[:, :, :k])
    assert b.ghosts.size == 0


def test_births_follow_the_rate(made):
    """20 per km, of 0.5 s on average: counted over the way driven, within four deviations."""
    pipeline = made(AT_RANDOM)
    rollout = pipeline.rollout(rows(pipeline, 256))
    frames = rollout.ghosts[:, 1, ::2, SEEN_BY] == GHOST
    births = (frames[:, 1:] & ~frames[:, :-1]).sum()
    v, free = rollout.v[:, 0, ::2], ~frames
    expected = (0.02 * 0.1 * v * free).sum()
    assert births == pytest.approx(expected, abs=4.0 * np.sqrt(expected) + 0.1 * expected)
    assert frames.sum() / births == pytest.approx(0.5 / 0.1, rel=0.2)


def test_files_say_it_there_and_back(made):
    pipeline = made()
    concrete = pipeline.runner.concrete(pipeline.space.row({}), "roads.xodr")
    assert not list(check(concrete.individuals, pipeline.runner.source.constraints))
    found, lost = individuals_from_openscenario(
        concrete.storyboard, concrete.roads, "roads.xodr", ""
    )[:2]
    assert not lost
    text = to_xml(concrete.storyboard)
    assert to_xml(openscenario_from_owl(found, "roads.xodr")) == text
    assert b"bridge" not in text.split(b"<Storyboard>")[1]  # no body of the scenario
    assert pipeline.runner.embedded.program.names == ("ego", "rear")
    approve(" ".join(story_lines(pipeline.scenario)), "bridge")


@pytest.mark.parametrize(
    ("old", "new", "named"),
    [
        ("    at: bridge_at\n", "", ("bridge", "rate")),
        ("    at: bridge_at\n", "    at: bridge_at\n    rate: 1.0\n", ("bridge", "rate")),
        ("    at: bridge_at\n", "    at: -3.0\n", ("ghosts.bridge.at",)),
        ("    at: bridge_at\n", "    at: ego_speed\n", ("ego_speed", "m/s")),
        ("    appears: appears\n", "    appears: 10.0\n    lifetime: 0.0\n", ("lifetime",)),
        ("    type: car\n", "    type: unicorn\n", ("unicorn",)),
        (
            "    appears: appears\n    vanishes: vanishes\n",
            "    appears: 10.0\n    vanishes: 20.0\n",
            ("vanishes < appears", "20"),
        ),
    ],
)
def test_a_scenario_file_that_says_it_wrongly_is_refused(made, old, new, named):
    with refuses(ScenarioError, *named):
        made(GHOSTS.replace(old, new))


@pytest.mark.parametrize(
    ("old", "new", "named"),
    [
        ("ghost.bridge.type", "ghost.bridge.kind", ("kind",)),
        ("ghost.bridge.at", "ghost.bridge.rate2", ("rate2",)),
        ('name="ghost.bridge.type" value="car"', 'name="ghost.bridge.type" value="x"', ("'x'",)),
        ('value="$vanishes"', 'value="-4"', ("ghost.bridge.vanishes [m]", "-4")),
        ('value="$vanishes"', 'value="soon"', ("ghost.bridge.vanishes [m]", "soon")),
    ],
)
def test_an_openscenario_file_that_says_it_wrongly_is_refused(made, old, new, named):
    pipeline = made()
    concrete = pipeline.runner.concrete(pipeline.space.row({}), "roads.xodr")
    text = to_xml(concrete.storyboard).decode()
    assert old in text
    with refuses(InputError, *named):
        file = prepared(read(text.replace(old, new).encode(), "x.xosc"), concrete.roads, "x.xosc")
        EmbeddedSimulator(file, "x.xosc")
