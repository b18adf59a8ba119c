"""Repairs a driver: search, set its numbers, search again; then both on held-out variations."""

import json
import re
from collections.abc import Sequence
from dataclasses import asdict, dataclass, fields, replace
from functools import partial
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from bridgegen.base.arrays import Float
from bridgegen.base.disk import write_whole
from bridgegen.base.errors import InputError, Interrupted, StorageError
from bridgegen.base.statistics import clopper_pearson
from bridgegen.base.units import percent
from bridgegen.drivers import drivers as egos
from bridgegen.drivers.identity import digest_of
from bridgegen.drivers.tunable import Tunable, split_settings, values_of
from bridgegen.engine.options import SearchOptions, called_with
from bridgegen.engine.workers import open_workers
from bridgegen.jobs.frame import Judged, Table, command_of
from bridgegen.jobs.repair.options import JOB, RepairOptions
from bridgegen.jobs.repair.tune import Bench, Trial
from bridgegen.jobs.search import Run, resume, run_search
from bridgegen.jobs.search.campaign import SearchCallbacks
from bridgegen.jobs.suite.difference import ALGORITHM, DriverDifference, compare_drivers
from bridgegen.jobs.suite.entries import find_entries
from bridgegen.jobs.suite.evaluate import Job, pipeline_of
from bridgegen.jobs.suite.options import ScenariosOptions
from bridgegen.jobs.suite.rows import is_sample
from bridgegen.jobs.suite.suite import check, default_folder
from bridgegen.pages.playbacks import nominal_playback
from bridgegen.pages.thumbnails import Thumbnail, thumbnail
from bridgegen.results.folder import claim
from bridgegen.results.store.run_file import FILE
from bridgegen.simulation.choice import EMBEDDED

SETTINGS, ROUNDS, PATCH, RESULT, PAGE, DIFF = (
    "settings.json",
    "rounds",
    "patch.yaml",
    "repair.json",
    "repair.html",
    "diff",
)

GUARDS, MOST_FAILING = 64, 64
"""Random variations of a scenario of which those that pass must still pass, as many that the first
search has passed, and failing ones that a round adds at most."""

MOST_LEFT = 200
"""Largest number of failures that are left of which the values are recorded."""

_STREAM = 53  # of random numbers, apart from others of the same seed

STRUCTURE = "the structure, not the numbers: none of the settings that were tried mends it"
TRADED = "other settings mend it, but break a constraint or mend fewer"
NEW = "new: it passes without the settings"
LATE = "found by the last search: no settings were sought for it"


@dataclass(frozen=True)
class ModeChange:
    """A failure mode of the first search: its scenario and title, and what the settings change.

    Attributes:
        scenario: by name.
        title: in words.
        robust: whether at least half of the scenarios beside the one that stands for it fail, too.
        examples: recorded ones that were driven again.
        left: of them, those that still fail, or have no result.
    """

    scenario: str
    title: str
    robust: bool
    examples: int
    left: int


@dataclass(frozen=True)
class Left:
    """A failure that is left: its scenario, its parameters by name, and why."""

    scenario: str
    values: dict[str, float]
    why: str


@dataclass(frozen=True)
class Repair:
    """What a repair has come to.

    Attributes:
        ego: the driver.
        repaired: the same with the settings, as ``--ego`` takes it; "" if none are better.
        tunable: its numbers.
        old: their values before.
        new: likewise, after; the same if no settings are better.
        rounds: by round, from 0, the evaluations of its searches and the failures that they add.
        trial: of the new settings, on all rows that have failed and passed.
        tried: number of settings that were tried.
        modes: those of the first search.
        left: failures that are left; of many, some.
        counts: of figures that are counts.
        held_out: both drivers on variations that the repair has not seen; None without settings.
        played: a mended failure before and after, if there is one.
        command: repeats it.
        folder: of the files.
    """

    ego: str
    repaired: str
    tunable: tuple[Tunable, ...]
    old: tuple[float, ...]
    new: tuple[float, ...]
    rounds: tuple[tuple[int, int], ...]
    trial: Trial
    tried: int
    modes: tuple[ModeChange, ...]
    left: tuple[Left, ...]
    counts: dict[str, int]
    held_out: DriverDifference | None
    played: tuple[Thumbnail, ...]
    command: str
    folder: Path

    @property
    def work(self) -> str:
        """How much was done."""
        evaluations = sum(count for count, _ in self.rounds)
        held_out = f", {self.held_out.work}" if self.held_out else ""
        return f"{evaluations:,} evaluations, {self.tried:,} settings{held_out}"

    @property
    def figures(self) -> dict[str, float]:
        """The figures of `JOB`; NaN: of held-out variations, where no settings were found."""
        found = self.held_out.difference if self.held_out else None
        counts = found.counts if found else None
        compared = len(found.rows) - found.counts["not comparable"] if found else 0
        robust = [mode for mode in self.modes if mode.robust]
        upper = float("nan")
        if counts and compared:
            upper = clopper_pearson(counts["broken"] + counts["both fail"], compared)[1]
        return {
            "changed": sum(a != b for a, b in zip(self.old, self.new, strict=True)),
            **self.counts,
            "modes": len(robust),
            "modes_gone": sum(not mode.left for mode in robust),
            **{
                name.replace(" ", "_"): float(counts[name]) if counts else float("nan")  # type: ignore[index]
                for name in ("broken", "fixed", "both fail")
            },
            "fails_upper": upper,
            "jerk": self.trial.jerk,
            "travel_time": self.trial.travel_time,
        }

    @property
    def sentence(self) -> str:
        """The result in a sentence or two."""
        counts = self.counts
        if not self.repaired:
            return (
                f"No settings within the ranges mend any of {counts['failures']:,} failures, keep "
                f"what passes and stay comfortable; {counts['structure']:,} of them none of "
                f"{self.tried:,} settings mends at all: the structure, not the numbers."
            )
        text = f"The settings mend {counts['mended']:,} of {counts['failures']:,} failures"
        if counts["new"]:
            text += f", and {counts['new']:,} of those left are new"
        if self.held_out is None:
            return f"{text}."
        figures = self.figures
        return (
            f"{text}. Held out: fixes {figures['fixed']:,.0f}, breaks {figures['broken']:,.0f}; "
            f"with 95 % confidence at most {percent(figures['fails_upper'])} still fail."
        )

    def to_json(self) -> Any:
        """Return the settings, figures, modes, and what is left, as JSON's types."""
        names = [item.name for item in self.tunable]
        figures = {k: None if v != v else v for k, v in self.figures.items()}
        return {
            "driver": self.ego,
            "repaired": self.repaired or None,
            "settings": {
                name: {"old": old, "new": new, "unit": item.unit}
                for name, old, new, item in zip(
                    names, self.old, self.new, self.tunable, strict=True
                )
            },
            "figures": figures,
            "rounds": [
                {"evaluations": evaluations, "failures": failures}
                for evaluations, failures in self.rounds
            ],
            "modes": [asdict(mode) for mode in self.modes],
            "left": [asdict(item) for item in self.left],
            "held_out": self.held_out.to_json() if self.held_out else None,
        }

    @property
    def table(self) -> Table:
        """The numbers, old and new."""
        rows = [
            (item.name, item.text(old), item.text(new) if new != old else "unchanged",
             f"{item.text(item.low)} to {item.text(item.high)}")
            for item, old, new in zip(self.tunable, self.old, self.new, strict=True)
        ]  # fmt: skip
        return Table(("number", "old", "new", "range"), rows)

    @property
    def rest(self) -> list[tuple[str, int]]:
        """Why failures are left, and how many are for that reason."""
        names = {"structure": STRUCTURE, "traded": TRADED, "new": NEW, "late": LATE}
        return [(why, self.counts[name]) for name, why in names.items() if self.counts.get(name)]

    def shown(self) -> Sequence[str | Table]:
        """Return the sentence, the table of numbers, modes, comfort, and the files."""
        gone = [mode for mode in self.modes if mode.robust and not mode.left]
        robust = sum(mode.robust for mode in self.modes)
        return [
            self.sentence,
            "",
            self.table,
            "",
            f"  {'robust modes':<16}{len(gone)} of {robust} gone",
            f"  {'mean jerk':<16}{self.trial.jerk - 1.0:+.1%}",
            f"  {'travel time':<16}{self.trial.travel_time - 1.0:+.1%}",
            *(f"  {count:<16,}left: {why}" for why, count in self.rest),
            *([f"\n{'driver':<12}{self.repaired}"] if self.repaired else []),
            *([f"{'diff':<12}{self.held_out.page}"] if self.held_out else []),
            f"{'page':<12}{self.folder / PAGE}",
        ]

    def judged(self) -> list[Judged]:
        """Return the figures, believed where settings were found."""
        return [
            Judged(
                suite=f"{self.ego} repair",
                group="bridgegen.repair",
                test="settings were found",
                holds=bool(self.repaired),
                details=self.sentence,
                figures=self.figures,
                facts={"ego": self.ego, "command": self.command, "page": str(self.folder / PAGE)},
            )
        ]


@called_with(RepairOptions)
def repair_driver(given: RepairOptions) -> Repair:
    """Set a driver's tunable numbers so that failures are gone, with the least change.

    Called again with the same arguments after it was stopped, it resumes: searches are kept.

    Returns:
        The settings, what they mend, and what they do not; its files are written.

    Raises:
        InputError: the driver has no tunable numbers, no failure is found, or an argument breaks a
            rule.
        StorageError: the folder holds something else, or cannot be written.
        Interrupted: Ctrl-C; what is done is kept.
    """
    from bridgegen.jobs.repair.page import write_page

    check(given, EMBEDDED)
    if len(given.egos) != 1:
        raise InputError(f"one driver is repaired (--ego), got {', '.join(given.egos) or 'none'}")
    (ego,) = given.egos
    if not egos.get(ego).is_own:
        raise InputError(
            f"'{ego}' has no tunable numbers: those of drivers that ship are compiled in; repair a "
            "driver of your own or a planner (see docs/repair.md)"
        )
    files = [given.files] if isinstance(given.files, str | Path) else list(given.files)
    jobs = [
        Job(entry, ego, given.of_each, EMBEDDED, given.samples, given.seed, given.matrix)
        for entry in find_entries(files)
    ]
    if problems := [job.entry.problem for job in jobs if job.entry.problem]:
        raise InputError(*problems)
    folder = (
        Path(given.out) if given.out is not None else Path("repairs") / default_folder(files).name
    )
    settings = {
        **{name: value for name, value in vars(given).items() if name not in _FREE},
        "version": version("bridgegen"),
        "files of drivers": {ego: digest_of(ego) or None},
        "scenario files": {job.entry.name: job.entry.digest for job in jobs},
    }
    command = command_of(JOB.name, given, folder)
    made = _Repairer(given, jobs, folder, command)
    claim(folder, json.loads(json.dumps(settings, default=str)), file=SETTINGS, pieces=ROUNDS,
          what="repair", belongs=(PATCH, RESULT, PAGE, DIFF).__contains__)  # fmt: skip
    try:
        found = made.run()
    except (KeyboardInterrupt, Interrupted):
        raise Interrupted(folder, made.done, given.rounds, what="rounds", command=command) from None
    write_whole(folder / RESULT, [json.dumps(found.to_json(), indent=1).encode()])
    write_page(folder / PAGE, found)
    return found


_FREE = ("workers", "out", "callbacks")


class _Repairer:
    """Does the rounds of a repair.

    Raises:
        InputError: the driver declares no tunable numbers, or a scenario has nothing to search.
    """

    def __init__(
        self, given: RepairOptions, jobs: Sequence[Job], folder: Path, command: str
    ) -> None:
        self.given, self.jobs, self.folder, self.command = given, jobs, folder, command
        self.done = 0
        given.callbacks.compile()
        self.hands = open_workers(None)
        pipelines = [pipeline_of(job) for job in jobs]
        for job, pipeline in zip(jobs, pipelines, strict=True):
            if not (pipeline.space.n_var and is_sample(pipeline.scenario)):
                raise InputError(f"{job.entry.name}: nothing varies in it that could be searched")
        (self.ego,) = given.egos
        driver = pipelines[0].driver
        self.tunable = pipelines[0].runner.embedded.own_driver.traits.tunable
        if not self.tunable:
            raise InputError(
                f"the driver '{self.ego}' declares no tunable numbers; its class must have, for "
                'example, tunable = {"headway": (1.5, 0.5, 3.0, "s")}: default, low, high, unit'
            )
        self.old = tuple(values_of(self.tunable, driver.settings, self.ego).values())
        self.bench = Bench(pipelines, self.tunable, self.old, given.within, self.hands.__enter__())

    def run(self) -> Repair:
        """Search and tune until nothing new is found; then compare on held-out variations."""
        given, bench, say = self.given, self.bench, self.given.callbacks
        values, rounds, first = self.old, list[tuple[int, int]](), list[Run]()
        sought = [0 for _ in self.jobs]
        for number in range(given.rounds + 1):
            self.done = number
            runs = [self._search(job, values, number) for job in self.jobs]
            fresh = [self._failures(i, run, values) for i, run in enumerate(runs)]
            if number == 0:
                first = runs
                drawn = [self._guard(i, run) for i, run in enumerate(runs)]
                fresh = [np.concatenate(pair) for pair in zip(fresh, drawn, strict=True)]
            rounds.append((sum(run.summary.evaluations for run in runs), sum(map(len, fresh))))
            if number == 0 and not any(map(len, fresh)):
                names = ", ".join(job.entry.name for job in self.jobs)
                raise InputError(
                    f"no failure of '{self.ego}' was found in {rounds[0][0]:,} evaluations of "
                    f"{names}: there is nothing to repair; a larger --budget or another --seed "
                    "may find one"
                )
            bench.add(fresh)
            if not any(map(len, fresh)) or number == given.rounds:
                break
            sought = [len(X) for X in bench.failing]
            say.stage(f"settings, round {number + 1}")
            best = bench.tune(values, given.tries, [given.seed, _STREAM, number])
            # Failures that no numbers mend are found again by every search: they are no reason to
            # go on.
            if best.mends.sum() <= bench.trial(values).mends.sum():
                break
            values = best.values
            self._write(self._patch(number + 1), values)
        return self._result(values, rounds, first, sought)

    def _search(self, job: Job, values: tuple[float, ...], number: int) -> Run:
        """Search a scenario with settings; read or resume what an earlier call began."""
        given = self.given
        ego = self._named(self._patch(number)) if number else self.ego
        options = SearchOptions.of(
            job.options,
            ego=ego,
            distribution=job.entry.distribution,
            algorithm=ALGORITHM,
            budget=given.budget,
            seed=given.seed + number,
            simulator=job.simulator,
            causes=False,
            triage="none" if number else "short",
        )
        facts = f"round {number}: {job.entry.name}"
        show = partial(given.callbacks.progress, "searching")
        how = SearchCallbacks(batch=lambda at: show(at.evaluations, given.budget, facts))
        name = re.sub(r"[^\w.-]+", "-", job.entry.name)
        folder = self.folder / ROUNDS / str(number) / name
        if not (folder / FILE).exists():
            return run_search(job.entry.scenario, **vars(options), out=folder, callbacks=how)
        run = Run(folder)
        digest = digest_of(ego)
        if run.settings.driver_digest != digest:
            raise StorageError(f"{folder}: was searched with other settings; remove it")
        return run if run.report.exists() else resume(folder, ego=ego, callbacks=how)

    def _failures(self, scene: int, run: Run, values: tuple[float, ...]) -> Float:
        """Return failing rows of a search: the examples of all modes, then others."""
        rows = run.rows()
        modes = run.triage.modes if run.triage else ()
        critical = np.flatnonzero(rows.critical)
        spread = np.random.Generator(np.random.PCG64([self.given.seed, _STREAM])).permutation
        wanted = [*(i for mode in modes for i in mode.examples[:3]), *spread(critical).tolist()]
        X = rows.X[[*dict.fromkeys(wanted)][:MOST_FAILING]]
        return X[self.bench.drive(scene, X, values).fails]

    def _guard(self, scene: int, run: Run) -> Float:
        """Choose the rows of a scenario that must still pass; return random ones that fail."""
        space, rows = self.bench.pipelines[scene].space, run.rows()
        random = np.random.Generator(np.random.PCG64([self.given.seed, _STREAM, scene]))
        drawn = space.decode(random.random((GUARDS, space.n_var))) + 0.0
        passed = random.permutation(np.flatnonzero(~rows.critical & (rows.status == 0)))
        return self.bench.guard(scene, drawn, rows.X[np.sort(passed[:GUARDS])])

    def _patch(self, number: int) -> Path:
        return self.folder / ROUNDS / str(number) / PATCH

    def _named(self, patch: Path) -> str:
        return f"{split_settings(self.ego)[0]}@{patch}"

    def _write(self, path: Path, values: tuple[float, ...]) -> None:
        """Write settings as the driver reads them."""
        lines = [f"# Settings by bridgegen repair; to drive with them: --ego {self._named(path)}"]
        for item, old, new in zip(self.tunable, self.old, values, strict=True):
            unit = f", unit: {json.dumps(item.unit, ensure_ascii=False)}" if item.unit else ""
            # What an earlier file sets, and this one does not change, must be said again.
            if new != item.default or new != old:
                lines.append(f"{item.name}: {{old: {old!r}, new: {new!r}{unit}}}")
        path.parent.mkdir(parents=True, exist_ok=True)
        write_whole(path, ["\n".join([*lines, ""]).encode()])

    def _result(
        self,
        values: tuple[float, ...],
        rounds: Sequence[tuple[int, int]],
        first: Sequence[Run],
        sought: Sequence[int],
    ) -> Repair:
        given, bench = self.given, self.bench
        old, new = bench.trial(self.old), bench.trial(values)
        is_changed = values != self.old
        patch, repaired, held_out = self.folder / PATCH, "", None
        if is_changed:
            self._write(patch, values)
            repaired = self._named(patch)
            shared = {item.name: getattr(given, item.name) for item in fields(ScenariosOptions)}
            given.callbacks.stage("held-out variations")
            held_out = compare_drivers(
                **shared | {"egos": (self.ego, repaired), "out": self.folder / DIFF}, budget=0
            )
        late = np.concatenate(
            [np.arange(len(X)) >= n for X, n in zip(bench.failing, sought, strict=True)]
        )
        left = ~new.mends
        whys = {"new": left & old.mends}
        whys["late"] = left & ~old.mends & late
        whys["structure"] = left & bench.never & ~late
        whys["traded"] = left & ~(whys["new"] | whys["late"] | whys["structure"])
        counts = {name: int(rows.sum()) for name, rows in whys.items()}
        counts |= {"failures": len(left), "mended": int(new.mends.sum()), "left": int(left.sum())}
        scene = np.repeat(np.arange(len(self.jobs)), [len(X) for X in bench.failing])
        X = [x for some in bench.failing for x in some]
        texts = {"new": NEW, "late": LATE, "structure": STRUCTURE, "traded": TRADED}
        rest = []
        for i in np.flatnonzero(left).tolist()[:MOST_LEFT]:
            why = next(name for name, rows in whys.items() if rows[i])
            space = bench.pipelines[scene[i]].space
            values_of_row = dict(zip(space.names, X[i].tolist(), strict=True))
            rest.append(Left(self.jobs[scene[i]].entry.name, values_of_row, texts[why]))
        played: tuple[Thumbnail, ...] = ()
        mended = np.flatnonzero(new.mends & old.fails)
        if repaired and len(mended):
            i = int(mended[np.argmax(old.harm[mended])])
            played = self._played(int(scene[i]), X[i], repaired)
        return Repair(
            ego=self.ego,
            repaired=repaired,
            tunable=self.tunable,
            old=self.old,
            new=values,
            rounds=tuple(rounds),
            trial=new,
            tried=bench.tried,
            modes=tuple(
                mode for i, run in enumerate(first) for mode in self._modes(i, run, values)
            ),
            left=tuple(rest),
            counts=counts,
            held_out=held_out,
            played=played,
            command=self.command,
            folder=self.folder,
        )

    def _modes(self, scene: int, run: Run, values: tuple[float, ...]) -> list[ModeChange]:
        found, rows = [], run.rows()
        for mode in run.triage.modes if run.triage else ():
            driven = self.bench.drive(scene, rows.X[list(mode.examples)], values)
            left = int((~driven.passes).sum())
            name = self.jobs[scene].entry.name
            found.append(
                ModeChange(name, mode.title, not mode.knife_edge, len(driven.passes), left)
            )
        return found

    def _played(self, scene: int, x: Float, repaired: str) -> tuple[Thumbnail, ...]:
        """Return a row with the driver as it is, and repaired."""
        shown = []
        for ego, words in ((self.ego, "before"), (repaired, "after")):
            job = replace(self.jobs[scene], ego=ego)
            playback = nominal_playback(pipeline_of(job), words, x)
            conflict = playback.conflict
            happened = conflict is not None and conflict.summary.happened
            text = conflict.summary.sentence if conflict and happened else "No conflict."
            shown.append(thumbnail(playback, f"{words}: {text}"))
        return tuple(item for item in shown if item is not None)
