"""The page of a logical scenario, and its picture."""

import re
from dataclasses import replace
from types import SimpleNamespace
from xml.etree import ElementTree

import numpy as np
import pytest
from tests.approval import approve, refuses
from tests.covering import covering
from tests.pages import without_theme

from bridgegen.base.errors import InputError, StorageError, UnknownNameError
from bridgegen.engine.pipeline import Pipeline
from bridgegen.engine.replays import Replays
from bridgegen.pages import page
from bridgegen.pages.birdseye import INK, MARKING, PLAYERS
from bridgegen.pages.playbacks import playbacks
from bridgegen.pages.scenario_page import show_scenario, story_lines
from bridgegen.pages.sketch import HEIGHT, WIDTH, sketch
from bridgegen.scenario.language.reader import load
from bridgegen.scenario.language.starter import start_scenario
from bridgegen.simulation.embedded import portable

pytestmark = pytest.mark.thorough

SVG = "{http://www.w3.org/2000/svg}"


@pytest.mark.parametrize("name", covering())
def test_the_picture_shows_everybody_who_matters(name):
    scenario = load(name)
    text = sketch(Pipeline(scenario, scenario.space()).runner)
    root = ElementTree.fromstring(text)
    assert root.get("viewBox") == f"0 0 {WIDTH} {HEIGHT}"
    labels = {one.text for one in root.iter(f"{SVG}text")}
    assert "ego" in labels
    assert len(labels) >= 3  # another one, and the scale
    assert len(list(root.iter(f"{SVG}polygon"))) >= 1  # asphalt
    assert "nan" not in text
    assert len(text) < 60_000
    # The page gives every colour its counterpart of the dark theme; lamps are lit in both.
    style = page.WEB.joinpath("birdseye.css").read_text("utf-8")
    lamps = {"#ff4d4d", "#ffd23f", "#38d39f", "#3a434e"}
    drawn = {colour for _, colour in re.findall(r'(fill|stroke)="(#\w+)"', text)} - lamps
    assert [colour for colour in sorted(drawn) if f'="{colour}"]' not in style] == []


def test_bodies_are_drawn_where_they_are():
    """The ego of S4 at its closest approach, from the rollout, in pixels."""
    scenario = load("crossroads-s4")
    pipeline = Pipeline(scenario, scenario.space())
    x = pipeline.space.row({})
    rollout = pipeline.rollout(x[np.newaxis])
    k = int(rollout.distance[0, 1, : rollout.n_steps[0]].argmin())
    gap = np.array(
        [rollout.x[0, 1, k] - rollout.x[0, 0, k], rollout.y[0, 1, k] - rollout.y[0, 0, k]]
    )
    heading = rollout.h[0, :, k]
    gap += 1.4 * np.array(
        [np.cos(heading[1]) - np.cos(heading[0]), np.sin(heading[1]) - np.sin(heading[0])]
    )
    root = ElementTree.fromstring(sketch(pipeline.runner, x))
    places = [
        np.mean([[float(v) for v in pair.split(",")] for pair in one.get("points").split()], axis=0)
        for colour in PLAYERS[:2]
        for one in root.iter(f"{SVG}polygon")
        if (one.get("fill"), one.get("stroke")) == (colour, MARKING)
    ]
    bar = next(one for one in root.iter(f"{SVG}polyline") if one.get("stroke") == INK)
    left, right = (float(bar.get("points").split()[k].split(",")[0]) for k in (1, 2))
    metres = next(one.text for one in root.iter(f"{SVG}text") if one.text.endswith(" m"))
    scale = (right - left) / float(metres.split()[0])
    assert len(places) == 2
    np.testing.assert_allclose((places[1] - places[0]) / scale, gap * [1, -1], atol=0.05)


def test_nobody_is_drawn_who_is_not_there(monkeypatch):
    scenario = load("crossroads-s4")
    pipeline = Pipeline(scenario, scenario.space())
    rollout = pipeline.rollout(pipeline.space.row({})[np.newaxis])
    present = np.ones(rollout.x.shape, dtype=np.bool_)
    present[0, 1, 20:] = False
    gone = replace(rollout, present=present)
    monkeypatch.setattr(pipeline.runner, "run", lambda _: gone)
    root = ElementTree.fromstring(sketch(pipeline.runner))
    closest = int(gone.distance[0, 1, : gone.n_steps[0]].argmin())
    assert closest < 20  # it counts only while it is there
    assert len(list(root.iter(f"{SVG}polyline"))) > 4
    present[0, 1] = False
    gone = replace(rollout, present=present)
    root = ElementTree.fromstring(sketch(pipeline.runner))
    assert "ego" in {one.text for one in root.iter(f"{SVG}text")}
    assert "bv" not in {one.text for one in root.iter(f"{SVG}text")}


def test_it_tells_the_story():
    lines = list(story_lines(load("pedestrian-behind-parked")))
    assert lines == [
        "ego, a car, starts at 40 m on lane 1 at ego_speed and goes to 190 m on lane 1.",
        "van, a van, stands at van_at on the shoulder.",
        "parked, a car, stands at 94 m on the shoulder.",
        "walker, a pedestrian, starts at 0 m/s; its path leads from 110 m on the sidewalk to 110 m "
        "on the sidewalk of the oncoming side.",
        "walker_steps_out: walker takes up walker_speed at 3 m/s² when the distance (between "
        "reference points, as the crow flies) from walker to ego is ≤ trigger_distance.",
    ]


DRIVEWAY = """
scenario: driveway
title: Car leaves a driveway
description: It comes from behind a building.
source: Ours.
template: road
roads: {lanes: 2, length: 400.0}
duration: 20.0
time_step: 0.05
axes: [participants]
include: [weather]
driver: route-follower
participants:
  ego:
    type: car
    place_by: ego_lane
    places:
      left: {start: {lane: 1, distance: 50.0}, end: {lane: 1, distance: 380.0}}
      right: {start: {lane: 2, distance: 50.0}, end: {lane: 2, distance: 380.0}}
    speed: 9.0
  neighbour:
    type: car
    model: vw_golf_sportsvan_2015
    path: [{lane: 2, distance: 178, offset: -16}, {lane: 2, distance: 180}, {lane: 2, distance: at}]
    speed: 3.0
  house:
    type: obstacle
    body: {length: 12, width: 8}
    start: {lane: 2, distance: 165, offset: -9}
parameters:
  ego_lane:
    axis: participants
    kind: category
    values: [left, right]
    default: right
    description: The lane on which the ego starts.
    source: Both are driven.
  at: {axis: participants, unit: m, low: 200, high: 260, default: 230, description: To, source: o}
objective: harm
"""


@pytest.fixture
def driveway(tmp_path):
    path = tmp_path / "driveway.yaml"
    path.write_text(DRIVEWAY, "utf-8")
    return path


def test_places_paths_and_models_in_words(driveway):
    lines = list(story_lines(load(driveway)))
    assert lines == [
        "ego, a car, starts at 9 m/s; ego_lane chooses its place: from 50 m on lane 1 to 380 m on "
        "lane 1 (left); from 50 m on lane 2 to 380 m on lane 2 (right).",
        "neighbour, a car (model vw_golf_sportsvan_2015), starts at 3 m/s; its path, a smooth "
        "curve, leads from 178 m on lane 2, 16 m right of its centre; past 180 m on lane 2; to at "
        "on lane 2.",
        "house, an obstacle, stands at 165 m on lane 2, 9 m right of its centre.",
    ]


def test_a_negative_offset_is_to_the_right():
    lines = list(story_lines(load("cyclist-swings-out")))
    approve(lines[1], "cyclist_at", "cyclist_speed")
    approve(lines[2], "170 m", "0.8 m")
    approve(lines[3], "centre")
    approve(lines[4], "1.5 m")


def test_the_main_road_of_a_merge_has_no_oncoming_side():
    said = " ".join(story_lines(load("merge-reactions")))
    assert "starts at ego_start on lane 2 of leg main in at ego_speed" in said
    assert "oncoming" not in said


def test_an_emergency_vehicle_on_a_call_in_words():
    (line,) = [one for one in story_lines(load("emergency-vehicle-on-red")) if "siren" in one]
    approve(line, "ambulance_start", "lane 2", "allowed")


@pytest.mark.parametrize(
    ("objective", "rule"),
    [
        ("harm", "critical: a collision that the ego is responsible for or could have prevented, "),
        (
            "{terms: [{metric: d_min, weight: 1}], weights: fixed, scale: raw, critical: "
            "{d_min_below: 1.5}}",
            "critical: a collision, or d_min below 1.5 m while v_d is at least 1 m/s",
        ),
    ],
)
def test_the_page_names_the_rule_that_counts(driveway, objective, rule):
    driveway.write_text(DRIVEWAY.replace("objective: harm", f"objective: {objective}"), "utf-8")
    assert f"<li>{rule}" in show_scenario(str(driveway)).read_text("utf-8")


@pytest.mark.parametrize("name", covering())
def test_the_page_says_everything(tmp_path, name):
    scenario = load(name)
    text = show_scenario(name, tmp_path / "page.html").read_text("utf-8")
    for parameter in scenario.parameters.values():
        assert f'<th scope="row">{parameter.name}</th>' in text
    stated = (scenario.bounds, scenario.derived, scenario.criteria)
    assert text.count("<dt>") == sum(map(len, stated))
    assert not re.findall(r"""(?:src|href)=["'](?!data:,|#)""", text)  # nothing is fetched
    # its data and its own script, where it simulates
    simulates = "It is not simulated in this page" not in text
    assert without_theme(text).count("<script") == (2 if simulates else 0)


def test_where_it_goes(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert show_scenario("cut-in").name == "cut-in.html"
    folder = tmp_path / "mine"
    folder.mkdir()
    own = start_scenario("own", folder=folder)
    assert show_scenario(str(own)) == folder / "own.html"
    assert show_scenario(str(own)) == folder / "own.html"  # an earlier picture is replaced
    (tmp_path / "notes.html").write_text("mine")
    with refuses(StorageError):
        show_scenario("cut-in", tmp_path / "notes.html")
    with refuses(InputError):
        show_scenario("cut-in", tmp_path / "page.pdf")
    with refuses(UnknownNameError, "cut-in"):
        show_scenario("cut-on")


def test_hostile_text_is_text(tmp_path):
    own = start_scenario("own", folder=tmp_path)
    text = own.read_text("utf-8").replace(
        "title: A slower car", "title: <script>alert(1)</script> & a slower car"
    )
    text = text.replace("description: ", "description: </script><script>alert(2)</script> ")
    own.write_text(text, "utf-8")
    page = show_scenario(str(own)).read_text("utf-8")
    assert "<script>alert" not in page
    assert without_theme(page).count("<script") == 2
    assert "&lt;script&gt;alert(1)&lt;/script&gt; &amp; a slower car" in page


def test_a_report_has_no_place_for_who_is_not_there(monkeypatch):
    scenario = load("crossroads-s4")
    pipeline = Pipeline(scenario, scenario.space())
    X = pipeline.space.row({})[np.newaxis]
    ((_, replay),) = pipeline.replays(X).parts
    present = np.ones(replay.rollout.x.shape, dtype=np.bool_)
    present[0, 1, 20:] = False
    gone = replace(replay, rollout=replace(replay.rollout, present=present))
    whole = Replays(((np.zeros(1, np.int64), gone),))
    monkeypatch.setattr(pipeline, "replays", lambda *_, **__: whole)
    rows = SimpleNamespace(
        X=X, metrics=np.zeros((1, len(pipeline.metrics))), critical=[True], cause=np.zeros(1, int),
        take=lambda at: rows,
    )  # fmt: skip
    (shown,) = playbacks(pipeline, rows, [("0001", 0, ())])
    for name in "xyva":
        assert (np.isnan(getattr(shown, name)) == ~present[0]).all()
    assert np.isinf(shown.distance[20:]).all()


def test_the_page_lists_pass_criteria_whatever_their_texts_are(tmp_path):
    path = start_scenario("mine", like="cut-in", folder=tmp_path)
    hostile = "</dd><script>alert(1)</script>"
    with path.open("a", encoding="utf-8") as file:
        file.write(
            "\ncriteria:\n  - id: R-12\n    formula: always(gap to bv > 2 m)\n"
            f'    text: "{hostile}"\n    severity: critical\n    tags: [gap]\n'
        )
    text = show_scenario(str(path)).read_text("utf-8")
    assert "<dt>R-12: always(gap to bv &gt; 2 m)</dt>" in text
    assert "critical, gap" in text
    assert hostile not in text
    assert "Pass criteria" not in show_scenario("cut-in", tmp_path / "plain.html").read_text(
        "utf-8"
    )


@pytest.mark.browser
def test_a_scenario_is_tried_on_its_page(browser, tmp_path):
    path = show_scenario("cut-in", tmp_path / "page.html")
    assert path.stat().st_size < 1_200_000
    page = browser.new_page(viewport={"width": 390, "height": 800})
    asked, errors = [], []
    page.on("request", lambda request: asked.append(request.url))
    page.on("pageerror", lambda error: errors.append(str(error)))
    page.goto(path.as_uri())
    page.wait_for_selector("#explore input")
    assert page.evaluate("document.documentElement.scrollWidth") <= 390
    assert page.locator("#play svg").bounding_box()["width"] < 20
    page.evaluate(
        """() => { const slider = document.querySelector('#explore input[aria-label="ego_speed"]');
        slider.value = slider.max; slider.dispatchEvent(new Event("input")); }"""
    )
    page.wait_for_selector(".tried:has-text('closest'), .tried:has-text('responsible')")
    page.evaluate("navigator.clipboard.writeText = async (text) => { window.copied = text; }")
    page.click("text=Copy command")
    page.wait_for_function("window.copied")
    copied = page.evaluate("window.copied")
    assert copied.startswith("bridgegen simulate cut-in --ego ")
    assert "--fix ego_speed=" in copied
    assert errors == []
    assert [url for url in asked if not url.startswith("blob:")] == [path.as_uri()]  # its own parts
    page.close()


def test_a_page_that_cannot_simulate_says_why(tmp_path, monkeypatch):
    monkeypatch.setattr(portable, "MODULE", tmp_path / "kernels.wasm")
    text = show_scenario("stopped-after-curve", tmp_path / "page.html").read_text("utf-8")
    assert "It is not simulated in this page: this installation has no kernels" in text
    assert 'id="data"' not in text
