"""There and back: what a scenario's individuals say, its file says; so they can be read off it."""

from pathlib import Path

import numpy as np
import pyoxigraph as ox
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from lxml import etree
from tests.covering import covering

from bridgegen.openx.convert import convert_file, import_file, scenario_of
from bridgegen.openx.opendrive.from_owl import opendrive_from_owl
from bridgegen.openx.opendrive.model import OpenDrive
from bridgegen.openx.opendrive.read import read as read_roads
from bridgegen.openx.opendrive.site import find_site
from bridgegen.openx.opendrive.write import to_xml as roads_to_xml
from bridgegen.openx.openscenario.from_owl import openscenario_from_owl
from bridgegen.openx.openscenario.read import read
from bridgegen.openx.openscenario.to_owl import individuals_from_openscenario
from bridgegen.openx.openscenario.write import to_xml
from bridgegen.scenario.language.reader import load
from bridgegen.scenario.ontology.check import check
from bridgegen.scenario.ontology.graph import Individuals
from bridgegen.scenario.ontology.individuals import build

from . import stories


def rows(name: str):
    """The defaults, and two rows from anywhere in the unit cube."""
    scenario = load(name)
    space = scenario.space()
    rng = np.random.default_rng(sum(name.encode()))
    for row in [space.row({}), *space.decode(rng.random((2, space.n_var)))]:
        yield dict(zip(space.names, row.tolist(), strict=True))


def roads_of(individuals: Individuals) -> OpenDrive:
    return read_roads(roads_to_xml(opendrive_from_owl(individuals)))


def written(individuals: Individuals) -> bytes:
    return to_xml(openscenario_from_owl(individuals, "map.xodr"))


def imported(data: bytes, roads: OpenDrive, **options) -> Individuals:
    found, lost = individuals_from_openscenario(read(data), roads, "map.xodr", **options)
    assert lost == []
    return found


# -- laws over the catalogue -----------------------------------------------------------------------


@pytest.mark.parametrize("name", covering())
def test_the_individuals_of_layers_3_to_5_come_back(name):
    if load(name).ego.change:
        pytest.skip("a route that changes lanes goes into files, and does not come back")
    if name == "door-opens":
        pytest.skip("a door comes back as the body that it is, not as a door")
    for values in rows(name):
        source = build(load(name), values, driver="route-follower")
        data = written(source)
        again = imported(data, roads_of(source))
        assert stories.said(again) == stories.said(source)
        assert written(again) == data


@pytest.mark.parametrize("name", ["crossroads-s4", "red-light-runner", "road-works"])
def test_what_comes_back_obeys_the_constraints(name):
    source = build(load(name), next(rows(name)), driver="route-follower")
    again = imported(written(source), roads_of(source))
    assert scenario_of(again) is not None
    assert check(again, scenario_of(again)) == []


def test_the_files_do_it_too(individuals, tmp_path):
    """By way of the disk: .owl → .xodr and .xosc → .owl → the same .xodr and .xosc."""
    from bridgegen.scenario.ontology.files import load as load_owl
    from bridgegen.scenario.ontology.files import save

    save(individuals(), tmp_path / "s4.owl")
    first, _ = convert_file(tmp_path / "s4.owl")
    (tmp_path / "deep").mkdir()
    owl, lost = import_file(first[1], tmp_path / "deep" / "s4.owl")
    assert lost == []
    again = load_owl(owl)
    assert again.text(again.one("RoadNetwork"), "has_map_file") == "../s4.xodr"
    assert stories.said(again) == stories.said(load_owl(tmp_path / "s4.owl"))
    second, broken = convert_file(owl, tmp_path / "second")
    assert broken == []
    assert [path.read_bytes() for path in second] == [path.read_bytes() for path in first]


def test_the_names_of_individuals_do_not_matter(individuals):
    """Whatever somebody calls them in Protégé: the file is the same, and so is what it says."""
    source = individuals()
    base = next(q.subject.value for q in source.quads if q.subject.value.endswith("#scenario"))
    base = base.removesuffix("scenario")

    def other(term):
        if isinstance(term, ox.NamedNode) and term.value.startswith(base):
            return ox.NamedNode(term.value.replace("#", "#somebody%27s_"))
        return term

    renamed = Individuals(ox.Quad(other(q.subject), q.predicate, other(q.object))
                          for q in source.quads)  # fmt: skip
    data = written(renamed)
    assert stories.said(imported(data, roads_of(source))) == stories.said(source)


@pytest.fixture(scope="module")
def town05():
    """CARLA's Town05: it is not part of the repository."""
    path = Path(__file__).parents[3].parent / "shared/data/Town05.xodr"
    if not path.exists():
        pytest.skip(f"{path} does not exist")
    return read_roads(path)


@pytest.mark.parametrize("name", ["crossroads-s1", "crossroads-s2", "crossroads-s3"])
def test_on_a_town_distances_count_from_the_intersection_of_the_scenario(town05, name):
    """Along legs of two roads, and on roads that other intersections end, too."""
    site = find_site(town05, map_name="Town05.xodr")
    for values in rows(name):
        source = build(load(name), values, driver="route-follower", site=site)
        again = imported(written(source), town05)
        assert stories.said(again) == stories.said(source)
        assert written(again) == written(source)


# -- one of everything -----------------------------------------------------------------------------


def everything(source: Individuals) -> Individuals:
    """Every action and every condition of the ontology, in events of one participant."""
    stage = stories.Stage(source)
    conditions = [[one] for one in stories.CONDITIONS]
    for k, action in enumerate(stories.ACTIONS + stories.PRESENCE):
        stage.event(f"e{k}", ["bv"], [action], conditions[:9])
    stage.event("many", ["bv"], stories.ACTIONS[:9], [stories.CONDITIONS[:9]])
    stage.event("late", ["bv"], stories.ACTIONS[:1], conditions[9:])
    both = {"has_value": 1.0, "has_subject": "<bv>"}
    stage.event("both", ["bv", "ego"], stories.ACTIONS[:1], [[("SpeedCondition", both)]])
    ended = {"has_value": 0.0, "has_event_ref": "<many>"}
    stage.event(
        "waits", ["ego"], stories.ACTIONS[:1], [[("StoryboardElementStateCondition", ended)]]
    )
    return stage.individuals()


def test_one_of_everything_comes_back(individuals):
    source = individuals()
    roads = roads_of(source)
    source = everything(source)
    data = written(source)
    again = imported(data, roads)
    assert stories.said(again) == stories.said(source)
    assert written(again) == data


def test_ways_come_back(individuals):
    """A trajectory with times, a route on the way, and what is known of people's bodies."""
    source = individuals("pedestrian-at-night")
    roads = roads_of(source)
    stage = stories.Stage(source)
    (walker,) = source.of_class("Pedestrian")
    who = source.text(walker, "has_name")
    lane = "leg_main_out_1" if source.find(stage.base + "leg_main_out_1") else "leg_A_in_1"
    time = [[("SimulationTimeCondition", {"has_value": 1.0})]]
    stage.event("walks", [who], [("FollowTrajectoryAction", {"has_trajectory": "<walks_action_path>"})], time)  # fmt: skip  # noqa: E501
    path = stage.node("walks_action_path", "Trajectory")
    stage.put(path, "has_name", "zigzag")
    for k in (1, 2, 3):
        vertex = stage.node(f"walks_action_vertex_{k}", "Vertex")
        stage.put(path, "has_vertex", vertex)
        stage.put(vertex, "has_index", k)
        stage.put(vertex, "has_time", float(k))
        place = stage.thing(f"walks_action_point_{k}", *stories.on_lane(lane, 5.0 * k, 0.1 * k))
        stage.put(vertex, "has_position", place)
    stage.event("turns", ["ego"], [("AssignRouteAction", {"has_route": "<turns_action_route>"})], time)  # fmt: skip  # noqa: E501
    route = stage.node("turns_action_route", "Route")
    start = stage.thing("turns_action_route_start", *stories.on_lane(lane, 3.0))
    stage.put(route, "has_start", start)
    end = stage.thing("turns_action_destination", *stories.on_lane(lane, 30.0))
    stage.put(route, "has_destination", end)
    source = stage.individuals()
    again = imported(written(source), roads)
    assert stories.said(again) == stories.said(source)
    assert written(again) == written(source)


def test_weather_that_changes_comes_back(individuals):
    """Under a prefix of its parameters, or by itself; and snow."""
    source = individuals()
    roads = roads_of(source)
    stage = stories.Stage(source)
    time = [[("SimulationTimeCondition", {"has_value": 3.0})]]
    action = "EnvironmentAction", {"has_weather": "<darkens_weather>"}
    stage.event("darkens", [], [action], time)
    weather = stage.node("darkens_weather", "Weather")
    parts = {
        "has_snow": ("Snow", {"has_snowfall": 1.5}),
        "has_cloud": ("Cloud", {"has_cloudiness": 80.0}),
        "has_road_state": ("RoadState", {"has_friction": 0.4}),
        "has_fog": ("Fog", {"has_fog_density": 12.5}),
    }
    for link, (cls, values) in parts.items():
        stage.put(weather, link, stage.thing(f"darkens_weather_{cls.lower()}", cls, values))
    source = stage.individuals()
    again = imported(written(source), roads)
    assert stories.said(again) == stories.said(source)
    assert written(again) == written(source)


def test_lights_come_back(individuals):
    source = individuals("red-light-runner")
    roads = roads_of(source)
    light = source.of_class("TrafficLight")[0]
    name = light.value.rpartition("#")[2]
    stage = stories.Stage(source)
    state = {"has_signal": f"<{name}>", "has_signal_state": "red_yellow"}
    stage.event("fails", [], [("TrafficSignalStateAction", state)],
                [[("TrafficSignalCondition", state | {"has_signal_state": "yellow"})]])  # fmt: skip
    source = stage.individuals()
    again = imported(written(source), roads)
    assert stories.said(again) == stories.said(source)
    assert written(again) == written(source)
    phases = sorted(again.number(one, "has_duration") for one in again.of_class("SignalPhase"))
    assert phases == sorted(source.number(one, "has_duration")
                            for one in source.of_class("SignalPhase"))  # fmt: skip


def test_an_accident_that_the_story_names_comes_back(individuals):
    source = individuals()
    stage = stories.Stage(source)
    crash = stage.node("crash", "TrafficAccident")
    for key, value in {"has_name": "crash", "has_time": 3.25}.items():
        stage.put(crash, key, value)
    for who in ("ego", "bv"):
        stage.put(crash, "has_who", stage.iri(who))
    stage.put(stage.scenario, "has_event", crash)
    again = imported(written(stage.individuals()), roads_of(source))
    assert stories.said(again) == stories.said(stage.individuals())


_DISTANCES = st.floats(0.0, 60.0) | st.integers(0, 60_000).map(lambda n: n / 1000.0)
_ODD = st.floats(-1e6, 1e6, allow_nan=False)


@settings(max_examples=40)
@given(
    st.lists(st.sampled_from(range(len(stories.ACTIONS))), min_size=1, max_size=12),
    st.lists(
        st.lists(st.sampled_from(range(len(stories.CONDITIONS))), min_size=1, max_size=3),
        min_size=1, max_size=12,
    ),
    _DISTANCES, _ODD,
)  # fmt: skip
def test_any_story_reads_back_to_the_same_file(individuals, actions, groups, distance, number):
    source = individuals()
    roads = roads_of(source)
    stage = stories.Stage(source)
    place = stories.on_lane("leg_A_in_1", distance, number)
    more = [("TeleportAction", {"has_position": place}),
            ("SpeedAction", {"has_target_speed": number})]  # fmt: skip
    stage.event("event", ["bv"], [*(stories.ACTIONS[k] for k in actions), *more],
                [[stories.CONDITIONS[k] for k in group] for group in groups])  # fmt: skip
    data = written(stage.individuals())
    assert written(imported(data, roads)) == data


@given(_DISTANCES, _ODD, st.sampled_from(["A", "B", "C", "D"]), st.sampled_from(["in", "out"]))
def test_places_come_back_to_the_bit(individuals, town_roads, distance, aside, leg, way):
    """On Town05's kind of roads, half of which run towards the junction."""
    source = individuals("crossroads-s1", site=town_roads[1])
    roads = town_roads[0]
    stage = stories.Stage(source)
    length = {"A": 21.697, "B": 50.748, "C": 11.614, "D": 54.907}[leg]
    place = stories.on_lane(f"leg_{leg}_{way}_1", min(distance, length), aside)
    time = [[("SimulationTimeCondition", {"has_value": 1.0})]]
    stage.event("jumps", ["bv"], [("TeleportAction", {"has_position": place})], time)
    data = written(stage.individuals())
    again = imported(data, roads)
    assert written(again) == data
    node = again.find(stage.base + "jumps_action_place")
    assert again.number(node, "has_lateral_offset") == aside
    if round(distance, 3) == distance:
        assert again.number(node, "has_distance") == min(distance, length)


@pytest.fixture(scope="module")
def town_roads(town):
    """Straight roads as long, and running the same way, as those of Town05's junction 965."""
    site = town()
    root = etree.Element("OpenDRIVE")
    etree.SubElement(root, "header", revMajor="1", revMinor="7", name="town")
    for number, leg in enumerate(site.legs):
        for road in leg.roads:
            _straight(root, road, 100.0 * number)
    etree.SubElement(root, "junction", id="965", name="")
    return read_roads(etree.tostring(root)), site


def _straight(root, road, y):
    length = repr(road.length)
    node = etree.SubElement(root, "road", id=road.road_id, length=length, junction="-1", name="")
    link = etree.SubElement(node, "link")
    if road.road_id in ("17", "0"):  # they run towards the junction
        etree.SubElement(link, "successor", elementType="junction", elementId="965")
    view = etree.SubElement(node, "planView")
    line = etree.SubElement(view, "geometry", s="0", x="0", y=str(y), hdg="0", length=length)
    etree.SubElement(line, "line")
    section = etree.SubElement(etree.SubElement(node, "lanes"), "laneSection", s="0")
    for side, ids in (("left", (2, 1)), ("center", (0,)), ("right", (-1, -2))):
        group = etree.SubElement(section, side)
        for lane_id in ids:
            kind = "driving" if lane_id else "none"
            lane = etree.SubElement(group, "lane", id=str(lane_id), type=kind, level="false")
            if lane_id:
                etree.SubElement(lane, "width", sOffset="0", a="3.5", b="0", c="0", d="0")
