"""False positives: what the ego's sensors report and is not there."""

from dataclasses import replace

import numpy as np
import pytest
from tests.approval import approve, refuses

from bridgegen.base.errors import InputError
from bridgegen.drivers.kinds import GHOST, HEADING, MISSED, NO_FRAME, SEEN_BY, X, Y
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
IMAGE = f"""{GHOSTS.rstrip()}
  image: {{type: car, mirrors: rear, aside: -2.5, share: 0.5, appears: 140.0, vanishes: 1.0}}

"""
TRACKER = GHOSTS + (
    "tracker: {angle: 2.0, range: 1.5, extent: 0.5, confirm: 2, of: 4, coast: 0.5}\n\n"
)


@pytest.fixture
def made(tmp_path):
    def make(ghosts: str = GHOSTS, **options) -> Pipeline:
        path = tmp_path / "phantom-braking.yaml"
        text = TEXT.replace(GHOSTS, ghosts)
        if ghosts == IMAGE:  # of a car ahead, on the other lane
            text = text.replace("lane: 2, distance: rear_at", "lane: 1, distance: rear_at")
            text = text.replace("value: 120 - gap - 4.6", "value: 120 + gap + 4.6")
        path.write_text(text, "utf-8")
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


def test_an_image_is_the_body_beyond_the_mirror(made):
    """A rail 2.5 m right of the ego's way: what is 3.75 m left of it is seen 8.75 m right."""
    pipeline = made(IMAGE)
    rollout = pipeline.rollout(rows(pipeline, 64))
    image, frames = rollout.ghosts[:, 1], rollout.ghosts[:, 1, :, SEEN_BY]
    seen = frames == GHOST
    ahead = rollout.x[:, 1] + rollout.box[1, 2]
    way = rollout.y[:, 0, :1]
    assert np.abs(image[..., X] - ahead)[seen].max() < 0.5
    assert image[..., Y][seen].mean() == pytest.approx((way - 8.75).mean(), abs=0.02)
    assert np.abs(image[..., Y] - way + 8.75)[seen].max() < 0.5
    assert image[..., HEADING][seen].mean() == pytest.approx(0.0, abs=0.02)
    near = (ahead - rollout.x[:, 0] < 120.0) & (frames != NO_FRAME)
    assert (seen & near).sum() / near.sum() == pytest.approx(0.5, abs=0.1)


@pytest.mark.parametrize("said", [GHOSTS, IMAGE, TRACKER])
def test_files_say_it_there_and_back(made, said):
    pipeline = made(said)
    concrete = pipeline.runner.concrete(pipeline.space.row({}), "roads.xodr")
    assert not list(check(concrete.individuals, pipeline.runner.source.constraints))
    found, lost = individuals_from_openscenario(
        concrete.storyboard, concrete.roads, "roads.xodr", ""
    )[:2]
    assert not lost
    text = to_xml(concrete.storyboard)
    assert to_xml(openscenario_from_owl(found, "roads.xodr")) == text
    assert b"bridge" not in text.split(b"<Storyboard>")[1]  # no body of the scenario
    program = pipeline.runner.embedded.program
    assert program.names == ("ego", "rear")
    assert [program.slots[i] for i in program.tracker] == (
        [2.0, 1.5, 0.5, 2.0, 4.0, 0.5] if said == TRACKER else []
    )
    approve(" ".join(story_lines(pipeline.scenario)))


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
        ("    at: bridge_at\n", "    mirrors: rear\n", ("bridge", "aside")),
        ("    at: bridge_at\n", "    mirrors: nobody\n    aside: 2.5\n", ("nobody",)),
        (GHOSTS, TRACKER.replace("of: 4", "of: 1"), ("confirm <= of", "2")),
        (GHOSTS, TRACKER.replace("of: 4", "of: 40"), ("tracker.of", "40", "30")),
        (GHOSTS, TRACKER.replace("range: 1.5, ", ""), ("angle", "range")),
        (GHOSTS, TRACKER.replace("1.5", "-1.5"), ("tracker.range [m]", "-1.5")),
    ],
)
def test_a_scenario_file_that_says_it_wrongly_is_refused(made, old, new, named):
    with refuses(InputError, *named):
        made(GHOSTS.replace(old, new))


@pytest.mark.parametrize(
    ("old", "new", "named"),
    [
        ("ghost.bridge.type", "ghost.bridge.kind", ("kind",)),
        ("ghost.bridge.at", "ghost.bridge.rate2", ("rate2",)),
        ('name="ghost.bridge.type" value="car"', 'name="ghost.bridge.type" value="x"', ("'x'",)),
        ('value="$vanishes"', 'value="-4"', ("ghost.bridge.vanishes [m]", "-4")),
        ('value="$vanishes"', 'value="soon"', ("ghost.bridge.vanishes [m]", "soon")),
        ('"ghost.bridge.vanishes"', '"tracker.vanishes"', ("tracker.vanishes", "coast")),
        (
            'name="ghost.bridge.vanishes" value="$vanishes"',
            'name="tracker.extent" value="1.5"',
            ("tracker.extent [1]", "1.5"),
        ),
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
