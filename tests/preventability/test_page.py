"""The page: a picture's pixels are cells, and it needs nothing but itself."""

import base64
import io
import re

import numpy as np
from PIL import Image
from tests.pages import without_theme

from bridgegen.jobs.preventability.classes import CellClass
from bridgegen.jobs.preventability.grid import GridAxis
from bridgegen.jobs.preventability.page import COLOURS, png
from bridgegen.jobs.preventability.pictures import representatives
from bridgegen.jobs.preventability.preventability import map_preventability


def test_a_pixel_has_the_colour_of_its_cell_s_class():
    codes = np.array([[0, 1, 2], [3, 4, 0]], np.int8)
    with Image.open(io.BytesIO(png(codes))) as picture:
        assert picture.size == (3, 2)
        pixels = np.asarray(picture.convert("RGB"))
    for at, code in np.ndenumerate(codes):
        assert "#" + pixels[at].tobytes().hex() == COLOURS[CellClass(code)]


def test_the_colours_differ_in_grey_too():
    """Two colours of one lightness would be one to who sees no colours; classes that may touch."""
    grey = [
        0.2126 * int(c[1:3], 16) + 0.7152 * int(c[3:5], 16) + 0.0722 * int(c[5:7], 16)
        for one, c in COLOURS.items()
        if one <= CellClass.NOT_APPLICABLE
    ]
    assert min(abs(a - b) for i, a in enumerate(grey) for b in grey[:i]) > 25.0


def test_the_page_shows_every_driver_upright_and_loads_nothing(tmp_path):
    found = map_preventability(
        "r157/cut-in", ["route-follower", "un-r157"],
        grid={
            "gap": GridAxis(1.0, 61.0, 7),
            "relative_speed": GridAxis("10 km/h", "50 km/h", 3),
            "lateral_speed": GridAxis(0.6, 1.8, 2),
        },
        out=tmp_path / "map",
    )  # fmt: skip
    page = found.page.read_text("utf-8")
    pictures = re.findall(r'href="data:image/png;base64,([^"]+)"', page)
    assert len(pictures) == 2 * 2
    assert not re.findall(r'(?:src|href)="(?!data:|#)', page)
    assert "<script" not in without_theme(page)
    with Image.open(io.BytesIO(base64.b64decode(pictures[1]))) as picture:
        pixels = np.asarray(picture)  # of route-follower, the second lateral speed
    expected = found.classes["route-follower"][:, :, 1].T[::-1]
    np.testing.assert_array_equal(pixels, expected)
    for one in (CellClass.AVOIDED, CellClass.PREVENTABLE):
        assert f"{found.counts('route-follower')[one]:,}<small>" in page


def test_cells_stand_in_the_middle_of_their_class_and_at_its_boundary():
    codes = np.zeros((9, 9), np.int8)
    codes[:, 5:] = CellClass.UNPREVENTABLE
    codes[0, 8] = CellClass.NOT_APPLICABLE
    found = {(kind, place): at for kind, place, at in representatives(codes)}
    assert {kind for kind, _ in found} == {CellClass.AVOIDED, CellClass.UNPREVENTABLE}
    for (kind, place), at in found.items():
        assert codes[at] == kind
        if place == "at the boundary":
            assert at[1] in (4, 5)
        else:
            assert at[1] in (0, 8)  # the map's end is no boundary
    assert [*representatives(np.full((3, 3), CellClass.NO_RESULT, np.int8))] == []


def test_played_cells_do_what_their_class_says(tmp_path):
    """A ring stands where bodies touch: in the cells that are not avoided, and in no other."""
    found = map_preventability(
        "r157/cut-in", ["route-follower", "computed:rss"],
        grid={"gap": GridAxis(1.0, 61.0, 9), "relative_speed": GridAxis(3.0, 14.0, 5)},
        out=tmp_path / "map",
    )  # fmt: skip
    page = found.page.read_text("utf-8")
    figures = re.findall(r'<figure class="card" id="cell-(\d+)">(.*?)</figure>', page, re.DOTALL)
    assert 4 <= len(figures) <= 6  # what is computed has no motion
    for number, text in figures:
        assert page.count(f'href="#cell-{number}"') == 1
        label = re.search(r"<strong>\d+ · (.*?), ", text)[1]
        assert ('stroke="#c00020"' in text) == (label != CellClass.AVOIDED.label)
    counts = found.counts("route-follower")
    hits = counts[CellClass.PREVENTABLE] + counts[CellClass.UNPREVENTABLE]
    judged = 45 - counts[CellClass.NOT_APPLICABLE]
    assert f"avoids {counts[CellClass.AVOIDED]} of {judged} cells; " in page
    assert f"{counts[CellClass.PREVENTABLE]} of its {hits} collisions were preventable." in page


def test_text_of_a_user_is_escaped(tmp_path):
    """A driver is called by its path, which may hold anything."""
    folder = tmp_path / "<b>"
    folder.mkdir()
    (folder / "mine.py").write_text(
        "import numpy as np\n"
        "from bridgegen.drivers.interface import Control\n"
        "class D:\n"
        "    def reset(self, n, scene): pass\n"
        "    def act(self, o): return Control(np.full(len(o.v), -8.0), np.zeros(len(o.v)))\n"
    )
    found = map_preventability(
        "r157/cut-in", f"{folder}/mine.py:D", grid=["gap=60:61:2"], out=tmp_path / "map"
    )
    page = found.page.read_text("utf-8")
    assert "<b>" not in page
    assert "&lt;b&gt;" in page
