"""A fit as a page without scripts: densities with bands, quantile plots, dependence."""

from pathlib import Path

import numpy as np

from bridgegen.base.disk import refuse_other
from bridgegen.base.units import percent
from bridgegen.pages import templates
from bridgegen.pages.charts import Plot
from bridgegen.scenario.exposure.fit import Fit, ParameterFit
from bridgegen.scenario.language.parameterisation import ELEMENTS, Parameterisation

GENERATOR = "BridgeGen fit"
DOUBTFUL = 0.05
"""Share of samples of a form below which events as far from it refute it."""

_DOTS = 200
"""Largest number of points of a quantile plot: more would hide each other."""


def refuse_other_page(path: Path) -> None:
    """Refuse a place where something else is than an earlier page of a fit.

    Raises:
        StorageError: there is one.
    """
    refuse_other(path, GENERATOR, "page of a fit")


def write_page(path: Path, fit: Fit, exposure: Path | None = None) -> None:
    """Write the page of a fit.

    Args:
        path: of the page.
        fit: it.
        exposure: its file, if it is written.

    Raises:
        StorageError: something else is there, or it cannot be written.
    """
    refuse_other_page(path)
    _, *facts = fit.facts()
    templates.write_page(
        path,
        "pages/web/exposure.html",
        title=f"Exposure of {fit.exposure.scenario.name}",
        generator=GENERATOR,
        verdict=_banner(fit, exposure),
        facts=facts,
        remarks=fit.remarks(),
        samples=len(fit.replicates),
        forms=[_form(parameter) for parameter in fit.parameters.values()],
        parameters=[_parameter(parameter, fit) for parameter in fit.parameters.values()],
        correlated=fit.correlated,
        correlation=fit.correlation.tolist(),
        band=fit.correlation_band.tolist(),
        says=fit.exposure.left_out,
        twins=_twins(fit.exposure.parameterisation),
    )


def _twins(found: Parameterisation | None) -> dict[str, object]:
    """Return the verdicts of recorded events and of their parameterised twins as tables."""
    if found is None:
        return {"rows": []}
    rows = [
        [verdict, driver, *one.model_dump().values(), *map(_interval, one.shares().values())]
        for verdict, of in found.agreement.items()
        for driver, one in of.items()
    ]
    back = [
        [verdict, one.replay + one.twin, *(of.get(element, "–") for element in ELEMENTS)]
        for verdict, of in found.given_back.items()
        for one in [found.pooled(verdict)]
    ]
    return {
        "source": found.source,
        "left_out": "; ".join(f"{n} {reason}" for reason, n in found.left_out.items()),
        "rows": rows,
        "elements": ELEMENTS,
        "back": back,
    }


def _interval(share: tuple[float, float, float] | None) -> tuple[str, str]:
    value, low, high = map(percent, share) if share else ("–", "", "")
    return value, f"{low} to {high}" if share else ""


def _banner(fit: Fit, exposure: Path | None) -> templates.Banner:
    """Return what was fitted, whether the forms hold, and what uses it."""
    first = next(fit.facts())
    tested = [one for one in fit.parameters.values() if not np.isnan(one.p)]
    doubtful = [one.name for one in tested if one.p < DOUBTFUL]
    text = f"of {fit.exposure.scenario.name}"
    if doubtful:
        text += f"; the form of {', '.join(doubtful)} is doubtful (p below {DOUBTFUL:g})"
    elif tested:
        text += f"; no form is refuted (least p {min(one.p for one in tested):.2f})"
    if fit.outside or fit.infeasible:
        text += "; some events lie outside the scenario, see below"
    name = fit.exposure.scenario.name
    command = "" if exposure is None else f"bridgegen risk {name} --exposure {exposure}"
    kind = "open" if doubtful or fit.outside or fit.infeasible else ""
    return templates.Banner(f"{text}.", kind, first.upper(), command)


def _form(parameter_fit: ParameterFit) -> list[str]:
    """Return a form with its numbers, tails and kernels without; how it fits; the next best one."""
    numbers = ", ".join(
        f"{key} {value:.4g}"
        for key, value in parameter_fit.section.items()
        if isinstance(value, float)
    )
    tested = (
        ("–", "–")
        if np.isnan(parameter_fit.p)
        else (f"{parameter_fit.distance:.3f}", f"{parameter_fit.p:.3f}")
    )
    second = next(
        (
            f"{name} (AIC {aic - parameter_fit.ranking[0][1]:+.1f})"
            for name, aic in parameter_fit.ranking[1:2]
        ),
        "–",
    )
    form = f"{parameter_fit.form} ({numbers})" if numbers else parameter_fit.form
    return [f"{parameter_fit.name} [{parameter_fit.unit}]", form, *tested, second]


def _parameter(parameter_fit: ParameterFit, fit: Fit) -> dict[str, object]:
    """Return a parameter's pictures; of one with single values a table of their shares."""
    parameter = fit.exposure.scenario.parameters[parameter_fit.name]
    shown: dict[str, object] = {
        "name": parameter_fit.name,
        "unit": parameter_fit.unit,
        "description": parameter.description,
        "shares": [],
    }
    if not parameter.kind.apart:
        return {**shown, "density": _density(parameter_fit), "quantiles": _quantiles(parameter_fit)}
    columns = (
        values.tolist() for values in (parameter_fit.at, parameter_fit.density, *parameter_fit.band)
    )
    shown["shares"] = [
        (parameter.kind.text(value, "{:g}".format), f"{share:.3f}", f"{low:.3f} to {high:.3f}")
        for value, share, low, high in zip(*columns, strict=True)
    ]
    return shown


def _density(parameter_fit: ParameterFit) -> str:
    low, high = float(parameter_fit.at[0]), float(parameter_fit.at[-1])
    n = len(parameter_fit.values)
    count = int(np.clip(np.ceil(2.0 * n ** (1.0 / 3.0)), 8, 60))
    counts, edges = np.histogram(parameter_fit.values, bins=count, range=(low, high))
    heights = counts / (n * np.diff(edges))
    finite = parameter_fit.density[np.isfinite(parameter_fit.density)]
    top = 1.08 * max(float(heights.max()), float(np.quantile(finite, 0.99)))
    plot = Plot((560.0, 373.0), (low, high), (0.0, top), (14.0, 14.0, 12.0, 40.0))
    plot.bars(edges, heights)
    plot.band(parameter_fit.at, parameter_fit.band[0], parameter_fit.band[1])
    plot.line(parameter_fit.at, parameter_fit.density)
    plot.frame(f"{parameter_fit.name} [{parameter_fit.unit}]")
    return plot.svg(f"Density of {parameter_fit.name}")


def _quantiles(parameter_fit: ParameterFit) -> str:
    n = len(parameter_fit.values)
    low = float(min(parameter_fit.values[0], parameter_fit.quantiles[0]))
    high = float(max(parameter_fit.values[-1], parameter_fit.quantiles[-1]))
    shown = np.unique(np.round(np.linspace(0, n - 1, min(n, _DOTS))).astype(np.int64))
    at, ends = parameter_fit.quantiles[shown], np.array([low, high])
    plot = Plot((340.0, 340.0), (low, high), (low, high), (58.0, 12.0, 12.0, 58.0))
    plot.band(at, parameter_fit.envelope[0][shown], parameter_fit.envelope[1][shown])
    plot.line(ends, ends, "even")
    plot.dots(at, parameter_fit.values[shown])
    plot.frame(f"form [{parameter_fit.unit}]", f"events [{parameter_fit.unit}]")
    return plot.svg(f"Quantiles of {parameter_fit.name}")
