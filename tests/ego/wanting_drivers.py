"""Drivers that want more than the plain observation, as classes and compiled."""

import numpy as np

from bridgegen.drivers.compiled import compiled_driver


def pursued(o):
    dx, dy = o.route[:, 3, 0] - o.x, o.route[:, 3, 1] - o.y
    left = dy * np.cos(o.h) - dx * np.sin(o.h)
    return 2.0 * left / np.maximum(dx * dx + dy * dy, 1.0)


class Lanes:
    """Drives as fast as all that it knows of the lanes adds up to."""

    wants = ("lanes",)

    def reset(self, n, scene): ...

    def act(self, o):
        lanes = o.lanes
        asked = np.minimum(lanes.speed_limit[:, 5], 30.0) + lanes.width[:, 7]
        asked = asked + lanes.junction[:, 9] + 0.1 * lanes.beside[:, 3].sum(axis=(1, 2))
        asked = asked + 0.01 * lanes.ends + 0.001 * lanes.goal.sum(axis=1)
        asked = asked + np.minimum(lanes.stop_sign, 9.0) + np.minimum(lanes.crosswalk, 9.0)[:, 0]
        return 0.2 * (asked - o.v), np.zeros(len(o.x))


@compiled_driver(wants=("lanes",))
def lanes(scene, ego, route, tracks, memory, lanes):
    beside = 0.0
    for i in range(2):
        for j in range(4):
            beside += lanes.beside[3, i, j]
    asked = min(lanes.speed_limit[5], 30.0) + lanes.width[7]
    asked += lanes.junction[9] + 0.1 * beside
    asked += 0.01 * lanes.ends + 0.001 * (lanes.goal[0] + lanes.goal[1] + lanes.goal[2])
    asked += min(lanes.stop_sign, 9.0) + min(lanes.crosswalk[0], 9.0)
    return 0.2 * (asked - ego.v), 0.0


class WantsWrong(Lanes):
    wants = ("lanes", "mop")


class WantsAString(Lanes):
    wants = "lanes"


class All:
    """Drives as fast as all that it knows adds up to."""

    wants = ("lanes", "map", "conflicts", "history")

    def reset(self, n, scene):
        self.scene = scene

    def act(self, o):
        asked = 0.1 * (o.map.near[:, :9] % 7).sum(axis=1) + o.map.lane % 5
        asked = asked + np.nan_to_num(np.clip(o.conflicts.zones, -9.0, 9.0)).sum(axis=(1, 2, 3))
        asked = asked + 0.1 * o.history[:, :, 7, 4].sum(axis=1)
        limits = [
            self.scene.maps[m].pieces[near[3], 5, 2]
            for m, near in zip(self.scene.map_of, o.map.near, strict=True)
        ]
        asked = asked + np.array(limits) + o.map.lights.sum(axis=1)
        # Rounded: another order of the sum must not decide which of two pieces is nearer.
        return 1e-6 * np.rint(2e5 * (asked - o.v)), np.zeros(len(o.x))


@compiled_driver(wants=("history", "map", "conflicts"))
def everything(scene, ego, route, tracks, memory, history, pieces, place, lights, conflicts):
    asked = float(place.lane % 5)
    for i in range(9):
        asked += 0.1 * (place.near[i] % 7)
    for one in conflicts:
        for way in one:
            for value in (
                way.enter, way.leave, way.other_enter, way.other_leave, way.priority, way.how,
            ):  # fmt: skip
                if value == value:
                    asked += min(max(value, -9.0), 9.0)
    for one in history:
        asked += 0.1 * one[7].vx
    asked += pieces[place.near[3]].points[5, 2]
    for light in lights:
        asked += light
    return 1e-6 * np.rint(2e5 * (asked - ego.v)), 0.0
