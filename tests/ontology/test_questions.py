"""Competency questions: the ontology answers what the scenarios' descriptions say in words."""

import sys
from dataclasses import replace

import pytest

from bridgegen.errors import FileFormatError, InputError, UnknownNameError
from bridgegen.odd.reader import load
from bridgegen.odd.story import Waypoint
from bridgegen.ontology import questions as module
from bridgegen.ontology.files import from_bytes, save, to_bytes
from bridgegen.ontology.graph import Individuals
from bridgegen.ontology.individuals import build, build_static
from bridgegen.ontology.questions import ask, ask_file, ask_sparql, questions

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
    values = space.values(space.decode([[0.4] * space.n_var])[0])
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
    assert rain.startswith("cloudiness >= precipitation: Rain falls from clouds")


def test_lanes_and_driver(case):
    _, values, individuals = case
    lanes = ask(individuals, "lanes").rows
    count = int(values["lanes_per_direction"])
    assert [(leg, lane) for leg, _, lane, _ in lanes] == [
        (leg, lane) for leg in "ABCD" for lane in range(1, count + 1)
    ]
    assert ask(individuals, "driver").rows == (("ego", "reference"),)


def test_answers_survive_saving(case):
    _, _, individuals = case
    again = from_bytes(to_bytes(individuals))
    for name in questions():
        assert ask(again, name) == ask(individuals, name)


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
    with pytest.raises(UnknownNameError, match="did you mean 'weather'"):
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
        ("SELECT * { SERVICE <http://127.0.0.1/> { ?s ?p ?o } }", "nothing goes to the network"),
        ("SELECT * { SERV\\u0049CE <http://127.0.0.1/> { ?s ?p ?o } }", "nothing goes to the"),
        ("SELECT * { 1serviceSILENT<x:y>{} }", "nothing goes to the network"),
        ("ASK { ?s ?p ?o }", "must be a SELECT"),
        ("CONSTRUCT { ?s ?p ?o } { ?s ?p ?o }", "must be a SELECT"),
        ("DELETE WHERE { ?s ?p ?o }", "cannot be answered"),
        ("SELECT", "cannot be answered"),
        ("", "cannot be answered"),
        ("SELECT * { ?a ?b ?c . ?d ?e ?f }", "10000 rows at most; add a LIMIT"),
    ],
)
def test_refused_in_one_line(individuals, query, message):
    with pytest.raises(InputError, match=message) as error:
        ask_sparql(individuals, query)
    assert len(str(error.value).splitlines()) == 1


def test_a_query_without_end_is_ended(individuals, monkeypatch):
    monkeypatch.setattr(module, "MAX_SECONDS", 0.5)
    many = " . ".join(f"?s{n} ?p{n} ?o{n}" for n in range(6))
    with pytest.raises(InputError, match=r"found no end within 0\.5 s"):
        ask_sparql(individuals, f"SELECT (COUNT(*) AS ?n) {{ {many} }}")


@pytest.mark.skipif(sys.platform != "linux", reason="no limit of memory")
def test_a_greedy_query_is_ended(individuals, monkeypatch):
    monkeypatch.setattr(module, "MAX_MEMORY", 2**28)
    many = " . ".join(f"?s{n} ?p{n} ?o{n}" for n in range(4))
    with pytest.raises(InputError, match="GiB, or failed"):
        ask_sparql(individuals, f"SELECT * {{ {many} }} ORDER BY ?s0")


def test_files(individuals, tmp_path):
    owl = tmp_path / "s.owl"
    save(individuals, owl)
    own = tmp_path / "q.rq"
    own.write_text("SELECT ?d { ?c bg:has_driver ?d }", "utf-8")
    assert ask_file(owl, sparql=own).rows == (("route-follower",),)
    assert ask_file(owl, "driver").rows == (("ego", "route-follower"),)
    assert [name for name, _ in ask_file(owl).rows] == sorted(questions())
    with pytest.raises(InputError, match="not both"):
        ask_file(owl, "driver", own)
    with pytest.raises(FileFormatError, match="no such file"):
        ask_file(owl, sparql=tmp_path / "none.rq")
    own.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(FileFormatError, match="not UTF-8"):
        ask_file(owl, sparql=own)
    own.write_bytes(b"#" * (module.MAX_QUERY + 1))
    with pytest.raises(FileFormatError, match="at most 100000 bytes"):
        ask_file(owl, sparql=own)


def test_nothing_known_gives_no_rows():
    assert ask(Individuals(()), "weather").rows == ()
