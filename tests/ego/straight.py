"""A straight road, an ego on it with a compiled driver, and others that move as they are told."""

from collections.abc import Callable

import numpy as np

from bridgegen.drivers import kinds

DT = 0.05
CAR = np.array([4.6, 1.9, 1.4])
WALKER = np.array([0.5, 0.6, 0.0])
DS = 0.5


def path(x: float, y: float, h: float, length: float = 600.0) -> np.ndarray:
    s = np.arange(round(length / DS) + 1) * DS
    c, q, one = np.cos(h), np.sin(h), np.ones_like(s)
    return np.stack([x + s * c, y + s * q, h * one, c * one, q * one, 0.0 * one], axis=1)


class Road:
    """The ego from x = 0 along +x; another on a path of its own, at a speed of each instant.

    `aside` (T,) moves the other to the left of its path; it is then changing its lane. A third
    body, a car, stands at ``standing`` [m], its rear, if that is given.
    """

    def __init__(
        self,
        drive: Callable[..., float],
        speed: float,
        other: np.ndarray,
        body: np.ndarray = CAR,
        kind: int = kinds.CAR,
        standing: float | None = None,
    ) -> None:
        self.drive, self.speed, self.body = drive, speed, body
        self.stands = [] if standing is None else [ahead(standing)]
        self.present = np.ones(2 + len(self.stands), dtype=np.bool_)
        self.paths = np.stack([path(0.0, 0.0, 0.0), other, *self.stands])
        self.kinds = np.array([kinds.CAR, kind, kinds.CAR][: len(self.paths)])

    def run(self, seconds: float, w: Callable[[float], float], aside=None) -> "Road":
        n, m = round(seconds / DT) + 1, len(self.paths)
        x, y, h, v = np.zeros((4, m, n))
        self.x, self.y, self.v, self.a = x, y, v, np.zeros(n)
        counts, steps = np.full(m, self.paths.shape[1]), np.full(m, DS)
        bodies = np.stack([CAR, self.body, CAR][:m])
        station, attention = np.zeros(m), np.zeros((m, 3))
        on, to = np.arange(m), np.full(m, -1)
        to[1] = -1 if aside is None else 1
        for e in range(2, m):
            x[e] = self.paths[e, 0, 0]
        v[0, 0] = self.speed
        heading = self.paths[1, 0, 2]
        for k in range(n):
            now = k * DT
            v[1, k], h[1, k] = w(now), heading
            left = 0.0 if aside is None else aside(now)
            x[1, k] = self.paths[1, 0, 0] + station[1] * np.cos(heading) - left * np.sin(heading)
            y[1, k] = self.paths[1, 0, 1] + station[1] * np.sin(heading) + left * np.cos(heading)
            x[0, k] = station[0]
            asked = self.drive(
                k, DT, self.paths, counts, steps, station, on, to, self.speed, self.present, x, y,
                h, v, bodies, self.kinds, attention,
            )  # fmt: skip
            end = max(v[0, k] + asked * DT, 0.0)
            self.a[k] = (end - v[0, k]) / DT
            station[0] += 0.5 * (v[0, k] + end) * DT
            station[1] += v[1, k] * DT
            if k + 1 < n:
                v[0, k + 1] = end
        return self

    @property
    def gap(self) -> np.ndarray:
        """From the ego's front to the rear of a body ahead on its lane."""
        return self.x[1] + self.body[2] - 0.5 * self.body[0] - (self.x[0] + CAR[2] + 0.5 * CAR[0])

    @property
    def brakes_at(self) -> float:
        """When it first asks for more than a comfortable deceleration, or for any at once [s]."""
        return float(np.argmax(self.a < -1e-9)) * DT if (self.a < -1e-9).any() else np.inf


def ahead(gap: float) -> np.ndarray:
    """The path of a car whose rear is so far before the ego's front."""
    return path(gap + CAR[2] + 0.5 * CAR[0] + 0.5 * CAR[0] - CAR[2], 0.0, 0.0)
