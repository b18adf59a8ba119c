"""The protocol of search algorithms: rows of the unit cube out, their objectives in."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Literal, Protocol, Self, runtime_checkable

import numpy as np
import numpy.typing as npt

from bridgegen.assess.cause import Cause
from bridgegen.base.arrays import Bool, Float, Int
from bridgegen.base.errors import InputError, UnknownNameError
from bridgegen.base.extras import require

Value = bool | int | float | str

JSON = None | bool | int | float | str | Sequence["JSON"] | Mapping[str, "JSON"]
"""Values that a run can record; no NaN and no inf."""


@dataclass(frozen=True)
class Setting:
    """One hyper-parameter of an algorithm.

    Attributes:
        default: its value unless the user gives another; also defines the type.
        text: its effect, one line.
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
    "restart once half of the population is this close to the best row, as a share of each "
    "parameter's range; 0: never",
    0.0,
    1.0,
)
"""Setting that restarts an algorithm whose population converges."""


class Arena(Protocol):
    """Where an agent decides for a participant while the scenario runs.

    Attributes:
        n_decisions: of each scenario.
        n_observed: size of an observation.
        decisions: ``(n_decisions, 2)`` int64, the columns of U that it decides.
    """

    n_decisions: int
    n_observed: int
    decisions: Int

    def play(self, U: Float, act: Callable[[Float, Bool], Float]) -> Float:
        """Let an agent decide, and return the resulting rows.

        Args:
            U: ``(N, n_var)``; the columns of decisions are ignored.
            act: ``(N, n_observed)`` observations and ``(N,)`` bool, whether a row still runs →
                ``(N, 2)`` decisions in [0, 1].

        Returns:
            ``(N, n_var)``.
        """
        ...


class Road(Protocol):
    """How the rows of a search are distributed on the road, by points of standard normal space.

    Attributes:
        dimensions: of that space.
        share: how likely a standard normal point is feasible: low, middle and high value.
        continuous: ``(dimensions,)``, which scores stand for a value each: of a parameter with
            single values, many scores stand for one.
    """

    dimensions: int
    share: tuple[float, float, float]
    continuous: Bool

    def rows(self, Z: Float) -> tuple[Float, Bool, Float]:
        """Return the rows that points stand for.

        Args:
            Z: ``(N, dimensions)``.

        Returns:
            U ``(N, n_var)``; ``(N,)`` which are feasible; and ``(N,)`` the logarithm of how much
            likelier each one is uniformly over the ranges than on the road.
        """
        ...

    def met(self, n: int, random: np.random.Generator) -> Float:
        """Return n feasible points as on the road, ``(n, dimensions)``."""
        ...

    def even(self, n: int, random: np.random.Generator) -> tuple[Float, Bool]:
        """Return points whose rows are uniform over the ranges.

        Returns:
            ``(n, dimensions)``; and ``(n,)`` which can happen on the road: the others stand for
            nothing.
        """
        ...


@dataclass(frozen=True)
class Results:
    """Results of n rows.

    Attributes:
        F: ``(n, n_obj)`` float64, smaller is more critical; anything, NaN included, in rows that
            are not ok.
        ok: ``(n,)`` bool, False where the simulation failed.
        critical: ``(n,)`` bool, by the scenario's thresholds.
        metrics: ``(n, len(problem.metrics))`` float64, in the metrics' units; NaN in rows that are
            not ok; +inf by the metric's definition (time to a collision that never occurs).
        cause: ``(n,)`` int8, a `Cause` each; NONE where not critical, or not sought.
    """

    F: Float
    ok: Bool
    critical: Bool
    metrics: Float
    cause: npt.NDArray[np.int8]

    @classmethod
    def of_F(cls, F: Float, ok: Bool | None = None) -> Self:
        """Return results without a scenario: objectives, no critical rows, no metrics.

        Args:
            F: ``(n, n_obj)``.
            ok: ``(n,)``; all by default.
        """
        n = len(F)
        good = np.ones(n, dtype=bool) if ok is None else ok
        nothing = np.zeros(n, dtype=bool), np.empty((n, 0)), np.full(n, Cause.NONE, np.int8)
        return cls(F, good, *nothing)


class Screen(Protocol):
    """A simulator that is cheap, with a budget of its own.

    Attributes:
        name: of the simulator.
        budget: maximum number of evaluations.
        each: how many they are for each evaluation of the run.
        evaluations: made so far; a row that is known costs none.
    """

    name: str
    budget: int
    each: float

    @property
    def evaluations(self) -> int:
        """See above."""

    def evaluate(self, U: Float) -> tuple[Results, Bool]:
        """Evaluate rows, up to the budget; rows beyond it are failed ones.

        Args:
            U: ``(n, n_var)``.

        Returns:
            Their results, and ``(n,)`` which rows are evaluated for the first time.
        """


@dataclass(frozen=True)
class Problem:
    """A search problem.

    Attributes:
        parameters: names of the searched parameters, one per column of U.
        metrics: names of the recorded metrics, one per column of ``Results.metrics``.
        n_obj: objectives, all minimised.
        arena: where an adversary drives in closed loop; None without one.
        levels: per column of U, into how many equal intervals it is divided, each a single value
            of a category or an integer; 0: it is continuous. Empty: all are.
        road: how rows are distributed on the road; None: uniformly in the unit cube.
        screen: a cheap simulator beside the run's; None without one.
    """

    parameters: tuple[str, ...]
    metrics: tuple[str, ...] = ()
    n_obj: int = 1
    arena: Arena | None = None
    levels: tuple[int, ...] = ()
    road: Road | None = None
    screen: Screen | None = None

    @property
    def n_var(self) -> int:
        """Number of searched parameters."""
        return len(self.parameters)

    @classmethod
    def unnamed(cls, n_var: int, n_obj: int = 1) -> Self:
        """Return a problem without a scenario: parameters x0, x1 …, no metrics."""
        return cls(tuple(f"x{i}" for i in range(n_var)), (), n_obj)


Arity = Literal["one", "many", "any"]
"""Number of columns of F that an algorithm takes: exactly one; one or more; or it ignores them."""


class Algorithm(Protocol):
    """A search algorithm over the unit cube; every objective is minimised.

    ``ask`` and ``tell`` alternate: each ``tell`` has the results of the last ``ask``, all of them,
    in its order; unless the algorithm is `asynchronous`. An algorithm draws random numbers only
    from its own generator, so that one seed gives one sequence of rows, bit for bit; resuming a run
    replays it and relies on that.

    It may name an ``extra`` that must be installed, see `bridgegen.base.extras`. It may also have
    ``notes``, see `TakesNotes`; ``state`` and ``restore``, see `Restorable`.

    Attributes:
        name: for the user.
        description: one line for ``bridgegen list algorithms``.
        source: where the method is published.
        settings: its hyper-parameters by name; the constructor takes them as keywords.
        objectives: how many it takes: "one", "many" (a campaign gives it a column of F for each
            term of the scenario's objective by default), or "any" (it ignores F).
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
            ``(n, n_var)`` float64 in [0, 1]; n = 0 if there are no more.
        """
        ...

    def tell(self, U: Float, results: Results) -> None:
        """Process the results of the last ``ask``.

        Args:
            U: ``(n, n_var)`` float64, the rows of the last ``ask``.
            results: of these rows; must not be changed.
        """


def asynchronous(algorithm: "type[Algorithm]") -> bool:
    """Return whether an algorithm may be asked again before all of its rows are told.

    Its class says so by ``asynchronous: ClassVar[bool] = True``. After the first batch, which is
    told as a whole, each ``tell`` then has the next rows that are not told yet, in the order in
    which they were asked for, some of an earlier ``ask`` and fewer of the last one; there may be
    any number of ``ask`` between two ``tell``.
    """
    return bool(getattr(algorithm, "asynchronous", False))


@runtime_checkable
class TakesNotes(Protocol):
    """An algorithm with notes that are recorded with the run."""

    def notes(self) -> Mapping[str, JSON]:
        """Return its notes so far, by title.

        The campaign records them when the search ends, is interrupted or stopped; ``Run.notes`` has
        them, and the report shows them. A list of mappings with the same keys is shown as a table.
        A mapping called "box" holds, for some parameters, the lowest and highest value in the unit
        cube; the report adds the parameters' own values, where no constraint couples them.
        """
        ...


@runtime_checkable
class Restorable(Protocol):
    """An algorithm whose state can be saved, because replaying a long run would take too long."""

    def state(self) -> bytes:
        """Return the state that determines the next rows, between ``tell`` and ``ask``.

        The campaign saves it with the batch; only the newest is kept.
        """
        ...

    def restore(self, state: bytes) -> None:
        """Restore the state of an algorithm that was constructed with the same arguments.

        Args:
            state: possibly damaged, or not written by BridgeGen at all: it must not be executed.

        Raises:
            ValueError: not a state of such an algorithm.
        """


def resolve(
    algorithm: type[Algorithm], problem: Problem, seed: int, given: Mapping[str, Value]
) -> dict[str, Any]:
    """Check a constructor's arguments and return every setting's value, given or default.

    Raises:
        InputError: all rules that are broken; or its extra is not installed.
        UnknownNameError: no such setting.
    """
    name = algorithm.name
    if extra := getattr(algorithm, "extra", None):
        require(extra, f"algorithm '{name}'")
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


def _wanted(setting: Setting, value: Value) -> str | None:
    """Return the rule that ``value`` breaks, or None."""
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


# --- The objectives of a failed row ---


class Penalty:
    """Replaces the objectives of rows without a usable result.

    A row counts as failed if its simulation failed or an objective is not finite. In every
    objective it gets a finite value worse than the worst finite one so far.
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
        """``(n_obj,)`` float64, the present penalty; it grows with the worst value so far."""
        if not np.isfinite(self._worst).all():
            return np.ones_like(self._worst)
        with np.errstate(over="ignore"):
            # The margin exceeds rounding errors, and scales with the objective.
            margin = np.maximum(self._worst - self._best, np.maximum(np.abs(self._worst), 1.0))
            value: Float = np.minimum(self._worst + margin, np.finfo(np.float64).max)
        return value
