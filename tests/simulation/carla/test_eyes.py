"""Cameras, LiDARs, and detectors of the user's."""

import csv
import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.approval import refuses

from bridgegen.adapters.carla.sensors import Truth, matched
from bridgegen.adapters.carla.view import View, overlap
from bridgegen.assess import metrics
from bridgegen.base.errors import InputError
from bridgegen.drivers.detector import Boxes, checked, load
from bridgegen.drivers.kinds import CAR
from bridgegen.engine.options import PipelineOptions
from bridgegen.engine.pipeline import Pipeline
from bridgegen.scenario.language.reader import load as logical_of
from bridgegen.simulation.choice import SimulatorChoice

HERE = Path(__file__).with_name("detectors.py")
VIEW = View(800, 600, math.radians(90.0), (1.4, 0.0, 1.8))


def test_what_a_camera_sees_by_hand():
    """90° and 800 pixels: a focal length of 400. A cube of 2 m, 10 m ahead, 1 m to the left."""
    outline = VIEW.outline(np.array([1.4 + 11.0, 1.0, 1.0, 2.0, 2.0, 2.0, 0.0]))
    # Nearest face: 10 m ahead, from 2 m left to 0; 1.8 m below the camera to 0.2 m above.
    np.testing.assert_allclose(outline, [400 - 400 * 0.2, 300 - 400 * 0.02, 400, 300 + 400 * 0.18])
    assert VIEW.foot(outline) == pytest.approx((1.4 + 10.0, 1.0))
    assert VIEW.outline(np.array([-5.0, 0.0, 1.0, 2.0, 2.0, 2.0, 0.0])) is None


@given(ahead=st.floats(6.0, 80.0), aside=st.floats(-4.0, 4.0))
def test_the_foot_of_a_box_is_where_it_stands(ahead, aside):
    """Of a plate that faces the camera, whose lower edge is on the road."""
    outline = VIEW.outline(np.array([ahead, aside, 0.75, 1e-6, 1.0, 1.5, 0.0]))
    assert outline is not None
    assert VIEW.foot(outline) == pytest.approx((ahead, aside), abs=1e-4)


def test_above_the_horizon_nothing_stands():
    assert VIEW.foot(np.array([10.0, 10.0, 20.0, 250.0])) is None


@given(st.lists(st.floats(0, 100), min_size=8, max_size=8))
def test_overlap_is_shapelys(edges):
    from shapely.geometry import box

    one, other = np.array(edges[:4]), np.array(edges[4:])
    one, other = (
        np.array([*np.minimum(b[:2], b[2:]), *np.maximum(b[:2], b[2:])]) for b in (one, other)
    )
    a, b = box(*one), box(*other)
    union = a.union(b).area
    expected = a.intersection(b).area / union if union > 1e-9 else 0.0
    if union > 1e-6:
        assert overlap(one, other) == pytest.approx(expected, abs=1e-6)


def truth_of(*others):
    states = np.array([[0.0, 0.0, 0.0, 10.0], *others])
    n = len(states)
    size = np.tile([4.6, 1.9, 1.5], (n, 1))
    return Truth(states, np.ones(n, bool), np.tile([4.6, 1.9, 1.4], (n, 1)), size)


def test_boxes_in_space_stand_for_the_nearest():
    truth = truth_of((20.0, 3.0, 0.0, 5.0), (30.0, 0.0, 0.0, 5.0))
    boxes = [[31.9, 0.2, 0.8, 4.0, 1.8, 1.5, 0.1], [21.0, 3.0, 0.8, 4.6, 1.9, 1.5, 0.0],
             [90.0, 0.0, 0.8, 4.6, 1.9, 1.5, 0.0]]  # fmt: skip
    rows = matched(checked(Boxes([CAR] * 3, [0.5, 0.9, 1.0], boxes=boxes)), truth, VIEW)
    np.testing.assert_allclose(rows[2], [1, 31.9, 0.2, 0.1, 4.0, 1.8, 0.5, CAR])
    np.testing.assert_allclose(rows[1, :3], [1, 21.0, 3.0])
    assert not rows[0].any()


def test_boxes_in_the_image_are_as_far_off_as_their_feet():
    truth = truth_of((20.0, 3.0, 0.4, 5.0))
    outline = VIEW.outline(truth.seen(1))
    exact = matched(checked(Boxes([CAR], [1.0], pixels=[outline])), truth, VIEW)
    np.testing.assert_allclose(exact[1, 1:3], truth.middle(1))
    np.testing.assert_allclose(exact[1, 3:6], [0.4, 4.6, 1.9])
    moved = outline + np.array([10, 0, 10, 0])
    aside = matched(checked(Boxes([CAR], [1.0], pixels=[moved])), truth, VIEW)
    foot = VIEW.foot(outline)
    assert aside[1, 2] == pytest.approx(truth.middle(1)[1] - 10.0 * (foot[0] - 1.4) / VIEW.focal)
    nobody = matched(checked(Boxes([CAR], [1.0], pixels=[[0, 0, 30, 30]])), truth, VIEW)
    assert not nobody.any()


@pytest.mark.parametrize(
    ("answer", "text"),
    [
        (None, "return"),
        (Boxes([CAR], [0.5]), "pixels"),
        (Boxes([CAR], [0.5], boxes=[[0] * 7], pixels=[[0] * 4]), "not both"),
        (Boxes([CAR], [1.5], pixels=[[0, 0, 1, 1]]), "confidence"),
        (Boxes([99], [0.5], pixels=[[0, 0, 1, 1]]), "kinds"),
        (Boxes([CAR], [0.5], pixels=[[0, 0, np.nan, 1]]), "finite"),
        (Boxes([CAR, CAR], [0.5], pixels=[[0, 0, 1, 1]]), "shape"),
        (Boxes([CAR], [0.5], boxes=[[1, 1, 1, 0, 1, 1, 0]]), "must be > 0"),
    ],
)
def test_answers_of_unsound_form(answer, text):
    with refuses(ValueError, text):
        checked(answer)


@pytest.mark.parametrize(
    ("spec", "text"),
    [
        ("detectors", "module"),
        ("no.such.module:X", "imported"),
        (f"{HERE}:Nobody", "Nobody"),
        (f"{HERE}:Lacks", "lacks reset"),
    ],
)
def test_what_is_no_detector(spec, text):
    with refuses(InputError, text):
        load(spec)


def watched(machine, scenario="lead-brakes", ego="kinematic", **access):
    logical = logical_of(scenario)
    given = {"--port": machine.port, **{f"--{name}": one for name, one in access.items()}}
    choice = SimulatorChoice("carla", {"ego": ego, "sensor_period": 0.5}, given)
    return Pipeline(
        logical, logical.space(), PipelineOptions(ego="route-follower"), simulator=choice
    )


@pytest.mark.parametrize("name", ["SeesRed", "SeesCorners"])
def test_a_perfect_detector_is_measured_as_one(machine, name):
    """Of what it sees; the stand-in's camera sees what is ahead, its LiDAR everything."""
    pipeline = watched(machine, detector=f"{HERE}:{name}")
    assert {"iou", "e_position", "map"} <= {*pipeline.metrics}
    rollout = pipeline.rollout(pipeline.space.row({})[np.newaxis])
    assert rollout.status[0] == 0, rollout.messages
    n = int(rollout.n_steps[0])
    frames = np.flatnonzero(rollout.detections[0, 1, :n, 0] >= 0)
    assert set(np.diff(frames)) == {10}
    seen = rollout.detections[0, 1, frames, 0] == 1
    travelled = np.hypot(*(one[0, 1] - one[0, 0] for one in (rollout.x, rollout.y)))[frames]
    ahead = (rollout.x[0, 1] - rollout.x[0, 0]) * np.cos(rollout.h[0, 0]) + (
        rollout.y[0, 1] - rollout.y[0, 0]
    ) * np.sin(rollout.h[0, 0])
    visible = ahead[frames] > 8.0
    assert visible.sum() > 5
    assert seen[visible].all()
    assert name == "SeesCorners" or not seen[(ahead[frames] < 0.0) & (travelled > 8.0)].any()
    error, share = metrics.evaluate(rollout, ("e_position", "iou"))[0]
    assert error < (0.5 if name == "SeesRed" else 0.05)  # a pixel is 2 m, 40 m away
    if name == "SeesCorners":  # of the models, which are larger than the scenario's boxes
        assert share > 0.7
        assert metrics.evaluate(rollout, ("map",))[0, 0] > 0.9


def test_without_a_detector_there_is_nothing_to_measure(machine):
    assert "iou" not in watched(machine).metrics


@pytest.mark.parametrize(
    ("name", "status", "text"),
    [("Raises", 20, "OSError: no weights"), ("Nonsense", 23, "confidence must be in 0 to 1")],
)
def test_a_detector_that_fails_costs_the_row(machine, name, status, text):
    pipeline = watched(machine, detector=f"{HERE}:{name}")
    rollout = pipeline.rollout(pipeline.space.row({})[np.newaxis])
    assert rollout.status[0] == status
    assert text in rollout.messages[0]
    assert not [one for one in machine.actors.values() if one.type_id != "traffic.traffic_light"]


def test_what_is_recorded(machine, tmp_path):
    pipeline = watched(machine, record=str(tmp_path / "seen"))
    rollout = pipeline.rollout(np.repeat(pipeline.space.row({})[np.newaxis], 2, axis=0))
    folders = sorted((tmp_path / "seen").iterdir())
    assert [one.name for one in folders] == ["000001", "000002"]
    n = int(rollout.n_steps[0])
    images = sorted(one.name for one in (folders[0] / "camera").iterdir())
    assert len(images) in ((n - 1) // 10, (n - 1) // 10 + 1)
    scans = sorted(one.stem for one in (folders[0] / "lidar").iterdir())
    assert scans == [one.removesuffix(".png") for one in images]
    assert (folders[0] / "trace.csv").exists()
    assert (folders[0] / "incidents.csv").read_text().startswith("frame,time,kind,what")
    with (folders[0] / "boxes.csv").open() as file:
        boxes = list(csv.DictReader(file))
    assert len(boxes) == len(images) * (len(rollout.names) - 1)
    k = int(boxes[3]["frame"])
    pixels = np.frombuffer((folders[0] / "camera" / f"{k:06}.png").read_bytes(), np.uint8)
    red = pixels.reshape(600, 800, 4)[:, :, 2] == 255
    v, u = np.nonzero(red)
    drawn = [u.min(), v.min(), u.max() + 1, v.max() + 1]
    told = [float(boxes[3][name]) for name in ("left", "top", "right", "bottom")]
    np.testing.assert_allclose(drawn, told, atol=1.0)


def test_a_folder_that_is_used_is_not_recorded_to(machine, tmp_path):
    (tmp_path / "x").write_text("")
    with refuses(InputError):
        watched(machine, record=str(tmp_path))
