"""What esmini is given to read, and what is read of what it writes."""

from dataclasses import replace

import numpy as np
import pytest
from lxml import etree

from bridgegen.openx.opendrive.read import read as read_roads
from bridgegen.openx.openscenario.read import read
from bridgegen.openx.source import source_of
from bridgegen.scenario.language.reader import load
from bridgegen.simulation.esmini.files import RoadFiles, ScenarioFile
from bridgegen.simulation.esmini.process import error_in

from ..embedded.storyboards import (
    after,
    crossroads,
    event,
    events,
    lane,
    scenario,
    speed_action,
    speeding,
    start,
)

DRIVER = """<ObjectController><Controller name="d"><Properties><Property name="driver"
value="reference"/></Properties></Controller></ObjectController></ScenarioObject>"""
SWITCH = """<ControllerAction><ActivateControllerAction lateral="false" longitudinal="false"/>
</ControllerAction>"""
FOLLOW = """<RoutingAction><FollowTrajectoryAction><TimeReference>
<Timing domainAbsoluteRelative="absolute" scale="1" offset="0"/></TimeReference>
<TrajectoryFollowingMode followingMode="position"/><TrajectoryRef><Trajectory name="t"
closed="false"><Shape><Polyline><Vertex time="1"><Position><WorldPosition x="1" y="2" h="0"/>
</Position></Vertex><Vertex time="2"><Position><WorldPosition x="3" y="2" h="0"/></Position>
</Vertex></Polyline></Shape></Trajectory></TrajectoryRef></FollowTrajectoryAction></RoutingAction>"""
TEXT = scenario(
    ("ego", "bv"),
    start("ego", lane(3, 1, 40), "${$v / 3}") + start("bv", lane(2, 1, 50), "$v"),
    events(
        ("one", "bv", speeding("$v", "linear rate 2"), after(1)),
        ("two", "ego", SWITCH, after(2)),
        ("way", "bv", FOLLOW, after(3)),
    ),
    parameters='<ParameterDeclaration name="v" parameterType="double" value="1"/>'
    '<ParameterDeclaration name="n" parameterType="int" value="1"/>',
).replace("</ScenarioObject>", DRIVER)


def written(tmp_path, ego="ego", values=None, course=None):
    storyboard = read(TEXT.encode(), "test.xosc")
    out = tmp_path / "row.xosc"
    driven = (ego,) if ego else ()
    template = ScenarioFile(storyboard, driven).on(tmp_path / "map.xodr", course or {})
    template.write(out, {"v": 1.0, "n": 1.0} | (values or {}))
    return etree.parse(out).getroot()


def test_an_ego_that_is_driven_waits_to_be_told(tmp_path):
    root = written(tmp_path)
    assert root.find(".//ObjectController") is None
    (assign,) = root.iter("AssignControllerAction")
    assert dict(assign.attrib) == {"activateLateral": "true", "activateLongitudinal": "true"}
    assert assign.find(".//Property").get("value") == "ExternalController"
    private = next(assign.iterancestors("Private"))
    assert private.get("entityRef") == "ego"
    (switch,) = root.iter("ActivateControllerAction")  # the event leaves it at the wheel
    assert dict(switch.attrib) == {"lateral": "true", "longitudinal": "true"}


def test_an_ego_that_is_not_has_no_controller(tmp_path):
    root = written(tmp_path, ego=None)
    assert root.find(".//ObjectController") is None
    assert root.find(".//AssignControllerAction") is None


def test_values_and_expressions_are_written_in_full(tmp_path):
    root = written(tmp_path, values={"v": 1 / 3, "n": 7.0})
    declared = {one.get("name"): one.get("value") for one in root.iter("ParameterDeclaration")}
    assert declared == {"v": repr(1 / 3), "n": "7"}
    speeds = [one.get("value") for one in root.iter("AbsoluteTargetSpeed")]
    assert speeds == [repr(1 / 3 / 3), "$v", "$v"]


def test_rows_of_one_template_do_not_stain_each_other(tmp_path):
    storyboard = read(TEXT.encode(), "test.xosc")
    template = ScenarioFile(storyboard, ("ego",)).on(tmp_path / "map.xodr", {})
    data = []
    for v in (1.0, 2.0, 1.0, float("inf")):
        template.write(tmp_path / "row.xosc", {"v": v, "n": 1.0})
        data.append((tmp_path / "row.xosc").read_bytes())
    assert data[0] == data[2] != data[1]
    assert b'"${$v / 3}"' in data[3]  # has no value: no other row's stays


def test_a_course_takes_the_place_of_the_trajectory(tmp_path):
    course = np.array([[1.0, 5.0, 6.0, 0.1], [1.5, 7.0, 6.5, 0.2], [2.5, 9.0, 7.0, 0.3]])
    root = written(tmp_path, course={"bv": course})
    found = [
        [float(vertex.get("time"))]
        + [float(vertex.find(".//WorldPosition").get(name)) for name in "xyh"]
        for vertex in root.iter("Vertex")
    ]
    np.testing.assert_array_equal(found, course)


def test_events_have_esmini_s_names(tmp_path):
    storyboard = read(TEXT.encode(), "test.xosc")
    assert ScenarioFile(storyboard, ("ego",)).event_paths() == [
        "s::a::gone::m::one", "s::a::gtwo::m::two", "s::a::gway::m::way",
    ]  # fmt: skip


def bare(model):
    roads = tuple(replace(road, objects=()) for road in model.roads)
    return replace(model, header=replace(model.header, geo_reference=None), roads=roads)


def test_a_map_goes_without_scenery_and_place_on_the_globe():
    """esmini calls most kinds of both errors."""
    logical = load("pedestrian-at-night")
    defaults = {name: one.default for name, one in logical.parameters.items()}
    model = source_of(logical, "route-follower").roads(defaults)
    assert any(road.objects for road in model.roads)
    header = replace(model.header, geo_reference="+proj=utm +zone=32 +no_defs")
    files = RoadFiles([replace(model, header=header)])
    assert read_roads(files.paths[0]) == bare(model)


def test_a_text_that_looks_like_an_expression_stays(tmp_path):
    text = TEXT.replace('Event name="one"', 'Event name="${one + _ + $v}"')
    out = tmp_path / "row.xosc"
    file = ScenarioFile(read(text.encode(), "t"), ("ego",))
    file.on(tmp_path / "m.xodr", {}).write(out, {"v": 1.0})
    assert b'name="${one + _ + $v}"' in out.read_bytes()


def test_roads_are_written_once_and_go_with_their_owner():
    one, other = crossroads(), crossroads(lane_width=3.0)
    files = RoadFiles([one, other, one])
    assert files.paths[0] == files.paths[2] != files.paths[1]
    assert read_roads(files.paths[1]) == bare(other)
    folder = files.paths[0].parent
    del files
    assert not folder.exists()


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", None),
        ("[] [info] no [warn]\n[0.1] [warn] a model is not there\n", None),
        ("[] [info] x\n[1.050] [error] Failed\n[2] [error] later\n", "Failed"),
        ("[] [error] " + "x" * 999, "x" * 300),
        (
            '[] [error] INFO: signal element "signalReference" not supported yet\n'
            "[] [error] lane 9 does not exist\n",
            "lane 9 does not exist",
        ),
        ('[] [error] INFO: signal element "signalReference" not supported yet\n', None),
    ],
)
def test_the_first_error_of_a_log(tmp_path, text, said):
    log = tmp_path / "esmini.log"
    log.write_text(text)
    assert error_in(log) == said


def test_no_log_tells_of_no_error(tmp_path):
    assert error_in(tmp_path / "none.log") is None


def test_an_event_s_action_on_speed_stays(tmp_path):
    """What the storyboard asks of the ego stays in the file: esmini leaves it to the controller."""
    text = scenario(
        ("ego",), start("ego", lane(3, 1, 40), 5), event("ego", speed_action(3), after(1))
    )
    out = tmp_path / "row.xosc"
    ScenarioFile(read(text.encode(), "t"), ("ego",)).on(tmp_path / "m.xodr", {}).write(out, {})
    assert len([*etree.parse(out).getroot().iter("SpeedAction")]) == 2
