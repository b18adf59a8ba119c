"""A search ends early if the user's driver fails in every scenario: there is nothing to find."""

import shlex

import numpy as np
import numpy.typing as npt

from bridgegen.base.errors import InputError
from bridgegen.jobs.search.loop import Progress
from bridgegen.jobs.search.run import Run
from bridgegen.results.store import Store
from bridgegen.simulation.rollout import FAILURES, STATUS_MESSAGES

LEAST = 20
"""Scenarios in which a driver must have failed before the search ends; the budget if smaller."""


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
        reason, count = next(one for one in reasons.items() if one[0].startswith(of_drivers))
        check = f"bridgegen check-driver {shlex.quote(self._driver)}"
        raise InputError(
            f"the driver '{self._driver}' failed in all {self._failed} scenarios that it was to "
            f"drive, so the search ended after {len(self._store)} of {self._budget} evaluations; "
            f"in {count}: {reason}. Run '{check}', then search again "
            f"in a new folder: {self._store.folder} keeps these evaluations"
        )
