"""r_red by hand; iou, e_position and map against shapely and a plain reading of nuScenes."""

from dataclasses import replace
from fractions import Fraction
from math import cos, hypot, pi, sin

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from tests.approval import refuses

from bridgegen.assess.metrics import perception as perceived
from bridgegen.assess.metrics.perception import e_position, iou, mean_average_precision
from bridgegen.assess.metrics.road import r_red
from bridgegen.drivers import kinds
from bridgegen.drivers.kinds import BOTH, MISSED, NO_FRAME

# r_red. The ego drives along +x; its front bumper is 2 m ahead of its reference point.

RED, RED_YELLOW, YELLOW, GREEN = 1, 2, 3, 4


def past_a_light(rollout_of, states, line=(7.0, 0.0, 0.0), x=(0.0, 2.0, 4.0, 6.0, 8.0), **more):
    """The front is at 2, 4, 6, 8, 10 m; the line at 7 m."""
    settings = {"stop_lines": [[line]], "stop_lights": [0], "light_names": ["a"], **more}
    return rollout_of(x=[[list(x)]], v=[[[40.0] * len(x)]], lights=[[states]], **settings)


@pytest.mark.parametrize(
    ("states", "expected"),
    [
        ((RED,) * 5, 1),
        ((GREEN,) * 5, 0),
        ((GREEN, GREEN, RED, GREEN, GREEN), 1),  # red while the bumper is between 6 and 8 m
        ((RED, RED, GREEN, RED, RED), 0),
        ((RED, RED, RED_YELLOW, GREEN, GREEN), 1),  # not yet green
        ((GREEN, GREEN, YELLOW, RED, RED), 0),
        ((0,) * 5, 0),  # switched off
    ],
)
def test_the_light_counts_while_the_bumper_crosses(rollout_of, states, expected):
    assert r_red(past_a_light(rollout_of, states)) == [expected]


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ((7.0, 3.4, 0.0), 1),  # the line of our lane
        ((7.0, 3.6, 0.0), 0),  # another lane's
        ((7.0, 0.0, pi), 0),  # from behind: the line of those who come towards us
        ((7.0, 0.0, 0.3), 1),
        ((10.5, 0.0, 0.0), 0),  # not reached
        ((1.5, 0.0, 0.0), 0),  # crossed before it all began
        ((10.0, 0.0, 0.0), 0),  # reached, and no farther
        ((8.0, 0.0, 0.0), 1),
    ],
)
def test_where_the_line_is(rollout_of, line, expected):
    assert r_red(past_a_light(rollout_of, (RED,) * 5, line)) == [expected]


def test_a_light_counts_once(rollout_of):
    there_and_back = (0.0, 4.0, 6.0, 4.0, 6.0)
    assert r_red(past_a_light(rollout_of, (RED,) * 5, x=there_and_back)) == [1.0]
    lines = [[(5.0, 0, 0), (7.0, 0, 0)]]
    same = past_a_light(rollout_of, (RED,) * 5, stop_lines=lines, stop_lights=[0, 0])
    assert r_red(same) == [1.0]
    other = replace(same, lights=np.ones((1, 2, 5), np.int8), stop_lights=np.array([0, 1]))
    assert r_red(other) == [2.0]


def test_without_lights_none_is_run(rollout_of):
    assert r_red(rollout_of(x=[[[0.0, 9.0]]])) == [0.0]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"stop_lights": np.array([1])}, "stop_lights"),
        ({"stop_lights": np.array([-1])}, "stop_lights"),
        (
            {
                "stop_lights": np.array([0, 1]),
                "stop_lines": np.zeros((1, 2, 3)),
                "stop_entities": np.zeros(2, np.int64),
            },
            "stop_lights",
        ),
        ({"stop_lines": np.zeros((1, 2, 3))}, "stop_lines"),
        ({"stop_lines": np.full((1, 1, 3), np.nan)}, "stop_lines"),
        ({"lights": np.zeros((1, 1, 2), np.int8)}, "lights"),
    ],
)
def test_malformed_stop_lines(rollout_of, change, message):
    with refuses(ValueError, message):
        r_red(replace(past_a_light(rollout_of, (RED,) * 5), **change))


# Detections, by hand. The other is 4 m × 2 m about its reference point, 20 m ahead.


def seen(rollout_of, *frames, other=20.0, kinds_=(0, 0)):
    """One row, one other; a frame is None, or (seen by, x, y, h, length, width, sure, kind)."""
    t = len(frames)
    rows = [(NO_FRAME, *(0.0,) * 7) if frame is None else frame for frame in frames]
    detections = np.zeros((1, 2, t, 8))
    detections[0, 1] = rows
    x = [[0.0] * t, [other] * t]
    return rollout_of(x=[x], kinds=kinds_, detections=detections)


EXACT = (BOTH, 20.0, 0.0, 0.0, 4.0, 2.0, 0.9, 0)
MISSED_DETECTION = (MISSED, *(0.0,) * 7)


def off_by(dx, dy=0.0, **more):
    frame = list(EXACT)
    frame[1] += dx
    frame[2] += dy
    for name, value in more.items():
        frame[("seen", "x", "y", "h", "length", "width", "sure", "kind").index(name)] = value
    return tuple(frame)


def test_iou_by_hand(rollout_of):
    assert iou(seen(rollout_of, EXACT)) == [1.0]
    assert iou(seen(rollout_of, off_by(2.0))) == pytest.approx([4 / 12])
    assert iou(seen(rollout_of, off_by(0.0, h=pi / 2))) == pytest.approx([4 / 12])
    assert iou(seen(rollout_of, off_by(0.0, h=pi))) == pytest.approx([1.0])
    assert iou(seen(rollout_of, off_by(9.0))) == [0.0]
    assert iou(seen(rollout_of, off_by(4.0))) == [0.0]  # edge to edge
    assert iou(seen(rollout_of, EXACT, None, MISSED_DETECTION, None)) == [0.5]
    assert iou(seen(rollout_of, None, None)) == [np.inf]


def test_e_position_by_hand(rollout_of):
    assert e_position(seen(rollout_of, off_by(3.0, 4.0), None, EXACT, MISSED_DETECTION)) == [2.5]
    assert e_position(seen(rollout_of, MISSED_DETECTION)) == [0.0]


@pytest.mark.parametrize(
    ("kind", "distance", "counts"),
    [
        (kinds.CAR, 49.9, True), (kinds.CAR, 50.0, False), (kinds.BUS, 49.9, True),
        (kinds.PEDESTRIAN, 39.9, True), (kinds.PEDESTRIAN, 40.1, False),
        (kinds.BICYCLE, 40.1, False), (kinds.OTHER, 29.9, True), (kinds.ANIMAL, 30.1, False),
    ],
)  # fmt: skip
def test_what_is_too_far_does_not_count(rollout_of, kind, distance, counts):
    rollout = seen(rollout_of, MISSED_DETECTION, other=distance, kinds_=(0, kind))
    expected = 0.0 if counts else np.inf
    assert iou(rollout) == [expected]
    assert mean_average_precision(rollout) == [expected]


def test_map_by_hand(rollout_of):
    assert mean_average_precision(seen(rollout_of, EXACT, EXACT)) == pytest.approx([1.0])
    assert mean_average_precision(seen(rollout_of, MISSED_DETECTION, MISSED_DETECTION)) == [0.0]
    # 1.5 m off: a hit by 2 m and 4 m.
    assert mean_average_precision(seen(rollout_of, off_by(1.5))) == pytest.approx([0.5])
    assert mean_average_precision(seen(rollout_of, off_by(0.0, kind=kinds.PEDESTRIAN))) == [0.0]
    # A truck taken for a bus is a heavy vehicle all the same.
    truck = seen(rollout_of, off_by(0.0, kind=kinds.BUS), kinds_=(0, kinds.TRUCK))
    assert mean_average_precision(truck) == pytest.approx([1.0])


def test_half_of_the_frames_missed(rollout_of):
    """Precision 1 up to recall 0.5: of the 90 recalls 0.11 … 1, the 40 up to 0.5 count fully."""
    rollout = seen(rollout_of, EXACT, MISSED_DETECTION)
    assert mean_average_precision(rollout) == pytest.approx([40 / 90])


HALF = (39 + (0.5 - 0.1) / 0.9) / 90
"""Average precision of a hit and then a mistake, where two boxes are to be found."""


def test_a_confident_mistake_costs_more_than_a_diffident_one(rollout_of):
    def with_confidences(right, wrong):
        return mean_average_precision(
            seen(rollout_of, off_by(0.0, sure=right), off_by(9.0, sure=wrong))
        )

    # The mistake last: precision 1 up to recall 0.5, where it drops to 1/2.
    assert with_confidences(0.9, 0.1) == pytest.approx([HALF])
    # First: 1/2 at recall 0.5, from 0 at 0.
    rising = sum(max(0.5 * r / 50 - 0.1, 0.0) for r in range(11, 51)) / 90 / 0.9
    assert with_confidences(0.1, 0.9) == pytest.approx([rising])


def test_the_best_of_two_detections_takes_the_box(rollout_of):
    """Two cars; both detections lie at the first: the second one finds no box left within 2 m."""
    detections = np.zeros((1, 3, 1, 8))
    detections[0, 1, 0] = (BOTH, 20.0, 0.0, 0, 4, 2, 0.9, 0)
    detections[0, 2, 0] = (BOTH, 20.3, 0.0, 0, 4, 2, 0.8, 0)
    rollout = rollout_of(x=[[[0.0], [20.0], [23.0]]], kinds=[0, 0, 0], detections=detections)
    # By 0.5, 1 and 2 m the second is a mistake; by 4 m both hit.
    assert mean_average_precision(rollout) == pytest.approx([(3 * HALF + 1) / 4])


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"kinds": np.array([0])}, "kinds"),
        ({"kinds": np.array([0, len(kinds.NAMES)])}, "kinds"),
        ({"detections": np.zeros((1, 1, 1, 8))}, "detections"),
        (
            {"detections": np.full((1, 2, 1, 8), np.nan)},
            "detections",
        ),
    ],
)
@pytest.mark.parametrize("metric", [iou, e_position, mean_average_precision])
def test_malformed_detections(rollout_of, metric, change, message):
    with refuses(ValueError, message):
        metric(replace(seen(rollout_of, EXACT), **change))


# Against shapely.


def polygon(x, y, h, length, width):
    c, s = cos(h), sin(h)
    corners = [(0.5 * i * length, 0.5 * j * width) for i, j in ((1, 1), (-1, 1), (-1, -1), (1, -1))]
    return shapely.Polygon([(x + p * c - q * s, y + p * s + q * c) for p, q in corners])


near = st.floats(-6, 6)
sizes = st.floats(0.3, 12)
turns = st.sampled_from([0.0, pi / 2, pi, 1e-9]) | st.floats(-7, 7)


@given(near, near, turns, turns, sizes, sizes, sizes, sizes, st.floats(-2, 2))
def test_iou_agrees_with_shapely(rollout_of, dx, dy, h, turn, la, wa, lb, wb, ahead):
    centre = (20.0 + ahead * cos(h), ahead * sin(h))
    detections = np.zeros((1, 2, 1, 8))
    detections[0, 1, 0] = (BOTH, centre[0] + dx, centre[1] + dy, h + turn, lb, wb, 1.0, 0)
    rollout = rollout_of(
        x=[[[0.0], [20.0]]], h=[[[0.0], [h]]], box=[(4.0, 2.0, 0.0), (la, wa, ahead)],
        kinds=[0, 0], detections=detections,
    )  # fmt: skip
    a = polygon(*centre, h, la, wa)
    b = polygon(centre[0] + dx, centre[1] + dy, h + turn, lb, wb)
    expected = a.intersection(b).area / a.union(b).area
    assert iou(rollout) == pytest.approx([expected], abs=1e-7)


# Against a plain reading of the definitions.


def frames(rollout, i):
    """Per instant with a frame: the ego's place, the others' true boxes, and the detections."""
    for k in range(rollout.n_steps[i]):
        rows = []
        for e in range(1, rollout.shape[1]):
            if rollout.detections[i, e, k, 0] < 0:
                continue
            h = rollout.h[i, e, k]
            length, width, ahead = rollout.box[e]
            x, y = rollout.x[i, e, k] + ahead * cos(h), rollout.y[i, e, k] + ahead * sin(h)
            truth = (x, y, h, length, width, int(rollout.kinds[e]))
            rows.append((truth, rollout.detections[i, e, k]))
        if rows:
            yield (rollout.x[i, 0, k], rollout.y[i, 0, k]), rows


CLASS = {0: 0, 1: 1, 2: 1, 3: 2, 4: 2, 5: 3, 6: 4, 7: 4}
RANGE = {0: 50, 1: 50, 2: 40, 3: 40, 4: 30}


def test_the_classes_are_those_of_the_oracle():
    assert dict(enumerate(perceived.CLASS_OF_KIND[: len(CLASS)].tolist())) == CLASS
    assert dict(enumerate(perceived.RANGES.tolist())) == RANGE


def plain_precision(predictions, boxes, threshold):
    """Average precision; a prediction is (confidence, frame, error, x, y), a box (frame, x, y)."""
    hits, taken = [], set()
    for _, frame, _, x, y in sorted(predictions, key=lambda p: (-p[0], p[1], p[2])):
        off = [
            (hypot(x - bx, y - by), j)
            for j, (box_frame, bx, by) in enumerate(boxes)
            if box_frame == frame and j not in taken
        ]
        best = min(off, default=(np.inf, -1))
        hits.append(best[0] < threshold)
        if hits[-1]:
            taken.add(best[1])
    if not hits:
        return 0.0
    tp = np.cumsum(hits)
    precision = tp / np.arange(1, len(hits) + 1)
    recall = [Fraction(int(n), len(boxes)) for n in tp]
    total = 0.0
    for percent in range(11, 101):
        r = Fraction(percent, 100)
        below = [j for j, value in enumerate(recall) if value <= r]
        if not below:
            found = precision[0]
        elif recall[below[-1]] == r:
            found = precision[below[-1]]
        elif below[-1] + 1 == len(recall):
            found = 0.0
        else:
            j = below[-1]
            share = float((r - recall[j]) / (recall[j + 1] - recall[j]))
            found = precision[j] + share * (precision[j + 1] - precision[j])
        total += max(found - 0.1, 0.0) / 0.9
    return total / 90


def plain(rollout, i):
    overlaps, errors = [], []
    boxes, predictions = ({c: [] for c in RANGE} for _ in range(2))
    for number, ((ex, ey), rows) in enumerate(frames(rollout, i)):
        for truth, found in rows:
            x, y, *_, kind = truth
            error = hypot(found[1] - x, found[2] - y)
            if hypot(x - ex, y - ey) < RANGE[CLASS[kind]]:
                boxes[CLASS[kind]].append((number, x, y))
                if found[0] > 0:
                    a, b = polygon(*truth[:5]), polygon(*found[1:6])
                    overlaps.append(a.intersection(b).area / a.union(b).area)
                    errors.append(error)
                else:
                    overlaps.append(0.0)
            c = CLASS[int(found[7])]
            if found[0] > 0 and hypot(found[1] - ex, found[2] - ey) < RANGE[c]:
                predictions[c].append((found[6], number, error, found[1], found[2]))
    precisions = [
        plain_precision(predictions[c], boxes[c], threshold)
        for c in RANGE
        if boxes[c]
        for threshold in (0.5, 1, 2, 4)
    ]
    return (
        np.mean(overlaps) if overlaps else np.inf,
        np.mean(errors) if errors else 0.0,
        np.mean(precisions) if precisions else np.inf,
    )


@pytest.mark.parametrize(("shape", "within"), [((25, 2, 60), 15), ((12, 8, 30), 40)])
def test_agrees_with_a_plain_reading(driven, shape, within):
    rollout = driven(*shape, seed=shape[1], within=within)
    got = np.column_stack([f(rollout) for f in (iou, e_position, mean_average_precision)])
    expected = np.array([plain(rollout, i) for i in range(shape[0])])
    np.testing.assert_allclose(got, expected, rtol=1e-9, atol=1e-12)
    assert len(set(np.round(expected[:, 2], 3))) > 5
