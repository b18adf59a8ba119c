"""The frame of a job: declared options and a function of them; all else follows from these.

A job's folder has its options, a subclass of `JobOptions`, and its function, which `called_with`
makes one of keywords. From a `Job` follow the command with its help and completion
(`bridgegen.cli.jobs`), run files and their schema, ``--json``, ``--fail-if``, JUnit, and the
command that repeats it. Imports nothing slow: the command line needs it to start.
"""

import shlex
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from importlib import import_module
from math import inf
from os import PathLike
from pathlib import Path
from typing import Any, NamedTuple, Protocol

from bridgegen.base.errors import InputError
from bridgegen.engine.options import file_forms, options_of
from bridgegen.engine.options.forms import PATH, Form, read_names
from bridgegen.engine.options.option import DRIVER, OUTPUT, SEARCH, WHAT, Declared, option
from bridgegen.engine.options.search import OF_ODD


class Table(NamedTuple):
    """A table of the terminal.

    Attributes:
        head: of its columns.
        rows: a value for each column.
        texts: how many of the first columns hold texts; numbers stand to the right.
    """

    head: Sequence[str]
    rows: Sequence[Sequence[object]]
    texts: int = 1_000


def _named(value: Any) -> str:
    """Return how a command names a scenario: a file by its whole path."""
    is_file = Path(value).suffix.lower() in (".yaml", ".yml", ".osc", ".xosc")
    return str(Path(value).resolve()) if is_file else str(value)


def as_names(values: Any) -> tuple[Any, ...]:
    """Return several values, of which Python code may give one alone, or none."""
    return (values,) if isinstance(values, str | PathLike) else tuple(values or ())


def _repeated(spelling: str, values: Sequence[Any]) -> list[str]:
    return [word for value in values for word in (spelling, _named(value))]


SCENARIO = Form(str, words=lambda spelling, value: [spelling, _named(value)])
"""Form of a scenario: a name of the catalogue or of a pack, or the path of a file."""

SCENARIOS = Form(
    list[str],
    words=_repeated,
    keep=as_names,
    in_file=file_forms.TEXTS,
    valid=lambda values: all(isinstance(value, str | PathLike) for value in values),
    must="names or paths",
)
"""Form of several scenarios; in Python one may stand alone."""

EXPOSURES = replace(
    SCENARIOS,
    keep=lambda values: (
        as_names(values) if isinstance(values, list | tuple) else as_names([values])
    ),
    valid=lambda values: None not in values,
    must="names, paths or exposures",
)
"""Form of several exposures; in Python one may stand alone, and be an object."""

PATHS = Form(
    list[Path],
    words=lambda spelling, paths: [
        word for path in paths for word in (spelling, str(path.resolve()))
    ],
    keep=lambda paths: tuple(map(Path, as_names(paths))),
    in_file=file_forms.PATHS,
    valid=lambda paths: all(isinstance(item, Path) for item in paths),
    must="paths",
)
"""Form of several files or folders; in Python one may stand alone."""

DRIVERS = Form(
    list[str],
    read=lambda texts, _: tuple(
        name
        for text in texts
        for name in ([text] if text.startswith("exec:") else read_names(text))
    ),
    words=_repeated,
    keep=as_names,
    in_file=file_forms.TEXTS,
    valid=lambda names: all(isinstance(item, str) for item in names),
    must="names",
)
"""Form of drivers: names, repeated or separated by commas, which a program's call may hold; in
Python one may stand alone."""

ANY = Form(str, valid=lambda value: value is not None, must="given")
"""Form of a text, or of what Python code gives in its place; the job checks it."""


@dataclass(frozen=True)
class JobCallbacks:
    """Called as a job progresses, all from the same thread.

    Attributes:
        compile: before kernels are compiled.
        stage: with the stage that begins, in words.
        progress: with what is counted, how many of it are done, of how many, and further facts.
        say: with a line that stays: what has failed, or what to expect.
    """

    compile: Callable[[], None] = lambda: None
    stage: Callable[[str], None] = lambda what: None
    progress: Callable[[str, int, int, str], None] = lambda what, done, total, facts: None
    say: Callable[[str], None] = lambda text: None


@dataclass(frozen=True, kw_only=True)
class DriveOptions(Declared):
    """How the ego moves, who drives the others, and what bounds the scenario."""

    vehicle: str | None = field(
        default=None,
        metadata=option(
            ANY,
            "How the ego moves: kinematic, single-track or multi-body.",
            shown="kinematic",
            group=DRIVER,
            names="vehicle",
        ),
    )
    others: str | None = field(
        default=None,
        metadata=option(
            ANY,
            "Driver of all other participants: attentive, lawful (so are people on foot and on "
            "cycles), insistent (gives way to none), or scripted (they react to nothing).",
            shown="what the scenario says",
            group=DRIVER,
            names="others",
        ),
    )
    odd: Mapping[str, Any] | Path | str | None = field(default=None, metadata=OF_ODD)


@dataclass(frozen=True, kw_only=True)
class JobOptions(Declared):
    """What every job is given, besides the options of its own."""

    out: Path | str | None = field(
        default=None,
        metadata=option(
            PATH,
            "The result's folder; what was stopped is resumed there.",
            shown="JOB/SCENARIO",
            group=OUTPUT,
        ),
    )
    callbacks: JobCallbacks = field(
        default_factory=JobCallbacks, metadata={"help": "Called as the job progresses."}
    )

    @property
    def more_figures(self) -> Sequence[str]:
        """The figures that these options add to those of the job: pass criteria, say."""
        return ()


@dataclass(frozen=True, kw_only=True)
class SimulatingOptions(JobOptions):
    """What a job that simulates is given besides."""

    workers: Any = field(
        default=None,
        metadata=option(
            ANY,
            "Number of worker processes, or 'ray' / 'ray://HOST:PORT' for a Ray cluster (extra "
            "ray). No result depends on it.",
            shown="threads of one process, one for each core",
            group=SEARCH,
        ),
    )


OF_SCENARIO = option(
    SCENARIO,
    "A name of the catalogue or of a pack, or the path of a YAML file.",
    names="scenario",
    group=WHAT,
    is_argument=True,
)
"""Metadata of the field of the scenario that a job takes as its argument."""


def require_ranges(options: object, limits: Mapping[str, tuple[float, float]]) -> None:
    """Check numbers that are options.

    Args:
        options: of a job.
        limits: by option the least and the greatest value, both allowed.

    Raises:
        InputError: one is out of its range; all that are.
    """
    spelling = {item.name: item.spelling for item in options_of(type(options))}
    if problems := [
        f"{spelling[name]} must be {_range(low, high)}, got {value:,g}"
        for name, (low, high) in limits.items()
        if not low <= (value := getattr(options, name)) <= high
    ]:
        raise InputError(*problems)


def _range(low: float, high: float) -> str:
    return f"at least {low:,g}" if high == inf else f"{low:,g} to {high:,g}"


def command_of(name: str, options: JobOptions, out: Path, **resolved: Any) -> str:
    """Return the command line that repeats a job.

    Args:
        name: of the job.
        options: that it was given.
        out: its folder.
        resolved: options that it has resolved, by name.
    """
    # No result depends on workers, so the command that repeats a job does not name them.
    values = {**vars(options), "workers": None, "out": None, **resolved}
    of_places = [item for item in options_of(type(options)) if item.is_argument]
    rest = [item for item in options_of(type(options)) if not item.is_argument]
    words = [word for place in (*of_places, *rest) for word in place.words(values[place.name])]
    return shlex.join(["bridgegen", *name.split(), *words, "--out", str(out)])


@dataclass(frozen=True)
class Judged:
    """What fail conditions are applied to: a result, or one driver's part of it.

    Attributes:
        suite: its name in JUnit.
        group: of its tests there.
        test: what must hold before a figure is believed.
        holds: whether it does.
        details: why, in words.
        figures: by name; NaN is one that is not known.
        facts: further properties, by name.
        of: the part, "" for the whole.
        missing: the figure that says how much is missing where the test does not hold; "": none.
    """

    suite: str
    group: str
    test: str
    holds: bool
    details: str
    figures: Mapping[str, float]
    facts: Mapping[str, str]
    of: str = ""
    missing: str = ""


class JobResult(Protocol):
    """What a job returns: plain data, and itself in words."""

    @property
    def work(self) -> str:
        """How much was done: "1,000 simulations"."""

    def to_json(self) -> Any:
        """Return the result as JSON's types."""

    def shown(self) -> Sequence[str | Table]:
        """Return what the terminal shows: texts and tables."""


class JudgedResult(JobResult, Protocol):
    """A result to which fail conditions are applied part by part."""

    def judged(self) -> Sequence[Judged]:
        """Return what fail conditions are applied to."""


@dataclass(frozen=True)
class Job:
    """A job, as the command line has it.

    Attributes:
        name: of its command, ``GROUP NAME`` if that is one of a group.
        options: their class.
        function: its module and name, ``module:name``; of keywords, the fields of the options.
        help: what it does; the first line is its summary.
        figures: what ``--fail-if`` can compare, by name: what each means.
        example: of a fail condition.
        fails: what fails it without conditions, in words; "" for nothing.
        has_folder: whether ``--out`` names a folder, of which each run of a run file gets its own.
    """

    name: str
    options: type[JobOptions]
    function: str
    help: str
    figures: Mapping[str, str]
    example: str
    fails: str = ""
    has_folder: bool = True

    @property
    def last_word(self) -> str:
        """The name in its group; also of folders and schemas."""
        return self.name.split()[-1]

    def run(self, options: JobOptions) -> JobResult:
        """Do it."""
        module, _, name = self.function.partition(":")
        result: JobResult = getattr(import_module(module), name)(**vars(options))
        return result
