"""A benchmark on one page: the drivers, every scenario, every failure mode, and the method."""

import re
from collections.abc import Iterable, Sequence
from html import escape
from importlib.metadata import version
from importlib.resources import files
from pathlib import Path

from bridgegen.base.disk import write_whole
from bridgegen.drivers.drivers import available
from bridgegen.drivers.planners import DOMAINS
from bridgegen.engine.domain import in_words
from bridgegen.jobs.benchmark.failures import CAREFUL
from bridgegen.jobs.benchmark.plan import COLUMNS, PERFECT, SENSED, Entrant, Plan
from bridgegen.jobs.benchmark.results import Outcome, Standing, Way
from bridgegen.jobs.compare.words import number


def write_page(
    plan: Plan, found: Sequence[Outcome], standings: Sequence[Standing], path: Path
) -> None:
    """Write the page.

    Raises:
        StorageError: it cannot be written.
    """
    styles = files("bridgegen.jobs.compare").joinpath("page.css").read_text("utf-8")
    fill = {
        "css": styles + _own("page.css"),
        "facts": "".join(f"<li>{escape(one)}</li>" for one in _facts(plan, found)),
        "standings": _standings(plan, standings),
        "matrix": _matrix(plan, found),
        "drivers": "".join(_driver(one, found) for one in plan.entrants),
        "method": _method(plan),
        "command": escape(plan.command()),
        "version": escape(version("bridgegen")),
    }
    parts = re.split(r"\{\{(\w+)\}\}", _own("page.html"))
    text = "".join(fill[part] if i % 2 else part for i, part in enumerate(parts))
    write_whole(path, [text.encode("utf-8", "replace")])


def _facts(plan: Plan, found: Sequence[Outcome]) -> Iterable[str]:
    yield _many(len(plan.entrants), "driver")
    yield _many(len(plan.scenarios), "scenario")
    yield _many(plan.seeds, "seed")
    yield f"{plan.budget:,} evaluations a run"
    yield f"algorithm {plan.algorithm}"
    yield f"{sum(one.evaluations for one in found):,} evaluations"


def _standings(plan: Plan, standings: Sequence[Standing]) -> str:
    """Return the table of drivers, a line for each column of perception."""
    heads = (
        ("driver", ""), ("perception", ""), ("failure modes", "distinct, the ego responsible"),
        ("robust", "most small changes of the scenario fail, too"),
        ("first failure", "evaluations until it, median of the runs"),
        ("severity", "worst probability of a serious injury, MAIS3+"),
        *((f"{name} avoids", "share of its failures") for name in CAREFUL),
        ("causes", "of its modes"), ("scenarios", "driven"), ("n/a", "outside its domain"),
        ("no result", "scenarios"), ("failed rows", "evaluations without a result"),
    )  # fmt: skip
    head = "".join(
        f'<th scope="col"{" class=words" if one in ("perception", "causes") else ""} '
        f'title="{escape(why)}">{escape(one)}</th>'
        for one, why in heads
    )
    body = []
    for one in standings:
        link = f'<a href="#{_anchor(one.driver)}">{escape(_short(one.driver))}</a>'
        shares = [_percent(one.avoided.get(name, float("nan"))) for name in CAREFUL]
        causes = ", ".join(f"{name} {count}" for name, count in one.causes) or "–"
        if one.driven:
            measured = [
                f"<b>{one.modes}</b>", str(one.robust), number(one.first, 0),
                f"{one.severity:.2f}", *shares,
            ]  # fmt: skip
        else:
            measured, causes = ["–"] * (4 + len(CAREFUL)), "–"
        cells = "".join(f"<td>{text}</td>" for text in measured)
        counts = (one.driven, one.not_applicable, one.failed)
        body.append(
            f'<tr><th scope="row">{link}</th><td class="state">{COLUMNS[one.column]}</td>{cells}'
            f'<td class="words">{escape(causes)}</td>'
            f"{''.join(f'<td>{n}</td>' for n in counts)}"
            f"<td>{one.failed_rows:,}<small>of {one.evaluations:,}</small></td></tr>"
        )
    note = (
        '<p class="muted">Fewer failure modes are better; only lines with the same perception and '
        "the same scenarios compare. “never”: most runs found no failure. A driver without sensors "
        "is told the truth, and has no second line.</p>"
    )
    return (
        f'{note}<div class="wide"><table><thead><tr>{head}</tr></thead>'
        f"<tbody>{''.join(body)}</tbody></table></div>"
    )


def _matrix(plan: Plan, found: Sequence[Outcome]) -> str:
    """Return failure modes of every driver in every scenario."""
    known = {(one.driver, one.scenario, one.column): one for one in found}
    head = "".join(
        f'<th scope="col"><a href="#{_anchor(one.name)}">{escape(_short(one.name))}</a>'
        f"<br><small>{escape(_stated(one))}</small></th>"
        for one in plan.entrants
    )
    body = []
    for scenario in plan.scenarios:
        cells = "".join(
            _cell([known[one.name, scenario, column] for column in one.columns])
            for one in plan.entrants
        )
        needs = in_words(plan.needs[scenario])
        body.append(
            f'<tr><th scope="row">{escape(scenario)}</th><td class="state">{needs}</td>{cells}</tr>'
        )
    return (
        '<p class="muted">Failure modes for which the driver is responsible: with perfect '
        "perception | with perception; shaded: a robust one among them. “n/a”: outside the domain "
        "that the driver states, so neither a pass nor a failure.</p>"
        '<div class="wide"><table class="matrix"><thead><tr><th scope="col">scenario</th>'
        f'<th scope="col">it needs</th>{head}</tr></thead><tbody>{"".join(body)}</tbody></table>'
        "</div>"
    )


def _cell(columns: Sequence[Outcome]) -> str:
    shown = columns[0]
    if shown.state == "not applicable":
        return f'<td class="state" title="{escape(shown.why)}">n/a</td>'
    texts = [str(len(one.ways)) if one.state == "driven" else "failed" for one in columns]
    why = "; ".join(dict.fromkeys(one.why for one in columns if one.why))
    is_robust = any(one.robust for one in columns)
    return (
        f'<td{" class=robust" if is_robust else ""} title="{escape(why)}">'
        f"{' <span class=column>|</span> '.join(texts)}</td>"
    )


def _driver(entrant: Entrant, found: Sequence[Outcome]) -> str:
    """Return what is known of a driver, and its failure modes by scenario."""
    own = [one for one in found if one.driver == entrant.name]
    rows = "".join(_outcome(one) for one in own if one.state != "not applicable")
    outside = sorted({one.scenario for one in own if one.state == "not applicable"})
    about = ""
    if entrant.planner is not None:
        planner = entrant.planner
        about = (
            f"<p>{escape(planner.description)} {escape(planner.licence)}; "
            f"{escape(planner.source)}; {escape(available(planner))}. "
            f"Domain: {escape(in_words(entrant.domain))}.</p>"
        )
    if entrant.problem:
        about += f"<p><b>It did not drive:</b> {escape(entrant.problem)}</p>"
    if outside:
        about += f'<p class="muted">Not applicable: {escape(", ".join(outside))}.</p>'
    head = "".join(
        f'<th scope="col"{" class=words" if name != "severity" else ""}>{name}</th>'
        for name in (
            "scenario", "perception", "failure mode", "severity", "cause", "minimal", "look"
        )
    )  # fmt: skip
    table = (
        f'<div class="wide"><table><thead><tr>{head}</tr></thead>'
        f"<tbody>{rows}</tbody></table></div>"
        if rows and not entrant.problem
        else ""
    )
    modes = "; ".join(
        f"{_many(sum(len(one.ways) for one in own if one.column == column), 'failure mode')} "
        f"{'with ' if column == PERFECT else ''}{COLUMNS[column]}"
        for column in entrant.columns
    )
    return (
        f'<details class="card" id="{_anchor(entrant.name)}"><summary>{escape(entrant.name)}: '
        f"{modes}</summary>{about}{table}</details>"
    )


def _outcome(one: Outcome) -> str:
    head = (
        f'<th scope="row">{escape(one.scenario)}</th>'
        f'<td class="state">{COLUMNS[one.column].removesuffix(" perception")}</td>'
    )
    if one.state == "failed":
        return f'<tr>{head}<td class="words" colspan="5">no result: {escape(one.why)}</td></tr>'
    rows = [f"<tr>{head}{_way(way)}</tr>" for way in one.ways]
    if not one.ways:
        rows = [
            f'<tr>{head}<td class="words off" colspan="5">{escape(_without_modes(one))}</td></tr>'
        ]
    if one.failed_rows:
        reasons = "; ".join(f"{count:,} × {text}" for text, count in one.messages[:3])
        text = f"{_many(one.failed_rows, 'row')} without a result: {reasons}"
        rows.append(f'<tr>{head}<td class="words" colspan="5">{escape(text)}</td></tr>')
    return "".join(rows)


def _without_modes(one: Outcome) -> str:
    if one.unjudged:
        return one.unjudged
    text = f"no failure in {_many(one.evaluations, 'evaluation')}"
    if one.preventable:
        text += f"; {one.preventable:,} that it could have prevented, others responsible"
    return text


def _way(way: Way) -> str:
    badge = {True: "robust", False: "knife-edge", None: "not tested"}[way.robust]
    small = escape(way.minimal or "–")
    if way.minimal_scenario:
        small = f'<a href="{escape(way.minimal_scenario)}">{small}</a>'
    links = [
        f'<a href="{escape(target)}">{text}</a>'
        for target, text in (
            (way.playback, "play"), (way.scenario, "scenario"), (way.script, "script"),
        )
        if target
    ]  # fmt: skip
    return (
        f'<td class="words">{escape(way.title)} <span class="badge">{badge}</span></td>'
        f'<td>{way.severity:.2f}</td><td class="state">{escape(", ".join(way.causes) or "–")}</td>'
        f'<td class="words">{small}</td><td class="state links">{"".join(links) or "–"}</td>'
    )


def _stated(entrant: Entrant) -> str:
    """Return a driver's domain in words; nothing where that is everywhere."""
    return "" if entrant.domain == DOMAINS.keys() else in_words(entrant.domain)


def _method(plan: Plan) -> str:
    terms = "".join(f"<dt>{escape(w)}</dt><dd>{escape(text)}</dd>" for w, text in DOMAINS.items())
    texts = (
        "Each driver has its own settings. With perfect perception it is told the true state of "
        f"all others; {COLUMNS[SENSED]}, what BridgeGen’s camera and LiDAR track, misses included.",
        "A driver is judged within the domain that it states. What a scenario needs is read from "
        "its map and actors: a junction on the ego’s route in which ways cross or turn; opposite "
        "lanes or traffic against the ego’s direction; pedestrians and cyclists.",
        "A failure is a collision or near miss with plausible traffic for which the ego, or the "
        "ego and another, are responsible. A mode is its conflict, type, rule, other participant "
        "and place on the route; modes of several seeds are counted once. It is robust if at least "
        "half of 32 small changes of its scenario fail, too.",
        f"Of the {plan.seeds} seeds of a driver, scenario and perception, the first is triaged, "
        "and each other one that fails in a way that is new.",
        "“Avoids”: the careful driver drives the same scenarios with the same traffic, and has "
        "neither a collision nor a near miss that counts as harm. un-r157 is that of UN Regulation "
        "157, and reacts to nothing that crosses; careful is the same extended to any road.",
        "Rows without a result (the driver raised, timed out, or answered nonsense) are counted "
        "apart: they are neither failures in traffic nor successes.",
    )
    return "".join(f"<p>{escape(one)}</p>" for one in texts) + f"<dl>{terms}</dl>"


def _short(name: str) -> str:
    """Return a driver's name without the folder of its file."""
    return Path(name).name


def _anchor(driver: str) -> str:
    return escape("driver-" + re.sub(r"[^\w.-]+", "-", driver))


def _percent(share: float) -> str:
    return "–" if share != share else f"{100 * share:.0f} %"


def _many(n: int, noun: str) -> str:
    return f"{n:,} {noun}{'' if n == 1 else 's'}"


def _own(name: str) -> str:
    return files("bridgegen.jobs.benchmark").joinpath(name).read_text("utf-8")
