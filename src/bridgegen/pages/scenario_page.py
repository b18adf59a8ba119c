"""A logical scenario as a page: its picture, what happens, its parameters and their reasons."""

import html
from collections.abc import Iterator
from pathlib import Path

from bridgegen.engine.pipeline import Pipeline
from bridgegen.pages.build import critical_in_words
from bridgegen.pages.page import write_still_page
from bridgegen.pages.scenario_words import story_lines
from bridgegen.pages.sketch import sketch
from bridgegen.scenario.language.criteria import Criterion
from bridgegen.scenario.language.parameters import Bound, Derived, Parameter
from bridgegen.scenario.language.scenario import LogicalScenario


def write_scenario_page(path: Path, scenario: LogicalScenario) -> None:
    """Write the page of a scenario, whole or not at all.

    Raises:
        StorageError: the file cannot be written.
    """
    title = f"{scenario.name}: {scenario.title}"
    body = "\n".join(_body(scenario)).encode("utf-8", "replace")
    write_still_page(path, "scenario.html", title, body)


def _body(scenario: LogicalScenario) -> Iterator[str]:
    pipeline, aim = Pipeline(scenario, scenario.space()), scenario.objective
    yield f"<h1>{_text(scenario.title)}</h1>"
    facts = [
        scenario.name, f"template {scenario.roads.template}", f"ego {pipeline.driver.name}",
        f"{scenario.duration:g} s", f"searched: {', '.join(scenario.axes)}",
        f"critical: {critical_in_words(aim.rule, aim.count, aim.critical, aim.criteria)}",
    ]  # fmt: skip
    yield f'<ul class="facts">{"".join(f"<li>{_text(fact)}</li>" for fact in facts)}</ul>'
    yield f'<p class="lead">{_text(scenario.description)}</p>'
    yield f'<p class="muted">Source: {_text(scenario.source)}</p>'
    yield (
        f'<figure class="card sketch">{sketch(pipeline)}<figcaption class="muted">At the '
        "defaults, when they are closest; dashed: where each starts.</figcaption></figure>"
    )
    lines = "".join(f"<li>{_text(line)}</li>" for line in story_lines(scenario))
    yield '<section class="card"><h2>Participants and events</h2>'
    yield f'<ul class="story">{lines}</ul></section>'
    yield '<section class="card"><h2>Parameters</h2><div class="wide"><table><thead><tr>'
    yield "<th>parameter</th><th>axis</th><th>range</th><th>default</th><th>description</th></tr>"
    yield "</thead><tbody>"
    for parameter in scenario.parameters.values():
        yield _parameter(parameter)
    yield "</tbody></table></div></section>"
    if scenario.criteria:
        yield '<section class="card"><h2>Pass criteria</h2><dl class="rules">'
        yield from map(_criterion, scenario.criteria)
        yield "</dl></section>"
    yield '<section class="card"><h2>Constraints</h2><dl class="rules">'
    rules: tuple[Bound | Derived, ...] = (*scenario.bounds, *scenario.derived)
    for rule in rules:
        yield (
            f"<dt>{_text(str(rule))}</dt><dd>{_text(rule.why)} "
            f"<small>{_text(rule.source)}</small></dd>"
        )
    yield "</dl></section>"


def _parameter(one: Parameter) -> str:
    unit = "" if one.unit in ("1", "count") else f" {one.unit}"
    return (
        f"<tr><th>{_text(one.name)}</th><td>{one.axis}</td>"
        f'<td class="number">{one.kind.span_text(one.low, one.high, "{:g}".format, unit)}</td>'
        f'<td class="number">{one.kind.text(one.default, "{:g}".format)}{unit}</td>'
        f"<td>{_text(one.description)}<small>{_text(one.source)}</small></td></tr>"
    )


def _criterion(one: Criterion) -> str:
    kind = ", ".join((one.severity, *one.tags))
    return (
        f"<dt>{_text(f'{one.id}: {one.states}')}</dt>"
        f"<dd>{_text(one.text)} <small>{_text(kind)}</small></dd>"
    )


def _text(text: str) -> str:
    return html.escape(text.strip())
