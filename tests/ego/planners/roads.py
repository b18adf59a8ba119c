"""Roads, observations and a small world for the tests of planners that drive on lanes."""

import numpy as np

from bridgegen.drivers.interface import (
    PIECE_POINTS,
    ROUTE_POINTS,
    ROUTE_STEP,
    Control,
    Lane,
    Observation,
    RoadMap,
    Scene,
)

DT, LENGTH, WIDTH, CENTRE = 0.05, 4.6, 1.9, 1.4
LANE_WIDTH = 3.5


def lane_name(section: int, lane: int) -> str:
    return f"road:{section}:{lane}"


def road_map(
    counts=(2,),
    length=600.0,
    curvature=0.0,
    route=0,
    limit=np.inf,
    marking="broken",
    keep=None,
    turn=0.0,
) -> RoadMap:
    """Return a road of several sections, each with so many lanes from the left, of one curvature.

    Args:
        counts: lanes of each section; the lane i goes on as the lane i.
        length: of each section [m].
        curvature: of the leftmost lane's centre [1/m].
        route: the lane that the route is on.
        limit: speed limit [m/s].
        marking: between lanes.
        keep: sections that the route has; all by default.
        turn: rotates the whole road [rad].
    """
    lanes = []
    for k, n in enumerate(counts):
        s = np.linspace(k * length, (k + 1) * length, int(length / 2.0) + 1)
        h = curvature * s + turn
        for i in range(n):
            d = -LANE_WIDTH * i

            def at(offset, s=s, h=h):
                if curvature == 0.0:
                    x, y = s, 0.0 * s
                else:
                    x, y = (
                        np.sin(curvature * s) / curvature,
                        (1 - np.cos(curvature * s)) / curvature,
                    )
                c, q = np.cos(turn), np.sin(turn)
                x, y = c * x - q * y, q * x + c * y
                return np.stack([x - offset * np.sin(h), y + offset * np.cos(h)], axis=1)

            leads = (lane_name(k + 1, i),) if k + 1 < len(counts) and i < counts[k + 1] else ()
            leaves = (lane_name(k - 1, i),) if k > 0 and i < counts[k - 1] else ()
            lanes.append(
                Lane(
                    id=lane_name(k, i),
                    kind="driving",
                    centre=np.column_stack([at(d), h]),
                    left=at(d + LANE_WIDTH / 2),
                    right=at(d - LANE_WIDTH / 2),
                    speed_limit=np.full(len(s), limit),
                    junction="",
                    next=leads,
                    previous=leaves,
                    left_lane=lane_name(k, i - 1) if i > 0 else "",
                    right_lane=lane_name(k, i + 1) if i + 1 < n else "",
                    left_is_same_way=i > 0,
                    right_is_same_way=i + 1 < n,
                    left_marking=marking,
                    right_marking=marking,
                    may_change_left=i > 0 and marking == "broken",
                    may_change_right=i + 1 < n and marking == "broken",
                )
            )
    on = range(len(counts)) if keep is None else keep
    return RoadMap(
        lanes=tuple(lanes),
        route=tuple(lane_name(k, route) for k in on),
        crosswalks=(),
        lights=(),
        pieces=np.zeros((0, PIECE_POINTS, 3)),
        piece_points=np.zeros(0, np.int64),
        piece_kind=np.zeros(0, np.int8),
        piece_lane=np.zeros(0, np.int64),
        piece_light=np.zeros(0, np.int64),
        piece_marking=np.zeros(0, np.int8),
    )


def scene(*maps: RoadMap, rows=None, n_others=1) -> Scene:
    """Return the scene of a batch whose rows have these maps, one each or as `rows` says."""
    return Scene(
        time_step=DT,
        n_steps=400,
        names=tuple(f"other{i}" for i in range(n_others)),
        kinds=np.zeros(n_others, dtype=np.int64),
        length=LENGTH,
        width=WIDTH,
        centre=CENTRE,
        max_speed=60.0,
        max_acceleration=5.0,
        max_deceleration=9.0,
        max_curvature=0.2,
        maps=maps,
        map_of=np.arange(len(maps)) if rows is None else np.array(rows),
    )


class World:
    """N scenarios of an ego and M others that hold their speeds and headings.

    Args:
        egos: ``(N, 4)`` x, y of the body's centre [m], heading [rad], speed [m/s].
        others: ``(N, M, 4)`` likewise.
        target: ``(N,)`` desired speeds [m/s].
    """

    def __init__(self, egos, others, target) -> None:
        self.ego = np.array(egos, dtype=np.float64)
        self.ego[:, 0] -= CENTRE * np.cos(self.ego[:, 2])
        self.ego[:, 1] -= CENTRE * np.sin(self.ego[:, 2])
        self.others = np.array(others, dtype=np.float64)
        self.target = np.array(target, dtype=np.float64)
        self.a = np.zeros(len(self.ego))
        self.time = 0.0
        self.stop = np.full(len(self.ego), np.inf)
        self.light = np.zeros(len(self.ego), np.int8)

    def observe(self) -> Observation:
        n, m = self.others.shape[:2]
        h, v = self.others[:, :, 2], self.others[:, :, 3]
        tracks = np.zeros((n, m, 13))
        tracks[:, :, 0] = 2.0
        tracks[:, :, 1:4] = self.others[:, :, :3]
        tracks[:, :, 4], tracks[:, :, 5] = v * np.cos(h), v * np.sin(h)
        tracks[:, :, 6], tracks[:, :, 7] = LENGTH, WIDTH
        route = np.zeros((n, ROUTE_POINTS, 4))
        route[:, :, 0] = self.ego[:, :1] + ROUTE_STEP * np.arange(ROUTE_POINTS)
        return Observation(
            time=self.time,
            running=np.ones(n, dtype=np.bool_),
            x=self.ego[:, 0].copy(),
            y=self.ego[:, 1].copy(),
            h=self.ego[:, 2].copy(),
            v=self.ego[:, 3].copy(),
            a=self.a.copy(),
            target_speed=self.target,
            offset=np.zeros(n),
            route=route,
            tracks=tracks,
            stop_distance=self.stop.copy(),
            light=self.light.copy(),
        )

    def move(self, control: Control) -> None:
        """Move all by one step: the ego's rear axle goes on an arc."""
        a, bend = np.asarray(control.acceleration), np.asarray(control.curvature)
        v = self.ego[:, 3]
        end = np.maximum(v + a * DT, 0.0)
        way = 0.5 * (v + end) * DT
        middle = self.ego[:, 2] + 0.5 * bend * way
        self.ego[:, 0] += way * np.cos(middle)
        self.ego[:, 1] += way * np.sin(middle)
        self.ego[:, 2] += bend * way
        self.a = (end - v) / DT
        self.ego[:, 3] = end
        speed = self.others[:, :, 3]
        self.others[:, :, 0] += speed * np.cos(self.others[:, :, 2]) * DT
        self.others[:, :, 1] += speed * np.sin(self.others[:, :, 2]) * DT
        self.stop -= way
        self.time += DT


def drive(driver, world: World, scene: Scene, seconds: float):
    """Return the observations and the commands ``(T, N, 2)`` of a drive."""
    driver.reset(len(world.ego), scene)
    seen, commands = [], []
    for _ in range(round(seconds / DT)):
        observation = world.observe()
        control = driver.act(observation)
        seen.append(observation)
        commands.append(np.stack([control.acceleration, control.curvature], axis=-1))
        world.move(control)
    return seen, np.array(commands)
