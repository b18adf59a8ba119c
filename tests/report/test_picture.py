"""The picture of five columns: what is in it are the individuals, and what is wrong with them."""

import json
from collections import Counter
from dataclasses import replace

import pyoxigraph as ox
import pytest
from tests.approval import approve

from bridgegen.pages.painter import FEW, paint
from bridgegen.pages.picture_payload import FOLD, pictures_payload
from bridgegen.scenario.ontology.check import check
from bridgegen.scenario.ontology.graph import Individuals
from bridgegen.scenario.ontology.individuals import build
from bridgegen.scenario.ontology.vocabulary import EQUIVALENT_CLASS, SCENARIOS, TYPE, bg

NARROW = "\N{NARROW NO-BREAK SPACE}"


@pytest.fixture(scope="module")
def picture(individuals):
    return paint(individuals)


def box(picture, id_):
    return next(one for one in picture.all_boxes() if one.id == id_)


def facts(picture, id_):
    return [(one.label, one.text.replace(NARROW, " ")) for one in box(picture, id_).facts]


def node(name):
    return ox.NamedNode(f"{SCENARIOS}all-layers#{name}")


def changed(individuals, name, property_, value):
    """The same individuals, with one value another, or without it (None)."""
    quads = [
        quad
        for quad in individuals.quads
        if (quad.subject, quad.predicate) != (node(name), bg(property_))
    ]
    assert len(quads) < len(individuals.quads)
    if value is not None:
        quads.append(ox.Quad(node(name), bg(property_), ox.Literal(value)))
    return Individuals(quads)


# -- boxes and columns -----------------------------------------------------------------------------


def test_every_layer_holds_what_the_scenario_says(picture):
    """Four legs of two lanes each way with sidewalks, crosswalks and lights; a jam of two; works:
    20 m with a cone every 5 m, and a sign; ego, truck and walker; the truck's two events."""
    assert Counter((one.layer, one.cls) for one in picture.all_boxes()) == {
        (1, "road network"): 1, (1, "crossroads"): 1, (1, "road"): 4, (1, "lane"): 16,
        (1, "crosswalk"): 4, (1, "sidewalk"): 8,
        (2, "traffic light"): 4, (2, "signal controller"): 1, (2, "signal phase"): 6,
        (2, "stop line"): 4, (2, "cone"): 5, (2, "construction sign"): 1,
        (3, "traffic jam"): 1, (3, "road works"): 1,
        (4, "car"): 2, (4, "van"): 1, (4, "truck"): 1, (4, "pedestrian"): 1,
        (4, "storyboard event"): 2,
        (5, "weather"): 1, (5, "rain"): 1, (5, "cloud"): 1, (5, "wind"): 1, (5, "fog"): 1,
        (5, "sun"): 1, (5, "road state"): 1,
    }  # fmt: skip


def test_nobody_is_missing(picture, individuals):
    """Every individual of the file is a box, in words, a parameter, or the scenario."""
    assert picture.left_out == ()
    ids = [one.id for one in picture.all_boxes()]
    assert len(set(ids)) == len(ids)


def test_values_have_units_and_say_which_parameter_gives_them(picture, values):
    speed = next(one for one in box(picture, "ego").facts if "speed" in one.text)
    assert speed.text == f"speed {values['ego_speed']:.4g}{NARROW}m/s"
    assert speed.bound == (("ego_speed", values["ego_speed"]),)
    declared = picture.parameters["ego_speed"]
    assert (declared.low, declared.high, declared.unit) == (4.9, 8.9, "m/s")  # encounter.yaml
    assert ("width", "3.5 m") in facts(picture, "leg_A_in_1")
    assert ("heading", "270°") in facts(picture, "leg_A")  # the leg to the south
    assert picture.parameters["friction"].formula


def test_an_event_is_in_its_participants_box_in_words(picture, values):
    assert [one.id for one in box(picture, "bv").inside] == ["bv_moves_over", "bv_sets_off"]
    time, distance, speed = (
        f"{values[name]:.4g}" for name in ("bv_trigger_time", "bv_trigger_distance", "bv_speed")
    )
    assert facts(picture, "bv_sets_off") == [
        ("", f"speed {speed} m/s at 3 m/s² when time ≥ {time} s or ego within {distance} m")
    ]
    bound = [name for name, _ in box(picture, "bv_sets_off").facts[0].bound]
    assert bound == ["bv_speed", "bv_trigger_time", "bv_trigger_distance"]
    assert facts(picture, "bv_moves_over") == [
        (
            "",
            "1 lane to the right within 4 s (sinusoidal) when "
            "(1 s after bv_sets_off and ego speed ≥ 3 m/s)",
        )
    ]


@pytest.mark.parametrize(
    ("from_", "to", "label"),
    [
        ("ego", "leg_C_in_1", "starts at"),  # P5: in, leg C
        ("ego", "leg_D_out_1", "ends at"),  # P8: out, leg D
        ("bv_sets_off", "bv", "who"),
        ("bv_sets_off", "ego", "when"),
        ("bv_moves_over", "bv_sets_off", "when"),
        ("light_A", "leg_A_in_2", "governs lane"),
        ("works", "leg_D_in_2", "closes lane"),
        ("queue", "queue_2", "who"),
        ("signals_phase_1", "light_C", "gives green to"),
    ],
)
def test_links(picture, from_, to, label):
    found = {link.to: link.label for link in box(picture, from_).links}
    assert label in found[to]


def test_links_lead_to_boxes_only(picture):
    ids = {one.id for one in picture.all_boxes()}
    assert {link.to for one in picture.all_boxes() for link in one.links} <= ids


def test_what_matters_is_shown_and_the_rest_is_not_lost(picture):
    ego = box(picture, "ego")
    assert FEW <= ego.shown < len(ego.facts)
    assert ("wheelbase", "2.8 m") in facts(picture, "ego")[ego.shown :]
    assert all(one.shown >= min(FEW, len(one.facts)) for one in picture.all_boxes())


def test_a_new_class_finds_its_column(individuals):
    cls = ox.NamedNode("https://example.org/own#Trolleybus")
    own = [
        ox.Quad(cls, ox.NamedNode("http://www.w3.org/2000/01/rdf-schema#subClassOf"), bg("Bus")),
        ox.Quad(node("trolley"), TYPE, cls),
    ]
    trolley = box(paint(Individuals([*individuals.quads, *own])), "trolley")
    assert (trolley.layer, trolley.cls) == (4, "Trolleybus")
    same = [ox.Quad(cls, EQUIVALENT_CLASS, bg("Fog")), ox.Quad(node("mist"), TYPE, cls)]
    assert box(paint(Individuals([*individuals.quads, *same])), "mist").layer == 5


def test_what_nobody_refers_to_is_named(individuals):
    lost = ox.Quad(node("lost"), TYPE, bg("LanePosition"))
    assert paint(Individuals([*individuals.quads, lost])).left_out == ("lost",)


def test_a_value_that_no_individual_carries_is_a_fact_of_the_scenario(picture, values):
    shown = {one.label: one.text for one in picture.facts}
    assert shown["speed_factor"] == f"{values['speed_factor']:.4g}"
    assert shown["duration"] == f"20{NARROW}s"


# -- violations ------------------------------------------------------------------------------------


def painted(individuals, scenario=None):
    return paint(individuals, check(individuals, scenario), "checked")


def test_a_scenario_as_it_should_be_has_none(individuals, layered):
    found = painted(individuals, layered)
    assert found.violations == ()
    assert not any(one.broken for one in found.all_boxes())
    assert not any(fact.wrong for one in found.all_boxes() for fact in one.facts)


def test_a_planted_value_is_wrong_in_its_box_with_the_reason(individuals, layered):
    found = painted(changed(individuals, "weather_fog", "has_fog_density", 140.0), layered)
    broken = {one.id for one in found.all_boxes() if one.broken}
    assert broken == {"weather_fog"}
    fog = box(found, "weather_fog")
    reasons = " ".join(found.violations[number].text for number in fog.broken)
    for part in ("0 <= fog_density <= 100", "[%]", "got 140", "Aviation Weather"):
        assert part in reasons
    wrong = {fact.label: fact.text for fact in fog.facts if fact.wrong}
    assert wrong["fog density"] == f"140{NARROW}%"
    # speed_factor, which no individual carries, no longer follows from the fog
    assert [found.violations[number].about for number in found.homeless] == [
        "speed_factor (DerivedParameter): speed_factor"
    ]
    assert [fact.label for fact in found.facts if fact.wrong] == ["speed_factor"]


def test_a_value_in_words_is_wrong_in_the_box_that_says_it(individuals, layered):
    found = painted(changed(individuals, "ego_start", "has_distance", 400.0), layered)
    assert {one.id for one in found.all_boxes() if one.broken} == {"ego"}
    wrong = [fact.text for fact in box(found, "ego").facts if fact.wrong]
    assert wrong
    assert all("400" in text for text in wrong)
    approve(found.violations[0].text, "road")


def test_a_value_that_is_missing_is_said_in_the_box(individuals):
    found = painted(changed(individuals, "leg_A_in_1", "has_width", None))
    assert {one.id for one in found.all_boxes() if one.broken} == {"leg_A_in_1"}
    approve(found.violations[0].text, "has_width")


def test_a_range_that_the_file_declares_is_broken_wherever_the_value_is(individuals):
    found = painted(changed(individuals, "p_arm_length", "has_high", 60.0))
    assert {one.id for one in found.all_boxes() if one.broken} == {f"leg_{leg}" for leg in "ABCD"}


# -- what is sent to the page ----------------------------------------------------------------------


def groups(payload, layer):
    return payload["columns"][payload["pictures"][0]["columns"][layer - 1]]


def test_many_boxes_fold_and_say_once_what_they_share(picture):
    sent = pictures_payload([picture])
    lanes = next(one for one in groups(sent, 1) if one["class"] == "lane")
    assert ["width", f"3.5{NARROW}m"] in lanes["common"]
    assert len(lanes["boxes"]) == 16 > FOLD
    assert all("width" not in {fact[0] for fact in one["facts"]} for one in lanes["boxes"])
    cars = [one for one in groups(sent, 4) if one["class"] == "car"]
    assert "common" not in cars[0]


def test_a_violated_box_stays_out_of_the_fold(individuals):
    sent = pictures_payload([painted(changed(individuals, "leg_A_in_1", "has_width", None))])
    first, rest = (one for one in groups(sent, 1) if one["class"] == "lane")
    assert [one["id"] for one in first["boxes"]] == ["leg_A_in_1"]
    assert "common" not in first
    assert ["width", f"3.5{NARROW}m"] in rest["common"]
    assert len(rest["boxes"]) == 15


def test_nothing_is_lost_on_the_way(picture):
    sent = pictures_payload([picture])
    for layer in range(1, 6):
        for group in groups(sent, layer):
            for one in group["boxes"]:
                want = Counter((f.label, f.text) for f in box(picture, one["id"]).facts)
                got = Counter((fact[0], fact[1]) for fact in one["facts"] + group.get("common", []))
                assert got == want


def test_a_column_that_scenarios_share_is_held_once(layered, values):
    faster = build(layered, {**values, "ego_speed": 8.0}, driver="route-follower")
    same = build(layered, values, driver="route-follower")
    sent = pictures_payload([paint(same), paint(faster)])
    (a, b) = (one["columns"] for one in sent["pictures"])
    assert [x == y for x, y in zip(a, b, strict=True)] == [True, True, True, False, True]
    assert len(sent["columns"]) == 6


def test_ten_scenarios_take_little_room(layered):
    space = layered.space()
    rows = space.decode([[k / 10] * space.n_var for k in range(10)])
    pictures = [
        paint(build(layered, space.values(x), driver="route-follower"), (), "checked") for x in rows
    ]
    assert len(json.dumps(pictures_payload(pictures))) < 250_000


def test_the_playbacks_pictures_are_sent_with_them(report, picture):
    from bridgegen.pages.payload import payload

    first, second, *rest = report.kept
    sent = payload(replace(report, kept=(first, replace(second, picture=picture), *rest)))
    assert [one["picture"] for one in sent["kept"]] == [None, 0, None, None]
    assert len(sent["pictures"]["pictures"]) == 1
