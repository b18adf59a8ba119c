"""SUMO's car-following models as drivers: Krauss, EIDM, ACC and CACC, with the lane changes LC2013.

Each row has a straight road of its own in one simulation of SUMO (`_sumo_road`). At every instant
all vehicles are put where they are, SUMO makes one step, and the ego's next speed is read: it is
the acceleration. If SUMO has put the ego on the lane beside, that lane is its goal: the course
there is ours, a quintic with 1 m/s² of lateral acceleration (`bridgegen.drivers._path_kernels`)
that pure pursuit follows. In SUMO a vehicle is on one lane, here that of its centre, or on two
while it changes lane. So the model also follows what is ahead on the lane that the ego's body is
leaving, and bodies that reach into the ego's lane from another one or from beside the road. At a
red light, and at a yellow one if it can, it is asked for its speed to stop.

All settings are SUMO's own, unless others are given (``tunable``), but random numbers are off
(``sigma``, ``speedDev`` and EIDM's errors are 0), so that a row depends on that row alone. What
crosses the road is a vehicle on it only while it is there; oncoming ones stand.

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

from collections.abc import Sequence
from importlib import import_module
from types import MappingProxyType
from typing import ClassVar

import numpy as np

from bridgegen.adapters.planners import _sumo_simulation as simulation
from bridgegen.adapters.planners._corridor import Corridor
from bridgegen.adapters.planners._sumo_road import Arrays, Eyes, Seen, StraightRoad, network_text
from bridgegen.adapters.planners._sumo_script import SCRIPT
from bridgegen.adapters.planners._sumo_simulation import MODELS, Simulation, types_text
from bridgegen.base.physics import GRAVITY
from bridgegen.drivers._path_kernels import aside_at, shift_length
from bridgegen.drivers._route_follower_kernels import preview
from bridgegen.drivers.interface import Control, Observation, Scene
from bridgegen.drivers.planners import Planner, require

PLANNERS = tuple(
    Planner(
        name=f"sumo:{model}",
        description=f"{what}, with LC2013's lane changes; steering is ours.",
        spec=f"bridgegen.adapters.planners.sumo:{model}Driver",
        requires=("libsumo==1.28.0",),
        licence="EPL-2.0",
        source="https://eclipse.dev/sumo",
        domain=frozenset({"motorway", "road"}),
    )
    for model, what in MODELS.items()
)
KRAUSS, EIDM, ACC, CACC = PLANNERS  # as pyproject.toml's entry points name them


class SumoDriver:
    """Drives by one model in one simulation of SUMO, which a process has once.

    Attributes:
        model: of `MODELS`.

    Raises:
        InputError: libsumo is not installed, or in another version.
    """

    wants = ("map",)
    tunable: ClassVar = simulation.OF_ALL
    settings: simulation.Settings = MappingProxyType({})
    model: str

    def __init__(self) -> None:
        planner = next(item for item in PLANNERS if item.name == f"sumo:{self.model}")
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
        edges, network = [len(item.lanes) for item in self._roads], network_text(self._roads)
        self._simulation = Simulation(self.model, network, edges, scene, self.settings)
        self._rows = [Row(road) for road in self._roads]

    def act(self, observation: Observation) -> Control:
        """See `BatchDriver`."""
        o, scene = observation, self._scene
        rows = np.flatnonzero(o.running).tolist()
        # All rows are placed before the one step: a process has one simulation of SUMO, in which
        # each row's road stands beside the others'.
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

    tunable: ClassVar = simulation.OF_ALL | simulation.OF_EIDM
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
        # SUMO says which lane, not how to get there: it has no course between lanes that a body
        # could follow.
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


def export(observations: Sequence[Observation], scene: Scene) -> Arrays:
    """Return the planner's inputs in one row, see above.

    Args:
        observations: of that row alone, one for each instant.
        scene: of the batch that they are of.
    """
    road = StraightRoad(Corridor(scene.maps[scene.map_of[0]]))
    eyes = Eyes(road, scene)
    seen = [eyes.see(observation, 0) for observation in observations]
    return {
        "network": np.array(network_text([road])),
        "types": np.array(types_text(scene.length, scene.width, {})),
        "route": np.array(" ".join(f"r0e{k}" for k in range(len(road.lanes)))),
        "time_step": np.array(scene.time_step),
        "lanes": road.lanes,
        "next": road.next,
        "ego": np.stack([item.ego for item in seen]),
        "others": np.stack([item.others for item in seen]),
        "ahead": np.stack([item.ahead for item in seen]),
        "stop": np.array([item.stop for item in seen]),
    }


def reproduction(observations_path: str) -> str:
    """Return a script that prints the planner's commands in an exported row, by libsumo alone.

    It takes the model's name as its argument, Krauss by default. One line for each instant:
    acceleration [m/s²] and the lane that SUMO wants the ego on, counted from the left.
    """
    return SCRIPT.replace("OBSERVATIONS", repr(observations_path))
