"""Drivers of a user's own, good and bad, for the tests."""

import os
import time
from dataclasses import replace

import numpy as np

from bridgegen.drivers.interface import Control, Trajectory


class Cruises:
    def reset(self, n, scene):
        self.n = n

    def act(self, observation):
        demanded = np.clip(observation.target_speed - observation.v, -3.0, 2.0)
        return Control(demanded, np.zeros(self.n))


class Prints(Cruises):
    def act(self, observation):
        print("a word on stdout, which carries the answers")
        return super().act(observation)


class Raises(Cruises):
    def act(self, observation):
        raise ValueError("no idea")


class Hangs(Cruises):
    def act(self, observation):
        time.sleep(60)


class Dies(Cruises):
    def act(self, observation):
        os._exit(3)


class AnswersNaN(Cruises):
    def act(self, observation):
        return np.full(self.n, np.nan), np.zeros(self.n)


class AnswersOneNumber(Cruises):
    def act(self, observation):
        return 1.0, np.zeros(self.n)


class AnswersOneForAll(Cruises):
    """Drives all scenarios of a batch as the first one."""

    def act(self, observation):
        return np.clip(observation.target_speed - observation.v, -3.0, 2.0)[:1], np.zeros(1)


class AnswersAColumn(Cruises):
    def act(self, observation):
        return np.zeros((self.n, 1)), np.zeros((self.n, 1))


class AnswersNothing(Cruises):
    def act(self, observation):
        return None


class CannotBeMade(Cruises):
    def __init__(self):
        raise OSError("no weights")


class LacksAct:
    def reset(self, n, scene):
        pass


class FailsFast(Cruises):
    """Fails where the ego is asked to drive fast, in one of four ways; cruises elsewhere."""

    LIMIT = 7.5

    def act(self, observation):
        fast = observation.running & (observation.target_speed > self.LIMIT)
        if fast.any() and observation.time > 1.0:
            return self.fail(fast)
        return super().act(observation)

    def fail(self, fast):
        raise ValueError("too fast for me")


class DiesFast(FailsFast):
    def fail(self, fast):
        os._exit(3)


class HangsFast(FailsFast):
    def fail(self, fast):
        time.sleep(60)


class NaNFast(FailsFast):
    def fail(self, fast):
        return np.where(fast, np.nan, 0.0), np.zeros(self.n)


class LooksAhead:
    """Steers along the route and brakes for who is ahead: all that it is told, it uses."""

    def reset(self, n, scene):
        self.scene = scene

    def act(self, observation):
        o = observation
        dx, dy = o.route[:, 3, 0] - o.x, o.route[:, 3, 1] - o.y
        left = dy * np.cos(o.h) - dx * np.sin(o.h)
        curvature = 2.0 * left / np.maximum(dx * dx + dy * dy, 1.0)
        tx, ty = o.tracks[:, :, 1] - o.x[:, None], o.tracks[:, :, 2] - o.y[:, None]
        ahead = tx * np.cos(o.h)[:, None] + ty * np.sin(o.h)[:, None]
        near = (o.tracks[:, :, 0] >= 2.0) & (ahead > 0.0) & (np.hypot(tx, ty) < 2.0 * o.v[:, None])
        wanted = np.where(near.any(axis=1), -6.0, np.clip(o.target_speed - o.v, -3.0, 2.0))
        return Control(wanted, curvature)


class Mixes(Cruises):
    """Drives all scenarios at the mean speed of the batch: nobody's result is its own."""

    def act(self, observation):
        demanded = np.mean(observation.target_speed) - observation.v
        return Control(np.clip(demanded, -3.0, 2.0), np.zeros(self.n))


class RoundsByBatch(Cruises):
    """Rounds differently by the size of the batch, as linear algebra does."""

    def act(self, observation):
        control = super().act(observation)
        return Control(control.acceleration + 1e-12 * self.n, control.curvature)


class Remembers(Cruises):
    """Drives more slowly in every batch."""

    batches = 0

    def reset(self, n, scene):
        super().reset(n, scene)
        self.batches += 1

    def act(self, observation):
        demanded = np.clip(observation.target_speed / self.batches - observation.v, -3.0, 2.0)
        return Control(demanded, np.zeros(self.n))


class Plans(Cruises):
    """Plans to go straight on, at a speed that changes to what is asked for."""

    period = 0.2

    def plan(self, o):
        time = np.linspace(0.0, 1.0, 11)
        a = np.clip(o.target_speed - o.v, -3.0, 2.0)[:, None]
        s = o.v[:, None] * time + 0.5 * a * time**2
        h = np.repeat(o.h[:, None], len(time), axis=1)
        x, y = o.x[:, None] + s * np.cos(h), o.y[:, None] + s * np.sin(h)
        return Trajectory(time, x, y, h, np.maximum(o.v[:, None] + a * time, 0.0))

    def act(self, observation):
        return self.plan(observation)


class PlansAtOnce(Plans):
    period = None


class HoldsControl(Cruises):
    """Counts its calls: it demands 0.1 m/s² more at each."""

    period = 0.2

    def reset(self, n, scene):
        super().reset(n, scene)
        self.calls = 0

    def act(self, observation):
        self.calls += 1
        return Control(np.full(self.n, 0.1 * self.calls), np.zeros(self.n))


class PlansAndControls(Plans):
    """Plans in every other call."""

    def act(self, observation):
        planned = round(observation.time / self.period) % 2 == 0
        return self.plan(observation) if planned else Cruises.act(self, observation)


class PlansThePastFast(Plans):
    def act(self, observation):
        made = self.plan(observation)
        fast = (observation.target_speed > FailsFast.LIMIT) & (observation.time > 1.0)
        return replace(made, time=made.time - np.where(fast, 2.0, 0.0)[:, None])


class PeriodOfAnHour(Cruises):
    period = 3600.0


class PlansThePast(Plans):
    def act(self, observation):
        made = self.plan(observation)
        return replace(made, time=made.time - 2.0)


class ReadsTheClock(Cruises):
    def act(self, observation):
        control = super().act(observation)
        noise = np.random.default_rng(time.time_ns()).random(self.n)
        return Control(control.acceleration + noise, control.curvature)


class IsBornByChance(Cruises):
    def __init__(self):
        self.bias = np.random.default_rng(time.time_ns()).random()

    def act(self, observation):
        control = super().act(observation)
        return Control(control.acceleration - self.bias, control.curvature)


class NaNLater(Cruises):
    """Answers NaN at 3 s where the ego is asked to drive fast."""

    def act(self, observation):
        control = super().act(observation)
        bad = (observation.time >= 3.0) & (observation.target_speed > FailsFast.LIMIT)
        return Control(np.where(bad, np.nan, control.acceleration), control.curvature)


class DecidesByHistory(Cruises):
    """Decides every 0.2 s, by where the others were in the last second."""

    wants = ("history",)

    def act(self, observation):
        if round(observation.time / 0.05) % 4 == 0:
            seen = observation.history[:, :, :, 1].sum(axis=1)
            weights = np.arange(1.0, 1.0 + seen.shape[1])
            self.demanded = np.sin((seen * weights).sum(axis=1))
        return Control(self.demanded, np.zeros(self.n))


class IsAskedForHistory(DecidesByHistory):
    period = 0.2


class TellsThreads:
    """Its acceleration is how many threads its libraries take."""

    def reset(self, n, scene):
        self.n = n

    def act(self, observation):
        return [float(os.environ["OPENBLAS_NUM_THREADS"])] * self.n, [0.0] * self.n
