"""The reproduction from start to finish: run what is missing, read, test, draw, write."""

import csv
import io
import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from bridgegen.base.disk import write_whole
from bridgegen.base.errors import Interrupted, StorageError
from bridgegen.engine.workers import read_choice
from bridgegen.jobs.compare.comparison import compare
from bridgegen.jobs.compare.plan import RUNS, Cell
from bridgegen.jobs.compare.result import Comparison
from bridgegen.jobs.compare.runs import evaluations_of
from bridgegen.jobs.frame import JobCallbacks
from bridgegen_reproduction import paper
from bridgegen_reproduction.claims import judge, of_fronts
from bridgegen_reproduction.document import FIGURES, TABLES, Document, Picture, markdown
from bridgegen_reproduction.page import html
from bridgegen_reproduction.perception import CAUSES, causes_of, paired_of
from bridgegen_reproduction.pictures import pictures
from bridgegen_reproduction.protocol import PARTS, PRINTED, Part, Protocol, make_protocol
from bridgegen_reproduction.results import of_run, results_of
from bridgegen_reproduction.runs import Run, read_run
from bridgegen_reproduction.story import RUNS_FILE, Found, in_short, tell
from bridgegen_reproduction.table import to_csv, to_latex, to_markdown

MARK, PAGE, README, TIMES_FILE = "reproduction.json", "index.html", "README.md", "times.csv"

NUMBERS = (
    "r_critic",
    "evaluations_to_k",
    "avg_d_min",
    "median_d_min",
    "avg_v_d",
    "median_v_d",
    "avg_fitness",
    "median_fitness",
)
TIMES = ("seconds_to_k", "runtime")


@dataclass(frozen=True)
class Reproduction:
    """The result of a reproduction.

    Attributes:
        folder: of all its files.
        found: the numbers.
        document: what was written.
    """

    folder: Path
    found: Found
    document: Document

    @property
    def page(self) -> Path:
        """What to open first."""
        return self.folder / PAGE

    @property
    def in_short(self) -> list[tuple[str, str]]:
        """What was found, in sentences, each with a few words before it."""
        return in_short(self.found)

    @property
    def gaps(self) -> Mapping[tuple[str, Cell], str]:
        """Why runs failed, by part's name and run."""
        return self.found.gaps


def reproduce(
    *,
    seeds: int = 10,
    iterations: int = paper.ITERATIONS,
    scenarios: Iterable[str] = tuple(map(paper.short, paper.SCENARIOS)),
    out: Path | str = "reproduction",
    workers: int | str | None = None,
    road_map: Path | str | None = None,
    junction: str | None = None,
    callbacks: JobCallbacks | None = None,
) -> Reproduction:
    """Run the paper's evaluation, Section V, and write it down beside the paper's numbers.

    Three comparisons' folders under ``out``: Section V as printed, the same with the reference
    driver and its perception, and the random scenarios again with ideal perception. Then tables,
    figures, ``README.md`` and ``index.html``. Killed at any moment and called again, it goes on;
    called with more seeds, it makes those runs besides.

    Args:
        seeds: runs of each method in each scenario, with the seeds 0, 1, 2 …
        iterations: of each run, of 40 evaluations; the paper's are 25.
        scenarios: of crossroads-s1 to -s4; S4 must be among them.
        out: the folder.
        workers: who makes the runs, see ``compare``. No result depends on it.
        road_map: a map to run on, CARLA's Town05 as in the paper, say; a generated crossroads by
            default.
        junction: which junction of the map.
        callbacks: called as it progresses.

    Returns:
        The reproduction. A run that failed is a gap in it; PPO is missing where its packages are.

    Raises:
        InputError: anything that the arguments say wrongly.
        StorageError: the folder holds something else, is being written, or cannot be.
        Interrupted: Ctrl-C; every run keeps what it has done.
    """
    callbacks = callbacks or JobCallbacks()
    read_choice(workers)  # before there is a folder
    protocol = make_protocol(
        seeds=seeds,
        iterations=iterations,
        scenarios=tuple(scenarios),
        out=Path(out),
        road_map=None if road_map is None else Path(road_map).resolve(),
        junction=junction,
    )
    _begin(protocol)
    comparisons: dict[str, Comparison] = {}
    try:
        progress = _Progress(protocol, callbacks)
        for part in PARTS:
            seen = progress.of(part)
            arguments = protocol.arguments(part)
            comparisons[part.name] = compare(
                **arguments, workers=workers, deliver=False, callbacks=seen
            )
        callbacks.stage("reading the runs")
        found = _read(protocol, comparisons)
        callbacks.stage("drawing")
        document = tell(found, pictures(found, comparisons[PRINTED.name]))
        _write(found, document)
    except (KeyboardInterrupt, Interrupted):
        ended = [is_ended for *_, is_ended in _runs_of(protocol)]
        raise Interrupted(
            protocol.out, sum(ended), len(ended), what="runs", command=protocol.command()
        ) from None
    return Reproduction(protocol.out, found, document)


def _begin(protocol: Protocol) -> None:
    """Make the folder, or find that it holds a reproduction.

    Raises:
        StorageError: it holds something else, or cannot be used.
    """
    out = protocol.out
    try:
        if out.exists() and not (out / MARK).exists() and any(out.iterdir()):
            raise StorageError(
                f"{out}: is not empty and holds no reproduction, so it is left alone; choose "
                "another --out"
            )
        for folder in (out, out / TABLES, out / FIGURES):
            folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise StorageError(f"{out}: cannot be used: {error.strerror}") from None
    mark = {"reproduction": "Section V", "parts": [part.name for part in PARTS]}
    write_whole(out / MARK, [json.dumps(mark, indent=1).encode()])


def _runs_of(protocol: Protocol) -> Iterator[tuple[Part, int, bool]]:
    """Yield of each run its part, its evaluations, and whether it has ended."""
    for part, cell in protocol.cells():
        try:
            yield part, *evaluations_of(protocol.run_folder(part, cell))
        except StorageError:  # the comparison tells of it
            yield part, 0, False


class _Progress:
    """Says how far the runs of all parts are, each of which is a comparison."""

    def __init__(self, protocol: Protocol, callbacks: JobCallbacks) -> None:
        self._callbacks = callbacks
        self._total, self._made = 0, {part.name: 0 for part in PARTS}
        for part, evaluations, is_ended in _runs_of(protocol):
            self._total += protocol.budget
            self._made[part.name] += evaluations if is_ended else 0

    def of(self, part: Part) -> JobCallbacks:
        """Return the callbacks of one part's comparison."""

        def progress(what: str, made: int, total: int, facts: str) -> None:
            self._made[part.name] = made
            now = f"{part.name}: {facts}"
            self._callbacks.progress(what, sum(self._made.values()), self._total, now)

        return replace(self._callbacks, progress=progress, stage=lambda what: None)


def _read(protocol: Protocol, comparisons: Mapping[str, Comparison]) -> Found:
    """Read every run, and work out all that is told of them."""
    runs: dict[tuple[str, Cell], Run] = {}
    gaps: dict[tuple[str, Cell], str] = {}
    for part, cell in protocol.cells():
        key = (part.name, cell)
        why = comparisons[part.name].gaps.get(cell)
        if why is not None:
            gaps[key] = why
            continue
        name = f"{part.name}/{RUNS}/{cell.name}"
        replay = f"replay/{part.name}/{cell.name}"
        try:
            runs[key] = read_run(protocol.run_folder(part, cell), name, replay)
        except StorageError as error:
            gaps[key] = str(error)
    results = {name: results_of(protocol, runs, name) for name in protocol.scenarios}
    measured = comparisons[PRINTED.name].measured
    fronts = {
        name: of_fronts(measured[name], protocol.algorithms) if name in measured else {}
        for name in protocol.scenarios
    }
    return Found(
        protocol=protocol,
        runs=runs,
        gaps=gaps,
        results=results,
        verdicts={name: judge(results[name], fronts[name]) for name in protocol.scenarios},
        causes=causes_of(protocol, runs),
        paired=paired_of(protocol, runs),
        commands={name: comparison.plan.command() for name, comparison in comparisons.items()},
    )


def _write(found: Found, document: Document) -> None:
    """Write all files; those that hold no seconds are the same bytes every time."""
    out = found.protocol.out
    for shown in document.tables():
        table = shown.table
        for ending, text in (
            ("md", f"# {table.title}\n\n{to_markdown(table)}"),
            ("csv", to_csv(table)),
            ("tex", to_latex(table)),
        ):
            write_whole(out / TABLES / f"{table.name}.{ending}", [text.encode()])
    for picture in document.pictures():
        _write_picture(out / FIGURES, picture)
    k = found.main.k
    write_whole(out / RUNS_FILE, [_csv(_runs(found, k)).encode()])
    write_whole(out / TIMES_FILE, [_csv(_times(found, k)).encode()])
    write_whole(out / README, [markdown(document).encode()])
    write_whole(out / PAGE, [html(document)])


def _write_picture(folder: Path, picture: Picture) -> None:
    write_whole(folder / f"{picture.name}.png", [picture.light])
    write_whole(folder / f"{picture.name}.pdf", [picture.pdf])


def _csv(rows: Iterable[Sequence[object]]) -> str:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    for row in rows:
        writer.writerow(
            ["" if isinstance(value, float) and value != value else value for value in row]
        )
    return text.getvalue()


def _cells(found: Found) -> Iterator[tuple[Part, Cell, Run]]:
    for part, cell in found.protocol.cells():
        if (part.name, cell) in found.runs:
            yield part, cell, found.runs[part.name, cell]


def _runs(found: Found, k: int) -> Iterator[Sequence[object]]:
    labels = [cause.label for cause in CAUSES]
    yield (
        "part",
        "scenario",
        "algorithm",
        "seed",
        "evaluations",
        "critical",
        *NUMBERS,
        *labels,
        "folder",
        "command",
    )
    for part, cell, run in _cells(found):
        numbers = of_run(run, k)
        yield (
            part.name,
            cell.scenario,
            cell.algorithm,
            cell.seed,
            len(run.critical),
            len(run.hits),
            *(numbers[name] for name in NUMBERS),
            *(int((run.cause == cause).sum()) if part.causes else "" for cause in CAUSES),
            run.folder,
            run.command,
        )


def _times(found: Found, k: int) -> Iterator[Sequence[object]]:
    yield ("part", "scenario", "algorithm", "seed", *TIMES)
    for part, cell, run in _cells(found):
        numbers = of_run(run, k)
        yield (part.name, cell.scenario, cell.algorithm, cell.seed, *(numbers[n] for n in TIMES))
