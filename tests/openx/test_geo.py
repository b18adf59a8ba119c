"""Positions by latitude and longitude: by known numbers, by laws, and what is refused."""

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.approval import refuses

from bridgegen.base.errors import FileFormatError, InputError
from bridgegen.engine.simulate import simulate_file
from bridgegen.openx.geo import on_plane, projection
from bridgegen.openx.opendrive.model import Header, Offset, OpenDrive
from bridgegen.openx.openscenario.read import read

pyproj = pytest.importorskip("pyproj")

CARLA = (
    "+proj=tmerc +lat_0=4.9e1 +lon_0=8e0 +k=1 +x_0=0 +y_0=0 +datum=WGS84 +units=m "
    "+geoidgrids=egm96_15.gtx +vunits=m +no_defs"
)
SCENARIO = """<?xml version="1.0"?><OpenSCENARIO><FileHeader revMajor="1" revMinor="2"
date="2026-01-01T00:00:00" description="d" author="a"/>
<ParameterDeclarations><ParameterDeclaration name="lat" parameterType="double" value="49"/>
</ParameterDeclarations><CatalogLocations/>
<RoadNetwork><LogicFile filepath="map.xodr"/></RoadNetwork><Entities><ScenarioObject name="walker">
<Pedestrian name="p" pedestrianCategory="pedestrian" mass="80"><BoundingBox>
<Center x="0" y="0" z="0.9"/><Dimensions width="0.6" length="0.4" height="1.8"/></BoundingBox>
</Pedestrian></ScenarioObject></Entities><Storyboard><Init><Actions><Private entityRef="walker">
<PrivateAction><TeleportAction><Position>{}</Position></TeleportAction></PrivateAction></Private>
</Actions></Init><StopTrigger><ConditionGroup><Condition name="c" delay="0" conditionEdge="none">
<ByValueCondition><SimulationTimeCondition value="1" rule="greaterOrEqual"/></ByValueCondition>
</Condition></ConditionGroup></StopTrigger></Storyboard></OpenSCENARIO>"""
MAP = """<OpenDRIVE><header revMajor="1" revMinor="7"><geoReference><![CDATA[{}]]></geoReference>
{}</header><road id="1" length="100" junction="-1"><planView><geometry s="0" x="0" y="0" hdg="0"
length="100"><line/></geometry></planView><lanes><laneSection s="0"><center><lane id="0"
type="none"/></center><right><lane id="-1" type="driving"><width sOffset="0" a="3.5" b="0" c="0"
d="0"/></lane></right></laneSection></lanes></road></OpenDRIVE>"""
PLACE = '<GeoPosition latitudeDeg="49.01" longitudeDeg="8.02"/>'


def files(folder: Path, place: str = PLACE, geo: str = CARLA, offset: str = "") -> Path:
    (folder / "map.xodr").write_text(MAP.format(geo, offset))
    (folder / "s.xosc").write_text(SCENARIO.format(place))
    return folder / "s.xosc"


def where(path: Path) -> tuple[float, float, float]:
    rollout = simulate_file(path).rollout
    return tuple(float(getattr(rollout, name)[0, 0, 0]) for name in "xyh")  # type: ignore[return-value]


def metres_per_degree(latitude: float) -> float:
    """Metres per degree of latitude on WGS 84, to a millimetre (Bugayevskiy, Snyder)."""
    p = math.radians(latitude)
    series = 111132.92, -559.82, 1.175, -0.0023
    return sum(a * math.cos(2 * k * p) for k, a in enumerate(series))


def test_a_start_by_latitude_and_longitude(tmp_path):
    """On the central meridian x is 0, and y the arc of the meridian."""
    place = (
        '<GeoPosition latitudeDeg="49.01" longitudeDeg="8"><Orientation type="absolute" h="0.5"/>'
    )
    x, y, h = where(files(tmp_path, place + "</GeoPosition>"))
    assert (x, h) == (pytest.approx(0.0, abs=1e-6), 0.5)
    assert y == pytest.approx(0.01 * metres_per_degree(49.005), abs=2e-3)


def test_radians_of_version_1_1_are_the_same_place(tmp_path):
    old = f'<GeoPosition latitude="{math.radians(49.01)}" longitude="{math.radians(8.02)}"/>'
    assert where(files(tmp_path, old)) == pytest.approx(where(files(tmp_path)), abs=1e-6)


def test_the_offset_of_the_header(tmp_path):
    """What is on the map is moved by the offset, and then turned, to be on the globe."""
    plain = np.array(where(files(tmp_path))[:2])
    moved = where(files(tmp_path, offset='<offset x="700" y="1000" z="0" hdg="0"/>'))
    assert moved[:2] == pytest.approx(plain - (700.0, 1000.0))
    turn = 0.3
    x, y, h = where(files(
        tmp_path, PLACE.replace("/>", '><Orientation type="absolute" h="0.5"/></GeoPosition>'),
        offset=f'<offset x="700" y="1000" z="0" hdg="{turn}"/>',
    ))  # fmt: skip
    c, s = math.cos(turn), math.sin(turn)
    again = np.array([[c, -s], [s, c]]) @ (x + 700.0, y + 1000.0)
    assert again == pytest.approx(plain)
    assert h == pytest.approx(0.5 - turn)


@given(st.floats(-5e4, 5e4), st.floats(-5e4, 5e4), st.floats(-3.0, 3.0), st.floats(-1e5, 1e5))
def test_there_and_back(x, y, turn, offset):
    header = Header(1, 7, geo_reference="EPSG:25832", offset=Offset(offset, 5.4e6, 0.0, turn))
    east = math.cos(turn) * (x + offset) - math.sin(turn) * (y + 5.4e6)
    north = math.sin(turn) * (x + offset) + math.cos(turn) * (y + 5.4e6)
    back = pyproj.Transformer.from_crs("EPSG:25832", "EPSG:4326", always_xy=True)
    longitude, latitude = back.transform(east, north)
    if abs(longitude - 9.0) < 3.0 and abs(latitude) < 80.0:
        assert projection(header, "m")(longitude, latitude) == pytest.approx((x, y), abs=1e-3)


@pytest.mark.parametrize(
    ("place", "geo", "message"),
    [
        (PLACE, "", "geoReference"),
        (PLACE, "nonsense", "geoReference"),
        ('<GeoPosition latitudeDeg="$lat" longitudeDeg="8"/>', CARLA,
         "line 9"),
        ('<GeoPosition latitudeDeg="49"/>', CARLA, "line 9"),
        ('<GeoPosition latitudeDeg="49" longitudeDeg="8"><Orientation type="relative" h="1"/>'
         "</GeoPosition>", CARLA, "line 9"),
    ],
)  # fmt: skip
def test_what_cannot_be_projected_is_refused_by_its_line(tmp_path, place, geo, message):
    with refuses(FileFormatError, message):
        simulate_file(files(tmp_path, place, geo))


def test_an_orientation_without_a_type_is_relative_from_1_3_on(tmp_path):
    place = PLACE.replace("/>", '><Orientation h="0.5"/></GeoPosition>')
    path = files(tmp_path, place)
    assert where(path)[2] == 0.5
    path.write_text(path.read_text().replace('revMinor="2"', 'revMinor="3"'))
    with refuses(FileFormatError):
        simulate_file(path)


def test_without_the_extra_one_is_told_its_name(tmp_path, monkeypatch):
    monkeypatch.setattr("bridgegen.base.extras.is_installed", lambda extra: extra != "geo")
    with refuses(InputError, "geo", "GeoPosition"):
        simulate_file(files(tmp_path))


def test_a_scenario_without_them_comes_back_as_it_is(tmp_path):
    scenario = read(files(tmp_path, '<WorldPosition x="1" y="2"/>'))
    assert on_plane(scenario, OpenDrive(Header(1, 7)), "s") is scenario
