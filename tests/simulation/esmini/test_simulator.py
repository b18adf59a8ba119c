"""Rows by esmini itself, where there is its library; what every simulator must do is elsewhere."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from bridgegen.engine.options import PipelineOptions
from bridgegen.engine.pipeline import Pipeline
from bridgegen.engine.simulate import simulate_file
from bridgegen.openx.opendrive.write import to_xml
from bridgegen.scenario.language.adversary import adversarial
from bridgegen.scenario.language.reader import load, shipped_text

from ..embedded.storyboards import crossroads, lane, scenario, start

pytestmark = pytest.mark.esmini


def both(logical, esmini, n=4, **options):
    """Return pipelines with the embedded simulator and with esmini, and rows."""
    space = logical.space()
    here = Pipeline(logical, space, PipelineOptions(**options))
    there = Pipeline(logical, space, PipelineOptions(**options), simulator=esmini)
    return here, there, space.decode(np.random.default_rng(4).random((n, space.n_var)))


@pytest.mark.parametrize("name", ["crossroads-s1", "crossroads-s4", "cut-in"])
def test_it_is_as_here(esmini, name):
    """esmini moves by the speed at a step's end: half a step of the change of speed."""
    here, there, X = both(load(name), esmini, ego="route-follower")
    expected, got = here.rollout(X), there.rollout(X)
    assert got.status.tolist() == [0] * 4, got.messages
    np.testing.assert_array_equal(got.n_steps, expected.n_steps)
    np.testing.assert_array_equal(got.began, expected.began)
    np.testing.assert_allclose(got.v, expected.v, atol=1e-9)
    np.testing.assert_allclose(got.x, expected.x, atol=0.3)
    np.testing.assert_allclose(got.y, expected.y, atol=0.3)


def test_traffic_on_the_left_is_the_mirror_image(esmini, tmp_path):
    """esmini runs the files, which are mirrored; what it moves is mirrored back."""
    text = shipped_text("cut-in").decode().replace("others: attentive", "others: scripted")
    found = []
    for key in ("", "traffic: left\n"):
        path = tmp_path / "cut-in.yaml"
        path.write_text(f"{text}\n{key}")
        here, there, X = both(load(path), esmini, ego="route-follower")
        found.append(there.rollout(X))
    right, left = found
    assert left.left_hand
    assert left.status.tolist() == [0] * 4, left.messages
    assert (left.x != here.rollout(X).x).any()  # esmini has moved somebody
    for name in ("x", "y", "h", "v"):
        np.testing.assert_allclose(getattr(left, name), getattr(right, name), atol=1e-9)


def test_courses_reach_it(esmini):
    """Each row's trajectory is written into the file: places at its times are exact."""
    logical = adversarial(load("cut-in"), "bv")
    here, there, X = both(logical, esmini, n=3, ego="route-follower")
    expected, got = here.rollout(X), there.rollout(X)
    assert got.status.tolist() == [0] * 3, got.messages
    assert np.ptp(expected.x[:, 1, 200]) > 1.0  # they differ
    np.testing.assert_allclose(got.x, expected.x, atol=1e-6)
    np.testing.assert_allclose(got.y, expected.y, atol=1e-6)
    np.testing.assert_allclose(got.h, expected.h, atol=0.05)


def test_threads_give_the_same_bits(esmini):
    _, there, X = both(load("crossroads-s4"), esmini, n=6, ego="reference")
    whole = there.rollout(X)
    with ThreadPoolExecutor(3) as pool:
        parts = list(pool.map(lambda i: there.rollout(X[i : i + 2]), (4, 0, 2)))
    for part, i in zip(parts, (4, 0, 2), strict=True):
        for name in ("x", "y", "h", "v", "a", "n_steps", "began"):
            assert (getattr(part, name) == getattr(whole, name)[i : i + 2]).all(), name


def test_causes_are_found_by_replays_there(esmini):
    here, there, X = both(load("crossroads-s2"), esmini, n=6, ego="reference", causes=True)
    for pipeline in (here, there):
        pipeline.choose_objective()
    expected, got = here.evaluate(X), there.evaluate(X)
    assert expected.critical.any()
    np.testing.assert_array_equal(got.critical, expected.critical)
    np.testing.assert_array_equal(got.cause, expected.cause)


def test_what_it_does_not_take_is_told_in_its_words(esmini):
    _, there, X = both(load("crossroads-s1"), esmini, n=2, ego="route-follower")
    roads, rows = there.runner.roads_of(X)
    columns = {name: X[:, i] for i, name in enumerate(there.space.names)}
    whole = roads.files.paths[0].read_bytes()
    roads.files.paths[0].write_text("<OpenDRIVE><road")
    out = there.runner.simulator.run(roads, rows, columns)
    assert out.status.tolist() == [40, 40]
    assert "esmini did not take the scenario" in out.messages[0]
    assert "OpenDRIVE" in out.messages[0]
    assert np.isfinite(out.x).all()
    roads.files.paths[0].write_bytes(whole)
    assert there.runner.simulator.run(roads, rows, columns).status.tolist() == [0, 0]


def test_a_file_runs_in_it(esmini, tmp_path, cli):
    ego = start("ego", lane(3, 1, 80.0), 10.0, lane(3, 1, 80.0), lane(1, -1, 90.0))
    file = tmp_path / "one.xosc"
    file.write_text(scenario(("ego",), ego))
    (tmp_path / "map.xodr").write_bytes(to_xml(crossroads()))
    here, there = simulate_file(file), simulate_file(file, simulator=esmini)
    assert there.status == "ok"
    assert there.seconds == here.seconds
    np.testing.assert_allclose(there.rollout.y, here.rollout.y, atol=1e-3)
    status, out, _ = cli("simulate", file, "--simulator", "esmini", "--ego", "reference")
    assert status == 0
    assert "ego reference" in out
