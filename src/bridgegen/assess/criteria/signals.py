"""The signals that formulas read, by name: states of an entity, and the ego's relation to one."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from bridgegen.assess.metrics.metric import motion, shared
from bridgegen.base.arrays import Bool, Float
from bridgegen.drivers.drivers import DEMAND, EXIT
from bridgegen.scenario.language.criteria import ANY
from bridgegen.simulation.rollout import Rollout


@dataclass(frozen=True)
class Signal:
    """A quantity over time.

    Attributes:
        name: as formulas write it.
        unit: SI.
        description: one line.
        compute: rollout and entity → ``(N, T)`` float64; what lies behind the end of a scenario is
            arbitrary. A state of who is not there is its nearest one in time.
        pair: whether it is the ego's to another entity, ``gap to bv``, not a state, ``ego.v``.
    """

    name: str
    unit: str
    description: str
    compute: Callable[[Rollout, int], Float]
    pair: bool = False


def _state(field: str) -> Callable[[Rollout, int], Float]:
    return lambda rollout, e: _held(rollout, e, np.asarray(getattr(rollout, field)[:, e]))


def _held(rollout: Rollout, e: int, values: Float) -> Float:
    """Return states; while an entity is absent, the last ones before, or else its first ones."""
    if not rollout.present.size or rollout.present[:, e].all():
        return values
    there: Bool = rollout.present[:, e]
    instants = np.arange(there.shape[1])
    # The greatest number of an instant so far at which it was there; -1 before the first.
    last = np.maximum.accumulate(np.where(there, instants, -1), axis=1)
    first = np.where(there.any(axis=1), there.argmax(axis=1), 0)[:, np.newaxis]
    return np.take_along_axis(values, np.where(last < 0, first, last), axis=1)


def _rate(values: Float, time_step: float) -> Float:
    """Return the change from each instant to the next, per second; at the last one that before."""
    if values.shape[1] < 2:
        return np.zeros(values.shape)
    change = np.diff(values, axis=1) / time_step
    return np.concatenate([change, change[:, -1:]], axis=1)


def _until_end(rollout: Rollout, values: Float) -> Float:
    """Return rates that are, at a scenario's last instant, those of the instant before."""
    n = len(values)
    last = np.asarray(rollout.n_steps) - 1
    values[np.arange(n), last] = values[np.arange(n), np.maximum(last - 1, 0)]
    # One instant has no rate.
    values[last == 0, 0] = 0.0
    return values


def _jerk(rollout: Rollout, e: int) -> Float:
    a = _held(rollout, e, np.asarray(rollout.a[:, e]))
    return _until_end(rollout, _rate(a, rollout.time_step))


def _yaw_rate(rollout: Rollout, e: int) -> Float:
    h = _held(rollout, e, np.asarray(rollout.h[:, e]))
    return _until_end(rollout, _rate(h, rollout.time_step))


def _lateral(rollout: Rollout, e: int) -> Float:
    return _held(rollout, e, np.asarray(rollout.v[:, e])) * _yaw_rate(rollout, e)


def _travelled(rollout: Rollout, e: int) -> Float:
    x, y = (_held(rollout, e, np.asarray(array[:, e])) for array in (rollout.x, rollout.y))
    way = np.sqrt(np.diff(x, axis=1) ** 2 + np.diff(y, axis=1) ** 2)
    return np.concatenate([np.zeros((len(x), 1)), np.cumsum(way, axis=1)], axis=1)


def _gap(rollout: Rollout, e: int) -> Float:
    return np.asarray(rollout.distance[:, e])


def _since(which: int) -> Callable[[Rollout, int], Float]:
    """Return how the time since a transition of the ego's is computed."""

    def compute(rollout: Rollout, e: int) -> Float:
        del e
        n, _, t = rollout.shape
        if not len(rollout.transitions):
            return np.zeros((n, t))
        at = rollout.transitions[:, which, np.newaxis]
        passed = (np.arange(t) - at) * rollout.time_step
        return np.where((at >= 0) & (passed > 0.0), passed, 0.0)

    return compute


# The kernels return the least value over a scenario's time: scenarios of one instant each give the
# value at every instant.
def _by_instant(of: Float, e: int) -> Float:
    """Return the ego's and another's states as scenarios of one instant, ``(N T, 2, 1)``."""
    n, _, t = of.shape
    both = of[:, [0, e]]
    return np.ascontiguousarray(both.transpose(0, 2, 1)).reshape(n * t, 2, 1)


def _ttc(rollout: Rollout, e: int) -> Float:
    from bridgegen.assess.metrics import _time_kernels as _ttc_kernels

    n, _, t = rollout.shape
    out = np.empty(n * t)
    _ttc_kernels.least_time(
        np.ascontiguousarray(rollout.box[[0, e]], dtype=np.float64),
        *(_by_instant(getattr(rollout, field), e) for field in ("x", "y", "h", "v")),
        _by_instant(rollout.distance, e),
        np.ones(n * t, dtype=np.int64),
        out,
    )
    return out.reshape(n, t)


def _thw(rollout: Rollout, e: int) -> Float:
    from bridgegen.assess.metrics import _time_kernels as _course_kernels

    m, (n, _, t) = motion(rollout), rollout.shape
    out = np.empty(n * t)
    states = (m.x, m.y, m.cosine, m.sine, m.v, m.distance)
    _course_kernels.headway(
        np.ascontiguousarray(m.half[[0, e]]),
        *(_by_instant(state, e) for state in states),
        np.ones(n * t, dtype=np.int64),
        out,
    )
    return out.reshape(n, t)


_STATES = (
    Signal("x", "m", "position, of the reference point", _state("x")),
    Signal("y", "m", "position, of the reference point", _state("y")),
    Signal("h", "rad", "heading, counter-clockwise from the x axis", _state("h")),
    Signal("v", "m/s", "speed, below 0 in reverse", _state("v")),
    Signal("a", "m/s²", "acceleration along the heading", _state("a")),
    Signal("a_lat", "m/s²", "acceleration across the heading, left positive", _lateral),
    Signal("jerk", "m/s³", "change of the acceleration", _jerk),
    Signal("yaw_rate", "rad/s", "change of the heading, left positive", _yaw_rate),
    Signal("offset", "m", "from the centre of the route's lane, left positive", _state("offset")),
    Signal("travelled", "m", "distance travelled since the start", _travelled),
)

_OF_DOMAIN = (
    Signal("outside_odd", "s", "time since its ODD was left; 0 before", _since(EXIT)),
    Signal(
        "demanding", "s", "time since its driver demanded a transition; 0 before", _since(DEMAND)
    ),
)

_PAIRS = (
    Signal("gap", "m", "distance of the bodies, 0 in contact; inf from who is absent", _gap, True),
    Signal("ttc", "s", "time to collision at constant velocities; else inf", _ttc, True),
    Signal("thw", "s", "time headway: until the ego is where it is now; else inf", _thw, True),
)

SIGNALS: Mapping[str, Signal] = MappingProxyType(
    {state.name: state for state in (*_STATES, *_OF_DOMAIN, *_PAIRS)}
)
"""All signals by name."""

OF_DOMAIN = tuple(signal.name for signal in _OF_DOMAIN)
"""Names of those of an ego with an operational design domain."""


def read(rollout: Rollout, name: str, of: tuple[str, ...]) -> Float:
    """Return a signal of a rollout, ``(N, T)`` float64.

    Args:
        rollout: of N scenarios.
        name: a key of SIGNALS.
        of: the entity of a state; the ego and another one, or ANY, of a pair.
    """
    signal, known = SIGNALS[name], shared(rollout, _Known)
    entity = of[-1]
    if (name, entity) not in known:
        if entity == ANY and signal.pair:
            # The ego's own trailer is no other.
            others = [e for e in range(1, len(rollout.names)) if not rollout.is_ego_s(e)]
            n, _, t = rollout.shape
            found = np.full((n, t), np.inf)
            for e in others:
                np.minimum(found, read(rollout, name, ("ego", rollout.names[e])), out=found)
        else:
            e = 0 if entity == "ego" else rollout.names.index(entity)
            found = signal.compute(rollout, e)
        known[name, entity] = found
    return known[name, entity]


class _Known(dict[tuple[str, str], Float]):
    """The signals of a rollout that were computed already."""

    def __init__(self, _: Rollout) -> None:
        super().__init__()
