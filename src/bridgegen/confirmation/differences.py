"""How two rollouts of one scenario differ, *here* and *there*; a difference is there − here."""

from dataclasses import dataclass

from pydantic import ConfigDict

from bridgegen.arrays import Float

PARTED = 0.5
"""States have parted where a reference point is farther than this from the other one [m]."""

TRACE = 0.05
"""What is off by more than this [m] is on its way to part."""


SLIGHT = 0.01
"""What is off by more than this [m] may change what a driver decides."""


class _Checked:
    """What is read from a file holds nothing else, and only numbers that are finite."""

    __pydantic_config__ = ConfigDict(allow_inf_nan=False, extra="forbid", strict=True)


@dataclass(frozen=True)
class Contact(_Checked):
    """The ego's first contact.

    Attributes:
        time: [s].
        entity: with whom.
    """

    time: float
    entity: str


@dataclass(frozen=True)
class Parting(_Checked):
    """When an entity is where it is not in the other rollout.

    Attributes:
        entity: who.
        time: the first instant at which it has parted [s].
        gap: how far the reference points are apart then [m]; None where it is in one alone.
        along: how far ahead it is there, in its own direction here [m]; None likewise, and so all
            that follow.
        across: how far left it is there [m].
        speed: how much faster it is there [m/s].
        turn: how far to the left of its direction of travel here it moves there [rad], in −π..π;
            None too where it does not move.
        since: the first instant from which on it was off by more than TRACE without a pause [s].
        only: "here" or "there", if it is in one of them alone, for more than a step.
    """

    entity: str
    time: float
    gap: float | None
    along: float | None
    across: float | None
    speed: float | None
    turn: float | None
    since: float
    only: str | None = None


@dataclass(frozen=True)
class Approach(_Checked):
    """The closest approach of the ego to another entity; the first contact, if there is one.

    Attributes:
        time: [s].
        entity: the other one.
        distance: of the boxes [m].
    """

    time: float
    entity: str
    distance: float


@dataclass(frozen=True)
class Divergence(_Checked):
    """How far an entity is from where it is in the other rollout, up to the closest approach.

    Attributes:
        entity: who.
        since: the first instant at which it is off by more than TRACE [s].
        time: the instant, up to the closest approach, at which it is off most [s].
        gap: how far the reference points are apart then [m]; None where it is in one alone.
        along: how far ahead it is there, in its own direction here [m]; None likewise, and so all
            that follow.
        across: how far left it is there [m].
        speed: how much faster it is there [m/s].
        turn: see `Parting`.
        only: likewise.
    """

    entity: str
    since: float
    time: float
    gap: float | None
    along: float | None
    across: float | None
    speed: float | None
    turn: float | None
    only: str | None = None


@dataclass(frozen=True)
class Offset(_Checked):
    """Who else was a little off when the first one parted, and may have led to it.

    Attributes:
        entity: who.
        gap: how far the reference points were apart [m].
    """

    entity: str
    gap: float


@dataclass(frozen=True)
class EventTimes(_Checked):
    """An event that began at different times, by more than a step.

    Attributes:
        name: of it.
        here: when it began [s]; None if it never did.
        there: likewise.
    """

    name: str
    here: float | None
    there: float | None

    @property
    def first(self) -> float:
        """When it first began, here or there [s]."""
        return min(one for one in (self.here, self.there) if one is not None)


@dataclass(frozen=True)
class LightTimes(_Checked):
    """A traffic light that shows something else, for more than a step.

    Attributes:
        name: its id.
        time: from when on [s].
        here: its state, see `Rollout.lights`.
        there: likewise.
    """

    name: str
    time: float
    here: int
    there: int


@dataclass(frozen=True)
class BoxSizes(_Checked):
    """An entity that has another box.

    Attributes:
        entity: who.
        here: length, width, and how far the centre is ahead of the reference point [m].
        there: likewise.
    """

    entity: str
    here: tuple[float, float, float]
    there: tuple[float, float, float]


@dataclass(frozen=True)
class Comparison:
    """Two rollouts of one scenario, side by side.

    Attributes:
        step: the coarser of the two time steps [s].
        ends: when each of them ends [s].
        contacts: the ego's first contact in each; None where there is none.
        partings: everybody's who parts, the first one first.
        offsets: of the others when the first one parted, if they were off by more than SLIGHT.
        events: those that began at different times, the earliest first.
        lights: those that differ, the earliest first.
        boxes: those that differ.
        only_here: entities that are unknown there.
        only_there: entities that are unknown here.
        closest: the closest approach here; None where the ego is alone.
        diverged: who was off by more than TRACE up to then, the first one first.
    """

    step: float
    ends: tuple[float, float]
    contacts: tuple[Contact | None, Contact | None]
    partings: tuple[Parting, ...] = ()
    offsets: tuple[Offset, ...] = ()
    events: tuple[EventTimes, ...] = ()
    lights: tuple[LightTimes, ...] = ()
    boxes: tuple[BoxSizes, ...] = ()
    only_here: tuple[str, ...] = ()
    only_there: tuple[str, ...] = ()
    closest: Approach | None = None
    diverged: tuple[Divergence, ...] = ()


@dataclass(frozen=True)
class Track:
    """Where somebody was there, at here's instants.

    Attributes:
        entity: who.
        first: the instant of the first value.
        x: ``(n,)`` float64 [m], of the reference point; NaN where it is not there.
        y: likewise.
        h: ``(n,)`` float64 [rad], heading.
    """

    entity: str
    first: int
    x: Float
    y: Float
    h: Float
