import pytest
from tests.approval import approve

from bridgegen.openx.opendrive.from_owl import opendrive_from_owl
from bridgegen.openx.openscenario.from_owl import openscenario_from_owl
from bridgegen.openx.openscenario.read import read
from bridgegen.openx.openscenario.validate import problems


@pytest.fixture(scope="module")
def roads(individuals):
    return opendrive_from_owl(individuals())


def test_what_we_write_is_right_on_every_road_network(individuals, scenario_name):
    for u in (0.0, 0.3, 1.0):
        for count, width, size in ((1, 2.75, 16.0), (3, 4.0, 44.0)):
            source = individuals(
                scenario_name, u, lane_width=width, lanes_per_direction=count,
                intersection_size=size, arm_length=45.0,
            )  # fmt: skip
            scenario = openscenario_from_owl(source, "x.xodr")
            assert problems(scenario, opendrive_from_owl(source)) == []


@pytest.mark.parametrize(
    ("old", "new", "text"),
    [
        ('<Private entityRef="bv">', '<Private entityRef="car">',
         "entityRef of Private must be one of ego, bv, got 'car'"),
        ('<EntityRef entityRef="bv"/>', '<EntityRef entityRef="$road_wetness"/>',
         "entityRef of EntityRef must be one of ego, bv, got 'dry'"),
        ('entityRef="ego" rel', 'entityRef="bvx" rel', "RelativeDistanceCondition must be one"),
        ('<ScenarioObject name="bv">', '<ScenarioObject name="ego">',
         "the name of a ScenarioObject must be its own, got 'ego' twice"),
        ('maximumExecutionCount="1"', 'maximumExecutionCount="0"',
         "maximumExecutionCount of ManeuverGroup must be at least 1, got 0"),
        ('delay="0.0"', 'delay="-1"', "delay of Condition must be at least 0, got -1"),
        ('tolerance="2.0"', 'tolerance="${0-$bv_speed}"',
         "must be at least 0, got ${0-$bv_speed} = -2.05"),
        ('azimuth="${', 'azimuth="${7+', "azimuth of Sun must be 0 to 6.28319"),
        ('visualRange="${', 'visualRange="${0/0+', "visualRange of Fog must be at least 0, got"),
        ('width="1.9"', 'width="-1.9"',
         "width of Dimensions must be at least 0 and finite, got -1.9"),
        ('length="4.6"', 'length="INF"', "must be at least 0 and finite, got inf"),
        ('height="1.5"', 'height="INF"', "height of Dimensions must be at least 0 and finite"),
        ('height="1.5"', 'height="-1"', "height of Dimensions must be at least 0 and finite"),
        ('<Center x="1.4"', '<Center x="INF"', "x of Center must be finite, got inf"),
        ('maximumExecutionCount="1"', 'maximumExecutionCount="${1e300}"',
         "must be of type unsignedInt, 0 to 4294967295, got ${1e300} = 1e+300"),
        ('maximumExecutionCount="1"', 'maximumExecutionCount="${1/0}"',
         "maximumExecutionCount of ManeuverGroup must be finite, got ${1/0} = inf"),
        ('delay="0.0"', 'delay="${1/0}"', "delay of Condition must be finite, got ${1/0} = inf"),
        ('<EntityRef entityRef="bv"/>', "",
         "the actions of ManeuverGroup bv_sets_off_group must have actors"),
        # on the map
        ('roadId="3"', 'roadId="33"', "LanePosition: road '33' is not in the road network"),
        ('laneId="1"', 'laneId="9"', "got lane 9"),
        ('laneId="1"', 'laneId="inner"', "laneId must be a whole number, got 'inner'"),
        ('s="40.0"', 's="60.5"', "got s=60.5"),
        ('s="$bv_start"', 's="${$bv_start+60}"', "got s=76"),
        ('roadId="4" laneId="-1"', 'roadId="4" laneId="1"', "Route ego_route: "),
    ],
)  # fmt: skip
def test_planted_problems_are_found(s4, roads, old, new, text):
    data = s4.decode()
    assert old in data
    mutant = data.replace(old, new, 1)
    if '"-2"' in new:  # the innermost lane leads to the innermost only
        mutant = data.replace(old, new)
    scenario = read(mutant.encode())
    found = problems(scenario, roads)
    assert any(text in problem for problem in found), found
    assert all("(line " in problem for problem in found)
    assert problems(read(s4), roads) == []


def test_each_place_is_complained_about_once(s4, roads):
    scenario = read(s4.replace(b'roadId="3"', b'roadId="33"', 1))
    assert len(problems(scenario, roads)) == 1


def test_without_a_map_places_are_taken_on_trust(s4):
    assert problems(read(s4.replace(b'roadId="3"', b'roadId="33"'))) == []


def test_a_scenario_in_memory_has_no_lines(individuals, s4):
    scenario = openscenario_from_owl(individuals(), "x.xodr")
    broken = type(scenario)(**vars(scenario) | {"parameter_declarations": None})
    found = problems(broken)
    approve(found, "bv_speed")
