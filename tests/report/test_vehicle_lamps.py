"""Indicators, brake lights and blue lights: which corners of a body are lit, seen in the pixels."""

import io
import math
import re
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from PIL import Image

from bridgegen.drivers.kinds import BLUE, BRAKE, HAZARD, LEFT, RIGHT
from bridgegen.engine.options import PipelineOptions
from bridgegen.engine.pipeline import Pipeline
from bridgegen.pages.birdseye import View
from bridgegen.pages.frames import FINE, Film
from bridgegen.pages.playbacks import playbacks
from bridgegen.scenario.language.reader import load

LIT, UNLIT = 96, 104  # instants: 4.80 s is within a flash of 1.5 a second, 5.20 s between two
CORNERS = {
    "front left": (1, 1),
    "front right": (1, -1),
    "rear left": (-1, 1),
    "rear right": (-1, -1),
}
RIM = 60  # a lamp's rim is darker than this in all channels

SHOWN = [
    (LEFT, {"front left", "rear left"}),
    (RIGHT, {"front right", "rear right"}),
    (HAZARD, set(CORNERS)),
    (BRAKE, set()),
    (0, set()),
]


@pytest.fixture
def shows(report):
    """Make the first playback; its other vehicle, whose colour is nearly a lamp's, shows lamps."""
    p = report.kept[0]

    def make(what):
        lamps = np.zeros(p.x.shape, dtype=np.int8)
        lamps[1] = what
        return replace(p, shows=lamps, lanes=p.lanes[:1])

    return make


def amber(pixels):
    r, g, b = pixels.T
    return (r > 250) & (g > 170) & (g < 182) & (b < 8)  # the body is 240, 163, 10


def found(picture, at, heading, scale, body):
    """Return the corners at which a lamp with a rim is lit, by the pixels about it."""
    pixels = np.asarray(picture.convert("RGB"), dtype=int)
    lit = set()
    for name, (end, side) in CORNERS.items():
        a, b = end * body.length / 2, side * body.width / 2
        x = at[0] + scale * (a * math.cos(heading) - b * math.sin(heading))
        y = at[1] - scale * (a * math.sin(heading) + b * math.cos(heading))
        r = max(6, round(0.5 * scale))
        box = pixels[round(y) - r : round(y) + r + 1, round(x) - r : round(x) + r + 1].reshape(
            -1, 3
        )
        if amber(box).sum() > 4 and (box.max(axis=1) < RIM).sum() > 4:
            lit.add(name)
    return lit


@pytest.mark.parametrize(("what", "corners"), SHOWN)
def test_a_film_shows_which_side_indicates(shows, monkeypatch, what, corners):
    p = shows(what)
    film = Film(p, (960, 540), LIT - 20, UNLIT)
    monkeypatch.setattr(View, "labels", lambda *_: None)
    monkeypatch.setattr(View, "trail", lambda *_: None)
    for k, expected in ((LIT, corners), (UNLIT, set())):
        camera = film._camera(k)
        at = np.array(camera.of(film.centres[1:2, k])[0]) / FINE
        picture = film.frame(k)
        seen = found(picture, at, p.h[1, k], camera.scale / FINE, p.entities[1])
        assert seen == expected


@pytest.mark.browser
@pytest.mark.parametrize(("what", "corners"), SHOWN)
def test_the_page_shows_which_side_indicates(show, report, shows, what, corners):
    p = shows(what)
    opened = show(replace(report, kept=(p,)))
    opened.page.evaluate("bridgegen.select(0)")
    opened.page.click("#zoom-fit")
    for k, expected in ((LIT, corners), (UNLIT, set())):
        opened.page.evaluate("k => bridgegen.seek(k)", k)
        state = opened.state()
        shot = opened.page.locator("#scene").screenshot()
        with Image.open(io.BytesIO(shot)) as picture:
            seen = found(picture, state["screen"][1], p.h[1, k], state["scale"], p.entities[1])
        assert seen == expected
    assert opened.complaints == []
    opened.page.close()


@pytest.mark.browser
@pytest.mark.parametrize(
    ("what", "words"),
    [(LEFT, "indicates left"), (HAZARD | BRAKE, "hazard lights on, brake lights on"),
     (BLUE, "blue lights on")],
)  # fmt: skip
def test_the_lamps_in_words(show, report, shows, what, words):
    opened = show(replace(report, kept=(shows(what),)))
    opened.page.evaluate("bridgegen.select(0); bridgegen.seek(100)")
    assert re.search(f"bv [0-9.]+ m/s, {words}[;.]", opened.page.inner_text("#now"))
    opened.page.close()


def red(picture):
    r, g, b = np.asarray(picture.convert("RGB"), dtype=int).reshape(-1, 3).T
    return int(((r > 240) & (g < 60) & (b < 60)).sum())


def blue(picture):
    r, g, b = np.asarray(picture.convert("RGB"), dtype=int).reshape(-1, 3).T
    return int(((r < 60) & (g > 130) & (g < 150) & (b > 240)).sum())


@pytest.mark.parametrize(("what", "colour"), [(BRAKE, red), (BLUE, blue)])
def test_a_film_shows_brake_lights_and_blue_lights(shows, what, colour):
    with_them, without = (Film(shows(one), (960, 540), LIT, LIT).frame(LIT) for one in (what, 0))
    assert colour(with_them) > 10
    assert colour(without) == 0


def played(name):
    """Return the playback of a catalogue scenario's defaults."""
    logical = load(name)
    space = logical.space()
    pipeline = Pipeline(logical, space, PipelineOptions(ego="route-follower"))
    rows: Any = SimpleNamespace(
        X=space.row({})[np.newaxis], metrics=np.zeros((1, len(pipeline.metrics))),
        critical=np.ones(1, dtype=bool), cause=np.zeros(1, dtype=np.int8), take=lambda at: rows,
    )  # fmt: skip
    (kept,) = playbacks(pipeline, rows, [("0001", 0, ())])
    return kept


def test_the_ambulance_on_a_call_shows_its_blue_lights():
    kept = played("emergency-vehicle-on-red")
    assert [one.name for one in kept.entities] == ["ego", "ambulance"]
    assert (kept.shows[1] & BLUE).all()
    assert not (kept.shows[0] & BLUE).any()
    brakes = kept.shows[1] & BRAKE > 0  # 3 m/s² before the junction
    assert 10 < brakes.sum() < 100
    assert kept.v[1, brakes].min() == pytest.approx(6.0, abs=0.2)


def test_the_bus_indicates_left_before_it_pulls_out():
    kept = played("bus-pulls-out")
    first = np.flatnonzero(kept.shows[1] & LEFT)[0]
    starts = np.flatnonzero(kept.v[1] > 0.01)[0]
    assert kept.v[0, first] * (starts - first) * kept.time_step == pytest.approx(20.0, abs=1.5)
    assert not (kept.shows[1] & RIGHT).any()
