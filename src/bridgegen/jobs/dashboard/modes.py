"""The failure modes of a project: those of all results, each once, with the person's status."""

from collections.abc import Sequence
from dataclasses import dataclass

from bridgegen.jobs.dashboard.results import Failure, ModeKey, Result, current, in_order
from bridgegen.jobs.dashboard.status_file import Decision, StatusFile
from bridgegen.jobs.suite.index import Status


@dataclass(frozen=True)
class OpenMode:
    """A failure mode of a project.

    Attributes:
        key: of it.
        title: in words, of the latest result that has it.
        status: as the person sets it; "new" where nothing is set.
        note: of the person, or "".
        fails_now: whether a current result has it, see `bridgegen.jobs.dashboard.results.current`.
        count: of evaluations in the current results that have it, else in the latest.
        severity: the worst probability of MAIS3+ in these.
        knife_edge: whether in all of these small changes make it vanish.
        versions: of the driver that have it, in the order of first appearance; without those that
            are not known.
        results: that have it, the latest first.
    """

    key: ModeKey
    title: str
    status: Status
    note: str
    fails_now: bool
    count: int
    severity: float
    knife_edge: bool
    versions: tuple[str, ...]
    results: tuple[Result, ...]

    @property
    def is_regression(self) -> bool:
        """Whether it is called fixed and fails now."""
        return self.status == "fixed" and self.fails_now


_RANK = {"regression": 0, "new": 1, "known": 2, "accepted": 3, "fixed": 4}


def failure_modes(results: Sequence[Result], file: StatusFile) -> list[OpenMode]:
    """Return all failure modes: those that fail now first, regressions and new ones ahead.

    Args:
        results: of the project.
        file: with the status of each.
    """
    now = {id(one) for one in current(results)}
    held: dict[ModeKey, list[tuple[Result, Failure]]] = {}
    for result in in_order(results):
        for failure in result.failures:
            held.setdefault(failure.key, []).append((result, failure))
    found = []
    for key, some in held.items():
        of_now = [pair for pair in some if id(pair[0]) in now]
        shown = of_now or some[-1:]
        found.append(
            OpenMode(
                key,
                some[-1][1].title,
                file.status(key.id),
                file.note(key.id),
                bool(of_now),
                sum(failure.count for _, failure in shown),
                max(failure.severity for _, failure in shown),
                all(failure.knife_edge for _, failure in shown),
                tuple(dict.fromkeys(filter(None, (one.driver.version for one, _ in some)))),
                tuple(result for result, _ in reversed(some)),
            )
        )
    return sorted(found, key=_order)


def _order(one: OpenMode) -> tuple[bool, int, bool, float, int, ModeKey]:
    rank = _RANK["regression" if one.is_regression else one.status]
    return not one.fails_now, rank, one.knife_edge, -one.severity, -one.count, one.key


def decisions_of(modes: Sequence[OpenMode]) -> list[Decision]:
    """Return the blocks of the status file for failure modes, each with its status."""
    return [
        Decision(one.key.id, one.status, one.key.scenario, one.key.driver, one.title)
        for one in modes
    ]


def unseen(modes: Sequence[OpenMode], file: StatusFile) -> list[Decision]:
    """Return what the file decides about modes that no result of the project has."""
    known = {one.key.id for one in modes}
    return [one for name, one in file.decisions.items() if name not in known]
