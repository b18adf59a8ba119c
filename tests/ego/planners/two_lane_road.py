"""A road for the tests of planners: two lanes one way, one back; straight, or an arc."""

import numpy as np

from bridgegen.drivers.interface import Lane, Lanes, Observation, RoadMap, Scene

WIDTH = 3.5
LENGTH = 400.0
BODY = {"length": 4.6, "width": 1.9, "centre": 1.4}


def along(s: np.ndarray, offset: float, curvature: float) -> np.ndarray:
    """Return x, y, heading at stations of a path from the origin along +x, offset to the left."""
    h = s * curvature
    if curvature:
        x, y = np.sin(h) / curvature, (1.0 - np.cos(h)) / curvature
    else:
        x, y = s, 0.0 * s
    return np.stack([x - offset * np.sin(h), y + offset * np.cos(h), h], axis=1)


def lane(name: str, offset: float, curvature: float, *, back: bool = False, **what) -> Lane:
    s = np.arange(-20.0, LENGTH, 2.0)
    parts = [along(s, offset + side, curvature) for side in (0.0, WIDTH / 2, -WIDTH / 2)]
    centre, left, right = parts
    if back:
        turned = np.array([0.0, 0.0, np.pi])
        centre, left, right = centre[::-1] + turned, right[::-1], left[::-1]
    given = {"left_lane": "", "right_lane": "", "left_is_same_way": True, "next": (), **what}
    return Lane(
        id=name, kind="driving", centre=centre, left=left[:, :2], right=right[:, :2],
        speed_limit=np.full(len(s), np.inf), junction="", previous=(),
        right_is_same_way=True, left_marking="broken", right_marking="broken",
        may_change_left=True, may_change_right=True, **given,
    )  # fmt: skip


def road_map(curvature: float = 0.0) -> RoadMap:
    """Return the road; the route is its right lane."""
    none = np.zeros((0, 11, 3))
    indices = np.zeros(0, dtype=np.int64)
    return RoadMap(
        lanes=(
            lane("1:0:-2", 0.0, curvature, left_lane="1:0:-1"),
            lane("1:0:-1", WIDTH, curvature, right_lane="1:0:-2", left_lane="1:0:1",
                 left_is_same_way=False),
            lane("1:0:1", 2 * WIDTH, curvature, back=True, left_lane="1:0:-1",
                 left_is_same_way=False),
        ),
        route=("1:0:-2",), crosswalks=(), lights=(), pieces=none, piece_points=indices,
        piece_kind=indices.astype(np.int8), piece_lane=indices, piece_light=indices,
        piece_marking=indices.astype(np.int8),
    )  # fmt: skip


def scene(n: int, curvature: float = 0.0) -> Scene:
    return Scene(
        time_step=0.05, n_steps=400, names=("other",), kinds=np.zeros(1, dtype=np.int64), **BODY,
        max_speed=50.0, max_acceleration=3.0, max_deceleration=9.0, max_curvature=0.2,
        maps=(road_map(curvature),), map_of=np.zeros(n, dtype=np.int64),
    )  # fmt: skip


def track(x: float, y: float, h: float = 0.0, v: float = 0.0, kind: int = 0) -> np.ndarray:
    """Return a confirmed track of a car's size."""
    out = np.zeros(13)
    out[:9] = (2.0, x, y, h, v * np.cos(h), v * np.sin(h), 4.5, 1.8, kind)
    return out


def observation(
    *rows: tuple[float, float, float],
    curvature: float = 0.0,
    tracks=None,
    time: float = 0.0,
    a=None,
) -> Observation:
    """Return what an ego sees in rows of (station, offset, speed), parallel to the road.

    Args:
        rows: one for each scenario.
        curvature: of the road [1/m].
        tracks: ``(N, M, 13)``; by default one that is absent.
        time: [s].
        a: ``(N,)`` [m/s²].
    """
    n = len(rows)
    station, offset, speed = np.array(rows, dtype=np.float64).T
    places = np.stack([along(s + np.arange(40) * 2.0, 0.0, curvature) for s in station])
    route = np.concatenate([places, np.full((n, 40, 1), curvature)], axis=2)
    h = route[:, 0, 2]
    beside = np.zeros((n, 40, 2, 4))
    beside[:, :, 0] = (WIDTH, WIDTH, 1.0, 1.0)
    lanes = {
        "speed_limit": np.full((n, 40), np.inf), "width": np.full((n, 40), WIDTH),
        "junction": np.zeros((n, 40), dtype=np.bool_), "beside": beside,
        "ends": LENGTH - station, "goal": np.zeros((n, 3)),
        "stop_sign": np.full(n, np.inf), "crosswalk": np.full((n, 4), np.inf),
    }  # fmt: skip
    return Observation(
        time=time, running=np.ones(n, dtype=np.bool_),
        x=route[:, 0, 0] - offset * np.sin(h), y=route[:, 0, 1] + offset * np.cos(h), h=h,
        v=speed, a=np.zeros(n) if a is None else a, target_speed=np.full(n, 15.0),
        offset=offset, route=route,
        tracks=np.zeros((n, 1, 13)) if tracks is None else tracks,
        stop_distance=np.full(n, np.inf), light=np.zeros(n, dtype=np.int8),
        lanes=Lanes(**lanes),
    )  # fmt: skip
