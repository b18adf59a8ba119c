"""The search algorithms, one file each, behind one ask/tell protocol over the unit cube.

``get(name)`` returns an algorithm's class, ``names()`` lists them; an installed package adds its
own through the entry-point group ``bridgegen.algorithms``.
"""

from bridgegen.search.algorithms.algorithm import (
    Algorithm,
    Problem,
    Restorable,
    Results,
    Setting,
    TakesNotes,
)
from bridgegen.search.algorithms.registry import ALGORITHMS, get, names

__all__ = [
    "ALGORITHMS",
    "Algorithm",
    "Problem",
    "Restorable",
    "Results",
    "Setting",
    "TakesNotes",
    "get",
    "names",
]
