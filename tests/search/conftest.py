"""What the tests of several algorithms share."""

from dataclasses import fields

import numpy as np
import pytest

from bridgegen.search.algorithms import Algorithm, Results


class Late:
    """An algorithm that gets results late, though it is told them after each batch.

    Args:
        search: the algorithm.
        ahead: how many rows are not told; all of the first batch are.
    """

    def __init__(self, search: Algorithm, ahead: int) -> None:
        self.search, self.ahead = search, ahead
        self.U: np.ndarray | None = None
        self.results: Results | None = None

    def ask(self) -> np.ndarray:
        return self.search.ask()

    def tell(self, U: np.ndarray, results: Results) -> None:
        if self.U is None or self.results is None:
            self.search.tell(U, results)
            self.U, self.results = U[:0], taken(results, slice(0))
            return
        self.U = np.concatenate([self.U, U])
        self.results = Results(
            *(
                np.concatenate([getattr(self.results, one.name), getattr(results, one.name)])
                for one in fields(Results)
            )
        )
        n = len(self.U) - self.ahead
        if n > 0:
            self.search.tell(self.U[:n], taken(self.results, slice(n)))
            self.U, self.results = self.U[n:], taken(self.results, slice(n, None))


def taken(results: Results, rows: slice) -> Results:
    """Return the results of some rows."""
    return Results(*(getattr(results, one.name)[rows] for one in fields(Results)))


@pytest.fixture
def late() -> type[Late]:
    """Return the class of algorithms that get results late."""
    return Late
