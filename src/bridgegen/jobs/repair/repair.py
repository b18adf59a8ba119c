"""Repairs a driver: search, set its numbers, search again; then both on held-out variations.

Settings are handed out as a patch only if the held-out variations support them.
"""

import json
import re
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from functools import partial
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from bridgegen.base.arrays import Float
from bridgegen.base.disk import write_whole
from bridgegen.base.errors import InputError, Interrupted
from bridgegen.base.statistics import clopper_pearson
from bridgegen.base.units import percent
from bridgegen.drivers import drivers
from bridgegen.drivers.identity import digest_of
from bridgegen.drivers.tunable import split_settings, values_of
from bridgegen.engine.options import SearchOptions, called_with
from bridgegen.jobs.frame import Judged, Table, command_of
from bridgegen.jobs.repair.options import JOB, RepairOptions
from bridgegen.jobs.repair.tune import FAILS, FIXED, PASSES, TESTED, Bench, Rows, supported
from bridgegen.jobs.search import Run, resume, run_search
from bridgegen.jobs.search.campaign import SearchCallbacks
from bridgegen.jobs.suite.difference import ALGORITHM, DriverDifference, compare_drivers
from bridgegen.jobs.suite.entries import find_entries
from bridgegen.jobs.suite.evaluate import Job, pipeline_of, rows_of_job
from bridgegen.jobs.suite.options import ScenariosOptions
from bridgegen.jobs.suite.rows import is_sample
from bridgegen.jobs.suite.suite import check, default_folder
from bridgegen.pages.templates import Banner, write_page
from bridgegen.results.folder import claim
from bridgegen.results.store.run_file import FILE
from bridgegen.search.triage.moves import ranges, searched
from bridgegen.search.triage.record import NOT_JUDGED
from bridgegen.simulation.choice import EMBEDDED

SETTINGS, ROUNDS, PATCH, RESULT, PAGE = (
    "settings.json", "rounds", "patch.yaml", "repair.json", "repair.html",
)  # fmt: skip
CANDIDATE = "candidate.yaml"
"""Settings that are compared on held-out variations, which make them the patch or do not."""

DIFF = "diff"

ATTEMPTS = 3
"""Times that settings are compared on held-out variations, other ones each time, at most."""

GUARDS, MOST_FAILING, MOST_LEFT, NEAREST_OF = 64, 64, 200, 2000
"""Random variations of a scenario that must still pass, and as many that the first search has
passed, those nearest to failures; failures that a search adds at most, and random ones; those left
that are listed at most; passed ones of a search of which the nearest are sought, at most."""

_STREAM = 53  # of random numbers, apart from others of the same seed

WHYS = {
    "late": "found by the last search: no settings were sought for it",
    "structure": "the structure, not the numbers: none of the settings that were tried mends it",
    "traded": "other settings mend it, but break a constraint or mend fewer",
}
"""Why a failure is left, by figure."""


@dataclass(frozen=True)
class Repair:
    """What a repair has come to.

    Attributes:
        record: as JSON's types: driver, settings, figures, modes, what is left, rounds.
        held_out: both drivers on variations that it has not seen; None where no settings are
            better.
        evaluations: of the searches.
        tried: number of settings.
        command: repeats it.
        folder: of its files.
    """

    record: dict[str, Any]
    held_out: DriverDifference | None
    evaluations: int
    tried: int
    command: str
    folder: Path

    @property
    def repaired(self) -> str:
        """The driver with its settings, as ``--ego`` takes it; "" where none are handed out."""
        return str(self.record["repaired"] or "")

    @property
    def figures(self) -> dict[str, float]:
        """The figures of `JOB`; NaN: of held-out variations that were not compared."""
        known = self.record["figures"]
        return {name: float("nan") if known[name] is None else known[name] for name in JOB.figures}

    @property
    def work(self) -> str:
        """How much was done."""
        held_out = f", {self.held_out.work}" if self.held_out else ""
        return f"{self.evaluations:,} evaluations, {self.tried:,} settings{held_out}"

    @property
    def sentence(self) -> str:
        """The result in words."""
        of, why = self.record["figures"], self.record["refused"]
        if self.held_out is None:
            return (
                f"No settings mend more of {of['failures']:,} failures, keep what passes, and jerk "
                f"and travel time within 5 %; {of['structure']:,} are the structure, not the "
                f"numbers: none of {self.tried:,} settings mends them."
            )
        text = f"The settings mend {of['mended']:,} of {of['failures']:,} failures"
        if why:
            return f"No patch. {text}, but {why}."
        if not of["fixed"]:
            return f"{text}, and break nothing; no held-out variation fails with or without them."
        text += f". Held out: they fix {of['fixed']:,}, break {of['broken']:,}"
        return f"{text}; with 95 % confidence at most {percent(of['fails_upper'])} still fail."

    @property
    def tables(self) -> dict[str, Table]:
        """The numbers, and why failures are left."""
        settings, of = self.record["settings"], self.record["figures"]
        numbers = [
            (name, *(f"{one[key]:g} {one['unit']}" for key in ("old", "new")))
            for name, one in settings.items()
        ]
        left = [(why, of[name]) for name, why in WHYS.items() if of[name]]
        return {
            "numbers": Table(("number", "old", "new" if self.repaired else "tried"), numbers),
            "left": Table(("left", "failures"), left, 1),
        }

    def to_json(self) -> Any:
        """Return the settings, figures, modes, and what is left, as JSON's types."""
        return self.record | {"held_out": self.held_out.to_json() if self.held_out else None}

    def shown(self) -> Sequence[str | Table]:
        """Return the sentence, the numbers, what is left, comfort, and the files."""
        of, tables = self.record["figures"], self.tables
        return [
            self.sentence,
            "",
            *tables.values(),
            "",
            f"  {'robust modes':<16}{of['modes_gone']} of {of['modes']} gone",
            f"  {'mean jerk':<16}{of['jerk'] - 1.0:+.1%}",
            f"  {'travel time':<16}{of['travel_time'] - 1.0:+.1%}",
            *([f"\n{'driver':<12}{self.repaired}"] if self.repaired else []),
            *([f"{'diff':<12}{self.held_out.page}"] if self.held_out else []),
            f"{'page':<12}{self.folder / PAGE}",
        ]

    def judged(self) -> list[Judged]:
        """Return the figures, believed where settings were found."""
        ego, page = str(self.record["driver"]), str(self.folder / PAGE)
        facts = {"ego": ego, "command": self.command, "page": page}
        made = (f"{ego} repair", "bridgegen.repair", "settings were found", bool(self.repaired))
        return [Judged(*made, self.sentence, self.figures, facts)]

    def write(self) -> None:
        """Write the record and the page.

        Raises:
            StorageError: they cannot be written.
        """
        of, found = self.record["figures"], self.held_out.difference if self.held_out else None
        kind = "open" if found is None else "" if self.repaired else "fails"
        rates = []
        if found is not None:
            for change, count in found.counts.items():
                rates.append((change, count, " to ".join(map(percent, found.interval(change)))))
        write_whole(self.folder / RESULT, [json.dumps(self.to_json(), indent=1).encode()])
        write_page(
            self.folder / PAGE,
            "jobs/repair/page.html",
            title=f"Repair of {self.record['driver']}",
            facts=[self.work, f"mean jerk {of['jerk'] - 1.0:+.1%}",
                   f"travel time {of['travel_time'] - 1.0:+.1%}"],
            verdict=Banner(self.sentence, kind),
            rates=rates,
            diff=self.held_out.page.relative_to(self.folder) if self.held_out else "",
            repair=self,
            tables=self.tables,
        )  # fmt: skip


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
    check(given, EMBEDDED)
    if len(given.egos) != 1:
        raise InputError(f"one driver is repaired (--ego), got {', '.join(given.egos) or 'none'}")
    ego = given.egos[0]
    if not drivers.get(ego).is_own:
        raise InputError(
            f"'{ego}' has no tunable numbers: those of drivers that ship are compiled in; repair a "
            "driver of your own or a planner"
        )
    files = [given.files] if isinstance(given.files, str | Path) else list(given.files)
    jobs = [
        Job(entry, ego, given.of_each, EMBEDDED, given.samples, given.seed, given.matrix)
        for entry in find_entries(files)
    ]
    if problems := [job.entry.problem for job in jobs if job.entry.problem]:
        raise InputError(*problems)
    folder = Path(given.out or Path("repairs") / default_folder(files).name)
    made = _Repairer(given, ego, jobs, folder)
    free = ("workers", "out", "callbacks", "files")
    settings = {
        **{name: repr(value) for name, value in vars(given).items() if name not in free},
        "version": version("bridgegen"),
        "files of drivers": digest_of(ego),
        "scenario files": {job.entry.name: job.entry.digest for job in jobs},
    }
    ours = (PATCH, CANDIDATE, RESULT, PAGE, DIFF)
    claim(folder, settings, file=SETTINGS, what="repair", pieces=ROUNDS, belongs=ours.__contains__)
    try:
        found = made.run()
    except (KeyboardInterrupt, Interrupted):
        raise Interrupted(
            folder, made.round, given.rounds, what="rounds", command=made.command
        ) from None
    found.write()
    return found


class _Repairer:
    """Does the rounds of a repair.

    Raises:
        InputError: the driver declares no tunable numbers, or nothing varies in a scenario.
    """

    def __init__(self, given: RepairOptions, ego: str, jobs: Sequence[Job], folder: Path) -> None:
        self.given, self.ego, self.jobs, self.folder = given, ego, jobs, folder
        self.command, self.round = command_of(JOB.name, given, folder), 0
        given.callbacks.compile()
        pipelines = [pipeline_of(job) for job in jobs]
        for job, pipeline in zip(jobs, pipelines, strict=True):
            if not (pipeline.space.n_var and is_sample(pipeline.scenario)):
                raise InputError(f"{job.entry.name}: nothing varies in it that could be searched")
        runner = pipelines[0].runner
        self.tunable = runner.embedded.own_driver.traits.tunable
        if not self.tunable:
            raise InputError(
                f"the driver '{ego}' declares no tunable numbers; its class must have, for "
                'example, tunable = {"headway": (1.5, 0.5, 3.0, "s")}: default, low, high, unit'
            )
        self.old = tuple(values_of(self.tunable, runner.driver.settings, ego).values())
        self.bench = Bench(pipelines, self.tunable, self.old, given.seed)

    def run(self) -> Repair:
        """Search and tune until nothing new is found; then compare on held-out variations."""
        given, bench, values, sought = self.given, self.bench, self.old, 0
        rounds = list[tuple[int, int]]()
        for number in range(given.rounds + 1):
            self.round = number
            runs = [self._search(job, number) for job in self.jobs]
            fresh, is_refuted = self._failures(runs, values), False
            if number == 0:
                first, fresh = runs, self._begin(runs, fresh)
            else:
                fresh, is_refuted = self._new(fresh, values)
            rounds.append((sum(run.summary.evaluations for run in runs), len(fresh.X)))
            if number == 0 and not len(fresh.X):
                names = ", ".join(job.entry.name for job in self.jobs)
                found = [run.triage.bound for run in runs if run.triage]
                whys = [bound.sentence for bound in found if bound.verdict == NOT_JUDGED]
                raise InputError(
                    f"no failure of '{self.ego}' was found in {rounds[0][0]:,} evaluations of "
                    f"{names}; " + ("; ".join(whys) or "try a larger --budget")
                )
            bench.failing += fresh
            if number == given.rounds:
                values = bench.choose().values if is_refuted else values
                break
            if not (len(fresh.X) or is_refuted):
                break
            sought = len(bench.failing.X)
            given.callbacks.stage(f"settings, round {number + 1}")
            best = bench.tune(values, given.tries, [given.seed, _STREAM, number])
            # Every search finds the failures again that no numbers mend: no reason to go on.
            if not is_refuted and best.mends.sum() <= bench.trial(values, -1.0).mends.sum():
                break
            values = best.values
            if values == self.old:
                break
            self._write(self._patch(number + 1), values)
        return self._result(values, rounds, first, sought)

    def _search(self, job: Job, number: int) -> Run:
        """Search a scenario with a round's settings; read or resume what an earlier call began."""
        given = self.given
        ego = self._named(self._patch(number)) if number else self.ego
        options = SearchOptions.of(
            job.options,
            ego=ego,
            distribution=job.entry.distribution,
            algorithm=ALGORITHM,
            budget=given.budget,
            seed=given.seed + number,
            causes=False,
            triage="none",  # a short one simulates 1,000 rows again
        )
        facts = f"round {number}: {job.entry.name}"
        show = partial(given.callbacks.progress, "searching")
        how = SearchCallbacks(batch=lambda at: show(at.evaluations, given.budget, facts))
        name = re.sub(r"[^\w.-]+", "-", job.entry.name)
        folder = self.folder / ROUNDS / str(number) / name
        if not (folder / FILE).exists():
            return run_search(job.entry.scenario, **vars(options), out=folder, callbacks=how)
        run = Run(folder)
        return run if run.report.exists() else resume(folder, ego=ego, callbacks=how)

    def _failures(self, runs: Sequence[Run], values: tuple[float, ...]) -> Rows:
        """Return failing rows of searches: examples of all modes, then others at random."""
        parts, random = [], np.random.Generator(np.random.PCG64([self.given.seed, _STREAM]))
        for run in runs:
            rows, modes = run.rows(), run.triage.modes if run.triage else ()
            others = random.permutation(np.flatnonzero(rows.critical)).tolist()
            wanted = [*(i for mode in modes for i in mode.examples[:3]), *others]
            parts.append(rows.X[[*dict.fromkeys(wanted)][:MOST_FAILING]])
        found = Rows.of(parts)
        return found.at(np.flatnonzero(self.bench.drive(found, values)[:, FAILS]))

    def _begin(self, runs: Sequence[Run], failing: Rows) -> Rows:
        """Draw rows, choose those that must still pass; return all failing ones."""
        bench, drawn, passed = self.bench, list[Float](), list[Float]()
        given, random = self.given, np.random.Generator(np.random.PCG64([self.given.seed, _STREAM]))
        given.callbacks.stage("random variations")
        for scene, pipeline in enumerate(bench.pipelines):
            of_scene = np.random.Generator(np.random.PCG64([given.seed, _STREAM, scene]))
            cube = of_scene.random((given.samples, pipeline.space.n_var))
            drawn.append(pipeline.space.decode(cube) + 0.0)
        rows = Rows.of(drawn)
        bench.draw(rows.at(random.permutation(len(rows.X))))
        failing += bench.drawn_that(FAILS, MOST_FAILING)
        for scene, (run, pipeline) in enumerate(zip(runs, bench.pipelines, strict=True)):
            found, space = run.rows(), pipeline.space
            at = random.permutation(np.flatnonzero(~found.critical & (found.status == 0)))
            X = found.X[np.sort(at[:NEAREST_OF])]
            fails = [x for x, k in zip(failing.X, failing.scene, strict=True) if k == scene]
            if fails and len(X):
                places, to = (searched(space, at) / ranges(space) for at in (X, np.stack(fails)))
                far = np.min([np.square(places - place).sum(axis=1) for place in to], axis=0)
                X = X[np.sort(np.argsort(far, kind="stable")[:GUARDS])]
            passed.append(X[:GUARDS])
        bench.guard(bench.drawn_that(PASSES, GUARDS), Rows.of(passed))
        return failing

    def _new(self, found: Rows, values: tuple[float, ...]) -> tuple[Rows, bool]:
        """Return the rows that fail without settings, too; whether others fail robustly.

        What the settings break becomes guards.
        """
        before = self.bench.drive(found, self.old)
        broken = found.at(np.flatnonzero(before[:, PASSES]))
        is_robust = self.bench.robust(broken, values)
        self.bench.guard(broken.at(np.flatnonzero(is_robust)))
        return found.at(np.flatnonzero(before[:, FAILS])), bool(is_robust.any())

    def _patch(self, number: int) -> Path:
        return self.folder / ROUNDS / str(number) / PATCH

    def _named(self, patch: Path) -> str:
        return f"{split_settings(self.ego)[0]}@{patch}"

    def _write(self, path: Path, values: tuple[float, ...]) -> None:
        """Write settings as the driver reads them."""
        lines = [f"# By bridgegen repair; to drive with it: --ego {self._named(path)}"]
        for item, old, new in zip(self.tunable, self.old, values, strict=True):
            unit = f", unit: {json.dumps(item.unit, ensure_ascii=False)}" if item.unit else ""
            # What an earlier file sets, and this one does not change, is said again.
            if not old == new == item.default:
                lines.append(f"{item.name}: {{old: {old!r}, new: {new!r}{unit}}}")
        path.parent.mkdir(parents=True, exist_ok=True)
        write_whole(path, ["\n".join([*lines, ""]).encode()])

    def _result(
        self,
        values: tuple[float, ...],
        rounds: Sequence[tuple[int, int]],
        first: Sequence[Run],
        sought: int,
    ) -> Repair:
        given, bench = self.given, self.bench
        repaired, why, held_out, upper, counts = "", "", None, None, dict[str, int]()
        shared = {item.name: getattr(given, item.name) for item in fields(ScenariosOptions)}
        found = values
        for attempt in range(1, ATTEMPTS + 1):
            if found == self.old:
                break
            values = found
            self._write(self.folder / CANDIDATE, values)
            shared |= {"egos": (self.ego, self._named(self.folder / CANDIDATE))}
            shared |= {"out": self.folder / DIFF / str(attempt), "seed": given.seed + attempt - 1}
            held_out = compare_drivers(**shared, budget=0)
            counts = {**held_out.difference.counts}  # type: ignore[dict-item]
            compared = sum(counts.values()) - counts["not comparable"]
            failing = counts["broken"] + counts["both fail"]
            upper = clopper_pearson(failing, compared)[1] if compared else None
            broken = self._broken(held_out, shared["seed"])
            counts["robust"] = int(bench.robust(broken, values).sum())
            if not (why := _refused(counts, compared)):
                self._write(self.folder / PATCH, values)
                repaired = self._named(self.folder / PATCH)
            if not (why and broken.X) or attempt == ATTEMPTS:
                break
            # What they teach is no longer held out: others judge the next settings.
            bench.guard(broken)
            given.callbacks.stage(f"settings, held out {attempt + 1}")
            seed = [given.seed, _STREAM, given.rounds + attempt]
            found, sought = bench.tune(self.old, given.tries, seed).values, len(bench.failing.X)
        new, manner = bench.trial(values, -1.0), bench.manners.get(values, np.ones(2)).tolist()
        left = ~new.mends
        whys = {"late": left & (np.arange(len(left)) >= sought)}
        whys["structure"] = left & bench.never & ~whys["late"]
        whys["traded"] = left & ~np.any([*whys.values()], axis=0)
        modes = [mode for i, run in enumerate(first) for mode in self._modes(i, run, values)]
        robust = [mode for mode in modes if mode["robust"]]
        figures = {
            "changed": sum(a != b for a, b in zip(self.old, values, strict=True)),
            "failures": len(left),
            "mended": int(new.mends.sum()),
            **{name: int(rows.sum()) for name, rows in whys.items()},
            "modes": len(robust),
            "modes_gone": sum(not mode["left"] for mode in robust),
            **{k.replace(" ", "_"): counts.get(k) for k in ("broken", "fixed", "both fail")},
            "broken_robustly": counts.get("robust"),
            "fails_upper": upper,
            **dict(zip(("jerk", "travel_time"), manner, strict=True)),
        }
        rows = []
        for i in np.flatnonzero(left)[:MOST_LEFT].tolist():
            scene, key = int(bench.failing.scene[i]), next(k for k in WHYS if whys[k][i])
            named = zip(
                bench.pipelines[scene].space.names, bench.failing.X[i].tolist(), strict=True
            )
            name = self.jobs[scene].entry.name
            rows.append({"scenario": name, "why": WHYS[key], "values": dict(named)})
        each = zip(self.tunable, self.old, values, strict=True)
        record = {
            "driver": self.ego,
            "repaired": repaired or None,
            "refused": why or None,
            "settings": {t.name: {"old": a, "new": b, "unit": t.unit} for t, a, b in each},
            "figures": figures,
            "modes": modes,
            "left": rows,
            "rounds": [{"evaluations": n, "failures": found} for n, found in rounds],
        }
        evaluations = sum(n for n, _ in rounds)
        return Repair(record, held_out, evaluations, bench.tried, self.command, self.folder)

    def _broken(self, held_out: DriverDifference, seed: int) -> Rows:
        """Return the first held-out variations that are broken."""
        at = {job.entry.name: scene for scene, job in enumerate(self.jobs)}
        broken = [row for row in held_out.difference.rows if row.change == "broken"][:TESTED]
        pairs = zip(self.jobs, self.bench.pipelines, strict=True)
        X = [rows_of_job(replace(job, seed=seed), one) for job, one in pairs] if broken else []
        scene = np.array([at[row.entry] for row in broken], np.int64)
        rows = zip(scene.tolist(), broken, strict=True)
        return Rows(tuple(X[k][row.row] for k, row in rows), scene)

    def _modes(self, scene: int, run: Run, values: tuple[float, ...]) -> list[dict[str, Any]]:
        """Return the failure modes of a search, and how many of their examples do not pass now."""
        found, X = [], run.rows().X
        for mode in run.triage.modes if run.triage else ():
            examples = [*mode.examples]
            worst = Rows(tuple(X[examples[:1]]), np.array([scene]))
            rows = Rows(tuple(X[examples]), np.full(len(examples), scene))
            left = int((self.bench.drive(rows, values)[:, PASSES] == 0.0).sum())
            name, is_robust = self.jobs[scene].entry.name, self.bench.robust(worst, self.old)
            of = {"scenario": name, "title": mode.title, "robust": bool(is_robust.all())}
            found.append(of | {"examples": len(examples), "left": left})
        return found


def _refused(counts: dict[str, int], compared: int) -> str:
    """Say why held-out variations do not support settings; "" if they do."""
    fixed, broken, robust = counts["fixed"], counts["broken"], counts["robust"]
    if robust:
        they = f"break {broken:,}, {robust:,} of them robustly: most neighbours fail, too"
    elif not supported(fixed, broken, robust):
        they = f"fix {fixed:,} and break {broken:,}, not {FIXED} to 1"
    elif not fixed and counts["both fail"]:
        they = f"fix none of {counts['both fail']:,} that fail"
    else:
        return "" if compared else "no held-out variation could be compared"
    return f"of {compared:,} held-out variations they {they}"
