"""The drivers that ship, how a scenario file names them, and all drivers as a table."""

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace
from enum import Enum
from pathlib import Path
from typing import Self

from bridgegen.base import plugins as own_code
from bridgegen.base.errors import InputError, UnknownNameError
from bridgegen.base.physics import CAREFUL_BRAKING_G, CAREFUL_REACTION
from bridgegen.drivers.address import address_of, is_remote
from bridgegen.drivers.planners import (
    DOMAINS,
    Planner,
    how_to_get,
    installed,
    missing,
    planners,
    require,
)
from bridgegen.drivers.tunable import Settings, read_settings, split_settings

STAGES = ("perception", "prediction", "control")
"""The stages of a driver that can be idealised, in order of execution; planning is the rest."""


class Origin(Enum):
    """Where a driver's code comes from."""

    SHIPPED = "shipped"
    """A driver that is installed with BridgeGen, compiled."""
    OWN = "own"
    """A driver from the user, or a planner that others wrote."""
    STORYBOARD = "storyboard"
    """No driver: the storyboard moves the ego."""
    GUEST = "guest"
    """A simulator other than the embedded one."""


EXIT, DEMAND = 0, 1
"""Columns of ``Rollout.transitions``."""

MANOEUVRES = {
    "+stop-in-lane": "Outside its ODD it stops in its lane.",
    "+stop-on-shoulder": "Outside its ODD it stops on the shoulder to its right, or in its lane.",
}
"""Ends of the names of drivers with a minimal-risk manoeuvre, see ``_odd_kernels``, and what each
does; by its place ``Plan.stops_in_lane``, from 1 on."""

TIME_LIMIT = 10.0
"""Default time limit of one call of a user's driver [s]."""


SCRIPTED, ATTENTIVE, INSISTENT, LAWFUL, TESTED = range(5)
"""Codes of the drivers of participants other than the ego."""

CODES = {
    "scripted": SCRIPTED,
    "attentive": ATTENTIVE,
    "insistent": INSISTENT,
    "lawful": LAWFUL,
    "ego": TESTED,
}
"""Codes of the drivers of participants other than the ego, by name."""

OTHERS = {
    "attentive": "Follows its script unless another participant is in its way: keeps its distance, "
    f"gives way, brakes after {CAREFUL_REACTION:g} s by up to {CAREFUL_BRAKING_G:g} g, waits for a "
    "gap to change lane.",
    "insistent": "As attentive to what is ahead and stands in its way; gives way to none "
    "that crosses, and passes red lights and stop signs.",
    "lawful": "As attentive; on foot and on a cycle, too, it waits at red lights, gives way, and "
    "enters the road away from crosswalks only where the gap in the traffic is long enough.",
    "scripted": "Does what its script says, whatever happens.",
}
"""The drivers of participants other than the ego: name and description."""


@dataclass(frozen=True)
class Driver:
    """A system under test that the embedded simulator can run.

    Attributes:
        name: as given to ``--ego`` and written to the file's Controller.
        description: one sentence.
        stages: those of `STAGES` that it has, and that can be made ideal.
        ideal: those that are idealised.
        time_limit: [s] that one call of a user's own driver may take.
        home: the only simulator that it drives in; empty: any.
        origin: where its code comes from.
        spec: of a user's own driver and of a planner, what its process makes: ``module:Class``,
            ``file.py:Class``, ``file.fmu``.
        domain: where it means to drive: words of `bridgegen.drivers.planners.DOMAINS`;
            empty: it does not say.
        called: what the user calls it (``--name``); empty: as its name says.
        manoeuvre: of `MANOEUVRES`, where its operational design domain is left; "": none.
        settings: values of its tunable numbers that are not at their defaults.
    """

    name: str
    description: str
    stages: frozenset[str] = frozenset()
    ideal: frozenset[str] = frozenset()
    time_limit: float = TIME_LIMIT
    home: str = ""
    origin: Origin = Origin.SHIPPED
    spec: str = ""
    domain: frozenset[str] = frozenset()
    called: str = field(default="", compare=False)
    manoeuvre: str = ""
    settings: Settings = ()

    @property
    def kernel(self) -> str:
        """The name of the driver that ships whose kernel drives."""
        return self.name.removesuffix(self.manoeuvre)

    @property
    def is_own(self) -> bool:
        """Whether it is the user's or a planner, in Python or as a co-simulation unit."""
        return self.origin is Origin.OWN

    @property
    def perceives(self) -> bool:
        """Whether it has sensors, ideal or not, whose detections a rollout then holds."""
        return "perception" in self.stages

    @property
    def draws(self) -> bool:
        """Whether its motion may follow from random numbers: those of its sensors, or its own."""
        return self.is_own or "perception" in self.stages - self.ideal

    @property
    def label(self) -> str:
        """What it is called, and the idealised stages."""
        name = self.called or self.name
        return f"{name} (ideal {join(self.ideal)})" if self.ideal else name

    def idealised(self, stages: Iterable[str]) -> Self:
        """Return the driver with exactly these stages ideal.

        Raises:
            UnknownNameError: no driver has such a stage.
            InputError: this driver lacks one of them.
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
    "route-follower",
    "Holds its target speed on its route and ignores traffic (paper, Section V-A).",
)
REFERENCE = Driver(
    "reference",
    "Perceives, predicts, plans and controls: follows its route, slows for bends, keeps its "
    "distance, passes standing vehicles, stops at red, yields and brakes by predicted conflict.",
    frozenset(STAGES),
)
UN_R157 = Driver(
    "un-r157",
    "The competent and careful human driver of UN Regulation 157, exact in its three disturbances "
    f"(cut-in, cut-out, deceleration): brakes after {CAREFUL_REACTION:g} s, by up to "
    f"{CAREFUL_BRAKING_G:g} g; follows otherwise.",
    domain=frozenset({"motorway"}),  # the regulation's: no crossing traffic, nobody on foot
)
CAREFUL = Driver(
    "careful",
    "UN R157's driver extended to any road: reacts to what crosses, walks or stands in its way as "
    f"well, after 0.4 s of perception and {CAREFUL_REACTION:g} s; sees everybody.",
)
FSM = Driver(
    "fsm",
    "The fuzzy safety model: brakes in anticipation, up to 6 m/s², by how unsafe its distances "
    "are; in UN R157's disturbances as in the Commission's code.",
    domain=frozenset({"motorway"}),
)
CAREFUL_FSM = Driver(
    "careful-fsm",
    "The fuzzy safety model extended to any road: sees through the vehicle ahead, and keeps more "
    "room; sees all actors.",
)
STORYBOARD = Driver(
    "storyboard", "None: the file's own actions move the ego.", origin=Origin.STORYBOARD
)
"""The driver of an ego without one; it cannot be chosen."""

DRIVERS = {
    driver.name: driver
    for driver in (ROUTE_FOLLOWER, REFERENCE, UN_R157, FSM, CAREFUL, CAREFUL_FSM)
}

GUESTS = {
    driver.name: driver
    for driver in (
        Driver(
            "carla-autopilot",
            "CARLA's own, its Traffic Manager, along the route (with --simulator carla alone).",
            home="carla",
            origin=Origin.GUEST,
        ),
        Driver(
            "carla-agent",
            "An agent of your CARLA's Python package 'agents' (with --simulator carla alone).",
            home="carla",
            origin=Origin.GUEST,
        ),
        Driver(
            "carla-external",
            "A client of yours that takes over the actor 'hero' (with --simulator carla alone).",
            home="carla",
            origin=Origin.GUEST,
        ),
    )
}
"""Drivers that live in another simulator, by name."""


def get(name: str, ideal: Iterable[str] = (), time_limit: float | None = None) -> Driver:
    """Return a driver by name, with some of its stages ideal.

    Args:
        name: of one that ships, of a planner, or a user's own: ``package.module:Class``,
            ``file.py:Class`` (or a compiled driver's function), ``file.fmu``; or where it runs,
            as ``connect:HOST:PORT``, ``unix:PATH``, ``exec:COMMAND``, ``egodriver://HOST:PORT``. It
            is loaded when it drives.
            One that ships may end in one of `MANOEUVRES`; a user's class or function and a planner
            in ``@FILE.yaml``, see `bridgegen.drivers.tunable`.
        ideal: stages to idealise.
        time_limit: [s] that one call of a user's own driver may take.

    Raises:
        UnknownNameError: no such driver, or no such stage.
        InputError: a stage that this driver lacks, an invalid time limit, or a planner that is
            not installed.
    """
    known = DRIVERS | GUESTS
    plain, file = split_settings(name)
    if file is not None:
        driver = get(plain, ideal, time_limit)
        if not driver.is_own:
            raise InputError(
                f"settings (@{file}) are for drivers of your own and planners; the numbers of "
                f"'{plain}' are compiled in"
            )
        return replace(driver, name=name, settings=read_settings(file))
    if time_limit is not None and not (name not in known and 0.0 < time_limit < math.inf):
        raise InputError(
            "a time limit [s] is for a driver of your own, and must be > 0 and finite, got "
            f"{time_limit:g} for '{name}'"
        )
    if name in known:
        return known[name].idealised(ideal)
    end = manoeuvre_of(name)
    if name.removesuffix(end) in DRIVERS:
        driver = DRIVERS[name.removesuffix(end)]
        what = f"{driver.description} {MANOEUVRES[end]}"
        return replace(driver, name=name, description=what, manoeuvre=end).idealised(ideal)
    if is_remote(name):
        address_of(name)
    spec, what, domain = name, "A driver of the user's own.", frozenset[str]()
    if is_planner(name):
        planner = planners()[name]
        require(planner)
        spec, what, domain = planner.spec, planner.description, planner.domain
    elif not is_spec(name):
        raise UnknownNameError("ego driver", name, [*DRIVERS, *planners()])
    own = Driver(
        name,
        what,
        stages=frozenset({"perception"}),
        time_limit=time_limit or TIME_LIMIT,
        origin=Origin.OWN,
        spec=spec,
        domain=domain,
    )
    return own.idealised(ideal)


def manoeuvre_of(name: str) -> str:
    """Return which of `MANOEUVRES` a driver's name ends in; "": none."""
    return next((end for end in MANOEUVRES if name.endswith(end)), "")


def is_planner(name: str) -> bool:
    """Return whether a name is that of a planner, installed or not."""
    return name in planners()


def is_spec(name: str) -> bool:
    """Return whether a name is that of a user's own driver, which is code."""
    # A planner with settings is only what a person has typed, too: its name holds a file.
    if is_remote(name) or split_settings(name)[1] is not None:
        return True
    return name.endswith(".fmu") or (own_code.is_own(name) and not is_planner(name))


def file_of(name: str) -> Path | None:
    """Return the file that the name of a user's own driver holds; None if it holds none."""
    name = split_settings(name)[0]
    if not is_spec(name) or is_remote(name):
        return None
    return Path(name) if name.endswith(".fmu") else own_code.file_of(name)


def split(text: str) -> tuple[str, ...]:
    """Return the stages that a text like ``perception,control`` names, unchecked."""
    return tuple(word for word in (part.strip() for part in text.split(",")) if word)


def join(stages: Iterable[str]) -> str:
    """Return stages as such a text, in order of execution."""
    chosen = frozenset(stages)
    return ",".join(stage for stage in STAGES if stage in chosen)


# --- All drivers as a table: those that ship, planners of others, drivers of other participants ---


HEAD = ("driver", "description", "can be ideal", "available", "licence", "domain", "source")


def listed() -> list[tuple[str, ...]]:
    """Return a row of `HEAD` for each driver; texts that say nothing are empty."""
    blank = ("", "", "")  # licence, domain, source
    rows: list[tuple[str, ...]] = [
        (item.name, item.description, join(item.stages), "ships", "", in_order(item.domain), "")
        for item in DRIVERS.values()
    ]
    rows += [
        (f"DRIVER{end}", f"One that ships, and: {what}", "", "ships", *blank)
        for end, what in MANOEUVRES.items()
    ]
    rows += [
        (guest.name, guest.description, join(guest.stages), f"in {guest.home}", *blank)
        for guest in GUESTS.values()
    ]
    rows += [
        (
            planner.name,
            planner.description,
            "perception",
            available(planner),
            planner.licence,
            in_order(planner.domain),
            planner.source,
        )
        for planner in planners().values()
    ]
    rows += [
        (name, f"Of other participants: {what}", "", "ships", *blank)
        for name, what in OTHERS.items()
    ]
    return rows


def available(planner: Planner) -> str:
    """Return whether a planner is installed, in which version, or how to get it."""
    if problem := missing(planner):
        return f"not installed ({problem}): {how_to_get(planner)}"
    versions = installed(planner)
    state = f"installed: {versions}" if versions else "installed"
    return f"{state}; {planner.how_to_get}" if planner.how_to_get else state


def in_order(domain: frozenset[str]) -> str:
    """Return where a driver means to drive, in the order of `DOMAINS`."""
    return ", ".join(word for word in DOMAINS if word in domain)


def planner_findings() -> Iterator[tuple[str, str, str]]:
    """Yield each planner's name, whether it is installed, and how to get it where it is not."""
    for planner in planners().values():
        problem = missing(planner)
        state = "not installed" if problem else available(planner)
        yield planner.name, state, how_to_get(planner) if problem else ""
