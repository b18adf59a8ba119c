"""What searches in a campaign: the run's algorithm, by itself or in a screen."""

from collections.abc import Callable

from bridgegen.base.errors import InputError
from bridgegen.engine.options import SearchOptions
from bridgegen.engine.pipeline import Pipeline
from bridgegen.jobs.search.screening import Screen, screen_of
from bridgegen.jobs.search.settings import Settings
from bridgegen.search import algorithms as toolkit
from bridgegen.search.algorithms.algorithm import Arena, Problem, asynchronous, resolve
from bridgegen.search.screened import Screened


def searcher_of(
    pipeline: Pipeline, settings: Settings, warn: Callable[[str], None]
) -> toolkit.Algorithm:
    """Return what searches: the run's algorithm, in the screen if there is one."""
    if settings.screen is None:
        return _algorithm(pipeline, settings)
    there = screen_of(pipeline, settings.screen)
    there.warm_up()
    assert settings.screen_budget is not None
    assert settings.screen_batch is not None
    closed_loop = getattr(toolkit.get(settings.algorithm), "is_adversary", False)
    return Screened(
        _algorithm(there, settings),
        None if closed_loop else lambda: _algorithm(pipeline, settings),
        Screen(there, settings.screen.name, settings.screen_budget),
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
        able = ", ".join(name for name, one in toolkit.ALGORITHMS.items() if asynchronous(one))
        raise InputError(
            f"--ahead {given.ahead}: {given.algorithm} needs the results of all its rows before it "
            f"asks for more; these algorithms do not: {able}"
        )


def _problem(pipeline: Pipeline, arena: Arena | None = None) -> Problem:
    space, n_obj = pipeline.space, pipeline.objective.n_obj
    return Problem(space.variables, pipeline.metrics, n_obj, arena, space.levels)


def _algorithm(pipeline: Pipeline, settings: Settings) -> toolkit.Algorithm:
    """Return the run's search algorithm, as it begins."""
    method = toolkit.get(settings.algorithm)
    arena = pipeline.arena() if getattr(method, "is_adversary", False) else None
    if arena is not None:
        arena.warm_up()
    problem = _problem(pipeline, arena)
    values = resolve(method, problem, settings.seed, settings.settings)
    return method(problem, settings.seed, **values)
