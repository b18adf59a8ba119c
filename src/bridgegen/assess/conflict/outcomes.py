"""Outcomes of a rollout, as individuals of the scenario (layer 4 causes layer 3)."""

from collections.abc import Mapping

import pyoxigraph as ox

from bridgegen.assess.conflict.analysis import CONTACT, NEAR_MISS, Conflicts, analyse
from bridgegen.assess.conflict.summary import ConflictSummary, of_pair
from bridgegen.assess.conflict.types import Responsible
from bridgegen.openx.opendrive.model import OpenDrive
from bridgegen.scenario.ontology.graph import Individuals
from bridgegen.scenario.ontology.vocabulary import NAMED_INDIVIDUAL, TYPE, Subject, bg
from bridgegen.simulation.accidents import Accident, accidents
from bridgegen.simulation.queues import queues
from bridgegen.simulation.rollout import Rollout


def with_outcomes(
    individuals: Individuals, rollout: Rollout, model: OpenDrive, row: int = 0
) -> Individuals:
    """Return a scenario's individuals with the outcomes of a rollout.

    A collision becomes a ``TrafficAccident``, a near miss of the ego a ``NearMiss``, a queue a
    ``TrafficJam``; the scenario refers to them by ``has_outcome``, and the converters ignore them.
    Near misses and the ego's first collision have the type, the responsible participant and the
    rule of the conflict analysis. A queue that the scenario itself declares is no outcome, unless
    other participants have joined it. Earlier outcomes among the individuals are those of another
    rollout, and are removed.

    Args:
        individuals: of the scenario.
        rollout: N scenarios; a failed one has no outcomes.
        model: the road network.
        row: which of them is this one.
    """
    scenario = individuals.one("Scenario")
    individuals = _without_outcomes(individuals, scenario)
    if rollout.status[row] != 0:
        return individuals
    participants = {
        individuals.text(node, "has_name"): node
        for node in individuals.links(scenario, "has_participant")
    }
    writer = _Writer(individuals, scenario)
    # What is no participant is part of the road.
    standing = [name for name in rollout.names if name not in participants]
    conflicts = analyse(rollout)
    for accident in accidents(rollout, row, standing):
        node = writer.node("accident", "TrafficAccident")
        for name, number in (
            ("has_time", accident.time),
            ("has_world_x", accident.x),
            ("has_world_y", accident.y),
        ):
            writer.put(node, name, ox.Literal(float(number)))
        for name in accident.who:
            if name in participants:
                writer.put(node, "has_who", participants[name])
        found = _conflict_of(conflicts, row, accident)
        if found is not None:
            _put_conflict(writer, node, found, rollout.names[0], participants)
            writer.put(node, "has_severity", ox.Literal(found.severity))
            writer.put(node, "has_delta_v", ox.Literal(found.delta_v_ego))
    for other in (conflicts.kind[row] == NEAR_MISS).nonzero()[0].tolist():
        found = of_pair(conflicts, row, other)
        node = writer.node("near_miss", "NearMiss")
        writer.put(node, "has_time", ox.Literal(found.time))
        writer.put(node, "has_time_to_collision", ox.Literal(found.ttc))
        for name in (rollout.names[0], found.partner):
            if name in participants:
                writer.put(node, "has_who", participants[name])
        _put_conflict(writer, node, found, rollout.names[0], participants)
    vehicles = [name for name, node in participants.items() if individuals.is_a(node, "Vehicle")]
    lanes = _lanes(individuals)
    declared = [
        set(individuals.links(event, "has_who"))
        for event in individuals.links(scenario, "has_event")
        if individuals.is_a(event, "TrafficJam")
    ]
    for queue in queues(rollout, row, vehicles, model, set(lanes)):
        who = {participants[name] for name in queue.who}
        # The scenario's own queue, unless somebody has joined it.
        if any(who <= group for group in declared):
            continue
        node = writer.node("queue", "TrafficJam")
        writer.put(node, "has_time", ox.Literal(float(queue.time)))
        writer.put(node, "has_length", ox.Literal(float(queue.length)))
        writer.put(node, "on_lane", lanes[queue.road_id, queue.lane_id])
        for name in queue.who:
            writer.put(node, "has_who", participants[name])
    return Individuals([*individuals.quads, *writer.quads])


def _without_outcomes(individuals: Individuals, scenario: Subject) -> Individuals:
    """Return a scenario's individuals without its outcomes; the same if it has none."""
    nodes = set(individuals.links(scenario, "has_outcome"))
    if not nodes:
        return individuals
    return Individuals(
        quad for quad in individuals.quads if quad.subject not in nodes and quad.object not in nodes
    )


def _conflict_of(conflicts: Conflicts, row: int, accident: Accident) -> ConflictSummary | None:
    """Return the conflict of an accident's contact; None if it was not analysed."""
    ego, *_ = conflicts.names
    if ego not in accident.who:
        return None
    other = conflicts.names.index(next(name for name in accident.who if name != ego))
    step = round(accident.time / conflicts.time_step)
    # The analysis has one conflict for each pair, so a later contact of the same two is not it.
    if conflicts.kind[row, other] != CONTACT or conflicts.instant[row, other] != step:
        return None
    return of_pair(conflicts, row, other)


def _put_conflict(
    writer: "_Writer",
    node: Subject,
    found: ConflictSummary,
    ego: str,
    participants: Mapping[str, Subject],
) -> None:
    """State type, responsibility and rule of an accident or a near miss."""
    writer.put(node, "has_conflict_type", ox.Literal(found.type))
    writer.put(node, "has_responsibility", ox.Literal(found.responsible))
    writer.put(node, "has_responsibility_rule", ox.Literal(found.rule))
    names = {
        Responsible.EGO.label: [ego],
        Responsible.OTHER.label: [found.partner],
        Responsible.SHARED.label: [ego, found.partner],
    }.get(found.responsible, [])
    for name in names:
        if name in participants:
            writer.put(node, "has_responsible", participants[name])


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
        """Add an outcome of a class, named ``outcome_name_1`` or with the next free number."""
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
