"""Preventability by UN Regulation 157: does its careful driver avoid the collision?

Annex 3 of the regulation calls a collision in a cut-in, a cut-out, or behind a vehicle that brakes
preventable if its model driver avoids it. Here the models drive, in steps of 0.1 s, as the
European Commission's code has it (JRC-FSM, whose crashes they have, cell for cell):

- ``un-r157``, the competent and careful human driver. Once there is a risk it takes the foot off
  the accelerator (0.4 m/s²), and 0.75 s later brakes by 12.65 m/s³ up to 0.774 g. A cut-in is a
  risk where the bodies overlap across the way and the time to collision is at most 2 s; beyond 2 s
  it is none, and preventable. A cut-out is one from 0.375 m on, a deceleration from its beginning.
- ``fsm``, the fuzzy safety model: 0.75 s after a distance has become unsafe, it brakes by how
  unsafe it is, up to 6 m/s².

Beside these two, which are the regulation's, a third is known here:

- ``rss``, a driver by responsibility-sensitive safety with the parameters of the Commission's code:
  0.75 s after the distances along and across the way have both become unsafe, it brakes by
  12.65 m/s³ up to 0.774 g for as long as they are.

The road is straight, level and dry, and braking is not limited by friction. The other vehicle does
not react. It is a collision, too, if the other drives into the ego's side.

The text of the regulation adds 0.4 s of perception to each disturbance; see docs/decisions.md.

Sources: UN Regulation 157, 01 series of amendments, annex 3 (00 series: annex 4, appendix 3);
European Commission, JRC-FSM; Mattas et al., Accident Analysis & Prevention 148 (2020) 105794 and
174 (2022) 106743; Shalev-Shwartz, Shammah and Shashua, arXiv:1708.06374 (RSS).
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from bridgegen.base.arrays import Bool, Float
from bridgegen.base.errors import InputError, UnknownNameError
from bridgegen.base.physics import CAREFUL_BRAKING, CAREFUL_JERK, CAREFUL_REACTION
from bridgegen.drivers._fsm_kernels import BRAKING as FSM_BRAKING
from bridgegen.drivers._fsm_kernels import (
    COMFORT_BRAKING,
    LEADER_BRAKING,
    SAFE_MARGIN,
    SLACK,
    STANDSTILL,
)
from bridgegen.drivers._un_r157_kernels import CRITICAL_TTC, RELEASE

RATE = 10.0
"""Rate at which the driver decides [Hz]; that of the Commission's code."""
LONGEST = 35.0
"""Duration of a run [s]; that of the Commission's code."""
LANE_GAP = 1.6
"""Lateral gap between two cars 1.9 m wide, in the middle of lanes 3.5 m wide [m]."""
SIZE = (4.3, 1.9)
"""Length and width of a car in the Commission's code [m]."""
MODELS = ("un-r157", "fsm")
"""Names of the regulation's driver models."""
KNOWN = (*MODELS, "rss")
"""All models that drive here."""
RSS_ACCELERATION, RSS_BRAKING = 3.0, 6.0
"""Acceleration of the ego while it reacts, and least deceleration of both, that RSS expects
[m/s²]."""
RSS_LATERAL, RSS_MARGIN = 1.0, 0.3
"""Lateral acceleration and deceleration that RSS expects [m/s²], and the lateral distance that is
left [m]."""


class _Place(NamedTuple):
    """The other vehicle at an instant, all ``(N,)``.

    Attributes:
        x: of its centre along the way, from where the ego's was at first [m].
        side: distance of the bodies across the way, <= 0 if they overlap there [m].
        speed: along the way [m/s].
        inward: lateral speed towards the ego's way [m/s].
    """

    x: Float
    side: Float
    speed: Float
    inward: Float


def avoids_cut_in(
    ego_speed: npt.ArrayLike,
    other_speed: npt.ArrayLike,
    gap: npt.ArrayLike,
    lateral_speed: npt.ArrayLike,
    *,
    lateral_gap: npt.ArrayLike = LANE_GAP,
    ego_size: tuple[float, float] = SIZE,
    other_size: tuple[float, float] = SIZE,
    driver: str = "un-r157",
) -> Bool:
    """Return for each cut-in whether the regulation's driver avoids the collision.

    The other comes from the next lane at a constant lateral speed, at a constant speed along the
    way, and stays in the middle of the ego's way once it is there. The arguments describe the
    instant 0.1 s before the driver first decides. They are broadcast against each other.

    Args:
        ego_speed: ``(N,)`` [m/s].
        other_speed: ``(N,)`` [m/s], along the way.
        gap: ``(N,)`` [m], from the ego's front to the other's rear.
        lateral_speed: ``(N,)`` [m/s], >= 0, towards the ego's way; 0: the other stays beside it.
        lateral_gap: ``(N,)`` [m], >= 0, between the bodies across the way: `LANE_GAP` where the
            cut-in begins, 0 where the bodies begin to overlap.
        ego_size: length and width [m].
        other_size: the same of the other.
        driver: one of `KNOWN`.

    Returns:
        ``(N,)`` bool.

    Raises:
        InputError: a value that is not finite, or negative where it may not be.
        UnknownNameError: no such model.
    """
    v, w, room, lateral, beside = _arrays(
        ego_speed=ego_speed,
        other_speed=other_speed,
        gap=gap,
        lateral_speed=lateral_speed,
        lateral_gap=lateral_gap,
    )
    width, length = 0.5 * ego_size[1] + 0.5 * other_size[1], 0.5 * (ego_size[0] + other_size[0])
    travelled, drifted = np.zeros_like(w), np.zeros_like(w)  # in steps, added up as theirs are

    def place(_: int) -> _Place:
        nonlocal travelled, drifted
        inward = np.where(drifted / RATE < beside + width, lateral, 0.0)
        # Cells on an edge (a TTC of 2 s exactly, bodies that touch) are decided by rounding, so
        # sums run as in the Commission's code.
        travelled, drifted = travelled + w, drifted + lateral
        away = np.maximum(beside + width - drifted / RATE, 0.0)
        side = away - 0.5 * ego_size[1] - 0.5 * other_size[1]
        return _Place(travelled / RATE + (room + length), side, w, inward)

    return _shaped(
        _avoids(v, place, ego_size[0], other_size[0], driver, cut_in=True),
        ego_speed,
        other_speed,
        gap,
        lateral_speed,
        lateral_gap,
    )


def avoids_cut_out(
    ego_speed: npt.ArrayLike,
    other_speed: npt.ArrayLike,
    gap: npt.ArrayLike,
    *,
    driver: str = "un-r157",
) -> Bool:
    """Return for each cut-out whether the driver avoids the vehicle that is revealed by it.

    The arguments describe the instant at which the vehicle that cuts out is more than 0.375 m
    beside the middle of the ego's way. They are broadcast against each other.

    Args:
        ego_speed: ``(N,)`` [m/s].
        other_speed: ``(N,)`` [m/s], of the revealed vehicle, constant; 0: it stands.
        gap: ``(N,)`` [m], from the ego's front to the revealed vehicle's rear.
        driver: one of `KNOWN`.

    Returns:
        ``(N,)`` bool.

    Raises:
        InputError: a value that is not finite or negative.
        UnknownNameError: no such model.
    """
    return avoids_deceleration(ego_speed, other_speed, gap, 0.0, driver=driver)


def avoids_deceleration(
    ego_speed: npt.ArrayLike,
    other_speed: npt.ArrayLike,
    gap: npt.ArrayLike,
    deceleration: npt.ArrayLike,
    *,
    driver: str = "un-r157",
) -> Bool:
    """Return whether the driver avoids the vehicle ahead, which brakes to a standstill.

    The arguments describe the instant at which the other begins to brake. They are broadcast
    against each other.

    Args:
        ego_speed: ``(N,)`` [m/s].
        other_speed: ``(N,)`` [m/s].
        gap: ``(N,)`` [m], from the ego's front to the other's rear; the regulation's ego follows at
            2 s.
        deceleration: ``(N,)`` [m/s²], >= 0, at once and constant.
        driver: one of `KNOWN`.

    Returns:
        ``(N,)`` bool.

    Raises:
        InputError: a value that is not finite or negative.
        UnknownNameError: no such model.
    """
    v, w, room, slowing = _arrays(
        ego_speed=ego_speed, other_speed=other_speed, gap=gap, deceleration=deceleration
    )
    travelled = np.zeros_like(w)

    def place(i: int) -> _Place:
        nonlocal travelled
        speed = np.maximum(w - i * slowing / RATE, 0.0)
        travelled = travelled + (speed if i else 0.0)
        overlap = np.full_like(w, -SIZE[1])
        return _Place(room + SIZE[0] + travelled / RATE, overlap, speed, np.zeros_like(w))

    return _shaped(
        _avoids(v, place, SIZE[0], SIZE[0], driver, cut_in=False),
        ego_speed,
        other_speed,
        gap,
        deceleration,
    )


def _arrays(**values: npt.ArrayLike) -> list[Float]:
    """Return values as flat arrays of one length, checked."""
    arrays = [np.asarray(value, dtype=np.float64) for value in values.values()]
    for name, array in zip(values, arrays, strict=True):
        bad = ~(np.isfinite(array) & (array >= 0.0))
        if bad.any():
            raise InputError(f"{name} must be finite and >= 0, got {array[bad].flat[0]:g}")
    return [item.ravel() for item in np.broadcast_arrays(*arrays)]


def _shaped(avoids: Bool, *values: npt.ArrayLike) -> Bool:
    return avoids.reshape(np.broadcast_shapes(*(np.shape(value) for value in values)))


def _avoids(
    v: Float,
    place: Callable[[int], _Place],
    ego_length: float,
    other_length: float,
    driver: str,
    *,
    cut_in: bool,
) -> Bool:
    """Step the model of a driver beside another that is at ``place(i)`` at instant i, in order.

    Positions follow from the speeds at the end of each step, as in the Commission's code.
    """
    if driver not in KNOWN:
        raise UnknownNameError("model of a careful driver", driver, KNOWN)
    half, both = 0.5 * (ego_length + other_length), ego_length + other_length
    x = v / RATE if cut_in else np.zeros_like(v)
    waits, brake, before = np.full_like(v, CAREFUL_REACTION), np.zeros_like(v), v.copy()
    collided, over = np.zeros(len(v), dtype=np.bool_), np.zeros(len(v), dtype=np.bool_)
    reacts = np.zeros(len(v), dtype=np.bool_)
    for i in range(round(LONGEST * RATE)):
        other = place(i)
        ahead, closing = other.x - x, v - other.speed
        gap = np.abs(ahead) - half
        if driver == "un-r157":
            risk, ended = _un_r157_risk(ahead, gap, closing, other.side, cut_in)
            over |= ended
            wanted = np.full_like(v, CAREFUL_BRAKING)
        elif driver == "rss":
            risk = _rss_risk(v, ahead, gap, other)
            wanted = np.full_like(v, CAREFUL_BRAKING)
        else:
            risk, wanted = _fsm_risk(v, (v - before) * RATE, ahead, gap, both, other)
        reacts |= risk
        waiting = waits > 0.0
        if driver == "un-r157":
            brake = np.where(risk & waiting, RELEASE, brake)
        pressed = np.minimum(brake + CAREFUL_JERK / RATE, wanted)
        brake = np.where(risk & ~waiting, pressed, brake)
        released = RELEASE if driver == "un-r157" else 0.0
        change = np.where(risk, np.where(waiting, released, brake), 0.0)
        waits = np.where(risk & waiting, waits - 1.0 / RATE, waits)
        collided |= ~over & (gap < 0.0) & (other.side < 0.0)
        before, v = v, np.maximum(v - change / RATE, 0.0)
        stands = before == 0.0
        over |= collided | (stands & (gap >= 0.0) if cut_in else stands)
        if cut_in:  # a vehicle that is passed, or gets away
            over |= (ahead < -half) | ((gap >= 0.0) & reacts & (closing <= 0.0))
        if over.all():
            break
        # By the speed at the step's end, as theirs; our own rule is the trapezoidal one, with which
        # 99.4 % of the cells agree at 20 Hz.
        x = x + v / RATE
    return ~collided


def _un_r157_risk(
    ahead: Float, gap: Float, closing: Float, side: Float, cut_in: bool
) -> tuple[Bool, Bool]:
    """Return where the driver reacts, and where the disturbance is no risk, so that it ends."""
    if not cut_in:
        return np.ones(len(ahead), dtype=np.bool_), np.zeros(len(ahead), dtype=np.bool_)
    overlaps = (ahead >= 0.0) & (side <= 0.0)
    # Beyond 2 s their run ends, and counts as no crash, so it does here; the driver `un-r157`
    # drives on.
    far = np.abs(gap) > CRITICAL_TTC * np.abs(closing)
    return overlaps & ~far, overlaps & far


def _fsm_risk(
    v: Float, a: Float, ahead: Float, gap: Float, both: float, other: _Place
) -> tuple[Bool, Float]:
    """Return where the distance is unsafe, and the deceleration that it requires [m/s²]."""
    w, closing = other.speed, v - other.speed
    with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
        past = (gap + both) / closing  # +inf if the other is as fast, < 0 if it is faster
        comes = np.where(other.inward > 0.0, other.side / other.inward, np.inf)
    counts = (ahead >= 0.0) & ((other.side <= 0.0) | ((comes <= past + SLACK) & (comes < np.inf)))
    stops = w * w / (2.0 * LEADER_BRAKING)
    safe = v * CAREFUL_REACTION + v * v / (2.0 * COMFORT_BRAKING) - stops + SAFE_MARGIN
    unsafe = v * CAREFUL_REACTION + v * v / (2.0 * FSM_BRAKING) - stops
    proactive = _share(gap - STANDSTILL, safe, unsafe)
    after = v + np.maximum(a, -COMFORT_BRAKING) * CAREFUL_REACTION
    lost, rest = (0.5 * (v + after) - w) * CAREFUL_REACTION, (after - w) ** 2
    goes_on = _share(gap, lost + rest / (2.0 * COMFORT_BRAKING), lost + rest / (2.0 * FSM_BRAKING))
    with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
        held = gap < closing**2 / np.abs(2.0 * a)
    critical = np.where(after < w, held, goes_on)
    critical = np.where(closing <= 0.0, 0.0, critical)
    urgent = COMFORT_BRAKING + critical * (FSM_BRAKING - COMFORT_BRAKING)
    wanted = np.where(critical > 0.0, urgent, proactive * COMFORT_BRAKING)
    return counts & (wanted > 0.0), wanted


def _rss_risk(v: Float, ahead: Float, gap: Float, other: _Place) -> Bool:
    """Return where both distances are less than RSS demands; the ego keeps to its way."""
    rho, hardest = CAREFUL_REACTION, 2.0 * RSS_BRAKING
    long = v * rho + 0.5 * RSS_ACCELERATION * rho**2 + (v + rho * RSS_ACCELERATION) ** 2 / hardest
    long -= other.speed**2 / hardest
    after = other.inward + RSS_LATERAL * rho
    across = RSS_MARGIN + 0.5 * (other.inward + after) * rho + after**2 / (2.0 * RSS_LATERAL)
    risk: Bool = (ahead >= 0.0) & (gap < long) & (other.side < across)
    return risk


def _share(gap: Float, safe: Float, unsafe: Float) -> Float:
    """Return how unsafe a gap is: 0 from ``safe`` on, 1 below ``unsafe``, linear between [m]."""
    with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
        between = (gap - safe) / (unsafe - safe)
    return np.where(gap > safe, 0.0, np.where(gap < unsafe, 1.0, between))
