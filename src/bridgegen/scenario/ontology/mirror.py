"""Individuals of left-hand traffic: in files as they are, in memory mirrored to the other side.

What is simulated drives on the right, see `bridgegen.openx.opendrive.mirror`. A road network with
``has_driving_side`` left is the mirror image of what its file says.
"""

from collections.abc import Iterator

import pyoxigraph as ox

from bridgegen.scenario.ontology.graph import Individuals, as_number
from bridgegen.scenario.ontology.vocabulary import bg

NEGATED = tuple(
    map(
        bg,
        (
            "has_heading", "has_lane_id", "has_t", "has_world_y", "has_world_yaw", "has_world_roll",
            "has_start_curvature", "has_end_curvature", "has_lateral_offset",
            "has_relative_heading", "has_lane_count", "has_target_offset",
            "has_ghost_aside",
        ),
    )
)  # fmt: skip
"""Properties whose numbers change their sign."""

_WORDS = {
    bg("allows_turn"): {"left": "right", "right": "left"},
    bg("has_light_type"): {
        "indicatorLeft": "indicatorRight",
        "indicatorRight": "indicatorLeft",
    },
}
_LIMITS = {bg("has_low"): bg("has_high"), bg("has_high"): bg("has_low")}


def is_left_hand(individuals: Individuals) -> bool:
    """Return whether traffic drives on the left."""
    return any(
        individuals.optional_text(network, "has_driving_side") == "left"
        for network in individuals.of_class("RoadNetwork")
    )


def mirrored(individuals: Individuals) -> Individuals:
    """Return individuals with left for right if traffic drives on the left, else as they are.

    A parameter that only gives what changes its sign has the mirrored range. The azimuth of the
    sun, formulas and elements in OpenSCENARIO's words stay as they are.
    """
    if not is_left_hand(individuals):
        return individuals
    names = {term.value.rpartition("#")[2] for term in NEGATED}
    sideways: set[object] = {
        node
        for node in individuals.of_class("Parameter")
        if names.issuperset(individuals.texts(node, "binds_property"))
    }
    return Individuals(_mirrored(individuals, sideways))


def _mirrored(individuals: Individuals, sideways: set[object]) -> Iterator[ox.Quad]:
    for quad in individuals.quads:
        subject, term, value = quad.subject, quad.predicate, quad.object
        if not isinstance(value, ox.Literal):
            yield quad
        elif term in _WORDS:
            word = _WORDS[term].get(value.value, value.value)
            yield ox.Quad(subject, term, ox.Literal(word))
        elif term in NEGATED:
            yield ox.Quad(subject, term, _negative(value))
        elif term in _LIMITS and subject in sideways:
            yield ox.Quad(subject, _LIMITS[term], _negative(value))
        else:
            yield quad


def _negative(value: ox.Literal) -> ox.Literal:
    number = as_number(value)
    if not number:  # a zero keeps its sign, so that the mirror of the mirror is the same
        return value
    return ox.Literal(-int(value.value) if "integer" in value.datatype.value else -number)
