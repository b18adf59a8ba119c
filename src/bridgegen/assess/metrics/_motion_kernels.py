"""Compiled box centres of bodies; public wrapper: ``motion.motion``."""

from bridgegen.base.arrays import Float, Int
from bridgegen.base.compiled import kernel


@kernel
def place(
    box: Float, x: Float, y: Float, cosine: Float, sine: Float, n_steps: Int,
    centre_x: Float, centre_y: Float,
) -> None:  # fmt: skip
    """Write the centre of each body's box."""
    n_rows, n_entities, _ = x.shape
    for i in range(n_rows):
        for e in range(n_entities):
            ahead = box[e, 2]
            for k in range(n_steps[i]):
                centre_x[i, e, k] = x[i, e, k] + ahead * cosine[i, e, k]
                centre_y[i, e, k] = y[i, e, k] + ahead * sine[i, e, k]
