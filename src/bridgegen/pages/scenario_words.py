"""What happens in a logical scenario, in sentences."""

from collections.abc import Iterator

from bridgegen.scenario.language.scenario import LogicalScenario
from bridgegen.scenario.language.story import (
    CONDITIONS,
    ConditionSpec,
    EventSpec,
    Jam,
    Participant,
    RoadWorks,
    Waypoint,
    beside,
    in_words,
)
from bridgegen.scenario.named_models import type_of


def story_lines(scenario: LogicalScenario) -> Iterator[str]:
    """Yield the participants, then the events."""
    jammed = {name for jam in scenario.story.jams for name in jam.participants}
    for one in scenario.participants:
        if one.name not in jammed:
            yield _participant(one, scenario)
    yield from (_jam(jam, scenario) for jam in scenario.story.jams)
    yield from (_works(works) for works in scenario.story.works)
    yield from (_event(event) for event in scenario.events)


def _participant(one: Participant, scenario: LogicalScenario) -> str:
    who, speed = f"{one.name}, {_kind(one)}", in_words(one.speed, "m/s")
    extra = ", with blue light and siren on" if one.siren else ""
    if one.exceeds_limit:
        extra += f", faster than allowed if need be ({one.exceeds_limit})"
    if one.path:
        start, *between, end = map(_place, one.path)
        past, how = ("past", ", a smooth curve,") if one.conduct == "vehicle" else ("via", "")
        way = "".join(f"; {past} {place}" for place in between) + (";" if between else "")
        path = f"its path{how} leads from {start}{way} to {end}"
        return f"{who}, starts at {speed}{extra}; {path}."
    if one.ways:
        names = scenario.parameters[one.place_by].kind.names
        at = [f"from {_place(start)}{f' to {_place(end)}' if end else ''} ({name})"
              for name, (start, end) in zip(names, one.ways, strict=True)]  # fmt: skip
        return (
            f"{who}, starts at {speed}{extra}; {one.place_by} chooses its place: {'; '.join(at)}."
        )
    turned = ""
    if one.heading in (180.0, -180.0):
        turned = ", against the traffic"
    elif one.heading != 0.0:
        turned = f", turned by {in_words(one.heading, 'deg')}"
    if one.conduct == "obstacle" or (one.speed == 0.0 and one.end is None):
        return f"{who}, stands at {_place(one.start)}{turned}{extra}."
    goes = "" if one.end is None else f" and goes to {_place(one.end)}"
    return f"{who}, starts at {_place(one.start)} at {speed}{turned}{extra}{goes}."


def _kind(one: Participant) -> str:
    """Return what it is, with its article: all that it may be."""
    return " or ".join(map(_noun, one.types or (one.model or one.type,)))


def _noun(name: str) -> str:
    """Return a type's noun with its article, or a model's with its name."""
    kind = type_of(name)
    noun = "emergency vehicle" if kind == "emergency" else kind
    model = "" if kind == name else f" (model {name})"
    return f"{'an' if noun[0] in 'aeiou' else 'a'} {noun}{model}"


def _jam(jam: Jam, scenario: LogicalScenario) -> str:
    kinds = ", ".join(scenario.participant(name).type for name in jam.participants)
    return f"{jam.name}, a queue from its tail at {_place(jam.tail)}: {kinds}."


def _works(works: RoadWorks) -> str:
    return (
        f"{works.name}: {len(works.cones)} cones close {works.length:g} m from "
        f"{_place(works.start)} on, announced by a sign."
    )


def _event(event: EventSpec) -> str:
    what = " and ".join(map(str, event.actions))
    when = ", or ".join(
        " and ".join(_condition(one, event) for one in alternative) for alternative in event.when
    )
    return f"{event.name}: {event.participant or 'the weather'} {what} when {when}."


def _condition(one: ConditionSpec, event: EventSpec) -> str:
    kind = CONDITIONS[one.kind]
    whose = one.of or event.participant
    subject = f"the {kind.meaning}" if one.kind == "time" else f"{kind.meaning} of {whose}"
    if one.kind == "after":
        subject = f"the time since {one.event} ended"
    if one.kind == "began":
        subject = f"the time since {one.event} began"
    if one.kind == "contact":
        return f"{whose} has touched {one.to}"
    if one.to is not None:
        subject = f"the {one.kind} ({kind.meaning}) from {whose} to {one.to}"
    return f"{subject} is {kind.rule} {in_words(one.value, kind.unit)}"


def _place(at: Waypoint) -> str:
    lane = f"lane {at.lane}" if isinstance(at.lane, int) else f"the {at.lane}"
    where = f" of leg {at.leg} {at.way}"
    if at.leg == "main":
        where = "" if at.way == "out" else " of the oncoming side"
    aside = "" if at.offset == 0.0 else f", {beside(at.offset)} of its centre"
    return f"{in_words(at.distance, 'm')} on {lane}{where}{aside}"
