"""Does the ego collide now? For rollouts of which nothing later is needed."""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

from bridgegen.base import _elementary_kernels as elementary
from bridgegen.base.compiled import kernel
from bridgegen.drivers._emergency_kernels import boxes_meet

SHRUNK = 0.01
"""Length by which half lengths and widths of boxes are smaller here [m]: two that meet all the same
overlap by 2 cm at least, which is no touch by rounding."""


@kernel
def collides(k, plan, record):
    """Return whether the ego's box, and another's that is present, overlap at instant k."""
    always = record.present.shape[0] == 0
    if not (always or record.present[0, k]):
        return False
    own, h = plan.bodies[0], record.h[0, k]
    x = record.x[0, k] + own[2] * elementary.cos(h)
    y = record.y[0, k] + own[2] * elementary.sin(h)
    for e in range(1, record.x.shape[0]):
        other, turned = plan.bodies[e], record.h[e, k]
        reach = 0.5 * (own[0] + own[1] + other[0] + other[1]) + abs(other[2])
        dx, dy = record.x[e, k] - x, record.y[e, k] - y
        # A cheap test first: most entities are far away at most instants.
        if abs(dx) > reach or abs(dy) > reach or not (always or record.present[e, k]):
            continue
        dx += other[2] * elementary.cos(turned)
        dy += other[2] * elementary.sin(turned)
        if boxes_meet(
            dx,
            dy,
            h,
            0.5 * own[0] - SHRUNK,
            0.5 * own[1] - SHRUNK,
            turned,
            0.5 * other[0] - SHRUNK,
            0.5 * other[1] - SHRUNK,
        ):
            return True
    return False
