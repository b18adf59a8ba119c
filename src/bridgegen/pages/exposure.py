"""A fit as a page without scripts: densities with bands, quantile plots, dependence."""

from pathlib import Path

import numpy as np

from bridgegen.base.disk import refuse_other
from bridgegen.pages import templates
from bridgegen.pages.charts import Plot
from bridgegen.scenario.exposure.fit import Fit, ParameterFit

GENERATOR = "BridgeGen fit"
_DOTS = 200
"""Largest number of points of a quantile plot: more would hide each other."""


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
    templates.write_page(
        path, "pages/web/exposure.html",
        title=f"Exposure of {fit.exposure.scenario.name}", generator=GENERATOR,
        facts=[*fit.facts()], remarks=fit.remarks(), samples=len(fit.replicates),
        forms=[_form(one) for one in fit.parameters.values()],
        parameters=[_parameter(one, fit) for one in fit.parameters.values()],
        correlated=fit.correlated, correlation=fit.correlation.tolist(),
        band=fit.correlation_band.tolist(),
    )  # fmt: skip


def _form(one: ParameterFit) -> list[str]:
    """Return a form with its numbers, tails and kernels without; how it fits; the next best one."""
    numbers = ", ".join(
        f"{key} {value:.4g}" for key, value in one.section.items() if isinstance(value, float)
    )
    tested = ("–", "–") if np.isnan(one.p) else (f"{one.distance:.3f}", f"{one.p:.3f}")
    second = next(
        (f"{name} (AIC {aic - one.ranking[0][1]:+.1f})" for name, aic in one.ranking[1:2]), "–"
    )
    form = f"{one.form} ({numbers})" if numbers else one.form
    return [f"{one.name} [{one.unit}]", form, *tested, second]


def _parameter(one: ParameterFit, fit: Fit) -> dict[str, object]:
    """Return a parameter's pictures; of one with single values a table of their shares."""
    parameter = fit.exposure.scenario.parameters[one.name]
    shown: dict[str, object] = {
        "name": one.name, "unit": one.unit, "description": parameter.description, "shares": [],
    }  # fmt: skip
    if not parameter.kind.apart:
        return {**shown, "density": _density(one), "quantiles": _quantiles(one)}
    columns = (values.tolist() for values in (one.at, one.density, *one.band))
    shown["shares"] = [
        (parameter.kind.text(value, "{:g}".format), f"{share:.3f}", f"{low:.3f} to {high:.3f}")
        for value, share, low, high in zip(*columns, strict=True)
    ]
    return shown


def _density(one: ParameterFit) -> str:
    low, high = float(one.at[0]), float(one.at[-1])
    n = len(one.values)
    count = int(np.clip(np.ceil(2.0 * n ** (1.0 / 3.0)), 8, 60))
    counts, edges = np.histogram(one.values, bins=count, range=(low, high))
    heights = counts / (n * np.diff(edges))
    finite = one.density[np.isfinite(one.density)]
    top = 1.08 * max(float(heights.max()), float(np.quantile(finite, 0.99)))
    plot = Plot((560.0, 373.0), (low, high), (0.0, top), (14.0, 14.0, 12.0, 40.0))
    plot.bars(edges, heights)
    plot.band(one.at, one.band[0], one.band[1])
    plot.line(one.at, one.density)
    plot.frame(f"{one.name} [{one.unit}]")
    return plot.svg(f"Density of {one.name}")


def _quantiles(one: ParameterFit) -> str:
    n = len(one.values)
    low = float(min(one.values[0], one.quantiles[0]))
    high = float(max(one.values[-1], one.quantiles[-1]))
    shown = np.unique(np.round(np.linspace(0, n - 1, min(n, _DOTS))).astype(np.int64))
    at, ends = one.quantiles[shown], np.array([low, high])
    plot = Plot((340.0, 340.0), (low, high), (low, high), (58.0, 12.0, 12.0, 58.0))
    plot.band(at, one.envelope[0][shown], one.envelope[1][shown])
    plot.line(ends, ends, "even")
    plot.dots(at, one.values[shown])
    plot.frame(f"form [{one.unit}]", f"events [{one.unit}]")
    return plot.svg(f"Quantiles of {one.name}")
