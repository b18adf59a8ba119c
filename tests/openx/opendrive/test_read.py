"""What the reader takes, and how it names everything that is wrong with a file."""

from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.approval import approve, refuses

from bridgegen.base.errors import BridgeGenError, FileFormatError, UnsupportedError
from bridgegen.openx.opendrive.model import OpenDrive
from bridgegen.openx.opendrive.plan_view import Arc, Line
from bridgegen.openx.opendrive.read import read
from bridgegen.openx.opendrive.write import to_xml

DOCUMENT = """<?xml version="1.0"?>
<OpenDRIVE>
  <header revMajor="1" revMinor="7" name="n">
    <geoReference><![CDATA[+proj=tmerc]]></geoReference>
    <userData code="x" value="dropped"/>
  </header>
  <road id="1" length="30" junction="-1" name="north">
    <link><successor elementType="road" elementId="2" contactPoint="end"/></link>
    <type s="0" type="town"><speed max="30" unit="mph"/></type>
    <planView>
      <geometry s="0" x="0" y="0" hdg="0" length="10"><line/></geometry>
      <geometry s="10" x="10" y="0" hdg="0" length="20"><arc curvature="0.01"/></geometry>
    </planView>
    <lanes>
      <laneSection s="0">
        <center><lane id="0" type="none"/></center>
        <right>
          <lane id="-1" type="driving" level="false">
            <link><predecessor id="-1"/><successor id="-1"/></link>
            <width sOffset="0" a="3.5" b="0" c="0" d="0"/>
          </lane>
        </right>
      </laneSection>
    </lanes>
  </road>
  <road id="2" length="1e1" junction="-1">
    <planView>
      <geometry s="0" x="0" y="0" hdg="0" length="10"><line/></geometry>
    </planView>
    <lanes>
      <laneSection s="0">
        <center><lane id="0" type="none"/></center>
        <left>
          <lane id="1" type="driving"><width sOffset="0" a="3" b="0" c="0" d="0"/></lane>
        </left>
      </laneSection>
    </lanes>
  </road>
</OpenDRIVE>
"""


def refused(old: str, new: str) -> list[str]:
    """Return what the reader says of the document after a change."""
    assert old in DOCUMENT
    with pytest.raises(FileFormatError) as caught:
        read(DOCUMENT.replace(old, new, 1).encode(), "map.xodr")
    return list(caught.value.problems)


def test_what_it_says() -> None:
    model = read(DOCUMENT.encode())
    road = model.road("1")
    assert (road.name, road.length, road.rule) == ("north", 30.0, "RHT")
    assert [geometry.shape for geometry in road.plan_view] == [Line(), Arc(0.01)]
    assert road.successor is not None
    assert (road.successor.element_id, road.successor.contact_point) == ("2", "end")
    lane = road.sections[0].lane(-1)
    assert lane is not None
    assert (lane.widths[0].a, lane.predecessors, lane.successors) == (3.5, (-1,), (-1,))
    assert model.header.geo_reference == "+proj=tmerc"
    speed = road.types[0].speed
    assert speed is not None
    assert speed.metres_per_second == pytest.approx(30 * 1609.344 / 3600)  # a mile is 1609.344 m


def test_namespace() -> None:
    spelled = DOCUMENT.replace("<OpenDRIVE>", '<OpenDRIVE xmlns="http://example.org/opendrive">')
    assert read(spelled.encode()) == read(DOCUMENT.encode())


def test_path_and_bytes(tmp_path: Path) -> None:
    path = tmp_path / "map.xodr"
    path.write_text(DOCUMENT)
    assert read(path) == read(str(path)) == read(DOCUMENT.encode())
    with refuses(FileFormatError, "none.xodr"):
        read(tmp_path / "none.xodr")


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('id="1" length="30"', 'length="30"', "line 7: <road>: attribute id is required"),
        ('length="30"', 'length="-3"', "line 7: road 1: length [m] must be > 0, got '-3'"),
        ('length="30"', 'length="0"', "length [m] must be > 0, got '0'"),
        ('length="30"', 'length="NaN"', "length [m] must be a finite number, got 'NaN'"),
        ('length="30"', 'length="1e400"', "length [m] must be a finite number, got '1e400'"),
        ('length="30"', 'length="1e7"', "length [m] must be within ±1e+06, got '1e7'"),
        ('x="10"', 'x="1e10"', "line 12: road 1, <geometry>: x [m] must be within ±1e+09"),
        ('x="10"', 'x="ten"', "x [m] must be a finite number, got 'ten'"),
        ('x="10"', 'x="1_0"', "x [m] must be a finite number, got '1_0'"),
        ('lane id="-1"', 'lane id="-1.5"', "line 18: road 1, lane -1.5: id must be a whole number"),
        ('successor id="-1"', "successor", "<successor>: id must be a whole number, got ''"),
        ('level="false"', 'level="no"', "level must be true or false, got 'no'"),
        ('<arc curvature="0.01"/>', "<clothoid/>", "is required, got clothoid"),
        ('<arc curvature="0.01"/>', "<line/><line/>", "only one <line> or <arc> or <spiral>"),
        ('curvature="0.01"', 'curvature="7"', "length · curvature must be ≤ 100 rad, got 140"),
        ('curvature="0.01"', 'curvature="7e4"', "curvature [1/m] must be within ±10000, got '7e4'"),
        ('contactPoint="end"', 'contactPoint="middle"', "must be one of start, end, got 'middle'"),
        ('lane id="0"', 'lane id="1"', "line 15: road 1, <laneSection>: the center must be one"),
        ('lane id="-1"', 'lane id="1"', "lanes on the right must count from -1, got [1]"),
        ('max="30"', 'max="fast"', "max must be a finite number, got 'fast'"),
        ('unit="mph"', 'unit="knots"', "unit must be one of m/s, km/h, mph, got 'knots'"),
        ('<center><lane id="0" type="none"/></center>', "", "<center/lane> is required, got right"),
    ],
)  # fmt: skip
def test_one_thing_wrong(old: str, new: str, said: str) -> None:
    (problem,) = refused(old, new)
    assert problem.startswith("map.xodr, line ")
    assert said in problem


def test_same_id_twice() -> None:
    said = refused('road id="2"', 'road id="1"')
    approve(said, "map.xodr", "line 26")


def test_no_geometry_at_all() -> None:
    start, end = DOCUMENT.index("<planView>"), DOCUMENT.index("</planView>")
    (problem,) = refused(DOCUMENT[start : end + 11], "")
    approve(problem, "link", "line 7")


def test_everything_at_once() -> None:
    broken = (
        DOCUMENT.replace('a="3.5"', 'a="wide"')
        .replace('x="10"', "")
        .replace('length="30"', 'length="long"')
    )
    with pytest.raises(FileFormatError) as caught:
        read(broken.encode(), "map.xodr")
    assert [problem.split(":")[0] for problem in caught.value.problems] == [
        "map.xodr, line 7", "map.xodr, line 12", "map.xodr, line 20",
    ]  # fmt: skip


def test_a_thousand_things_wrong() -> None:
    roads = "\n".join('<road id="1" length="x"/>' for _ in range(1000))
    (*shown, rest) = refused("</OpenDRIVE>", f"{roads}</OpenDRIVE>")
    assert len(shown) == 20
    approve(rest, "map.xodr", "2980")  # length, planView and lanes of each


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (b"", "well-formed"),
        (b"<OpenDRIVE>", "well-formed"),
        (b"<OpenSCENARIO/>", "OpenSCENARIO"),
        (b"<OpenDRIVE/>", "line 1"),
        (b'<!DOCTYPE x [<!ENTITY e "e">]><OpenDRIVE/>', "DOCTYPE"),
        (b"<OpenDRIVE>" + b"<a>" * 100 + b"</a>" * 100 + b"</OpenDRIVE>", "nest 64 deep"),
    ],
)
def test_not_a_road_network(text: bytes, said: str) -> None:
    with refuses(FileFormatError, said):
        read(text)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (
            "</OpenDRIVE>",
            '<junction id="5" type="virtual"><connection id="0"/></junction></OpenDRIVE>',
            "line 39: junction 5: type 'virtual' is not supported",
        ),
    ],
)
def test_valid_but_not_supported(old: str, new: str, said: str) -> None:
    with pytest.raises(UnsupportedError) as caught:
        read(DOCUMENT.replace(old, new, 1).encode(), "map.xodr")
    (problem,) = caught.value.problems
    assert said in problem
    assert problem.endswith("not supported")


@pytest.mark.parametrize(
    ("shape", "said"),
    [
        (
            '<paramPoly3 aU="0" bU="0" cU="20" dU="0" aV="0" bV="0" cV="0" dV="0" '
            'pRange="normalized"/>',
            "must have a direction everywhere",
        ),
        (
            '<paramPoly3 aU="0" bU="1" cU="0" dU="0" aV="0" bV="0" cV="0" dV="0" '
            'pRange="normalized"/>',
            "length [m] must be the length of the paramPoly3, 1, got 20",
        ),
        ('<spiral curvStart="0" curvEnd="9"/>', "must be ≤ 100 rad, got 180"),
        ('<poly3 a="0" b="0" c="1e9" d="1e9"/>', "must rise by ≤ 10 m per metre"),
    ],
)
def test_shapes_that_cannot_be_followed(shape: str, said: str) -> None:
    (problem,) = refused('<arc curvature="0.01"/>', shape)
    approve(problem, "line 12", "road 1")
    assert said in problem


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('incomingRoad="2"', 'incomingRoad="77"', "incomingRoad '77' is not in the file"),
        ('connectingRoad="101"', 'connectingRoad="77"', "connectingRoad '77' is not in the file"),
        (
            'connectingRoad="101"',
            'connectingRoad="1"',
            "must be of this junction, got junction '-1'",
        ),
        ('from="1" to="-1"', 'from="7" to="-1"', "road 1 has no lane 7 there"),
        ('from="1" to="-1"', 'from="1" to="-7"', "has no lane -7 there"),
        ('<junction id="100"', '<junction id="99"', "junction '100' is not in the file"),
    ],
)
def test_links_to_nothing_are_left_out_and_said(
    old: str, new: str, said: str, crossroads: Callable[..., OpenDrive]
) -> None:
    text = to_xml(crossroads()).decode()
    assert old in text
    broken = text.replace(old, new, 1)
    warnings: list[str] = []
    read(broken.encode(), "map.xodr", warnings)
    (problem, *_) = [one for one in warnings if said in one]
    line = int(problem.split("line ")[1].split(":")[0])
    assert line <= len(broken.splitlines())
    assert any(
        tag in broken.splitlines()[line - 1] for tag in ("<road", "<junction", "<connection")
    )


def test_a_whole_number_beyond_all_floats_is_one_clear_error() -> None:
    huge = "9" * 400
    read(DOCUMENT.replace('revMinor="7"', f'revMinor="{huge}"').encode())  # taken for the default
    with refuses(FileFormatError):
        read(DOCUMENT.replace('<lane id="-1"', f'<lane id="-{huge}"', 1).encode())


@given(st.data())
def test_any_damage_is_one_clear_error(data: st.DataObject) -> None:
    """Cut, doubled, or overwritten anywhere: a model or one of our errors, never another."""
    text = DOCUMENT.encode()
    at = data.draw(st.integers(0, len(text) - 1))
    length = data.draw(st.integers(0, 30))
    put = data.draw(st.sampled_from([b"", b'"', b"<", b"0", b"-1", b"nan", b"9" * 400, b"\xff"]))
    try:
        read(text[:at] + put + text[at + length :])
    except BridgeGenError:
        return
