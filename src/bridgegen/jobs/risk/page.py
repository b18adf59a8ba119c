"""A risk as a page without scripts."""

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from bridgegen.base.arrays import Float
from bridgegen.base.units import percent
from bridgegen.jobs.risk.estimators.weighted import Probability
from bridgegen.jobs.risk.options import WORDS
from bridgegen.jobs.risk.outcomes import EVENTS
from bridgegen.jobs.risk.result import PAGE, Finding, ParameterShare, Risk
from bridgegen.jobs.risk.text import (
    crashes,
    data_sentence,
    elsewhere_sentence,
    extreme_sentence,
    interval,
    sentence,
)
from bridgegen.pages import charts, templates
from bridgegen.pages.templates import Banner, Cell, counted, number, odds

if TYPE_CHECKING:
    from bridgegen.jobs.risk.total import TotalRisk

MOST_DRAWN = 6
"""Largest number of failure modes in the picture of all intervals; the table has all."""


def write_page(path: Path, risk: Risk) -> None:
    """Write the page of a risk.

    Raises:
        StorageError: it cannot be written.
    """
    templates.write_page(
        path,
        "jobs/risk/page.html",
        title=f"Risk of {risk.exposure.scenario.name}",
        facts=[*facts(risk)],
        verdict=_banner(risk),
        doubts=risk.weighted.doubts,
        picture=_intervals(risk),
        has_rates=risk.exposure.encounters is not None,
        stated=[
            [words, *_cells(finding), *_rates(risk, name)] for words, name, finding in risk.stated
        ],
        modes=[[words, *_cells(finding)] for words, finding in risk.by_mode.items()],
        parameters=[(parameter, _shares(parameter)) for parameter in risk.parameters],
        likely=[
            (likely, _often(finding.probability if finding else None), [*_values(risk, likely.x)])
            for likely in risk.most_likely
            for finding in (risk.by_mode.get(likely.mode),)
        ],
        unsure=[*unsure(risk)],
        command=risk.command,
    )


def write_total(path: Path, total: "TotalRisk") -> None:
    """Write the page of a sum over scenarios.

    Raises:
        StorageError: it cannot be written.
    """
    head, rows = total.rows()
    drawn = [
        charts.Interval(name, "event", p.low, p.estimate, p.high)
        for name, *_ in rows
        if (p := total.risks[name].probability(total.event)) and p.estimate > 0.0
    ]
    linked = [[Cell(row[0], href=f"scenarios/{row[0]}/{PAGE}"), *row[1:]] for row in rows]
    templates.write_page(
        path,
        "jobs/risk/total.html",
        title="Risk of several scenarios",
        facts=[f"driver {total.driver}", total.work, counted(len(total.risks), "scenario")],
        verdict=Banner(total.sentence),
        advice=total.advice,
        picture=charts.intervals(drawn, "Probabilities per encounter, 95 %") if drawn else "",
        head=head,
        rows=linked,
        near_misses=[*total.near_misses()],
        command=total.command,
    )


def _banner(risk: Risk) -> Banner:
    return Banner(sentence(risk), word=_often(risk.probability(risk.event)))


def _often(probability: Probability | None) -> str:
    """Return how often something happens, in words; "" where that is not known, or never."""
    if probability is None or not probability.estimate > 0.0:
        return ""
    words = odds(probability.estimate)
    return f"{words} of encounters" if words.endswith("%") else f"{words} encounters"


def facts(risk: Risk) -> Iterator[str]:
    """Yield what a reader wants to know first, a few words each."""
    yield f"driver {risk.driver}"
    yield f"{risk.weighted.evaluations:,} simulations"
    yield f"method {risk.estimated.method}"
    yield f"{percent(risk.exposure.feasible_share.estimate)} of the exposure keep the constraints"
    yield f"seed {risk.seed}"
    if risk.exposure.scenario.odd is not None:
        yield f"{risk.exposure.scenario.odd.label}: per encounter inside it"


def unsure(risk: Risk) -> Iterator[str]:
    """Yield what the number rests on, a sentence each."""
    found = risk.probability(risk.event)
    if found is not None:
        yield (
            "Few simulations: the interval says how far the estimate may be off, if the exposure "
            "and the simulation are right."
        )
    if "explored_hits" in risk.weighted.facts:
        yield (
            "Harm was found by rows that are spread over the ranges, since no gradient of harm "
            "leads to it; a region so small that none of them lay in it is allowed for in the "
            "upper end alone."
        )
    elif "spread" in risk.weighted.facts:
        yield (
            "Harm to which no gradient leads is found only where one of "
            f"{risk.weighted.facts['spread']:,.0f} rows lies in it that are spread over the "
            "ranges; mc assumes nothing."
        )
    elif risk.estimated.method in ("subset", "importance"):
        yield (
            "Harm to which no gradient leads is not found by this method, "
            "however much of it there is; mc assumes nothing."
        )
    if risk.extreme is not None:
        yield extreme_sentence(risk.extreme, risk.probability("collision"))
    if risk.data is not None:
        yield data_sentence(risk.data)
    else:
        yield "Few data: the exposure's numbers are taken as they are."
    yield risk.exposure.left_out
    yield f"Where the exposure comes from: {risk.exposure.source}"
    yield from crashes(risk)
    yield (
        "The simulation: drivers, participants, sensors and friction are those of the embedded "
        "simulator."
    )
    yield (
        "Not compared with another simulator (--simulator)."
        if risk.elsewhere is None
        else elsewhere_sentence(risk.elsewhere)
    )
    if risk.failed or risk.implausible:
        yield (
            f"{risk.failed:,} rows have no result and {risk.implausible:,} could not happen; they "
            "count as harmless."
        )


def _rates(risk: Risk, name: str | None) -> Iterator[tuple[str, str] | None]:
    """Yield an event's rates per hour and per 1000 km, each with its interval."""
    if risk.exposure.encounters is not None:
        for unit, factor in (("h", 1.0), ("km", 1000.0)):
            rate = None if name is None else risk.rate(name, unit)
            yield (
                None
                if rate is None
                else (
                    number(rate.estimate * factor),
                    f"{number(rate.low * factor)} to {number(rate.high * factor)}",
                )
            )


def _cells(finding: Finding) -> tuple[str, ...]:
    value, width, upper = interval(finding.probability)
    return value, width if finding.probability else finding.doubt, upper, f"{finding.hits:,.0f}"


def _intervals(risk: Risk) -> str:
    """Return a picture of all intervals; nothing where no estimate is above 0."""
    lines = [("event", WORDS[name], finding.probability) for name, finding in risk.findings.items()]
    modes = [*risk.by_mode.items()][:MOST_DRAWN]
    lines += [("mode", words, mode.probability) for words, mode in modes]
    if risk.check is not None:
        p = risk.check.probability(EVENTS[risk.event].score)
        lines.append(("check", f"{WORDS[risk.event]}, by Monte Carlo", p))
    drawn = [
        charts.Interval(words, kind, p.low, p.estimate, p.high)
        for kind, words, p in lines
        if p is not None and p.estimate > 0.0
    ]
    label = "Probabilities per encounter with 95 % intervals"
    return charts.intervals(drawn, label) if drawn else ""


def _shares(parameter_share: ParameterShare) -> str:
    label = f"Shares of harmful rows by tenths of {parameter_share.name}"
    return charts.bars(parameter_share.shares, 0.1, label)


def _values(risk: Risk, x: Float) -> Iterator[tuple[str, str]]:
    """Yield the exposure's parameters with a row's values in their units."""
    space = risk.exposure.space
    values = space.values(x)
    for name in risk.exposure.marginals:
        parameter = space.parameters[name]
        if text := parameter.kind.text(values[name], "{:.4g}".format):
            yield name, text if parameter.unit == "1" else f"{text} {parameter.unit}"
