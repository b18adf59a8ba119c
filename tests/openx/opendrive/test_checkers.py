"""Strangers' judgement of our files: ASAM's quality checkers, its schema, and SUMO's netconvert.

Run with ``BRIDGEGEN_CHECKERS`` naming the virtual environment that they are in.
"""

import random
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from lxml import etree

from bridgegen.openx.opendrive.from_owl import opendrive_from_owl
from bridgegen.openx.opendrive.model import OpenDrive
from bridgegen.openx.opendrive.read import read
from bridgegen.openx.opendrive.write import to_xml
from bridgegen.scenario.ontology.individuals import build_static
from bridgegen.scenario.ontology.site import ArmRoad, Leg, Site, SiteLane

from .kinds import FURNISHED, KINDS
from .kinds import model as kind

pytestmark = pytest.mark.checkers


def skewed() -> OpenDrive:
    """Legs that are neither equal nor at right angles, two of them drawn towards the junction."""
    legs = []
    for number, (name, heading, inbound, outbound, end) in enumerate(
        [
            ("A", 283.0, (3.5, 3.0), (3.25,), "start"),
            ("B", 171.0, (3.0,), (3.0, 3.5), "end"),
            ("C", 80.0, (3.5, 3.5, 3.5), (3.5, 3.5), "end"),
            ("D", 10.0, (4.0,), (2.75,), "start"),
        ],
        start=1,
    ):
        side = 1 if end == "start" else -1
        lanes = [SiteLane(side * k, "in", width) for k, width in enumerate(inbound, 1)]
        lanes += [SiteLane(-side * k, "out", width) for k, width in enumerate(outbound, 1)]
        road = ArmRoad(str(number), 50.0 + number, end, tuple(lanes), 13.9)  # type: ignore[arg-type]
        legs.append(Leg(name, heading, (road,)))
    return opendrive_from_owl(build_static(Site("skewed", None, "100", 36.0, tuple(legs))))


@pytest.fixture(scope="module")
def files(
    tmp_path_factory: pytest.TempPathFactory,
    corners: list[dict[str, float]],
    crossroads: Callable[..., OpenDrive],
) -> list[Path]:
    """The corners, a random sample, and a skewed crossroads, as files."""
    pick = random.Random(0)
    models = [crossroads(*values.values()) for values in corners]
    for _ in range(6):
        width, lanes = pick.uniform(2.75, 4.0), pick.randint(1, 3)
        size = pick.uniform(max(16.0, 2 * lanes * width + 6.0), 44.0)
        models.append(crossroads(width, lanes, pick.uniform(45.0, 100.0), size))
    models += [kind(name) for name in KINDS]
    models.insert(0, opendrive_from_owl(build_static(FURNISHED)))
    models.append(skewed())
    folder = tmp_path_factory.mktemp("xodr")
    paths = [folder / f"{number:02}.xodr" for number in range(len(models))]
    for path, model in zip(paths, models, strict=True):
        path.write_bytes(to_xml(model))
    return paths


def test_quality(checkers: Any, files: list[Path]) -> None:
    for path, report in zip(files, checkers.qc_opendrive(*files), strict=True):
        assert report.clean, (path, report)
        assert len(report.completed) >= 22
        assert not report.warnings


def test_quality_checkers_do_find_faults(checkers: Any, files: list[Path], tmp_path: Path) -> None:
    text = files[0].read_text()
    gap, form = tmp_path / "gap.xodr", tmp_path / "form.xodr"
    start = text.index("<geometry", text.index("<geometry") + 1)
    gap.write_text(text[:start] + text[start:].replace('y="', 'y="5', 1))
    form.write_text(text.replace("revMinor", "revMino", 1))
    broken, unread = checkers.qc_opendrive(gap, form)
    assert any("no_horizontal_gaps" in error for error in broken.errors)
    assert unread.incomplete
    assert not broken.clean
    assert not unread.clean


def test_schema(checkers: Any, files: list[Path]) -> None:
    schema = checkers.schema("qc_opendrive", "1.7.0/opendrive_17_core.xsd")
    for path in files:
        assert schema.validate(etree.parse(path)), (path, schema.error_log)


@pytest.mark.parametrize("name", KINDS)
def test_netconvert_takes_every_kind(checkers: Any, tmp_path: Path, name: str) -> None:
    path = tmp_path / f"{name}.xodr"
    path.write_bytes(to_xml(kind(name)))
    done = checkers.netconvert(path)
    assert done.returncode == 0, done.stderr
    assert "Error" not in done.stderr
    assert etree.parse(path.with_suffix(".net.xml")).findall("edge")


def test_netconvert(checkers: Any, files: list[Path]) -> None:
    """SUMO takes every file, and finds every way across."""
    for path in [*files[: -len(KINDS) - 1 : 4], files[-1]]:
        done = checkers.netconvert(path)
        assert done.returncode == 0, (path, done.stderr)
        assert "Error" not in done.stderr
        network = etree.parse(path.with_suffix(".net.xml"))
        found = [
            one
            for one in network.iter("connection")
            if not one.get("from", "").startswith(":") and one.get("dir") != "t"  # U-turns
        ]
        model = read(path)
        declared = {
            (connection.incoming_road, way.successor, way.sections[0].lanes[0].successors)
            for connection in model.junctions[0].connections
            for way in [model.road(connection.connecting_road)]
        }
        # Where two lanes of a leg lead into one, SUMO keeps one of the ways; elsewhere all.
        assert len(found) == len(declared)
