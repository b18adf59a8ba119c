"""Participants and events of a logical scenario: layers 3 and 4."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Literal

from bridgegen.scenario.language.roads import LETTERS, Quantity
from bridgegen.scenario.named_models import body_of
from bridgegen.scenario.participants import PARTICIPANTS, Body, Conduct

Way = Literal["in", "out"]
STRIPS = ("sidewalk", "shoulder")
"""Strips besides driving lanes on which a waypoint may lie."""


def in_words(value: Quantity, unit: str) -> str:
    """Return a parameter's name as it is, a number with its unit."""
    return value if isinstance(value, str) else f"{value:g} {unit}".removesuffix(" 1")


def beside(offset: Quantity) -> str:
    """Return an offset [m] in words: "1.5 m right"; a parameter's is left, as it is declared."""
    if isinstance(offset, str) or offset >= 0.0:
        return f"{in_words(offset, 'm')} left"
    return f"{in_words(-offset, 'm')} right"


@dataclass(frozen=True)
class Waypoint:
    """A place on a leg.

    Attributes:
        leg: its name; of a road without a junction, "main".
        way: "in" on a lane that leads to the junction, "out" on one that leads away from it; on a
            road without a junction "out" is along the road.
        distance: [m] along the leg from the junction's edge (or the road's start).
        lane: 1 is the innermost of its direction; or a strip beside the lanes.
        offset: [m] from the lane's centre, left of its direction of travel.
    """

    leg: str
    way: Way
    distance: Quantity
    lane: int | Literal["sidewalk", "shoulder"] = 1
    offset: Quantity = 0.0

    @classmethod
    def at_point(cls, point: str, distance: Quantity) -> "Waypoint":
        """Return a place by the paper's points (Section V-A): P1 in and P2 out are leg A's, …."""
        number = int(point[1:])
        return cls(LETTERS[(number - 1) // 2], "in" if number % 2 else "out", distance)

    def __str__(self) -> str:
        """Return the lane that it lies on, for messages."""
        lane = f"lane {self.lane}" if isinstance(self.lane, int) else self.lane
        return f"leg {self.leg} {self.way}, {lane}"


@dataclass(frozen=True)
class Participant:
    """A road user.

    Attributes:
        name: "ego" for the system under test.
        type: what it is, one of `bridgegen.scenario.participants.TYPES`.
        start: where it stands at time 0.
        end: where its route ends; None: it continues along its lane, or along its path.
        speed: [m/s] at time 0; of the ego also its target.
        path: the points of its own way, ``start`` first; empty: it keeps to lanes.
        driver: of a participant other than the ego one of
            `bridgegen.scenario.language.adversary.DRIVERS`; empty: as scripted.
        heading: turned from its lane's direction of travel [deg], left positive; who moves at 180
            drives against the traffic.
        type_by: the category that gives its type or model in each evaluation; empty: it is always
            the same.
        types: the values of that: types, and names of models.
        place_by: the category that gives its start and end in each evaluation; empty: they are
            always the same.
        ways: the starts and ends that it chooses from, in the order of its values.
        model: one of `bridgegen.scenario.named_models.MODELS`; empty: it is as its type usually is.
        own_body: its body, where it is not the type's or model's.
        siren: whether it is an emergency vehicle on a call, to which all give way.
        exceeds_limit: why it may drive faster than road and weather allow; empty: it may not.
        off_crosswalk: why a pedestrian is on the road away from crosswalks; empty: it is not.
        change: of the ego's route, which changes to the lane beside: from where on it may, on its
            lane, and by where it must have, on the other; where it passes something, also from
            where on it returns, and by where it has; empty: it keeps its lanes.
    """

    name: str
    type: str
    start: Waypoint
    end: Waypoint | None
    speed: Quantity
    path: tuple[Waypoint, ...] = ()
    driver: str = field(default="", repr=False, kw_only=True)
    heading: Quantity = field(default=0.0, repr=False, kw_only=True)
    exceeds_limit: str = field(default="", repr=False, kw_only=True)
    off_crosswalk: str = field(default="", repr=False, kw_only=True)
    siren: bool = field(default=False, repr=False, kw_only=True)
    own_body: Body | None = field(default=None, repr=False, kw_only=True)
    type_by: str = field(default="", repr=False, kw_only=True)
    types: tuple[str, ...] = field(default=(), repr=False, kw_only=True)
    place_by: str = field(default="", repr=False, kw_only=True)
    ways: tuple[tuple[Waypoint, Waypoint | None], ...] = field(default=(), repr=False, kw_only=True)
    model: str = field(default="", repr=False, kw_only=True)
    change: tuple[Waypoint, ...] = field(default=(), repr=False, kw_only=True)

    @property
    def body(self) -> Body:
        """How large it is, and what it can do."""
        return self.own_body or body_of(self.model or self.type)

    @property
    def bodies(self) -> tuple[Body, ...]:
        """All that its body may be."""
        return tuple(body_of(kind) for kind in self.types) or (self.body,)

    @property
    def at_each_place(self) -> "tuple[Participant, ...]":
        """It at each place that its category chooses from; itself where there is none."""
        return tuple(
            replace(self, start=start, end=end, place_by="", ways=()) for start, end in self.ways
        ) or (self,)

    @property
    def is_door(self) -> bool:
        """Whether it is the door of a vehicle, which is a body of its own once it opens."""
        return bool(self.path) and self.conduct == "obstacle"

    @property
    def conduct(self) -> Conduct:
        """The rules by which it moves."""
        return PARTICIPANTS[self.type].seen_as.conduct


@dataclass(frozen=True)
class Change:
    """The dynamics of a change: one of the three defines its duration; none: at once.

    Attributes:
        rate: [m/s²] (of a speed only).
        time: [s].
        distance: [m] travelled meanwhile.
        shape: of the value over time (or distance).
        jerk: [m/s³] with which an acceleration up to the rate builds up and is released; None: at
            once.
    """

    rate: Quantity | None = None
    time: Quantity | None = None
    distance: Quantity | None = None
    shape: Literal["linear", "cubic", "sinusoidal"] = "linear"
    jerk: float | None = None

    def __str__(self) -> str:
        """Return how long it takes, to be said after what changes."""
        for value, unit, word in (
            (self.rate, "m/s²", "at"),
            (self.time, "s", "within"),
            (self.distance, "m", "over"),
        ):
            if value is not None:
                return f"{word} {in_words(value, unit)}"
        return "at once"


@dataclass(frozen=True)
class SpeedChange:
    """A participant takes up a speed [m/s]."""

    speed: Quantity
    change: Change

    def __str__(self) -> str:
        """Return what the participant does, to be said after its name."""
        return f"takes up {in_words(self.speed, 'm/s')} {self.change}"


@dataclass(frozen=True)
class LaneChange:
    """A participant changes lane: how many lanes, left of its direction of travel positive."""

    lanes: int
    change: Change

    def __str__(self) -> str:
        """Return what the participant does, to be said after its name."""
        count, side = abs(self.lanes), "left" if self.lanes > 0 else "right"
        lanes = "a lane" if count == 1 else f"{count} lanes"
        return f"changes {lanes} to the {side} {self.change}"


@dataclass(frozen=True)
class LaneOffset:
    """A participant moves aside within its lane, or over its edge, and stays there.

    Attributes:
        offset: where to, left of its lane's centre positive [m].
        acceleration: across the lane at most [m/s²].
        shape: of the way aside over time.
    """

    offset: Quantity
    acceleration: Quantity
    shape: Literal["linear", "cubic", "sinusoidal"] = "sinusoidal"

    def __str__(self) -> str:
        """Return what the participant does, to be said after its name."""
        return (
            f"moves to {beside(self.offset)} of its lane's centre with at most "
            f"{in_words(self.acceleration, 'm/s²')}"
        )


@dataclass(frozen=True)
class KeepDistance:
    """A participant follows another one at a distance, bumper to bumper.

    Attributes:
        to: the other one.
        distance: [m]; or
        time: a gap [s].
        acceleration: at most [m/s²].
        braking: at most [m/s²].
        max_speed: [m/s], if not only its body limits it.
    """

    to: str
    distance: Quantity | None
    time: Quantity | None
    acceleration: Quantity
    braking: Quantity
    max_speed: Quantity | None = None

    def __str__(self) -> str:
        """Return what the participant does, to be said after its name."""
        gap = in_words(self.distance, "m") if self.distance is not None else ""
        return f"keeps {gap or in_words(self.time or 0.0, 's')} behind {self.to}"


@dataclass(frozen=True)
class Arrival:
    """A participant chooses its speed so that it arrives somewhere as another does elsewhere.

    Attributes:
        at: where it arrives.
        other: the other participant.
        place: where that one arrives.
    """

    at: Waypoint
    other: str
    place: Waypoint

    def __str__(self) -> str:
        """Return what the participant does, to be said after its name."""
        here, there = (
            f"{waypoint} at {in_words(waypoint.distance, 'm')}"
            for waypoint in (self.at, self.place)
        )
        return f"arrives at {here} when {self.other} arrives at {there}"


@dataclass(frozen=True)
class Indication:
    """A vehicle indicates, switches its hazard lights on, or all of these off.

    Attributes:
        side: which.
    """

    side: Literal["left", "right", "hazard", "off"]

    def __str__(self) -> str:
        """Return what the participant does, to be said after its name."""
        if self.side == "hazard":
            return "switches its hazard lights on"
        return "stops indicating" if self.side == "off" else f"indicates to the {self.side}"


@dataclass(frozen=True)
class Opening:
    """A door opens: it comes into the scenario, and goes along its path from then on."""

    def __str__(self) -> str:
        """Return what the door does, to be said after its name."""
        return "opens"


@dataclass(frozen=True)
class WeatherChange:
    """The weather becomes that of other parameters.

    Attributes:
        prefix: those are named so, and then as the weather's own (``later_fog_density``).
        is_whole: whether they state all of the weather; else the rest stays as it was.
    """

    prefix: str
    is_whole: bool = field(default=True, repr=False)

    def __str__(self) -> str:
        """Return what happens to the weather, to be said after it."""
        return f"becomes that of {self.prefix}…"


Action = (
    SpeedChange
    | LaneChange
    | LaneOffset
    | KeepDistance
    | Arrival
    | Indication
    | Opening
    | WeatherChange
)


@dataclass(frozen=True)
class ConditionSpec:
    """When an event starts.

    Attributes:
        kind: what is compared with ``value``; see ``CONDITIONS``.
        value: a parameter's name or a constant, in the kind's unit.
        to: the other participant, where the kind needs one.
        of: whose state is looked at; the event's own participant by default.
        event: the event that must have ended, for "after", or begun, for "began".
    """

    kind: str
    value: Quantity
    to: str | None = None
    of: str | None = None
    event: str | None = None


@dataclass(frozen=True)
class ConditionKind:
    """A kind of condition: its unit, the rule it holds by, and whether it is about two."""

    unit: str
    rule: str
    pair: bool
    meaning: str


CONDITIONS: Mapping[str, ConditionKind] = MappingProxyType(
    {
        "time": ConditionKind("s", "≥", False, "time since the start"),
        "distance": ConditionKind("m", "≤", True, "between reference points, as the crow flies"),
        "gap": ConditionKind("m", "≤", True, "along the lane, between the bodies"),
        "ttc": ConditionKind("s", "≤", True, "time to collision at present speeds"),
        "headway": ConditionKind("s", "≤", True, "time until it is where the other is now"),
        "speed": ConditionKind("m/s", "≥", False, "its speed"),
        "travelled": ConditionKind("m", "≥", False, "distance since the start"),
        "standstill": ConditionKind("s", "≥", False, "time for which it has stood"),
        "contact": ConditionKind("1", "=", True, "it has touched the other"),
        "after": ConditionKind("s", "≥", False, "time since another event ended"),
        "began": ConditionKind("s", "≥", False, "time since another event began"),
    }
)
"""Kinds of conditions of an event, by name."""


@dataclass(frozen=True)
class EventSpec:
    """Something that happens.

    Attributes:
        name: of the event.
        participant: who acts; None where it is the weather.
        actions: what changes.
        when: alternatives, the first to hold starts the event; each is conditions that must hold
            together.
    """

    name: str
    participant: str | None
    actions: tuple[Action, ...]
    when: tuple[tuple[ConditionSpec, ...], ...]


@dataclass(frozen=True)
class Jam:
    """A queue of standing vehicles (layer 3).

    Attributes:
        name: of the jam.
        tail: where the last of them stands.
        participants: their names, the last first.
    """

    name: str
    tail: Waypoint
    participants: tuple[str, ...]


@dataclass(frozen=True)
class RoadWorks:
    """A lane that is closed for work, by a row of cones and a sign (layer 3).

    Attributes:
        name: of the works.
        start: where the first cone stands.
        length: [m] of the closed stretch, the taper's included.
        cones: each cone's place, in the direction of travel.
        sign: the place of the sign before them.
    """

    name: str
    start: Waypoint
    length: float
    cones: tuple[Waypoint, ...]
    sign: Waypoint


GHOST_UNITS = {
    "at": "m", "rate": "1/m", "appears": "m", "vanishes": "m", "lifetime": "s", "aside": "m",
    "share": "1",
}  # fmt: skip
"""The numbers of a ghost, with their units; see ``GhostSection``."""

TRACKER_UNITS = {
    "angle": "deg", "range": "m", "extent": "1", "confirm": "1", "of": "1", "coast": "s",
}  # fmt: skip
"""The numbers of the ego's tracker, with their units; see ``TrackerSection``."""


@dataclass(frozen=True)
class Ghost:
    """What the ego's sensors report and is not there.

    Attributes:
        name: of it.
        type: what it is taken for, one of `bridgegen.scenario.participants.TYPES`.
        numbers: those of `GHOST_UNITS` that it has, by name: either at, or rate, or aside.
        mirrors: name of the participant whose mirror image it is; empty: of none.
    """

    name: str
    type: str
    numbers: Mapping[str, Quantity]
    mirrors: str = field(default="", repr=False)


@dataclass(frozen=True)
class Story:
    """Layers 3 and 4 of a logical scenario.

    Attributes:
        participants: the ego and the others.
        events: what happens.
        jams: queues; their vehicles are among the participants.
        works: closed lanes.
        ghosts: false positives of the ego's sensors.
        tracker: the numbers of `TRACKER_UNITS`; empty if the scenario states none.
    """

    participants: tuple[Participant, ...] = ()
    events: tuple[EventSpec, ...] = ()
    jams: tuple[Jam, ...] = field(default=())
    works: tuple[RoadWorks, ...] = field(default=())
    ghosts: tuple[Ghost, ...] = field(default=(), repr=False)
    tracker: Mapping[str, Quantity] = field(default_factory=dict, repr=False)

    @property
    def later_weathers(self) -> tuple[str, ...]:
        """The prefixes of the whole weathers that events change to."""
        changes = (
            action
            for event in self.events
            for action in event.actions
            if isinstance(action, WeatherChange) and action.is_whole
        )
        return tuple(dict.fromkeys(change.prefix for change in changes))


@dataclass(frozen=True)
class Adversary:
    """A participant that the search drives, and within what limits; see `adversary.py`.

    Attributes:
        participant: its name.
        speeds: [m/s] that the scenario gives it: the first is its speed at the start, the largest
            its highest.
        lane_width: [m] of the lane that it keeps to.
        width: of its body [m].
        rate: [m/s²] at which the scenario has it change its speed.
        acceleration: of its body at most [m/s²].
        braking: of its body at most [m/s²].
        paces: the parameters that are its speeds as shares of the highest, one per decision.
        offsets: the parameters that are its places in the lane, -1 at its right edge, 1 at its left
            one, one per decision.
    """

    participant: str
    speeds: tuple[Quantity, ...]
    lane_width: Quantity
    width: float
    rate: Quantity
    acceleration: float
    braking: float
    paces: tuple[str, ...]
    offsets: tuple[str, ...]

    @property
    def controls(self) -> tuple[str, ...]:
        """The parameters by decision: pace and place of the first, then of the second."""
        pairs = zip(self.paces, self.offsets, strict=True)
        return tuple(name for pair in pairs for name in pair)
