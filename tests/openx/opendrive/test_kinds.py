"""Laws of every kind of road network that is made from a template."""

import itertools
import math

import pytest
from tests.approval import refuses

from bridgegen.base.errors import InputError
from bridgegen.openx.opendrive.lanes import lane_pose
from bridgegen.openx.opendrive.plan_view import Arc
from bridgegen.openx.opendrive.read import read
from bridgegen.openx.opendrive.routes import plan_route
from bridgegen.openx.opendrive.validate import problems
from bridgegen.openx.opendrive.write import to_xml
from bridgegen.scenario.ontology.check import check

from .kinds import KINDS, individuals, model

NAMES = tuple(KINDS)


@pytest.mark.parametrize("name", NAMES)
def test_it_is_sound_and_reads_as_it_was_written(name):
    made = model(name)
    assert problems(made) == []
    assert read(to_xml(made)) == made
    ids = [road.id for road in made.roads] + [junction.id for junction in made.junctions]
    assert len(set(ids)) == len(ids)
    assert all(one.isdigit() for one in ids)


@pytest.mark.parametrize("name", NAMES)
def test_its_individuals_keep_every_rule(name):
    assert [str(one) for one in check(individuals(name))] == []


@pytest.mark.parametrize("name", NAMES)
def test_lanes_join_without_a_step(name):
    made = model(name)
    joints = 0
    for road in made.roads:
        if not road.is_connecting:
            continue
        (section,) = road.sections
        (lane,) = section.lanes
        for link, (other_lane,), s in (
            (road.predecessor, lane.predecessors, 0.0),
            (road.successor, lane.successors, road.length),
        ):
            other = made.road(link.element_id)
            at = 0.0 if link.contact_point == "start" else other.length
            a, b = lane_pose(road, lane.id, s), lane_pose(other, other_lane, at)
            assert math.dist(a[:2], b[:2]) < 1e-3
            assert abs(math.remainder(a.h - b.h, math.tau)) < 1e-3
            assert a.width == pytest.approx(b.width, abs=1e-6)
            joints += 1
        for one in road.plan_view:
            assert not isinstance(one.shape, Arc) or abs(one.shape.curvature) <= 0.5
    assert joints or not made.junctions


def ends(made, way):
    """Places on all lanes that lead to a junction (or away from one), but not both."""
    for road in made.roads:
        if road.is_connecting or (road.predecessor and road.successor):
            continue
        contact = "start" if road.predecessor else "end"
        near, far = (1.0, road.length) if contact == "start" else (road.length - 1.0, 0.0)
        section = road.section_at(contact)
        for lane in section.lanes:
            inwards = (road.direction(lane.id) > 0) == (contact == "end")
            if lane.drivable and inwards == (way == "in"):
                yield road.id, lane.id, far if way == "in" else near


@pytest.mark.parametrize("name", [name for name in NAMES if KINDS[name].template != "road"])
def test_every_lane_in_leads_out_and_every_leg_can_be_reached(name):
    made = model(name)
    ways = list(itertools.product(ends(made, "in"), ends(made, "out")))
    reached = set()
    for start, end in ways:
        try:
            plan_route(made, start, [], end)
        except InputError:
            continue
        reached.add((start, end))
    assert {start for start, _ in reached} == set(ends(made, "in"))
    assert {end[0] for _, end in reached} == {end[0] for end in ends(made, "out")}
    if KINDS[name].template == "roundabout":
        assert len(reached) == len(ways)  # from every leg to every leg, the own one too


def test_turn_lanes_lead_where_they_say():
    names = sorted(road.name for road in model("turn-lanes").roads if road.is_connecting)
    from_a = [name for name in names if name.startswith("A")]
    assert from_a == [
        "A1 left B1", "A2 straight C1", "A3 right D2", "A3 straight C2",
    ]  # fmt: skip
    assert [name for name in names if name.startswith("C")] == [
        "C1 left D1", "C2 right B1", "C2 straight A2",
    ]  # fmt: skip


def test_lights_stand_where_vehicles_stop_and_change_by_pairs():
    made = model("signals")
    lights = {
        signal.id: (road, signal) for road in made.roads for signal in road.signals
        if signal.dynamic == "yes"
    }  # fmt: skip
    assert len(lights) == 4
    for road, signal in lights.values():
        assert signal.orientation == "-"
        (validity,) = signal.validity
        assert (validity.from_lane, validity.to_lane) == (1, 2)
        assert signal.t > 2 * 3.5 + 0.5 + 2.0  # beside the sidewalk
        assert signal.s == 1.0 + 4.0 + 1.0  # a metre, the crosswalk, a metre
        assert road.link("start").element_id == made.junctions[0].id
    groups = [sorted(one.signal_id[0] for one in c.controls) for c in made.controllers]
    assert sorted(groups) == [["1", "3"], ["2", "4"]]  # A and C, B and D
    assert [c.id for c in made.junctions[0].controllers] == [c.id for c in made.controllers]
    crosswalks = [o for road in made.roads for o in road.objects if o.type == "crosswalk"]
    lines = [o for road in made.roads for o in road.objects if o.subtype == "stopLine"]
    assert (len(crosswalks), len(lines)) == (4, 4)
    for one in crosswalks:
        assert {(s, abs(t)) for s, t in one.corners} == {(1.0, 7.0), (5.0, 7.0)}
        assert len(one.outline.corners_local) == 5  # what CARLA and CommonRoad read


def test_the_acceleration_lane_ends():
    made = model("merge")
    after = made.road("3")
    assert [len(section.right) for section in after.sections] == [3, 3, 2]
    assert [section.s for section in after.sections] == [0.0, 200.0, 260.0]
    start = ("2", -1, 0.0)
    route = plan_route(made, start, [], ("3", -3, 259.9))
    assert route.length == pytest.approx(300.0 + 60.0 * math.radians(10) / math.sin(
        math.radians(10)) + 259.9, abs=0.5)  # fmt: skip
    assert lane_pose(after, -3, 230.0).width == pytest.approx(3.75 / 2)


def test_a_sign_in_the_road_and_a_light_off_an_intersection_are_refused():
    import pyoxigraph as ox

    from bridgegen.base.errors import OntologyError
    from bridgegen.openx.opendrive.from_owl import opendrive_from_owl
    from bridgegen.scenario.ontology.graph import Individuals
    from bridgegen.scenario.ontology.vocabulary import bg

    def moved(quad):
        sign = quad.subject.value.endswith("yield_sign_A") and quad.predicate == bg("has_t")
        return ox.Quad(quad.subject, quad.predicate, ox.Literal(1.0)) if sign else quad

    inside = Individuals(moved(quad) for quad in individuals("t-junction").quads)
    with refuses(OntologyError, "has_t"):
        opendrive_from_owl(inside)
