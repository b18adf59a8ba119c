"""Direct junctions: roads that meet without connecting roads, as at a motorway's exit."""

import pytest
from tests.approval import approve, refuses

from bridgegen.base.errors import UnsupportedError
from bridgegen.openx.opendrive.from_owl import opendrive_from_owl
from bridgegen.openx.opendrive.lane_graph import LaneGraph
from bridgegen.openx.opendrive.map_names import lane_name
from bridgegen.openx.opendrive.read import read
from bridgegen.openx.opendrive.routes import plan_route
from bridgegen.openx.opendrive.site import turned_sites
from bridgegen.openx.opendrive.to_owl.network import individuals_from_opendrive
from bridgegen.openx.opendrive.validate import problems
from bridgegen.openx.opendrive.write import to_xml
from bridgegen.scenario.ontology.check import check
from bridgegen.scenario.ontology.graph import Individuals
from bridgegen.scenario.ontology.vocabulary import local_name

WIDTH = '<width sOffset="0" a="4" b="0" c="0" d="0"/>'


def road(number: int, x: float, y: float, link: str, left: int, right: int) -> str:
    """A straight road of 50 m to the east, with so many lanes of 4 m."""

    def lanes(side: str, ids: list[int]) -> str:
        each = "".join(f'<lane id="{i}" type="driving" level="false">{WIDTH}</lane>' for i in ids)
        return f"<{side}>{each}</{side}>" if ids else ""

    return f"""<road id="{number}" length="50" junction="-1"><link>{link}</link><planView>
<geometry s="0" x="{x}" y="{y}" hdg="0" length="50"><line/></geometry></planView><lanes>
<laneSection s="0">{lanes("left", list(range(left, 0, -1)))}<center>
<lane id="0" type="none" level="false"/></center>
{lanes("right", list(range(-1, -right - 1, -1)))}</laneSection></lanes></road>"""


IN = '<successor elementType="junction" elementId="9"/>'
OUT = '<predecessor elementType="junction" elementId="9"/>'
CONNECTIONS = """<connection id="0" incomingRoad="1" linkedRoad="2" contactPoint="start">
<laneLink from="-1" to="-1"/><laneLink from="1" to="1"/></connection>
<connection id="1" incomingRoad="1" linkedRoad="3" contactPoint="start">
<laneLink from="-2" to="-1"/></connection>"""


def document(connections: str = CONNECTIONS, out: str = OUT) -> bytes:
    """A road with an oncoming lane, whose rightmost lane goes on as a road of its own."""
    roads = road(1, 0, 0, IN, 1, 2) + road(2, 50, 0, OUT, 1, 1) + road(3, 50, -4, out, 0, 1)
    return f"""<OpenDRIVE><header revMajor="1" revMinor="8"/>{roads}
<junction id="9" name="exit" type="direct">{connections}</junction></OpenDRIVE>""".encode()


def test_lanes_go_on_in_both_directions_of_traffic():
    model = read(document(), "exit.xodr")
    route = plan_route(model, ("1", -2, 10.0), [], ("3", -1, 20.0))
    assert [(step.road_id, step.lane_id) for step in route.steps] == [("1", -2), ("3", -1)]
    assert route.length == pytest.approx(60.0)
    back = plan_route(model, ("2", 1, 20.0), [], ("1", 1, 10.0))
    assert [(step.road_id, step.lane_id) for step in back.steps] == [("2", 1), ("1", 1)]
    graph = LaneGraph(model)
    assert graph.following[graph.node("1", -1, 10.0)] == (graph.node("2", -1, 10.0),)
    assert graph.following[graph.node("1", 1, 10.0)] == ()
    assert list(problems(model)) == []


def test_what_is_written_is_what_was_read():
    model = read(document(), "exit.xodr")
    text = to_xml(model)
    assert b'linkedRoad="3"' in text
    assert b'type="direct"' in text
    assert b"connectingRoad" not in text
    assert read(text, "again.xodr") == model


def test_lanes_that_do_not_meet_are_named():
    model = read(document(CONNECTIONS.replace('from="-2" to="-1"', 'from="-1" to="-1"')), "a.xodr")
    found = list(problems(model))
    approve(found, "lane -1", "road 3", "lane -2", "road 1")


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        (
            {"connections": CONNECTIONS.replace("linkedRoad", "connectingRoad")},
            "it has no linkedRoad",
        ),
        (
            {"connections": CONNECTIONS.replace(' contactPoint="start"', "")},
            "needs the contactPoint",
        ),
        ({"connections": CONNECTIONS.replace('"3"', '"7"')}, "linkedRoad '7' is not in the file"),
        ({"connections": CONNECTIONS.replace('to="-1"', 'to="-5"')}, "road 2 has no lane -5"),
        ({"out": ""}, "it needs the contactPoint of road 3"),
    ],
)
def test_links_that_lead_nowhere_are_left_out(wrong: dict[str, str], said: str):
    warnings: list[str] = []
    (before,) = read(document(), "exit.xodr").junctions
    (after,) = read(document(**wrong), "exit.xodr", warnings).junctions
    assert len(after.connections) < len(before.connections)
    assert any(said in warning for warning in warnings)


def test_the_ontology_has_it_with_its_lanes():
    model = read(document(), "exit.xodr")
    found = individuals_from_opendrive(model, "exit.xodr")
    (junction,) = found.of_class("DirectJunction")
    assert len(found.links(junction, "has_leg")) == 3
    assert not found.links(junction, "has_inner_road")
    lanes = {
        tuple(local_name(found.link(link, name)) for name in ("from_lane", "to_lane"))
        for connection in found.links(junction, "has_connection")
        for link in found.links(connection, "has_lane_link")
    }
    names = [lane_name("1", 0, -1), lane_name("2", 0, -1), lane_name("3", 0, -1)]
    assert {(names[0], names[1]), (lane_name("1", 0, -2), names[2])} <= lanes
    assert len(lanes) == 3
    assert check(found) == []
    unnamed = [quad for quad in found.quads if local_name(quad.predicate) != "has_map_file"]
    with refuses(UnsupportedError, "direct junction"):  # there is no file of the map any more
        opendrive_from_owl(Individuals(unnamed))


def test_a_place_of_the_map_says_what_it_is():
    headings = {"A": 180.0, "B": 0.0, "C": 0.0}
    assert {site.kind for site in turned_sites(read(document()), None, None, headings)} == {
        "DirectJunction"
    }


def test_virtual_junctions_are_refused_by_name():
    with refuses(UnsupportedError, "virtual"):
        read(document().replace(b'"direct"', b'"virtual"'), "exit.xodr")
