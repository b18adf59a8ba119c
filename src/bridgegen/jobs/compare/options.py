"""What a comparison of algorithms can be asked, and the figures that it states."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from bridgegen.base.errors import InputError
from bridgegen.engine.options import CommonOptions, file_forms
from bridgegen.engine.options.forms import NAMES, NUMBER, PATH, TEXT, WHOLE, Form, read_value
from bridgegen.engine.options.option import OUTPUT, SEARCH, WHAT, option
from bridgegen.jobs.frame import ANY, SCENARIOS, Job, SimulatingOptions
from bridgegen.simulation.choice import Value

APART = 0.1
"""Least distance of two scenarios that are different: root mean square over the searched
parameters, as shares of their ranges; two random ones differ by 0.41."""


def _read_settings(texts: Sequence[str], spelling: str) -> dict[str, dict[str, Value]]:
    """Read ``ALGORITHM.NAME=VALUE`` pairs."""
    found: dict[str, dict[str, Value]] = {}
    for text in texts:
        name, equals, value = text.partition("=")
        algorithm, dot, setting = name.partition(".")
        if not (equals and dot and algorithm and setting):
            raise InputError(f"{spelling} must read ALGORITHM.NAME=VALUE, got '{text}'")
        found.setdefault(algorithm, {})[setting] = read_value(value)
    return found


def _setting_words(spelling: str, settings: Mapping[str, Mapping[str, Value]]) -> list[str]:
    return [
        word
        for name, of_it in settings.items()
        for key, value in of_it.items()
        for word in (spelling, f"{name}.{key}={json.dumps(value)}")
    ]


SETTINGS = Form(
    list[str],
    read=_read_settings,
    words=_setting_words,
    keep=lambda given: {name: dict(of_it) for name, of_it in (given or {}).items()},
    in_file=file_forms.TEXTS,
    must="settings by algorithm",
    valid=lambda given: isinstance(given, dict),
)


def _names(given: Any) -> Any:
    return (given,) if isinstance(given, str) else tuple(given)


ALGORITHMS = Form(
    str,
    read=NAMES.read,
    words=NAMES.words,
    keep=_names,
    in_file=file_forms.NAMES,
    valid=NAMES.valid,
    must="names",
)


@dataclass(frozen=True, kw_only=True)
class CompareOptions(CommonOptions, SimulatingOptions):
    """The options of ``compare``: those that all runs share, and those of the grid."""

    scenarios: str | Path | Sequence[str | Path] = field(
        kw_only=False,
        metadata=option(
            SCENARIOS,
            "Catalogue names, or paths of YAML or OpenSCENARIO files.",
            names="scenario",
            group=WHAT,
            is_argument=True,
        ),
    )
    algorithms: str | Sequence[str] = field(
        default=("random", "pso"),
        metadata=option(
            ALGORITHMS,
            "See 'bridgegen list algorithms'; or your own: module:Class, file.py:Class.",
            hint="Separated by commas.",
            shown="random,pso",
            group=SEARCH,
            names="algorithm",
        ),
    )
    settings: Mapping[str, Mapping[str, Value]] = field(
        default_factory=dict,
        metadata=option(
            SETTINGS,
            "Override a setting of an algorithm.",
            spelling="--set",
            hint="ALGORITHM.NAME=VALUE, of your own CLASS.NAME=VALUE; may be repeated.",
            group=SEARCH,
        ),
    )
    baseline: str | None = field(
        default=None,
        metadata=option(
            TEXT,
            "Baseline of the tests.",
            shown="the first algorithm",
            group=OUTPUT,
            names="algorithm",
        ),
    )
    apart: float = field(
        default=APART,
        metadata=option(
            NUMBER,
            "Critical scenarios are different if their searched parameters differ by this share "
            "of their ranges, in root mean square.",
            spelling="--distinct",
            group=OUTPUT,
        ),
    )
    seeds: int = field(
        default=10,
        metadata=option(
            WHOLE, "Runs of each algorithm in each scenario, with the seeds 0, 1, 2 …", group=SEARCH
        ),
    )
    budget: int = field(
        default=1000, metadata=option(WHOLE, "Evaluations of each run, exactly.", group=SEARCH)
    )
    workers: Any = field(
        default=None,
        metadata=option(
            ANY,
            "Number of runs at a time, each in a process; or 'ray' / 'ray://HOST:PORT': a Ray "
            "cluster (extra ray) simulates their scenarios. No result depends on it.",
            shown="one on each core",
            group=SEARCH,
        ),
    )
    out: Path | str | None = field(
        default=None,
        metadata=option(
            PATH,
            "The comparison's folder; a stopped comparison is resumed.",
            shown="comparisons/SCENARIOS",
            group=OUTPUT,
        ),
    )
    deliver: bool = field(
        default=True,
        metadata={"help": "Whether to write tables, figures and page; a later call can do it."},
    )


JOB = Job(
    name="benchmark algorithms",
    options=CompareOptions,
    function="bridgegen.jobs.compare.comparison:compare",
    help="""Compare algorithms over several seeds.

    Writes a table, tests, figures and a page.
    """,
    figures={
        "runs": "runs that have ended",
        "missing": "runs without a result",
    },
    example="missing > 0",
)
