"""The drivers that ship, and how a scenario file names them."""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Self

from bridgegen.errors import InputError, UnknownNameError

STAGES = ("perception", "prediction", "control")
"""What of a driver can be made ideal, in the order of the work; planning is what is left."""


@dataclass(frozen=True)
class Driver:
    """A system under test that the embedded simulator can run.

    Attributes:
        name: as given to ``--ego`` and written to the file's Controller.
        code: which branch of the compiled rollout it is.
        description: one sentence.
        stages: those of `STAGES` that it has, and that can be made ideal.
        ideal: those that are.
        perceives: whether it has sensors, whose detections a rollout then holds.
    """

    name: str
    code: int
    description: str
    stages: frozenset[str] = frozenset()
    ideal: frozenset[str] = frozenset()
    perceives: bool = False

    @property
    def label(self) -> str:
        """The name, and what is ideal."""
        return f"{self.name} (ideal {join(self.ideal)})" if self.ideal else self.name

    def idealised(self, stages: Iterable[str]) -> Self:
        """Return the driver with exactly these stages ideal.

        Raises:
            UnknownNameError: no driver has such a stage.
            InputError: this one has not.
        """
        wanted = frozenset(stages)
        for stage in sorted(wanted):
            if stage not in STAGES:
                raise UnknownNameError("stage of a driver", stage, STAGES)
        if not wanted <= self.stages:
            which = f"has {join(self.stages)}" if self.stages else "has no stages"
            raise InputError(
                f"ideal must name stages of the driver '{self.name}', which {which}; got "
                f"{join(wanted)}"
            )
        return replace(self, ideal=wanted)


ROUTE_FOLLOWER = Driver(
    "route-follower", 0, "Holds its target speed on its route and sees nobody (paper, Section V-A)."
)
REFERENCE = Driver(
    "reference",
    1,
    "Perceives, predicts, plans and controls: follows its route, slows for bends, keeps its "
    "distance, stops at red, yields and brakes by predicted conflict.",
    frozenset(STAGES),
)
UN_R157 = Driver(
    "un-r157",
    2,
    "The competent and careful human driver of UN Regulation 157: reacts to a risk after 0.75 s, "
    "then brakes by up to 0.774 g; sees everybody.",
)
FSM = Driver(
    "fsm",
    3,
    "The fuzzy safety model: brakes in anticipation, up to 6 m/s², by how unsafe its distances "
    "are; sees everybody.",
)
TRAJECTORY = Driver("trajectory", 0, "Nobody: the file's own timetable moves the ego.")
"""What an ego without a driver says it is driven by; not to be chosen."""

DRIVERS = {driver.name: driver for driver in (ROUTE_FOLLOWER, REFERENCE, UN_R157, FSM)}


def get(name: str, ideal: Iterable[str] = ()) -> Driver:
    """Return a driver by name, with some of its stages ideal.

    Raises:
        UnknownNameError: no such driver, or no such stage.
        InputError: a stage that this driver has not.
    """
    try:
        driver = DRIVERS[name]
    except KeyError:
        raise UnknownNameError("ego driver", name, DRIVERS) from None
    return driver.idealised(ideal)


def split(text: str) -> tuple[str, ...]:
    """Return the stages that a text like ``perception,control`` names, unchecked."""
    return tuple(word for word in (part.strip() for part in text.split(",")) if word)


def join(stages: Iterable[str]) -> str:
    """Return stages as such a text, in the order of the work."""
    chosen = frozenset(stages)
    return ",".join(stage for stage in STAGES if stage in chosen)
