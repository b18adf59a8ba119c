"""Which simulator runs a scenario, and how; what is asked for on the command line."""

import os
from collections.abc import Callable, Mapping, MutableMapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from bridgegen.base.cuda import DEVICE
from bridgegen.base.errors import InputError, UnknownNameError
from bridgegen.base.plugins import PlugIns, Registry
from bridgegen.simulation.vehicles import KINEMATIC

if TYPE_CHECKING:  # it is part of the command line, which starts fast
    from bridgegen.drivers import Driver
    from bridgegen.openx.openscenario.model import OpenScenario
    from bridgegen.simulation.embedded.simulator import EmbeddedSimulator
    from bridgegen.simulation.simulator import Simulator

Value = bool | int | float | str
"""Value of a simulator's setting."""


@dataclass(frozen=True)
class Kind:
    """A simulator that can be chosen.

    Attributes:
        name: of it.
        description: one sentence.
        settings: what changes its results, by name: what it means, with its unit.
        access: what says where it is on this machine, by the name of the option for it.
        device: "CPU" or "GPU": what a worker of it needs one of.
        make: of the embedded simulator of a storyboard, that storyboard, the chosen settings and
            the access.
    """

    name: str
    description: str
    make: "Make"
    settings: Mapping[str, str] = field(default_factory=dict)
    access: Mapping[str, str] = field(default_factory=dict)
    device: str = "CPU"


Make = Callable[
    ["EmbeddedSimulator", "OpenScenario", Mapping[str, Value], Mapping[str, Value]],
    "Simulator[Any]",
]


def _embedded(
    embedded: "EmbeddedSimulator",
    storyboard: "OpenScenario",
    settings: Mapping[str, Value],
    access: Mapping[str, Value],
) -> "Simulator[Any]":
    return embedded


def _esmini(
    embedded: "EmbeddedSimulator",
    storyboard: "OpenScenario",
    settings: Mapping[str, Value],
    access: Mapping[str, Value],
) -> "Simulator[Any]":
    from bridgegen.simulation.esmini.simulator import EsminiSimulator, library_of, steps_of

    return EsminiSimulator(embedded, storyboard, library_of(access), steps=steps_of(settings))


_OURS = {
    kind.name: kind
    for kind in (
        Kind(
            "embedded",
            "Ours, compiled to machine code: thousands of scenarios a second.",
            _embedded,
        ),
        Kind(
            "esmini",
            "esmini 3, by its library: it runs the storyboard, and our driver the ego in it.",
            _esmini,
            settings={"steps": "how many steps of esmini's make one of the scenario's, 1 to 100"},
            access={"--esmini-lib": "esmini's library, libesminiLib.so; or set ESMINI_LIB"},
        ),
    )
}

ADDED = PlugIns("simulator", "bridgegen.simulators")


def _checked(found: object, name: str) -> Kind:
    """Return a package's simulator.

    Raises:
        InputError: it is no `Kind` of that name.
    """
    if not isinstance(found, Kind):
        raise InputError(
            f"{ADDED.place(name)} must be a bridgegen.simulation.choice.Kind, got "
            f"{type(found).__name__}"
        )
    if found.name != name:
        raise InputError(
            f"{ADDED.place(name)} has the name '{found.name}'; the two names must agree"
        )
    return found


SIMULATORS: MutableMapping[str, Kind] = Registry(_OURS, ADDED, _checked)
"""Simulators by name: ours, then those found by entry points: CARLA (`adapters`), and those of
other packages."""


@dataclass(frozen=True)
class SimulatorChoice:
    """A simulator, how it is to work, and where it is.

    Attributes:
        name: of `SIMULATORS`.
        settings: what changes its results; recorded with a run.
        access: where it is on this machine. Never recorded: what a run's folder names is not
            started, loaded or connected to by itself.
        finer: how many steps of the embedded simulator make one of the scenario's.

    Raises:
        UnknownNameError: no such simulator, or it has no such setting.
        InputError: it is not reached in this way.
    """

    name: str = "embedded"
    settings: Mapping[str, Value] = field(default_factory=dict)
    access: Mapping[str, Value] = field(default_factory=dict)
    finer: int = 1

    def __post_init__(self) -> None:
        if self.name not in SIMULATORS:
            raise UnknownNameError("simulator", self.name, SIMULATORS)
        kind = SIMULATORS[self.name]
        for name in self.settings:
            if name not in kind.settings:
                raise UnknownNameError(f"setting of the simulator {self.name}", name, kind.settings)
        for name in self.access:
            if name not in kind.access:
                owners = [
                    simulator.name for simulator in SIMULATORS.values() if name in simulator.access
                ]
                raise InputError(
                    f"{name} is for the simulator {' or '.join(owners) or '(none)'}, got it for "
                    f"{self.name}"
                )

    @property
    def device(self) -> str:
        """What a worker needs one of: "CPU" or "GPU"."""
        return SIMULATORS[self.name].device

    @property
    def detects(self) -> bool:
        """Whether a detector of the user's looks at what it renders."""
        return "--detector" in self.access

    def simulator(
        self,
        storyboard: "OpenScenario",
        place: str,
        driver: "Driver | None" = None,
        vehicle: str | None = None,
    ) -> "Simulator[Any]":
        """Return the simulator, with a storyboard.

        Args:
            storyboard: the scenario file, validated.
            place: its name, for messages.
            driver: who drives the ego; what the file says by default.
            vehicle: how the ego moves; what the file says by default.

        Raises:
            UnsupportedError: what it cannot run, by name and line, all of it at once.
            InputError: a setting out of range; or it is not where it should be.
        """
        from bridgegen.simulation.embedded.simulator import EmbeddedSimulator

        embedded = EmbeddedSimulator(storyboard, place, driver=driver, vehicle=vehicle)
        return self.around(embedded, storyboard)

    def around(self, embedded: "EmbeddedSimulator", storyboard: "OpenScenario") -> "Simulator[Any]":
        """Return the simulator, with the storyboard that the embedded one has.

        Args:
            embedded: it.
            storyboard: the scenario file that it was made of.

        Raises:
            InputError: see ``simulator``; or the ego's driver or its vehicle lives in another
                simulator.
        """
        driver = embedded.program.driver
        if device := os.environ.get(DEVICE):
            _require_compiled(embedded, self.name, f"--device {device}")
        if driver.home not in ("", self.name):
            raise InputError(
                f"{embedded.program.place}: the driver '{driver.name}' drives in the simulator "
                f"{driver.home} alone (--simulator {driver.home}), got {self.name}"
            )
        vehicle = embedded.program.vehicle
        if vehicle != KINEMATIC and self.name != EMBEDDED.name:
            raise InputError(
                f"{embedded.program.place}: the vehicle '{vehicle}' is of the embedded simulator; "
                f"{self.name} moves the ego in its own way (--vehicle {KINEMATIC})"
            )
        if embedded.partners and self.name != EMBEDDED.name:
            place = embedded.program.place
            raise InputError(
                f"{place}: several egos run in the embedded simulator, got {self.name}"
            )
        if storyboard.left_hand and self.name not in _OURS:
            raise InputError(
                f"{embedded.program.place}: traffic drives on the left, which the simulators "
                f"{' and '.join(_OURS)} run, got {self.name}"
            )
        return SIMULATORS[self.name].make(embedded, storyboard, self.settings, self.access)


def _require_compiled(embedded: "EmbeddedSimulator", simulator: str, asker: str) -> None:
    """Check that a storyboard runs on a device.

    Raises:
        InputError: it does not.
    """
    driver, place = embedded.program.driver, embedded.program.place
    if simulator != EMBEDDED.name:
        raise InputError(f"{place}: {asker} runs the embedded simulator, got {simulator}")
    if driver.is_own or driver.home:
        raise InputError(
            f"{place}: {asker} runs drivers that ship, which are compiled, got '{driver.name}'"
        )
    if embedded.partners:
        raise InputError(f"{place}: {asker} runs one ego, and the scenario has several")


EMBEDDED = SimulatorChoice()
