"""What every search algorithm is: ask for rows of the unit cube, tell their objectives."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Protocol

import numpy as np

from bridgegen.arrays import Bool, Float
from bridgegen.errors import InputError, UnknownNameError

Value = bool | int | float | str


@dataclass(frozen=True)
class Setting:
    """One hyper-parameter of an algorithm.

    Attributes:
        default: its value unless the user gives another; also fixes the type.
        text: what it does, one line.
        low: smallest value allowed, for numbers.
        high: largest value allowed, for numbers.
    """

    default: Value
    text: str
    low: float | None = None
    high: float | None = None


RESTART_WITHIN = Setting(
    1e-3,
    "begin afresh once half of the population is this close to the best row, as a share of each "
    "parameter's range; 0: never",
    0.0,
    1.0,
)
"""The setting of an algorithm whose population converges."""


class Algorithm(Protocol):
    """A search algorithm over the unit cube; every objective is minimised.

    ``ask`` and ``tell`` alternate: each ``tell`` answers the last ``ask``, whole and in its order.
    An algorithm draws random numbers only from its own generator, so that one seed gives one
    sequence of rows, bit for bit; the campaign's resume replays a run on that promise.

    Attributes:
        name: what the user calls it.
        description: one line for ``bridgegen list algorithms``.
        source: where the method is published.
        settings: its hyper-parameters by name; the constructor takes them as keywords.
        many_objective: whether it takes more than one objective.
    """

    name: ClassVar[str]
    description: ClassVar[str]
    source: ClassVar[str]
    settings: ClassVar[Mapping[str, Setting]]
    many_objective: ClassVar[bool]

    def __init__(self, n_var: int, n_obj: int, seed: int, **settings: Value) -> None:
        """Set up the search.

        Args:
            n_var: searched parameters, ≥ 1.
            n_obj: objectives, ≥ 1; exactly 1 unless ``many_objective``.
            seed: ≥ 0.
            **settings: a subset of ``settings``; the others keep their defaults.

        Raises:
            InputError: a value breaks one of these rules.
            UnknownNameError: no such setting.
        """

    def ask(self) -> Float:
        """Return the next rows to evaluate.

        Returns:
            ``(n, n_var)`` float64 in [0, 1]; n = 0 says that there are no more.
        """
        ...

    def tell(self, U: Float, F: Float, ok: Bool) -> None:
        """Take the results of the last ``ask``.

        Args:
            U: ``(n, n_var)`` float64, the rows that were asked.
            F: ``(n, n_obj)`` float64, smaller is more critical; anything, NaN included, in rows
                that are not ok.
            ok: ``(n,)`` bool, False where the simulation failed.
        """


def resolve(
    algorithm: type[Algorithm], n_var: int, n_obj: int, seed: int, given: Mapping[str, Value]
) -> dict[str, Any]:
    """Check a constructor's arguments and return every setting's value, given or default.

    Raises:
        InputError: the rules that are broken, all of them.
        UnknownNameError: no such setting.
    """
    name = algorithm.name
    for key in given:
        if key not in algorithm.settings:
            raise UnknownNameError(f"setting of {name}", key, algorithm.settings)
    problems = []
    if n_var < 1:
        problems.append(f"{name}: n_var ≥ 1 must hold, got {n_var}: there is nothing to search")
    if n_obj < 1 or (n_obj > 1 and not algorithm.many_objective):
        rule = "≥ 1" if algorithm.many_objective else "= 1 (it searches a single objective)"
        problems.append(f"{name}: n_obj {rule} must hold, got {n_obj}")
    if seed < 0:
        problems.append(f"{name}: seed ≥ 0 must hold, got {seed}")
    values = {key: setting.default for key, setting in algorithm.settings.items()}
    for key, value in given.items():
        problem = _problem(algorithm.settings[key], value)
        if problem:
            problems.append(f"{name}: {key} must be {problem}, got {value!r}")
        values[key] = float(value) if isinstance(values[key], float) and not problem else value
    if problems:
        raise InputError(*problems)
    return values


def _problem(setting: Setting, value: Value) -> str | None:
    """Return what ``value`` must be, where it is not."""
    kind = type(setting.default)
    fits = type(value) is kind or (kind is float and type(value) is int)
    if not fits:
        return {bool: "true or false", int: "an integer", float: "a number", str: "a text"}[kind]
    if isinstance(value, str):
        return None
    low = -np.inf if setting.low is None else setting.low
    high = np.inf if setting.high is None else setting.high
    # Written so that NaN fails.
    return None if low <= value <= high else f"in {low:g} .. {high:g}"


class Penalty:
    """Stands in for the objectives of rows without a usable result.

    A row counts as failed where its simulation failed or an objective is not finite. It gets,
    in every objective, a finite value worse than the worst finite one told so far.
    """

    def __init__(self, n_obj: int) -> None:
        self._best = np.full(n_obj, np.inf)
        self._worst = np.full(n_obj, -np.inf)

    def apply(self, F: Float, ok: Bool) -> tuple[Float, Bool]:
        """Return F with failed rows replaced, all of it finite, and which rows failed.

        Args:
            F: ``(n, n_obj)`` float64, unchanged.
            ok: ``(n,)`` bool.
        """
        good = ok & np.isfinite(F).all(axis=1)
        if good.any():
            self._best = np.minimum(self._best, F[good].min(axis=0))
            self._worst = np.maximum(self._worst, F[good].max(axis=0))
        return np.where(good[:, None], F, self.value), ~good

    @property
    def value(self) -> Float:
        """``(n_obj,)`` float64, the penalty as of now; it grows with the worst value told."""
        if not np.isfinite(self._worst).all():
            return np.ones_like(self._worst)
        with np.errstate(over="ignore"):
            # The margin is never lost to rounding, and is of the objective's own size.
            margin = np.maximum(self._worst - self._best, np.maximum(np.abs(self._worst), 1.0))
            value: Float = np.minimum(self._worst + margin, np.finfo(np.float64).max)
        return value
