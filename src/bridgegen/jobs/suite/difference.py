"""Two egos on the same rows: what is fixed or broken; and searches for where one is worse."""

import hashlib
import json
import re
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from pathlib import Path
from typing import Any, Literal

from bridgegen.base.errors import BridgeGenError, InputError, Interrupted
from bridgegen.base.statistics import clopper_pearson
from bridgegen.engine.options import SearchOptions, called_with
from bridgegen.jobs.frame import JobCallbacks, Table
from bridgegen.jobs.search import Run, resume, run_search
from bridgegen.jobs.search.campaign import SearchCallbacks
from bridgegen.jobs.suite.evaluate import Job, pipeline_of
from bridgegen.jobs.suite.options import BUDGET, DIFF, DiffOptions
from bridgegen.jobs.suite.results import EntryResult, RowResult, Verdict
from bridgegen.jobs.suite.rows import is_sample
from bridgegen.jobs.suite.suite import SuiteRun, run_entries
from bridgegen.results.store.run_file import FILE
from bridgegen.search.triage.bound import too_few
from bridgegen.search.triage.record import NOT_JUDGED

Change = Literal["fixed", "broken", "both fail", "both pass", "not comparable"]

CHANGES: tuple[Change, ...] = ("broken", "fixed", "both fail", "both pass", "not comparable")

Kind = Literal["broken", "fixed", "worse", "milder", "same", "not comparable"]

KINDS: tuple[Kind, ...] = ("broken", "fixed", "worse", "milder", "same", "not comparable")
"""What a change amounts to, the most important first; each variation is of one kind."""

LEAST_SEVERITY = 1e-4
"""Least difference of two probabilities of MAIS3+ that makes a variation worse or milder. It is the
last digit that pages show ("0.43 %"): what reads the same is called the same."""


@dataclass(frozen=True)
class RowChange:
    """What changes in one variation from the first ego to the second.

    Attributes:
        entry: of the suite, by name.
        row: number of the variation.
        change: the second passes what the first fails ("fixed"), the reverse ("broken"), …
        severity: second less first, of the probability of MAIS3+.
        harm: second less first.
        run: whether both have a result.
        flaky: whether repeats with one of them disagree.
    """

    entry: str
    row: int
    change: Change
    severity: float
    harm: float
    run: bool = True
    flaky: bool = False

    @property
    def kind(self) -> Kind:
        """What the change amounts to: where the verdict stays, the severity decides."""
        if self.change in ("broken", "fixed", "not comparable"):
            return self.change
        if abs(self.severity) < LEAST_SEVERITY:
            return "same"
        return "worse" if self.severity > 0.0 else "milder"


@dataclass(frozen=True)
class Difference:
    """Two egos on the same variations.

    Attributes:
        first: the ego that is compared with, as people call it.
        second: the ego that is compared.
        rows: what changes in each variation; of an entry that one of them cannot run, one.
        sampled: whether the variations are a sample, so that there are confidence intervals.
    """

    first: str
    second: str
    rows: tuple[RowChange, ...]
    sampled: bool = True

    @property
    def counts(self) -> dict[Change, int]:
        """The number of variations of each change."""
        found = Counter(row.change for row in self.rows)
        return {change: found[change] for change in CHANGES}

    @property
    def kinds(self) -> dict[Kind, int]:
        """The number of variations of each kind of change."""
        found = Counter(row.kind for row in self.rows)
        return {kind: found[kind] for kind in KINDS}

    @property
    def headline(self) -> str:
        """Both drivers and the numbers of variations in a line, without a full stop."""
        kinds = self.kinds
        n = len(self.rows) - kinds["not comparable"]
        lost = f"; {kinds['not comparable']:,} not comparable" if kinds["not comparable"] else ""
        if flaky := sum(row.flaky for row in self.rows):
            lost += f" ({flaky:,} flaky)"
        return (
            f"{self.second} against {self.first}: fixes {kinds['fixed']:,}, breaks "
            f"{kinds['broken']:,}, {kinds['worse']:,} worse, {kinds['milder']:,} milder of {n:,} "
            f"{'variation' if n == 1 else 'variations'}{lost}"
        )

    @cached_property
    def unjudged(self) -> dict[str, str]:
        """By entry why it says nothing, of those of which too few variations can be compared."""
        of: dict[str, list[bool]] = {}
        for row in self.rows:
            of.setdefault(row.entry, []).append(row.change != "not comparable")
        whys = {
            entry: too_few(sum(known), len(known), "variations could be compared")
            if len(known) > 1 or known[0]
            else "it could not be compared"
            for entry, known in of.items()
        }
        return {entry: why for entry, why in whys.items() if why}

    def interval(self, change: Change) -> tuple[float, float]:
        """Return the 95 % interval of the share of a change among comparable variations.

        Source: Clopper and Pearson, Biometrika 26 (1934) 404. It holds where variations are a
        sample, as those of a logical scenario are; not where they are all that there are.
        """
        counts = self.counts
        return clopper_pearson(counts[change], len(self.rows) - counts["not comparable"])

    @property
    def p_value(self) -> float:
        """The probability of so uneven a number of fixed and broken variations by chance.

        Source: McNemar's test, exact (Psychometrika 12 (1947) 153).
        """
        from scipy.stats import binomtest

        counts = self.counts
        n = counts["fixed"] + counts["broken"]
        # McNemar's exact test: variations that change nothing say nothing of the difference.
        return float(binomtest(counts["broken"], n).pvalue) if n else 1.0


def difference(
    first: Sequence[EntryResult], second: Sequence[EntryResult], egos: tuple[str, str]
) -> Difference:
    """Compare the results of two egos on the same entries.

    Args:
        first: of the ego that is compared with, entry by entry.
        second: of the other, in the same order.
        egos: their names.
    """
    rows, sampled = list[RowChange](), True
    for a, b in zip(first, second, strict=True):
        if a.problem or b.problem or len(a.rows) != len(b.rows):
            rows.append(RowChange(a.entry, 0, "not comparable", 0.0, 0.0, run=False))
            continue
        sampled = sampled and a.sampled
        verdicts = zip(a.verdicts, b.verdicts, strict=True)
        rows += [_change(a.entry, i, a.rows[i], b.rows[i], both) for i, both in enumerate(verdicts)]
    return Difference(*egos, tuple(rows), sampled)


def suite_difference(suite: SuiteRun) -> Difference | None:
    """Compare the egos of a suite; None if it has another number of them, or was stopped."""
    if len(suite.egos) != 2:
        return None
    first, second = (suite.of_ego(ego) for ego in suite.egos)
    if [result.entry for result in first] != [result.entry for result in second]:
        return None
    return difference(first, second, (suite.labels[0], suite.labels[1]))


def in_order(found: Difference) -> list[RowChange]:
    """Return the changes, the most important first: by kind, then by the change of severity."""
    return sorted(
        found.rows,
        key=lambda row: (KINDS.index(row.kind), -abs(row.severity), -abs(row.harm), row.row),
    )


def _change(
    entry: str, row: int, a: RowResult, b: RowResult, verdicts: tuple[Verdict, Verdict]
) -> RowChange:
    change: Change = "not comparable"
    if not {"not run", "not judged", "flaky"} & {*verdicts}:
        named: dict[tuple[bool, bool], Change] = {
            (True, True): "both fail",
            (True, False): "fixed",
            (False, True): "broken",
            (False, False): "both pass",
        }
        change = named[verdicts[0] == "failed", verdicts[1] == "failed"]
    run = "not run" not in verdicts
    flaky = "flaky" in verdicts
    return RowChange(entry, row, change, b.severity - a.severity, b.harm - a.harm, run, flaky)


# --- Searches of a suite's scenarios for where one ego is worse than another ---


FOLDER = "worse"
"""Folder in a suite's folder that holds the searches, a run each."""

ALGORITHM = "es"
"""Algorithm of the searches: it finds the most failure modes with few evaluations; see
docs/decisions/search.md."""


@dataclass(frozen=True)
class WorseThan:
    """What a search of one scenario found.

    Attributes:
        entry: of the suite, by name.
        folder: of the run; its report has the playback of both egos.
        evaluations: that were made.
        worse: those that the second ego fails and the first passes.
        modes: the titles of the failure modes that they make up, the worst first.
        sentence: the finding in words, with the share of the space.
        problem: why there is no result; else empty.
    """

    entry: str
    folder: Path
    evaluations: int = 0
    worse: int = 0
    modes: tuple[str, ...] = ()
    sentence: str = ""
    problem: str = ""


def search_worse(
    suite: SuiteRun,
    egos: tuple[str, str],
    *,
    budget: int = BUDGET,
    seed: int = 0,
    callbacks: JobCallbacks | None = None,
) -> tuple[WorseThan, ...]:
    """Search each scenario of a suite for where the second ego fails and the first does not.

    Only scenarios whose rows are a sample of a space are searched, logical ones say: of all others
    the suite has run each variation. A search that was stopped is resumed.

    Args:
        suite: that both egos have run, with its jobs.
        egos: the one that is compared with, then the other.
        budget: evaluations of each search; 0: nothing is searched.
        seed: of each search.
        callbacks: called as they progress.

    Returns:
        Of each searched scenario what was found, in the order of the suite.

    Raises:
        Interrupted: Ctrl-C; what is done is kept.
        StorageError: a folder cannot be written.
    """
    callbacks = callbacks or JobCallbacks()
    if not budget:
        return ()
    first, second = egos
    runs = {(result.entry, result.ego): result for result in suite.results}
    jobs = [
        job
        for job in suite.jobs
        if job.ego == second
        and not any(runs[job.entry.name, ego].problem for ego in egos)
        and _is_searched(job)
    ]
    found = []
    for number, job in enumerate(jobs):
        facts = f"{number + 1} of {len(jobs)}: {job.entry.name}"
        progress = partial(_show, callbacks, budget, facts)
        progress(0)
        found.append(_searched(job, first, suite.folder / FOLDER, budget, seed, progress))
    return tuple(found)


def _show(callbacks: JobCallbacks, budget: int, facts: str, evaluations: int) -> None:
    callbacks.progress("searching", evaluations, budget, facts)


def _is_searched(job: Job) -> bool:
    pipeline = pipeline_of(job)
    return bool(pipeline.space.n_var) and is_sample(pipeline.scenario)


def _searched(
    job: Job, first: str, home: Path, budget: int, seed: int, progress: Callable[[int], None]
) -> WorseThan:
    """Search one scenario, resume the search, or read what it found."""
    options = SearchOptions.of(
        job.options,
        ego=job.ego,
        worse_than=first,
        distribution=job.entry.distribution,
        algorithm=ALGORITHM,
        budget=budget,
        seed=seed,
        simulator=job.simulator,
        causes=True,
    )
    how = SearchCallbacks(batch=lambda batch: progress(batch.evaluations))
    name = job.entry.name
    folder = home / _folder_name(job, replace(job, ego=first), options)
    try:
        if not (folder / FILE).exists():
            run = run_search(job.entry.scenario, **vars(options), out=folder, callbacks=how)
        elif not (run := Run(folder)).report.exists():
            run = resume(folder, ego=job.ego, worse_than=first, callbacks=how)
    except Interrupted:
        raise
    except InputError as error:
        return WorseThan(name, folder, problem="; ".join(error.problems))
    except BridgeGenError as error:
        return WorseThan(name, folder, problem=str(error))
    triage, summary = run.triage, run.summary
    if run.verdict == NOT_JUDGED and triage is not None and not summary.critical:
        return WorseThan(name, folder, summary.evaluations, problem=triage.bound.sentence)
    sentence = triage.bound.sentence if triage else ""
    if triage is None or triage.bound.harmful != summary.critical:  # critical by another rule
        words = f"{summary.critical} of {summary.evaluations} evaluations are critical"
        sentence = "; ".join(filter(None, (f"{words} with {job.ego} alone", sentence)))
    modes = tuple(mode.title for mode in triage.modes) if triage else ()
    return WorseThan(name, folder, summary.evaluations, summary.critical, modes, sentence)


def _folder_name(job: Job, first: Job, options: SearchOptions) -> str:
    """Return a name that is another one for each scenario, driver and option."""
    facts = [job.entry.digest, job.driver_digest, first.driver_digest, repr(options)]
    short = hashlib.sha256(json.dumps(facts).encode()).hexdigest()[:8]
    return f"{re.sub(r'[^A-Za-z0-9._-]+', '-', job.entry.name)}-{short}"


# --- The job: a suite with two egos, their difference, and searches ---


@dataclass(frozen=True)
class DriverDifference:
    """Two drivers compared on the same variations, and by searches.

    Attributes:
        suite: of both.
        difference: of the first from the second, variation by variation.
        searches: for where the second is worse, of each logical scenario.
        page: that shows all this.
    """

    suite: SuiteRun
    difference: Difference
    searches: tuple[WorseThan, ...]
    page: Path

    @property
    def work(self) -> str:
        """How much was done."""
        searched = sum(search.evaluations for search in self.searches)
        return f"{self.suite.work}, {searched:,} evaluations of searches"

    def to_json(self) -> Any:
        """Return counts, what is broken or fixed, and the searches as JSON's types."""
        from bridgegen.jobs.suite.shown import json_of_difference

        return json_of_difference(self)

    def shown(self) -> Sequence[str | Table]:
        """Return what is broken and fixed, with intervals, then what searches found."""
        from bridgegen.jobs.suite.shown import difference_shown

        return difference_shown(self)


@called_with(DiffOptions)
def compare_drivers(given: DiffOptions) -> DriverDifference:
    """Compare two drivers on the same variations, and search for where the second is worse.

    Returns:
        What the second breaks and fixes; it is resumed as `run_suite` is.

    Raises:
        InputError: no scenario is found, there are not two drivers, or an argument breaks a rule.
        StorageError: the folder holds something else, or cannot be written.
        Interrupted: Ctrl-C; what is done is kept.
    """
    from bridgegen.jobs.suite.page import write_suite_page

    if len(given.egos) != 2 or given.egos[0] == given.egos[1]:
        raise InputError(
            f"two different drivers are compared: --ego A --ego B, got {', '.join(given.egos)}"
        )
    egos = (given.egos[0], given.egos[1])
    suite = run_entries(DIFF, given)
    searches = search_worse(
        suite, egos, budget=given.budget, seed=given.seed, callbacks=given.callbacks
    )
    given.callbacks.stage("page")
    page = write_suite_page(suite, suite.jobs, searches=searches)
    found = suite_difference(suite)
    assert found is not None  # two drivers, and every entry was run
    return DriverDifference(suite, found, searches, page)
