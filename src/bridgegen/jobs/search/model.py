"""A scenario with a driver as a plain function, for Python: rows in, results or motion out."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from bridgegen.assess.conflict.analysis import analyse
from bridgegen.assess.conflict.findings import Findings
from bridgegen.assess.conflict.summary import ConflictSummary, summarise
from bridgegen.base.arrays import Float
from bridgegen.base.errors import InputError, ScenarioError
from bridgegen.base.extras import require
from bridgegen.engine.domain import outside
from bridgegen.engine.options import CommonOptions, called_with
from bridgegen.engine.pipeline import Pipeline
from bridgegen.engine.simulate import FileResult, measured, result_of, surroundings
from bridgegen.jobs.search.restored import placed
from bridgegen.jobs.search.scenarios import as_judged, chosen_objective, driven_by, load, within
from bridgegen.pages.sketch import sketch
from bridgegen.simulation.choice import EMBEDDED, SimulatorChoice
from bridgegen.simulation.rollout import STATUS_MESSAGES, Rollout

if TYPE_CHECKING:
    import pandas as pd

MOST_PROBLEMS = 10
"""Largest number of rows whose broken constraints one error lists."""


@dataclass(frozen=True, kw_only=True)
class ModelArguments(CommonOptions):
    """The arguments of ``model``."""

    scenario: str | Path = field(
        kw_only=False,
        metadata={"help": "Name in the catalogue, or path of a YAML file or an OpenSCENARIO file."},
    )
    simulator: SimulatorChoice = field(
        default=EMBEDDED, metadata={"help": "Simulator that runs the rows."}
    )


@called_with(ModelArguments)
def model(given: ModelArguments) -> "Model":
    """Return a scenario with a driver of its ego as a function of its parameters.

    Returns:
        The model; its rows are judged by the same rules as those of ``run_search``.

    Raises:
        InputError: arguments or files that break a rule.
    """
    pipeline = _pipeline_of(given)
    pipeline.choose_objective()
    return Model(pipeline)


def _pipeline_of(given: ModelArguments, *, held: bool = False) -> Pipeline:
    """Return the pipeline of a scenario; ``held``: every parameter stands at its value."""
    logical = driven_by(load(given.scenario, given.distribution, given.empty_trigger), given.others)
    logical = within(logical, given.odd, given.road_map)
    spec = chosen_objective(logical.objective, given, "one")
    logical = as_judged(replace(logical, objective=spec), spec.gated)
    logical, roads = placed(logical, given.road_map, given.junction)
    space = logical.space(given.axes, given.fixed)
    if held:
        row = space.values(space.row(space.fixed))
        space = logical.space(given.axes, {name: row[name] for name in space.parameters})
    return Pipeline(logical, space, given, road_map=roads, simulator=given.simulator)


def simulate_scenario(
    scenario: str | Path,
    options: CommonOptions,
    simulator: SimulatorChoice = EMBEDDED,
    also: Sequence[str] = (),
) -> FileResult:
    """Simulate one row of a scenario: parameters that are not fixed stand at their defaults.

    Args:
        scenario: name in the catalogue, or path of a file.
        options: ``metrics`` are those to report, all by default.
        simulator: runs it.
        also: names of metrics that must be among them.

    Raises:
        InputError: arguments or files that break a rule, or fixed values that break a constraint.
    """
    given = ModelArguments.of(options, scenario=scenario, simulator=simulator)
    pipeline = _pipeline_of(given, held=True)
    runner, space = pipeline.runner, pipeline.space
    driver = runner.embedded.driver
    names = measured(given.metrics, also, pipeline.held, driver)
    # Not the row of the space's defaults: that is moved into its limits, by rounding errors.
    x = space.row(space.fixed)
    rollout = pipeline.rollout(x[np.newaxis])
    ((_, of_row),) = runner.by_variant(x[np.newaxis])
    roads = of_row.source.roads(of_row.space.values(x))
    columns = of_row.columns(x[np.newaxis])
    return replace(
        result_of(rollout, names, driver, pipeline.monitor, may_stop=pipeline.is_protocol),
        around=partial(surroundings, of_row.embedded, roads, columns, rollout),
        parameters=runner.facts(x),
        notes=(*pipeline.scenario.notes, *runner.notes),
    ).unless("" if rollout.status[0] else outside(runner))


@dataclass(frozen=True)
class Motion:
    """How one row moves; a notebook shows it from above.

    Attributes:
        values: the scenario's parameters, by name.
        rollout: the motion, N = 1.
        conflict: the decisive conflict; None without one.
        picture: SVG, seen from above at the closest approach.
    """

    values: Mapping[str, float]
    rollout: Rollout = field(repr=False)
    conflict: ConflictSummary | None
    picture: str = field(repr=False)

    def _repr_svg_(self) -> str:
        return self.picture


class Model:
    """A scenario with a driver of its ego: a function of the scenario's parameters.

    Each row's result depends on that row alone: on no other row, batch size or number of threads.
    Made by `bridgegen.model`.

    Attributes:
        scenario: its name.
        driver: of the ego.
        parameters: low, high and default value, and unit of each parameter that may vary, by name.
        notes: what the user should know, a sentence each: the driver is not made for the scenario,
            say.
    """

    def __init__(self, pipeline: Pipeline) -> None:
        self._pipeline, self._space = pipeline, pipeline.space
        self.scenario, self.driver = pipeline.scenario.name, pipeline.driver.label
        declared = self._space.parameters
        self.parameters: Mapping[str, tuple[float, float, float, str]] = {
            name: (parameter.low, parameter.high, self._space.defaults[name], parameter.unit)
            for name, parameter in ((name, declared[name]) for name in self._space.variables)
        }
        odd = outside(pipeline.runner)
        self.notes = (*pipeline.scenario.notes, *pipeline.runner.notes, *([odd] if odd else []))

    def __repr__(self) -> str:
        return f"Model({self.scenario}, {self.driver}, {len(self.parameters)} parameters)"

    def sample(self, count: int, seed: int = 0) -> "pd.DataFrame":
        """Return random rows of what ranges and constraints allow: even ones, but for priors.

        Args:
            count: number of rows.
            seed: of the random numbers.

        Returns:
            A column for each parameter and derived quantity.

        Raises:
            InputError: pandas is not installed, or a number that is negative.
        """
        require("pandas", "a data frame")
        import pandas as pd

        if count < 0 or seed < 0:
            raise InputError(f"count and seed must be 0 or more, got {count} and {seed}")
        U = np.random.default_rng(seed).random((count, self._space.n_var))
        return pd.DataFrame(self._space.decode(U), columns=list(self._space.names))

    def evaluate(self, X: "pd.DataFrame | Mapping[str, Sequence[float]] | Float") -> "pd.DataFrame":
        """Simulate rows and measure them.

        Args:
            X: values by parameter, in its unit (a category's by number or name), as columns of a
                data frame or a mapping, those that are missing at their defaults; or an array
                ``(N, len(self.columns))``.

        Returns:
            A row for each of X, with its index: the parameters, the metrics, ``critical``, the
            decisive conflict (``conflict``, ``conflict_type``, ``responsible``, …; missing without
            one), ``implausible`` (why its traffic could not happen) and ``problem`` (why there is
            no result).

        Raises:
            UnknownNameError: no such parameter.
            InputError: rows that break a range or a constraint; or pandas is not installed.
        """
        require("pandas", "a data frame")
        import pandas as pd

        rows = self._rows(X)
        found = self._pipeline.evaluate(rows)
        index = X.index if isinstance(X, pd.DataFrame) else None
        table: dict[str, object] = dict(self._pipeline.runner.columns(rows))
        table |= dict(zip(self._pipeline.metrics, found.metrics.T, strict=True))
        table["critical"] = found.critical
        for name, column in found.findings.columns().items():
            if name != "happened":
                table[name] = np.array([text or None for text in column.tolist()], dtype=object)
        problems = np.full(len(rows), None, dtype=object)
        for k in np.flatnonzero(found.status).tolist():
            words = (STATUS_MESSAGES[int(found.status[k])], found.messages.get(k, ""))
            problems[k] = ": ".join(text for text in words if text)
        table["problem"] = problems
        return pd.DataFrame(table, index=index)

    def rollout(self, x: Mapping[str, float] | Float | None = None) -> Motion:
        """Simulate one row, and keep its motion.

        Args:
            x: values by parameter (a mapping, or a row of a data frame), those that are missing at
                their defaults; or an array ``(len(self.columns),)``. The defaults by default.

        Raises:
            UnknownNameError: no such parameter.
            InputError: it breaks a range or a constraint, or has no result.
        """
        if x is None:
            row = self._space.row({})
        elif isinstance(x, np.ndarray):
            row = self._rows(x[np.newaxis])[0]
        else:  # a row of what ``evaluate`` returns has results, too
            row = self._rows(
                {str(name): [value] for name, value in x.items() if not self._is_result(str(name))}
            )[0]
        runner = self._pipeline.runner
        rollout = self._pipeline.rollout(row[np.newaxis])
        if rollout.status[0]:
            words = [STATUS_MESSAGES[int(rollout.status[0])], *rollout.messages.values()]
            raise InputError(f"{self.scenario}: {': '.join(words)}")
        conflict = summarise(analyse(rollout), 0, self._pipeline.objective.count)
        return Motion(runner.facts(row), rollout, conflict, sketch(runner, row))

    def _is_result(self, name: str) -> bool:
        """Whether ``evaluate`` adds a column, which is no parameter."""
        findings = (item.name for item in fields(Findings))
        return name not in self.columns and name in {
            *self._pipeline.metrics,
            *findings,
            "critical",
            "problem",
        }

    @property
    def columns(self) -> tuple[str, ...]:
        """The names of all columns of a row: parameters, then derived quantities."""
        return self._space.names

    def _rows(self, X: "pd.DataFrame | Mapping[str, Sequence[float]] | Float") -> Float:
        """Return rows, ``(N, len(self.columns))``, that keep all ranges and constraints."""
        space = self._space
        if isinstance(X, np.ndarray):
            if X.ndim != 2 or X.shape[1] != len(space.names):
                raise InputError(
                    f"X must have the shape (N, {len(space.names)}), a column for each of "
                    f"{', '.join(space.names)}; got {X.shape}"
                )
            rows = np.ascontiguousarray(X, dtype=np.float64)
        else:
            columns = {str(name): self._numbers(str(name), series) for name, series in X.items()}
            counts = {len(column) for column in columns.values()}
            if len(counts) > 1:
                raise InputError(f"all columns must be as long, got {sorted(counts)} values")
            rows = space.rows(columns, counts.pop() if counts else 1)
        if broken := space.violations(rows):
            some = [
                f"row {violation.row}: {violation.reason}" for violation in broken[:MOST_PROBLEMS]
            ]
            more = len(broken) - len(some)
            raise ScenarioError(*some, *([f"and {more} more"] if more else []))
        return rows

    def _numbers(self, name: str, values: Iterable[Any]) -> Float:
        """Return a column's values as numbers within the parameter's range."""
        self._space.index(name)
        parameter, given = self._space.parameters.get(name), list(values)
        if parameter is not None and any(isinstance(item, str) for item in given):
            given = [parameter.read(item) for item in given]
        try:
            found = np.asarray(given, dtype=np.float64)
        except (TypeError, ValueError):
            raise InputError(f"{name} must be numbers, got {given!r:.60}") from None
        if found.ndim != 1:
            raise InputError(f"{name} must be a column of numbers, got an array {found.shape}")
        if parameter is not None:
            # Negated, so that NaN is outside, too.
            outside = np.flatnonzero(~((found >= parameter.low) & (found <= parameter.high)))
            if outside.size:
                raise InputError(
                    f"row {outside[0]}: {name} [{parameter.unit}] must be {parameter.low:g} to "
                    f"{parameter.high:g}, got {found[outside[0]]:g}"
                )
        return found
