import pyoxigraph as ox
import pytest

from bridgegen.scenario.ontology.graph import Individuals
from bridgegen.scenario.ontology.phrases import Phrases, quantity
from bridgegen.scenario.ontology.structure import Members
from bridgegen.scenario.ontology.vocabulary import SCENARIOS, TYPE, bg, local_name, tbox

NARROW = "\N{NARROW NO-BREAK SPACE}"


def node(name: str) -> ox.NamedNode:
    return ox.NamedNode(f"{SCENARIOS}x#{name}")


def said(cls: str, **values: object) -> str:
    """Say an individual of a class; a text that begins with # is another individual."""
    quads = [ox.Quad(node("it"), TYPE, bg(cls))]
    for name, given in values.items():
        for value in given if isinstance(given, list) else [given]:
            term = ox.Literal(value)
            if isinstance(value, str) and value.startswith("#"):
                term = node(value[1:])
            quads.append(ox.Quad(node("it"), bg(name), term))
    quads += [
        ox.Quad(node("early"), TYPE, bg("SimulationTimeCondition")),
        ox.Quad(node("early"), bg("has_value"), ox.Literal(2.0)),
        ox.Quad(node("near"), TYPE, bg("RelativeDistanceCondition")),
        ox.Quad(node("near"), bg("has_value"), ox.Literal(30.0)),
        ox.Quad(node("near"), bg("has_entity_ref"), node("ego")),
    ]
    phrase = Phrases(Members(Individuals(quads))).say(node("it"))
    return phrase.text.replace(NARROW, " ")


@pytest.mark.parametrize(
    ("text", "cls", "values"),
    [
        ("speed 1.8 m/s at 3 m/s²", "SpeedAction", {"has_target_speed": 1.8, "has_rate": 3.0}),
        ("speed 1.8 m/s", "SpeedAction", {"has_target_speed": 1.8}),
        (
            "1 lane to the right within 4 s (cubic)",
            "LaneChangeAction",
            {"has_lane_count": -1, "has_transition_time": 4.0, "has_dynamics_shape": "cubic"},
        ),
        ("2 lanes to the left", "LaneChangeAction", {"has_lane_count": 2}),
        ("weather rain", "EnvironmentAction", {"has_weather": "#rain"}),
        ("lane_1, 40 m", "LanePosition", {"on_lane": "#lane_1", "has_distance": 40.0}),
        (
            "lane_1, 40 m, −0.5 m aside",
            "LanePosition",
            {"on_lane": "#lane_1", "has_distance": 40.0, "has_lateral_offset": -0.5},
        ),
        ("time ≥ 2 s", "SimulationTimeCondition", {"has_value": 2.0}),
        ("time < 2 s", "SimulationTimeCondition", {"has_value": 2.0, "has_rule": "lessThan"}),
        (
            "ego within 30 m",
            "RelativeDistanceCondition",
            {"has_value": 30.0, "has_entity_ref": "#ego"},
        ),
        (
            "distance to ego ≥ 30 m",
            "RelativeDistanceCondition",
            {"has_value": 30.0, "has_entity_ref": "#ego", "has_rule": "greaterOrEqual"},
        ),
        ("ego speed ≥ 3 m/s", "SpeedCondition", {"has_value": 3.0, "has_subject": "#ego"}),
        (
            "time to collision with ego ≤ 1.5 s",
            "TimeToCollisionCondition",
            {"has_value": 1.5, "has_entity_ref": "#ego"},
        ),
        (
            "1 s after bv_sets_off",
            "StoryboardElementStateCondition",
            {"has_value": 1.0, "has_event_ref": "#bv_sets_off"},
        ),
        ("time ≥ 2 s or ego within 30 m", "Trigger", {"has_condition": ["#early", "#near"]}),
        (
            "(time ≥ 2 s and ego within 30 m)",
            "ConditionGroup",
            {"has_condition": ["#early", "#near"]},
        ),
        ("delete entity action: refers to bv", "DeleteEntityAction", {"has_entity_ref": "#bv"}),
    ],
)
def test_words(text, cls, values):
    assert said(cls, **values) == text


@pytest.mark.parametrize(
    "cls",
    sorted(
        local_name(cls)
        for top in ("Action", "Condition", "Position")
        for cls in tbox().subclasses[bg(top)]
    ),
)
def test_every_class_is_said_even_where_everything_is_missing(cls):
    assert said(cls)


def test_two_values_are_both_shown():
    assert said("SpeedAction", has_target_speed=[1.0, 2.0]) == "speed 1 m/s, 2 m/s"


def test_a_circle_comes_to_an_end():
    assert "it" in said("Trigger", has_condition=["#it"])


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [
        (6.9, "m/s", "6.9 m/s"), (-37.936, "deg", "−37.94°"), (0.6, "1", "0.6"),
        (2.0, "count", "2"),
        (12345.0, "kg", "12345 kg"), (0.000123456, "1/m", "0.0001235 1/m"), (-0.0, "m", "0 m"),
    ],
)  # fmt: skip
def test_quantities(value, unit, text):
    assert quantity(value, unit).replace(NARROW, " ") == text
