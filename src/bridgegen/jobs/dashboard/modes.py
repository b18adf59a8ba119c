"""The failure modes of a project: those of all results, each once, with the person's status.

The status is that of a block of ``failures.yaml``: of a suite that keeps the same failure, else of
the project's folder.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

from bridgegen.jobs.dashboard.project import Project
from bridgegen.jobs.dashboard.results import (
    Failure,
    ModeKey,
    Result,
    current,
    driver_of,
    in_order,
    place_of,
)
from bridgegen.results.failures import FILE, MOST_TEXT, STATUSES, FailureFile, Status
from bridgegen.results.failures import Failure as Block


@dataclass(frozen=True)
class OpenMode:
    """A failure mode of a project.

    Attributes:
        key: of it.
        title: in words, of the latest result that has it.
        status: as the person sets it; "new" where nothing is set.
        comment: of the person, or "".
        decided: the suite's file and block that state both; "" if the project's own do, or none.
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
    comment: str
    decided: str
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


# --- The blocks that decide ---


@dataclass
class Decisions:
    """What a person decides about failure modes.

    Attributes:
        own: the blocks of the project's folder, by id.
        others: place and block of other folders, by the id or the key of the mode.
    """

    own: Mapping[str, Block] = field(default_factory=dict)
    others: dict[str | ModeKey, list[tuple[str, Block]]] = field(default_factory=dict)

    def of(self, failure: Failure) -> tuple[str, Block]:
        """Return the block of a failure mode, and where it is if it is not the project's own.

        Of several, the one that calls for most: new before known, accepted and fixed.
        """
        key = failure.key
        in_file = ModeKey(
            key.scenario,
            "",
            key.conflict,
            key.conflict_type,
            key.responsible,
            requirement=key.requirement,
        )
        for mode_key in (replace(key, scenario=failure.searched or key.scenario), in_file, key.id):
            if some := self.others.get(mode_key, []):
                # Of several blocks about one mode (by cause), the first of new, known, accepted,
                # fixed counts: what is undecided for one cause is undecided.
                return min(some, key=lambda pair: STATUSES.index(pair[1].status))
        return "", self.own.get(key.id) or Block()


def decisions_of(own: Mapping[str, Block], project: Project) -> Decisions:
    """Return all decisions that concern a project.

    Args:
        own: the blocks of its folder, by id.
        project: with the other files.
    """
    found = Decisions(own)
    files = {**project.decisions, project.folder: FailureFile(project.folder / FILE, own)}
    for folder, file in files.items():
        place = place_of(str(folder / FILE), project.folder)
        for id, block in file.failures.items():
            keys: list[str | ModeKey] = [id] if folder != project.folder else []
            for key in _keys(block, project) if block.files else keys:
                found.others.setdefault(key, []).append((f"{place}: {id}", block))
    for suite in project.suites:
        for scenario, path in suite.files.items():
            kept = files[path.parent].of_file(path.name) if path.parent in files else None
            if kept is None:
                continue
            id, block = kept
            place = place_of(str(path.parent / FILE), project.folder)
            happens = ModeKey(scenario, "", block.conflict, block.type, block.responsible)
            violated = [
                ModeKey(scenario, "", requirement=criterion.id) for criterion in block.violates
            ]
            for key in (happens, *violated):
                # A failure that a growing suite keeps has its status in the suite's file alone.
                found.others[key] = [(f"{place}: {id}", block)]
    return found


def _keys(block: Block, project: Project) -> Iterator[ModeKey]:
    """Yield the keys of the failure modes of runs that a suite's block is about."""
    scenario, driver = block.scenario, driver_of(block.driver, project.folder, "").name
    if block.conflict:
        yield ModeKey(
            scenario,
            driver,
            block.conflict,
            block.type,
            block.responsible,
            block.partner,
            block.place,
        )
    else:
        for criterion in block.violates:
            yield ModeKey(scenario, driver, requirement=criterion.id)


# --- The modes, each with its block ---


_RANK = {"regression": 0, "new": 1, "known": 2, "accepted": 3, "fixed": 4}


def failure_modes(results: Sequence[Result], decisions: Decisions) -> list[OpenMode]:
    """Return all failure modes: those that fail now first, regressions and new ones ahead.

    Args:
        results: of the project.
        decisions: with the status of each.
    """
    now = {id(item) for item in current(results)}
    held: dict[ModeKey, list[tuple[Result, Failure]]] = {}
    for result in in_order(results):
        for failure in result.failures:
            held.setdefault(failure.key, []).append((result, failure))
    found = []
    for key, some in held.items():
        of_now = [pair for pair in some if id(pair[0]) in now]
        shown = of_now or some[-1:]
        decided, block = decisions.of(some[-1][1])
        found.append(
            OpenMode(
                key,
                some[-1][1].title,
                block.status,
                block.comment,
                decided,
                bool(of_now),
                sum(failure.count for _, failure in shown),
                max(failure.severity for _, failure in shown),
                all(failure.knife_edge for _, failure in shown),
                tuple(dict.fromkeys(filter(None, (item.driver.version for item, _ in some)))),
                tuple(result for result, _ in reversed(some)),
            )
        )
    return sorted(found, key=_order)


def _order(open_mode: OpenMode) -> tuple[bool, int, bool, float, int, ModeKey]:
    rank = _RANK["regression" if open_mode.is_regression else open_mode.status]
    return (
        not open_mode.fails_now,
        rank,
        open_mode.knife_edge,
        -open_mode.severity,
        -open_mode.count,
        open_mode.key,
    )


def undecided(modes: Sequence[OpenMode], own: Mapping[str, Block]) -> dict[str, Block]:
    """Return blocks for the failure modes that no block is about, by id."""
    return {
        mode.key.id: Block(
            title=cleaned(mode.title),
            scenario=cleaned(mode.key.scenario),
            driver=cleaned(mode.key.driver),
        )
        for mode in modes
        # Blocks that are there are never changed: the file is the user's, and belongs into git.
        if not mode.decided and mode.key.id not in own
    }


def contradictions(modes: Sequence[OpenMode], own: Mapping[str, Block]) -> list[str]:
    """Return a sentence on each decision of the project's folder that a suite's overrules."""
    return [
        f"{id} is {own[id].status} in {FILE} and {mode.status} in {mode.decided}, which counts: "
        "remove the former"
        for mode in modes
        if mode.decided
        and (id := mode.key.id) in own
        and own[id].status not in ("new", mode.status)
    ]


def cleaned(text: str) -> str:
    """Return a text, which may come from a stranger's file, as a block takes it."""
    # A title may come from a stranger's file: a control character would change what a terminal or
    # an editor shows.
    return "".join(c if c.isprintable() else "\ufffd" for c in text[:MOST_TEXT])


def unseen(modes: Sequence[OpenMode], own: Mapping[str, Block]) -> dict[str, Block]:
    """Return the blocks of the project's folder about modes that none of its results has."""
    known = {mode.key.id for mode in modes}
    return {id: failure for id, failure in own.items() if id not in known and not failure.files}
