"""The comparison on one self-contained page: sentences, tables, figures, and every run."""

import base64
import re
from collections.abc import Iterable, Mapping, Sequence
from html import escape
from importlib.metadata import version
from importlib.resources import files
from typing import Any

import numpy as np

from bridgegen.assess.criteria import quantity
from bridgegen.assess.metrics import Quantity
from bridgegen.base.disk import write_whole
from bridgegen.base.errors import StorageError
from bridgegen.jobs.compare import figures, words
from bridgegen.jobs.compare.figures import DARK, LIGHT
from bridgegen.jobs.compare.measures import Measure, ordinal, waited_for
from bridgegen.jobs.compare.plan import RUNS, Cell
from bridgegen.jobs.compare.record import points
from bridgegen.jobs.compare.result import Comparison
from bridgegen.jobs.compare.table import Line

FIGURES = "figures"

FIGURE_NAMES = ("distinct", "r_critic", "critical", "hypervolume")
"""The ends of the files' names, in the page's order."""


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
    settled = [one for one in comparison.measures if not one.timed]
    fill = {
        "title": escape(f"Comparison: {', '.join(plan.scenarios)}"),
        "css": _own("page.css"),
        "facts": "".join(f"<li>{escape(one)}</li>" for one in _facts(comparison)),
        "scenarios": "\n".join(_scenario(comparison, name, settled) for name in plan.scenarios),
        "method": _method(comparison, settled),
        "command": escape(plan.command()),
        "version": escape(version("bridgegen")),
    }
    parts = re.split(r"\{\{(\w+)\}\}", _own("page.html"))
    text = "".join(fill[part] if i % 2 else part for i, part in enumerate(parts))
    write_whole(comparison.page, [text.encode("utf-8", "replace")])


def _facts(comparison: Comparison) -> Iterable[str]:
    plan = comparison.plan
    yield _many(len(plan.algorithms), "algorithm")
    yield _many(plan.seeds, "seed")
    yield f"{plan.budget:,} evaluations a run"
    yield f"baseline: {plan.baseline}"
    for name, value in vars(plan.options).items():
        if value not in (None, False, (), {}):
            shown = value
            if isinstance(value, tuple):
                shown = ", ".join(map(_shown, value))
            elif isinstance(value, dict):
                shown = ", ".join(
                    k if one is None else f"{k} = {one:g}" for k, one in value.items()
                )
            yield name.replace("_", " ") if value is True else f"{name.replace('_', ' ')}: {shown}"
    if comparison.gaps:
        yield f"{_many(len(comparison.gaps), 'run')} failed"


def _shown(value: str | Mapping[str, Any]) -> str:
    """Return one of an option's values in words: a pass criterion by its id and formula."""
    return value if isinstance(value, str) else f"{value['id']}: {value['formula']}"


def _scenario(comparison: Comparison, scenario: str, measures: Sequence[Measure]) -> str:
    text = "".join(f"<p>{escape(one)}</p>" for one in words.sentences(comparison, scenario))
    parts = [f"<h2>{escape(scenario)}</h2>", f'<div class="card">{text}</div>']
    if scenario in comparison.measured:
        legend = _legend(comparison.plan.baseline)
        first = [one.name for one in measures].index("r_critic")
        found, often = measures[:first], [one for one in measures[first:] if one.name[0] in "rt"]
        other = [one for one in measures[first:] if one not in often]
        parts.append(_figures(comparison, scenario))
        parts.append(_medians(comparison, scenario, found, "What was found, and how soon", legend))
        parts.append(_medians(comparison, scenario, often, "How often"))
        parts.append(_medians(comparison, scenario, other, "How bad at once"))
    parts.append(_runs(comparison, scenario, measures))
    return f"<section>{''.join(parts)}</section>"


def _medians(
    comparison: Comparison, scenario: str, measures: Sequence[Measure], title: str, note: str = ""
) -> str:
    """Return a table of medians and quartiles; the best of each column is marked."""
    plan = comparison.plan
    columns = [
        [comparison.line(scenario, name, one.name) for name in plan.algorithms] for one in measures
    ]
    best = [_best(column, one) for column, one in zip(columns, measures, strict=True)]
    head = "".join(
        f'<th scope="col" title="{escape(one.text)}">{escape(one.title)} '
        f"{'↑' if one.larger else '↓'}</th>"
        for one in measures
    )
    rows = []
    for row, name in enumerate(plan.algorithms):
        cells = "".join(
            _median(column[row], one, column[row].quartiles.median == top)
            for column, one, top in zip(columns, measures, best, strict=True)
        )
        link = f'<a href="#{_anchor(scenario, name)}">{escape(name)}</a>'
        rows.append(f'<tr><th scope="row">{link}</th>{cells}</tr>')
    return (
        f'<div class="card"><h3>{escape(title)}: medians and quartiles over the runs</h3>{note}'
        f'<div class="wide"><table><thead><tr><th scope="col">algorithm</th>{head}</tr></thead>'
        f"<tbody>{''.join(rows)}</tbody></table></div></div>"
    )


def _legend(baseline: str) -> str:
    return (
        '<p class="muted">↑ larger is better, ↓ smaller; shaded: the best median. '
        f"▲ better, ▼ worse than {escape(baseline)} with p &lt; {words.SURE} after correction; "
        f"A12: how often a run is better than one of {escape(baseline)}. A name leads to its "
        "runs.</p>"
    )


def _best(column: Sequence[Line], one: Measure) -> float:
    known = [line.quartiles.median for line in column if np.isfinite(line.quartiles.median)]
    if not known:
        return float("nan")
    return max(known) if one.larger else min(known)


def _median(line: Line, one: Measure, is_best: bool) -> str:
    mark = {"better": "▲", "worse": "▼", "": ""}[words.verdict(line)]
    title = {"better": "better", "worse": "worse", "": ""}[words.verdict(line)]
    parts = [f"<b>{escape(words.median(line, one))}</b>"]
    if mark:
        parts.append(f' <span class="mark" title="{title}">{mark}</span>')
    parts.append(f"<small>{escape(words.span(line, one))}</small>")
    if not np.isnan(line.p_holm):
        parts.append(f"<small>p {escape(words.p_value(line.p_holm))}, A12 {line.a12:.2f}</small>")
    if 0 < line.never < line.runs:
        parts.append(f"<small>never in {line.never} of {line.runs}</small>")
    return f"<td{' class=best' if is_best else ''}>{''.join(parts)}</td>"


def _figures(comparison: Comparison, scenario: str) -> str:
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
    drawn = []
    for theme in (LIGHT, DARK):
        different = figures.curves(
            distinct, at, plan.baseline, "different critical scenarios", theme
        )
        critical = figures.curves(found, at, plan.baseline, "critical scenarios", theme)
        volume = figures.curves(volumes, at, plan.baseline, "hypervolume", theme, from_zero=False)
        shares_drawn = figures.boxes(shares, plan.baseline, "R_critic", theme)
        drawn.append((different, shares_drawn, critical, volume))
    captions = (
        f"Different critical scenarios found. {band}.",
        "R_critic: the critical share of each run (points), quartiles and median.",
        f"Critical scenarios found. {band}.",
        f"Hypervolume of the front. {band}.",
    )
    for kind, light in zip(FIGURE_NAMES, drawn[0], strict=True):
        write_whole(comparison.folder / FIGURES / f"{scenario}-{kind}.png", [light])
    shown = (_figure(*one) for one in zip(*drawn, captions, strict=True))
    return f'<div class="figures">{"".join(shown)}</div>'


def _figure(light: bytes, dark: bytes, caption: str) -> str:
    return (
        '<figure class="card"><picture>'
        f'<source media="(prefers-color-scheme: dark)" srcset="{_data(dark)}">'
        f'<img alt="{escape(caption)}" src="{_data(light)}"></picture>'
        f"<figcaption>{escape(caption)}</figcaption></figure>"
    )


def _runs(comparison: Comparison, scenario: str, measures: Sequence[Measure]) -> str:
    """Return every run of a scenario: its figures, its folder, and the command that repeats it."""
    shown = [one for one in measures if one.name != "t_critic"]
    head = "".join(f'<th scope="col">{escape(one.title)}</th>' for one in shown)
    parts = []
    for name in comparison.plan.algorithms:
        rows = "".join(
            _run(comparison, cell, shown)
            for cell in comparison.plan.cells_in_order
            if (cell.scenario, cell.algorithm) == (scenario, name)
        )
        parts.append(
            f'<details id="{_anchor(scenario, name)}"><summary>{escape(name)}</summary>'
            '<div class="wide"><table class="runs"><thead><tr><th scope="col">run</th>'
            f'<th scope="col">evaluations</th>{head}<th scope="col">the same run again</th>'
            f"</tr></thead><tbody>{rows}</tbody></table></div></details>"
        )
    return (
        '<div class="card"><h3>Every run</h3><p class="muted"><code>bridgegen resume FOLDER</code> '
        "writes a run’s critical scenarios and its report; <code>bridgegen coverage FOLDER</code> "
        f"shows what it searched.</p>{''.join(parts)}</div>"
    )


def _run(comparison: Comparison, cell: Cell, measures: Sequence[Measure]) -> str:
    folder = f"{RUNS}/{cell.name}"
    link = f'<th scope="row"><a href="{escape(folder)}/">{cell.seed}</a></th>'
    if cell in comparison.gaps:
        span = len(measures) + 1
        text = f"failed: {comparison.gaps[cell]}"
        return f'<tr>{link}<td colspan="{span}"></td><td>{escape(text)}</td></tr>'
    record = comparison.records[cell]
    row: Mapping[str, float] = comparison.measured[cell.scenario].values[cell]
    values = "".join(f"<td>{words.number(row[one.name], one.digits)}</td>" for one in measures)
    command = (
        "<td><details><summary>command</summary>"
        f"<code>{escape(record.command)}</code></details></td>"
    )
    return f"<tr>{link}<td>{record.evaluations:,}</td>{values}{command}</tr>"


def _range(term: Quantity, worst: float, best: float) -> str:
    """Return a term's values in its unit, given as larger = more critical."""
    low, high = (term.sign * one + 0.0 for one in (worst, best))  # no negative zero
    return f"{term.name} {low:.4g} to {high:.4g} {term.unit}".removesuffix(" 1")


def _method(comparison: Comparison, measures: Sequence[Measure]) -> str:
    plan = comparison.plan
    terms = "".join(f"<dt>{escape(one.title)}</dt><dd>{escape(one.text)}</dd>" for one in measures)
    k = waited_for(plan.budget)
    boxes = "; ".join(
        f"{name}: " + ", ".join(
            _range(quantity(term), worst, best)
            for term, worst, best in zip(
                next(r for c, r in comparison.records.items() if c.scenario == name).terms,
                one.scale.worst, one.scale.best, strict=True,
            )
        )
        for name, one in comparison.measured.items()
    )  # fmt: skip
    texts = [
        f"T_critic is the number of evaluations until {k} critical scenarios, 5 % of the budget, "
        "divided by the least median of all algorithms here. If that is never reached (for example "
        f"the {ordinal(10)} critical scenario of a run that found nine), the value is censored: "
        "ranked last, tied with the other censored ones.",
        f"Two critical scenarios are different if their searched parameters differ by "
        f"{100 * plan.apart:g} % of their ranges or more, in root mean square; they are counted in "
        "the order in which the run found them, each compared with those counted before it, up to "
        "10,000.",
        "Modes are the different conflicts of a run’s critical scenarios: type, responsible party, "
        "rule, and the other participant. A critical scenario without a near miss or a contact, "
        "which the paper’s thresholds allow, has none.",
        "Bins are five a parameter, and pairs of bins those of two parameters, as "
        "“bridgegen coverage” counts them.",
        "Hypervolume, distance and spread are those of the objective’s metrics, whatever the "
        "algorithm minimised, scaled by the range over all runs of the scenario, "
        f"least to most critical ({boxes}). The reference point is the least critical corner, "
        "and the reference front that of all runs together.",
        f"p is that of the two-sided Mann–Whitney U test against {plan.baseline}, with Holm’s "
        f"correction for the {_many(len(plan.algorithms) - 1, 'algorithm')} tested in each measure "
        "and scenario. A12 is Vargha and Delaney’s: how probable it is that a run is better than "
        f"one of {plan.baseline}, ties counting half; small from 0.56, "
        "medium from 0.64, large from 0.71.",
    ]
    return f"<dl>{terms}</dl>" + "".join(f"<p>{escape(text)}</p>" for text in texts)


def _anchor(scenario: str, algorithm: str) -> str:
    return escape(f"runs-{scenario}-{algorithm}".replace(" ", "_"))


def _many(n: int, noun: str) -> str:
    return f"{n:,} {noun}{'' if n == 1 else 's'}"


def _data(png: bytes) -> str:
    return f"data:image/png;base64,{base64.b64encode(png).decode()}"


def _own(name: str) -> str:
    return files("bridgegen.jobs.compare").joinpath(name).read_text("utf-8")
