"""The pack ncap-aeb: the protocol's numbers of rows, and the impact that each row intends."""

import re
from functools import lru_cache

import numpy as np
import pytest

from bridgegen.assess.metrics.impact import first_contact
from bridgegen.engine.options import PipelineOptions
from bridgegen.engine.pipeline import Pipeline
from bridgegen.jobs.suite.rows import rows_of
from bridgegen.scenario.language.reader import load, pack_names

read = lru_cache(load)
NAMES = [name for name in pack_names() if name.startswith("ncap-aeb/")]
FRONT, WIDTH, LENGTH = 3.528, 1.815, 4.358  # of the ego, from its rear axle

CELLS = {
    "ccrs": (75, 40, 16), "ccrm": (55, 55, 22), "ccrb": (4, 30, 47), "ccfhos": (2, 18, 14),
    "ccfhol": (2, 18, 14), "ccftap": (9, 9, 7), "cccscp": (0, 50, 0), "cccscp-open": (0, 0, 16),
    "cmrs": (0, 24, 16), "cmrb": (0, 18, 37), "cmftap": (9, 9, 7), "cmcscp": (0, 50, 0),
    "cmcscp-open": (0, 0, 16), "cpna": (44, 36, 24), "cpfa": (22, 12, 48), "cpnco": (22, 12, 24),
    "cpla": (32, 20, 60), "cbla": (15, 9, 27), "cbna": (11, 12, 18), "cbfa": (11, 12, 18),
    "cbnao": (11, 12, 18), "cpta-fs": (3, 3, 17), "cpta-fo": (3, 3, 17), "cpta-ns": (0, 1, 4),
    "cpta-no": (1, 1, 4), "cbta-fo": (0, 3, 17), "cbta-no": (0, 1, 2),
}  # fmt: skip
"""Grid cells by the protocols' tables: of 2023, of 2026's standard and extended ranges. Those of
crossing vehicles count twice, for either side."""

POINTS = {
    "cc": 1.35 + 2.7 + 1.8 + 2.25 + 2.25 + 4.5 + 6.75, "cm": 1.35 + 1.8 + 4.5 + 6.75,
    "cp": 2.25 + 2.25 + 4.5, "cb": 2.25 + 4.5 + 1.0 + 0.125,
}  # fmt: skip
"""Crash Avoidance, Frontal Collisions, 1.1, tables 3.1.1 to 3.2.3: standard and extended range."""


def test_the_pack_has_each_cell_of_the_matrices():
    found = {}
    for name in NAMES:
        matrix = read(name).matrix
        parts = (
            [one for one in matrix if one.edition == "2023"],
            [one for one in matrix if one.edition == "2026" and one.graded],
            [one for one in matrix if one.edition == "2026" and not one.graded],
        )
        found[name.removeprefix("ncap-aeb/")] = tuple(sum(map(len, some)) for some in parts)
    assert found == CELLS


def test_grids_are_worth_the_protocol_s_points():
    found = dict.fromkeys(POINTS, 0.0)
    for name in NAMES:
        points = sum(one.points for one in read(name).matrix if one.edition == "2026")
        found[name.removeprefix("ncap-aeb/")[:2]] += points
    assert found == pytest.approx(POINTS, abs=2e-5)


@pytest.mark.parametrize("name", NAMES)
def test_a_scenario_names_its_protocol_and_section(name):
    scenario = read(name)
    assert scenario.name == name.replace("/", "-")
    assert re.search(r"Euro NCAP, Crash Avoidance.* section 3\.", scenario.source)
    for grid in scenario.matrix:
        assert re.search(r"^(Crash Avoidance.*3\.|AEB)", grid.source)


@lru_cache
def contacts(name):
    """Each matrix row's first contact with an ego that keeps its speed: as a dict of columns."""
    scenario = read(name)
    space = scenario.space()
    rows = rows_of(scenario, space, 0, 0)
    assert rows.excluded == 0
    pipeline = Pipeline(scenario, space, PipelineOptions(ego="route-follower"))
    found = []
    for at, one in pipeline.runner.by_variant(rows.X):
        rollout = one.run(rows.X[at])
        touching, instant = first_contact(rollout)
        assert (rollout.status == 0).all()
        for i, (who, k) in enumerate(zip(touching, instant, strict=True)):
            assert k >= 0, rows.X[at][i]
            (other,) = np.flatnonzero(who)
            x, y, h, v = (a[i, :, k] for a in (rollout.x, rollout.y, rollout.h, rollout.v))
            dx, dy = x[other] - x[0], y[other] - y[0]
            ahead, left = (
                dx * np.cos(h[0]) + dy * np.sin(h[0]),
                -dx * np.sin(h[0]) + dy * np.cos(h[0]),
            )
            row = dict(zip(space.names, rows.X[at][i], strict=True))
            found.append(
                (row, rollout.names[other], ahead - FRONT, left, h[other] - h[0], v[[0, other]], k)
            )
    return found, rollout.time_step


TARGETS = {"target", "pedestrian", "bicyclist"}


@pytest.mark.parametrize("name", NAMES)
def test_without_a_reaction_the_ego_hits_its_target_at_its_first_speed(name):
    found, _ = contacts(name)
    for row, who, _, _, _, v, _ in found:
        assert who in TARGETS
        slack = 0.6 if "cpta" in name else 0.0  # at 25 km/h it slows down for the bend
        assert v[0] == pytest.approx(row["ego_speed"], abs=1e-9 + slack)


@pytest.mark.parametrize(
    "name", ["ccrs", "ccrm", "ccrb", "ccfhos", "ccfhol", "cmrs", "cmrb", "cpla", "cbla"]
)
def test_along_the_lane_the_middle_of_the_target_is_at_the_location(name):
    for row, _, _, left, _, _, _ in contacts(f"ncap-aeb/{name}")[0]:
        assert 50.0 + 100.0 * left / WIDTH == pytest.approx(row["location"], abs=0.1)


# How far the reference point of the protocol is ahead of the entity's [m], and half of the width of
# its box.
REFERENCE = {
    "cpna": (-0.06, 0.25), "cpfa": (-0.06, 0.25), "cpnco": (-0.04, 0.149),
    "cbna": (0.62, 0.25), "cbfa": (0.62, 0.25), "cbnao": (0.62, 0.25),
}  # fmt: skip


@pytest.mark.parametrize("name", REFERENCE)
def test_who_crosses_the_road_is_met_at_the_location(name):
    found, step = contacts(f"ncap-aeb/{name}")
    ahead_of_it, half = REFERENCE[name]
    for row, _, ahead, left, angle, v, _ in found:
        at = left + ahead_of_it * np.sin(angle)
        wanted = WIDTH * (row["location"] / 100.0 - 0.5)
        assert at == pytest.approx(
            wanted, abs=abs(v[-1]) * step + 0.002
        )  # seen a step late at most
        assert half - v[0] * step - 1e-6 <= ahead <= half + 1e-6  # the front, not a side
        assert np.sign(angle) == (-1.0 if name == "cpfa" or name == "cbfa" else 1.0)


@pytest.mark.parametrize("name", ["cpta-fs", "cpta-fo", "cpta-ns", "cpta-no"])
def test_who_crosses_beyond_the_turn_is_met_at_the_location(name):
    found, _ = contacts(f"ncap-aeb/{name}")
    for row, _, _, left, _, _, _ in found:
        assert 50.0 + 100.0 * left / WIDTH == pytest.approx(row["location"], abs=9.0)  # 0.16 m


@pytest.mark.parametrize("name", ["ccftap", "cmftap", "cbta-fo", "cbta-no"])
def test_in_a_turn_the_front_of_the_target_meets_the_location(name):
    half = {"ccftap": 0.856, "cmftap": 0.0, "cbta-fo": 0.0, "cbta-no": 0.0}[name]
    front = {"ccftap": 3.3395, "cmftap": 1.713}.get(name, 1.55)
    found, step = contacts(f"ncap-aeb/{name}")
    for row, _, ahead, left, angle, v, k in found:
        assert k * step == pytest.approx(5.0, abs=2 * step)
        # the near edge of its front, as the ego sees it
        x = ahead + front * np.cos(angle) - half * np.sin(angle) * np.sign(np.sin(angle))
        y = left + front * np.sin(angle) + half * np.cos(angle)
        location = row.get("location", 50.0)
        late = (v[-1] + v[0]) * 2 * step
        assert abs(x) <= late
        assert y == pytest.approx(WIDTH * (location / 100.0 - 0.5), abs=late)


@pytest.mark.parametrize("name", ["cccscp", "cccscp-open", "cmcscp", "cmcscp-open"])
def test_who_crosses_the_junction_is_met_where_the_protocol_says(name):
    found, step = contacts(f"ncap-aeb/{name}")
    sides = set()
    for _, _, ahead, left, angle, v, k in found:
        assert k * step == pytest.approx(4.0, abs=1.5 * step)
        toward = np.sign(np.sin(angle))
        sides.add(toward)
        late = v[-1] * step + 0.01
        if name.startswith("cm"):  # its front wheel, at 90 % of the length of the ego's side
            assert ahead == pytest.approx(-0.1 * LENGTH, abs=v[0] * step + 0.01)
            assert left + toward * (1.713 + 0.5 * WIDTH) == pytest.approx(0.0, abs=late)
        else:  # the point at 75 % of the length of its side, at the middle of the ego's front
            assert ahead == pytest.approx(0.856, abs=v[0] * step + 0.01)
            assert left + toward * (3.3395 - 0.25 * 4.023) == pytest.approx(0.0, abs=late)
    assert sides == {-1.0, 1.0}


def test_the_car_that_pulls_out_keeps_the_protocol_s_times():
    scenario = load("ncap-aeb/ccfhol")
    space = scenario.space()
    rows = rows_of(scenario, space, 0, 0)
    pipeline = Pipeline(scenario, space, PipelineOptions(ego="route-follower"))
    ((_, one),) = pipeline.runner.by_variant(rows.X)
    rollout = one.run(rows.X)
    target, overtaken = (rollout.names.index(who) for who in ("target", "overtaken"))
    speed, length = (rows.X[:, space.index(n)] for n in ("target_speed", "change_length"))
    y = rollout.y[:, target]
    moved = np.abs(y - y[:, -1:]) > 1e-3
    end = (moved.shape[1] - 1 - moved[:, ::-1].argmax(axis=1)) * rollout.time_step
    np.testing.assert_allclose((end - 2.0) * speed, length, atol=0.06 * speed.max())
    _, k = first_contact(rollout)
    np.testing.assert_allclose(k * rollout.time_step - end, 1.5, atol=0.08)
    gap = rollout.x[:, target, 0] - rollout.x[:, overtaken, 0] - 3.3395 - 0.81
    np.testing.assert_allclose(gap, speed, atol=0.001)  # 13.9 m at 50 km/h, 19.4 m at 70 km/h


def test_a_child_is_hidden_until_it_is_near():
    scenario = load("ncap-aeb/cpnco")
    space = scenario.space()
    X = space.row({})[np.newaxis]
    pipeline = Pipeline(scenario, space, PipelineOptions(ego="reference"))
    ((_, one),) = pipeline.runner.by_variant(X)
    rollout = one.run(X)
    child = rollout.names.index("pedestrian")
    seen = rollout.detections[0, child, :, 0] > 0.0
    start = scenario.space().values(X[0])["start_time"]
    assert not seen[: int(start / rollout.time_step)].any()
    assert seen.any()


def test_nights_are_dark():
    scenario = load("ncap-aeb/cpna")
    angles = {one.label: dict(one.values)["sun_altitude_angle"][0] for one in scenario.matrix}
    assert all((angle < -6.0) == ("night" in label) for label, angle in angles.items())
    assert {"2023 day", "2026 standard night"} <= angles.keys()
