"""A benchmark on one page: the drivers, every scenario, every failure mode, and the method."""

import re
from collections.abc import Iterator, Sequence
from math import inf
from pathlib import Path

from markupsafe import Markup

from bridgegen.drivers.drivers import available
from bridgegen.drivers.planners import DOMAINS
from bridgegen.engine.domain import in_words
from bridgegen.jobs.benchmark.failures import CAREFUL
from bridgegen.jobs.benchmark.plan import COLUMNS, PERFECT, SENSED, Entrant, Plan
from bridgegen.jobs.benchmark.results import Outcome, Standing
from bridgegen.jobs.compare.words import number
from bridgegen.pages import templates
from bridgegen.pages.templates import counted
from bridgegen.pages.thumbnails import drawn, read_thumbnails

MOST_PICTURES, SIZE = 60, (120, 74)
"""Largest number of thumbnails, and the size of each [pixels]."""


def write_page(
    plan: Plan, found: Sequence[Outcome], standings: Sequence[Standing], path: Path
) -> None:
    """Write the page.

    Raises:
        StorageError: it cannot be written.
    """
    known = {(outcome.driver, outcome.scenario, outcome.column): outcome for outcome in found}
    templates.write_page(
        path, "jobs/benchmark/page.html",
        title="Benchmark of planners",
        facts=[*_facts(plan, found)], verdict=templates.Banner(_lead(standings)),
        standings=[(standing, _measured(standing)) for standing in standings],
        entrants=[_entrant(entrant, found) for entrant in plan.entrants],
        scenarios=[
            (name, in_words(plan.needs[name]), [
                _cell([known[entrant.name, name, column] for column in entrant.columns])
                for entrant in plan.entrants
            ])
            for name in plan.scenarios
        ],
        careful=CAREFUL, columns=COLUMNS, sensed=COLUMNS[SENSED], domains=DOMAINS,
        pictures=_pictures(path.parent, found), seeds=plan.seeds, command=plan.command(),
        anchor=_anchor, short=_short, said=_said,
    )  # fmt: skip


def _pictures(folder: Path, found: Sequence[Outcome]) -> dict[str, Markup]:
    """Return pictures of the failure modes that runs keep one of, by where their playback is."""
    pictures: dict[str, Markup] = {}
    for way in (way for outcome in found for way in outcome.ways if way.playback):
        if len(pictures) == MOST_PICTURES:
            break
        for shown in read_thumbnails((folder / way.playback.partition("#")[0]).parent):
            if shown.caption == way.title:
                pictures[way.playback] = drawn(shown, f"t{len(pictures)}", SIZE)
    return pictures


def _lead(standings: Sequence[Standing]) -> str:
    """Return which driver has the fewest failure modes, in each column of perception."""
    best: dict[str, Standing] = {}
    for one in standings:
        if one.driven and one.modes < getattr(best.get(one.column), "modes", inf):
            best[one.column] = one
    said = [f"{_short(one.driver)} ({one.modes}, {COLUMNS[name]})" for name, one in best.items()]
    return f"Fewest failure modes: {'; '.join(said)}." if said else "No driver drove."


def _facts(plan: Plan, found: Sequence[Outcome]) -> Iterator[str]:
    yield counted(len(plan.entrants), "driver")
    yield counted(len(plan.scenarios), "scenario")
    yield counted(plan.seeds, "seed")
    yield f"{plan.budget:,} evaluations a run"
    yield f"algorithm {plan.algorithm}"
    yield f"{sum(outcome.evaluations for outcome in found):,} evaluations"


def _measured(standing: Standing) -> list[str | int]:
    """Return the cells of a line of the table of drivers that need a driven scenario."""
    if not standing.driven:
        return ["–"] * (4 + len(CAREFUL))
    shares = [standing.avoided.get(name, float("nan")) for name in CAREFUL]
    return [
        standing.modes,
        standing.robust,
        number(standing.first, 0),
        f"{standing.severity:.2f}",
        *("–" if share != share else f"{100 * share:.0f} %" for share in shares),
    ]


def _cell(columns: Sequence[Outcome]) -> dict[str, object]:
    """Return the failure modes of a driver in a scenario, in each column of perception."""
    if columns[0].state == "not applicable":
        return {"texts": ["n/a"], "why": columns[0].why, "is_robust": False}
    return {
        "texts": [
            str(len(column.ways)) if column.state == "driven" else "failed" for column in columns
        ],
        "why": "; ".join(dict.fromkeys(column.why for column in columns if column.why)),
        "is_robust": any(column.robust for column in columns),
    }


def _entrant(entrant: Entrant, found: Sequence[Outcome]) -> dict[str, object]:
    """Return what is known of a driver, and its outcomes by scenario."""
    own = [outcome for outcome in found if outcome.driver == entrant.name]
    about, planner = "", entrant.planner
    if planner is not None:
        about = (
            f"{planner.description} {planner.licence}; {planner.source}; {available(planner)}. "
            f"Domain: {in_words(entrant.domain)}."
        )
    number = {
        column: sum(len(outcome.ways) for outcome in own if outcome.column == column)
        for column in entrant.columns
    }
    modes = (
        f"{counted(n, 'failure mode')} {'with ' if column == PERFECT else ''}{COLUMNS[column]}"
        for column, n in number.items()
    )
    return {
        "name": entrant.name,
        "problem": entrant.problem,
        "about": about,
        "stated": "" if entrant.domain == DOMAINS.keys() else in_words(entrant.domain),
        "summary": f"{entrant.name}: {'; '.join(modes)}",
        "outside": sorted(
            {outcome.scenario for outcome in own if outcome.state == "not applicable"}
        ),
        "outcomes": [outcome for outcome in own if outcome.state != "not applicable"],
    }


def _said(outcome: Outcome) -> Iterator[str]:
    """Yield what else is to be said of an outcome: that it has no mode or result, failed rows."""
    if outcome.state == "failed":
        yield f"no result: {outcome.why}"
        return
    if not outcome.ways:
        text = f"no failure in {counted(outcome.evaluations, 'evaluation')}"
        if outcome.preventable:
            text += f"; {outcome.preventable:,} that it could have prevented, others responsible"
        yield outcome.unjudged or text
    if outcome.failed_rows:
        reasons = "; ".join(f"{count:,} × {text}" for text, count in outcome.messages[:3])
        yield f"{counted(outcome.failed_rows, 'row')} without a result: {reasons}"


def _short(name: str) -> str:
    """Return a driver's name without the folder of its file."""
    return Path(name).name


def _anchor(driver: str) -> str:
    return "driver-" + re.sub(r"[^\w.-]+", "-", driver)
