"""A fit as a page without scripts: densities with bands, quantile plots, dependence."""

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from html import escape
from importlib.metadata import version
from importlib.resources import files
from pathlib import Path

import numpy as np

from bridgegen.base.arrays import Float
from bridgegen.base.disk import refuse_other, write_whole
from bridgegen.scenario.exposure.exposure import Rate
from bridgegen.scenario.exposure.fit import Fit, ParameterFit

GENERATOR = "BridgeGen fit"
_WIDTH, _HEIGHT, _LEFT, _BOTTOM, _TOP = 560, 373, 14, 40, 12
_SQUARE, _EDGE = 340, 58
_DOTS = 200
"""Of a quantile plot: more would hide each other."""


@dataclass(frozen=True)
class _Scale:
    """From values to pixels; values outside the range stand at its ends."""

    low: float
    high: float
    start: float
    end: float

    def __call__(self, value: Float) -> list[float]:
        part = (np.clip(value, self.low, self.high) - self.low) / (self.high - self.low)
        pixels: list[float] = (self.start + part * (self.end - self.start)).tolist()
        return pixels

    def at(self, value: float) -> float:
        """Return the pixel of one value."""
        return self(np.array([value]))[0]


def refuse_other_page(path: Path) -> None:
    """Refuse a place where something else is than an earlier page of a fit.

    Raises:
        StorageError: there is one.
    """
    refuse_other(path, GENERATOR, "page of a fit")


def write_page(path: Path, fit: Fit) -> None:
    """Write the page of a fit.

    Raises:
        StorageError: something else is there, or it cannot be written.
    """
    refuse_other_page(path)
    fill = {
        "title": f"Exposure of {escape(fit.exposure.scenario.name)}",
        "css": _own("page.css"),
        "facts": "".join(f"<li>{escape(one)}</li>" for one in facts(fit)),
        "table": _table(fit),
        "test": (
            "D is Kolmogorov's distance between data and form; p is the share of "
            f"{len(fit.replicates)} samples of the form, each fitted again, that are as far from "
            "their fit. A small p says that the form is wrong; a large one only that these events "
            "do not show it."
        ),
        "remarks": _remarks(fit),
        "parameters": "\n".join(_section(one, fit) for one in fit.parameters.values()),
        "dependence": _dependence(fit),
        "version": escape(version("bridgegen")),
    }
    parts = re.split(r"\{\{(\w+)\}\}", _own("page.html"))
    text = "".join(fill[part] if i % 2 else part for i, part in enumerate(parts))
    write_whole(path, [text.encode("utf-8", "replace")])


def facts(fit: Fit) -> Iterator[str]:
    """Yield what a fit found, a few words each."""
    yield f"{fit.used:,} of {fit.rows:,} events fitted"
    encounters = fit.exposure.encounters
    if encounters is not None:
        for unit, rate in (("h", encounters.per_hour), ("km", encounters.per_km)):
            if rate is not None:
                yield rate_text(rate, unit)
    yield f"{fit.exposure.feasible_share.estimate:.2%} keep the constraints"
    yield f"seed {fit.seed}"


def rate_text(rate: Rate, unit: str) -> str:
    """Return a rate with its interval in words."""
    return f"{rate.estimate:.3g} per {unit} (95 %: {rate.low:.3g} to {rate.high:.3g})"


def remarks(fit: Fit) -> list[str]:
    """Return what a reader of a fit must know, a sentence each."""
    broken = [f"{count} events break '{rule}'" for rule, count in fit.infeasible.items()]
    return [*fit.outside, *broken, *fit.notes]


def _remarks(fit: Fit) -> str:
    found = remarks(fit)
    lines = "".join(f"<li>{escape(one)}</li>" for one in found)
    return f"<div class='card'><ul>{lines}</ul></div>" if found else ""


def _table(fit: Fit) -> str:
    head = "".join(
        f"<th{' class=words' if one == 'form' else ''}>{one}</th>"
        for one in ("parameter", "form", "D", "p", "next best")
    )
    rows = []
    for one in fit.parameters.values():
        beyond = one.ranking[1:2]
        second = f"{beyond[0][0]} (AIC {beyond[0][1] - one.ranking[0][1]:+.1f})" if beyond else "–"
        tested = ("–", "–") if np.isnan(one.p) else (f"{one.distance:.3f}", f"{one.p:.3f}")
        cells = [*tested, escape(second)]
        rows.append(
            f"<tr><th>{escape(one.name)} [{escape(one.unit)}]</th>"
            f"<td class='words'>{escape(_form(one))}</td>"
            + "".join(f"<td>{cell}</td>" for cell in cells)
            + "</tr>"
        )
    return f"<table><thead><tr>{head}</tr></thead><tbody>{''.join(rows)}</tbody></table>"


def _form(one: ParameterFit) -> str:
    """Return a form with its numbers, tails and kernels without."""
    single = {key: value for key, value in one.section.items() if isinstance(value, float)}
    numbers = ", ".join(f"{key} {value:.4g}" for key, value in single.items())
    return f"{one.form} ({numbers})" if numbers else one.form


def _section(one: ParameterFit, fit: Fit) -> str:
    parameter = fit.exposure.scenario.parameters[one.name]
    about = f"<p class='muted'>{escape(parameter.description)}</p>" if parameter.description else ""
    title = f"<section><h2>{escape(one.name)} [{escape(one.unit)}]</h2>"
    if parameter.kind.apart:
        texts = [parameter.kind.text(value, "{:g}".format) for value in one.at.tolist()]
        return f"{title}<div class='card'>{_shares(one, texts)}{about}</div></section>"
    return (
        f"{title}<div class='card'><div class='pair'><div>{_density(one)}"
        "<p class='muted'>Events, the fitted density, and its 95 % band.</p></div><div>"
        f"{_quantiles(one)}<p class='muted'>Quantiles of the events over those of the form; in the "
        f"band lie 95 % of each if the form is true.</p></div></div>{about}</div></section>"
    )


def _density(one: ParameterFit) -> str:
    low, high = float(one.at[0]), float(one.at[-1])
    n = len(one.values)
    count = int(np.clip(np.ceil(2.0 * n ** (1.0 / 3.0)), 8, 60))
    counts, edges = np.histogram(one.values, bins=count, range=(low, high))
    heights = counts / (n * np.diff(edges))
    finite = one.density[np.isfinite(one.density)]
    top = 1.08 * max(float(heights.max()), float(np.quantile(finite, 0.99)))
    x = _Scale(low, high, _LEFT, _WIDTH - _LEFT)
    y = _Scale(0.0, top, _HEIGHT - _BOTTOM, _TOP)
    bars = "".join(
        f'<rect class="bar" x="{a:.1f}" y="{b:.1f}" width="{max(w - 1.0, 0.5):.1f}" '
        f'height="{_HEIGHT - _BOTTOM - b:.1f}"/>'
        for a, b, w in zip(x(edges[:-1]), y(heights), np.diff(x(edges)).tolist(), strict=True)
    )
    upper = zip(x(one.at), y(one.band[1]), strict=True)
    lower = zip(x(one.at[::-1]), y(one.band[0][::-1]), strict=True)
    band = f'<polygon class="band" points="{_points([*upper, *lower])}"/>'
    curve = _points(zip(x(one.at), y(one.density), strict=True))
    line = f'<polyline class="fit" points="{curve}"/>'
    base = _HEIGHT - _BOTTOM
    axis = f'<path class="axis" d="M{_LEFT} {base}H{_WIDTH - _LEFT}"/>'
    marks = "".join(
        f'<text x="{x.at(tick):.1f}" y="{base + 18}" text-anchor="middle">{tick:g}</text>'
        for tick in _ticks(low, high)
    )
    label = (
        f'<text x="{_WIDTH / 2:.0f}" y="{_HEIGHT - 4}" text-anchor="middle">'
        f"{escape(one.name)} [{escape(one.unit)}]</text>"
    )
    body = bars + band + line + axis + marks + label
    return _svg(_WIDTH, _HEIGHT, f"Density of {one.name}", body)


def _quantiles(one: ParameterFit) -> str:
    n = len(one.values)
    low = float(min(one.values[0], one.quantiles[0]))
    high = float(max(one.values[-1], one.quantiles[-1]))
    side = _SQUARE - _EDGE - 12
    x = _Scale(low, high, _EDGE, _EDGE + side)
    y = _Scale(low, high, 12 + side, 12)
    shown = np.unique(np.round(np.linspace(0, n - 1, min(n, _DOTS))).astype(np.int64))
    at = one.quantiles[shown]
    upper = zip(x(at), y(one.envelope[1][shown]), strict=True)
    lower = zip(x(at[::-1]), y(one.envelope[0][shown][::-1]), strict=True)
    band = f'<polygon class="band" points="{_points([*upper, *lower])}"/>'
    dots = "".join(
        f'<circle class="dot" cx="{a:.1f}" cy="{b:.1f}" r="1.8"/>'
        for a, b in zip(x(at), y(one.values[shown]), strict=True)
    )
    even = f'<path class="even" d="M{_EDGE} {12 + side}L{_EDGE + side} 12"/>'
    axes = f'<path class="axis" d="M{_EDGE} 12V{12 + side}H{_EDGE + side}"/>'
    ticks = "".join(
        f'<text x="{x.at(tick):.1f}" y="{30 + side}" text-anchor="middle">{tick:g}</text>'
        f'<text x="{_EDGE - 6}" y="{y.at(tick) + 4:.1f}" text-anchor="end">{tick:g}</text>'
        for tick in _ticks(low, high)
    )
    label = (
        f'<text x="{_EDGE + side / 2:.0f}" y="{50 + side}" text-anchor="middle">form '
        f"[{escape(one.unit)}]</text>"
        f'<text transform="translate(14 {12 + side / 2:.0f}) rotate(-90)" text-anchor="middle">'
        f"events [{escape(one.unit)}]</text>"
    )
    body = band + even + dots + axes + ticks + label
    return _svg(_SQUARE, _SQUARE, f"Quantiles of {one.name}", body)


def _shares(one: ParameterFit, texts: Sequence[str]) -> str:
    rows = "".join(
        f"<tr><th>{escape(text)}</th><td>{share:.3f}</td><td>{low:.3f} to {high:.3f}</td></tr>"
        for text, share, low, high in zip(
            texts, one.density.tolist(), one.band[0].tolist(), one.band[1].tolist(), strict=True
        )
    )
    head = "<tr><th>value</th><th>share</th><th>95 % band</th></tr>"
    return f"<table><thead>{head}</thead><tbody>{rows}</tbody></table>"


def _dependence(fit: Fit) -> str:
    names = fit.correlated
    if len(names) < 2:
        return ""
    low, high = fit.correlation_band
    rows = []
    for i, name in enumerate(names):
        cells = []
        for j in range(len(names)):
            value = float(fit.correlation[i, j])
            if i == j:
                cells.append("<td>1</td>")
                continue
            sign = "plus" if value > 0.0 else "minus"
            cells.append(
                f'<td style="background: rgba(var(--{sign}), {abs(value):.2f})">{value:.2f}'
                f"<small>{low[i, j]:.2f} to {high[i, j]:.2f}</small></td>"
            )
        rows.append(f"<tr><th>{escape(name)}</th>{''.join(cells)}</tr>")
    head = "<th></th>" + "".join(f"<th>{escape(name)}</th>" for name in names)
    return (
        "<section><h2>Dependence</h2><div class='card'><div class='wide'><table class='matrix'>"
        f"<thead><tr>{head}</tr></thead><tbody>{''.join(rows)}</tbody></table></div>"
        "<p class='muted'>Correlations of normal scores (a Gaussian copula), with 95 % bands. A "
        "Gaussian copula has no dependence in the extremes beyond them.</p></div></section>"
    )


def _ticks(low: float, high: float) -> list[float]:
    """Return round numbers in a range, about six."""
    step = 10.0 ** np.floor(np.log10((high - low) / 5.0))
    step *= next(one for one in (1.0, 2.0, 5.0, 10.0) if (high - low) / (step * one) <= 7.0)
    first = np.ceil(low / step - 1e-9)
    return [
        float(f"{k * step:.10g}") + 0.0
        for k in np.arange(first, np.floor(high / step + 1e-9) + 1.0)
    ]


def _points(pairs: "Iterable[tuple[float, float]]") -> str:
    return " ".join(f"{a:.1f},{b:.1f}" for a, b in pairs)


def _svg(width: int, height: int, label: str, body: str) -> str:
    return (
        f'<svg viewBox="0 0 {width} {height}" role="img" aria-label="{escape(label)}">{body}</svg>'
    )


def _own(name: str) -> str:
    return files("bridgegen.scenario.exposure").joinpath(name).read_text("utf-8")
