"""Where tracks will be if they keep their speed and follow their lane."""

import numpy as np

from bridgegen.base.arrays import Float
from bridgegen.drivers.interface import RoadMap

NEAR, ALIGNED = 2.0, np.pi / 6.0
"""Largest distance of a track from the centre of a lane that it follows [m], and largest angle
between their directions [rad]."""

SLOW = 0.5  # m/s; slower ones stay on their line


class AlongLanes:
    """Predicts on one road network: along the lane if one fits, else straight on.

    At a fork it takes the lane that turns least.

    Args:
        road_map: the network.
        kinds: OpenDRIVE's types of the lanes that are followed.
    """

    def __init__(self, road_map: RoadMap, kinds: frozenset[str]) -> None:
        lanes = [item for item in road_map.lanes if item.kind in kinds and len(item.centre) > 1]
        at = {lane.id: k for k, lane in enumerate(lanes)}
        self._centres = [lane.centre for lane in lanes]
        self._next = [[at[name] for name in lane.next if name in at] for lane in lanes]
        none = np.zeros((0, 3))
        self._points = np.concatenate([none, *self._centres])
        sizes = [len(centre) for centre in self._centres]
        self._lane = np.repeat(np.arange(len(lanes)), sizes)
        self._first = np.concatenate([[0], np.cumsum(sizes)]).astype(np.int64)

    def predict(self, tracks: Float, times: Float) -> Float:
        """Return where tracks will be.

        Args:
            tracks: ``(M, 13)``, see `Observation`; all of them are predicted.
            times: ``(K,)`` [s] from now on.

        Returns:
            ``(M, K, 3)``: x, y [m] of the box's centre, heading [rad].
        """
        out = np.empty((len(tracks), len(times), 3))
        for m, track in enumerate(tracks):
            x, y, h, vx, vy = track[1:6]
            out[m, :, 0], out[m, :, 1], out[m, :, 2] = x + vx * times, y + vy * times, h
            speed = np.hypot(vx, vy)
            start = self._start(x, y, np.arctan2(vy, vx)) if speed > SLOW else -1
            if start >= 0:
                path = self._path(start, speed * times[-1] + NEAR)
                out[m] = _along(path, x, y, h, speed * times)
        return out

    def _start(self, x: float, y: float, direction: float) -> int:
        """Return the index of the nearest point of a lane that fits, or -1."""
        if not len(self._points):
            return -1
        distance = np.hypot(self._points[:, 0] - x, self._points[:, 1] - y)
        away = np.cos(self._points[:, 2] - direction) < np.cos(ALIGNED)
        distance[away] = np.inf
        nearest = int(distance.argmin())
        return nearest if distance[nearest] <= NEAR else -1

    def _path(self, start: int, length: float) -> Float:
        """Return the centres of lanes from a point on, at least as long [m] if they are."""
        lane = int(self._lane[start])
        parts = [self._points[max(start - 1, self._first[lane]) : self._first[lane + 1]]]
        found, seen = _length(parts[0]), {lane}
        while found < length:
            end = parts[-1][-1, 2]
            ahead = [number for number in self._next[lane] if number not in seen]
            if not ahead:
                break
            lane = min(ahead, key=lambda number: -np.cos(self._centres[number][-1, 2] - end))
            seen.add(lane)
            parts.append(self._centres[lane])
            found += _length(parts[-1])
        return np.concatenate(parts)


def _length(points: Float) -> float:
    return float(np.hypot(*np.diff(points[:, :2], axis=0).T).sum())


def _along(path: Float, x: float, y: float, h: float, s: Float) -> Float:
    """Return poses ``(K, 3)`` at distances ``(K,)`` [m] along a path, as far beside it as now."""
    steps = np.hypot(*np.diff(path[:, :2], axis=0).T)
    path = path[np.concatenate([[True], steps > 1e-6])]
    if len(path) < 2:
        return np.stack([x + s * np.cos(h), y + s * np.sin(h), np.full(len(s), h)], axis=1)
    at = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(path[:, :2], axis=0).T))])
    heading = np.unwrap(path[:, 2])
    near = int(np.hypot(path[:, 0] - x, path[:, 1] - y).argmin())
    forward = (x - path[near, 0]) * np.cos(path[near, 2]) + (y - path[near, 1]) * np.sin(
        path[near, 2]
    )
    start = float(np.clip(at[near] + forward, 0.0, at[-1]))

    def pose(found: Float) -> tuple[Float, Float, Float]:
        beyond = np.maximum(found - at[-1], 0.0)
        px, py, ph = (np.interp(found, at, array) for array in (path[:, 0], path[:, 1], heading))
        return px + beyond * np.cos(ph), py + beyond * np.sin(ph), ph

    (x0,), (y0,), (h0,) = pose(np.array([start]))
    ahead = (x - x0) * np.cos(h0) + (y - y0) * np.sin(h0)  # m, what is left of chords and tangents
    left = (y - y0) * np.cos(h0) - (x - x0) * np.sin(h0)
    px, py, ph = pose(start + s)
    px, py = (
        px + ahead * np.cos(ph) - left * np.sin(ph),
        py + ahead * np.sin(ph) + left * np.cos(ph),
    )
    return np.stack([px, py, ph + (h - h0)], axis=1)
