"""Films of a playback: what Pillow reads of them, and where the ego's colour is in them."""

from dataclasses import replace

import numpy as np
import pytest
from PIL import Image, ImageColor

from bridgegen.errors import InputError, StorageError
from bridgegen.report.frames import FINE, PLAYERS, Film, _overlap
from bridgegen.report.video import write_video


def ego_pixels(image):
    """Return the middle of the pixels in the ego's colour (x, y)."""
    wanted = np.array(ImageColor.getrgb(PLAYERS[0]))
    off = np.abs(np.asarray(image.convert("RGB"), dtype=int) - wanted).max(axis=2)
    y, x = np.nonzero(off < 12)
    return x.mean(), y.mean()


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


def test_the_ego_moves_as_it_does(playback):
    """Without labels or trails: bodies alone, the camera at rest."""
    film = Film(playback, (960, 540), 0, 60)
    film._draw_labels = film._draw_trail = lambda *_: None
    film._follows, film._middle = False, film.centres[0, 40]
    ahead = playback.entities[0].center_ahead
    pixels, metres = [], []
    for k in (20, 60):
        x, y = ego_pixels(film.frame(k))
        camera = film._camera(k)
        scale = camera.scale / FINE
        pixels.append((x - 480 + camera.x * scale, 270 - y + camera.y * scale))
        h = playback.h[0, k]
        metres.append((playback.x[0, k] + ahead * np.cos(h), playback.y[0, k] + ahead * np.sin(h)))
    moved = np.subtract(*pixels) / scale
    assert moved == pytest.approx(np.subtract(*metres), abs=0.3)


def test_no_label_covers_the_contact(playback):
    hit = replace(playback, distance=np.where(np.arange(401) < 100, 5.0, 0.0))
    film = Film(hit, (960, 540), 60, 130)
    drawn, pill = [], film._pill
    film._pill = lambda *given: drawn.append(pill(*given)) or drawn[-1]
    film.frame(110)
    u, v = film.contact(110)
    cross = (FINE * u - 14, FINE * v - 14, FINE * u + 14, FINE * v + 14)
    assert len(drawn) >= 3  # the clock and two labels
    assert [one for one in drawn if _overlap(one, cross)] == []


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
    with pytest.raises(InputError, match=r"must end in \.gif"):
        write_video(playback, tmp_path / "a.avi")
