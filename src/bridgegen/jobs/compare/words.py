"""A comparison in sentences and short numbers."""

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from math import isinf, isnan

import numpy as np

from bridgegen.base.statistics import effect, mann_whitney
from bridgegen.jobs.compare.measures import Measure, others
from bridgegen.jobs.compare.result import Comparison
from bridgegen.jobs.compare.table import Line
from bridgegen.jobs.frame import Table

SURE = 0.05
"""Corrected p value below which a difference is stated."""

SENTENCE_STARTS = {
    "modes": "The largest number of failure modes is that of",
    "distinct": "The largest number of different critical scenarios is that of",
    "r_critic": "The largest share of critical scenarios, R_critic, is that of",
    "hypervolume": "The largest hypervolume, many bad outcomes at once, is that of",
}
"""Beginnings of the sentence about each measure; larger is better in each."""


def number(value: float, digits: int) -> str:
    """Return a value, "–" where it is not defined, "never" where it is +inf."""
    if isnan(value):
        return "–"
    return "never" if isinf(value) else f"{value:,.{digits}f}"


def median(line: Line, measure: Measure) -> str:
    """Return a line's median; a small count that lies between two has a decimal."""
    value = line.quartiles.median
    between = measure.digits == 0 and abs(value) < 10.0 and value % 1.0 > 0.0
    return number(value, 1 if between else measure.digits)


def span(line: Line, measure: Measure) -> str:
    """Return a line's quartiles."""
    q = line.quartiles
    if isnan(q.low) or isinf(q.low):
        return ""
    return f"{number(q.low, measure.digits)} to {number(q.high, measure.digits)}"


def p_value(p: float) -> str:
    """Return a p value as papers print it."""
    if isnan(p):
        return "–"
    return "< 0.001" if p < 0.001 else f"{p:.3f}"


def verdict(line: Line) -> str:
    """Return whether runs are "better" or "worse" than the baseline's, or "" for neither."""
    if isnan(line.p_holm) or line.p_holm >= SURE or line.a12 == 0.5:
        return ""
    return "better" if line.a12 > 0.5 else "worse"


def runs_that_find(line: Line) -> str:
    """Return in how many runs a time to the k-th scenario ended, "18 of 20"."""
    return f"{line.runs - line.never} of {line.runs}"


_TEXTS = 1
"""Index of the algorithm's column of a table."""


def lines(comparison: Comparison) -> Iterator[str | Table]:
    """Yield what the terminal shows: of each scenario two tables and sentences; then the files."""
    plan = comparison.plan
    for scenario in plan.scenarios:
        yield f"\n{scenario}, {plan.budget} evaluations a run, medians over the runs"
        if scenario in comparison.measured:
            yield _findings(comparison, scenario)
            yield _others(comparison, scenario)
        yield from sentences(comparison, scenario)
    for cell, why in comparison.gaps.items():
        yield f"missing: {cell.name}: {why}"
    yield f"\n{'page':<12}{comparison.page}"
    yield f"{'tables':<12}{comparison.folder / '*.csv'}"
    yield f"{'runs':<12}{comparison.folder / 'runs'}  (bridgegen resume, coverage, …)"


def _findings(comparison: Comparison, scenario: str) -> Table:
    """Return the table of what was found and how soon, with the tests of ``distinct``."""
    kinds = {measure.name: measure for measure in comparison.measures}
    early = [name for name in kinds if name.endswith(("_distinct", "_modes", "to_1"))]
    head = (
        "algorithm",
        "found in",
        "modes",
        "distinct",
        "quartiles",
        "p",
        "A12",
        *(kinds[name].title for name in early),
        "R_critic",
    )
    rows = []
    for name in comparison.plan.algorithms:
        of = {kind: comparison.line(scenario, name, kind) for kind in kinds}
        distinct = of["distinct"]
        cells = [
            name,
            runs_that_find(of["to_1"]),
            median(of["modes"], kinds["modes"]),
            median(distinct, kinds["distinct"]),
            span(distinct, kinds["distinct"]),
            p_value(distinct.p_holm),
            number(distinct.a12, 2),
            *(median(of[item], kinds[item]) for item in (*early, "r_critic")),
        ]
        rows.append(cells)
    return Table(head, rows, _TEXTS)


_MORE = {
    "t_critic",
    "to_10",
    "to_50",
    "critical_bins",
    "critical_pairs",
    "hypervolume",
    "gd",
    "spread",
    "seconds",
}


def _others(comparison: Comparison, scenario: str) -> Table:
    """Return the table of the other measures, and of the time that it took."""
    shown = [measure for measure in comparison.measures if measure.name in _MORE]
    rows = []
    for name in comparison.plan.algorithms:
        of = (comparison.line(scenario, name, measure.name) for measure in shown)
        rows.append(
            [name, *(median(line, measure) for line, measure in zip(of, shown, strict=True))]
        )
    return Table(("algorithm", *(measure.title for measure in shown)), rows, _TEXTS)


def sentences(comparison: Comparison, scenario: str) -> list[str]:
    """Return the findings in one scenario: the best algorithms, the tests, and peculiarities."""
    measures = {measure.name: measure for measure in comparison.measures}
    few = _too_few(comparison, scenario)
    found = any(
        record.critical for c, record in comparison.records.items() if c.scenario == scenario
    )
    names = list(SENTENCE_STARTS) if found else ["hypervolume"]
    texts = [] if found else ["No run found a critical scenario."]
    texts += [_best(comparison, scenario, measures[name], is_open=not few) for name in names]
    return [text for text in (*texts, few, *_short(comparison, scenario)) if text]


def _too_few(comparison: Comparison, scenario: str) -> str:
    """Return a warning where so few runs cannot be significant, even if they differ entirely."""
    plan = comparison.plan
    runs = {
        name: comparison.line(scenario, name, "r_critic").runs
        for name in plan.algorithms
        if comparison.line(scenario, name, "r_critic").runs
    }
    others = [n for name, n in runs.items() if name != plan.baseline]
    if not others or plan.baseline not in runs:
        return ""
    n, m = runs[plan.baseline], max(others)
    least = mann_whitney(np.arange(float(n)), np.arange(float(n), float(n + m))) * len(others)
    if least < SURE:
        return ""
    against = f" by {len(others)} tests" if len(others) > 1 else ""
    return (
        f"So few runs cannot show a difference from {plan.baseline}{against}: were each run of an "
        f"algorithm better than each of {plan.baseline}, p would still be {min(least, 1.0):.2f}. "
        "Use more seeds."
    )


def _best(comparison: Comparison, scenario: str, measure: Measure, *, is_open: bool) -> str:
    """Return which algorithm's median is the largest, and which differ from the baseline."""
    lines = [
        line
        for line in comparison.lines
        if (line.scenario, line.measure) == (scenario, measure.name)
    ]
    known = [line for line in lines if line.runs]
    if not known:
        return ""
    top = max(line.quartiles.median for line in known)
    best = [line for line in known if line.quartiles.median == top]
    names = _and(line.algorithm for line in best)
    text = f"{SENTENCE_STARTS[measure.name]} {names} (median {median(best[0], measure)}"
    base = next((line for line in known if line.algorithm == comparison.plan.baseline), None)
    if base is None or base in best:
        text += ")."
    else:
        text += f"; {base.algorithm}: {median(base, measure)})."
    parts = []
    for which in ("better", "worse"):
        if chosen := [line for line in lines if verdict(line) == which]:
            parts.append(f"{which} than {comparison.plan.baseline}: {_tested(chosen)}")
    open_ones = [
        line.algorithm
        for line in lines
        if not verdict(line) and line.algorithm != comparison.plan.baseline and line.runs
    ]
    if open_ones and is_open:
        parts.append(f"no difference from {comparison.plan.baseline} shown: {_and(open_ones)}")
    rest = "; ".join(parts)
    return text + (f" {rest[0].upper()}{rest[1:]}." if rest else "")


def _tested(lines: Iterable[Line]) -> str:
    """Return algorithms with their tests; those whose tests read the same, together."""
    groups: dict[str, list[str]] = {}
    for line in lines:
        test = f"p {_is(line.p_holm)}, A12 {line.a12:.2f}, {effect(line.a12)}"
        groups.setdefault(test, []).append(line.algorithm)
    return "; ".join(f"{_and(names)} ({test})" for test, names in groups.items())


def _is(p: float) -> str:
    return "< 0.001" if p < 0.001 else f"= {p:.3f}"


def _short(comparison: Comparison, scenario: str) -> Iterable[str]:
    """Yield notes on runs that failed, or that ended before their budget."""
    budget = comparison.plan.budget
    records = {c: record for c, record in comparison.records.items() if c.scenario == scenario}
    ended = Counter(c.algorithm for c, record in records.items() if record.evaluations < budget)
    for name, count in ended.items():
        made = [record.evaluations for c, record in records.items() if c.algorithm == name]
        few = f"{min(made):,}" if min(made) == max(made) else f"{min(made):,} to {max(made):,}"
        yield (
            f"{name} had no more rows to propose after {few} of {budget:,} evaluations in "
            f"{count} of {len(made)} runs: its shares are of these, and what it had not found "
            "by then counts as never found."
        )
    if strange := others(records, comparison.plan.baseline) if records else set():
        names = [name for name in comparison.plan.algorithms if name in strange]
        yield (
            f"{_and(names)} searched other parameters than {comparison.plan.baseline}: different "
            "scenarios and bins are not counted, for they could not be compared."
        )
    failed = Counter(c.algorithm for c, record in records.items() if record.failed)
    if failed:
        total = sum(record.failed for record in records.values())
        yield (
            f"{total:,} simulations failed, in runs of {_and(failed)}; they count as evaluations "
            "that are not critical."
        )
    gaps = [cell for cell in comparison.gaps if cell.scenario == scenario]
    if gaps:
        which = _and(f"{cell.algorithm} with seed {cell.seed}" for cell in gaps)
        yield f"Missing, since the run failed: {which}. The same command tries again."


def _and(words: Iterable[str]) -> str:
    given: Sequence[str] = list(words)
    if len(given) < 2:
        return "".join(given)
    return f"{', '.join(given[:-1])} and {given[-1]}"
