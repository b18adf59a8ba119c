"""What other tools' maps have that is not as it should be: read, repaired, and said."""

import pytest
from tests.approval import approve
from tests.openx.opendrive.test_read import DOCUMENT

from bridgegen.openx.opendrive.lanes import lane_pose
from bridgegen.openx.opendrive.model import OpenDrive
from bridgegen.openx.opendrive.read import read

WIDTH = '<width sOffset="0" a="3.5" b="0" c="0" d="0"/>'


def repaired(*changes: tuple[str, str]) -> tuple[OpenDrive, list[str]]:
    """Return the document after changes, as it is read, and what is said of it."""
    text = DOCUMENT
    for old, new in changes:
        assert old in text
        text = text.replace(old, new, 1)
    warnings: list[str] = []
    return read(text.encode(), "map.xodr", warnings), warnings


def test_a_sound_file_has_no_warnings() -> None:
    assert repaired()[1] == []


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (DOCUMENT[DOCUMENT.index("  <header") : DOCUMENT.index("  <road")], "", "<header> is miss"),
        ('revMajor="1"', 'revMajor="one"', "line 3: <header>: revMajor is 'one', read as 1"),
        (WIDTH, f'{WIDTH}<roadMark sOffset="0" type="solid" height="-0.13"/>',
         "<roadMark>: height [m] must be ≥ 0, got '-0.13'; passed over"),
        (WIDTH, f'{WIDTH}<roadMark type="solid"/>',
         "line 20: road 1, lane -1, <roadMark>: attribute sOffset is required; the roadMark is"),
        ("</planView>", '</planView><elevationProfile><elevation a="1"/></elevationProfile>',
         "<elevation>: attribute s is required; the elevation is left out"),
        ('<arc curvature="0.01"/>', '<spiral curvStart="-100" curvEnd="100"/>',
         "line 12: road 1, <geometry>: a curvature of 100 /m turns within 0.01 m"),
        ('elementId="2"', 'elementId="9"', "line 7: road 1: its successor, road '9', is not in"),
        ('elementType="road"', 'elementType="junction"', "junction '2', is not in the file"),
        ('junction="-1" name', 'junction="5" name', "line 7: road 1: junction '5' is not in"),
        ('contactPoint="end"', "", "road '2', needs a contactPoint: read as the road's end"),
    ],
)  # fmt: skip
def test_read_with_a_warning(old: str, new: str, said: str) -> None:
    length = ('length="20"', 'length="0.5"') if "spiral" in new else ('length="20"', 'length="20"')
    warnings = repaired(length, (old.replace(*length), new))[1]
    assert any(said in warning for warning in warnings), warnings


def test_many_of_one_kind_are_one_warning() -> None:
    corner = '<cornerLocal u="0" v="0" z="0"/>'
    (warning,) = repaired(
        ("</lanes>", '</lanes><objects><object id="7" s="1" t="2" type="building"><outline>'
         f"{corner * 5}</outline></object></objects>"),
    )[1]  # fmt: skip
    approve(warning, "cornerLocal")


def test_an_object_that_has_no_place_is_left_out() -> None:
    model, warnings = repaired(("</lanes>", '</lanes><objects><object id="7" t="1"/></objects>'))
    assert model.road("1").objects == ()
    assert ["attribute s is required; the object is left out" in one for one in warnings] == [True]


def test_borders_are_read_as_widths() -> None:
    outer = (
        '<lane id="-2" type="driving">'
        '<border sOffset="0" a="-5" b="0" c="0" d="0"/>'
        '<border sOffset="10" a="-5" b="-0.1" c="0" d="0"/></lane></right>'
    )
    border = '<border sOffset="0" a="-3" b="0" c="0" d="0"/>'
    model, warnings = repaired((WIDTH, border), ("</right>", outer))
    assert ["borders of lanes are read as widths" in one for one in warnings] == [True]
    road = model.road("1")
    # By hand: the second border lies at -5 m, from s=10 m on at -5 - 0.1 (s - 10).
    assert lane_pose(road, -1, 5.0)[:2] == pytest.approx((5.0, -1.5))
    assert lane_pose(road, -1, 5.0).width == pytest.approx(3.0)
    assert lane_pose(road, -2, 5.0).width == pytest.approx(2.0)
    assert lane_pose(road, -2, 20.0).width == pytest.approx(3.0)


def test_lanes_that_do_not_count_from_the_centre() -> None:
    model, warnings = repaired(('lane id="-1"', 'lane id="-3"'))
    approve(warnings[0], "count")
    section = model.road("1").sections[0]
    assert [(one.id, one.type) for one in section.right] == [
        (-1, "none"), (-2, "none"), (-3, "driving"),
    ]  # fmt: skip
    assert lane_pose(model.road("1"), -3, 5.0)[1] == pytest.approx(-1.75)  # as lane -1 would be


def test_a_width_beyond_its_section() -> None:
    model, warnings = repaired((WIDTH, WIDTH + WIDTH.replace('"0"', '"45"', 1)))
    approve(warnings[0], "45 m", "30 m")
    assert len(model.road("1").sections[0].right[0].widths) == 1


def test_a_road_that_is_longer_than_its_geometry() -> None:
    model, warnings = repaired(('length="30"', 'length="200"'))
    approve(warnings[0], "200 m", "30 m")
    assert model.road("1").length == 30.0


def test_a_geometry_without_length_is_left_out() -> None:
    model, warnings = repaired(
        ('<geometry s="10"', '<geometry s="10" x="10" y="0" hdg="0" length="0"><line/></geometry>'
         '<geometry s="10"'),
    )  # fmt: skip
    approve(warnings[0], "0 m")
    assert len(model.road("1").plan_view) == 2


def test_a_junction_link_that_only_one_side_has() -> None:
    junction = (
        '<road id="9" length="5" junction="8"><link>'
        '<predecessor elementType="road" elementId="2" contactPoint="start"/></link>'
        '<planView><geometry s="0" x="0" y="0" hdg="3.14159" length="5"><line/></geometry>'
        '</planView><lanes><laneSection s="0"><center><lane id="0"/></center><right>'
        f'<lane id="-1" type="driving">{WIDTH}</lane></right></laneSection></lanes></road>'
        '<junction id="8"><connection id="0" incomingRoad="2" connectingRoad="9">'
        '<laneLink from="1" to="-1"/></connection></junction></OpenDRIVE>'
    )
    model, warnings = repaired(("</OpenDRIVE>", junction))
    approve(warnings, "road 2")
    approve(warnings, "contactPoint")
    assert model.road("2").ends_at("8") == ["start"]
    assert len(model.junction("8").connections) == 1
