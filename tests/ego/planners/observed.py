"""A straight road along +x with two lanes of one way, and what a driver in the right one sees."""

from dataclasses import replace

import numpy as np

from bridgegen.drivers import kinds
from bridgegen.drivers.interface import (
    PIECE_POINTS,
    ROUTE_POINTS,
    ROUTE_STEP,
    Lane,
    Light,
    MapView,
    Observation,
    RoadMap,
    Scene,
)

DT, WIDTH, LENGTH = 0.05, 3.5, 600.0
BODY_LENGTH, BODY_WIDTH, CENTRE = 4.6, 1.9, 1.4

RIGHT, LEFT = "1:0:-2", "1:0:-1"


def lane(name, y, kind="driving", **said):
    x = np.arange(0.0, LENGTH + 1.0, 2.0)
    zero = np.zeros_like(x)
    usual = {
        "junction": "", "next": (), "previous": (), "left_lane": "", "right_lane": "",
        "left_is_same_way": False, "right_is_same_way": False, "left_marking": "broken",
        "right_marking": "broken", "may_change_left": False, "may_change_right": False,
    }  # fmt: skip
    return Lane(
        name, kind, np.stack([x, zero + y, zero], 1), np.stack([x, zero + y + WIDTH / 2], 1),
        np.stack([x, zero + y - WIDTH / 2], 1), zero + 36.0, **(usual | said),
    )  # fmt: skip


def road_map(may_change=True, lights=()):
    lanes = (
        lane("1:0:-3", -WIDTH, "shoulder"),
        lane(RIGHT, 0.0, left_lane=LEFT, left_is_same_way=True, may_change_left=may_change),
        lane(LEFT, WIDTH, right_lane=RIGHT, right_is_same_way=True, may_change_right=may_change),
    )
    none = np.zeros(0, dtype=np.int64)
    return RoadMap(
        lanes, (RIGHT,), (), tuple(lights), np.zeros((0, PIECE_POINTS, 3)), none,
        none.astype(np.int8), none, none, none.astype(np.int8),
    )  # fmt: skip


def light(station):
    stop = np.array([[station, -WIDTH / 2], [station, 1.5 * WIDTH]])
    return Light("9", (RIGHT, LEFT), stop)


def scene(n=1, m=1, road=None):
    return Scene(
        DT, 400, tuple(f"other{j}" for j in range(m)), np.full(m, kinds.CAR), BODY_LENGTH,
        BODY_WIDTH, CENTRE, 60.0, 4.0, 9.0, 0.2, (road or road_map(),), np.zeros(n, np.int64),
    )  # fmt: skip


def track(x=60.0, y=0.0, vx=20.0, vy=0.0, state=2, kind=kinds.CAR, h=0.0):
    return np.array([state, x, y, h, vx, vy, 4.6, 1.9, kind, 1.0, 0.0, 2.0, 0.0])


def observation(tracks, *, x=0.0, y=0.0, h=0.0, v=25.0, a=0.0, target=30.0, time=0.0, state=4):
    """Return one row; ``state`` is that of the lights."""
    route = np.zeros((1, ROUTE_POINTS, 4))
    route[0, :, 0] = x + ROUTE_STEP * np.arange(ROUTE_POINTS)
    one = np.ones(1)
    view = MapView(np.ones(1, np.int64), np.zeros((1, 0), np.int32), np.full((1, 1), state, "i1"))
    return Observation(
        time, np.ones(1, bool), one * x, one * y, one * h, one * v, one * a, one * target, one * y,
        route, np.array(tracks).reshape(1, -1, 13), one * np.inf, np.zeros(1, np.int8),
        map=view,
    )  # fmt: skip


def together(rows):
    """Return observations of one row each as one of all rows."""

    def joined(parts):
        found = {}
        for name, value in vars(parts[0]).items():
            values = [getattr(part, name) for part in parts]
            if isinstance(value, np.ndarray):
                found[name] = np.concatenate(values)
            elif isinstance(value, MapView):
                found[name] = joined(values)
        return replace(parts[0], **found)

    return joined(rows)


def drive(driver, told, n_steps, *, v=25.0, target=30.0, state=lambda time: 4, **said):
    """Let a driver drive alone; return its observations and commands ``(T, 2)``.

    Args:
        driver: it.
        told: returns the tracks at a time.
        n_steps: instants.
        v: its first speed.
        target: its target speed.
        state: returns that of the lights at a time.
        said: of `scene`.
    """
    driver.reset(1, scene(m=len(told(0.0)), **said))
    x, y, h, a, seen, commands = 0.0, 0.0, 0.0, 0.0, [], []
    for k in range(n_steps):
        now = {"time": k * DT, "state": state(k * DT)}
        seen.append(observation(told(k * DT), x=x, y=y, h=h, v=v, a=a, target=target, **now))
        demanded = driver.act(seen[-1])
        a, bend = float(demanded.acceleration[0]), float(demanded.curvature[0])
        commands.append((a, bend))
        x, y, h = x + v * np.cos(h) * DT, y + v * np.sin(h) * DT, h + v * bend * DT
        v = max(0.0, v + a * DT)
    return seen, np.array(commands)
