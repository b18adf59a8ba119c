"""Constraints between the layers that every scenario keeps, whatever its file says.

Each becomes a bound like one from a file, so the decoder keeps it and SHACL checks it.
"""

import math
from collections.abc import Iterable, Iterator, Mapping

from bridgegen.base import elementary
from bridgegen.base.physics import DRY_FRICTION, GRAVITY, MOST_LATERAL
from bridgegen.scenario.language.expression import parse
from bridgegen.scenario.language.parameters import Bound, Parameter
from bridgegen.scenario.language.roads import Quantity, RoadsSpec
from bridgegen.scenario.language.story import KeepDistance, Participant, SpeedChange, Story

GRIP_FORMULA = f"{DRY_FRICTION}*{GRAVITY}"
"""Greatest lateral acceleration of a tyre on a dry road [m/s²], as a part of a formula."""

STRAIGHT = 45.0
"""Turn angle below which a route goes straight on [deg]."""

_SPEED_WHY = "Nobody drives faster than the road allows, less in rain, in fog and by night."
_SPEED_SOURCE = (
    "Paper, Section III-B (road and weather constrain participants); speed_limit of the road, "
    "speed_factor of the weather."
)
_BEND_WHY = "A vehicle drives through a bend no faster than drivers do, and than the tyres hold."
_BEND_SOURCE = (
    "Paper, Section III-B (the road constrains participants' speed and path); v² <= μ·g·R with "
    f"{DRY_FRICTION} on a dry road, Wong, Theory of Ground Vehicles, table 1.3; at most "
    f"{MOST_LATERAL} m/s² without a reason (exceeds_limit), Mitschke and Wallentowitz, Dynamik der "
    "Kraftfahrzeuge."
)
_CLOSED_WHY = "The road that the scenario takes place on is closed in such weather."
_CLOSED_SOURCE = "Paper, Section III-B (heavy fog or rain restricts roads); the road's own limit."


def bounds_between_layers(
    roads: RoadsSpec,
    story: Story,
    parameters: Mapping[str, Parameter],
    prefixes: Iterable[str],
    place: str,
) -> Iterator[Bound]:
    """Yield what the road and the weather demand of a scenario's parameters.

    Args:
        roads: the road network.
        story: who does what on it.
        parameters: what may be limited.
        prefixes: of the weathers that come later.
        place: the scenario's file.
    """
    weathers = ("", *prefixes)
    yield from speed_bounds(roads.knobs["speed_limit"], story, parameters, prefixes, place)
    for participant in story.participants:
        if participant.conduct != "vehicle" or "ego" in (participant.name, participant.driver):
            continue  # the ego's driver is under test: what it dares is its own affair
        radii = [bend(roads, at) for at in participant.at_each_place]
        for radius in dict.fromkeys(item for item in radii if item is not None):
            yield from bend_bounds(radius, participant, story, parameters, prefixes, place)
    for name, limit in roads.closes.items():
        for prefix in weathers:
            if f"{prefix}{name}" in parameters:
                hi = parse(_text(limit))
                yield Bound(f"{prefix}{name}", None, hi, _CLOSED_WHY, _CLOSED_SOURCE, place)


def speed_bounds(
    limit: Quantity,
    story: Story,
    parameters: Mapping[str, Parameter],
    prefixes: Iterable[str],
    place: str,
) -> Iterator[Bound]:
    """Yield what a road's speed limit [m/s] demands; the rest as in `bounds_between_layers`."""
    hi = parse(cap(limit, ("", *prefixes)))
    for name in sorted(_speeds(story) & parameters.keys()):
        yield Bound(name, None, hi, _SPEED_WHY, _SPEED_SOURCE, place)


def bend_bounds(
    radius: str,
    participant: Participant,
    story: Story,
    parameters: Mapping[str, Parameter],
    prefixes: Iterable[str],
    place: str,
) -> Iterator[Bound]:
    """Yield what the tightest bend on a participant's way demands, by the formula of its radius."""
    friction = _least([f"{prefix}friction" for prefix in ("", *prefixes)])
    most = f"{GRIP_FORMULA} * {friction}"
    if not participant.exceeds_limit:
        most = f"min({most}, {MOST_LATERAL})"
    hi = parse(f"sqrt({most} * ({radius}))")
    for name in sorted(_speeds_of(participant, story) & parameters.keys()):
        yield Bound(name, None, hi, _BEND_WHY, _BEND_SOURCE, place)


def cap(limit: Quantity, weathers: Iterable[str] = ("",)) -> str:
    """Return the formula of the highest speed [m/s] that speed limit and weather allow."""
    factor = _least([f"{prefix}speed_factor" for prefix in weathers])
    return f"{_text(limit)} * {factor}"


def bend(roads: RoadsSpec, participant: Participant) -> str | None:
    """Return the formula of the tightest radius [m] on a participant's way; None if straight."""
    if roads.template == "road":
        bends = [q for part in roads.segments for q in (part.curvature, part.end_curvature)]
        sharp = [f"abs({_text(q)})" for q in bends if q != 0.0]
        if not sharp:
            return None
        tightest = sharp[0] if len(sharp) == 1 else f"max({', '.join(sharp)})"
        return f"1 / max({tightest}, 1e-6)"
    if roads.template == "roundabout":
        return None if participant.end is None else _text(roads.knobs["radius"])
    if (
        participant.end is None
        or participant.start.leg not in roads.legs
        or participant.end.leg not in roads.legs
    ):
        return None
    inward = roads.legs[participant.start.leg].heading + 180.0
    turn = math.remainder(roads.legs[participant.end.leg].heading - inward, 360.0)
    if abs(turn) < STRAIGHT:
        return None
    # Lane centres lie half a width beside the leg's axis: outside in a left turn, inside in a
    # right one. Legs at the angle φ have their tangent points half the junction from its centre.
    half = 0.5 / elementary.tan(math.radians(abs(turn)) / 2.0)
    size, width = _text(roads.knobs["intersection_size"]), _text(roads.knobs["lane_width"])
    lane = participant.start.lane if isinstance(participant.start.lane, int) else 1
    sign = "+" if turn > 0.0 else "-"
    return f"max({half:.10g}*{size} {sign} {lane - 0.5:g}*{width}, 2)"


def _speeds(story: Story) -> set[str]:
    """Return the parameters that are speeds of motor vehicles."""
    vehicles = [
        participant
        for participant in story.participants
        if participant.conduct == "vehicle" and not participant.exceeds_limit
    ]
    return set().union(*(_speeds_of(vehicle, story) for vehicle in vehicles))


def _speeds_of(participant: Participant, story: Story) -> set[str]:
    return {value for value in speeds_of(participant, story) if isinstance(value, str)}


def speeds_of(participant: Participant, story: Story) -> list[Quantity]:
    """Return every speed [m/s] that a participant is told to have."""
    actions = [
        action
        for event in story.events
        if event.participant == participant.name
        for action in event.actions
    ]
    later = [action.speed for action in actions if isinstance(action, SpeedChange)]
    kept = [
        action.max_speed
        for action in actions
        if isinstance(action, KeepDistance) and action.max_speed is not None
    ]
    return [participant.speed, *later, *kept]


def _least(names: list[str]) -> str:
    return names[0] if len(names) == 1 else f"min({', '.join(names)})"


def _text(value: Quantity) -> str:
    return value if isinstance(value, str) else repr(value)
