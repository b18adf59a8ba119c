"""An evolution strategy, pymoo's."""

import math
from collections.abc import Mapping
from typing import Any, ClassVar

from bridgegen.search.algorithms.algorithm import RESTART_WITHIN, Arity, Setting
from bridgegen.search.algorithms.evolved import Evolved


class ES(Evolved):
    """The best of a generation's children become the next parents; no parent survives.

    Each individual has its own step sizes, one per parameter, which mutate before use (log-normal
    self-adaptation); some children move by differences of parents instead. The first generation is
    drawn anywhere, as many as there are parents.

    Source: Runarsson and Yao (2005), "Search biases in constrained evolutionary optimization",
    without its constraints.
    """

    name: ClassVar[str] = "es"
    description: ClassVar[str] = "evolution strategy of one objective, steps self-adapted (pymoo)"
    source: ClassVar[str] = "Runarsson and Yao (2005), doi:10.1109/TSMCC.2004.841906"
    settings: ClassVar[Mapping[str, Setting]] = {
        "children": Setting(
            40, "children of a generation, and rows per batch", low=4, high=100_000
        ),
        "parents": Setting(
            0.15, "share of the children that become parents; at least two", 0.01, 0.5
        ),
        "gamma": Setting(0.85, "length of the steps by differences of parents", 0.0, 2.0),
        "restart_within": RESTART_WITHIN,
    }
    objectives: ClassVar[Arity] = "one"
    asynchronous: ClassVar[bool] = True

    def _build(self) -> Any:
        from pymoo.algorithms.soo.nonconvex import es

        children = self._values["children"]
        parents = min(max(2, math.ceil(children * self._values["parents"])), children // 2)
        return es.ES(n_offsprings=children, pop_size=parents, gamma=self._values["gamma"])
