"""Changes lane on motorways: IDM along the road, MOBIL across it.

bridgegen search cut-in --ego docs/examples/my_lane_changer.py:MyLaneChanger

Sources: Treiber, Hennecke, Helbing (2000) for IDM, with the highway parameters of Treiber, Kesting
(2013), Traffic Flow Dynamics, table 11.2; Kesting, Treiber, Helbing (2007) for MOBIL and its own.
"""

import numpy as np

from bridgegen.ego.interface import ROUTE_STEP, Control

T, S0, A, B, HARDEST = 1.0, 2.0, 1.0, 1.5, 8.0  # s, m, m/s², m/s², m/s²
POLITENESS, SAFE, THRESHOLD, BIAS = 0.2, 4.0, 0.1, 0.3  # 1, then m/s²
ASIDE, SIDEWAYS, CORNERING = 1.9, 1.0, 2.0  # m (in one's lane), m/s, m/s²


def idm(v, gap, lead, wanted):
    s = S0 + np.maximum(v * T + v * (v - lead) / (2.0 * np.sqrt(A * B)), 0.0)
    free = 1.0 - (v / np.maximum(wanted, 0.1)) ** 4
    return np.clip(A * (free - (s / np.maximum(gap, 0.1)) ** 2), -HARDEST, A)


class MyLaneChanger:
    wants = ("lanes",)

    def reset(self, n, scene):
        self.scene, self.side, self.aim = scene, np.zeros(n, dtype=int), np.zeros(n)

    def follow(self, y, v, wanted):
        """Return accelerations on the lane at y: mine, and of who is behind me with and without me."""
        inside, none = np.abs(self.left - y[:, None]) < ASIDE, [(0, 0), (0, 1)]
        found = []
        for there in (inside & (self.ahead > 0.0), inside & (self.ahead <= 0.0)):
            gap = np.pad(np.where(there, self.gap, np.inf), none, constant_values=np.inf)
            at = gap.argmin(axis=1)[:, None]
            speed = np.pad(self.speed, none)
            found += [np.take_along_axis(one, at, 1)[:, 0] for one in (gap, speed)]
        front, lead, back, rear = found
        rest = idm(rear, front + back + self.scene.length, lead, rear)
        return idm(v, front, lead, wanted), idm(rear, back, v, rear), rest

    def act(self, o):
        rows, route, lanes = np.arange(len(o.x)), o.route, o.lanes
        d = o.tracks[:, :, None, 1:3] - route[:, None, :, :2]  # the others, along the route
        at = (d**2).sum(axis=-1).argmin(axis=-1)
        dx, dy = np.moveaxis(np.take_along_axis(d, at[:, :, None, None], 2)[:, :, 0], -1, 0)
        c, s = np.cos(route[rows[:, None], at, 2]), np.sin(route[rows[:, None], at, 2])
        self.ahead = ROUTE_STEP * at + dx * c + dy * s - self.scene.centre
        self.left = np.where(o.tracks[:, :, 0] >= 2, dy * c - dx * s, np.inf)
        self.gap = np.abs(self.ahead) - 0.5 * (o.tracks[:, :, 6] + self.scene.length)
        self.speed = o.tracks[:, :, 4] * c + o.tracks[:, :, 5] * s
        bend = np.sqrt(CORNERING / np.maximum(np.abs(route[:, :, 3]).max(axis=1), 1e-4))
        wanted = np.minimum(np.minimum(o.target_speed, lanes.speed_limit[:, 0]), bend)
        last = np.clip(5.0 * o.v / ROUTE_STEP, 5, route.shape[1] - 1).astype(int)
        is_lane = (lanes.beside[..., 2] == 1) & (lanes.beside[..., 3] == 1)
        lasts = np.logical_and.accumulate(is_lane, axis=1)[rows, last]  # left, right
        y = [np.zeros(len(rows)), lanes.beside[:, 0, 0, 0], lanes.beside[:, 0, 1, 0]]
        each = [self.follow(one, o.v, wanted) for one in y]  # side 0: the route, 1 left, -1 right
        mine, behind, rest = np.moveaxis(np.array(each), 1, 0)[:, self.side, rows]
        best, most = self.side, np.full(len(rows), THRESHOLD)
        for side, (me, they, before) in zip((0, 1, -1), each, strict=True):
            is_there = lasts[:, (1 - side) // 2] if side else lasts[:, 0] | True
            pays = me - mine + POLITENESS * (they - before + rest - behind)
            pays += BIAS * (np.abs(self.side) - abs(side))
            pays += np.where(lasts[rows, (1 - self.side) // 2] | (self.side == 0), 0.0, 99.0)
            may = is_there & (np.abs(self.side - side) == 1) & (they > -SAFE) & (pays > most)
            best, most = np.where(may, side, best), np.where(may, pays, most)
        target = np.array(y)[self.side, rows]
        self.side = np.where(np.abs(self.aim - target) < 0.2, best, self.side)
        target, reach = np.array(y)[self.side, rows], SIDEWAYS * self.scene.time_step
        self.aim = self.aim + np.clip(target - self.aim, -reach, reach)
        asked = np.minimum(
            self.follow(self.aim, o.v, wanted)[0], self.follow(target, o.v, wanted)[0]
        )
        x, y, h, _ = route[rows, np.clip(o.v / ROUTE_STEP, 3, 20).astype(int)].T
        dx, dy = x - self.aim * np.sin(h) - o.x, y + self.aim * np.cos(h) - o.y
        left = dy * np.cos(o.h) - dx * np.sin(o.h)
        return Control(asked, 2.0 * left / np.maximum(dx * dx + dy * dy, 1.0))
