"""The coverage of the search space by a run on disk."""

from pathlib import Path

from bridgegen.base.arrays import Bool, Float
from bridgegen.jobs.search.restored import searched
from bridgegen.jobs.search.run import Run
from bridgegen.jobs.search.settings import Settings
from bridgegen.scenario.exposure import Exposure
from bridgegen.scenario.exposure.reader import chosen_exposure, rows_on_the_road
from bridgegen.scenario.language.coverage import MAX_STRENGTH, Coverage, coverage
from bridgegen.scenario.language.scenario import SearchedScenario
from bridgegen.scenario.language.space import SearchSpace
from bridgegen.scenario.odd.coverage import OddCoverage, odd_coverage


def coverage_of(
    folder: Path | str,
    *,
    bins: int = 5,
    strength: int = MAX_STRENGTH,
    exposure: str | Path | Exposure | None = None,
) -> tuple[Settings, Coverage, OddCoverage | None]:
    """Return a run's settings, the bins and t-way combinations that it evaluated, and of its ODD.

    A row whose simulation failed covers nothing.

    Args:
        folder: of a run, finished or not.
        bins: equal bins per parameter; an integer has one for each value.
        strength: the largest t.
        exposure: how parameters are distributed on the road, see `chosen_exposure`.

    Raises:
        StorageError: not a run, or its scenario or map is not what it was.
        FileFormatError: the exposure's file cannot be read.
        ScenarioError: the exposure breaks a rule.
        InputError: the scenario or the map is missing; bins or strength out of range; the exposure
            contradicts the scenario.
    """
    run = Run(folder)
    scenario, space, _ = searched(run)
    distribution = chosen_exposure(scenario, exposure)
    met = None if distribution is None else rows_on_the_road(distribution, space)
    rows = run.rows()
    ok = rows.status == 0
    found = coverage(space, rows.X[ok], rows.critical[ok], bins=bins, strength=strength, met=met)
    return run.settings, found, of_odd(scenario, space, rows.X[ok], rows.critical[ok])


def of_odd(
    scenario: SearchedScenario, space: SearchSpace, X: Float, critical: Bool
) -> OddCoverage | None:
    """Return what rows cover of the ODD that bounds their scenario; None where none does.

    Args:
        scenario: the scenario.
        space: its search space.
        X: ``(N, len(space.names))``, rows whose simulation succeeded.
        critical: ``(N,)`` bool.
    """
    if scenario.odd is None:
        return None
    found = odd_coverage(scenario.odd.odd)
    found.add(scenario.odd, dict(zip(space.names, X.T, strict=True)), critical)
    return found
