"""Traffic on roads whose lanes are known."""

import numpy as np

from bridgegen.recordings.readers.table import Facts, RecordedTraffic, build

STEP = 0.1
BOX = (4.5, 1.8)


def recorded(tracks, *, lanelets=(), kind=0, source="planted") -> RecordedTraffic:
    """Return traffic of tracks: dicts of time, x, y and, if known, heading, vx, vy, lane."""
    n = len(tracks)
    ids = np.repeat(np.arange(n), [len(one["time"]) for one in tracks])
    columns = {key: np.concatenate([one[key] for one in tracks]) for key in tracks[0]}
    facts = Facts("planted", "none", source, STEP, "a plane", lanelets=tuple(lanelets))
    return build(facts, ids, columns, lambda i: f"{source}, state {i}", kind=np.full(n, kind),
                 length=np.full(n, BOX[0]), width=np.full(n, BOX[1]))  # fmt: skip


def on_road(s, t, radius=None, turn=0.0):
    """Return points and direction of a straight road, or one of this radius (left positive)."""
    h = np.zeros_like(s) if radius is None else s / radius
    x = s if radius is None else radius * np.sin(h)
    y = np.zeros_like(s) if radius is None else radius * (1.0 - np.cos(h))
    x, y = x - t * np.sin(h), y + t * np.cos(h)
    c, d = np.cos(turn), np.sin(turn)
    return c * x - d * y, d * x + c * y, h + turn


def highway(seed, *, n=60, lanes=3, width=3.6, length=500.0, radius=None, turn=0.0, noise=0.0,
            opposing=False, has_lanes=True):  # fmt: skip
    """Return traffic on a road whose lane 1 begins at t = 0, and its lanes as the truth.

    A fifth of the vehicles change lane once. Half of the traffic runs against the road, right of
    t = 0, if ``opposing``. Without lanes, paths are spread evenly.
    """
    rng = np.random.default_rng(seed)
    tracks = []
    for p in range(n):
        speed = rng.uniform(20.0, 32.0)
        time = np.arange(0.0, length / speed, STEP)
        k = int(rng.integers(lanes))
        wander = rng.normal(0.0, 0.25) + 0.15 * np.sin(time * rng.uniform(0.5, 1.2))
        t = (k + 0.5) * width + wander
        if lanes > 1 and rng.random() < 0.2:
            other = k + 1 if k == 0 else k - 1
            middle = time[-1] * rng.uniform(0.2, 0.8)
            t += (other - k) * width * 0.5 * (1.0 + np.tanh((time - middle) / 1.2))
        if not has_lanes:
            t = rng.uniform(0.0, lanes * width) + 0.3 * np.sin(time / 5.0)
        lane = np.floor(t / width).astype(np.int64) + 1
        s = speed * time
        if opposing and p % 2:
            s, t = length - s, -t
        x, y, _ = on_road(s, t, radius, turn)
        start = round(rng.uniform(0.0, 60.0), 1)
        tracks.append({
            "time": start + time, "x": x + rng.normal(0.0, noise, len(x)),
            "y": y + rng.normal(0.0, noise, len(x)), "lane": lane,
        })  # fmt: skip
    return recorded(tracks)
