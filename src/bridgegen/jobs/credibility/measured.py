"""``measured.csv``: what real tests measured, beside what the same scenarios gave in the runs.

The area metric is the area between the two empirical distributions, in the quantity's unit.
Sources: Ferson, Oberkampf and Ginzburg (2008), Model validation and predictive capability for the
thermal challenge problem; ASME V&V 20 and V&V 10 [R]. Known, not read for this.
"""

import csv
import math
import random
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from statistics import mean, quantiles

from bridgegen.assess.metrics import METRICS
from bridgegen.base.disk import read_inside, write_whole
from bridgegen.base.errors import FileFormatError
from bridgegen.jobs.credibility.model import Comparison, Verdict
from bridgegen.jobs.safety_case.facts import Facts
from bridgegen.jobs.safety_case.numbers import Numbers
from bridgegen.jobs.search.exported import exported_scenarios
from bridgegen.results.store import Recorded, Store

FILE = "measured.csv"
COLUMNS = ("run", "scenario", "quantity", "unit", "measured", "uncertainty", "threshold", "series")

MOST_TESTS = 2000
MOST_BYTES = 1_000_000
FEWEST = 6
"""Least number of tests for an interval: that of the median, from the least to the greatest of n,
has 1 - 2 ** (1 - n), which is 95 % from 6 on."""
RESAMPLES = 1000

_HEAD = f"""\
# Results of real tests, a row each; 'bridgegen credibility' reads this file and never changes it.
# run: its folder's name, may be empty if there is one run. scenario: the name of an exported one
# (0001), or 'evaluation 12'. quantity: a metric that the run records (bridgegen list metrics), in
# the metric's unit. uncertainty: expanded (k = 2), may be empty. threshold: the greatest area that
# you accept, may be empty. series: tests that are compared together; else those of one scenario.
{",".join(COLUMNS)}
"""


@dataclass(frozen=True)
class RealTest:
    """A row of the file, with what the run has of it.

    Attributes:
        run: id of the run.
        evaluation: of it, from 0.
        series: with which it is compared; of one scenario by default.
        quantity: name of the metric.
        unit: of the metric.
        measured: value.
        simulated: value; not finite where the run has none.
        uncertainty: expanded, ≥ 0.
        threshold: of the area; None if none is stated.
    """

    run: str
    evaluation: int
    series: str
    quantity: str
    unit: str
    measured: float
    simulated: float
    uncertainty: float
    threshold: float | None


def write_template(folder: Path) -> None:
    """Write a file without rows, unless there is one.

    Raises:
        StorageError: it cannot be written.
    """
    if not (folder / FILE).exists():
        write_whole(folder / FILE, [_HEAD.encode()])


def read_measured(folder: Path, runs: Mapping[str, Facts]) -> list[RealTest]:
    """Return the tests that people wrote down; none without the file.

    Args:
        folder: of the dossier.
        runs: that were read, by id.

    Raises:
        FileFormatError: all that is wrong, with line and column.
        StorageError: it cannot be read, or is a link to another folder.
    """
    place = folder / FILE
    try:
        text = read_inside(folder, FILE)[: MOST_BYTES + 1].decode("utf-8-sig")
    except FileNotFoundError:
        return []
    except UnicodeDecodeError as error:
        raise FileFormatError(f"the file must be text in UTF-8: {error.reason} ({place})") from None
    lines = [(n, line) for n, line in enumerate(text.splitlines(), 1)
             if line.strip() and not line.startswith("#")]  # fmt: skip
    if len(text) > MOST_BYTES or "\0" in text or len(lines) > MOST_TESTS + 1:
        raise FileFormatError(
            f"must have at most {MOST_BYTES:,} bytes and {MOST_TESTS:,} rows, no NUL ({place})"
        )
    separator = ";" if lines and ";" in lines[0][1] else ","
    rows = [[cell.strip() for cell in row]
            for row in csv.reader((line for _, line in lines), delimiter=separator)]  # fmt: skip
    if rows and (rows[0] != [*COLUMNS] or len(rows) != len(lines)):
        first = separator.join(rows[0])[:200]
        raise FileFormatError(
            f"rows must be a line each, the first {','.join(COLUMNS)}, got {first!r} ({place})"
        )
    tests, problems = list[RealTest](), list[str]()
    with ExitStack() as stores:

        @cache
        def recorded(run: str) -> Recorded:
            return Recorded(stores.enter_context(Store.open(runs[run].run.folder)))

        for (line, _), row in zip(lines[1:], rows[1:], strict=True):
            cells = dict(zip(COLUMNS, [*row, *[""] * len(COLUMNS)], strict=False))
            try:
                tests.append(_test(cells, runs, recorded))
            except _WrongError as error:
                column, rule = error.args
                problems.append(
                    f"{column} must be {rule}, got {cells[column][:60]!r} ({place}, line {line}, "
                    f"column {column})"
                )
    problems += [
        f"threshold must be the same in all tests of {group[0].series} and {group[0].quantity} "
        f"({place}, column threshold)"
        for group in grouped(tests)
        if len({test.threshold for test in group}) > 1
    ]
    if problems:
        raise FileFormatError(*problems)
    return tests


class _WrongError(Exception):
    """A cell breaks a rule: column and rule."""


def _test(
    cells: Mapping[str, str], runs: Mapping[str, Facts], recorded: Callable[[str], Recorded]
) -> RealTest:
    """Return a row's test.

    Raises:
        _WrongError: a cell breaks a rule.
    """

    def number(column: str, least: float, rule: str) -> float:
        try:
            value = float(cells[column])
        except ValueError:
            value = math.nan
        if not math.isfinite(value) or value < least:
            raise _WrongError(column, rule)
        return value

    names = {name: facts.run.folder.resolve().name for name, facts in runs.items()}
    found = [name for name, folder in names.items() if cells["run"] in ("", folder)]
    if len(found) != 1:
        known = ", ".join(names.values())[:200] or "none"
        raise _WrongError("run", f"the folder's name of one run that is read ({known})")
    facts, quantity = runs[found[0]], cells["quantity"]
    rows, row = recorded(found[0]), _evaluation(facts, cells["scenario"])
    if row is None or row >= len(rows):
        raise _WrongError("scenario", "an exported scenario's name, or 'evaluation N'")
    if quantity not in facts.run.metrics:
        raise _WrongError("quantity", "a metric that the run records; search with --metric NAME")
    own = {about["name"]: str(about["unit"]) for about in facts.run.settings.own_metrics}
    unit = METRICS[quantity].unit if quantity in METRICS else own.get(quantity, "1")
    if cells["unit"] != unit:
        raise _WrongError("unit", f"that of {quantity}, {unit!r}")
    simulated = float(rows.metrics[row, facts.run.metrics.index(quantity)])
    some = cells["threshold"]
    return RealTest(
        run=found[0],
        evaluation=row,
        series=cells["series"] or f"evaluation {row + 1}",
        quantity=quantity,
        unit=unit,
        measured=number("measured", -math.inf, "a finite number with a decimal point"),
        simulated=math.nan if rows.status[row] else simulated,
        uncertainty=number("uncertainty", 0.0, "a number ≥ 0") if cells["uncertainty"] else 0.0,
        threshold=number("threshold", 0.0, "a number ≥ 0") if some else None,
    )


def _evaluation(facts: Facts, named: str) -> int | None:
    """Return the row that a scenario's name stands for; None of none."""
    number = named.removeprefix("evaluation ")
    if not number.isascii() or not number.isdecimal() or len(number) > 9:
        return None
    if number != named:
        return int(number) - 1 if int(number) else None
    exported = {item.name: item.evaluation for item in exported_scenarios(facts.run.folder)}
    return exported.get(number.zfill(4))  # a spreadsheet writes 1 for 0001


def grouped(tests: Sequence[RealTest]) -> list[list[RealTest]]:
    """Return tests that are compared together, in the order of the file."""
    groups: dict[tuple[str, str, str], list[RealTest]] = {}
    for test in tests:
        groups.setdefault((test.run, test.series, test.quantity), []).append(test)
    return [*groups.values()]


def area(measured: Sequence[float], simulated: Sequence[float]) -> float:
    """Return the area between two empirical distributions of as many values each."""
    pairs = zip(sorted(measured), sorted(simulated), strict=True)
    return sum(abs(a - b) for a, b in pairs) / len(measured)


def interval(group: Sequence[RealTest]) -> tuple[float, float]:
    """Return the 95 % interval of an area: bootstrap, and the measurements' uncertainty.

    The bootstrap draws tests with their simulations, percentiles of `RESAMPLES`; with fewer than
    `FEWEST` tests there is none. Errors of at most u each move the area by at most the mean of u.
    """
    pairs = [(test.measured, test.simulated) for test in group]
    low = high = area(*zip(*pairs, strict=True))
    if len(pairs) >= FEWEST:
        draw = random.Random(0)  # no secret: the same in every interpreter
        drawn = (draw.choices(pairs, k=len(pairs)) for _ in range(RESAMPLES))
        ends = quantiles([area(*zip(*some, strict=True)) for some in drawn], n=40)
        low, high = ends[0], ends[-1]
    off = mean(test.uncertainty for test in group)
    return max(low - off, 0.0), high + off


def compare(tests: Sequence[RealTest], numbers: Numbers) -> list[Comparison]:
    """Return the comparisons; add their figures."""
    made = []
    for k, group in enumerate(grouped(tests), start=1):
        first, verdict = group[0], VERDICTS["valueless"]
        measured, simulated = zip(*((t.measured, t.simulated) for t in group), strict=True)
        if all(map(math.isfinite, simulated)):
            low, high = interval(group)
            verdict = _verdict(first.threshold, low, high)
            for name, value in (
                ("area", area(measured, simulated)), ("area_low", low), ("area_high", high),
                ("measured_mean", mean(measured)), ("simulated_mean", mean(simulated)),
            ):  # fmt: skip
                key = f"{first.run}|{first.series}|{first.quantity}"
                numbers.add(f"{name}:{k}", value, "number", of=key, source=FILE, unit=first.unit)
        made.append(
            Comparison(
                run=first.run, series=first.series, quantity=first.quantity, unit=first.unit,
                tests=len(group), threshold=first.threshold, verdict=verdict,
                evaluations=tuple(sorted({test.evaluation + 1 for test in group})),
            )
        )  # fmt: skip
    if made:
        counts = {"tests": len(tests), "comparisons": len(made)}
        counts["few"] = sum(one.tests < FEWEST for one in made)
        counts |= {name: sum(one.verdict == v for one in made) for name, v in VERDICTS.items()}
        for name, count in counts.items():
            numbers.add(name, count, source=FILE)
    return made


VERDICTS: Mapping[str, Verdict] = {
    "accepted": "accepted",
    "refused": "not accepted",
    "undecided": "not decided",
    "without": "no threshold",
    "valueless": "no simulated value",
}
"""Verdicts by the names of their counts."""


def _verdict(threshold: float | None, low: float, high: float) -> Verdict:
    if threshold is None:
        return "no threshold"
    return "accepted" if high <= threshold else "not accepted" if low > threshold else "not decided"
