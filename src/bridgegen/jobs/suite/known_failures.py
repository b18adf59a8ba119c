"""What is known of a suite's failures: the statuses that people set in the index of its folder."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, Self

from bridgegen.jobs.suite.results import EntryResult, RowResult
from bridgegen.results.failures import Failure, FailureFile, Status, failure_of

Standing = Literal[
    "passed", "not run", "not judged", "flaky", "new", "known", "accepted", "regression"
]
"""Status of a variation: known and accepted failures do not fail a suite; new ones do, and
regressions: failures that were fixed and are there again."""

EXCUSED: tuple[Standing, ...] = ("known", "accepted")


@dataclass(frozen=True)
class KnownFailures:
    """The failures that indexes state, by entry.

    Attributes:
        failures: by the name of the entry, with their ids.
    """

    failures: dict[str, tuple[str, Failure]]

    @classmethod
    def of(cls, results: Sequence[EntryResult]) -> Self:
        """Return what the indexes beside the scenarios of results state now.

        Raises:
            FileFormatError: an index is damaged.
        """
        read = dict[Path, FailureFile]()
        found = {
            result.entry: failure
            for result in results
            if (failure := failure_of(result.scenario, result.distribution or None, read))
            is not None
        }
        return cls(found)

    def status_of(self, entry: str) -> Status | None:
        """Return the status that a person gave the failure of an entry, if it is one."""
        found = self.failures.get(entry)
        return None if found is None else found[1].status

    def is_excused(self, entry_result: EntryResult, row: RowResult) -> bool:
        """Return whether a conflict of a critical variation is the one that is known."""
        failure = self._excuse(entry_result)
        way = (row.conflict, row.conflict_type, row.responsible)
        return failure is not None and way == (
            failure.conflict,
            failure.type,
            failure.responsible,
        )

    def is_criterion_excused(self, entry_result: EntryResult, criterion: int) -> bool:
        """Return whether it is known that an entry violates a criterion, by its number."""
        failure = self._excuse(entry_result)
        id = entry_result.criteria[criterion]["id"]
        return failure is not None and any(id == each.id for each in failure.violates)

    def standing(self, entry_result: EntryResult, row: RowResult) -> Standing:
        """Return how a variation of an entry stands."""
        verdict = row.verdict
        if verdict != "failed" and verdict != "flaky":
            return verdict
        found = self.failures.get(entry_result.entry)
        if found is None:
            return "new" if verdict == "failed" else "flaky"
        status = found[1].status
        if status == "fixed":
            return "regression"
        known = not row.critical or self.is_excused(entry_result, row)
        known &= all(self.is_criterion_excused(entry_result, i) for i in row.violated)
        return status if known and status != "new" else "new" if verdict == "failed" else "flaky"

    def worst(self, entry_result: EntryResult) -> Standing:
        """Return how an entry stands: as its worst variation does."""
        found = {self.standing(entry_result, row) for row in entry_result.rows}
        order: tuple[Standing, ...] = (
            "regression",
            "new",
            "flaky",
            "not run",
            "known",
            "accepted",
            "passed",
        )
        if entry_result.problem or not entry_result.rows:
            return "not run"
        if entry_result.verdict == "not judged":
            return "not judged"
        return next(each for each in order if each in found)

    def counts(self, results: Sequence[EntryResult]) -> Counter[Standing]:
        """Return the numbers of variations by how they stand; entries without count as one."""
        found = Counter(self.standing(result, row) for result in results for row in result.rows)
        found["not run"] += sum(bool(result.problem) for result in results)
        return found

    def sentence(self, results: Sequence[EntryResult]) -> str:
        """Return how failing variations stand, in words; empty if none fails or no index names any.

        Args:
            results: with one ego.
        """
        count = self.counts(results)
        known = sum(count[name] for name in EXCUSED)
        if not self.failures or not known + count["new"] + count["regression"]:
            return ""
        again = count["regression"]
        return (
            f"of the variations that fail, {known} {'is' if known == 1 else 'are'} known or "
            f"accepted, {count['new']} new, {again} {'regression' if again == 1 else 'regressions'}"
        )

    def regressions(self, results: Sequence[EntryResult]) -> list[str]:
        """Return the ids of the failures that were fixed, and are there again."""
        again = (result.entry for result in results if self.worst(result) == "regression")
        return sorted({self.failures[name][0] for name in again})

    def gone(self, results: Sequence[EntryResult]) -> list[str]:
        """Return the ids of the failures that no longer fail, and are not called fixed.

        Of all egos together: all of its files pass.
        """
        stand: dict[str, set[Standing]] = {}
        for result in results:
            if result.entry in self.failures:
                stand.setdefault(self.failures[result.entry][0], set()).add(self.worst(result))
        status = {id: failure.status for id, failure in self.failures.values()}
        return sorted(
            id for id, each in stand.items() if each == {"passed"} and status[id] != "fixed"
        )

    def _excuse(self, entry_result: EntryResult) -> Failure | None:
        found = self.failures.get(entry_result.entry)
        return found[1] if found is not None and found[1].status in EXCUSED else None


def words(standing: Standing, failure: tuple[str, Failure] | None) -> str:
    """Return how a failing entry stands, where an index names it."""
    if failure is None or standing in ("passed", "not run", "not judged", "flaky"):
        return ""
    note = f", {failure[1].note}" if failure[1].note else ""
    if standing == "regression":
        return f"regression: it was fixed{note}"
    if standing == "new" and failure[1].status != "new":
        return f"new: not the {failure[1].status} failure"
    return f"{standing} failure{note}"
