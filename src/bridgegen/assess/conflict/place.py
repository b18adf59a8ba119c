"""Place of a conflict on the ego's route: before, in, between or after its junctions."""

import numpy as np
import numpy.typing as npt

from bridgegen.base.arrays import Float

BEFORE, IN = "before the junction", "in the junction"
BETWEEN, AFTER = "between junctions", "after the junction"


def place_on_route(way: Float, step: float, junctions: Float, x: Float, y: Float) -> list[str]:
    """Return the places of points relative to the junctions on a route.

    A point counts at the sample of the route that is nearest to it.

    Args:
        way: ``(L, 2)`` [m], samples of the route.
        step: between two samples [m].
        junctions: ``(J, 2)`` [m], stations at which the route enters and leaves each.
        x: ``(N,)`` [m].
        y: ``(N,)`` [m].

    Returns:
        N labels; "" where the route leads through no junction.
    """
    if not len(junctions):
        return [""] * len(x)
    from scipy.spatial import cKDTree

    nearest = np.asarray(cKDTree(way).query(np.stack([x, y], axis=1))[1], dtype=np.float64)
    s = step * nearest
    inside = ((junctions[:, 0] <= s[:, np.newaxis]) & (s[:, np.newaxis] <= junctions[:, 1])).any(1)
    labels: npt.NDArray[np.str_] = np.select(
        [inside, s < junctions[0, 0], s > junctions[-1, 1]], [IN, BEFORE, AFTER], BETWEEN
    )
    return [str(label) for label in labels]
