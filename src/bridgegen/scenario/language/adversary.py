"""Other participants that decide: drivers that look ahead, and one that an adversary drives."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from math import ceil

from bridgegen.base.errors import InputError, UnknownNameError
from bridgegen.base.physics import GRIP
from bridgegen.scenario.language.parameters import Axis, Parameter
from bridgegen.scenario.language.roads import Quantity
from bridgegen.scenario.language.rules import speeds_of
from bridgegen.scenario.language.scenario import LogicalScenario, SearchedScenario
from bridgegen.scenario.language.story import Adversary, EventSpec, Participant, SpeedChange, Story
from bridgegen.scenario.participants import PARTICIPANTS

# --- A participant that an adversary drives: what it decides is searched like any other parameter -
# Its events are taken from the scenario; instead, it changes its speed and moves within its lane as
# parameters of the extension axis say, one of each per decision. Whatever they are, they keep to
# the # scenario's limits: the speeds that the scenario gives the participant (which road and
# weather # bound), the rate at which it takes them up, what its body and the road's friction let it
# brake, # and # its lane.


PERIOD = 0.5
"""Time between two decisions [s]: less than an alert driver's reaction, more than a
controller's."""

MARGIN = 0.1
"""Distance that its body keeps to the edges of its lane [m]: it overshoots by a centimetre at
times."""


def first_speed(adversary: Adversary, values: Mapping[str, float]) -> float:
    """Return the participant's speed at the start [m/s]."""
    return _value(adversary.speeds[0], values)


def top_speed(adversary: Adversary, values: Mapping[str, float]) -> float:
    """Return the participant's highest speed [m/s]."""
    return max(_value(speed, values) for speed in adversary.speeds)


def limits(adversary: Adversary, values: Mapping[str, float]) -> tuple[float, float]:
    """Return by how much the participant accelerates and brakes at most [m/s²]."""
    grip = GRIP * values.get("friction", 1.0)
    rate = min(_value(adversary.rate, values), adversary.acceleration, grip)
    return rate, min(adversary.braking, grip)


def room(adversary: Adversary, values: Mapping[str, float]) -> float:
    """Return how far the participant may be aside of its lane's centre [m]."""
    return max(0.0, 0.5 * (_value(adversary.lane_width, values) - adversary.width) - MARGIN)


def adversarial(scenario: SearchedScenario, participant: str | None = None) -> LogicalScenario:
    """Return a scenario in which an adversary drives one of the participants.

    Args:
        scenario: of five layers.
        participant: a vehicle or bicycle that keeps to lanes, not to rails, and not the ego; the
            first that the scenario lets move by default.

    Raises:
        UnknownNameError: no such participant.
        InputError: a scenario file; or a participant that is no such vehicle, or whose events
            others wait for.
    """
    if not isinstance(scenario, LogicalScenario):
        raise InputError(
            f"{scenario.name}: an adversary drives participants of a scenario of five layers (a "
            "YAML file), and this is an OpenSCENARIO file"
        )
    able = [item.name for item in scenario.participants if _can_be_driven(item, scenario.story)]
    if participant is None:
        if not able:
            raise InputError(
                f"{scenario.place}: an adversary needs a vehicle other than the ego that keeps to "
                "lanes and may move"
            )
        participant = able[0]
    names = [item.name for item in scenario.participants]
    if participant not in names:
        raise UnknownNameError("participant", participant, names)
    if participant not in able:
        raise InputError(
            f"{scenario.place}: an adversary drives a vehicle other than the ego that keeps to "
            f"lanes and may move, got '{participant}'; it can drive: {', '.join(able) or 'none'}"
        )
    driven = scenario.participant(participant)
    own = [event for event in scenario.events if event.participant == participant]
    rest = tuple(event for event in scenario.events if event.participant != participant)
    # An event that waits for one which the adversary takes away would never begin, and nobody would
    # see why.
    _refuse_awaited(scenario, own, rest)
    adversary = _adversary(scenario, driven, own)
    # The adversary is its driver.
    story = replace(
        scenario.story,
        participants=tuple(
            replace(item, driver="scripted") if item is driven else item
            for item in scenario.participants
        ),
        events=rest,
    )
    left = replace(scenario, story=story)
    own_limits = (*adversary.speeds, adversary.lane_width, adversary.rate)
    needed = {quantity for quantity in own_limits if isinstance(quantity, str)}
    # Parameters that only the events of its script read would be searched without any effect.
    idle = _quantities(own) - _quantities(rest) - needed - _elsewhere(left)
    kept = {name: parameter for name, parameter in left.parameters.items() if name not in idle}
    return replace(
        left,
        parameters=kept | {control.name: control for control in _controls(adversary)},
        bounds=tuple(bound for bound in left.bounds if bound.target not in idle),
        axes=tuple(axis for axis in Axis if axis in {*left.axes, Axis.EXTENSION}),
        adversary=adversary,
    )


def _can_be_driven(participant: Participant, story: Story) -> bool:
    on_lanes = (
        participant.conduct in ("vehicle", "bicycle")
        and not participant.path
        and not participant.ways
    )
    on_lanes = on_lanes and not PARTICIPANTS[participant.type].on_rails
    return (
        on_lanes
        and participant.name != "ego"
        and any(speed != 0.0 for speed in speeds_of(participant, story))
    )


def _adversary(
    scenario: LogicalScenario, driven: Participant, own: Iterable[EventSpec]
) -> Adversary:
    body = driven.body
    changes = [a.change for event in own for a in event.actions if isinstance(a, SpeedChange)]
    rates = [change.rate for change in changes if change.rate is not None]
    numbers = [f"{k:02d}" for k in range(1, ceil(scenario.duration / PERIOD) + 1)]
    return Adversary(
        participant=driven.name,
        speeds=tuple(speeds_of(driven, scenario.story)),
        lane_width=scenario.roads.knobs["lane_width"],
        width=body.width,
        rate=rates[0] if rates else body.max_acceleration,
        acceleration=body.max_acceleration,
        braking=body.max_deceleration,
        paces=tuple(f"{driven.name}_pace_{number}" for number in numbers),
        offsets=tuple(f"{driven.name}_offset_{number}" for number in numbers),
    )


def _controls(adversary: Adversary) -> Iterable[Parameter]:
    name = adversary.participant
    for k, (pace, offset) in enumerate(zip(adversary.paces, adversary.offsets, strict=True)):
        when = f"from {k * PERIOD:g} s to {(k + 1) * PERIOD:g} s"
        yield Parameter(
            pace,
            Axis.EXTENSION,
            "1",
            0.0,
            1.0,
            1.0,
            description=f"Speed that the adversary has {name} make for {when}; 1: its highest.",
            source="The speeds that the scenario gives it.",
        )
        yield Parameter(
            offset,
            Axis.EXTENSION,
            "1",
            -1.0,
            1.0,
            0.0,
            description=f"Where in its lane the adversary steers {name} {when}; 1: leftmost.",
            source="The lane's width, less its body's.",
        )


def _refuse_awaited(
    scenario: LogicalScenario, own: Iterable[EventSpec], rest: Iterable[EventSpec]
) -> None:
    names = {event.name for event in own}
    problems = [
        f"{scenario.place}: event '{event.name}' waits for '{condition.event}', which an adversary "
        f"that drives '{next(iter(own)).participant}' takes away"
        for event in rest
        for group in event.when
        for condition in group
        if condition.event in names
    ]
    if problems:
        raise InputError(*problems)


def _quantities(events: Iterable[EventSpec]) -> set[str]:
    """Return the parameters that events read."""
    found: set[Quantity | None] = set()
    for event in events:
        found |= {condition.value for group in event.when for condition in group}
        for action in event.actions:
            found |= {getattr(action, "speed", None)}
            if (change := getattr(action, "change", None)) is not None:
                found |= {change.rate, change.time, change.distance}
    return {name for name in found if isinstance(name, str)}


def _elsewhere(scenario: LogicalScenario) -> set[str]:
    """Return the parameters that anything but events reads."""
    found: set[Quantity] = set(scenario.roads.knobs.values())
    for participant in scenario.participants:
        found.add(participant.speed)
        for point in (participant.start, participant.end, *participant.path):
            if point is not None:
                found |= {point.distance, point.offset}
    names = {name for name in found if isinstance(name, str)}
    return names.union(
        *(bound.names for bound in scenario.bounds),
        *(derived.names for derived in scenario.derived),
    )


def _value(quantity: Quantity, values: Mapping[str, float]) -> float:
    return float(values[quantity]) if isinstance(quantity, str) else float(quantity)


# --- Drivers of participants other than the ego: their script alone, or one that looks ahead ---


ATTENTIVE, INSISTENT, SCRIPTED = "attentive", "insistent", "scripted"

LOOKING = (ATTENTIVE, INSISTENT, "lawful")
"""Drivers that limit the script by what is in the way."""

DRIVERS = (*LOOKING, SCRIPTED)
"""Drivers that all participants other than the ego may have."""

EGO = "ego"
"""Name of the ego; of a driver: the ego's, which drives this participant, too."""
ABLE = ("vehicle", "bicycle", "pedestrian")
"""Conduct of participants that get the driver which a scenario states for all."""


def require(name: str) -> str:
    """Return the name of a driver of other participants.

    Raises:
        UnknownNameError: no such driver.
    """
    if name not in DRIVERS:
        raise UnknownNameError("driver of other participants", name, DRIVERS)
    return name


def driven(
    participants: Iterable[Participant], events: Sequence[EventSpec], others: str
) -> tuple[Participant, ...]:
    """Return participants with one driver for all that have none of their own.

    The ego, animals, objects and participants that never move stay as they are.
    """
    acting = {event.participant for event in events}
    return tuple(
        replace(participant, driver=others)
        if not participant.driver
        and participant.name != EGO
        and participant.conduct in ABLE
        and (participant.speed != 0.0 or participant.name in acting)
        else participant
        for participant in participants
    )


def with_others(scenario: LogicalScenario, others: str) -> LogicalScenario:
    """Return a scenario in which one driver drives all participants but the ego.

    Args:
        scenario: of five layers.
        others: of `DRIVERS`, instead of the scenario's. A participant that an
            adversary drives keeps it.

    Raises:
        UnknownNameError: no such driver.
    """
    require(others)
    adversary = scenario.adversary.participant if scenario.adversary else None
    story = scenario.story
    bare = [
        participant
        if participant.name in (EGO, adversary) or participant.driver == EGO
        else replace(participant, driver="")
        for participant in story.participants
    ]
    changed = driven(bare, story.events, others)
    return replace(scenario, story=replace(story, participants=changed))
