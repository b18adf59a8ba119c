"""Changes lane on motorways, by IDM (Treiber, Kesting, Traffic Flow Dynamics, 2013, table 11.2,
highway) and MOBIL (Kesting, Treiber, Helbing, General lane-changing model MOBIL, 2007)."""

import numpy as np

T, S0, A, B, HARDEST = 1.0, 2.0, 1.0, 1.5, 8.0  # s, m, m/s², m/s², m/s²
POLITENESS, SAFE, THRESHOLD, BIAS = 0.2, 4.0, 0.1, 0.3  # 1, then m/s²
SIDES = np.array([[0], [1], [-1]])  # the route's lane, left and right of it


def idm(v, gap, lead, wanted):
    s = S0 + np.maximum(v * T + v * (v - lead) / (2.0 * np.sqrt(A * B)), 0.0)
    free = 1.0 - (v / np.maximum(wanted, 0.1)) ** 4
    return np.clip(A * (free - (s / np.maximum(gap, 0.1)) ** 2), -HARDEST, A)


class MyLaneChanger:
    wants = ("lanes",)

    def reset(self, n, scene):
        self.scene, self.side, self.aim = scene, np.zeros(n, dtype=int), np.zeros(n)

    def follow(self, y, v, wanted):  # on a lane: mine, and with and without me who is behind
        inside, found = np.abs(self.left - y[:, None]) < 1.9, []
        for there in (inside & (self.ahead > 0.0), inside & (self.ahead <= 0.0)):
            gaps = np.c_[np.where(there, self.gap, np.inf), np.full(len(v), np.inf)]
            at = np.arange(len(v)), gaps.argmin(axis=1)
            found += [gaps[at], np.c_[self.speed, 0.0 * v][at]]
        front, lead, back, rear = found
        rest = front + back + self.scene.length
        return idm(v, front, lead, wanted), idm(rear, back, v, rear), idm(rear, rest, lead, rear)

    def act(self, o):
        rows, route, beside = np.arange(len(o.x)), o.route, o.lanes.beside
        d = o.tracks[:, :, None, 1:3] - route[:, None, :, :2]  # the others, along the route
        at = (d**2).sum(axis=-1).argmin(axis=-1)
        dx, dy = np.moveaxis(np.take_along_axis(d, at[:, :, None, None], 2)[:, :, 0], -1, 0)
        c, s = (each(route[rows[:, None], at, 2]) for each in (np.cos, np.sin))
        self.ahead = 2.0 * at + dx * c + dy * s - self.scene.centre
        self.left = np.where(o.tracks[:, :, 0] >= 2, dy * c - dx * s, np.inf)
        self.gap = np.abs(self.ahead) - 0.5 * (o.tracks[:, :, 6] + self.scene.length)
        self.speed = o.tracks[:, :, 4] * c + o.tracks[:, :, 5] * s
        bend = np.sqrt(2.0 / np.maximum(np.abs(route[:, :, 3]).max(axis=1), 1e-4))  # at 2 m/s²
        wanted = np.min((o.target_speed, o.lanes.speed_limit[:, 0], bend), axis=0)
        is_lane = (beside[..., 2] == 1) & (beside[..., 3] == 1)  # left, right; for 5 s at least
        last = rows, np.clip(2.5 * o.v, 5, 39).astype(int)
        there = np.stack((rows >= 0, *np.logical_and.accumulate(is_lane, 1)[last].T))
        y = np.stack((np.zeros(len(rows)), beside[:, 0, 0, 0], beside[:, 0, 1, 0]))
        mine, behind, rest = np.array([self.follow(one, o.v, wanted) for one in y]).swapaxes(0, 1)
        worth = mine + POLITENESS * (behind - rest) - BIAS * np.abs(SIDES)
        may = there & (np.abs(self.side - SIDES) == 1) & (behind > -SAFE)
        pays = np.where(may, worth - (worth - 99.0 * ~there)[self.side, rows], -np.inf)
        changes = (pays.max(axis=0) > THRESHOLD) & (np.abs(self.aim - y[self.side, rows]) < 0.2)
        self.side = np.where(changes, SIDES[pays.argmax(axis=0), 0], self.side)
        target, dt = y[self.side, rows], self.scene.time_step  # to the side at 1 m/s
        self.aim = self.aim + np.clip(target - self.aim, -dt, dt)
        a = np.minimum(*(self.follow(one, o.v, wanted)[0] for one in (self.aim, target)))
        x, y, h, _ = route[rows, np.clip(0.5 * o.v, 3, 20).astype(int)].T  # a second ahead
        dx, dy = x - self.aim * np.sin(h) - o.x, y + self.aim * np.cos(h) - o.y
        return a, 2.0 * (dy * np.cos(o.h) - dx * np.sin(o.h)) / np.maximum(dx**2 + dy**2, 1.0)
