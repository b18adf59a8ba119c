"""The screen of a search: the same scenario in a simulator that is cheap."""

import numpy as np

from bridgegen.base.arrays import Bool, Float, as_float
from bridgegen.base.errors import InputError
from bridgegen.engine.options import SearchOptions
from bridgegen.engine.options.search import MAX_BUDGET
from bridgegen.engine.pipeline import Pipeline
from bridgegen.jobs.search.known_rows import KnownRows, ResultLog
from bridgegen.search.algorithms import Results
from bridgegen.simulation.choice import SimulatorChoice

BATCH = 8
"""Default number of rows of the run's simulator that are chosen at a time."""

EACH = 20
"""Default number of rows of the screen for each row of the run's simulator."""

EACH_RATED, LEAST_EACH = 100, 20
"""Default and least number of them in a search with rates. Each batch is drawn of a pool of so many
points for each row: rows of a small pool are not independent, and intervals are too narrow."""


def require_screen(given: SearchOptions, budget: int) -> None:
    """Check the options of a screen.

    Raises:
        InputError: one of them breaks a rule; all that do.
    """
    problems = []
    if given.screen is None:
        problems = [
            f"{spelling} is for a search with a screen (--screen), got {value}"
            for spelling, value in (
                ("--screen-budget", given.screen_budget),
                ("--screen-batch", given.screen_batch),
            )
            if value is not None
        ]
    elif is_same(given.screen, given.simulator):
        problems.append(
            "the screen must be another simulator than the search's, or have other settings; both "
            f"are {given.simulator.name} (--screen, --simulator)"
        )
    elif given.screen_budget is not None and given.screen_budget < budget:
        problems.append(
            "the screen proposes every evaluation, so screen_budget >= budget must hold, got "
            f"{given.screen_budget} and {budget} (--screen-budget, --budget)"
        )
    if given.screen is not None and given.rate:
        if given.screen_batch is not None:
            problems.append(
                "--screen-batch is for a search without rates (--rate), whose batches are those of "
                f"its algorithm (--set batch), got {given.screen_batch}"
            )
        if given.screen_budget is not None and given.screen_budget < LEAST_EACH * budget:
            problems.append(
                "--rate draws its rows from those that the screen has evaluated, so screen_budget "
                f">= {LEAST_EACH} * budget must hold, got {given.screen_budget} and {budget} "
                "(--screen-budget, --budget)"
            )
    if problems:
        raise InputError(*problems)


def is_same(simulator_choice: SimulatorChoice, other: SimulatorChoice) -> bool:
    """Return whether two choices give the same results."""
    return (simulator_choice.name, dict(simulator_choice.settings)) == (
        other.name,
        dict(other.settings),
    )


def screen_budget(given: SearchOptions, budget: int) -> int | None:
    """Return the screen's budget, given or default; None without a screen."""
    if given.screen is None or given.screen_budget is not None:
        return given.screen_budget
    return min((EACH_RATED if given.rate else EACH) * budget, MAX_BUDGET)


def screen_batch(given: SearchOptions) -> int | None:
    """Return the number of rows that are chosen at a time; None without a screen, or with rates."""
    return None if given.screen is None or given.rate else given.screen_batch or BATCH


class Screen:
    """See `bridgegen.search.algorithms.algorithm.Screen`.

    Args:
        pipeline: of the scenario in the screen's simulator, its objective chosen.
        name: of the simulator.
        budget: maximum number of evaluations.
        rows: evaluations of the run.
    """

    def __init__(self, pipeline: Pipeline, name: str, budget: int, rows: int) -> None:
        self.name, self.budget, self.each = name, budget, budget / rows
        self._pipeline = pipeline
        self._known = KnownRows()
        self._log = ResultLog(pipeline.objective.n_obj, len(pipeline.metrics))

    @property
    def evaluations(self) -> int:
        """See `bridgegen.search.algorithms.algorithm.Screen`."""
        return len(self._known)

    def evaluate(self, U: Float) -> tuple[Results, Bool]:
        """See `bridgegen.search.algorithms.algorithm.Screen`."""
        space = self._pipeline.space
        X = as_float("X", space.decode(U), (len(U), len(space.names))) + 0.0
        ids, fresh = self._known.add(X, self.budget)
        if fresh:
            self._log.add(self._pipeline.evaluate(X[fresh]))
        new = np.zeros(len(U), np.bool_)
        new[fresh] = True
        return self._log.results(ids), new


def screen_of(pipeline: Pipeline, simulator: SimulatorChoice) -> Pipeline:
    """Return the pipeline of a screen.

    Args:
        pipeline: of the run, its objective chosen.
        simulator: the screen's.

    Raises:
        InputError: the screen cannot run the scenario, or not with the run's driver, vehicle or
            metrics.
    """
    try:
        return pipeline.elsewhere(simulator)
    except InputError as error:
        problems = [
            f"the screen {simulator.name} (--screen): {problem}" for problem in error.problems
        ]
        raise InputError(*problems) from None
