"""What we write stands up to ASAM's schemas and quality checkers."""

import numpy as np
import pytest
from lxml import etree

from bridgegen.openx.opendrive.from_owl import opendrive_from_owl
from bridgegen.openx.opendrive.write import to_xml as roads_to_xml
from bridgegen.openx.openscenario.from_owl import openscenario_from_owl
from bridgegen.openx.openscenario.write import to_xml

pytestmark = pytest.mark.checkers


@pytest.fixture(scope="module")
def files(individuals, town, tmp_path_factory):
    """The four scenarios over the range of their parameters, and on another map."""
    folder = tmp_path_factory.mktemp("xosc")
    paths = []
    for name in ("crossroads-s1", "crossroads-s2", "crossroads-s3", "crossroads-s4"):
        rows = [0.0, 1.0, np.random.default_rng(0).random(10)]
        sources = [individuals(name, u) for u in rows] + [individuals(name, site=town())]
        for k, source in enumerate(sources):
            paths.append(folder / f"{name}-{k}.xosc")
            paths[-1].write_bytes(to_xml(openscenario_from_owl(source, "road.xodr")))
    # the checkers look for traffic signals in it
    (folder / "road.xodr").write_bytes(roads_to_xml(opendrive_from_owl(individuals())))
    return paths


def test_files_are_valid_by_the_schema(checkers, files):
    schema = checkers.schema("qc_openscenario", "1.2.0/OpenSCENARIO.xsd")
    for path in files:
        assert schema.validate(etree.parse(path)), (path, schema.error_log)


def test_the_quality_checkers_find_nothing(checkers, files):
    for path, report in zip(files, checkers.qc_openscenario(*files), strict=True):
        assert report.clean, (path.name, report)
        assert not report.warnings, (path.name, report)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        (b'conditionEdge="none"', b'conditionEdge="never"'),
        (b'<EntityRef entityRef="bv"/>', b'<EntityRef entityRef="nobody"/>'),
    ],
)
def test_the_quality_checkers_would_find_something(checkers, s4, tmp_path, old, new):
    path = tmp_path / "broken.xosc"
    path.write_bytes(s4.replace(old, new))
    (report,) = checkers.qc_openscenario(path)
    assert report.errors
