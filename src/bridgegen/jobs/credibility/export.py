"""The dossier of runs: read, filled, written with its page and the script that recomputes it."""

import json
import platform
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from importlib.metadata import version
from importlib.resources import files
from math import nan
from pathlib import Path

from bridgegen.base._elementary_kernels import FUNCTIONS
from bridgegen.base.compilation.cache import is_compiled
from bridgegen.base.disk import refuse_other, write_whole
from bridgegen.base.errors import BridgeGenError, InputError, StorageError
from bridgegen.base.statistics import CONFIDENCE
from bridgegen.drivers import file_of
from bridgegen.engine.conformance import differences
from bridgegen.engine.options import called_with
from bridgegen.jobs.credibility.figures import (
    EVERY,
    EXPOSURE,
    SENSITIVITY,
    flips,
    installed,
    measure,
    twins_of,
)
from bridgegen.jobs.credibility.form import FILE as FORM_FILE
from bridgegen.jobs.credibility.form import read_form, write_form
from bridgegen.jobs.credibility.items import ASKED, CHAPTERS, SOURCES, Asked
from bridgegen.jobs.credibility.measured import FEWEST, TEMPLATE, compare, read_measured
from bridgegen.jobs.credibility.measured import FILE as MEASURED
from bridgegen.jobs.credibility.model import FILE, Dossier, Gap, Item
from bridgegen.jobs.credibility.options import JOB, CredibilityOptions
from bridgegen.jobs.credibility.page import GENERATOR, PAGE, page, worst
from bridgegen.jobs.credibility.region import regions, warning
from bridgegen.jobs.credibility.release import SBOM, known_faults, release, sbom
from bridgegen.jobs.credibility.validation import FIGURES, Protocol, ToolValidated, validate
from bridgegen.jobs.credibility.validation import FILE as PROTOCOL
from bridgegen.jobs.frame import Judged, Table
from bridgegen.jobs.safety_case.context import assumptions
from bridgegen.jobs.safety_case.facts import Facts, Files, read_facts, run_facts
from bridgegen.jobs.safety_case.model import PLACE, Evidence, Number, Statement
from bridgegen.jobs.safety_case.numbers import RUN, TRIAGE, Numbers, statement
from bridgegen.jobs.search.exported import FOLDER as SCENARIOS
from bridgegen.jobs.view.overview import MOST_RUNS, find_folders
from bridgegen.results.confirmation.record import PREFIX, SUFFIX
from bridgegen.results.validated import FILE as VALIDATED
from bridgegen.results.validated import Validated

FOLDER, SCRIPT, GAPS = "dossier", "recompute.py", "gaps.txt"

Details = dict[str, Sequence[str]]


@dataclass(frozen=True)
class Read:
    """The runs that a dossier is asked for.

    Attributes:
        runs: those that were read, by id.
        gaps: why others were not, then what the former lack.
        unread: how many were not.
    """

    runs: Mapping[str, Facts]
    gaps: Sequence[Gap]
    unread: int


def read(folders: Sequence[Path]) -> Read:
    """Read runs; what is wrong with one is a gap, and the rest is read."""
    runs: dict[str, Facts] = {}
    unread: list[Gap] = []
    for folder in folders:
        try:
            _refuse_links(folder)
            facts = read_facts(folder)
            twins_of(folder)
        except (BridgeGenError, OSError) as error:
            problems = error.problems if isinstance(error, BridgeGenError) else [str(error)]
            unread.append(Gap(place=str(folder), why="; ".join(problems)[:4000]))
        else:
            runs[f"R{len(runs) + 1}"] = facts
    lacks = [gap for facts in runs.values() for gap in _lacks(facts)]
    return Read(runs, (*unread, *lacks), len(unread))


def _refuse_links(folder: Path) -> None:
    """Refuse a run of which a file is a link to another place.

    Raises:
        StorageError: that it is.
    """
    # A run may come from another person: figures and digests of this user's files are not its own.
    names = (RUN, f"{RUN}-wal", f"{RUN}-shm", TRIAGE, SENSITIVITY, EXPOSURE, SCENARIOS)
    for path in (*(folder / name for name in names), *folder.glob(f"{PREFIX}*{SUFFIX}")):
        try:
            inside = path.resolve().is_relative_to(folder.resolve())
        except RuntimeError:  # links in a circle
            inside = False
        if path.is_symlink() and not inside:
            raise StorageError(f"{path}: is a link to a place outside {folder}, and is not read")


def _lacks(facts: Facts) -> Iterator[Gap]:
    """Yield what a run that was read lacks."""
    run, place = facts.run, str(facts.run.folder)
    if run.version != version("bridgegen"):
        yield Gap(
            place=place,
            why=f"made by BridgeGen {run.version}; verification of code and assumptions are "
            f"those of {version('bridgegen')}",
            command=run.settings.command(run.folder),
        )
    code = file_of(run.settings.ego)
    if code is not None and not code.is_file():
        yield Gap(place=place, why=f"the driver's file is gone, so it has no digest here: {code}")
    if not facts.triage.step_checks:
        yield Gap(
            place=place,
            why="nothing was simulated at fractions of the time step: its triage was "
            f"{run.settings.triage}, or of an earlier version",
            command=run.settings.command(Path(f"{run.folder.name}-again")),
        )


def build(
    found: Read, answers: Mapping[str, str], out: Path, protocol: Protocol | None = None
) -> Dossier:
    """Return the dossier of runs.

    Args:
        found: the runs.
        answers: what people stated, by key of the form.
        out: the folder of the dossier, which files are named from.
        protocol: of the validation suite, if it was run.
    """
    runs = found.runs
    evidence: list[Evidence] = []
    for number, facts in enumerate(runs.values(), start=1):
        of_run = Files(facts, number, out)
        if (path := facts.run.folder / SENSITIVITY).is_file():
            of_run.add(path, "which constants of the models its verdicts depend on", "")
        if (path := facts.run.folder / EXPOSURE).is_file():
            of_run.add(path, "how its parameters are distributed on roads", "")
        evidence += of_run.all
    numbers, more = measure(runs), Numbers(EVERY)
    tests = read_measured(out, runs)
    comparisons = compare(tests, more)
    validated = regions(runs, tests, comparisons)
    if validated:
        more.add("regions", len(validated), source=VALIDATED)
    if comparisons:
        of_run.add(out / MEASURED, "results of real tests", "")
        evidence.append(of_run.all[-1])
    rows = is_compiled()  # else to compare these takes minutes
    different, distributions = differences(rows=rows), installed()
    more.add("bits_compared", len(FUNCTIONS) + rows, again="bridgegen doctor")
    more.add("bits_different", len(different), again="bridgegen doctor")
    more.add("installed", len(distributions), again="python -m pip list")
    _of_package(more, runs, protocol)
    more.add("files", len(evidence), source=FILE)
    numbers |= {number.id: number for number in more.all}
    details = _added(runs, numbers, different, protocol)
    spans = [
        f"{_plain(one.scenario)}, vehicle {one.vehicle}, {_plain(one.evidence)}: "
        + _plain("; ".join(map(one.side, one.ranges)) + ".")
        for one in validated
    ]
    details["10.2"] = spans + [
        f"{name}: {_plain(said)}."
        for name, one in runs.items()
        if (said := warning(one, validated))
    ]
    notes = _notes(found, numbers, rows=rows)
    if any(one.verdict != "accepted" or one.tests < FEWEST for one in comparisons):
        notes["8.3"] = "not all are accepted, from 6 tests or more"
    if protocol and protocol.failed(*FIGURES["cases"]):
        notes["5.4"] = "cases fail, which are named here"
    items = tuple(
        _filled(
            replace(
                item,
                details=[*item.details, *details.get(item.id, ())],
                note="; ".join(filter(None, [item.note, notes.get(item.id, "")])),
            ),
            numbers,
            answers,
        )
        for item in ASKED
    )
    of_items = [
        Gap(place=item.id, why=f"{item.title}: {item.claim.text}", command=item.again)
        for item in items
        if item.status == "gap"
    ]
    return Dossier(
        generator=f"BridgeGen {version('bridgegen')}",
        machine=f"{platform.python_implementation()} {platform.python_version()}, "
        f"{platform.system()} {platform.machine()}",
        confidence=CONFIDENCE,
        unread=found.unread,
        chapters=CHAPTERS,
        sources=SOURCES,
        runs=tuple(run_facts(facts, name, out) for name, facts in runs.items()),
        commands={
            name: facts.run.settings.command(Path(facts.run.folder.resolve().name))
            for name, facts in runs.items()
        },
        numbers=tuple(numbers.values()),
        items=items,
        flips=tuple(flips(runs)),
        comparisons=tuple(comparisons),
        validated=tuple(validated),
        gaps=(*found.gaps, *of_items),
        installed=distributions,
        evidence=tuple(evidence),
    )


def _of_package(numbers: Numbers, runs: Mapping[str, Facts], protocol: Protocol | None) -> None:
    """Add what the release and the validation suite state."""
    for name, key in (("mutants", "faults"), ("random", "random_faults")):
        if rows := release().get(key):
            for part, count in (
                ("", len(rows)),
                ("_seen", sum(bool(row["kind"]) for row in rows)),
                ("_known", sum(row["kind"] in ("answer", "law") for row in rows)),
            ):
                numbers.add(name + part, count, again="python tools/faults.py, in the source")
    faults = known_faults(facts.run.version for facts in runs.values())
    numbers.add("known_faults", len(faults), again="bridgegen credibility RUN")
    if protocol:
        for name, of in (("", "cases"), ("_wrong", "wrong"), ("_bits", "other_bits")):
            numbers.add(f"cases{name}", protocol.figures[of], source=PROTOCOL)


def _plain(text: str) -> str:
    """Return a text of a run for a template: its braces name no number."""
    return text.translate({ord("{"): "(", ord("}"): ")"})


def _added(
    runs: Mapping[str, Facts],
    numbers: Mapping[str, Number],
    different: Sequence[str],
    protocol: Protocol | None,
) -> Details:
    """Return what runs and package add to items, by their ids: templates of sentences."""
    ran = [number for name, number in numbers.items() if name.startswith("all.ran:")]
    simulators = [
        f"{{all.confirmed:{k}}} of {{all.ran:{k}}} are critical in {_plain(number.of)}, too; "
        f"95 % interval {{all.confirmed_low:{k}}} to {{all.confirmed_high:{k}}}."
        for k, number in enumerate(ran, start=1)
    ]
    recorded = [
        _plain(f"{name}: {found.figures()['says']}")
        for name, facts in runs.items()
        if (found := twins_of(facts.run.folder))
    ]
    return {
        "3.1": [_plain(text) for text, _ in assumptions([*runs.values()])] if runs else [],
        "4.1": [
            _plain(
                f"{name}: digest of the scenario {facts.run.settings.fingerprint}, of all "
                f"evaluations {facts.triage.results}."
            )
            for name, facts in runs.items()
        ],
        "5.1": [f"Differs: {name}." for name in different],
        "5.3": [_plain(text) for text in release().get("coverage", ())],
        "5.4": [
            _plain(f"{one['id']} fails, known by {one['kind']}: {one['what']}")
            for one in (protocol.results if protocol else ())
            if not one["passed"]
        ],
        "5.5": [
            _plain(f"{one['id']}, {one['effect']}: {one['what']} In {one['only']}.")
            for one in known_faults(facts.run.version for facts in runs.values())
        ],
        "8.1": simulators,
        "8.2": recorded,
        "9.3": simulators,
        "9.5": recorded,
        "9.1": [
            _plain(f"{name}, {facts.triage.scenario} with {facts.ego}: ")
            + (f"{{{name}.share_low}}" if f"{name}.share_low" in numbers else "0 %")
            + f" to {{{name}.share_high}} ({{{name}.drawn_harmful}} of {{{name}.drawn_known}})."
            for name, facts in runs.items()
        ],
        "9.6": [f"{name}: at most {{{name}.share_high_steps}}." for name in runs],
        "11.1": [f"{name}: seed {facts.run.settings.seed}." for name, facts in runs.items()],
    }


def _notes(found: Read, numbers: Mapping[str, Number], *, rows: bool) -> dict[str, str]:
    """Return why items are filled in part only, by their ids."""
    shares = sum(f"{name}.share" in numbers for name in found.runs)
    notes = {} if rows else {"5.1": "nothing is compiled yet, so motion is not compared"}
    if found.unread:
        notes |= dict.fromkeys(("1.3", "11.1"), f"{found.unread} runs could not be read")
    checked = sum(bool(facts.triage.step_checks) for facts in found.runs.values())
    if checked < len(found.runs):
        why = f"{checked} of {len(found.runs)} runs have finer steps"
        notes |= {item.id: why for item in ASKED if item.id.startswith("6.")}
    if shares < len(found.runs):
        notes["9.1"] = f"{shares} of {len(found.runs)} runs estimate one"
    return notes


def _filled(asked: Asked, numbers: dict[str, Number], answers: Mapping[str, str]) -> Item:
    """Return an item with its figures, the answer of people, or what is missing."""
    common = {"id": asked.id, "title": asked.title, "sources": tuple(asked.sources)}
    if asked.form:
        answer = answers.get(asked.form, "")
        return Item(
            **common,
            claim=Statement(text=answer or asked.claim),
            how=asked.claim if answer else "",
            details=[Statement(text=text) for text in asked.details],
            again="" if answer else f"write it in {FORM_FILE}, under {asked.form}",
            status="stated" if answer else "yours",
        )
    needs = tuple(f"{EVERY}.{name}" for name in asked.needs)
    if any(name not in numbers for name in needs):
        claim = Statement(text=asked.gap)
        return Item(**common, claim=claim, again=asked.fill, needs=needs, status="gap")
    return Item(
        **common,
        claim=statement(asked.claim, numbers),
        details=tuple(
            statement(text, numbers)
            for text in asked.details
            if all(name in numbers for name in PLACE.findall(text))
        ),
        how=asked.how,
        again=asked.again,
        needs=needs,
        status="partly" if asked.note else "filled",
        note=asked.note,
    )


@dataclass(frozen=True)
class Exported:
    """A dossier on disk.

    Attributes:
        dossier: its content.
        folder: that holds its files.
        protocol: of the validation suite, if it was run.
    """

    dossier: Dossier
    folder: Path
    protocol: Protocol | None = None

    @property
    def page(self) -> Path:
        """The page."""
        return self.folder / PAGE

    @property
    def file(self) -> Path:
        """Its JSON file."""
        return self.folder / FILE

    @property
    def work(self) -> str:
        """How many figures it states."""
        return f"{len(self.dossier.numbers):,} figures"

    def to_json(self) -> dict[str, object]:
        """Return figures and items as JSON's types."""
        return {
            "page": str(self.page),
            "figures": self.dossier.figures | (self.protocol.figures if self.protocol else {}),
            "items": [
                {"item": item.id, "status": item.status, "claim": item.claim.text}
                for item in self.dossier.items
            ],
            "gaps": [gap.model_dump() for gap in self.dossier.gaps],
        }

    def shown(self) -> list[str | Table]:
        """Return the worst first, then the items and the files."""
        rows = [(item.id, item.status, item.claim.text) for item in self.dossier.items]
        return [
            f"{worst(self.dossier)}\n",
            Table(("item", "status", "claim"), rows),
            f"\n{'page':<12}{self.page}",
            f"{'gaps':<12}{self.folder / GAPS}",
            f"{'yours':<12}{self.folder / FORM_FILE}, {self.folder / MEASURED}",
            f"{'check it':<12}python {self.folder / SCRIPT}",
        ]

    def judged(self) -> list[Judged]:
        """Return whether all runs could be read, and the figures."""
        dossier = self.dossier
        suite = self.protocol.figures if self.protocol else dict.fromkeys(FIGURES, nan)
        figures = dossier.figures | suite
        return [
            *([self.protocol.judged(str(self.page), figures)] if self.protocol else ()),
            Judged(
                suite=str(self.page),
                group="bridgegen.credibility",
                test="the runs could be read",
                holds=not dossier.unread,
                details="; ".join(gap.why for gap in dossier.gaps[: dossier.unread])
                or f"{len(dossier.runs)} runs",
                figures=figures,
                facts={},
            ),
        ]


@called_with(CredibilityOptions)
def export_credibility(given: CredibilityOptions) -> Exported | ToolValidated:
    """Write the credibility dossier of runs, or of all runs of projects.

    A run that cannot be read is a gap of the dossier. ``yours.yaml`` is kept as it is.

    Returns:
        The dossier, and its files; without runs the protocol of the validation suite.

    Raises:
        InputError: no folder; or a folder of a run is to be that of the dossier.
        FileFormatError: what people wrote into ``yours.yaml`` is damaged.
        StorageError: a folder is missing or has no run; or the files cannot be written.
    """
    named: list[Path] = list(given.runs)  # type: ignore[arg-type]  # its form makes them so
    if not named and not given.validate:
        raise InputError("a dossier is of one run at least, got none")
    folders = _runs_of(named)
    alone = len(folders) == 1 and folders[0] == named[0]
    out = Path(given.out) if given.out else folders[0] / FOLDER if alone else Path(FOLDER)
    if (out / RUN).exists():
        raise InputError(f"{out}: is the folder of a run; choose another --out")
    refuse_other(out / PAGE, GENERATOR, "dossier")
    answers = read_form(out)
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise StorageError(f"{out}: cannot be written: {error.strerror}") from None
    protocol = None
    if given.validate:
        protocol = validate(given.callbacks)
        write_whole(out / PROTOCOL, [json.dumps(protocol.facts, indent=1).encode() + b"\n"])
        if not named:
            return ToolValidated(protocol, out / PROTOCOL, [*JOB.figures])
    dossier = build(read(folders), answers, out, protocol)
    write_form(out)
    if not (out / MEASURED).exists():
        write_whole(out / MEASURED, [TEMPLATE.encode()])
    data = dossier.model_dump_json(indent=1).encode("utf-8", "replace") + b"\n"
    write_whole(out / FILE, [data])
    regions_data = Validated(regions=dossier.validated).model_dump_json(indent=1).encode()
    write_whole(out / VALIDATED, [regions_data, b"\n"])
    write_whole(out / PAGE, [page(dossier, data)])
    lines = [f"{gap.place}: {gap.why}" + f" [{gap.command}]" * bool(gap.command) + "\n"
             for gap in dossier.gaps]  # fmt: skip
    write_whole(out / SBOM, [sbom()])
    write_whole(out / GAPS, ["".join(lines).encode("utf-8", "replace")])
    for script in (SCRIPT, "recompute_real.py"):
        code = files("bridgegen.jobs.credibility").joinpath(script).read_bytes()
        write_whole(out / script, [code])
    return Exported(dossier, out, protocol)


def _runs_of(named: Sequence[Path]) -> list[Path]:
    """Return folders of runs: those that are named, and all below those that are not runs.

    Raises:
        StorageError: a folder is missing, or has no run.
    """
    found: dict[Path, Path] = {}
    for path in named:
        if not path.is_dir():
            raise StorageError(f"{path}: there is no such folder")
        here = [path]
        if not (path / RUN).exists() and not (path / TRIAGE).exists():
            here = find_folders(path, lambda folder: (folder / RUN).exists())
            if not here:
                raise StorageError(f"{path}: contains no run, nor does any folder below it")
        for folder in here:
            found.setdefault(folder.resolve(), folder)
    # Folders beyond that are not found, so they could not be named.
    if len(found) >= MOST_RUNS:
        raise InputError(f"a dossier is of fewer than {MOST_RUNS:,} runs")
    return list(found.values())
