"""Entries of catalogues in the files of strangers, and of enemies."""

import os
from itertools import pairwise

import pytest
from tests.approval import approve, refuses

from bridgegen.base.errors import FileFormatError, UnsupportedError
from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario import validate
from bridgegen.openx.openscenario.element import walk
from bridgegen.openx.openscenario.expand import MAX_ELEMENTS
from bridgegen.openx.openscenario.read import read
from bridgegen.openx.openscenario.write import to_xml

from .files import (
    car,
    catalog,
    declared,
    entity,
    location,
    maneuver,
    parameter,
    reference,
    scenario,
    speed,
    story,
    written,
)

CARS = location("Vehicle", "catalogs")


@pytest.fixture
def file(tmp_path):
    """Writes a scenario of one entity that is a reference, and what lies in its catalogues."""

    def make(body: str = reference("cars", "small"), **catalogs: str):
        written(tmp_path / "catalogs", **catalogs)
        return written(tmp_path, scenario=scenario(entities=entity(body), locations=CARS))

    return make


def refused(path, error=FileFormatError) -> str:
    with pytest.raises(error) as caught:
        read(path)
    return str(caught.value)


def test_an_entry_stands_where_it_is_referred_to(file):
    path = file(cars=catalog("cars", car("large", "2.5"), car("small", "1.5")))
    found = read(path)
    assert found.entities.scenario_objects[0].entity_object.name == "small"
    assert found.catalog_locations == osc.CatalogLocations()
    assert read(to_xml(found)) == found


def test_a_catalogue_may_be_called_by_its_file(file):
    path = file(reference("mine", "small"), mine=catalog("another", car("small")))
    assert read(path).entities.scenario_objects[0].entity_object.name == "small"


def test_a_catalogue_of_one_name_may_be_in_several_files(file):
    path = file(a=catalog("cars", car("large")), b=catalog("cars", car("small")))
    assert read(path).entities.scenario_objects[0].entity_object.name == "small"


def test_parameters_have_what_they_are_given_or_their_own(file, tmp_path):
    entry = car(
        "small", "$width", "${$top / 2}",
        declared(parameter("width", "double", "1.5"), parameter("top", "double", "50")),
    )  # fmt: skip
    path = file(cars=catalog("cars", entry))
    body = read(path).entities.scenario_objects[0].entity_object
    assert (body.bounding_box.dimensions.width, float(body.performance.max_speed.resolve({}))
            if isinstance(body.performance.max_speed, osc.Expr)
            else body.performance.max_speed) == (1.5, 25.0)  # fmt: skip
    text = scenario(
        declared=declared(parameter("top", "double", "40")),
        entities=entity(reference("cars", "small", width="2", top="$top")),
        locations=CARS,
    )
    body = read(written(tmp_path, scenario=text)).entities.scenario_objects[0].entity_object
    assert body.bounding_box.dimensions.width == 2.0
    assert float(body.performance.max_speed.resolve({"top": 60.0})) == 30.0


@pytest.mark.parametrize("kind", ["Maneuver", "Route", "Trajectory", "Environment", "Controller"])
def test_every_kind_of_entry(tmp_path, kind):
    spot = '<Position><WorldPosition x="$x" y="0"/></Position>'
    x = declared(parameter("x", "double", "1"))
    way = f'<Waypoint routeStrategy="shortest">{spot}</Waypoint>' * 2
    line = f"<Shape><Polyline>{f'<Vertex>{spot}</Vertex>' * 2}</Polyline></Shape>"
    entries = {
        "Maneuver": maneuver(speed("$x"), declared=x, name="e"),
        "Route": f'<Route name="e" closed="false">{x}{way}</Route>',
        "Trajectory": f'<Trajectory name="e" closed="false">{x}{line}</Trajectory>',
        "Environment": f'<Environment name="e">{x}<Weather><Fog visualRange="$x"/></Weather>'
                       "</Environment>",
        "Controller": f'<Controller name="e">{x}<Properties><Property name="p" value="$x"/>'
                      "</Properties></Controller>",
    }  # fmt: skip
    ref = reference("c", "e", x="7")
    follow = (
        "<PrivateAction><RoutingAction><FollowTrajectoryAction>{}<TimeReference><None/>"
        '</TimeReference><TrajectoryFollowingMode followingMode="position"/>'
        "</FollowTrajectoryAction></RoutingAction></PrivateAction>"
    )
    uses = {
        "Maneuver": {"stories": story(ref)},
        "Route": {"init": f'<Private entityRef="ego"><PrivateAction><RoutingAction>'
                          f"<AssignRouteAction>{ref}</AssignRouteAction></RoutingAction>"
                          "</PrivateAction></Private>"},
        "Trajectory": {"init": f'<Private entityRef="ego">{follow.format(ref)}'
                               f"{follow.format(f'<TrajectoryRef>{ref}</TrajectoryRef>')}"
                               "</Private>"},
        "Environment": {"init": "<GlobalAction><EnvironmentAction>" + ref
                                + "</EnvironmentAction></GlobalAction>"},
        "Controller": {"entities": entity(car() + f"<ObjectController>{ref}</ObjectController>")},
    }  # fmt: skip
    written(tmp_path / "there", c=catalog("c", entries[kind]))
    path = written(tmp_path, s=scenario(locations=location(kind, "there"), **uses[kind]))
    found = read(path)
    cls = getattr(osc, kind)
    there = [one for one in walk(found) if isinstance(one, cls)]
    assert there
    for one in there:
        assert one.name == "e"
        values = [getattr(below, field) for below in walk(one)
                  for field in ("x", "value", "visual_range") if hasattr(below, field)]  # fmt: skip
        assert 7.0 in values or "7" in values
    assert read(to_xml(found)) == found


def test_lines_say_which_file_they_are_of(file):
    path = file(cars=catalog("cars", "\n\n" + car("small", "-1")))
    (problem,) = validate.problems(read(path))
    approve(problem, "line 3")
    assert problem.endswith("cars.xosc)")


def test_what_is_wrong_in_an_entry_is_said_with_its_file_and_line(file):
    path = file(cars=catalog("cars", car("large", "bad"), "\n" + car("small", "wide", speed="$no")))
    said = refused(path)
    approve(said, "wide", "cars.xosc")
    assert "large" not in said
    path = file(cars=catalog("cars", "\n" + car("small", speed="$no")))
    approve(refused(path), "line 2")
    path = file(cars=catalog("cars", "\n" + car("small").replace("<Axles>", "<Wings/><Axles>")))
    approve(refused(path, UnsupportedError), "cars.xosc", "line 2")
    skipped: list[str] = []
    assert read(path, skipped=skipped).entities.scenario_objects[0].entity_object.name == "small"
    assert len(skipped) == 1


@pytest.mark.parametrize(
    ("body", "text"),
    [
        (reference("cars", "huge"), "has no Vehicle or Pedestrian or MiscObject 'huge'"),
        (reference("bikes", "small"), "catalogue 'bikes' is in no file of"),
        (reference("../cars", "small"), "catalogue '../cars' is in no file of"),
        (reference("$cars", "small"), "refers to $cars, which is not declared"),
    ],
)
def test_references_that_lead_nowhere(file, body, text):
    path = file(body, cars=catalog("cars", car("small")))
    assert text in refused(path)
    assert "(line 2)" in refused(path)


def test_a_parameter_that_the_entry_lacks_is_a_warning(file):
    path = file(reference("cars", "small", hue="red"), cars=catalog("cars", car("small")))
    warnings: list[str] = []
    assert read(path, warnings=warnings) == read(path)
    (said,) = warnings
    approve(said, "cars", "small")


def test_a_value_that_is_not_of_its_type_is_a_text_until_it_is_used_as_a_number(file):
    odd = parameter("mode", "double", "position")
    path = file(cars=catalog("cars", car("small", "1.5", "50", declared(odd))))
    warnings: list[str] = []
    read(path, warnings=warnings)
    (said,) = warnings
    approve(said, "position")
    used = catalog("cars", car("small", "$mode", "50", declared(odd)))
    approve(refused(file(cars=used)), "double")


def test_what_a_catalogue_lacks_may_be_left_out_with_what_it_is_part_of(tmp_path):
    """Without its body the second car goes, and what it does; a folder that is not there, likewise.

    The ego, the first one, never does: what is left would be another scenario.
    """
    written(tmp_path / "catalogs", cars=catalog("cars", car("small")))
    cars = entity(reference("cars", "small"), "ego"), entity(reference("cars", "huge"), "other")
    text = scenario(entities="".join(cars), locations=CARS)
    skipped: list[str] = []
    found = read(written(tmp_path, s=text), skipped=skipped)
    assert [one.name for one in found.entities.scenario_objects] == ["ego"]
    assert len(skipped) == 1
    approve(skipped[0], "huge", "MiscObject")
    for body in (reference("cars", "huge"), reference("../cars", "small")):
        alone = scenario(entities=entity(body), locations=CARS)
        with refuses(FileFormatError):
            read(written(tmp_path, s=alone), skipped=[])


def test_without_a_path_there_is_no_catalogue(file):
    path = file(cars=catalog("cars", car("small")))
    with refuses(UnsupportedError, "line 2"):
        read(path.read_bytes())


def test_without_a_location_there_is_no_catalogue(tmp_path):
    path = written(tmp_path, s=scenario(entities=entity(reference("cars", "small"))))
    approve(refused(path), "CatalogLocations", "VehicleCatalog")


# -- enemies ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("path", ["nowhere", "scenario.xosc", "/dev", "/proc/self/mem", "a" * 5000])
def test_folders_that_are_none(tmp_path, path):
    text = scenario(entities=entity(reference("null", "x")), locations=location("Vehicle", path))
    said = refused(written(tmp_path, scenario=text))
    assert "cannot be read" in said or "is in no file" in said


def test_only_regular_files_are_read(file, tmp_path):
    path = file(cars=catalog("cars", car("small")))
    (tmp_path / "catalogs" / "cars.xosc").unlink()
    (tmp_path / "catalogs" / "cars.xosc").mkdir()
    os.mkfifo(tmp_path / "catalogs" / "a.xosc")  # reading it would never end
    (tmp_path / "catalogs" / "b.xosc").symlink_to("/dev/zero")
    approve(refused(path), "cars")


def test_a_file_of_a_gigabyte_is_not_read(file, tmp_path):
    path = file(cars="")
    os.truncate(tmp_path / "catalogs" / "cars.xosc", 2**30)
    assert "may have" in refused(path)
    assert "1073741824" in refused(path)


def test_too_many_files_are_not_looked_at(file, tmp_path):
    path = file(cars=catalog("cars", car("small")))
    for k in range(1001):
        (tmp_path / "catalogs" / f"f{k}").touch()
    approve(refused(path), "1000")


def chain(tmp_path, entries: dict[str, list[str]]):
    """Writes controllers' cars that pull others by reference."""
    made = []
    for name, pulled in entries.items():
        trailers = "".join(
            f'<Trailer><Trailer name="t{k}">{reference("cars", other)}</Trailer></Trailer>'
            for k, other in enumerate(pulled)
        )
        made.append(car(name).replace("</Vehicle>", f"{trailers}</Vehicle>"))
    written(tmp_path / "catalogs", cars=catalog("cars", *made))
    body = reference("cars", next(iter(entries)))
    return written(tmp_path, s=scenario(entities=entity(body), locations=CARS))


def test_entries_refer_to_further_ones(tmp_path):
    path = chain(tmp_path, {"a": ["b"], "b": []})
    first, second = read(path).entities.scenario_objects
    assert first.entity_object.trailer.trailer.entity_ref == second.name == "t0"
    assert second.entity_object.name == "b"


@pytest.mark.parametrize("entries", [{"a": ["a"]}, {"a": ["b"], "b": ["c"], "c": ["b"]}])
def test_entries_that_hold_themselves(tmp_path, entries):
    assert "holds itself" in refused(chain(tmp_path, entries))


def test_entries_that_nest_deeper_than_a_file_may(tmp_path):
    names = [f"e{k}" for k in range(40)]
    entries = {name: [other] for name, other in pairwise(names)}
    assert "elements nest more than 64 deep" in refused(chain(tmp_path, entries | {"e39": []}))


def test_entries_that_multiply(tmp_path):
    """Ten maneuvers of 200 actions, with a controller of 500 properties each: a million."""
    action = (
        '<Action name="a{k}"><PrivateAction><ControllerAction><AssignControllerAction>{ref}'
        "</AssignControllerAction></ControllerAction></PrivateAction></Action>"
    )
    actions = "".join(action.format(k=k, ref=reference("c", "big")) for k in range(200))
    event = f'<Event name="e" priority="parallel">{actions}</Event>'
    properties = "".join(f'<Property name="p{k}" value="1"/>' for k in range(500))
    big = f'<Controller name="big"><Properties>{properties}</Properties></Controller>'
    written(tmp_path / "m", m=catalog("m", maneuver(event, name="all")))
    written(tmp_path / "c", c=catalog("c", big))
    path = written(
        tmp_path,
        s=scenario(
            stories=story(reference("m", "all") * 10),
            locations=location("Controller", "c") + location("Maneuver", "m"),
        ),
    )
    approve(refused(path), MAX_ELEMENTS)


def test_parameters_that_go_round_in_circles(file):
    entry = car(
        "small", "$a",
        declared=declared(parameter("a", "double", "$b"), parameter("b", "double", "$a")),
    )  # fmt: skip
    said = refused(file(cars=catalog("cars", entry)))
    approve(said, "line 1")


@pytest.mark.parametrize(
    "text",
    ["", "<OpenSCENARIO>", '<!DOCTYPE x [<!ENTITY a "b">]><OpenSCENARIO/>', "<OpenDRIVE/>", "\x01"],
)
def test_files_that_are_no_catalogues(file, text):
    assert "cars.xosc" in refused(file(cars=text)) or "is in no file" in refused(file(cars=text))
