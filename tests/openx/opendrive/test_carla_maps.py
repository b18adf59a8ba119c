"""Maps by CARLA's names: found where CARLA_ROOT says, wherever its releases keep them."""

from pathlib import Path

import pytest
from tests.approval import refuses

from bridgegen.base.errors import FileFormatError
from bridgegen.openx.convert import import_file
from bridgegen.openx.opendrive.road_map import map_of, map_path

from .test_read import DOCUMENT


@pytest.mark.parametrize(
    "place",
    [
        "Town01.xodr",
        "CarlaUE4/Content/Carla/Maps/OpenDrive/Town01.xodr",  # releases up to 0.9
        "CarlaUnreal/Content/Carla/Maps/OpenDrive/Town01.xodr",  # 0.10
        "CarlaUE4/Content/Carla/Maps/Town01/OpenDrive/Town01.xodr",  # large maps
    ],
)
def test_where_it_lies(place: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    road_map = tmp_path / place
    road_map.parent.mkdir(parents=True, exist_ok=True)
    road_map.write_text(DOCUMENT)
    monkeypatch.setenv("CARLA_ROOT", str(tmp_path))
    assert map_path(Path("Town01")) == road_map
    assert map_path(Path("scenarios/Carla/Maps/Town01")) == road_map
    assert map_path(Path("other.xodr")) == Path("other.xodr")


def test_import_writes_here_and_not_into_carla(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    root, here = tmp_path / "carla", tmp_path / "here"
    root.mkdir()
    here.mkdir()
    (root / "Town01.xodr").write_text(DOCUMENT)
    monkeypatch.setenv("CARLA_ROOT", str(root))
    monkeypatch.chdir(here)
    owl, _ = import_file(Path("Town01"))
    assert owl.resolve() == here / "Town01.owl"
    assert map_of(owl)[0].resolve() == root / "Town01.xodr"


def test_what_is_not_found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("CARLA_ROOT", raising=False)
    with refuses(FileFormatError, "--maps", "CARLA_ROOT"):
        map_path(Path("Town01"))
    monkeypatch.setenv("CARLA_ROOT", str(tmp_path))
    with refuses(FileFormatError):
        map_path(Path("Town99"))
    with pytest.raises(FileFormatError, match="letters, digits"):
        map_path(Path("T*"))
