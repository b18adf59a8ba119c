"""``measured.csv``: what real tests measured, beside what the same scenarios gave in the runs.

The area metric is the area between the two empirical distributions, in the quantity's unit.
Sources, known and not read for this: Ferson, Oberkampf and Ginzburg (2008), Model validation and
predictive capability for the thermal challenge problem; ASME V&V 20 and V&V 10.
"""

import csv
import math
import random
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from statistics import mean, quantiles
from typing import NamedTuple

from bridgegen.assess.metrics import METRICS
from bridgegen.base.disk import read_inside
from bridgegen.base.errors import FileFormatError
from bridgegen.jobs.credibility.model import Comparison
from bridgegen.jobs.safety_case.facts import Facts
from bridgegen.jobs.safety_case.numbers import Numbers
from bridgegen.jobs.search.exported import exported_scenarios
from bridgegen.results.store import Recorded, Store

FILE = "measured.csv"
COLUMNS = ("run", "scenario", "quantity", "unit", "measured", "uncertainty", "threshold", "series")
TEMPLATE = f"""\
# Results of real tests, a row each; 'bridgegen credibility' reads this file and never changes it.
# run: its folder's name, may be empty if there is one run. scenario: the name of an exported one
# (0001), or 'evaluation 12'. quantity: a metric that the run records (bridgegen list metrics), in
# the metric's unit. uncertainty: expanded (k = 2), may be empty. threshold: the greatest area that
# you accept, may be empty. series: tests that are compared together; else those of one scenario.
{",".join(COLUMNS)}
"""

MOST_TESTS, MOST_BYTES = 2000, 1_000_000
FEWEST = 6
"""Least number of tests for an interval: that of the median, from the least to the greatest of n,
has 1 - 2 ** (1 - n), which is 95 % from 6 on."""
RESAMPLES = 1000

VERDICTS: Mapping[str, str] = {
    "accepted": "accepted",
    "refused": "not accepted",
    "undecided": "not decided",
    "without": "no threshold",
    "valueless": "no simulated value",
}
"""Verdicts by the names of their counts."""


class RealTest(NamedTuple):
    """A row: what was measured, and what the run has of it, not finite where it has none."""

    run: str
    evaluation: int
    series: str
    quantity: str
    unit: str
    measured: float
    simulated: float
    uncertainty: float
    threshold: float | None


def read_measured(folder: Path, runs: Mapping[str, Facts]) -> list[RealTest]:
    """Return the tests that people wrote into the folder of a dossier; none without the file.

    Args:
        folder: of the dossier.
        runs: that were read, by id.

    Raises:
        FileFormatError: the first thing that is wrong, with line and column.
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
    read = csv.reader((line for _, line in lines), delimiter=separator)
    rows = [[cell.strip() for cell in row] for row in read]
    if rows and (rows[0] != [*COLUMNS] or len(rows) != len(lines)):
        got = separator.join(rows[0])[:200]
        raise FileFormatError(
            f"rows must be a line each, the first {','.join(COLUMNS)}, got {got!r} ({place})"
        )
    with ExitStack() as open_stores:
        stores = {
            name: Recorded(open_stores.enter_context(Store.open(facts.run.folder)))
            for name, facts in (runs if rows[1:] else {}).items()
        }
        tests = [
            _test(dict(zip(COLUMNS, [*row, *[""] * 8], strict=False)), runs, stores,
                  f"{place}, line {line}")
            for (line, _), row in zip(lines[1:], rows[1:], strict=True)
        ]  # fmt: skip
    for group in _grouped(tests):
        if len({test.threshold for test in group}) > 1:
            raise FileFormatError(
                f"threshold must be the same in all tests of {group[0].series} and "
                f"{group[0].quantity} ({place}, column threshold)"
            )
    return tests


def _test(
    cells: Mapping[str, str],
    runs: Mapping[str, Facts],
    stores: Mapping[str, Recorded],
    place: str,
) -> RealTest:
    """Return a row's test; raise the first rule that a cell breaks."""

    def wrong(column: str, rule: str) -> FileFormatError:
        got = cells[column][:60]
        return FileFormatError(f"{column} must be {rule}, got {got!r} ({place}, column {column})")

    def number(column: str, least: float = 0.0, rule: str = "a number ≥ 0") -> float:
        try:
            value = float(cells[column])
        except ValueError:
            value = math.nan
        if not least <= value < math.inf:
            raise wrong(column, rule)
        return value

    names = {name: facts.run.folder.resolve().name for name, facts in runs.items()}
    found = [name for name, folder in names.items() if cells["run"] in ("", folder)]
    if len(found) != 1:
        known = ", ".join(names.values())[:200] or "none"
        raise wrong("run", f"the folder's name of one run that is read ({known})")
    run, rows, quantity = runs[found[0]].run, stores[found[0]], cells["quantity"]
    digits = cells["scenario"].removeprefix("evaluation ")
    row = int(digits) - 1 if digits.isascii() and digits.isdecimal() and len(digits) < 10 else -1
    if digits == cells["scenario"]:  # a spreadsheet writes 1 for 0001
        exported = {item.name: item.evaluation for item in exported_scenarios(run.folder)}
        row = exported.get(digits.zfill(4), -1)
    if not 0 <= row < len(rows):
        raise wrong("scenario", "an exported scenario's name, or 'evaluation N'")
    if quantity not in run.metrics:
        raise wrong("quantity", "a metric that the run records; search with --metric NAME")
    own = {about["name"]: str(about["unit"]) for about in run.settings.own_metrics}
    unit = METRICS[quantity].unit if quantity in METRICS else own.get(quantity, "1")
    if cells["unit"] != unit:
        raise wrong("unit", f"that of {quantity}, {unit!r}")
    simulated = float(rows.metrics[row, run.metrics.index(quantity)])
    return RealTest(
        run=found[0],
        evaluation=row,
        series=cells["series"] or f"evaluation {row + 1}",
        quantity=quantity,
        unit=unit,
        measured=number("measured", -1e300, "a finite number with a decimal point"),
        simulated=math.nan if rows.status[row] else simulated,
        uncertainty=number("uncertainty") if cells["uncertainty"] else 0.0,
        threshold=number("threshold") if cells["threshold"] else None,
    )


def _grouped(tests: Sequence[RealTest]) -> list[list[RealTest]]:
    """Return tests that are compared together, in the order of the file."""
    groups: dict[tuple[str, str, str], list[RealTest]] = {}
    for test in tests:
        groups.setdefault((test.run, test.series, test.quantity), []).append(test)
    return [*groups.values()]


def area(measured: Sequence[float], simulated: Sequence[float]) -> float:
    """Return the area between two empirical distributions of as many values each."""
    pairs = zip(sorted(measured), sorted(simulated), strict=True)
    return sum(abs(a - b) for a, b in pairs) / len(measured)


def _interval(group: Sequence[RealTest]) -> tuple[float, float]:
    """Return the 95 % interval of an area: bootstrap, and the measurements' uncertainty.

    The bootstrap draws tests with their simulations; with fewer than `FEWEST` there is none.
    Errors of at most u each move the area by at most the mean of u.
    """
    pairs = [(test.measured, test.simulated) for test in group]
    low = high = area(*zip(*pairs, strict=True))
    if len(pairs) >= FEWEST:
        draw = random.Random(0)  # no secret: the same in every interpreter
        drawn = (draw.choices(pairs, k=len(pairs)) for _ in range(RESAMPLES))
        low, *_, high = quantiles([area(*zip(*some, strict=True)) for some in drawn], n=40)
    off = mean(test.uncertainty for test in group)
    return max(low - off, 0.0), high + off


def compare(tests: Sequence[RealTest], numbers: Numbers) -> list[Comparison]:
    """Return the comparisons; add their figures."""
    made = []
    for k, group in enumerate(_grouped(tests), start=1):
        first, limit, verdict = group[0], group[0].threshold, VERDICTS["valueless"]
        measured, simulated = zip(*((t.measured, t.simulated) for t in group), strict=True)
        if all(map(math.isfinite, simulated)):
            low, high = _interval(group)
            means = {"measured_mean": mean(measured), "simulated_mean": mean(simulated)}
            figures = {"area": area(measured, simulated), "area_low": low, "area_high": high}
            for name, value in (figures | means).items():
                key = f"{first.run}|{first.series}|{first.quantity}"
                numbers.add(f"{name}:{k}", value, "number", of=key, source=FILE, unit=first.unit)
            verdict = VERDICTS[
                "without" if limit is None else "accepted" if high <= limit
                else "refused" if low > limit else "undecided"
            ]  # fmt: skip
        about = {name: getattr(first, name) for name in ("run", "series", "quantity", "unit")}
        made.append(Comparison(**about, tests=len(group), threshold=limit, verdict=verdict))
    if made:
        counts = {"tests": len(tests), "comparisons": len(made)}
        counts["few"] = sum(one.tests < FEWEST for one in made)
        counts |= {name: sum(one.verdict == v for one in made) for name, v in VERDICTS.items()}
        for name, count in counts.items():
            numbers.add(name, count, source=FILE)
    return made
