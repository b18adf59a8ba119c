"""The comparison on one self-contained page: sentences, tables, figures, and every run."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from markupsafe import Markup

from bridgegen.assess.criteria import quantity
from bridgegen.assess.metrics import Quantity
from bridgegen.base.disk import write_whole
from bridgegen.base.errors import StorageError
from bridgegen.jobs.compare import figures, words
from bridgegen.jobs.compare.measures import Measure, ordinal, waited_for
from bridgegen.jobs.compare.plan import RUNS, Cell
from bridgegen.jobs.compare.record import points
from bridgegen.jobs.compare.result import Comparison
from bridgegen.jobs.compare.table import Line
from bridgegen.pages import templates
from bridgegen.pages.templates import counted

FIGURES = "figures"

FIGURE_NAMES = ("distinct", "r_critic", "critical", "hypervolume")
"""Endings of the names of the figures' files, in the page's order."""


def write_page(comparison: Comparison) -> None:
    """Write the page, and its figures as files beside it.

    Raises:
        StorageError: they cannot be written.
    """
    plan = comparison.plan
    try:
        (comparison.folder / FIGURES).mkdir(exist_ok=True)
    except OSError as error:
        raise StorageError(f"{comparison.folder}: cannot be written: {error.strerror}") from None
    # Durations differ each time: they have a file of their own, and the page is the same to the
    # byte.
    settled = [measure for measure in comparison.measures if not measure.timed]
    templates.write_page(
        comparison.page,
        "jobs/compare/page.html",
        title=f"Comparison: {', '.join(plan.scenarios)}",
        facts=[*_facts(comparison)],
        verdict=templates.Banner(_lead(comparison)),
        scenarios=[_scenario(comparison, name, settled) for name in plan.scenarios],
        measures=settled,
        shown=[measure for measure in settled if measure.name != "t_critic"],
        baseline=plan.baseline,
        sure=words.SURE,
        apart=100 * plan.apart,
        tested=counted(len(plan.algorithms) - 1, "algorithm"),
        waited=waited_for(plan.budget),
        tenth=ordinal(10),
        boxes=_boxes(comparison),
        command=plan.command(),
        figure_style=figures.style(),
    )


def _lead(comparison: Comparison) -> str:
    """Return the first sentence on the first scenario; of several, with its name."""
    names = [*comparison.plan.scenarios]
    text = next(iter(words.sentences(comparison, names[0])), "")
    return text if len(names) == 1 else f"{names[0]}: {text}"


def _facts(comparison: Comparison) -> Iterator[str]:
    plan = comparison.plan
    yield counted(len(plan.algorithms), "algorithm")
    yield counted(plan.seeds, "seed")
    yield f"{plan.budget:,} evaluations a run"
    yield f"baseline: {plan.baseline}"
    for name, value in vars(plan.options).items():
        if value not in (None, False, (), {}):
            shown = Path(value["path"]).name if name == "odd" else value
            if isinstance(value, tuple):
                shown = ", ".join(map(_shown, value))
            elif isinstance(shown, dict):
                shown = ", ".join(
                    k if item is None else f"{k} = {item:g}" for k, item in value.items()
                )
            yield name.replace("_", " ") if value is True else f"{name.replace('_', ' ')}: {shown}"
    if comparison.gaps:
        yield f"{counted(len(comparison.gaps), 'run')} failed"


def _shown(value: str | Mapping[str, Any]) -> str:
    """Return one of an option's values in words: a pass criterion by its id and formula."""
    return value if isinstance(value, str) else f"{value['id']}: {value['formula']}"


def _scenario(
    comparison: Comparison, scenario: str, measures: Sequence[Measure]
) -> dict[str, object]:
    first = [measure.name for measure in measures].index("r_critic")
    often = [measure for measure in measures[first:] if measure.name[0] in "rt"]
    groups = (
        ("What was found, and how soon", measures[:first]),
        ("How often", often),
        ("How bad at once", [measure for measure in measures[first:] if measure not in often]),
    )
    is_measured = scenario in comparison.measured
    return {
        "name": scenario,
        "sentences": [*words.sentences(comparison, scenario)],
        "figures": [*_figures(comparison, scenario)] if is_measured else [],
        "medians": [(title, some, _medians(comparison, scenario, some)) for title, some in groups]
        if is_measured
        else [],
        "runs": [
            (
                name,
                [
                    _run(comparison, cell, measures)
                    for cell in comparison.plan.cells_in_order
                    if (cell.scenario, cell.algorithm) == (scenario, name)
                ],
            )
            for name in comparison.plan.algorithms
        ],
    }


def _medians(
    comparison: Comparison, scenario: str, measures: Sequence[Measure]
) -> list[tuple[str, list[dict[str, object]]]]:
    """Return each algorithm's medians and quartiles; the best of each measure is marked."""
    names = comparison.plan.algorithms
    columns = [
        [comparison.line(scenario, name, measure.name) for name in names] for measure in measures
    ]
    cells = [
        [_median(line, measure, _best(column, measure)) for line in column]
        for column, measure in zip(columns, measures, strict=True)
    ]
    return [(name, [column[row] for column in cells]) for row, name in enumerate(names)]


def _best(column: Sequence[Line], measure: Measure) -> float:
    known = [line.quartiles.median for line in column if np.isfinite(line.quartiles.median)]
    if not known:
        return float("nan")
    return max(known) if measure.larger else min(known)


def _median(line: Line, measure: Measure, best: float) -> dict[str, object]:
    notes = [words.span(line, measure)]
    if not np.isnan(line.p_holm):
        notes.append(f"p {words.p_value(line.p_holm)}, A12 {line.a12:.2f}")
    if 0 < line.never < line.runs:
        notes.append(f"never in {line.never} of {line.runs}")
    return {
        "median": words.median(line, measure),
        "verdict": words.verdict(line),
        "notes": notes,
        "is_best": line.quartiles.median == best,
    }


def _figures(comparison: Comparison, scenario: str) -> Iterator[tuple[Markup, str]]:
    """Yield each figure and its caption; write it as a file, too."""
    plan, measured = comparison.plan, comparison.measured[scenario]

    def of(name: str) -> list[Cell]:
        return [cell for cell in measured.values if cell.algorithm == name]

    shares = {
        name: np.array([measured.values[cell]["r_critic"] for cell in of(name)])
        for name in plan.algorithms
    }
    found = {
        name: np.array([comparison.records[cell].found for cell in of(name)], np.float64)
        for name in plan.algorithms
    }
    distinct = {
        name: np.array([comparison.records[cell].distinct_found for cell in of(name)], np.float64)
        for name in plan.algorithms
    }
    volumes = {
        name: np.array([measured.curves[cell] for cell in of(name)]) for name in plan.algorithms
    }
    at = points(plan.budget).tolist()
    band = "Median over the runs, and the band between the quartiles"
    base = plan.baseline
    drawn = (
        figures.curves(distinct, at, base, "different critical scenarios"),
        figures.boxes(shares, base, "R_critic"),
        figures.curves(found, at, base, "critical scenarios"),
        figures.curves(volumes, at, base, "hypervolume", from_zero=False),
    )
    captions = (
        f"Different critical scenarios found. {band}.",
        "R_critic: the critical share of each run (points), quartiles and median.",
        f"Critical scenarios found. {band}.",
        f"Hypervolume of the front. {band}.",
    )
    for kind, figure, caption in zip(FIGURE_NAMES, drawn, captions, strict=True):
        path = comparison.folder / FIGURES / f"{scenario}-{kind}.svg"
        write_whole(path, [figures.as_file(figure)])
        yield figure, caption


def _run(comparison: Comparison, cell: Cell, measures: Sequence[Measure]) -> dict[str, object]:
    """Return a run: its figures, its folder, and the command that repeats it; or why it failed."""
    about = {"seed": cell.seed, "folder": f"{RUNS}/{cell.name}", "gap": comparison.gaps.get(cell)}
    if cell in comparison.gaps:
        return about
    record = comparison.records[cell]
    row: Mapping[str, float] = comparison.measured[cell.scenario].values[cell]
    values = [
        words.number(row[measure.name], measure.digits)
        for measure in measures
        if measure.name != "t_critic"
    ]
    return {**about, "evaluations": record.evaluations, "values": values, "command": record.command}


def _range(term: Quantity, worst: float, best: float) -> str:
    """Return a term's values in its unit, given as larger = more critical."""
    low, high = (term.sign * value + 0.0 for value in (worst, best))  # no negative zero
    return f"{term.name} {low:.4g} to {high:.4g} {term.unit}".removesuffix(" 1")


def _boxes(comparison: Comparison) -> str:
    """Return the range of each objective over all runs, by scenario, in words."""
    return "; ".join(
        f"{name}: "
        + ", ".join(
            _range(quantity(term), worst, best)
            for term, worst, best in zip(
                next(r for c, r in comparison.records.items() if c.scenario == name).terms,
                measured.scale.worst,
                measured.scale.best,
                strict=True,
            )
        )
        for name, measured in comparison.measured.items()
    )
