"""Stories that have one of everything that the ontology can say, and what is said of them."""

from collections.abc import Iterable
from typing import Any

import pyoxigraph as ox

from bridgegen.scenario.ontology.builder import Builder
from bridgegen.scenario.ontology.graph import Individuals
from bridgegen.scenario.ontology.vocabulary import BG, local_name

Thing = tuple[str, dict[str, Any]]

LANES = "leg_A_in_1", "leg_C_out_1", "leg_B_in_1"


def said(individuals: Individuals) -> set[tuple[str, str, str]]:
    """All that is said of layers 3 to 5; roads, lanes and lights are what they are in OpenDRIVE.

    Of layers 1 and 2, and of the static parameters, a storyboard says nothing.
    """
    places: dict[Any, tuple[object, ...]] = {}
    for road in individuals.of_class("Road"):
        road_id = individuals.text(road, "has_road_id")
        places[road] = "road", road_id
        for link in ("has_lane", "has_strip"):
            for lane in individuals.links(road, link):
                places[lane] = "lane", road_id, individuals.integer(lane, "has_lane_id")
    for light in individuals.of_class("TrafficLight"):
        places[light] = "light", individuals.text(light, "has_object_id")
    ours = set(individuals.of_class("RoadCone") + individuals.of_class("ConstructionCard"))
    static = set(individuals.of_class("Static")) - ours
    fixed = {
        one
        for one in individuals.of_class("Parameter")
        if individuals.text(one, "has_axis") == "static"
    }
    unsaid = static | fixed
    rules = {value for one in fixed for value in individuals.texts(one, "constraint")}
    found = set()
    for subject, predicate, value, _ in individuals.quads:
        text = value.value if isinstance(value, ox.Literal) else None
        about_term = isinstance(subject, ox.NamedNode) and subject.value.startswith(BG)
        if subject in unsaid or value in fixed or (about_term and text in rules):
            continue
        if value in static and value not in places and local_name(value) != "road_network":
            continue
        found.add((local_name(subject), local_name(predicate), str(places.get(value, value))))
    return found


class Stage(Builder):
    """Adds events to the individuals of a scenario, under names that an importer gives them."""

    def __init__(self, source: Individuals) -> None:
        scenario = source.one("Scenario")
        super().__init__(source.text(scenario, "has_name"), {})
        self.source = source
        self.scenario = self.iri("scenario")
        self.quads = list(source.quads)

    def thing(self, name: str, cls: str, properties: dict[str, Any]) -> ox.NamedNode:
        """Add an individual; a text in angle brackets is the name of another one."""
        node = self.node(name, cls)
        for key, value in properties.items():
            if isinstance(value, tuple):
                value = self.thing(f"{name}_{PLACE[key]}", *value)
            elif isinstance(value, str) and value.startswith("<"):
                value = self.iri(value.strip("<>"))
            self.put(node, key, value)
        return node

    def event(
        self,
        name: str,
        who: Iterable[str],
        actions: Iterable[Thing],
        groups: Iterable[Iterable[Thing]],
    ) -> None:
        """Add an event."""
        who, actions, groups = list(who), list(actions), [list(group) for group in groups]
        cls = (
            "StoryboardEvent"
            if who
            else (
                "SignalChangeEvent"
                if all(cls == "TrafficSignalStateAction" for cls, _ in actions)
                else "EnvironmentChangeEvent"
            )
        )
        node = self.node(name, cls)
        self.put(self.scenario, "has_event", node)
        self.put(node, "has_name", name)
        for one in who:
            self.put(node, "has_who", self.iri(one))
        for k, (kind, properties) in enumerate(actions, start=1):
            suffix = "" if k == 1 else f"_{k}"
            self.put(node, "has_what", self.thing(f"{name}_action{suffix}", kind, properties))
        trigger = self.node(f"{name}_trigger", "Trigger")
        self.put(node, "has_when", trigger)
        for k, group in enumerate(groups, start=1):
            label = f"{name}_condition_{k}"
            if len(group) == 1:
                self.put(trigger, "has_condition", self.thing(label, *group[0]))
                continue
            all_ = self.node(label, "ConditionGroup")
            self.put(trigger, "has_condition", all_)
            for j, (kind, properties) in enumerate(group, start=1):
                self.put(all_, "has_condition", self.thing(f"{label}_{j}", kind, properties))

    def individuals(self) -> Individuals:
        """Return them all."""
        return Individuals(self.quads)


PLACE = {"has_position": "place", "has_master_position": "master_place"}


def on_lane(lane: str, distance: float, offset: float | None = None) -> Thing:
    """A position on a lane."""
    aside = {} if offset is None else {"has_lateral_offset": offset}
    return "LanePosition", {"on_lane": f"<{lane}>", "has_distance": distance} | aside


ACTIONS: tuple[Thing, ...] = (
    ("SpeedAction", {"has_target_speed": 3.0}),
    ("SpeedAction", {"has_target_speed": 3.5, "has_rate": 2.0}),
    ("SpeedAction", {"has_target_speed": 3.5, "has_rate": 2.0, "has_max_jerk": 5.0}),
    ("SpeedAction", {"has_target_speed": 0.1, "has_transition_time": 2.0,
                     "has_dynamics_shape": "cubic"}),
    ("LaneChangeAction", {"has_lane_count": -1, "has_transition_distance": 30.0,
                          "has_dynamics_shape": "sinusoidal", "has_target_offset": 0.25}),
    ("LaneOffsetAction", {"has_target_offset": -0.5}),
    ("LaneOffsetAction", {"has_target_offset": 0.75, "has_max_lateral_acceleration": 2.0,
                          "has_dynamics_shape": "step"}),
    ("TeleportAction", {"has_position": on_lane("leg_A_in_1", 12.5, 0.3)}),
    ("TeleportAction", {"has_position": ("WorldPosition", {
        "has_world_x": 1.0, "has_world_y": -2.0, "has_world_z": 0.5, "has_world_yaw": 30.0,
        "has_world_pitch": -1.0, "has_world_roll": 0.1})}),
    ("LongitudinalDistanceAction", {"has_entity_ref": "<ego>", "has_kept_distance": 12.5}),
    ("LongitudinalDistanceAction", {"has_entity_ref": "<ego>", "has_kept_time": 1.8,
                                    "has_max_acceleration": 2.0, "has_max_deceleration": 3.5,
                                    "has_max_speed": 20.0}),
    ("TeleportAction", {"has_position": ("LanePosition", {
        "on_lane": "<leg_A_in_1>", "has_distance": 12.5, "has_relative_heading": 90.0})}),
    ("LightStateAction", {"has_light_type": "indicatorLeft", "has_light_mode": "flashing"}),
    ("LightStateAction", {"has_light_type": "brakeLights", "has_light_mode": "off"}),
    ("SynchronizeAction", {"has_entity_ref": "<ego>",
                           "has_position": on_lane("leg_C_out_1", 5.0),
                           "has_master_position": on_lane("leg_B_in_1", 1.0)}),
)  # fmt: skip
"""Of a participant; those with individuals of their own further below are made apart."""

PRESENCE: tuple[Thing, ...] = (
    ("AddEntityAction", {"has_entity_ref": "<bv>", "has_position": on_lane("leg_B_in_1", 9.0)}),
    ("DeleteEntityAction", {"has_entity_ref": "<bv>"}),
)

CONDITIONS: tuple[Thing, ...] = (
    ("SimulationTimeCondition", {"has_value": 2.0}),
    ("SimulationTimeCondition", {"has_value": 2.0, "has_rule": "lessThan"}),
    ("RelativeDistanceCondition", {"has_value": 20.0, "has_entity_ref": "<ego>"}),
    ("RelativeDistanceCondition", {"has_value": 20.0, "has_entity_ref": "<bv>",
                                   "has_subject": "<ego>", "has_rule": "greaterThan"}),
    ("RelativeDistanceCondition", {"has_value": 5.0, "has_entity_ref": "<ego>",
                                   "has_distance_measure": "gap"}),
    ("TimeToCollisionCondition", {"has_value": 2.5, "has_entity_ref": "<ego>"}),
    ("TimeHeadwayCondition", {"has_value": 1.5, "has_entity_ref": "<ego>",
                              "has_rule": "greaterOrEqual"}),
    ("SpeedCondition", {"has_value": 7.0}),
    ("SpeedCondition", {"has_value": 7.0, "has_rule": "notEqualTo", "has_subject": "<ego>"}),
    ("TraveledDistanceCondition", {"has_value": 15.0}),
    ("StandStillCondition", {"has_value": 3.0}),
    ("ReachPositionCondition", {"has_value": 1.0, "has_position": on_lane("leg_C_out_1", 8.0)}),
    ("CollisionCondition", {"has_entity_ref": "<ego>"}),
    ("StoryboardElementStateCondition", {"has_value": 0.5, "has_event_ref": "<bv_sets_off>"}),
    ("StoryboardElementStateCondition", {"has_value": 0.5, "has_event_ref": "<bv_sets_off>",
                                         "has_event_state": "began"}),
)  # fmt: skip
"""Of an event of ``bv``."""
