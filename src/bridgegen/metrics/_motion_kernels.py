"""Compiled places and directions of bodies; public wrapper: ``motion.motion``."""

from bridgegen.arrays import Float, Int
from bridgegen.compiled import kernel
from bridgegen.simulation._box_kernels import directions


@kernel
def place(
    box: Float, x: Float, y: Float, h: Float, n_steps: Int,
    cosine: Float, sine: Float, centre_x: Float, centre_y: Float,
) -> None:  # fmt: skip
    """Write each body's direction and its box's centre."""
    n_rows, n_entities, _ = x.shape
    for i in range(n_rows):
        n = n_steps[i]
        for e in range(n_entities):
            c, s, ahead = cosine[i, e], sine[i, e], box[e, 2]
            directions(h[i, e], n, c, s)
            for k in range(n):
                centre_x[i, e, k] = x[i, e, k] + ahead * c[k]
                centre_y[i, e, k] = y[i, e, k] + ahead * s[k]
