"""What every search algorithm is: ask for rows of the unit cube, tell their objectives."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from typing import Any, ClassVar, Literal, Protocol, Self, runtime_checkable

import numpy as np
import numpy.typing as npt

from bridgegen.arrays import Bool, Float, Int
from bridgegen.cause import Cause
from bridgegen.errors import InputError, UnknownNameError

Value = bool | int | float | str

EXTRAS = {"rl": ("torch", "stable_baselines3", "gymnasium")}
"""The modules that come with an extra."""

JSON = None | bool | int | float | str | Sequence["JSON"] | Mapping[str, "JSON"]
"""What a run can keep; no NaN and no inf."""


@dataclass(frozen=True)
class Setting:
    """One hyper-parameter of an algorithm.

    Attributes:
        default: its value unless the user gives another; also fixes the type.
        text: what it does, one line.
        low: smallest value allowed, for numbers.
        high: largest value allowed, for numbers.
        choices: the values allowed, for texts; empty where any is.
    """

    default: Value
    text: str
    low: float | None = None
    high: float | None = None
    choices: tuple[str, ...] = ()


RESTART_WITHIN = Setting(
    1e-3,
    "begin afresh once half of the population is this close to the best row, as a share of each "
    "parameter's range; 0: never",
    0.0,
    1.0,
)
"""The setting of an algorithm whose population converges."""


class Arena(Protocol):
    """Where an agent decides for a participant while the scenario runs.

    Attributes:
        n_decisions: of each scenario.
        n_observed: numbers that it sees at each.
        decisions: ``(n_decisions, 2)`` int64, the columns of U that it decides.
    """

    n_decisions: int
    n_observed: int
    decisions: Int

    def play(self, U: Float, act: Callable[[Float, Bool], Float]) -> Float:
        """Let an agent decide, and return the rows that came of it.

        Args:
            U: ``(N, n_var)``; the columns of decisions do not count.
            act: ``(N, n_observed)`` observations and ``(N,)`` bool, whether a row still runs →
                ``(N, 2)`` decisions in [0, 1].

        Returns:
            ``(N, n_var)``.
        """
        ...


@dataclass(frozen=True)
class Problem:
    """What is searched.

    Attributes:
        parameters: the searched ones' names, one per column of U.
        metrics: the names of those that are recorded, one per column of ``Results.metrics``.
        n_obj: objectives, all minimised.
        arena: where an adversary drives in closed loop; None without one.
    """

    parameters: tuple[str, ...]
    metrics: tuple[str, ...] = ()
    n_obj: int = 1
    arena: Arena | None = None

    @property
    def n_var(self) -> int:
        """Searched parameters."""
        return len(self.parameters)

    @classmethod
    def unnamed(cls, n_var: int, n_obj: int = 1) -> Self:
        """Return a problem of no scenario: parameters x0, x1 …, no metrics."""
        return cls(tuple(f"x{i}" for i in range(n_var)), (), n_obj)


@dataclass(frozen=True)
class Results:
    """What n rows came to.

    Attributes:
        F: ``(n, n_obj)`` float64, smaller is more critical; anything, NaN included, in rows that
            are not ok.
        ok: ``(n,)`` bool, False where the simulation failed.
        critical: ``(n,)`` bool, by the scenario's thresholds.
        metrics: ``(n, len(problem.metrics))`` float64, in the metrics' units; NaN in rows that are
            not ok; +inf where the metric says so (a time to a collision that never comes).
        cause: ``(n,)`` int8, a `Cause` each; NONE where not critical, or not sought.
    """

    F: Float
    ok: Bool
    critical: Bool
    metrics: Float
    cause: npt.NDArray[np.int8]

    @classmethod
    def of_F(cls, F: Float, ok: Bool | None = None) -> Self:
        """Return results of no scenario: objectives, nothing critical, no metrics.

        Args:
            F: ``(n, n_obj)``.
            ok: ``(n,)``; all by default.
        """
        n = len(F)
        good = np.ones(n, dtype=bool) if ok is None else ok
        nothing = np.zeros(n, dtype=bool), np.empty((n, 0)), np.full(n, Cause.NONE, np.int8)
        return cls(F, good, *nothing)


Arity = Literal["one", "many", "any"]
"""How many columns of F an algorithm takes: exactly one; one or more; or it takes no notice."""


class Algorithm(Protocol):
    """A search algorithm over the unit cube; every objective is minimised.

    ``ask`` and ``tell`` alternate: each ``tell`` answers the last ``ask``, whole and in its order.
    An algorithm draws random numbers only from its own generator, so that one seed gives one
    sequence of rows, bit for bit; the campaign's resume replays a run on that promise.

    It may name an ``extra`` that must be installed, see `EXTRAS`, and it may have other methods:
    ``notes``, see `TakesNotes`; ``state`` and ``restore``, see `Restorable`.

    Attributes:
        name: what the user calls it.
        description: one line for ``bridgegen list algorithms``.
        source: where the method is published.
        settings: its hyper-parameters by name; the constructor takes them as keywords.
        objectives: how many it takes: "one", "many" (a campaign gives it a column of F for each
            term of the scenario's objective, if not told otherwise), or "any" (it takes no notice).
    """

    name: ClassVar[str]
    description: ClassVar[str]
    source: ClassVar[str]
    settings: ClassVar[Mapping[str, Setting]]
    objectives: ClassVar[Arity]

    def __init__(self, problem: Problem, seed: int, **settings: Value) -> None:
        """Set up the search.

        Args:
            problem: at least one parameter; as many objectives as it takes.
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

    def tell(self, U: Float, results: Results) -> None:
        """Take the results of the last ``ask``.

        Args:
            U: ``(n, n_var)`` float64, the rows that were asked.
            results: of these rows; not to be changed.
        """


@runtime_checkable
class TakesNotes(Protocol):
    """An algorithm that learns something which is worth keeping with the run."""

    def notes(self) -> Mapping[str, JSON]:
        """Return what it has learnt so far, by title.

        The campaign records it when the search ends, is interrupted or stopped; ``Run.notes`` has
        it, and the report shows it. Where a value is a list of mappings with the same keys, it is
        shown as a table. A mapping called "box" holds, for some parameters, the lowest and highest
        value in the unit cube; the report adds the parameters' own values, where no constraint
        couples them.
        """
        ...


@runtime_checkable
class Restorable(Protocol):
    """An algorithm for which replaying a long run would take too long: it can be saved."""

    def state(self) -> bytes:
        """Return all that the next rows depend on, as it is between ``tell`` and ``ask``.

        The campaign saves it with the batch; only the newest is kept.
        """
        ...

    def restore(self, state: bytes) -> None:
        """Become what the algorithm was that returned ``state``, made with the same arguments.

        Args:
            state: perhaps damaged, or not written by BridgeGen at all: nothing in it is run.

        Raises:
            ValueError: it is no state of such an algorithm.
        """


def resolve(
    algorithm: type[Algorithm], problem: Problem, seed: int, given: Mapping[str, Value]
) -> dict[str, Any]:
    """Check a constructor's arguments and return every setting's value, given or default.

    Raises:
        InputError: the rules that are broken, all of them; or its extra is not installed.
        UnknownNameError: no such setting.
    """
    name = algorithm.name
    _require(name, getattr(algorithm, "extra", None))
    for key in given:
        if key not in algorithm.settings:
            raise UnknownNameError(f"setting of {name}", key, algorithm.settings)
    problems = []
    if problem.n_var < 1:
        problems.append(f"{name}: n_var ≥ 1 must hold, got 0: there is nothing to search")
    single = algorithm.objectives == "one"
    if problem.n_obj < 1 or (problem.n_obj > 1 and single):
        rule = "= 1 (it searches a single objective)" if single else "≥ 1"
        problems.append(f"{name}: n_obj {rule} must hold, got {problem.n_obj}")
    if seed < 0:
        problems.append(f"{name}: seed ≥ 0 must hold, got {seed}")
    values = {key: setting.default for key, setting in algorithm.settings.items()}
    for key, value in given.items():
        wanted = _wanted(algorithm.settings[key], value)
        if wanted:
            problems.append(f"{name}: {key} must be {wanted}, got {value!r}")
        values[key] = float(value) if isinstance(values[key], float) and not wanted else value
    if problems:
        raise InputError(*problems)
    return values


def _require(name: str, extra: str | None) -> None:
    """Refuse an algorithm whose extra is not installed; imports nothing."""
    if extra and not all(find_spec(module) for module in EXTRAS[extra]):
        raise InputError(f"algorithm '{name}' needs the extra: pip install 'bridgegen[{extra}]'")


def _wanted(setting: Setting, value: Value) -> str | None:
    """Return what ``value`` must be, where it is not."""
    kind = type(setting.default)
    fits = type(value) is kind or (kind is float and type(value) is int)
    if not fits:
        return {bool: "true or false", int: "an integer", float: "a number", str: "a text"}[kind]
    if isinstance(value, str):
        fits = not setting.choices or value in setting.choices
        return None if fits else f"one of {', '.join(setting.choices)}"
    low = -np.inf if setting.low is None else setting.low
    high = np.inf if setting.high is None else setting.high
    # Written so that NaN fails.
    return None if low <= value <= high else f"in {low:g} .. {high:g}"
