"""Competency questions: the ontology answers what the scenarios' descriptions say in words."""

import sys
from dataclasses import replace

import pyoxigraph as ox
import pytest
from tests.approval import approve, refuses

from bridgegen.base.errors import FileFormatError, InputError, UnknownNameError
from bridgegen.scenario.language.reader import load
from bridgegen.scenario.language.story import Waypoint
from bridgegen.scenario.ontology import questions as module
from bridgegen.scenario.ontology.files import from_bytes, save, to_bytes
from bridgegen.scenario.ontology.graph import Individuals
from bridgegen.scenario.ontology.individuals import build, build_static
from bridgegen.scenario.ontology.questions import ask, ask_file, ask_sparql, questions
from bridgegen.scenario.ontology.vocabulary import SCENARIOS, TYPE, bg

from .conftest import in_rain_and_haze

# The scenarios' descriptions: from leg, to leg, turn; legs A south, B west, C north, D east.
ROUTES = {
    "crossroads-s1": {"ego": ("C", "A", "straight"), "bv": ("B", "D", "straight")},
    "crossroads-s2": {"ego": ("C", "A", "straight"), "bv": ("A", "B", "left")},
    "crossroads-s3": {"ego": ("A", "C", "straight"), "bv": ("D", "A", "left")},
    "crossroads-s4": {"ego": ("C", "D", "left"), "bv": ("B", "D", "straight")},
}


def concrete(name):
    scenario = load(name)
    space = scenario.space(axes=["static", "participants", "weather"])
    values = in_rain_and_haze(space)
    return scenario, values, build(scenario, values, driver="reference")


def records(answer):
    return [dict(zip(answer.columns, row, strict=True)) for row in answer.rows]


@pytest.fixture(params=ROUTES)
def case(request):
    return concrete(request.param)


def test_participants_and_their_starts(case):
    scenario, values, individuals = case
    bv, ego = records(ask(individuals, "participants"))
    assert (ego["participant"], bv["participant"]) == ("ego", "bv")
    assert ego["type"] == bv["type"] == "car"
    assert (ego["leg"], bv["leg"]) == tuple(ROUTES[scenario.name][w][0] for w in ("ego", "bv"))
    assert (ego["distance_to_junction_m"], ego["speed_m_s"]) == (40.0, values["ego_speed"])
    assert (bv["distance_to_junction_m"], bv["speed_m_s"]) == (values["bv_start"], 0.0)
    assert ego["lane"] == bv["lane"] == 1


def test_routes_through_the_intersection(case):
    scenario, _, individuals = case
    found = {who: rest for who, *rest in ask(individuals, "routes").rows}
    assert found == {who: list(route) for who, route in ROUTES[scenario.name].items()}


def test_conflicts(case):
    scenario, _, individuals = case
    merge = scenario.name == "crossroads-s4"
    expected = ("ego", "bv", "merge", "D") if merge else ("ego", "bv", "cross", "")
    assert ask(individuals, "conflicts").rows == (expected,)


@pytest.mark.parametrize(
    ("other", "rows"),
    [
        (("P5", "P2"), ()),  # oncoming, straight on
        (("P5", "P8"), (("bv", "cross", ""),)),  # left, across
        (("P3", "P2"), ()),  # right, into another leg, before the crossing
        (("P7", "P6"), (("bv", "merge", "C"),)),  # right, into the same leg
        (("P7", "P4"), (("bv", "cross", ""),)),
    ],
)
def test_conflicts_of_an_ego_that_goes_north(other, rows):
    scenario, values, _ = concrete("crossroads-s3")
    start, end = other
    ego, bv = scenario.participants
    bv = replace(
        bv,
        start=Waypoint.at_point(start, bv.start.distance),
        end=Waypoint.at_point(end, bv.end.distance),
    )
    changed = replace(scenario, story=replace(scenario.story, participants=(ego, bv)))
    found = ask(build(changed, values, driver="reference"), "conflicts").rows
    assert found == tuple(("ego", *row) for row in rows)


def test_triggers(case):
    _, values, individuals = case
    by_distance, by_time = records(ask(individuals, "triggers"))
    for one in (by_distance, by_time):
        assert (one["event"], one["participant"]) == ("bv_sets_off", "bv")
        assert one["target_speed_m_s"] == values["bv_speed"]
        assert one["rate_m_s2"] == 3.0
    assert (by_distance["condition"], by_distance["to"]) == ("relative distance condition", "ego")
    assert (by_distance["value"], by_distance["unit"]) == (values["bv_trigger_distance"], "m")
    assert (by_time["condition"], by_time["to"]) == ("simulation time condition", None)
    assert (by_time["value"], by_time["unit"]) == (values["bv_trigger_time"], "s")


def test_weather_and_bindings(case):
    scenario, values, individuals = case
    weather = {(part, what): value for part, what, value, _ in ask(individuals, "weather").rows}
    assert weather["fog", "fog density"] == values["fog_density"]
    assert weather["road state", "friction"] == values["friction"]
    bound = {row["parameter"]: row for row in records(ask(individuals, "parameters"))}
    assert {name: row["value"] for name, row in bound.items()} == pytest.approx(values, abs=0)
    assert bound["lane_width"]["individuals"] == 4 + 16  # roads, lanes: two each way on four legs
    for name, parameter in scenario.parameters.items():
        assert (bound[name]["low"], bound[name]["high"]) == (parameter.low, parameter.high)


def test_constraints(case):
    scenario, _, individuals = case
    found = ask(individuals, "constraints").rows
    assert len(found) == len(scenario.bounds) + len(scenario.derived)
    (rain,) = (text for name, text in found if name == "cloudiness")
    approve(rain, "precipitation")


def test_lanes_and_driver(case):
    _, values, individuals = case
    lanes = ask(individuals, "lanes").rows
    count = int(values["lanes_per_direction"])
    assert [(leg, lane) for leg, _, lane, _ in lanes] == [
        (leg, lane) for leg in "ABCD" for lane in range(1, count + 1)
    ]
    assert ask(individuals, "driver").rows == (("bv", "insistent"), ("ego", "reference"))


# -- all that a scenario may hold: everything.yaml -------------------------------------------------


def node(name):
    return ox.NamedNode(f"{SCENARIOS}everything#{name}")


def planted(individuals, *statements):
    return Individuals([*individuals.quads, *(ox.Quad(*one) for one in statements)])


def moved(individuals, name, metres):
    """The same individuals, with one position elsewhere on its lane."""
    wanted = (node(name), bg("has_distance"))
    quads = [quad for quad in individuals.quads if (quad.subject, quad.predicate) != wanted]
    assert len(quads) == len(individuals.quads) - 1
    return Individuals([*quads, ox.Quad(*wanted, ox.Literal(metres))])


def test_everybody_starts_somewhere(everything):
    """With a route or without one, on a lane or on the sidewalk beyond two of them."""
    assert ask(everything, "participants").rows == (
        ("bv", "truck", "B", 1, 10.0, 0.0),
        ("ego", "car", "C", 1, 40.0, 6.9),
        ("queue_1", "car", "A", 1, 40.0, 0.0),
        # a car's front 3.2 m ahead of its reference point, 3 m of gap, a van's rear 1.65 m
        ("queue_2", "van", "A", 1, 40.0 - 7.85, 0.0),
        ("walker", "pedestrian", "B", 3, 3.0, 1.4),
    )


def test_which_lights_govern_which_lane(everything):
    """A light a leg, for both of its lanes inwards: 1 m, the crosswalk of 4 m, 1 m."""
    assert ask(everything, "lights").rows == tuple(
        (leg, str(road), lane, f"light_{leg}", 6.0, "signals")
        for road, leg in enumerate("ABCD", start=1)
        for lane in (1, 2)
    )


def test_when_each_light_shows_what(everything):
    """Green 20 s, yellow 3 s, all red 2 s for A and C, then for B and D: a cycle of 50 s.

    30 s of it have passed at the start: B and D have been green for 5 s.
    """
    rows = ask(everything, "signals").rows
    assert len(rows) == 4 * 6
    assert {row[-1] for row in rows} == {50.0}
    for light, others in (("light_B", "light_D"), ("light_A", "light_C")):
        one, other = ([row[1:5] for row in rows if row[0] == name] for name in (light, others))
        assert one == other
    assert [row[1:5] for row in rows if row[0] == "light_B"] == [
        ("green", "BD_green", 0.0, 15.0),
        ("yellow", "BD_yellow", 15.0, 18.0),
        ("red", "BD_clearing", 18.0, 20.0),
        ("red", "AC_green", 20.0, 40.0),
        ("red", "AC_yellow", 40.0, 43.0),
        ("red", "AC_clearing", 43.0, 45.0),
    ]
    assert [row[1] for row in rows if row[0] == "light_A"] == [
        *("red", "red", "red", "green", "yellow", "red"),
    ]


def test_an_offset_of_whole_cycles_is_none_and_red_yellow_is_a_state(everything):
    wanted = (node("signals"), bg("has_offset"))
    quads = [quad for quad in everything.quads if (quad.subject, quad.predicate) != wanted]
    late = Individuals([
        *quads,
        ox.Quad(*wanted, ox.Literal(100.0)),
        ox.Quad(node("signals_phase_6"), bg("gives_red_yellow_to"), node("light_A")),
    ])  # fmt: skip
    rows = ask(late, "signals").rows
    assert [row[1:5] for row in rows if row[0] == "light_A"] == [
        ("green", "AC_green", 0.0, 20.0),
        ("yellow", "AC_yellow", 20.0, 23.0),
        ("red", "AC_clearing", 23.0, 25.0),
        ("red", "BD_green", 25.0, 45.0),
        ("red", "BD_yellow", 45.0, 48.0),
        ("red_yellow", "BD_clearing", 48.0, 50.0),
    ]


def test_who_can_reach_which_conflict_point(everything):
    """The truck stands 10 m from the intersection on B, the middle of the crosswalk is at 3 m; the
    ego starts 40 m before it on C and leaves by D. The jam on A stands, and reaches nothing."""
    assert ask(everything, "reach").rows == (
        ("crosswalk_B", "crosswalk", "bv", 7.0),
        ("crosswalk_B", "crosswalk", "walker", None),
        ("crosswalk_C", "crosswalk", "ego", 37.0),
        ("crosswalk_D", "crosswalk", "ego", None),
    )


def test_what_lies_behind_cannot_be_reached(everything):
    beyond = moved(everything, "bv_start", 2.5)
    points = {(row[0], row[2]) for row in ask(beyond, "reach").rows}
    assert ("crosswalk_B", "bv") not in points
    short = moved(everything, "ego_destination", 2.0)
    assert ("crosswalk_D", "ego") not in {(row[0], row[2]) for row in ask(short, "reach").rows}


def test_the_conflict_points_of_two_routes(case):
    scenario, values, individuals = case
    point = ("D", "merge") if scenario.name == "crossroads-s4" else ("bv/ego", "cross")
    assert ask(individuals, "reach").rows == (
        (*point, "bv", values["bv_start"]),
        (*point, "ego", 40.0),
    )


def test_what_changes_the_weather_and_when(everything):
    """Fog of 40 %: it begins at 100 - 40 m and falls off by 0.05 * 40; nothing else changes."""
    when = ("fog_falls", "simulation time condition", 6.0, "s", "fog")
    assert ask(everything, "weather-changes").rows == (
        (*when, "fog density", 0.0, 40.0, "%"),
        (*when, "fog distance", 100.0, 60.0, "m"),
        (*when, "fog falloff", 0.0, 2.0, None),
    )
    weather = [row[:3] for row in ask(everything, "weather").rows]
    assert ("fog", "fog density", 0.0) in weather  # the first one alone
    assert len(set(weather)) == len(weather)


def test_which_lanes_road_works_close_and_by_what(everything):
    """20 m from 50 m before the crossing inwards, a cone every 5 m; the sign 5 m before."""
    assert ask(everything, "closed-lanes").rows == (
        ("works", "D", 2, "in", "cone", 5, 30.0, 50.0),
        ("works", "D", 2, "in", "construction sign", 1, 55.0, 55.0),
    )


def test_who_stands_in_the_jam(everything):
    assert ask(everything, "jams").rows == (
        ("queue", "queue_2", "van", "A", 1, 40.0 - 7.85),
        ("queue", "queue_1", "car", "A", 1, 40.0),
    )


def test_who_may_cross_where(everything):
    """Crosswalks 4 m wide, their middle 3 m from the crossing; the walker keeps to that of B."""
    crosswalks = {leg: (leg, f"crosswalk_{leg}", 3.0, 4.0, f"light_{leg}") for leg in "ABCD"}
    nobody = (None, None)
    walker = ("walker", "pedestrian")
    assert ask(everything, "crosswalks").rows == (
        (*crosswalks["A"], *nobody),
        (*crosswalks["B"], *walker),
        (*crosswalks["C"], *nobody),
        (*crosswalks["D"], *nobody),
    )
    # 1 to 5 m is the crosswalk; off it by half a metre on one side is beside it
    edge = moved(everything, "walker_start", 5.0)
    assert (*crosswalks["B"], *walker) in ask(edge, "crosswalks").rows
    beside = ask(moved(everything, "walker_start", 5.5), "crosswalks").rows
    assert (*crosswalks["B"], *nobody) in beside
    assert ("B", None, (5.5 + 3.0) / 2, None, None, *walker) in beside
    assert len(beside) == 5


def test_what_came_of_it(everything):
    assert ask(everything, "outcomes").rows == ()
    crash, jam = node("crash"), node("later_jam")
    after = planted(
        everything,
        (node("scenario"), bg("has_outcome"), crash),
        (crash, TYPE, bg("TrafficAccident")),
        (crash, bg("has_name"), ox.Literal("crash")),
        (crash, bg("has_time"), ox.Literal(7.25)),
        (crash, bg("has_who"), node("ego")),
        (crash, bg("has_who"), node("bv")),
        (crash, bg("has_world_x"), ox.Literal(-3.5)),
        (crash, bg("has_world_y"), ox.Literal(1.0)),
        (crash, bg("has_conflict_type"), ox.Literal("crossing")),
        (crash, bg("has_responsibility"), ox.Literal("ego")),
        (crash, bg("has_responsible"), node("ego")),
        (crash, bg("has_responsibility_rule"), ox.Literal("red light")),
        (crash, bg("has_severity"), ox.Literal(0.25)),
        (crash, bg("has_delta_v"), ox.Literal(6.5)),
        (node("scenario"), bg("has_outcome"), jam),
        (jam, TYPE, bg("TrafficJam")),
        (jam, bg("has_name"), ox.Literal("later jam")),
        (jam, bg("has_time"), ox.Literal(12.0)),
        (jam, bg("has_who"), node("bv")),
        (jam, bg("has_length"), ox.Literal(9.5)),
        (jam, bg("on_lane"), node("leg_B_in_1")),
    )
    assert ask(after, "outcomes").rows == (
        ("crash", "traffic accident", 7.25, "bv, ego", "crossing", "ego", 0.25, 6.5, None,
         -3.5, 1.0, None, None),
        ("later jam", "traffic jam", 12.0, "bv", None, None, None, None, None,
         None, None, "leg_B_in_1", 9.5),
    )  # fmt: skip
    assert ask(after, "responsible").rows == (
        ("crash", "traffic accident", "crossing", "ego", "ego", "red light", 7.25),
    )
    assert ask(after, "jams") == ask(everything, "jams")  # what came later was not there before


def test_conditions_of_a_group_stand_together(everything):
    rows = {(row["event"], row["condition"]): row for row in records(ask(everything, "triggers"))}
    assert len(rows) == 5
    speed = rows["bv_moves_over", "speed condition"]
    assert (speed["of"], speed["value"], speed["unit"]) == ("ego", 3.0, "m/s")
    after = rows["bv_moves_over", "storyboard element state condition"]
    assert (after["to"], after["value"], after["unit"]) == ("bv_sets_off", 1.0, "s")
    assert speed["together"] == after["together"] == "bv_moves_over_condition_1"
    assert (speed["action"], speed["lanes"]) == ("lane change action", -1)
    assert rows["bv_sets_off", "relative distance condition"]["together"] is None
    fog = rows["fog_falls", "simulation time condition"]
    assert (fog["participant"], fog["action"]) == (None, "environment action")


def test_every_question_finds_something_in_everything(everything):
    """But for those about two routes, as only the ego has one, and about what came of it."""
    silent = {name for name in questions() if not ask(everything, name).rows}
    assert silent == {"conflicts", "outcomes", "responsible"}


def test_every_question_says_what_it_asks():
    for one in questions().values():
        assert one.query.startswith(f"# {one.description}\n")
        assert one.description[0].isupper()
        assert one.description.endswith("?")
        assert len(one.query.splitlines()[0]) <= 100
        assert "ORDER BY" in one.query  # the same file gives the same answer


def test_roads_of_other_templates_answer(individuals_of):
    """The first scenarios of their kind in the catalogue, read from their files by hand."""
    roadworks = ask(individuals_of("road-works"), "closed-lanes").rows
    # 150 m of cones every 10 m from 330 m on; the sign 100 m before
    assert roadworks == (
        ("works", "main", -2, "out", "cone", 16, 330.0, 480.0),
        ("works", "main", -2, "out", "construction sign", 1, 230.0, 230.0),
    )
    night = individuals_of("pedestrian-at-night")
    (crossing,) = (row for row in ask(night, "crosswalks").rows if row[5] is not None)
    assert crossing == ("D", "crosswalk_D", 3.0, 4.0, None, "walker", "pedestrian")
    assert {row[2] for row in ask(night, "reach").rows if row[0] == "crosswalk_D"} == {
        *("ego", "walker"),
    }
    assert [row[1] for row in ask(individuals_of("jam-tail-in-fog"), "jams").rows] == [
        f"jam_{number}" for number in range(1, 7)
    ]


def test_answers_survive_saving(case, everything):
    _, _, individuals = case
    for one in (individuals, everything):
        again = from_bytes(to_bytes(one))
        for name in questions():
            assert ask(again, name) == ask(one, name)


def test_roads_alone_answer_what_they_can():
    static = {
        "lane_width": 3.0,
        "lanes_per_direction": 1,
        "arm_length": 50,
        "intersection_size": 20,
    }
    individuals = build_static(static)
    assert len(ask(individuals, "lanes").rows) == 4
    assert all(not ask(individuals, name).rows for name in questions() if name != "lanes")


def test_an_unknown_question_suggests_the_nearest(individuals):
    with refuses(UnknownNameError, "weather"):
        ask(individuals, "wether")


# -- a user's own ----------------------------------------------------------------------------------


def test_own_select(individuals, values):
    query = "SELECT ?rain ?none { ?rain a bg:Rain ; bg:has_precipitation ?x FILTER(?x > 0) }"
    assert ask_sparql(individuals, query).rows == (("weather_rain", None),)
    (row,) = ask_sparql(individuals, "SELECT ?v ?i ?s { ?p bg:has_fog_density ?v . "
                        "?c bg:has_junction_id ?s BIND(3 AS ?i) }").rows  # fmt: skip
    assert row == (values["fog_density"], 3, "100")


@pytest.mark.parametrize(
    ("query", "message"),
    [
        ("SELECT * { SERVICE <http://127.0.0.1/> { ?s ?p ?o } }", "nothing"),
        ("SELECT * { SERV\\u0049CE <http://127.0.0.1/> { ?s ?p ?o } }", "nothing"),
        ("SELECT * { 1serviceSILENT<x:y>{} }", "nothing"),
        ("ASK { ?s ?p ?o }", "SELECT"),
        ("CONSTRUCT { ?s ?p ?o } { ?s ?p ?o }", "SELECT"),
        ("DELETE WHERE { ?s ?p ?o }", "answered"),
        ("SELECT", "answered"),
        ("", "answered"),
        ("SELECT * { ?a ?b ?c . ?d ?e ?f }", "10000"),
    ],
)
def test_refused_in_one_line(individuals, query, message):
    with refuses(InputError, message) as error:
        ask_sparql(individuals, query)
    assert len(str(error.value).splitlines()) == 1


def test_a_query_without_end_is_ended(individuals, monkeypatch):
    monkeypatch.setattr(module, "MAX_SECONDS", 0.5)
    many = " . ".join(f"?s{n} ?p{n} ?o{n}" for n in range(6))
    with refuses(InputError, "0.5 s"):
        ask_sparql(individuals, f"SELECT (COUNT(*) AS ?n) {{ {many} }}")


@pytest.mark.skipif(sys.platform != "linux", reason="no limit of memory")
def test_a_greedy_query_is_ended(individuals, monkeypatch):
    monkeypatch.setattr(module, "MAX_MEMORY", 2**28)
    many = " . ".join(f"?s{n} ?p{n} ?o{n}" for n in range(4))
    with refuses(InputError):
        ask_sparql(individuals, f"SELECT * {{ {many} }} ORDER BY ?s0")


def test_files(individuals, tmp_path):
    owl = tmp_path / "s.owl"
    save(individuals, owl)
    own = tmp_path / "q.rq"
    own.write_text("SELECT ?d { ?c bg:has_driver ?d } ORDER BY ?d", "utf-8")
    assert ask_file(owl, sparql=own).rows == (("insistent",), ("route-follower",))
    assert ask_file(owl, "driver").rows == (("bv", "insistent"), ("ego", "route-follower"))
    assert [name for name, _ in ask_file(owl).rows] == sorted(questions())
    with pytest.raises(InputError, match="not both"):
        ask_file(owl, "driver", own)
    with refuses(FileFormatError):
        ask_file(owl, sparql=tmp_path / "none.rq")
    own.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(FileFormatError, match="not UTF-8"):
        ask_file(owl, sparql=own)
    own.write_bytes(b"#" * (module.MAX_QUERY + 1))
    with refuses(FileFormatError, "100000"):
        ask_file(owl, sparql=own)


def test_nothing_known_gives_no_rows():
    assert ask(Individuals(()), "weather").rows == ()
