"""The coverage of the search space by a run on disk."""

from pathlib import Path

from bridgegen.campaign.restored import searched
from bridgegen.campaign.run import Run
from bridgegen.campaign.settings import Settings
from bridgegen.odd.coverage import MAX_STRENGTH, Coverage, coverage


def coverage_of(
    folder: Path | str, *, bins: int = 5, strength: int = MAX_STRENGTH
) -> tuple[Settings, Coverage]:
    """Return a run's settings, and the bins and t-way combinations that it evaluated.

    A row whose simulation failed covers nothing.

    Args:
        folder: of a run, finished or not.
        bins: equal bins per parameter; an integer has one for each value.
        strength: the largest t.

    Raises:
        StorageError: not a run, or its scenario or map is not what it was.
        InputError: the scenario or the map is missing; bins or strength out of range.
    """
    run = Run(folder)
    rows, space = run.rows(), searched(run)[1]
    ok = rows.status == 0
    found = coverage(space, rows.X[ok], rows.critical[ok], bins=bins, strength=strength)
    return run.settings, found
