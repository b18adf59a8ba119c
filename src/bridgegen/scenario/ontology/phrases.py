"""Actions, conditions and positions in words: "speed 1.8 m/s at 3 m/s²", "ego within 30 m".

A class without a phrase is described by its label and its values, so that nothing is left
out. Missing or duplicate values, as may be in a file that was edited, are shown as
it is; nothing here raises.
"""

from collections.abc import Callable
from dataclasses import dataclass, field

import pyoxigraph as ox

from bridgegen.scenario.ontology.graph import as_number
from bridgegen.scenario.ontology.structure import Members
from bridgegen.scenario.ontology.vocabulary import TYPE, Subject, bg, local_name, tbox

NARROW = "\N{NARROW NO-BREAK SPACE}"
_UNITS = {"deg": "°", "1": "", "count": "", "m/s^2": "m/s²"}
_RULES = {
    "lessThan": "<",
    "lessOrEqual": "≤",
    "equalTo": "=",
    "greaterOrEqual": "≥",
    "greaterThan": ">",
    "notEqualTo": "≠",
}
_UNSAID = frozenset({TYPE, bg("has_name"), bg("has_parameter"), bg("binds_property")})
_DEEP = 8
"""Largest depth of individuals within individuals; a circle in an edited file ends there."""
_MOST_PLACES = 12
"""Largest number of places of a trajectory that are listed; of a longer one, its two ends are."""


@dataclass
class Phrase:
    """Words, and what they were taken from.

    Attributes:
        text: the words.
        bound: the values that a parameter gives: individual, property.
        nodes: the individuals that the words are about.
    """

    text: str = ""
    bound: list[tuple[Subject, ox.NamedNode]] = field(default_factory=list)
    nodes: list[Subject] = field(default_factory=list)


class Phrases:
    """Describes the individuals of a file in words."""

    def __init__(self, members: Members) -> None:
        self.members = members

    def say(self, node: Subject) -> Phrase:
        """Return an individual that is no box of its own in words, with all that hangs on it."""
        phrase = Phrase()
        phrase.text = _Speaker(self.members, phrase).node(node)
        return phrase

    def event(self, what: list[Subject], when: list[Subject]) -> Phrase:
        """Return what an event does, and when."""
        phrase = Phrase()
        speaker = _Speaker(self.members, phrase)
        does = " and ".join(speaker.node(node) for node in what)
        starts = " or ".join(speaker.node(node) for node in when)
        phrase.text = " when ".join(part for part in (does, starts) if part)
        return phrase


class _Speaker:
    """Builds one phrase, and records its sources."""

    def __init__(self, members: Members, phrase: Phrase) -> None:
        self.members, self.phrase = members, phrase
        self.depth = 0

    def node(self, node: Subject) -> str:
        self.phrase.nodes.append(node)
        if self.depth >= _DEEP:
            return self.members.name(node)
        self.depth += 1
        known = (say for cls, say in _SAYINGS.items() if self.members.is_a(node, cls))
        text = next(known, _anything)(self, node)
        self.depth -= 1
        return text

    def value(self, node: Subject, name: str, unit: str | None = None) -> str:
        """Return the values of a data property, with the unit; "?" where there is none."""
        term = bg(name)
        found = self.members.values(node).get(term, [])
        self.phrase.bound.append((node, term))
        if unit is None:
            unit = unit_of(term)
        return (
            ", ".join(value_text(item, unit) for item in found if isinstance(item, ox.Literal))
            or "?"
        )

    def link(self, node: Subject, name: str) -> str:
        """Return the names of what a property points to; "?" where it points to nothing."""
        found = self.links(node, name)
        return ", ".join(map(self.members.name, found)) or "?"

    def links(self, node: Subject, name: str) -> list[Subject]:
        values = self.members.values(node).get(bg(name), [])
        return [value for value in values if isinstance(value, Subject)]

    def inner(self, node: Subject, name: str) -> str:
        """Return what a property points to in words; "?" where it points to nothing."""
        return ", ".join(self.node(link) for link in self.links(node, name)) or "?"

    def has(self, node: Subject, name: str) -> bool:
        return bool(self.members.values(node).get(bg(name)))


Saying = Callable[[_Speaker, Subject], str]


def _anything(speaker: _Speaker, node: Subject) -> str:
    """Describe a class without a phrase: its label and all values."""
    members, parts = speaker.members, []
    for term, values in members.values(node).items():
        if term in _UNSAID or term == bg("has_rule"):
            continue
        if isinstance(values[0], ox.Literal):
            text = speaker.value(node, local_name(term))
        elif members.layer(values[0]) is not None:
            text = ", ".join(members.name(value) for value in values if isinstance(value, Subject))
        else:
            text = ", ".join(speaker.node(value) for value in values if isinstance(value, Subject))
        parts.append(f"{property_label(term)} {text}")
    label = members.class_label(members.class_of(node)) if any(members.classes(node)) else ""
    return f"{label or members.name(node)}{': ' if parts else ''}{', '.join(parts)}"


# -- actions ---------------------------------------------------------------------------------------


def _change(speaker: _Speaker, node: Subject) -> str:
    """Describe a change's dynamics: at a rate, within a time, over a distance; else at once."""
    text = "".join(
        f" {word} {speaker.value(node, name)}"
        for name, word in (
            ("has_rate", "at"),
            ("has_transition_time", "within"),
            ("has_transition_distance", "over"),
            ("has_max_jerk", "with"),
        )
        if speaker.has(node, name)
    )
    shape = "has_dynamics_shape"
    return f"{text} ({speaker.value(node, shape)})" if speaker.has(node, shape) else text


def _speed(speaker: _Speaker, node: Subject) -> str:
    return f"speed {speaker.value(node, 'has_target_speed')}{_change(speaker, node)}"


def _lane_change(speaker: _Speaker, node: Subject) -> str:
    found = speaker.members.values(node).get(bg("has_lane_count"), [])
    number = as_number(found[0]) if len(found) == 1 and isinstance(found[0], ox.Literal) else None
    if number is None:
        return f"lane change by {speaker.value(node, 'has_lane_count')}{_change(speaker, node)}"
    side = "left" if number > 0 else "right"
    count = f"{abs(number):g} lane{'' if abs(number) == 1 else 's'}"
    return f"{count} to the {side}{_change(speaker, node)}"


def _trajectory(speaker: _Speaker, node: Subject) -> str:
    vertices = [
        v
        for link in speaker.links(node, "has_trajectory")
        for v in speaker.links(link, "has_vertex")
    ]
    speaker.phrase.nodes += speaker.links(node, "has_trajectory") + vertices

    def index(vertex: Subject) -> float:
        found = speaker.members.values(vertex).get(bg("has_index"), [])
        return next((as_number(v) or 0.0 for v in found if isinstance(v, ox.Literal)), 0.0)

    places = [speaker.inner(item, "has_position") for item in sorted(vertices, key=index)]
    if len(places) > _MOST_PLACES:
        places = [places[0], f"{len(places) - 2} points between", places[-1]]
    smooth = any(
        speaker.has(link, "has_spline_order") for link in speaker.links(node, "has_trajectory")
    )
    return f"along {'a smooth curve by ' * smooth}{' → '.join(places) or '?'}"


def _lane_position(speaker: _Speaker, node: Subject) -> str:
    aside = "has_lateral_offset"
    beside = f", {speaker.value(node, aside)} aside" if speaker.has(node, aside) else ""
    if speaker.has(node, "has_relative_heading"):
        beside += f", turned by {speaker.value(node, 'has_relative_heading')}"
    return f"{speaker.link(node, 'on_lane')}, {speaker.value(node, 'has_distance')}{beside}"


# -- conditions ------------------------------------------------------------------------------------


def _rule(speaker: _Speaker, node: Subject, usual: str) -> str:
    found = speaker.members.values(node).get(bg("has_rule"), [])
    given = [_RULES.get(item.value, item.value) for item in found if isinstance(item, ox.Literal)]
    return given[0] if given else usual


def _compared(quantity_: str, unit: str, usual: str, link: str = "has_entity_ref") -> Saying:
    """Return the phrase of a condition: "quantity other ≥ value", after its subject."""

    def say(speaker: _Speaker, node: Subject) -> str:
        subject = (
            f"{speaker.link(node, 'has_subject')} " if speaker.has(node, "has_subject") else ""
        )
        other = f" {speaker.link(node, link)}" if speaker.has(node, link) else ""
        value = speaker.value(node, "has_value", unit)
        return f"{subject}{quantity_}{other} {_rule(speaker, node, usual)} {value}"

    return say


def _aside(speaker: _Speaker, node: Subject) -> str:
    return f"{speaker.value(node, 'has_target_offset')} left of the lane's centre"


def _keeps(speaker: _Speaker, node: Subject) -> str:
    kept = "has_kept_distance" if speaker.has(node, "has_kept_distance") else "has_kept_time"
    return f"{speaker.value(node, kept)} behind {speaker.link(node, 'has_entity_ref')}"


def _lights(speaker: _Speaker, node: Subject) -> str:
    return f"{speaker.value(node, 'has_light_type')} {speaker.value(node, 'has_light_mode')}"


def _arrives(speaker: _Speaker, node: Subject) -> str:
    other = speaker.link(node, "has_entity_ref")
    there = speaker.inner(node, "has_master_position")
    return f"at {speaker.inner(node, 'has_position')} when {other} is at {there}"


def _distance(speaker: _Speaker, node: Subject) -> str:
    if speaker.has(node, "has_distance_measure"):
        return _compared("gap to", "m", "≤")(speaker, node)
    if speaker.has(node, "has_rule"):
        return _compared("distance to", "m", "≤")(speaker, node)
    subject = f"{speaker.link(node, 'has_subject')} to " if speaker.has(node, "has_subject") else ""
    other = speaker.link(node, "has_entity_ref")
    return f"{subject}{other} within {speaker.value(node, 'has_value', 'm')}"


def _after(speaker: _Speaker, node: Subject) -> str:
    value = speaker.value(node, "has_value", "s")
    begins = " begins" if speaker.has(node, "has_event_state") else ""
    return f"{value} after {speaker.link(node, 'has_event_ref')}{begins}"


def _reached(speaker: _Speaker, node: Subject) -> str:
    value = speaker.value(node, "has_value", "m")
    return f"within {value} of {speaker.inner(node, 'has_position')}"


def _all_of(speaker: _Speaker, node: Subject) -> str:
    return f"({' and '.join(map(speaker.node, speaker.links(node, 'has_condition'))) or '?'})"


def _any_of(speaker: _Speaker, node: Subject) -> str:
    return " or ".join(map(speaker.node, speaker.links(node, "has_condition"))) or "?"


def _driver(speaker: _Speaker, node: Subject) -> str:
    name: str = speaker.value(node, "has_driver")
    if not speaker.members.values(node).get(bg("has_ideal_stages")):
        return name
    return f"{name}, ideal {speaker.value(node, 'has_ideal_stages')}"


_SAYINGS: dict[str, Saying] = {
    "SpeedAction": _speed,
    "LaneChangeAction": _lane_change,
    "LaneOffsetAction": _aside,
    "LongitudinalDistanceAction": _keeps,
    "SynchronizeAction": _arrives,
    "LightStateAction": _lights,
    "TeleportAction": lambda speaker, node: speaker.inner(node, "has_position"),
    "FollowTrajectoryAction": _trajectory,
    "EnvironmentAction": lambda speaker, node: f"weather {speaker.link(node, 'has_weather')}",
    "TrafficSignalStateAction": lambda speaker, node: (
        f"{speaker.link(node, 'has_signal')} turns {speaker.value(node, 'has_signal_state')}"
    ),
    "LanePosition": _lane_position,
    "Route": lambda speaker, node: (
        f"{speaker.inner(node, 'has_start')} → {speaker.inner(node, 'has_destination')}"
    ),
    "Controller": _driver,
    "Trigger": _any_of,
    "ConditionGroup": _all_of,
    "SimulationTimeCondition": _compared("time", "s", "≥"),
    "RelativeDistanceCondition": _distance,
    "TimeToCollisionCondition": _compared("time to collision with", "s", "≤"),
    "TimeHeadwayCondition": _compared("time headway to", "s", "≤"),
    "SpeedCondition": _compared("speed", "m/s", "≥"),
    "TraveledDistanceCondition": _compared("distance travelled", "m", "≥"),
    "StandStillCondition": _compared("standstill", "s", "≥"),
    "ReachPositionCondition": _reached,
    "CollisionCondition": lambda speaker, node: (
        f"contact with {speaker.link(node, 'has_entity_ref')}"
    ),
    "StoryboardElementStateCondition": _after,
    "TrafficSignalCondition": lambda speaker, node: (
        f"{speaker.link(node, 'has_signal')} is {speaker.value(node, 'has_signal_state')}"
    ),
}


# -- values ----------------------------------------------------------------------------------------


def property_label(term: ox.NamedNode) -> str:
    """Return what people call a property: "has length" is "length"."""
    name = local_name(term)
    return tbox().labels.get(name, name).removeprefix("has ")


def unit_of(term: ox.NamedNode) -> str:
    """Return the unit of a property's values; empty where it has none."""
    return tbox().units.get(local_name(term), "")


def quantity(value: float, unit: str) -> str:
    """Return a number of four digits with its unit; a whole one keeps all of its digits."""
    value += 0.0  # no negative zero
    text = f"{value:.0f}" if value.is_integer() and abs(value) < 1e15 else f"{value:.4g}"
    shown = _UNITS.get(unit, unit)
    gap = NARROW if shown and shown != "°" else ""
    return text.replace("-", "\N{MINUS SIGN}") + gap + shown


def value_text(value: ox.Literal, unit: str) -> str:
    """Return a literal in words: a number with its unit, a text as it is."""
    number = as_number(value)
    return value.value if number is None else quantity(number, unit)
