"""How two rollouts of one scenario differ, *here* and *there*; a difference is there − here."""

from dataclasses import dataclass

from pydantic import ConfigDict

from bridgegen.base.arrays import Float

DIVERGED = 0.5
"""Distance between an entity's reference points beyond which it diverges [m]."""

TRACE = 0.05
"""Deviation beyond which a divergence begins [m]."""

SLIGHT = 0.01
"""Deviation beyond which a driver's decision may change [m]."""


class _Checked:
    """Has no further fields and only finite numbers, also when it is read from a file."""

    __pydantic_config__ = ConfigDict(allow_inf_nan=False, extra="forbid", strict=True)


@dataclass(frozen=True)
class Contact(_Checked):
    """The ego's first contact.

    Attributes:
        time: [s].
        entity: the other one.
    """

    time: float
    entity: str


@dataclass(frozen=True)
class EntityDivergence(_Checked):
    """The divergence of an entity: its positions differ by more than DIVERGED.

    Attributes:
        entity: its name.
        time: the first instant of the divergence [s].
        gap: distance of the reference points at that instant [m]; None if the entity is present in
            one rollout only, as for the next four.
        along: difference there − here along its heading here [m], positive ahead.
        across: likewise across its heading here [m], positive to the left.
        speed: likewise of its speed [m/s].
        turn: angle from its direction of travel here to that there [rad], in −π..π, positive to the
            left; None also if it does not move.
        since: the instant from which it deviates by more than TRACE without interruption [s].
        only: "here" or "there", if it is present in one rollout only, for more than a step.
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
    """The closest approach of the ego to another entity; the first contact if there is one.

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
    """The largest deviation of an entity up to the closest approach.

    Attributes:
        entity: its name.
        since: the first instant at which it deviates by more than TRACE [s].
        time: the instant of the largest deviation up to the closest approach [s].
        gap: see `EntityDivergence`, as for the following.
        along: [m].
        across: [m].
        speed: [m/s].
        turn: [rad].
        only: "here", "there" or None.
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
    """A small deviation of another entity when the first one diverged: a possible cause.

    Attributes:
        entity: its name.
        gap: distance of the reference points [m].
    """

    entity: str
    gap: float


@dataclass(frozen=True)
class EventTimes(_Checked):
    """An event whose start times differ by more than a step.

    Attributes:
        name: of the event.
        here: its start [s]; None if it did not start.
        there: likewise.
    """

    name: str
    here: float | None
    there: float | None

    @property
    def first(self) -> float:
        """Its earlier start [s]."""
        return min(value for value in (self.here, self.there) if value is not None)


@dataclass(frozen=True)
class LightTimes(_Checked):
    """A traffic light whose states differ for more than a step.

    Attributes:
        name: its id.
        time: start of the difference [s].
        here: its state, see `Rollout.lights`.
        there: likewise.
    """

    name: str
    time: float
    here: int
    there: int


@dataclass(frozen=True)
class BoxSizes(_Checked):
    """An entity whose bounding boxes differ.

    Attributes:
        entity: its name.
        here: length, width, and distance of the centre ahead of the reference point [m].
        there: likewise.
    """

    entity: str
    here: tuple[float, float, float]
    there: tuple[float, float, float]


@dataclass(frozen=True)
class Comparison:
    """The comparison of two rollouts of one scenario.

    Attributes:
        step: the coarser of the two time steps [s].
        ends: when each of them ends [s].
        contacts: the ego's first contact in each, or None.
        partings: of all entities that diverge, in order of time.
        offsets: of other entities when the first one diverged, if larger than SLIGHT.
        events: those with different start times, in order of time.
        lights: those that differ, in order of time.
        boxes: those that differ.
        only_here: entities that do not exist there.
        only_there: entities that do not exist here.
        closest: the closest approach here; None if the ego is alone.
        diverged: entities that deviate by more than TRACE up to that instant, in order of time.
    """

    step: float
    ends: tuple[float, float]
    contacts: tuple[Contact | None, Contact | None]
    partings: tuple[EntityDivergence, ...] = ()
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
    """The track of an entity there, at the instants of here.

    Attributes:
        entity: its name.
        first: the instant of the first value.
        x: ``(n,)`` float64 [m], of the reference point; NaN where it is absent.
        y: likewise.
        h: ``(n,)`` float64 [rad], heading.
    """

    entity: str
    first: int
    x: Float
    y: Float
    h: Float
