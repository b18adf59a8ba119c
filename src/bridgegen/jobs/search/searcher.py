"""What searches in a campaign: the algorithm, alone or in a screen; and what ends it early."""

import shlex
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Literal

import numpy as np
import numpy.typing as npt

from bridgegen.base.errors import InputError
from bridgegen.engine.options import SearchOptions
from bridgegen.engine.pipeline import Pipeline
from bridgegen.jobs.search.known_rows import KnownRows, ResultLog
from bridgegen.jobs.search.loop import Progress, Reason
from bridgegen.jobs.search.run import Run
from bridgegen.jobs.search.screening import Screen, screen_of
from bridgegen.jobs.search.settings import Settings
from bridgegen.results.store import Store
from bridgegen.scenario.exposure import Exposure
from bridgegen.scenario.exposure import Rate as OfExposure
from bridgegen.scenario.exposure.reader import chosen_exposure
from bridgegen.scenario.exposure.road import OnRoad
from bridgegen.search import algorithms as toolkit
from bridgegen.search.algorithms.algorithm import Arena, Problem, asynchronous, resolve
from bridgegen.search.algorithms.rate import Rate
from bridgegen.search.screened import Screened, ScreenedRate
from bridgegen.search.triage.modes import Key, keys_of
from bridgegen.search.triage.rates import Drawn, how_likely
from bridgegen.simulation.rollout import FAILURES, STATUS_MESSAGES


def searcher_of(
    pipeline: Pipeline, settings: Settings, warn: Callable[[str], None]
) -> toolkit.Algorithm:
    """Return what searches: the run's algorithm, in the screen if there is one."""
    if settings.screen is None:
        return _algorithm(pipeline, settings)
    there = screen_of(pipeline, settings.screen)
    there.warm_up()
    assert settings.screen_budget is not None
    screen = Screen(there, settings.screen.name, settings.screen_budget, settings.budget)
    if settings.rate:
        problem = replace(_problem(pipeline, met=_met(pipeline, settings)), screen=screen)
        name, values = settings.simulator.name, settings.settings
        return ScreenedRate(problem, settings.seed, name, **values)
    assert settings.screen_batch is not None
    closed_loop = getattr(toolkit.get(settings.algorithm), "is_adversary", False)
    return Screened(
        _algorithm(there, settings),
        None if closed_loop else lambda: _algorithm(pipeline, settings),
        screen,
        _problem(pipeline),
        simulator=settings.simulator.name,
        seed=settings.seed,
        budget=settings.budget,
        batch=settings.screen_batch,
        say=warn,
    )


def require_asynchronous(given: SearchOptions, algorithm: type[toolkit.Algorithm]) -> None:
    """Check that a search can run ahead of its results, if it is to.

    Args:
        given: the options of the search.
        algorithm: of that name.

    Raises:
        InputError: it cannot.
    """
    if not given.ahead:
        return
    if given.screen is not None:
        raise InputError(f"--ahead is for a search without a screen (--screen), got {given.ahead}")
    if not asynchronous(algorithm):
        able = ", ".join(name for name, kind in toolkit.ALGORITHMS.items() if asynchronous(kind))
        raise InputError(
            f"--ahead {given.ahead}: {given.algorithm} needs the results of all its rows before it "
            f"asks for more; these algorithms do not: {able}"
        )


def drawn_of(
    algorithm: toolkit.Algorithm, pipeline: Pipeline, settings: Settings, store: Store
) -> Drawn:
    """Return the rows of a finished run as they were drawn, with their chances.

    Args:
        algorithm: that searched; if it was not asked for all rows, since the run had been resumed
            from its end, another one is.
        pipeline: of the run.
        settings: of the run, which is one with rates.
        store: of the run.
    """
    assert isinstance(algorithm, Rate)
    log, n = ResultLog(store.n_obj, len(store.metrics)), len(store)
    for rows in store.rows():
        log.add(rows)
    again, known = not len(algorithm.draws.U), KnownRows()
    ids = np.empty(0, np.int64)
    while True:
        if again:
            U = algorithm.ask()
        X = pipeline.space.decode(algorithm.draws.U[len(ids) :]) + 0.0
        more, _ = known.add(X, n)
        ids = np.concatenate([ids, more])
        if not again or len(known) >= n:
            break
        algorithm.tell(U, log.results(more))
    over = np.flatnonzero(ids < 0)  # the budget ends within a batch
    last = int(over[0]) if len(over) else len(ids)
    met = _met(pipeline, settings)
    road = OnRoad(met, pipeline.space).share if met else (1.0, 1.0, 1.0)
    amounts: dict[Literal["hour", "1,000 km"], OfExposure] = {}
    # Hours and kilometres count encounters outside the ODD, too, of which nothing is simulated.
    if met and met.encounters and settings.odd is None:
        if (per_hour := met.encounters.per_hour) is not None:
            amounts["hour"] = per_hour
        if (per_km := met.encounters.per_km) is not None:
            amounts["1,000 km"] = per_km.of_which(1000.0, 1000.0, 1000.0)
    return Drawn(
        algorithm.draws.take(last),
        ids[:last],
        road,
        met.source if met else "",
        amounts,
        settings.budget - n if store.finished == Reason.ENOUGH else 0,
    )


def _met(pipeline: Pipeline, settings: Settings) -> Exposure | None:
    """Return the exposure of a run with rates, if there is one."""
    scenario = pipeline.scenario
    return chosen_exposure(scenario, settings.exposure) if settings.rate else None


def _problem(
    pipeline: Pipeline, arena: Arena | None = None, met: Exposure | None = None
) -> Problem:
    space, n_obj = pipeline.space, pipeline.objective.n_obj
    road = None if met is None else OnRoad(met, space)
    return Problem(space.variables, pipeline.metrics, n_obj, arena, space.levels, road)


def _algorithm(pipeline: Pipeline, settings: Settings) -> toolkit.Algorithm:
    """Return the run's search algorithm, as it begins."""
    method = toolkit.get(settings.algorithm)
    arena = pipeline.arena() if getattr(method, "is_adversary", False) else None
    if arena is not None:
        arena.warm_up()
    problem = _problem(pipeline, arena, _met(pipeline, settings))
    values = resolve(method, problem, settings.seed, settings.settings)
    return method(problem, settings.seed, **values)


LEAST_RATED, QUIET = 300, 0.25
"""Number of evaluations before which no search with rates ends, unless its budget does; and the
share of them, the last ones, in which there was no new failure mode."""


class Suffices:
    """Whether a search with rates may end: its interval is narrow, and no failure mode is new.

    Args:
        algorithm: that searches.
        kinds: of the participants, by name.
    """

    def __init__(self, algorithm: Rate, kinds: Mapping[str, str]) -> None:
        self._algorithm, self._kinds = algorithm, kinds
        self._modes, self._rows, self._at_last = set[Key](), 0, 0

    def after_batch(self, progress: Progress) -> None:
        """Note the failure modes of a batch, recorded or replayed."""
        self._rows, result = progress.evaluations, progress.result
        if result.findings is not None:
            found = result.findings.take(np.flatnonzero(result.critical))
            blank = [""] * len(found.conflict)
            keys = keys_of(found, self._kinds, blank, blank)
            if not self._modes.issuperset(keys):
                self._modes.update(keys)
                self._at_last = self._rows

    def __call__(self) -> bool:
        """Return whether the rows so far suffice, by the algorithm's settings."""
        ran, values = self._algorithm, self._algorithm.values
        if self._rows < LEAST_RATED or self._rows - self._at_last < QUIET * self._rows:
            return False
        n = len(ran.draws.U)
        found = how_likely(Drawn(ran.draws, np.arange(n), ran.road.share, ""), ran.critical)
        width = found.high - found.low
        return bool(found.estimate) and width <= 2.0 * values["precision"] * (found.estimate or 0.0)


# --- A search ends early if the user's driver fails in every scenario: there is nothing to find ---


LEAST = 20
"""Number of scenarios in which a driver must have failed before the search ends; the budget if
smaller."""


class FailingDriver:
    """Ends the search of a driver that has failed in every evaluated scenario.

    Scenarios that failed for another reason than the driver say nothing about it. The evaluations
    that ended a search are in its store, so a resumed one ends in the same error.

    Args:
        store: of the run.
        driver: the user's own, by name.
        budget: of evaluations.

    Raises:
        InputError: it failed in all scenarios of a run that is resumed.
    """

    def __init__(self, store: Store, driver: str, budget: int) -> None:
        self._store, self._driver, self._budget = store, driver, budget
        self._failed, self._drives = 0, False
        # A resumed run counts the rows of its store here, so after_batch skips what is replayed.
        for rows in store.rows():
            self._count(rows.status)
            if self._drives:
                return
        self._refuse()

    def after_batch(self, progress: Progress) -> None:
        """Count the failures of a batch.

        Raises:
            InputError: the driver has failed in every scenario so far, and in enough of them.
        """
        if not (self._drives or progress.replayed):
            self._count(progress.result.status)
            self._refuse()

    def _count(self, status: npt.NDArray[np.integer]) -> None:
        self._drives = self._drives or bool((status == 0).any())
        self._failed += int(np.isin(status, list(FAILURES.values())).sum())

    @property
    def fails(self) -> bool:
        """Whether it has failed in every scenario so far, and in enough of them."""
        return not self._drives and self._failed >= max(1, min(LEAST, self._budget))

    def _refuse(self) -> None:
        if not self.fails:
            return
        reasons = Run.of(self._store, self._store.read()).failures
        of_drivers = tuple(STATUS_MESSAGES[status] for status in FAILURES.values())
        reason, count = next(pair for pair in reasons.items() if pair[0].startswith(of_drivers))
        check = f"bridgegen validate {shlex.quote(self._driver)}"
        raise InputError(
            f"the driver '{self._driver}' failed in all {self._failed} scenarios that it was to "
            f"drive, so the search ended after {len(self._store)} of {self._budget} evaluations; "
            f"in {count}: {reason}. Run '{check}', then search again "
            f"in a new folder: {self._store.folder} keeps these evaluations"
        )
