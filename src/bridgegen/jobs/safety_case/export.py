"""The safety case of runs: made, and written with its page and the script that recomputes it."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from importlib.resources import files
from pathlib import Path

from bridgegen.base.disk import write_whole
from bridgegen.base.errors import InputError, StorageError
from bridgegen.base.statistics import CONFIDENCE
from bridgegen.engine.options import called_with
from bridgegen.jobs.frame import Judged, Table
from bridgegen.jobs.safety_case.argument import RunArgument
from bridgegen.jobs.safety_case.builder import Draft, finish
from bridgegen.jobs.safety_case.context import (
    add_assumptions,
    add_context,
    generator,
    justification,
)
from bridgegen.jobs.safety_case.facts import Facts, Files, read_facts, run_facts
from bridgegen.jobs.safety_case.measured import measure
from bridgegen.jobs.safety_case.model import FILE, Number, RunFacts, SafetyCase
from bridgegen.jobs.safety_case.numbers import Numbers
from bridgegen.jobs.safety_case.options import JOB, SafetyCaseOptions
from bridgegen.jobs.safety_case.page import PAGE, page
from bridgegen.search.triage.record import NOT_JUDGED

# --- The safety case of one run or several: its argument, its numbers, its evidence ---


def build(runs: Sequence[Facts], out: Path) -> SafetyCase:
    """Return the safety case of runs.

    Args:
        runs: at least one.
        out: the folder of the case, which its files are named from.
    """
    names = " and ".join(dict.fromkeys(run.triage.scenario for run in runs))
    egos = " and ".join(dict.fromkeys(run.ego for run in runs))
    # Numbers stand in the argument by their ids, and each says how it follows from the files: the
    # script beside the case computes them again without BridgeGen.
    numbers: dict[str, Number] = {}
    top = Draft("Goal", "1", _claim(runs[0]))
    if len(runs) > 1:
        top = _over(runs, numbers)
    strategy = top.below[0][1] if top.below else None
    found: list[RunFacts] = []
    evidence = []
    for k, facts in enumerate(runs, start=1):
        own = top if strategy is None else strategy.add("Goal", f"1.{k}", _claim(facts))
        files, of = Files(facts, k, out), Numbers(f"R{k}")
        measure(facts, of)
        numbers |= {number.id: number for number in of.all}
        add_context(own, facts, files)
        inner = own.add("Strategy", own.at, _STRATEGY)
        if strategy is None:
            inner.add("Justification", own.at, justification())
            add_assumptions(inner, [facts])
        RunArgument(inner, facts, files, of).build()
        evidence += files.all
        found.append(run_facts(facts, f"R{k}", out))
    elements, relations = finish(top, numbers)
    return SafetyCase(
        generator=generator(),
        title=f"{egos} in {names}",
        confidence=CONFIDENCE,
        runs=tuple(found),
        numbers=tuple(numbers.values()),
        elements=elements,
        relations=relations,
        evidence=tuple(evidence),
    )


_STRATEGY = (
    "Argument over scope, coverage, failures, remaining share, requirements, validity of the "
    "simulation, and acceptability."
)


def _claim(facts: Facts) -> str:
    return (
        f"In the searched part of {facts.triage.scenario}, as simulated, no failure of "
        f"{facts.ego} was found, its requirements are met, and the harmful share that may "
        "remain is bounded and acceptable."
    )


def _over(runs: Sequence[Facts], numbers: dict[str, Number]) -> Draft:
    """Return the goal over several runs, with its strategy."""
    top = Draft(
        "Goal", "1", f"What each of {len(runs)} runs claims of its system under test holds."
    )
    strategy = top.add("Strategy", "1", "Argument over each run.")
    strategy.add("Justification", "1", justification())
    of = Numbers("all")
    bounded = sum(bool(run.triage.bound.space.rows) for run in runs)
    if bounded > 1:
        # Bonferroni's inequality: the intervals need not be independent.
        of.add("joint", max(0.0, round(1.0 - bounded * (1.0 - CONFIDENCE), 12)), "percent")
        numbers |= {number.id: number for number in of.all}
        strategy.add(
            "Justification",
            "1.1",
            "The confidence of an interval is that of its run alone. All of them hold together "
            "with a confidence of at least {all.joint} (Bonferroni's inequality).",
        )
    add_assumptions(strategy, list(runs))
    return top


FOLDER, SCRIPT = "safety-case", "recompute.py"


@dataclass(frozen=True)
class Exported:
    """A safety case on disk.

    Attributes:
        case: its content.
        folder: that holds its files.
        page: of it.
        unjudged: by folder of a run that could not be judged, why: no claim on its ego is
            supported.
    """

    case: SafetyCase
    folder: Path
    unjudged: Mapping[Path, str] = field(default_factory=dict)

    @property
    def page(self) -> Path:
        """The page."""
        return self.folder / PAGE

    @property
    def file(self) -> Path:
        """Its JSON file."""
        return self.folder / FILE

    @property
    def script(self) -> Path:
        """What recomputes it."""
        return self.folder / SCRIPT

    @property
    def work(self) -> str:
        """How many numbers it states."""
        return f"{len(self.case.numbers):,} numbers"

    def to_json(self) -> list[dict[str, str]]:
        """Return the goals that decide, with their status, as JSON's types."""
        return [
            {"goal": goal.id, "status": goal.status, "claim": goal.statement.text}
            for goal in self.case.main_goals()
        ]

    def shown(self) -> list[str | Table]:
        """Return the goals that decide, then the files."""
        goals = [(goal.id, goal.status, goal.statement.text) for goal in self.case.main_goals()]
        return [
            Table(("goal", "status", "claim"), goals),
            f"\n{'page':<12}{self.page}",
            f"{'case':<12}{self.file}",
            f"{'check it':<12}python {self.script}",
        ]

    def judged(self) -> list[Judged]:
        """Return whether all runs could be judged, and the goals by status."""
        status = Counter(goal.status for goal in self.case.main_goals())
        whys = [
            f"{run} supports no claim on its driver: {why.removeprefix('Not judged: ')}"
            for run, why in self.unjudged.items()
        ]
        return [
            Judged(
                suite=self.case.title,
                group="bridgegen.safety-case",
                test="the runs could be judged",
                holds=not whys,
                details="; ".join(whys) or f"{len(self.case.runs)} runs",
                figures={name: status[name.replace("_", " ")] for name in JOB.figures},  # type: ignore[index]
                facts={},
            )
        ]


@called_with(SafetyCaseOptions)
def export_safety_case(given: SafetyCaseOptions) -> Exported:
    """Write the safety case of finished runs; the same runs give the same bytes.

    Returns:
        The case, and its files.

    Raises:
        InputError: no run, one given twice, or one that cannot be argued about: not finished,
            without a triage, or of a version that recorded too little.
        FileFormatError: a record of a run is damaged, or another run's.
        StorageError: not a run, damaged or changed since; or the files cannot be written.
    """
    folders: list[Path] = list(given.runs)  # type: ignore[arg-type]  # its form makes them so
    if not folders:
        raise InputError("a safety case is of one run at least, got none")
    seen: set[Path] = set()
    for path in folders:
        if path.resolve() in seen:
            raise InputError(f"{path}: a safety case takes each run once, and it is given twice")
        seen.add(path.resolve())
    folder = (
        Path(given.out)
        if given.out
        else (folders[0] / FOLDER if len(folders) == 1 else Path(FOLDER))
    )
    # All runs are read before the folder is made: a refusal leaves nothing behind.
    found = [read_facts(path) for path in folders]
    if folder.resolve() in seen:
        raise InputError(f"{folder}: is the folder of a run; choose another --out")
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise StorageError(f"{folder}: cannot be written: {error.strerror}") from None
    case = build(found, folder)
    data = case.model_dump_json(indent=1).encode() + b"\n"
    write_whole(folder / FILE, [data])
    write_whole(folder / PAGE, [page(case, data)])
    write_whole(
        folder / SCRIPT, [files("bridgegen.jobs.safety_case").joinpath(SCRIPT).read_bytes()]
    )
    unjudged = {
        facts.run.folder: facts.triage.bound.sentence
        for facts in found
        if facts.run.verdict == NOT_JUDGED
    }
    return Exported(case, folder, unjudged)
