"""Distance between the ego's oriented box and every other's, over whole rollouts."""

import numpy as np
import numpy.typing as npt

from bridgegen.base.arrays import Bool, Float, Int, as_float


def box_distance(
    box: npt.ArrayLike,
    x: npt.ArrayLike,
    y: npt.ArrayLike,
    h: npt.ArrayLike,
    n_steps: npt.ArrayLike,
    direction: tuple[Float, Float] | None = None,
) -> Float:
    """Return the distance from entity 0's oriented box to each other's at every instant.

    Args:
        box: ``(E, 3)`` [m]: length > 0, width > 0, distance of the box's centre ahead of the
            reference point.
        x: ``(N, E, T)`` [m], reference point.
        y: ``(N, E, T)`` [m], reference point.
        h: ``(N, E, T)`` [rad], heading.
        n_steps: ``(N,)`` in 1..T, the instants that are real.
        direction: what `directions` gives for h, if it is known.

    Returns:
        ``(N, E, T)`` float64 [m]: 0 where the boxes touch or overlap, +inf for entity 0 itself;
        instants from ``n_steps`` on repeat the last real one.

    Raises:
        ValueError: a shape differs, a value is not finite, a box has no area.
    """
    from bridgegen.simulation import _box_kernels

    x = as_float("x [m]", x, (None, None, None))
    n, e, t = x.shape
    y = as_float("y [m]", y, (n, e, t))
    h = as_float("h [rad]", h, (n, e, t))
    box = as_float("box [m]", box, (e, 3))
    if e < 1 or not (box[:, :2] > 0.0).all():
        raise ValueError(f"box [m] must hold lengths and widths > 0 of ≥ 1 entity, got {box}")
    out = np.empty((n, e, t))
    cosine, sine = directions(h, n_steps) if direction is None else direction
    _box_kernels.box_distance(box, x, y, cosine, sine, as_steps(n_steps, n, t), out)
    return out


def directions(h: npt.ArrayLike, n_steps: npt.ArrayLike) -> tuple[Float, Float]:
    """Return the cosine and the sine of headings ``(N, E, T)``; padded instants are unset.

    Raises:
        ValueError: a shape differs, a heading is not finite.
    """
    from bridgegen.simulation import _box_kernels

    h = as_float("h [rad]", h, (None, None, None))
    cosine, sine = np.empty(h.shape), np.empty(h.shape)
    _box_kernels.directions_of(h, as_steps(n_steps, h.shape[0], h.shape[2]), cosine, sine)
    return cosine, sine


def leave_out(present: Bool, e: int, distance: Float) -> Float:
    """Return distances from body e ``(N, E, T)``, +inf where one of the two is not present."""
    from bridgegen.simulation import _box_kernels

    present = np.ascontiguousarray(present, dtype=np.bool_)
    distance = np.ascontiguousarray(distance)
    _box_kernels.leave_out_of_rows(present, e, distance)
    return distance


def as_steps(n_steps: npt.ArrayLike, n: int, t: int) -> Int:
    """Return ``n_steps`` as a C-contiguous ``(n,)`` int64 array, each in 1..t.

    Raises:
        ValueError: not whole numbers, another shape, or out of range.
    """
    given = np.asarray(n_steps)
    if given.shape != (n,) or given.dtype.kind not in "iu":
        raise ValueError(f"n_steps must be ({n},) whole numbers, got {given.dtype} {given.shape}")
    steps = np.ascontiguousarray(given, dtype=np.int64)
    if n and (steps.min() < 1 or steps.max() > t):
        raise ValueError(f"n_steps must be in 1..{t}, got {steps.min()} to {steps.max()}")
    return steps
