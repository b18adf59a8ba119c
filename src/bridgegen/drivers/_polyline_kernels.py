"""Polylines of the map in the egos' frames."""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

from bridgegen.base.compiled import kernel


@kernel
def gather_points(at, counts, pieces, directions, x, y, cosine, sine, points, mask):
    """Fill ``points`` ``(N, Q, V, 4)`` and ``mask`` ``(N, Q, V)``, which are zeros.

    ``at`` ``(N, Q)`` are rows of ``pieces`` ``(K, V, 3)`` and of ``directions`` ``(K, V, 2)``, the
    first ``counts`` ``(K,)`` points of which count; the ego of row i is at x, y with a heading.
    """
    for i in range(at.shape[0]):
        c, s = cosine[i], sine[i]
        for q in range(at.shape[1]):
            k = at[i, q]
            for j in range(counts[k]):
                dx, dy = pieces[k, j, 0] - x[i], pieces[k, j, 1] - y[i]
                u, w = directions[k, j, 0], directions[k, j, 1]
                points[i, q, j, 0], points[i, q, j, 1] = dx * c + dy * s, dy * c - dx * s
                points[i, q, j, 2], points[i, q, j, 3] = u * c + w * s, w * c - u * s
                mask[i, q, j] = True
