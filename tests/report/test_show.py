import json
import re
import subprocess
import sys

import pytest
from tests.approval import refuses

from bridgegen.base.errors import FileFormatError, InputError, StorageError
from bridgegen.pages.scenario_page import show_file
from bridgegen.scenario.ontology.files import save


@pytest.fixture
def owl(tmp_path, individuals):
    save(individuals, tmp_path / "it.owl")
    return tmp_path / "it.owl"


def edit(path, pattern, new):
    text, count = re.subn(pattern, new, path.read_text(encoding="utf-8"), count=1)
    assert count == 1
    path.write_text(text, encoding="utf-8")


def sent(page):
    text = page.read_text(encoding="utf-8")
    return json.loads(re.search(r'id="data">(.*?)</script>', text, re.S)[1])


def test_the_page_is_beside_the_file(owl):
    page, violations = show_file(owl)
    assert (page, violations) == (owl.with_suffix(".html"), 0)
    picture = sent(page)["pictures"][0]
    assert picture["violations"] == []
    assert re.match(r"\d+ constraints checked \(\d+ of every scenario, ", picture["checked"])
    assert "<title>it.owl: all-layers – BridgeGen</title>" in page.read_text(encoding="utf-8")


@pytest.mark.thorough
def test_a_scenario_of_the_catalogue_is_held_against_it(owl):
    edit(owl, r">all-layers</bg:has_name>", ">crossroads-s4</bg:has_name>")
    page, violations = show_file(owl)
    assert "of scenario crossroads-s4" in sent(page)["pictures"][0]["checked"]
    assert violations > 0  # its lanes, legs and the size of the crossroads are bound to nothing


def test_an_edited_file_is_drawn_with_what_is_wrong(owl):
    edit(owl, r"(<bg:has_fog_density[^>]*>)[^<]*<", r"\g<1>140<")
    page, violations = show_file(owl, owl.with_name("picture.html"))
    assert violations == len(sent(page)["pictures"][0]["violations"]) > 0


def test_an_earlier_picture_is_replaced_and_nothing_else_is(owl):
    page, _ = show_file(owl)
    before = page.read_bytes()
    edit(owl, r">ego</bg:has_name>", ">Egon</bg:has_name>")
    show_file(owl)
    assert page.read_bytes() != before
    page.write_text("my notes")
    with refuses(StorageError):
        show_file(owl)
    assert page.read_text() == "my notes"


def test_mistakes_are_one_clear_error(owl, tmp_path):
    with refuses(InputError):
        show_file(owl, tmp_path / "picture.svg")
    with refuses(FileFormatError):
        show_file(tmp_path / "none.owl")
    with refuses(StorageError):
        show_file(owl, tmp_path / "nowhere" / "it.html")
    owl.with_suffix(".html").mkdir()
    with refuses(StorageError):
        show_file(owl)


def test_on_the_command_line(owl):
    edit(owl, r"(<bg:has_fog_density[^>]*>)[^<]*<", r"\g<1>140<")
    command = [sys.executable, "-c", "from bridgegen.cli import main; main()", "draw", str(owl)]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert done.stdout == f"{owl.with_suffix('.html')}\n"
    assert re.search(r"warning: .*it\.owl: \d+ violations?, shown in red", done.stderr)
