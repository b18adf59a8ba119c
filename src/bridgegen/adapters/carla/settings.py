"""Settings of a simulation in CARLA, and access to the server."""

import os
from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any, Self

from bridgegen.base.errors import InputError

Value = bool | int | float | str

TIME_STEP = 0.05
"""Duration of a tick [s]: with CARLA's ten substeps, a physics step is at most 0.01 s."""

MEANINGS: Mapping[str, str] = {
    "ego": "physics (CARLA's vehicle, pedals and steering by our driver), or kinematic (moved as "
    "the embedded simulator moves it)",
    "ego_model": "the ego's blueprint, e.g. vehicle.tesla.model3",
    "map": "auto (a Town by its name where the storyboard names its file, else our roads), "
    "opendrive (always our roads), or the name of one of the server's maps",
    "agent": "for --ego carla-agent: basic, cautious, normal or aggressive",
    "seed": "of the Traffic Manager, for --ego carla-autopilot",
    "sensor_period": "seconds between two frames of --record and --detector",
}
"""Meanings of the settings, which affect results."""

OPTIONS: Mapping[str, str] = {
    "--host": "where the server is; or set CARLA_HOST",
    "--port": "its port; or set CARLA_PORT",
    "--carla-command": "starts the server, and again when it has ended",
    "--carla-timeout": "seconds that an answer may take",
    "--record": "a new folder for images, LiDAR points, boxes and incidents",
    "--detector": "a detector of your own, whose boxes are measured",
}
"""Meanings of the options of access and outputs, which do not affect results."""

AGENTS = ("basic", "cautious", "normal", "aggressive")


@dataclass(frozen=True)
class CarlaSettings:
    """The settings, by the names of `MEANINGS`."""

    ego: str = "physics"
    ego_model: str = ""
    map: str = "auto"
    agent: str = "basic"
    seed: int = 0
    sensor_period: float = 0.1

    @classmethod
    def of(cls, chosen: Mapping[str, Value]) -> Self:
        """Return checked settings.

        Raises:
            InputError: what is out of range, all of it at once.
        """
        problems = []

        def must(name: str, rule: str, holds: bool) -> None:
            if name in chosen and not holds:
                problems.append(
                    f"{rule} must hold for the setting {name} of the simulator carla, "
                    f"got {chosen[name]}"
                )

        ego, agent, seed = (chosen.get(name) for name in ("ego", "agent", "seed"))
        must("ego", "'physics' or 'kinematic'", ego in ("physics", "kinematic"))
        must("agent", " or ".join(AGENTS), agent in AGENTS)
        must("seed", "0 <= seed < 2^31, whole,", _whole(seed) and 0 <= int(seed or 0) < 2**31)
        period = chosen.get("sensor_period")
        must(
            "sensor_period",
            f"a multiple of {TIME_STEP:g} s up to 10 s",
            _number(period) and _is_multiple(float(period or 0.0)),
        )
        for name in ("ego_model", "map"):
            must(name, "a name", isinstance(chosen.get(name), str) and chosen.get(name) != "")
        if problems:
            raise InputError(*problems)
        known = {field.name for field in fields(cls)}
        given: dict[str, Any] = {name: flag for name, flag in chosen.items() if name in known}
        return cls(**given)


@dataclass(frozen=True)
class Access:
    """Access to the server, by the names of `OPTIONS`.

    Attributes:
        host: its machine.
        port: of its first connection; it takes the next two, too.
        command: starts the server; empty if the user starts it.
        timeout: [s] that an answer may take.
        record: a folder for what the sensors record; empty: nothing is.
        detector: of the user's; empty: none.
    """

    host: str = "localhost"
    port: int = 2000
    command: str = ""
    timeout: float = 20.0
    record: str = ""
    detector: str = ""

    @classmethod
    def of(cls, given: Mapping[str, Value]) -> Self:
        """Return access from options; else from the environment, as on a worker's machine.

        Raises:
            InputError: a port or a time that is none.
        """
        said: dict[str, Any] = {
            name.removeprefix("--").removeprefix("carla-"): value for name, value in given.items()
        }
        if host := os.environ.get("CARLA_HOST"):
            said.setdefault("host", host)
        if (text := os.environ.get("CARLA_PORT", "")).isdecimal():
            said.setdefault("port", int(text))
        port, timeout = said.get("port", 2000), said.get("timeout", 20.0)
        problems = []
        if not (_whole(port) and 0 < int(port) < 65534):
            problems.append(f"0 < port < 65534 must hold for --port, got {port}")
        if not (_number(timeout) and 0 < float(timeout) < float("inf")):
            problems.append(f"0 < timeout must hold for --carla-timeout [s], got {timeout}")
        if problems:
            raise InputError(*problems)
        return cls(**said)

    @property
    def address(self) -> str:
        """As ``host:port``."""
        return f"{self.host}:{self.port}"


def _whole(value: object) -> bool:
    return isinstance(value, int) and not isinstance(value, bool)


def _number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _is_multiple(period: float) -> bool:
    ticks = period / TIME_STEP
    return 0.0 < period <= 10.0 and abs(ticks - round(ticks)) < 1e-9
