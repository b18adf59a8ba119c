"""Which of many rows a model learns from."""

import numpy as np

from bridgegen.base.arrays import Float, Int


def telling(values: Float, count: int) -> Int:
    """Return which rows a model keeps if it can have only some: ascending places.

    Half of them are those with the smallest values; the others are spread evenly over the ranks of
    the rest, so that the model knows the whole range. Ties go by their order.
    """
    if len(values) <= count:
        return np.arange(len(values))
    order = np.argsort(values, kind="stable")
    smallest, others = order[: count // 2], order[count // 2 :]
    spread = np.linspace(0, len(others) - 1, count - len(smallest)).round().astype(np.int64)
    return np.sort(np.concatenate([smallest, others[spread]]))
