"""Compiled severity of a collision; public wrappers and constants: ``severity``."""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

from bridgegen.assess.conflict.severity import (
    FADE,
    FRICTION,
    INTERCEPTS,
    MASS,
    SLOPES,
    UNPROTECTED,
)
from bridgegen.base import _elementary_kernels as elementary
from bridgegen.base.compiled import kernel
from bridgegen.drivers.kinds import CAR, IS_OBSTACLE

RESULTS = 6
"""Number of rows of what ``collisions`` finds."""


@kernel
def effective_speed(normal, tangential):
    """Return the part of a closing velocity that a plastic collision takes away [m/s]."""
    normal, tangential = normal if not normal <= 0.0 else 0.0, abs(tangential)
    slides = FRICTION * normal
    if not tangential >= slides and slides == slides:  # NaN stays NaN
        slides = tangential
    return elementary.hypot(normal, slides)


@kernel
def shares(a, b, movable_a, movable_b):
    """Return each party's share of the closing speed: the inverse masses over their sum."""
    mine = 0.0 if IS_OBSTACLE[a] and not movable_a else 1.0 / MASS[a]
    its = 0.0 if IS_OBSTACLE[b] and not movable_b else 1.0 / MASS[b]
    total = mine + its
    if not total > 0.0:
        total = 1.0
    return mine / total, its / total


@kernel
def p_mais3(kind, v, direction):
    """Return the probability that a person in or on a participant is injured at MAIS3+."""
    # A logistic curve is above 0 at standstill; `FADE` takes it there.
    power = -(INTERCEPTS[kind, direction] + SLOPES[kind, direction] * v)
    logistic = 1.0 / (1.0 + elementary.exp(power))
    slow = v / FADE
    return -elementary.expm1(-(slow * slow)) * logistic


@kernel
def injury(kind, share, speed, direction):
    """Return the probability of MAIS3+ of a party with a share of a collision's speed."""
    # The curves of those without a body around them are by closing speed with a passenger car:
    # other partners count by the change of velocity that they cause.
    if UNPROTECTED[kind]:
        share = share / (MASS[CAR] / (MASS[CAR] + MASS[kind]))
    return p_mais3(kind, share * speed, direction)


@kernel
def collision(a, b, normal, tangential, direction_a, direction_b, movable_a, movable_b):
    """Return what ``collisions`` finds, of one collision."""
    speed = effective_speed(normal, tangential)
    mine, its = shares(a, b, movable_a, movable_b)
    injury_a = injury(a, mine, speed, direction_a)
    injury_b = injury(b, its, speed, direction_b)
    worst = injury_a if injury_a > injury_b or injury_a != injury_a else injury_b
    return speed, mine * speed, its * speed, injury_a, injury_b, worst


@kernel
def severity(a, b, normal, tangential, direction_a, direction_b, movable_b):
    """Return the severity of a collision in which a is movable."""
    _, _, _, _, _, worst = collision(
        a, b, normal, tangential, direction_a, direction_b, True, movable_b
    )
    return worst


@kernel
def collisions(
    kind_a, kind_b, normal, tangential, direction_a, direction_b, movable_a, movable_b, out
):
    """Fill ``out`` ``(RESULTS, N)``.

    Its rows: the effective speed, the changes of both velocities, both injuries, the severity.
    """
    for i in range(len(kind_a)):
        found = collision(
            kind_a[i], kind_b[i], normal[i], tangential[i], direction_a[i], direction_b[i],
            movable_a[i], movable_b[i],
        )  # fmt: skip
        for j in range(RESULTS):
            out[j, i] = found[j]


@kernel
def probabilities(kind, speed, direction, out):
    """Fill ``out`` ``(N,)`` with `p_mais3`."""
    for i in range(len(kind)):
        out[i] = p_mais3(kind[i], speed[i], direction[i])
