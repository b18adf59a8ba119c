"""What gravity does to an entity where it is; see ``slopes``."""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

from bridgegen.base.compiled import kernel

UPHILL, ASIDE, RELIEF = 0, 1, 2  # columns of Roads.slopes


@kernel
def slope(e, roads, state):
    """Return gravity against an entity's motion and to its right [m/s²], and the tyres' share.

    The last is how hard the road is pressed upon [1], 1 on a level one. Off the lanes, roads are
    level.
    """
    p = state.on[e]
    if p < 0 or roads.slopes.shape[1] == 0:
        return 0.0, 0.0, 1.0
    i = int(state.station[e] / roads.steps[p])
    if i < 0 or i >= roads.slopes.shape[1]:
        return 0.0, 0.0, 1.0
    row = roads.slopes[p, i]
    return row[UPHILL], row[ASIDE], 1.0 - row[RELIEF]
