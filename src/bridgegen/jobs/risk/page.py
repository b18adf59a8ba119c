"""A risk as a page without scripts."""

import math
import re
from collections.abc import Iterator
from html import escape
from importlib.metadata import version
from importlib.resources import files
from pathlib import Path

from bridgegen.base.disk import write_whole
from bridgegen.jobs.risk.estimators.weighted import Probability
from bridgegen.jobs.risk.options import WORDS
from bridgegen.jobs.risk.outcomes import EVENTS
from bridgegen.jobs.risk.result import BINS, Finding, Likely, ParameterShare, Risk
from bridgegen.jobs.risk.text import data_sentence, elsewhere_sentence, number, sentence
from bridgegen.scenario.language.parameters import Parameter

_WIDTH, _ROW, _LEFT, _RIGHT = 900, 30, 330, 30
_SMALL, _TALL = 260, 110


def write_page(path: Path, risk: Risk) -> None:
    """Write the page of a risk.

    Raises:
        StorageError: it cannot be written.
    """
    fill = {
        "title": f"Risk of {escape(risk.exposure.scenario.name)}",
        "css": _own("page.css"),
        "facts": "".join(f"<li>{escape(one)}</li>" for one in facts(risk)),
        "sentence": escape(sentence(risk)),
        "picture": _intervals(risk),
        "table": _table(risk),
        "doubts": _list(risk.weighted.doubts),
        "modes": _modes(risk),
        "parameters": _parameters(risk),
        "likely": _likely(risk),
        "unsure": _list(unsure(risk)),
        "command": escape(risk.command),
        "version": escape(version("bridgegen")),
    }
    parts = re.split(r"\{\{(\w+)\}\}", _own("page.html"))
    text = "".join(fill[part] if i % 2 else part for i, part in enumerate(parts))
    write_whole(path, [text.encode("utf-8", "replace")])


def facts(risk: Risk) -> Iterator[str]:
    """Yield what a reader wants to know first, a few words each."""
    yield f"driver {risk.driver}"
    yield f"{risk.weighted.evaluations:,} simulations"
    yield f"method {risk.estimated.method}"
    yield f"{risk.exposure.feasible_share.estimate:.2%} of the exposure keep the constraints"
    yield f"seed {risk.seed}"


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
            "Harm was found by rows that are spread over the ranges, for no ever more harmful rows "
            "lead to it; a region so small that none of them lay in it is allowed for in the upper "
            "end alone."
        )
    elif "spread" in risk.weighted.facts:
        yield (
            "Harm that is reached through no ever more harmful rows is found only where one of "
            f"{risk.weighted.facts['spread']:,.0f} rows lies in it that are spread over the "
            "ranges; mc assumes nothing."
        )
    elif risk.estimated.method in ("subset", "importance"):
        yield (
            "Harm that is reached through no ever more harmful rows is not found by this method, "
            "however much of it there is; mc assumes nothing."
        )
    if risk.data is not None:
        yield data_sentence(risk.data)
    else:
        yield "Few data: the exposure's numbers are taken as they are."
    yield f"Where the exposure comes from: {risk.exposure.source}"
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


def _table(risk: Risk) -> str:
    rates = risk.exposure.encounters
    head = ["", "per encounter", "95 %", "below, with 95 %", "effective rows"]
    head += ["per hour", "per 1000 km"] if rates is not None else []
    rows = []
    for words, name, one in risk.stated:
        cells = list(_cells(one))
        if rates is not None:
            for unit, factor in (("h", 1.0), ("km", 1000.0)):
                rate = None if name is None else risk.rate(name, unit)
                cells.append(
                    "–"
                    if rate is None
                    else f"{number(rate.estimate * factor)}<small>{number(rate.low * factor)} to "
                    f"{number(rate.high * factor)}</small>"
                )
        row = "".join(f"<td>{cell}</td>" for cell in cells)
        rows.append(f"<tr><th>{escape(words)}</th>{row}</tr>")
    columns = "".join(f"<th>{one}</th>" for one in head)
    return f"<table><thead><tr>{columns}</tr></thead><tbody>{''.join(rows)}</tbody></table>"


def _cells(one: Finding) -> Iterator[str]:
    if one.probability is None:
        yield from ("not known", escape(one.doubt), "–", f"{one.hits:,.0f}")
        return
    p = one.probability
    yield number(p.estimate)
    yield f"{number(p.low)} to {number(p.high)}"
    yield number(p.upper)
    yield f"{one.hits:,.0f}"


def _intervals(risk: Risk) -> str:
    """Return a picture of all intervals, on a logarithmic axis."""
    lines: list[tuple[str, str, Probability]] = [
        ("event", WORDS[name], one.probability)
        for name, one in risk.findings.items()
        if one.probability is not None
    ]
    lines += [
        ("mode", words, one.probability)
        for words, one in list(risk.by_mode.items())[:6]
        if one.probability is not None
    ]
    if risk.check is not None:
        p = risk.check.probability(EVENTS[risk.event].score)
        lines.append(("check", f"{WORDS[risk.event]}, by Monte Carlo", p))
    lines = [one for one in lines if one[2].high > 0.0 and (one[2].estimate > 0.0)]
    if not lines:
        return ""
    least = min(p.low if p.low > 0.0 else p.estimate / 10.0 for _, _, p in lines)
    first, last = (
        math.floor(math.log10(least)),
        math.ceil(math.log10(max(p.high for *_, p in lines))),
    )
    last = max(last, first + 1)

    def at(value: float) -> float:
        part = (math.log10(max(value, 10.0**first)) - first) / (last - first)
        return _LEFT + part * (_WIDTH - _LEFT - _RIGHT)

    height = _ROW * len(lines) + 40
    parts = []
    for power in range(first, last + 1):
        x = at(10.0**power)
        parts.append(f'<path class="grid" d="M{x:.1f} 6V{height - 28}"/>')
        parts.append(f'<text x="{x:.1f}" y="{height - 10}" text-anchor="middle">1e{power}</text>')
    for row, (kind, words, p) in enumerate(lines):
        y = 20 + _ROW * row
        short = words if len(words) < 48 else f"{words[:46]}…"
        parts.append(
            f'<text class="{kind}" x="{_LEFT - 12}" y="{y + 4}" text-anchor="end">'
            f"{escape(short)}</text>"
        )
        parts.append(f'<path class="interval {kind}" d="M{at(p.low):.1f} {y}H{at(p.high):.1f}"/>')
        parts.append(f'<circle class="{kind}" cx="{at(p.estimate):.1f}" cy="{y}" r="4.5"/>')
    return (
        f'<svg viewBox="0 0 {_WIDTH} {height}" role="img" aria-label="Probabilities per encounter '
        f'with 95 % intervals">{"".join(parts)}</svg>'
    )


def _modes(risk: Risk) -> str:
    found = risk.by_mode
    if not found:
        return "<p>No harmful row was found.</p>"
    rows = []
    for words, one in found.items():
        row = "".join(f"<td>{cell}</td>" for cell in _cells(one))
        rows.append(f"<tr><th>{escape(words)}</th>{row}</tr>")
    head = "".join(
        f"<th>{one}</th>"
        for one in ("failure mode", "per encounter", "95 %", "below, with 95 %", "effective rows")
    )
    body = f"<thead><tr>{head}</tr></thead><tbody>{''.join(rows)}</tbody>"
    return f"<div class='wide'><table>{body}</table></div>"


def _parameters(risk: Risk) -> str:
    found = risk.parameters
    if not found:
        return "<p>Too few harmful rows to tell.</p>"
    return f"<div class='grid'>{''.join(_parameter(one) for one in found)}</div>"


def _parameter(one: ParameterShare) -> str:
    top = max(float(one.shares.max()), 0.2)
    wide, high = _SMALL / BINS, _TALL - 24
    bars = "".join(
        f'<rect class="bar" x="{k * wide + 1:.1f}" y="{6 + high * (1 - share / top):.1f}" '
        f'width="{wide - 2:.1f}" height="{high * share / top:.1f}"/>'
        for k, share in enumerate(one.shares.tolist())
    )
    level = 6 + high * (1 - 0.1 / top)
    line = f'<path class="even" d="M0 {level:.1f}H{_SMALL}"/>'
    unit = f" [{escape(one.unit)}]" if one.unit not in ("", "1") else ""
    low, middle, upper = (f"{value:.3g}" for value in one.harmful)
    least, usual, most = (f"{value:.3g}" for value in one.road)
    return (
        f"<figure><figcaption><b>{escape(one.name)}</b>{unit} <span>{one.distance:.2f}</span>"
        f"</figcaption><svg viewBox='0 0 {_SMALL} {_TALL - 12}' role='img' aria-label='Shares of "
        f"harmful rows by tenths of {escape(one.name)}'>{bars}{line}</svg>"
        f"<p class='muted'>harmful {middle} ({low} to {upper})<br>road {usual} ({least} to {most})"
        "</p></figure>"
    )


def _likely(risk: Risk) -> str:
    if not risk.most_likely:
        return ""
    shown = "".join(_encounter(risk, one) for one in risk.most_likely)
    return (
        "<section><h2>The most likely harmful encounter of each failure mode</h2><p class='muted'>"
        "The ego is blue, the one it meets orange; outlines stand where the conflict is most "
        f"urgent.</p>{shown}</section>"
    )


def _encounter(risk: Risk, one: Likely) -> str:
    space = risk.exposure.space
    values = space.values(one.x)
    rows = "".join(
        f"<tr><th>{escape(name)}</th><td>{escape(text)}</td></tr>"
        for name in risk.exposure.marginals
        if (text := _value(space.parameters[name], values[name]))
    )
    return (
        f"<div class='card'><h3>{escape(one.mode)}</h3><div class='motion'>{one.picture}</div>"
        f"<p class='muted'>Its files: {one.name}.xosc, .xodr and .owl.</p>"
        f"<div class='wide'><table class='values'><tbody>{rows}</tbody></table></div></div>"
    )


def _value(parameter: Parameter, value: float) -> str:
    unit = "" if parameter.unit == "1" else f" {parameter.unit}"
    return f"{parameter.kind.text(value, '{:.4g}'.format)}{unit}"


def _list(lines: "Iterator[str] | tuple[str, ...]") -> str:
    found = "".join(f"<li>{escape(one)}</li>" for one in lines)
    return f"<ul>{found}</ul>" if found else ""


def _own(name: str) -> str:
    return files("bridgegen.jobs.risk").joinpath(name).read_text("utf-8")
