"""Severity of a collision: the probability of a serious injury, from published curves.

Severity is the probability that the person at the highest risk in either party is injured at
MAIS 3 or more: the maximum abbreviated injury scale "serious", fatal injuries included. Three steps
lead to it:

1. The two bodies collide plastically, friction limits what their surfaces transfer along each
   other (`effective_speed`), and the masses divide the change of velocity (`delta_v`).
2. A logistic curve gives the probability of MAIS3+ (`p_mais3`): of occupants of a car, truck or bus
   by their vehicle's delta-v and the direction of the force; of pedestrians, cyclists and
   motorcyclists by the closing speed against a car's front.
3. The party at the higher risk counts (`severity`).

Only relative velocities count, not which party moves. Trucks and buses have no curve of their own:
those of car occupants are used. ``docs/severity.md`` has the table of constants, the check of each
curve, and the limits.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from bridgegen.base.arrays import Float, Int
from bridgegen.drivers.kinds import CAR, NAMES
from bridgegen.scenario.participants import OBJECT_CLASSES

FRONT, REAR, SIDE = range(3)
"""Direction of the force on a vehicle: the end or side that is struck."""

DIRECTIONS = ("front", "rear", "side")
"""Directions of the force on an occupied vehicle, by code."""

MASS: Float = np.array([object_class.mass for object_class in OBJECT_CLASSES])
"""Mass [kg] by `bridgegen.drivers.kinds`, as in exported storyboards.

Source: car 1,500 (a van is a ``CAR`` too): default of SUMO; mean of new cars in the EU 1,392 (ICCT,
European Vehicle Market Statistics 2017/18, section 5), plus a passenger. Truck 16,000 and bus
18,000: two axles, at most 18,000 (Directive 96/53/EC, Annex I, 2.3.1). Motorcycle 300: 200 (SUMO)
and its rider with clothing and luggage. Bicycle 95: rider and a 20 kg bicycle. Pedestrian 75: a
driver's mass in Regulation (EU) No 1230/2012, Article 2(4). Animal 25 (a roe deer) and other 50 (an
obstacle that can be pushed): ours. SUMO: documentation, "Vehicle Type Parameter Defaults".
"""
MASS.setflags(write=False)

FRICTION = 0.55
"""Friction coefficient [1] between two vehicles' surfaces in a collision.

Source: McHenry and McHenry (1997), "SMAC-97: refinement of the collision algorithm", SAE 970947:
normal value 0.55, recommended range 0.3 to 1.0.
"""

_KMH = 3.6  # km/h in 1 m/s
_MPH = 3600.0 / 1609.344  # mile/h in 1 m/s

AGE = {"pedestrian": 46.0, "bicycle": 39.0, "motorcycle": 40.0}
"""Age [years] at which the curves of Lubbe et al. (2022) are taken.

Pedestrians and cyclists: the medians of their sample. Motorcyclists: the age at which their
coefficients give their 10 % at 48 km/h.
"""


@dataclass(frozen=True)
class Curve:
    """A logistic curve: P(MAIS3+) = 1 / (1 + exp(-(intercept + slope v))).

    Attributes:
        intercept: [1].
        slope: per m/s.
        variable: the quantity v: "delta-v" or "closing speed".
        source: of intercept and slope.
    """

    intercept: float
    slope: float
    variable: str
    source: str


def _lubbe(injured: str, table: int, intercept: float, per_kmh: float, per_year: float) -> Curve:
    return Curve(
        intercept + per_year * AGE[injured],
        per_kmh * _KMH,
        "closing speed",
        "Lubbe, Wu and Jeppsson (2022), Safe speeds: fatality and injury risks of pedestrians, "
        "cyclists, motorcyclists, and car drivers impacting the front of another passenger car as "
        "a function of closing speed and age, Traffic Safety Research 2:000006, "
        f"doi:10.55329/vfma7555, Table {table}, MAIS3+F",
    )


def _wang(table: str, intercept: float, per_mph: float) -> Curve:
    return Curve(
        intercept,
        per_mph * _MPH,
        "delta-v",
        "Wang (2022), MAIS(05/08) injury probability curves as functions of delta V, NHTSA, "
        f"DOT HS 813 219, Table {table}, MAIS3+",
    )


_FRONT = _wang("A-6 (and 4-3), frontal", -6.9774, 0.1620)
_LOG_ODDS = -2.197224577336219  # ln(0.1 / 0.9); to call for it here would import the compiler
_SIDE_TEN_PERCENT = 73.0 / 2.0 / _KMH  # delta-v of equal masses that close at 73 km/h

CURVES = {
    "pedestrian": _lubbe("pedestrian", 2, -6.190, 0.078, 0.038),
    "bicycle": _lubbe("bicycle", 3, -7.467, 0.079, 0.047),
    "motorcycle": _lubbe("motorcycle", 4, -4.555, 0.040, 0.011),
    "front": _FRONT,
    "rear": _wang("A-9, rear-end", -8.0329, 0.1793),
    "side": Curve(
        _LOG_ODDS - _FRONT.slope * _SIDE_TEN_PERCENT,
        _FRONT.slope,
        "delta-v",
        "TARGET setting for high severity collisions: tolerance-based assessment of risk for "
        "generalized event thresholds, Traffic Safety Research, article 27552, abstract: 10 % "
        "MAIS3+ at a closing speed of 73 km/h, near side; masses taken as equal, slope as in "
        "Wang's frontal curve",
    ),
}
"""Curves by the injured person, or by the direction of the force on an occupied vehicle."""

FADE = 2.0
"""Speed [m/s] below which a curve fades out, see `p_mais3`. Ours, about a fast walk."""


def _tables() -> tuple[Float, Float]:
    """Return intercepts and slopes, (kinds, directions); without persons, -inf and 0."""
    shape = (len(NAMES), len(DIRECTIONS))
    intercept, slope = np.full(shape, -np.inf), np.zeros(shape)
    for kind, object_class in enumerate(OBJECT_CLASSES):
        if object_class.injury is None:
            continue
        for direction, name in enumerate(DIRECTIONS):
            curve = CURVES[name if object_class.injury == "occupant" else object_class.injury]
            intercept[kind, direction], slope[kind, direction] = curve.intercept, curve.slope
    return intercept, slope


INTERCEPTS, SLOPES = _tables()
"""Of the curve by kind and direction of the force."""

UNPROTECTED = tuple(
    object_class.injury not in (None, "occupant") for object_class in OBJECT_CLASSES
)
"""Whether the curve of each kind is of the closing speed to a car."""


def effective_speed(closing_normal: npt.ArrayLike, closing_tangential: npt.ArrayLike) -> Float:
    """Return the part of the closing velocity that a plastic collision takes away.

    All of the normal part, and of the tangential part what friction can stop while the normal
    impulse lasts: ``sqrt(n² + min(FRICTION n, |t|)²)``. Bodies are point masses: they do not
    rotate, so that this is an upper bound for an eccentric impact.

    Args:
        closing_normal: ``(N,)`` [m/s], along the contact's normal; bodies that separate (≤ 0) have
            0. NaN stays NaN.
        closing_tangential: ``(N,)`` [m/s], along the contact's surface, of either sign.

    Returns:
        ``(N,)`` [m/s], ≥ 0; strictly increasing in the normal part, increasing in the size of the
        tangential part.
    """
    return _collide(CAR, CAR, closing_normal, closing_tangential)[0]


def delta_v(
    kind_a: npt.ArrayLike,
    kind_b: npt.ArrayLike,
    closing_normal: npt.ArrayLike,
    closing_tangential: npt.ArrayLike,
    movable_a: npt.ArrayLike = True,
    movable_b: npt.ArrayLike = True,
) -> tuple[Float, Float]:
    """Return the change of either party's velocity in a plastic collision.

    The impulse is the reduced mass times `effective_speed`; each velocity changes by it over the
    own mass (`MASS`), so that momentum is conserved.

    Args:
        kind_a: ``(N,)`` of `bridgegen.drivers.kinds`.
        kind_b: ``(N,)``, of the other party.
        closing_normal: ``(N,)`` [m/s], see `effective_speed`.
        closing_tangential: ``(N,)`` [m/s].
        movable_a: ``(N,)`` bool; an ``OTHER`` that is not movable (a barrier, a post) has infinite
            mass. Any other kind is movable, also where it stands.
        movable_b: ``(N,)`` bool.

    Returns:
        Of a and of b: ``(N,)`` [m/s], ≥ 0; both 0 between two immovable bodies.

    Raises:
        ValueError: a kind does not exist.
    """
    _, change_a, change_b, *_ = _collide(
        kind_a, kind_b, closing_normal, closing_tangential, FRONT, FRONT, movable_a, movable_b
    )
    return change_a, change_b


def p_mais3(kind: npt.ArrayLike, speed: npt.ArrayLike, direction: npt.ArrayLike) -> Float:
    """Return the probability that a person in or on a participant has an injury of MAIS 3 or more.

    A logistic curve is above 0 at speed 0. It is therefore multiplied by ``1 - exp(-(v / FADE)²)``,
    which is 0 at 0, strictly increasing, above 0.98 from 4 m/s (14 km/h) and above 0.999 from
    5.3 m/s (19 km/h) on: published values are kept where the data are.

    Args:
        kind: ``(N,)`` of `bridgegen.drivers.kinds`; the probability is 0 where `ObjectClass.injury`
            is None.
        speed: ``(N,)`` [m/s], ≥ 0: of a car, truck or bus its delta-v; of a pedestrian, bicycle or
            motorcycle the closing speed against a car's front. NaN stays NaN.
        direction: ``(N,)`` of `FRONT`, `REAR`, `SIDE`: of the force on a car, truck or bus; without
            effect for the others.

    Returns:
        ``(N,)`` in [0, 1].

    Raises:
        ValueError: a kind or direction does not exist, or a speed is negative.

    Source: `CURVES`.
    """
    from bridgegen.assess.conflict import _severity_kernels as kernels  # which imports this one

    kind, direction = (
        _codes("kind", kind, NAMES),
        _codes("direction", direction, DIRECTIONS),
    )
    v = np.asarray(speed, dtype=np.float64)
    if (v < 0.0).any():
        raise ValueError(f"speed [m/s] must be >= 0, got {v[v < 0.0][0]}")
    given = np.broadcast_arrays(kind, v, direction)
    found = np.empty(given[0].shape)
    kernels.probabilities(*(array.ravel() for array in given), found.reshape(-1))
    return found


def injuries(
    kind_a: npt.ArrayLike,
    kind_b: npt.ArrayLike,
    closing_normal: npt.ArrayLike,
    closing_tangential: npt.ArrayLike,
    direction_a: npt.ArrayLike,
    direction_b: npt.ArrayLike,
    movable_a: npt.ArrayLike = True,
    movable_b: npt.ArrayLike = True,
) -> tuple[Float, Float]:
    """Return the probability of MAIS3+ of either party of a collision.

    Occupants of a car, truck or bus: `p_mais3` of `delta_v`. Pedestrians, cyclists and
    motorcyclists: `p_mais3` of the closing speed to a car that would change their velocity as much
    as this collision does. In a collision with a car it is `effective_speed`: at its front that
    is the relative speed; at its side it is the person's speed towards it, plus what friction adds.

    Args:
        kind_a: ``(N,)`` of `bridgegen.drivers.kinds`.
        kind_b: ``(N,)``, of the other party.
        closing_normal: ``(N,)`` [m/s], along the contact's normal, see `effective_speed`.
        closing_tangential: ``(N,)`` [m/s], along the contact's surface.
        direction_a: ``(N,)`` of `FRONT`, `REAR`, `SIDE`: of the force on a.
        direction_b: ``(N,)``, on b.
        movable_a: ``(N,)`` bool, see `delta_v`.
        movable_b: ``(N,)`` bool.

    Returns:
        Of a and of b: ``(N,)`` in [0, 1]; NaN where a closing speed is.

    Raises:
        ValueError: a kind or direction does not exist.
    """
    *_, injury_a, injury_b, _ = _collide(
        kind_a,
        kind_b,
        closing_normal,
        closing_tangential,
        direction_a,
        direction_b,
        movable_a,
        movable_b,
    )
    return injury_a, injury_b


def severity(
    kind_a: npt.ArrayLike,
    kind_b: npt.ArrayLike,
    closing_normal: npt.ArrayLike,
    closing_tangential: npt.ArrayLike,
    direction_a: npt.ArrayLike,
    direction_b: npt.ArrayLike,
    movable_a: npt.ArrayLike = True,
    movable_b: npt.ArrayLike = True,
) -> Float:
    """Return the severity of a collision: the higher of both parties' `injuries`.

    It is 0 at closing speed 0, strictly increasing in the normal closing speed (as far as a float64
    can be: below 1 and above 1e-150 m/s) where a person is involved, increasing in the tangential
    one, and the same for (a, b) as for (b, a).

    Args:
        kind_a: ``(N,)`` of `bridgegen.drivers.kinds`.
        kind_b: ``(N,)``, of the other party.
        closing_normal: ``(N,)`` [m/s], along the contact's normal, see `effective_speed`.
        closing_tangential: ``(N,)`` [m/s], along the contact's surface.
        direction_a: ``(N,)`` of `FRONT`, `REAR`, `SIDE`: of the force on a.
        direction_b: ``(N,)``, on b.
        movable_a: ``(N,)`` bool, see `delta_v`.
        movable_b: ``(N,)`` bool.

    Returns:
        ``(N,)`` in [0, 1]; NaN where a closing speed is.

    Raises:
        ValueError: a kind or direction does not exist.
    """
    *_, worst = _collide(
        kind_a,
        kind_b,
        closing_normal,
        closing_tangential,
        direction_a,
        direction_b,
        movable_a,
        movable_b,
    )
    return worst


def _collide(
    kind_a: npt.ArrayLike,
    kind_b: npt.ArrayLike,
    closing_normal: npt.ArrayLike,
    closing_tangential: npt.ArrayLike,
    direction_a: npt.ArrayLike = FRONT,
    direction_b: npt.ArrayLike = FRONT,
    movable_a: npt.ArrayLike = True,
    movable_b: npt.ArrayLike = True,
) -> tuple[Float, ...]:
    """Return what ``_severity_kernels.collisions`` finds of collisions, ``(N,)`` each."""
    from bridgegen.assess.conflict import _severity_kernels as kernels  # which imports this one

    given = np.broadcast_arrays(
        _codes("kind_a", kind_a, NAMES),
        _codes("kind_b", kind_b, NAMES),
        np.asarray(closing_normal, dtype=np.float64),
        np.asarray(closing_tangential, dtype=np.float64),
        _codes("direction_a", direction_a, DIRECTIONS),
        _codes("direction_b", direction_b, DIRECTIONS),
        np.asarray(movable_a, dtype=np.bool_),
        np.asarray(movable_b, dtype=np.bool_),
    )
    found = np.empty((kernels.RESULTS, *given[0].shape))
    flat = found.reshape(kernels.RESULTS, given[0].size)
    kernels.collisions(*(array.ravel() for array in given), flat)
    return tuple(np.asarray(array) for array in found)


def _codes(name: str, value: npt.ArrayLike, names: tuple[str, ...]) -> Int:
    """Return codes as int64.

    Raises:
        ValueError: one is not the number of a name.
    """
    codes = np.asarray(value, dtype=np.int64)
    wrong = (codes < 0) | (codes >= len(names))
    if wrong.any():
        raise ValueError(
            f"{name} must be 0 to {len(names) - 1} ({', '.join(names)}), got {codes[wrong][0]}"
        )
    return codes
