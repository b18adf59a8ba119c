"""Participants, events and objective of a scenario file: built, with the rules they must keep."""

import math
from collections.abc import Iterator, Mapping, Set

from bridgegen.odd.parameters import Axis, Derived, Parameter, nearest
from bridgegen.odd.plain_yaml import Document, Path, entries
from bridgegen.odd.scenario import (
    ConditionSpec,
    Critical,
    EventSpec,
    ObjectiveSpec,
    Participant,
    Term,
    Waypoint,
)
from bridgegen.odd.schema import (
    ConditionSection,
    EventSection,
    ObjectiveSection,
    ParticipantSection,
    WaypointSection,
    section,
)

MAX_STEPS = 100_000
EGO = "ego"


class Storyboard:
    """What a file says beyond its parameters, built as far as it has the right shape.

    Attributes:
        problems: the rules that it breaks, with their lines.
        used: the parameters that it refers to.
        participants: as ``LogicalScenario`` holds them.
        events: as ``LogicalScenario`` holds them.
        objective: as ``LogicalScenario`` holds it; ``None`` if it is not of the right shape.

    Args:
        document: the scenario file.
        parameters: what it may refer to.
        derived: what it may not refer to, for the message.
        declared: all names, also of what is declared wrongly: no reason to call it unknown.
    """

    def __init__(
        self,
        document: Document,
        parameters: Mapping[str, Parameter],
        derived: Mapping[str, Derived],
        declared: Set[str],
    ) -> None:
        self._document = document
        self._parameters, self._derived, self._declared = parameters, derived, declared
        self.problems: list[str] = []
        self.used: set[str] = set()
        self._check_time()
        self._known = [str(name) for name, _ in entries(self._document, "participants")]
        self.participants = tuple(self._participants())
        self.events = tuple(self._events())
        self.objective = self._objective()

    def _say(self, problem: str, path: Path) -> None:
        self.problems.append(f"{problem} ({self._document.at(path)})")

    def _check_time(self) -> None:
        data = self._document.data if isinstance(self._document.data, dict) else {}
        duration, step = data.get("duration"), data.get("time_step")
        if not isinstance(duration, int | float) or not isinstance(step, int | float):
            return  # the shape says so already
        for key, value in (("duration", duration), ("time_step", step)):
            if not 0.0 < value < math.inf:
                self._say(f"{key} [s] must be greater than 0 and finite, got {value}", (key,))
                return
        steps = duration / step
        if not 1 <= steps <= MAX_STEPS or abs(steps - round(steps)) > 1e-6 * steps:
            self._say(
                f"duration must be a whole number of time steps, 1 to {MAX_STEPS}, "
                f"got {duration} s / {step} s = {steps:.6g}",
                ("duration",),
            )

    def _quantity(
        self, value: str | float, unit: str, path: Path, *, positive: bool = False
    ) -> None:
        """Check a constant, or a reference to a parameter, that must be ≥ 0 or > 0 in ``unit``."""
        label = ".".join(str(part) for part in path)
        rule = f"{label} [{unit}] must be {'greater than' if positive else 'at least'} 0"
        if not isinstance(value, str):
            if not (value > 0.0 if positive else value >= 0.0) or math.isinf(value):
                self._say(f"{rule} and finite, got {value}", path)
            return
        self.used.add(value)
        if value in self._derived:
            self._say(f"{label} must be a number or a parameter, '{value}' is derived", path)
            return
        if value not in self._declared:
            hint = nearest(value, self._parameters)
            self._say(f"{label} names the unknown parameter '{value}'{hint}", path)
        if value not in self._parameters:
            return
        one = self._parameters[value]
        if one.unit != unit:
            self._say(f"{label} needs a parameter in {unit}, '{value}' is in {one.unit}", path)
        elif one.low < 0.0 or (positive and one.low == 0.0):
            self._say(f"{rule}, '{value}' goes down to {one.low:g}", path)
        if one.axis is Axis.STATIC:
            self._say(
                f"{label} must not depend on the static axis, '{value}' does: "
                "one storyboard serves every road network",
                path,
            )

    def _participants(self) -> Iterator[Participant]:
        if EGO not in self._known:
            self._say("participants must hold 'ego', the system under test", ("participants",))
        elif len(self._known) < 2:
            self._say("participants must hold somebody besides the ego", ("participants",))
        for key, data in entries(self._document, "participants"):
            name, path = str(key), ("participants", key)
            given = section(ParticipantSection, data)
            if given is None:
                continue
            if not name.isidentifier() or not name.isascii():
                self._say(f"a participant's name is a word, got '{name}'", path)
            self._quantity(given.speed, "m/s", (*path, "speed"))
            self._quantity(given.start.distance, "m", (*path, "start", "distance"))
            self._quantity(given.end.distance, "m", (*path, "end", "distance"), positive=True)
            start, end = int(given.start.point[1:]), int(given.end.point[1:])
            if start % 2 == 0:
                self._say(
                    f"a route starts where an inbound lane does: P1, P3, P5 or P7, got P{start}",
                    (*path, "start"),
                )
            if end % 2 == 1:
                self._say(
                    f"a route ends where an outbound lane does: P2, P4, P6 or P8, got P{end}",
                    (*path, "end"),
                )
            if end == start + 1:
                self._say(f"a route must not turn back: P{start} to P{end} is one leg", path)
            yield Participant(
                name, given.type, _waypoint(given.start), _waypoint(given.end), given.speed
            )

    def _events(self) -> Iterator[EventSpec]:
        for key, data in entries(self._document, "events"):
            name, path = str(key), ("events", key)
            given = section(EventSection, data)
            if given is None:
                continue
            if not name.isidentifier() or not name.isascii():
                self._say(f"an event's name is a word, got '{name}'", path)
            self._check_participant(given.participant, (*path, "participant"))
            if given.participant == EGO:
                self._say("events move the others; the ego's driver is under test", path)
            self._quantity(given.speed, "m/s", (*path, "speed"))
            self._quantity(given.rate, "m/s²", (*path, "rate"), positive=True)
            for number, condition in enumerate(given.when):
                self._check_condition(given, condition, (*path, "when", number))
            yield EventSpec(
                name,
                given.participant,
                given.speed,
                given.rate,
                tuple(ConditionSpec(one.kind, one.value, one.to) for one in given.when),
            )

    def _check_condition(self, event: EventSection, one: ConditionSection, path: Path) -> None:
        self._quantity(one.value, "s" if one.kind == "time" else "m", (*path, "value"))
        if one.kind == "time":
            if one.to is not None:
                self._say(f"a time condition has no 'to', got '{one.to}'", path)
        elif one.to is None:
            self._say("a distance condition needs 'to', the other participant", path)
        else:
            self._check_participant(one.to, (*path, "to"))
            if one.to == event.participant:
                self._say(f"a distance is to another participant, got '{one.to}' twice", path)

    def _check_participant(self, name: str, path: Path) -> None:
        if name not in self._known:
            self._say(f"unknown participant '{name}'{nearest(name, self._known)}", path)

    def _objective(self) -> ObjectiveSpec | None:
        data = self._document.data
        raw = data.get("objective") if isinstance(data, dict) else None
        given = section(ObjectiveSection, raw)
        if given is None:
            return None
        seen: set[str] = set()
        for number, term in enumerate(given.terms):
            path: Path = ("objective", "terms", number)
            if term.metric in seen:
                self._say(f"the metric '{term.metric}' occurs twice", path)
            seen.add(term.metric)
            if given.weights == "entropy" and term.weight is not None:
                self._say(f"weights by entropy leave no weight to {term.metric}", path)
            elif given.weights == "fixed" and not 0.0 < (term.weight or 0.0) < math.inf:
                self._say(
                    f"fixed weights need one greater than 0 for {term.metric}, got {term.weight}",
                    path,
                )
        limits = given.critical.model_dump()
        for key, value in limits.items():
            if not 0.0 <= value < math.inf:
                self._say(f"{key} must be at least 0 and finite, got {value}", (*_CRITICAL, key))
        terms = tuple(Term(one.metric, one.weight) for one in given.terms)
        return ObjectiveSpec(terms, given.weights, given.scale, Critical(**limits))


_CRITICAL: Path = ("objective", "critical")


def _waypoint(given: WaypointSection) -> Waypoint:
    return Waypoint(given.point, given.distance)
