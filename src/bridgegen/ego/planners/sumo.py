"""SUMO's car-following models as drivers: Krauss, EIDM, ACC and CACC, with the lane changes LC2013.

Each row has a straight road of its own in one simulation of SUMO (`_sumo_road`). At every instant
all vehicles are put where they are, SUMO makes one step, and the ego's next speed is read: it is
the acceleration. If SUMO has put the ego on the lane beside, that lane is its goal: the course
there is ours, a quintic with 1 m/s² of lateral acceleration (`bridgegen.ego._shift_kernels`) that
pure pursuit follows. In SUMO a vehicle is on one lane, here that of its centre, or on two while it
changes lane. So the model also follows what is ahead on the lane that the ego's body is leaving,
and bodies that reach into the ego's lane from another one or from beside the road. At a red light,
and at a yellow one if it can, it is asked for its speed to stop.

All settings are SUMO's own, but random numbers are off (``sigma``, ``speedDev`` and EIDM's errors
are 0), so that a row depends on that row alone. What crosses the road is a vehicle on it only while
it is there; oncoming ones stand.

CACC needs a leader that is a CACC vehicle and sends its acceleration; no other participant is one.
So it keeps its desired speed above a time gap of 2 s, follows by ACC's law (headway 1 s) below
1.5 s, and goes on as before between them; only 2 m/s above Krauss' safe speed it brakes for safety.
SUMO scales its accelerations as for steps of 0.1 s: at 0.05 s they are halved.

`export` makes these arrays of one row, over T instants, M others, S edges, L lanes at most:

- ``network``: the text of the ``.net.xml``; ``types``: of the vehicle types; ``route``: the ids of
  the edges, parted by spaces; ``time_step`` [s];
- ``lanes`` ``(S,)`` and ``next`` ``(S, L)``: see `StraightRoad`;
- ``ego`` ``(T, 6)``, ``others`` ``(T, M, 7)``, ``ahead`` ``(T, L, 6)``, ``stop`` ``(T,)``: see
  `Seen`.

Source: Lopez et al., Microscopic Traffic Simulation using SUMO, ITSC 2018; Krauß, Microscopic
Modeling of Traffic Flow, DLR-FB 98-08, 1998; Salles, Kaufmann, Reuss, SUMO Conf. Proc. 1 (2020),
EIDM; Milanés, Shladover, Transp. Res. C 48 (2014) 285, ACC and CACC; Erdmann, LC2013, 2014.
"""

import tempfile
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path

import numpy as np

from bridgegen.arrays import Int
from bridgegen.ego._route_follower_kernels import preview
from bridgegen.ego._shift_kernels import aside_at, shift_length
from bridgegen.ego.interface import Control, Observation, Scene
from bridgegen.ego.planners._corridor import Corridor
from bridgegen.ego.planners._sumo_road import (
    DECELERATION,
    PARKED,
    PARKING_SPACE,
    Arrays,
    Eyes,
    Seen,
    StraightRoad,
    network_text,
)
from bridgegen.ego.planners._sumo_script import SCRIPT
from bridgegen.ego.planners.planner import Planner
from bridgegen.ego.planners.registry import require
from bridgegen.errors import InputError
from bridgegen.physics import GRAVITY

MODELS = {
    "Krauss": "SUMO's default model (Krauß 1998)",
    "EIDM": "SUMO's extended IDM",
    "ACC": "SUMO's adaptive cruise control (Milanés, Shladover 2014)",
    "CACC": "SUMO's cooperative ACC; as nobody ahead is a CACC vehicle, cruise control from a time "
    "gap of 1.5 to 2 s on, its ACC below",
}
"""The car-following models."""

PLANNERS = tuple(
    Planner(
        name=f"sumo:{model}",
        description=f"{what}, with LC2013's lane changes; steering is ours.",
        spec=f"bridgegen.ego.planners.sumo:{model}Driver",
        requires=("libsumo==1.28.0",),
        licence="EPL-2.0",
        source="https://eclipse.dev/sumo",
        domain=frozenset({"motorway", "road"}),
    )
    for model, what in MODELS.items()
)

MIN_GAP = 2.5
"""m, SUMO's ``minGap`` of all vehicles."""

EMERGENCY = 9.0
"""m/s², SUMO's ``emergencyDecel`` of passenger cars."""


class SumoDriver:
    """Drives by one model in one simulation of SUMO, which a process has once.

    Attributes:
        model: of `MODELS`.

    Raises:
        InputError: libsumo is not installed, or in another version.
    """

    wants = ("map",)
    model: str

    def __init__(self) -> None:
        planner = next(one for one in PLANNERS if one.name == f"sumo:{self.model}")
        require(planner)
        import_module("libsumo")  # seconds that no call's limit has

    def reset(self, n: int, scene: Scene) -> None:
        """See `BatchDriver`.

        Raises:
            InputError: a time step that is no whole number of milliseconds, or no route on lanes.
        """
        self._scene = scene
        roads = [StraightRoad(Corridor(road)) for road in scene.maps]
        self._roads = [roads[k] for k in scene.map_of[:n]]
        self._eyes = [Eyes(road, scene) for road in self._roads]
        self._simulation = Simulation(
            self.model, network_text(self._roads), [len(one.lanes) for one in self._roads], scene
        )
        self._rows = [Row(road) for road in self._roads]

    def act(self, observation: Observation) -> Control:
        """See `BatchDriver`."""
        o, scene = observation, self._scene
        rows = np.flatnonzero(o.running).tolist()
        seen = {i: self._eyes[i].see(o, i) for i in rows}
        for i in rows:
            self._rows[i].find_goal(seen[i])
            self._simulation.place(i, seen[i], self._rows[i].goal, self._roads[i])
        self._simulation.step()
        acceleration, curvature = np.zeros((2, len(o.x)))
        for i in rows:
            speed, goal = self._simulation.command(i, seen[i], self._rows[i].goal, self._roads[i])
            acceleration[i] = (speed - seen[i].ego[2]) / scene.time_step
            curvature[i] = self._rows[i].steer(seen[i], goal, o, i)
        return Control(acceleration, curvature)


class KraussDriver(SumoDriver):
    """Drives by SUMO's Krauss."""

    model = "Krauss"


class EIDMDriver(SumoDriver):
    """Drives by SUMO's EIDM."""

    model = "EIDM"


class ACCDriver(SumoDriver):
    """Drives by SUMO's ACC."""

    model = "ACC"


class CACCDriver(SumoDriver):
    """Drives by SUMO's CACC."""

    model = "CACC"


class Row:
    """Where one scenario's ego is to drive: the goal's lane, and the course to it."""

    def __init__(self, road: StraightRoad) -> None:
        self._road = road
        self._edge = -1
        self.goal = 0
        self._shift = (0.0, 0.0, 0.0, 0.0)

    def find_goal(self, seen: Seen) -> None:
        """Follow the goal's lane to the edge that the ego is on now."""
        edge, on = int(seen.ego[0]), int(seen.ego[5])
        if self._edge < 0 or edge < self._edge:
            self._edge, self.goal = edge, on
        while self._edge < edge:
            self.goal = int(self._road.next[self._edge, self.goal])
            self._edge += 1
            if self.goal < 0:
                self._edge, self.goal = edge, on

    def steer(self, seen: Seen, goal: int, o: Observation, i: int) -> float:
        """Return the curvature [1/m] of the course to a goal's lane."""
        s, v = float(seen.place[0]), float(o.v[i])
        if goal != self.goal:
            to, now = self._offset(goal, s), self._offset(self.goal, s) + aside_at(self._shift, s)
            length = shift_length(now - to, v, GRAVITY)
            self.goal, self._shift = goal, (now - to, 0.0, s, float(length))
        ahead = s + float(preview(v))
        x, y = self._road.corridor.point(
            ahead, self._offset(self.goal, ahead) + float(aside_at(self._shift, ahead))
        )
        dx, dy = x - o.x[i], y - o.y[i]
        left = dy * np.cos(o.h[i]) - dx * np.sin(o.h[i])
        return float(2.0 * left / max(dx * dx + dy * dy, 1e-6))

    def _offset(self, lane: int, s: float) -> float:
        """Return the offset [m] of the goal's lane at a station, which may be on a later edge."""
        edge, _ = self._road.edge_at(s)
        for k in range(self._edge, edge):
            leads = int(self._road.next[k, lane])
            if leads < 0:
                return self._road.section(k).lanes[lane].at(s)[0]
            lane = leads
        return self._road.section(max(edge, self._edge)).lanes[lane].at(s)[0]


class Simulation:
    """SUMO's one simulation of a process, with a road for each of N rows.

    Args:
        model: of `MODELS`.
        network: of all rows' roads.
        edges: how many each has.
        scene: of the batch.

    Raises:
        InputError: the time step is no whole number of milliseconds.
    """

    def __init__(self, model: str, network: str, edges: Sequence[int], scene: Scene) -> None:
        import libsumo

        milliseconds = 1000.0 * scene.time_step
        if abs(milliseconds - round(milliseconds)) > 1e-6 or round(milliseconds) < 1:
            raise InputError(
                "SUMO's time step must be a whole number of milliseconds, got "
                f"{scene.time_step:g} s"
            )
        self._sumo, self._scene = libsumo, scene
        self._away: dict[str, bool] = {}
        self._lengths: dict[str, float] = {}
        self._last = [n - 1 for n in edges]
        with tempfile.TemporaryDirectory() as folder:
            net, types = Path(folder, "road.net.xml"), Path(folder, "types.add.xml")
            net.write_text(network)
            types.write_text(types_text(scene.length, scene.width))
            options = [
                *("-n", str(net), "-a", str(types), "--step-length", f"{scene.time_step:g}"),
                *("--collision.action", "none", "--time-to-teleport", "-1"),
                *("--no-internal-links", "--no-step-log", "--no-warnings"),
            ]
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
                libsumo.vehicle.setSpeedMode(f"r{r}o{j}", 0)
                libsumo.vehicle.setLaneChangeMode(f"r{r}o{j}", 0)

    def place(self, r: int, seen: Seen, goal: int, road: StraightRoad) -> None:
        """Put the vehicles of a row where they are."""
        vehicle = self._sumo.vehicle
        edge, position, speed, acceleration, most, _ = seen.ego.tolist()
        ego = f"r{r}ego"
        vehicle.moveTo(ego, _lane(r, int(edge), goal, road.lanes), position)
        vehicle.setMaxSpeed(ego, most)
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
        if vehicle.getRoadID(ego) == f"r{r}e{int(seen.ego[0])}":
            wish = n - 1 - vehicle.getLaneIndex(ego)
        least = max(now - EMERGENCY * self._scene.time_step, 0.0)
        for lane, ahead in enumerate(seen.ahead.tolist()):
            gap, of, j = ahead[3:] if lane == goal else ahead[:3]
            if np.isfinite(gap):
                # CACC follows nobody whose name it is not told: it would keep its speed.
                other = f"r{r}o{int(j)}"
                follow = vehicle.getFollowSpeed(ego, now, gap - MIN_GAP, of, DECELERATION, other)
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


def types_text(length: float, width: float) -> str:
    """Return the vehicle types, as the text of an additional file of SUMO.

    Args:
        length: of the ego [m].
        width: of the ego [m].
    """
    errors = {"EIDM": ' sigmaleader="0" sigmagap="0" sigmaerror="0"'}
    egos = "".join(
        f'<vType id="{model}" carFollowModel="{model}" sigma="0" speedDev="0" '
        f'length="{length!r}" width="{width!r}"{errors.get(model, "")}/>\n'
        for model in MODELS
    )
    return f'<additional>\n{egos}<vType id="other" sigma="0" speedDev="0"/>\n</additional>\n'


def export(observations: Sequence[Observation], scene: Scene) -> Arrays:
    """Return the planner's inputs in one row, see above.

    Args:
        observations: of that row alone, one for each instant.
        scene: of the batch that they are of.
    """
    road = StraightRoad(Corridor(scene.maps[scene.map_of[0]]))
    eyes = Eyes(road, scene)
    seen = [eyes.see(one, 0) for one in observations]
    return {
        "network": np.array(network_text([road])),
        "types": np.array(types_text(scene.length, scene.width)),
        "route": np.array(" ".join(f"r0e{k}" for k in range(len(road.lanes)))),
        "time_step": np.array(scene.time_step),
        "lanes": road.lanes,
        "next": road.next,
        "ego": np.stack([one.ego for one in seen]),
        "others": np.stack([one.others for one in seen]),
        "ahead": np.stack([one.ahead for one in seen]),
        "stop": np.array([one.stop for one in seen]),
    }


def reproduction(observations_path: str) -> str:
    """Return a script that prints the planner's commands in an exported row, by libsumo alone.

    It takes the model's name as its argument, Krauss by default. One line for each instant:
    acceleration [m/s²] and the lane that SUMO wants the ego on, counted from the left.
    """
    return SCRIPT.replace("OBSERVATIONS", repr(observations_path))
