"""What a rollout brought about, as individuals of the scenario (layer 4 brings about layer 3)."""

import pyoxigraph as ox

from bridgegen.ontology.graph import Individuals
from bridgegen.ontology.vocabulary import NAMED_INDIVIDUAL, TYPE, Subject, bg
from bridgegen.openx.opendrive.model import OpenDrive
from bridgegen.simulation.accidents import accidents
from bridgegen.simulation.queues import queues
from bridgegen.simulation.rollout import Rollout


def with_outcomes(
    individuals: Individuals, rollout: Rollout, model: OpenDrive, row: int = 0
) -> Individuals:
    """Return a scenario's individuals with what a rollout of it brought about.

    A collision makes a ``TrafficAccident``, a queue a ``TrafficJam``; the scenario has them by
    ``has_outcome``, and the converters leave them aside. A queue that the scenario itself declares
    is none that behaviour brought about, unless others have joined it.

    Args:
        individuals: of the scenario.
        rollout: N scenarios; a failed one brings about nothing.
        model: the road network.
        row: which of them is this one.
    """
    if rollout.status[row] != 0:
        return individuals
    scenario = individuals.one("Scenario")
    participants = {
        individuals.text(node, "has_name"): node
        for node in individuals.links(scenario, "has_participant")
    }
    writer = _Writer(individuals, scenario)
    standing = [name for name in rollout.names if name not in participants]
    for accident in accidents(rollout, row, standing):
        node = writer.node("accident", "TrafficAccident")
        for name, number in (
            ("has_time", accident.time), ("has_world_x", accident.x), ("has_world_y", accident.y)
        ):  # fmt: skip
            writer.put(node, name, ox.Literal(float(number)))
        for name in accident.who:
            if name in participants:
                writer.put(node, "has_who", participants[name])
    vehicles = [name for name, node in participants.items() if individuals.is_a(node, "Vehicle")]
    lanes = _lanes(individuals)
    declared = [
        set(individuals.links(event, "has_who"))
        for event in individuals.links(scenario, "has_event")
        if individuals.is_a(event, "TrafficJam")
    ]
    for queue in queues(rollout, row, vehicles, model, set(lanes)):
        who = {participants[name] for name in queue.who}
        if any(who <= one for one in declared):
            continue
        node = writer.node("queue", "TrafficJam")
        writer.put(node, "has_time", ox.Literal(float(queue.time)))
        writer.put(node, "has_length", ox.Literal(float(queue.length)))
        writer.put(node, "on_lane", lanes[queue.road_id, queue.lane_id])
        for name in queue.who:
            writer.put(node, "has_who", participants[name])
    return Individuals([*individuals.quads, *writer.quads])


def _lanes(individuals: Individuals) -> dict[tuple[str, int], Subject]:
    """Return the lanes of a scenario's roads, by road id and lane id."""
    return {
        (individuals.text(road, "has_road_id"), individuals.integer(lane, "has_lane_id")): lane
        for road in individuals.of_class("Road")
        for lane in individuals.links(road, "has_lane")
    }


class _Writer:
    """Collects the statements about outcomes."""

    def __init__(self, individuals: Individuals, scenario: Subject) -> None:
        self.individuals, self.scenario = individuals, scenario
        self.base = scenario.value.rpartition("#")[0] + "#"
        self.quads: list[ox.Quad] = []
        self.count: dict[str, int] = {}

    def node(self, name: str, cls: str) -> ox.NamedNode:
        """Add an outcome of a class, called ``outcome_name_1`` or as is still free."""
        while True:
            self.count[name] = number = self.count.get(name, 0) + 1
            node = ox.NamedNode(f"{self.base}outcome_{name}_{number}")
            if self.individuals.find(node.value) is None:
                break
        self.put(self.scenario, "has_outcome", node)
        self.quads.append(ox.Quad(node, TYPE, NAMED_INDIVIDUAL))
        self.quads.append(ox.Quad(node, TYPE, bg(cls)))
        self.put(node, "has_name", ox.Literal(f"{name}_{number}"))
        return node

    def put(self, node: Subject, name: str, value: Subject | ox.Literal) -> None:
        self.quads.append(ox.Quad(node, bg(name), value))
