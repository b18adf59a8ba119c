"""Films of a playback: what Pillow reads of them, and where the ego's colour is in them."""

import shutil
import subprocess
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from lxml import etree
from PIL import Image
from tests.approval import refuses

from bridgegen.base.errors import InputError, StorageError
from bridgegen.pages import video as ffmpeg
from bridgegen.pages.birdseye import HIT, PLAYERS
from bridgegen.pages.frames import Film
from bridgegen.pages.video import write_video


def elements(film, k, kind, **having):
    """Return the elements of a kind of an instant's picture that have some attributes."""
    root = etree.fromstring(film.drawing(k).encode())
    found = [one for one in root if one.tag.endswith(kind)]
    return [one for one in found if all(one.get(name) == having[name] for name in having)]


def points(element):
    return np.array([[float(v) for v in pair.split(",")] for pair in element.get("points").split()])


@pytest.fixture
def playback(report):
    return report.kept[0]


def test_frames_and_size(playback, tmp_path):
    out = tmp_path / "a.gif"
    write_video(playback, out, size=(320, 180), fps=10, start=2.0, end=4.0)
    with Image.open(out) as film:
        assert film.n_frames == 21
        assert film.size == (320, 180)
        assert film.info["duration"] == 100


def test_the_same_bytes_twice(playback, tmp_path):
    for name in ("a.gif", "b.gif"):
        write_video(playback, tmp_path / name, size=(320, 180), fps=5, start=1.0, end=2.0)
    assert (tmp_path / "a.gif").read_bytes() == (tmp_path / "b.gif").read_bytes()


def test_bodies_move_as_they_do(playback):
    """Where the other one is from the ego, in lengths of the ego."""
    film = Film(playback, (960, 540), 0, 60)
    ahead = np.array([entity.center_ahead for entity in playback.entities])
    for k in (20, 60):
        (ego,), (other,) = (elements(film, k, "polygon", fill=one) for one in PLAYERS[:2])
        corners = points(ego)
        metre = np.hypot(*(corners[1] - corners[0])) / playback.entities[0].length
        apart = (points(other).mean(axis=0) - corners.mean(axis=0)) / metre
        h = playback.h[:, k]
        x = playback.x[:, k] + ahead * np.cos(h)
        y = playback.y[:, k] + ahead * np.sin(h)
        assert apart == pytest.approx([x[1] - x[0], y[0] - y[1]], abs=0.05)


def test_no_label_covers_the_contact(playback, monkeypatch):
    hit = replace(playback, distance=np.where(np.arange(401) < 100, 5.0, 0.0))
    film = Film(hit, (960, 540), 60, 130)
    lines = elements(film, 110, "polyline", stroke=HIT)
    low, high = (
        end(np.concatenate([points(one) for one in lines]), axis=0) for end in (np.min, np.max)
    )
    labels = [one for one in elements(film, 110, "rect") if one.get("rx")]
    assert len(labels) >= 3  # the clock and two labels
    for label in labels:
        x, y, w, h = (float(label.get(name)) for name in ("x", "y", "width", "height"))
        assert x + w <= low[0] or x >= high[0] or y + h <= low[1] or y >= high[1]


def test_the_contact_is_red_in_a_gif_that_ends_elsewhere(playback, tmp_path):
    hit = replace(playback, distance=np.where(np.arange(401) < 60, 5.0, 0.0))
    out = tmp_path / "a.gif"
    write_video(hit, out, size=(320, 180), fps=10, start=2.0, end=8.0)
    with Image.open(out) as film:
        film.seek(11)
        assert (192, 0, 32) in {colour for _, colour in film.convert("RGB").getcolors(1 << 16)}


@pytest.mark.parametrize(
    ("given", "rule"),
    [
        ({"size": (10, 540)}, "--size"),
        ({"fps": 0}, "--fps"),
        ({"start": 3.0, "end": 3.0}, "--from < --to"),
        ({"start": 1e3}, "--from <="),
        ({"start": 1.0, "end": 1e3}, "--to <="),
        ({"start": float("nan")}, "--from <="),
    ],
)
def test_values_out_of_bounds(playback, tmp_path, given, rule):
    with pytest.raises(InputError, match=rule):
        write_video(playback, tmp_path / "a.gif", **given)
    assert not list(tmp_path.iterdir())


def test_another_file_is_not_overwritten(playback, tmp_path):
    out = tmp_path / "a.png"
    out.write_text("mine")
    with pytest.raises(StorageError, match="not overwritten"):
        write_video(playback, out)
    assert out.read_text() == "mine"


def test_another_format_is_refused(playback, tmp_path):
    with refuses(InputError):
        write_video(playback, tmp_path / "a.avi")


def tags(picture):
    return Counter(one.tag.rpartition("}")[2] for one in etree.fromstring(picture).iter())


def test_one_moment_as_svg_has_the_bodies_where_they_are(playback, tmp_path):
    out = tmp_path / "moment.svg"
    write_video(playback, out, size=(640, 360), start=3.0)
    root = etree.fromstring(out.read_bytes())
    assert (root.get("width"), root.get("height")) == ("640", "360")
    (ego,) = [one for one in root if one.get("fill") == PLAYERS[0] and one.tag.endswith("polygon")]
    corners = points(ego)
    long, wide = np.hypot(*(corners[1:3] - corners[:2]).T)
    body = playback.entities[0]
    assert long / wide == pytest.approx(body.length / body.width, rel=0.02)
    words = [one.text for one in root if one.tag.endswith("text")]
    assert any(word.startswith("ego  ") for word in words)
    assert "3.0 s" in words
    assert out.stat().st_size < 100_000


def test_svg_and_png_show_the_same(playback):
    """Every kind of element that pixels have; the text of a hostile name is text."""
    named = replace(playback.entities[1], name="<b>&amp;</b>")
    film = Film(replace(playback, entities=(playback.entities[0], named)), (640, 360), 0, 60)
    found = tags(film.drawing(60).encode())
    assert found["polygon"] > 5
    assert found["polyline"] > 3
    assert found["circle"] > 1
    assert found["b"] == 0


@pytest.mark.parametrize("kind", [".mp4", ".webm"])
@pytest.mark.skipif(shutil.which("ffmpeg") is None, reason="ffmpeg is not installed")
def test_a_film_that_ffmpeg_reads_again(playback, tmp_path, kind):
    out = tmp_path / f"a{kind}"
    write_video(playback, out, size=(321, 180), fps=10, start=2.0, end=4.0)
    again = subprocess.run(
        ["ffmpeg", "-v", "error", "-i", out, "-f", "rawvideo", "-pix_fmt", "rgb24", "-"],
        capture_output=True, check=True,
    )  # fmt: skip
    frames = np.frombuffer(again.stdout, np.uint8).reshape(-1, 180, 322, 3)
    assert len(frames) == 21
    film = Film(playback, (321, 180), 40, 80)
    first = np.asarray(film.frame(40), dtype=int)
    assert np.abs(frames[0][:, :321] - first).mean() < 6.0
    write_video(playback, out, size=(320, 180), fps=10, start=2.0, end=3.0)  # ours: replaced


def test_without_ffmpeg_one_error_names_it(playback, tmp_path, monkeypatch):
    monkeypatch.setattr(ffmpeg.shutil, "which", lambda name: None)
    monkeypatch.setattr(ffmpeg, "find_spec", lambda name: None)
    with refuses(InputError):
        write_video(playback, tmp_path / "a.mp4")


def test_an_ffmpeg_that_fails_is_one_error_and_leaves_nothing(playback, tmp_path, monkeypatch):
    failing = tmp_path / "bin" / "ffmpeg"
    failing.parent.mkdir()
    failing.write_text("#!/bin/sh\necho 'Unknown encoder' >&2\nexit 3\n")
    failing.chmod(0o755)
    monkeypatch.setenv("PATH", f"{failing.parent}:/usr/bin:/bin")
    with refuses(StorageError):
        write_video(playback, tmp_path / "a.mp4", size=(320, 180), start=1.0, end=2.0)
    assert not (tmp_path / "a.mp4").exists()


def test_an_ffmpeg_that_hangs_is_ended(playback, tmp_path, monkeypatch):
    hanging = tmp_path / "bin" / "ffmpeg"
    hanging.parent.mkdir()
    hanging.write_text("#!/bin/sh\nexec sleep 100\n")
    hanging.chmod(0o755)
    monkeypatch.setenv("PATH", f"{hanging.parent}:/usr/bin:/bin")
    monkeypatch.setattr(ffmpeg, "TIMEOUT", 0.5)
    with refuses(StorageError, "0.5 s"):
        write_video(playback, tmp_path / "a.webm", size=(320, 180), start=1.0, end=2.0)
