"""SUMO's one simulation of a process: vehicles are placed, it makes a step, the ego is asked."""

import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from bridgegen.adapters.planners._sumo_road import (
    DECELERATION,
    PARKED,
    PARKING_SPACE,
    Seen,
    StraightRoad,
)
from bridgegen.base.arrays import Int
from bridgegen.base.errors import InputError
from bridgegen.drivers.interface import Scene

MODELS = {
    "Krauss": "SUMO's default model (Krauß 1998)",
    "EIDM": "SUMO's extended IDM",
    "ACC": "SUMO's adaptive cruise control (Milanés, Shladover 2014)",
    "CACC": "SUMO's cooperative ACC; as nobody ahead is a CACC vehicle, cruise control from a time "
    "gap of 1.5 to 2 s on, its ACC below",
}
"""Descriptions of SUMO's car-following models by name."""

MIN_GAP = 2.5
"""Least gap between vehicles [m]; SUMO's ``minGap`` of all vehicles."""

EMERGENCY = 9.0
"""Largest deceleration of passenger cars [m/s²]; SUMO's ``emergencyDecel``."""

Settings = Mapping[str, float]

Numbers = dict[str, tuple[float | str, ...]]

OF_ALL: Numbers = {
    "tau": (1.0, 0.5, 3.0, "s"),
    "minGap": (MIN_GAP, 1.0, 6.0, "m"),
    "accel": (2.6, 1.0, 3.5, "m/s²"),
    "decel": (4.5, 2.0, 6.0, "m/s²"),
    "emergencyDecel": (EMERGENCY, 6.0, 9.0, "m/s²"),
}
"""The numbers of a vehicle type that may be set, by SUMO's names: its defaults for passenger cars,
and ranges, which SUMO does not state: these are ours."""

OF_EIDM: Numbers = {
    "tpreview": (4.0, 1.0, 8.0, "s"),
    "treaction": (0.5, 0.0, 1.5, "s"),
    "ccoolness": (0.99, 0.0, 1.0),
    "jerkmax": (3.0, 1.0, 10.0, "m/s³"),
    "epsilonacc": (1.0, 0.5, 3.0, "m/s²"),
}
"""Those that EIDM has besides; not ``stepping``, which changes nothing in steps below 0.25 s."""


class Simulation:
    """SUMO's one simulation of a process, with a road for each of N rows.

    Args:
        model: of `MODELS`.
        network: of all rows' roads.
        edges: how many each has.
        scene: of the batch.
        settings: of the ego's type; what is left out has SUMO's default.

    Raises:
        InputError: the time step is no whole number of milliseconds.
    """

    def __init__(
        self, model: str, network: str, edges: Sequence[int], scene: Scene, settings: Settings
    ) -> None:
        import libsumo

        milliseconds = 1000.0 * scene.time_step
        if abs(milliseconds - round(milliseconds)) > 1e-6 or round(milliseconds) < 1:
            raise InputError(
                "SUMO's time step must be a whole number of milliseconds, got "
                f"{scene.time_step:g} s"
            )
        self._sumo, self._scene, self._settings = libsumo, scene, settings
        self._away: dict[str, bool] = {}
        self._lengths: dict[str, float] = {}
        self._last = [n - 1 for n in edges]
        with tempfile.TemporaryDirectory() as folder:
            net, types = Path(folder, "road.net.xml"), Path(folder, "types.add.xml")
            net.write_text(network)
            types.write_text(types_text(scene.length, scene.width, settings))
            options = [
                *("-n", str(net), "-a", str(types), "--step-length", f"{scene.time_step:g}"),
                # SUMO would take vehicles away that collide or wait for long; here they stay, as
                # the scenario has them.
                *("--collision.action", "none", "--time-to-teleport", "-1"),
                *("--no-internal-links", "--no-step-log", "--no-warnings"),
            ]
            # libsumo holds one simulation a process, in global variables; another one is loaded
            # over it.
            if libsumo.isLoaded():
                libsumo.load(options)
            else:
                libsumo.start(["sumo", *options])
        for r, n in enumerate(edges):
            libsumo.route.add(f"r{r}", [f"r{r}e{k}" for k in range(n)])
            libsumo.vehicle.add(f"r{r}ego", f"r{r}", typeID=model)
            for j in range(len(scene.names)):
                libsumo.vehicle.add(f"r{r}o{j}", f"r{r}", typeID="other")
                self._park(r, j)
                # No rules of SUMO's for the others: they are put where the scenario has them, at
                # each instant.
                libsumo.vehicle.setSpeedMode(f"r{r}o{j}", 0)
                libsumo.vehicle.setLaneChangeMode(f"r{r}o{j}", 0)

    def place(self, r: int, seen: Seen, goal: int, road: StraightRoad) -> None:
        """Put the vehicles of a row where they are."""
        vehicle = self._sumo.vehicle
        edge, position, speed, acceleration, most, _ = seen.ego.tolist()
        ego = f"r{r}ego"
        vehicle.moveTo(ego, _lane(r, int(edge), goal, road.lanes), position)
        vehicle.setMaxSpeed(ego, most)
        # `moveTo` alone would leave SUMO's own speed of the step before, and models look at how
        # speed changes.
        vehicle.setPreviousSpeed(ego, speed, acceleration)
        for j, (there, edge, position, lane, speed, change, length) in enumerate(
            seen.others.tolist()
        ):
            other = f"r{r}o{j}"
            if not there:
                if not self._away[other]:
                    self._park(r, j)
                continue
            self._away[other] = False
            if self._lengths.get(other) != length:
                self._lengths[other] = length
                vehicle.setLength(other, length)
            vehicle.moveTo(other, _lane(r, int(edge), int(lane), road.lanes), position)
            vehicle.setPreviousSpeed(other, speed, change)
            vehicle.setSpeed(other, speed)

    def step(self) -> None:
        """Let SUMO make one step."""
        self._sumo.simulationStep()

    def command(self, r: int, seen: Seen, goal: int, road: StraightRoad) -> tuple[float, int]:
        """Return the ego's next speed [m/s], and the lane that SUMO wants it on, from the left."""
        vehicle, ego = self._sumo.vehicle, f"r{r}ego"
        n = int(road.lanes[int(seen.ego[0])])
        now = seen.ego[2]
        speed = vehicle.getSpeed(ego)
        wish = goal
        # Having moved to the next edge within the step, its lane there says nothing of a change.
        if vehicle.getRoadID(ego) == f"r{r}e{int(seen.ego[0])}":
            wish = n - 1 - vehicle.getLaneIndex(ego)
        hardest = self._settings.get("emergencyDecel", EMERGENCY)
        least = max(now - hardest * self._scene.time_step, 0.0)
        for lane, ahead in enumerate(seen.ahead.tolist()):
            gap, of, j = ahead[3:] if lane == goal else ahead[:3]
            if np.isfinite(gap):
                # Without its name, CACC ignores the leader and keeps its speed.
                other = f"r{r}o{int(j)}"
                free = gap - self._settings.get("minGap", MIN_GAP)
                follow = vehicle.getFollowSpeed(ego, now, free, of, DECELERATION, other)
                speed = min(speed, max(follow, least))
        if np.isfinite(seen.stop):
            speed = min(speed, max(vehicle.getStopSpeed(ego, now, seen.stop), least))
        return float(speed), wish

    def _park(self, r: int, j: int) -> None:
        other = f"r{r}o{j}"
        self._away[other] = True
        position = PARKED + PARKING_SPACE * j
        self._sumo.vehicle.moveTo(other, f"r{r}e{self._last[r]}_0", position)
        self._sumo.vehicle.setPreviousSpeed(other, 0.0)
        self._sumo.vehicle.setSpeed(other, 0.0)


def _lane(r: int, edge: int, lane: int, lanes: Int) -> str:
    """Return SUMO's id of a lane that is counted from the left."""
    return f"r{r}e{edge}_{int(lanes[edge]) - 1 - lane}"


def types_text(length: float, width: float, settings: Settings) -> str:
    """Return the vehicle types, as the text of an additional file of SUMO.

    Args:
        length: of the ego [m].
        width: of the ego [m].
        settings: of the ego's type.
    """
    default = OF_ALL | OF_EIDM
    of = "".join(f' {k}="{value!r}"' for k, value in settings.items() if value != default[k][0])
    errors = {"EIDM": ' sigmaleader="0" sigmagap="0" sigmaerror="0"'}
    egos = "".join(
        f'<vType id="{model}" carFollowModel="{model}" sigma="0" speedDev="0" '
        f'length="{length!r}" width="{width!r}"{errors.get(model, "")}{of}/>\n'
        for model in MODELS
    )
    return f'<additional>\n{egos}<vType id="other" sigma="0" speedDev="0"/>\n</additional>\n'
