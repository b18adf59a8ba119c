"""What happens in simulated scenarios, worked out from the simulation by itself."""

import numpy as np

EVERY = 20
"""Of the simulation's steps."""


def centres(rollout, row, e):
    """Centres of a body, and the time of each."""
    k = np.arange(0, rollout.n_steps[row], EVERY)
    if rollout.present.size:
        k = k[rollout.present[row, e, k]]
    x, y, h = (one[row, e, k] for one in (rollout.x, rollout.y, rollout.h))
    ahead = rollout.box[e, 2]
    return x + ahead * np.cos(h), y + ahead * np.sin(h), k * rollout.time_step


def crossing_of(rollout, row, other):
    """Return when the ego and another pass where their paths cross; NaN if they never do."""
    (ax, ay, at), (bx, by, bt) = (centres(rollout, row, e) for e in (0, other))
    ux, uy, vx, vy = np.diff(ax)[:, None], np.diff(ay)[:, None], np.diff(bx), np.diff(by)
    dx, dy = bx[:-1] - ax[:-1, None], by[:-1] - ay[:-1, None]
    cross = ux * vy - uy * vx
    with np.errstate(divide="ignore", invalid="ignore"):
        f, g = (dx * vy - dy * vx) / cross, (dx * uy - dy * ux) / cross
    hits = (f >= 0) & (f < 1) & (g >= 0) & (g < 1) & (np.abs(cross) > 1e-9)
    if not hits.any():
        return np.nan, np.nan
    i, j = np.argwhere(hits)[0]
    step = rollout.time_step * EVERY
    return at[i] + f[i, j] * step, bt[j] + g[i, j] * step


def at_time(rollout, field, e, time):
    k = np.clip(np.nan_to_num(time) / rollout.time_step, 0, rollout.x.shape[2] - 1).astype(int)
    return getattr(rollout, field)[np.arange(len(k)), e, k]


def apart_at(rollout, other, time):
    x, y = (at_time(rollout, f, other, time) - at_time(rollout, f, 0, time) for f in ("x", "y"))
    return np.hypot(x, y)


def set_off_time(rollout, other):
    moves = rollout.v[:, other] > 1e-9
    return np.where(moves.any(axis=1), moves.argmax(axis=1) * rollout.time_step, 1e9)


def encounter(own, other="bv", trigger="bv_trigger", speed="bv_speed"):
    """Of a scenario whose other stands, and sets off while the ego has this way to go."""

    def what(P, rollout, passes, name):
        e = rollout.names.index(name)
        go = set_off_time(rollout, e)
        rest = own - P["ego_speed"] * go
        happens = {
            f"{trigger}_time": go, f"{trigger}_distance": apart_at(rollout, e, go),
            speed: at_time(rollout, "v", e, passes[1]),
        }  # fmt: skip
        # events take a change of speed as a ramp, which begins up to a/(2·j) = 0.3 s later
        surely = (go > 1.5) & (rest > 0.5 + 0.3 * P["ego_speed"])
        return surely, (go > 0.3) & (rest > -0.5), P | happens

    return what


def some_rows(surely, maybe, most):
    """Return rows in which it happens, in which it may, and in which it does not."""
    return np.sort(np.concatenate([
        np.flatnonzero(surely)[:most], np.flatnonzero(maybe & ~surely)[: most // 4],
        np.flatnonzero(~maybe)[: most // 4],
    ]))  # fmt: skip
