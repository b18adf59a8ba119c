"""Maps that are called by name are found in the folder of ``--maps``."""

import os
from pathlib import Path

import pytest
from tests.approval import approve

from .openx.opendrive.test_read import DOCUMENT


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.delenv("CARLA_ROOT", raising=False)
    monkeypatch.chdir(tmp_path)
    found = tmp_path / "carla"
    found.mkdir()
    (found / "Town01.xodr").write_text(DOCUMENT)
    return found


def test_a_map_is_found_by_its_name(cli, folder):
    code, _, err = cli("ontology", "import", "Town01")
    assert code == 2
    approve(err, "--maps", "CARLA_ROOT")
    code, _, _ = cli("ontology", "import", "Town01", "--maps", str(folder))
    assert code == 0
    assert (folder.parent / "Town01.owl").exists()
    assert "CARLA_ROOT" not in os.environ


def test_the_option_goes_before_the_variable(cli, folder, monkeypatch):
    monkeypatch.setenv("CARLA_ROOT", "/nowhere")
    code, out, _ = cli("list", "places", "Town01", "--maps", str(folder))
    assert code == 0
    assert "1 lane, 30 m" in out
    assert os.environ["CARLA_ROOT"] == "/nowhere"


def test_what_is_no_folder_is_refused(cli, folder):
    code, _, err = cli("validate", "x.xosc", "--maps", str(folder / "none"))
    assert code == 2
    approve(err, "--maps")
