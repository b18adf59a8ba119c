"""The state of a search with a surrogate: the rows it knows, its generator, and a few numbers."""

import json
from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np

from bridgegen.search.surrogates.gaussian_process import Parameters
from bridgegen.search.surrogates.known import Known


class Saved(ABC):
    """An algorithm that learns models of the rows it knows; see `Restorable`.

    A replay would fit all models again, 10 ms for each row.
    """

    name: ClassVar[str]
    _values: Mapping[str, Any]
    _known: Known
    _rng: np.random.Generator

    @abstractmethod
    def _more(self) -> Any:
        """Return all that the next rows depend on besides, as JSON."""

    @abstractmethod
    def _take(self, more: Any) -> None:
        """Take what `_more` returned, after the known rows.

        Raises:
            ValueError, TypeError, KeyError, IndexError: it did not return this.
        """

    # The known rows determine all but the generator and the models' parameters; a replay would fit
    # every model again.
    def state(self) -> bytes:
        """Return a line of JSON, then the known rows as plain numbers."""
        known = self._known
        table = np.column_stack([known.U, known.F, known.critical])
        head = self._header() | {"generator": self._rng.bit_generator.state, "more": self._more()}
        return json.dumps(head).encode() + b"\n" + table.tobytes()

    def restore(self, state: bytes) -> None:
        """Restore the state of an algorithm.

        Raises:
            ValueError: the state is of another algorithm or other settings; or it is damaged.
        """
        known = self._known
        n_var = known.U.shape[1]
        line, _, rest = state.partition(b"\n")
        try:
            head = json.loads(line)
            # A state of other settings would continue another search without a word.
            if {key: head[key] for key in self._header()} != self._header():
                raise ValueError(f"it is not a state of {self.name} with these settings")
            table = np.frombuffer(rest, np.float64).reshape(-1, n_var + 2)
            U, F, critical = table[:, :n_var], table[:, n_var], table[:, n_var + 1]
            if not ((U >= 0.0) & (U <= 1.0)).all() or np.isnan(F).any():
                raise ValueError("its rows are not those of a search")
            known.add(U, F, np.ones(len(F), np.bool_), critical == 1.0)
            self._rng.bit_generator.state = head["generator"]
            self._take(head["more"])
        except (KeyError, TypeError, IndexError, OverflowError, RecursionError) as error:
            raise ValueError(f"it is damaged: {error!r}") from error

    def _header(self) -> dict[str, Any]:
        levels = self._known.columns.levels
        return {"name": self.name, "values": dict(self._values), "levels": list(levels)}


def packed(parameters: Parameters | None) -> list[float] | None:
    """Return a process's parameters as JSON, to the last bit."""
    return None if parameters is None else parameters.logs.tolist()


def unpacked(logs: Any, n_var: int) -> Parameters | None:
    """Return parameters of `packed`.

    Raises:
        ValueError: they are not parameters.
    """
    if logs is None:
        return None
    array = np.array(logs, np.float64)
    if array.shape != (n_var + 2,) or not (np.abs(array) < 20.0).all():
        raise ValueError("its models have other parameters")
    return Parameters(array)
