"""A folder of runs as a site: their facts, each run's report, two runs side by side."""

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from bridgegen.assess.criteria import headline
from bridgegen.jobs.view.overview import RunLine, find_runs, read_line
from bridgegen.jobs.view.run_view import RunView
from bridgegen.pages import templates
from bridgegen.pages.sentences import NARROW, share
from bridgegen.results.store.run_file import FILE
from bridgegen.search.triage.record import Mode

MOST_OPEN = 4
"""Maximum number of runs whose rows are in memory."""

STILL = 60.0
"""Time without a write after which an unfinished run counts as interrupted [s]."""


class FolderView:
    """The runs below a folder, read only; other processes may be extending them.

    Args:
        folder: of the runs, at any depth.
    """

    def __init__(self, folder: Path | str) -> None:
        self.folder = Path(folder).resolve()
        self._runs: list[Path] = []  # by number
        self._views: dict[int, RunView] = {}
        self._known: dict[int, tuple[tuple[int, int], Mapping[str, Any]]] = {}
        self._find()

    def _find(self) -> None:
        known = set(self._runs)  # a run keeps its number
        # Appended, never sorted anew: open pages address runs by number.
        self._runs += [run for run in find_runs(self.folder) if run not in known]

    def facts(self) -> list[Mapping[str, Any]]:
        """Return what the list says of each run, by number."""
        self._find()
        return [self._facts(k) for k in range(len(self._runs))]

    def news(self, after: Sequence[int]) -> Mapping[str, Any]:
        """Return how many runs there are, and the facts of some, by their numbers."""
        self._find()
        some = [k for k in after if k < len(self._runs)]
        return {"total": len(self._runs), "runs": [self._facts(k) for k in some]}

    def _facts(self, number: int) -> Mapping[str, Any]:
        """Return what the list says of a run; of one that has ended, read once."""
        run = self._runs[number]
        try:
            # A file that replaces another changes the folder's time.
            mark = run.stat().st_mtime_ns, (run / FILE).stat().st_mtime_ns
        except OSError:
            mark = 0, 0
        known = self._known.get(number)
        if known is None or known[0] != mark or not known[1]["finished"]:
            known = mark, _facts(number, read_line(self.folder, run))
            self._known[number] = known
        return known[1]

    def run(self, number: int) -> RunView | None:
        """Return the site of a run by its number; None if there is none.

        Raises:
            BridgeGenError: it cannot be shown.
        """
        if number >= len(self._runs):
            return None
        view = self._views.pop(number, None) or RunView(self._runs[number])
        view.home = "../../"
        self._views[number] = view  # the latest is the last
        while len(self._views) > MOST_OPEN:
            del self._views[next(iter(self._views))]
        return view

    def pair(self, first: int, second: int) -> bytes | None:
        """Return two runs side by side, as HTML; None if one does not exist."""
        if max(first, second) >= len(self._runs):
            return None
        a, b = (read_line(self.folder, self._runs[k]) for k in (first, second))
        rows = [(name, of(a), of(b)) for name, of in _FIGURES.items()]
        return templates.page(
            "jobs/view/pair.html",
            title=f"{a.path} and {b.path}",
            home="./",
            runs=((first, a), (second, b)),
            rows=rows,
            matched=[*_matched(a, b)],
        )


def _facts(number: int, line: RunLine) -> Mapping[str, Any]:
    bound = line.triage.bound if line.triage else None
    worst = max(line.modes, key=lambda item: (not item.knife_edge, item.harm), default=None)
    return {
        "number": number,
        "path": line.path,
        "problem": line.problem,
        "changed": line.changed,
        "size": line.size,
        "scenario": line.scenario,
        "ego": line.ego,
        "algorithm": line.algorithm,
        "seed": line.seed,
        "evaluations": line.evaluations,
        "critical": line.critical,
        "budget": line.budget,
        "finished": line.finished or bool(line.problem),
        "grows": not (line.finished or line.problem) and time.time() - line.changed < STILL,
        "modes": len(line.modes) + (line.triage.unrecorded_modes if line.triage else 0),
        "worst": worst.title if worst else "",
        "judged": headline(line.ego, line.criteria),
        "violated": any(criterion.violated for criterion in line.criteria),
        "failures": bound.failures if bound else None,
        "unjudged": bound is None or not bound.judged,
        "share": bound.space.share if bound else None,
        "low": bound.space.low if bound else None,
        "high": bound.space.high if bound else None,
    }


def _failures(line: RunLine) -> str:
    if line.triage is None:
        return "–"
    return f"{line.triage.bound.failures:,}" if line.triage.bound.judged else "not judged"


def _is_judged(line: RunLine) -> bool:
    return line.triage is not None and line.triage.bound.judged


def _share(line: RunLine) -> str:
    space = line.triage.bound.space if line.triage else None
    if space is None or space.share is None or not _is_judged(line):
        return "–"
    return f"{share(space.share)} (95{NARROW}%: {share(space.low)} to {share(space.high)})"


_FIGURES: dict[str, Callable[[RunLine], str]] = {
    "scenario": lambda line: line.scenario,
    "driver": lambda line: line.ego,
    "algorithm": lambda line: f"{line.algorithm}, seed {line.seed}",
    "evaluations": lambda line: (
        f"{line.evaluations:,}" + ("" if line.finished else ", not finished")
    ),
    "pass criteria": lambda line: headline(line.ego, line.criteria) or "–",
    "failures": lambda line: _failures(line),
    "failure modes": lambda line: f"{len(line.modes):,}" if _is_judged(line) else "–",
    "harmful share of the space": _share,
    "worst severity (MAIS3+)": lambda line: (
        share(max((mode.severity for mode in line.modes), default=0.0)) if _is_judged(line) else "–"
    ),
}


def _matched(a: RunLine, b: RunLine) -> Iterator[tuple[str, list[str]]]:
    """Yield the failure modes of both runs, and of each alone, in words."""
    ours, theirs = _by_key(a), _by_key(b)
    both = [key for key in ours if key in theirs]
    yield (
        "Failure modes of both",
        [
            f"{ours[k][0].title}: {_count(ours[k])} and {_count(theirs[k])} evaluations"
            for k in both
        ],
    )
    for line, own, other in ((a, ours, theirs), (b, theirs, ours)):
        alone = [group for key, group in own.items() if key not in other]
        words = [f"{group[0].title}: {_count(group)} evaluations" for group in alone]
        yield f"Only in {line.path}", words


def _by_key(line: RunLine) -> dict[tuple[str, ...], list[Mode]]:
    """Return the modes of a run by what makes two of different runs the same, in their order."""
    found: dict[tuple[str, ...], list[Mode]] = {}
    for item in line.modes:
        key = (item.conflict, item.conflict_type, item.responsible, item.rule, item.partner)
        found.setdefault(key, []).append(item)
    return found


def _count(modes: list[Mode]) -> str:
    return f"{sum(item.count for item in modes):,}"
