"""A risk: one bar for its simulations, then its sentence and its table."""

import json
import math
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from bridgegen.cli.terminal.live import Live
from bridgegen.cli.terminal.tables import print_table

if TYPE_CHECKING:
    from collections.abc import Sequence

    from bridgegen.jobs.preventability import CellClass, PreventabilityMap
    from bridgegen.jobs.preventability.preventability import MapCallbacks
    from bridgegen.jobs.risk.result import Risk
    from bridgegen.jobs.risk.risk import RiskCallbacks
    from bridgegen.scenario.exposure.exposure import Rate
    from bridgegen.scenario.exposure.fit import Fit


class RiskScreen(Live):
    """A risk's live progress."""

    @property
    def callbacks(self) -> "RiskCallbacks":
        """The callbacks for a risk."""
        from bridgegen.jobs.risk.risk import RiskCallbacks

        return RiskCallbacks(
            compile=self.say_compiling,
            evaluations=lambda done, total: self.show(what="simulations", done=done, total=total),
            elsewhere=lambda done, total: self.show(what="elsewhere", done=done, total=total),
        )


def print_risk(result: "Risk", seconds: float, *, as_json: bool) -> None:
    """Print a risk's sentence, its probabilities and rates, then its files; or its record."""
    from bridgegen.jobs.risk.outcomes import EVENTS
    from bridgegen.jobs.risk.result import PAGE
    from bridgegen.jobs.risk.text import (
        data_sentence,
        elsewhere_sentence,
        interval,
        rate_text,
        sentence,
    )

    if as_json:
        print(json.dumps(result.to_dict(), indent=1))
        return
    print(f"{sentence(result)}\n")
    met = result.exposure.encounters
    units = [one for one in ("h", "km") if met is not None and getattr(met, _AMOUNTS[one])]
    rows = []
    for words, name, one in result.stated:
        row = [words, *interval(one.probability), f"{one.hits:,.0f}"]
        for unit in units:
            row.append(rate_text(None if name is None else result.rate(name, unit)))
        rows.append(tuple(row))
    head = ("", "per encounter", "95 %", "below (95 %)", "effective rows")
    print_table((*head, *(f"per {unit}" for unit in units)), rows, as_json=False)
    for doubt in result.weighted.doubts:
        print(f"\ndoubt       {doubt}")
    print(f"\n{'method':<12}{result.estimated.method}: {result.estimated.why}")
    if result.check is not None:
        p = result.check.probability(EVENTS[result.event].score)
        values = interval(p)
        print(f"{'check':<12}{values[0]} ({values[1]}) in {result.check.evaluations:,} by mc")
    if result.data is not None:
        print(f"{'data':<12}{data_sentence(result.data)}")
    if result.elsewhere is not None:
        print(f"{'elsewhere':<12}{elsewhere_sentence(result.elsewhere)}")
    print(f"{'page':<12}{result.folder / PAGE}")
    print(f"{'wall time':<12}{seconds:.1f} s, {result.weighted.evaluations:,} simulations")


_AMOUNTS = {"h": "hours", "km": "km"}


# --- A preventability map: one bar for its cells, then its table ---


class MapScreen(Live):
    """A map's live progress."""

    @property
    def callbacks(self) -> "MapCallbacks":
        """The callbacks for a map."""
        from bridgegen.jobs.preventability.preventability import MapCallbacks

        return MapCallbacks(
            compile=self.say_compiling,
            cells=lambda done, total: self.show(what="cells", done=done, total=total),
        )


def print_map(result: "PreventabilityMap", seconds: float, *, as_json: bool) -> None:
    """Print the cells of each driver by class, as ``summary.json`` calls them; then the files."""
    from bridgegen.jobs.preventability import CellClass

    figures = [result.figures(name) for name in result.drivers]
    if as_json:
        head = tuple(figures[0])
        print_table(head, [tuple(one.values()) for one in figures], as_json=True)
        return
    rows = [(one["driver"], *(_cell(one, kind) for kind in CellClass)) for one in figures]
    head = ("driver", *(kind.name.lower().replace("_", " ") for kind in CellClass))
    print_table(head, rows, as_json=False)
    print(f"\n{'page':<12}{result.page}")
    print(f"{'arrays':<12}{result.folder}")
    print(f"{'wall time':<12}{seconds:.1f} s, {result.grid.cells:,} cells")


def _cell(figures: dict[str, object], kind: "CellClass") -> str:
    count, share = figures[kind.name.lower()], figures.get(f"{kind.name.lower()}_share")
    return f"{count:,} {share:.1%}" if isinstance(share, float) else f"{count:,}"


# --- A fit as it is made, and what it found ---


class FitScreen(Live):
    """The bar of the parameters that are fitted."""

    def progress(self, done: int, total: int) -> None:
        """Show how many of how many parameters are done."""
        self.show(what="parameters", done=done, total=total)


def print_fit(fit: "Fit", written: "Sequence[Path]", *, as_json: bool) -> None:
    """Print the forms with their goodness of fit, rates and files; on stderr what to know."""
    from bridgegen.scenario.exposure.page import facts, remarks

    for text in remarks(fit):
        print(f"bridgegen: warning: {text}", file=sys.stderr)
    if as_json:
        print(json.dumps(_plain(fit, written), indent=2))
        return
    print_table(
        ("parameter", "unit", "form", "D", "p"),
        [
            (
                one.name, one.unit, one.form,
                None if math.isnan(one.distance) else float(f"{one.distance:.3g}"),
                None if math.isnan(one.p) else float(f"{one.p:.3g}"),
            )
            for one in fit.parameters.values()
        ],
        as_json=False,
    )  # fmt: skip
    print()
    for text in facts(fit):
        print(text)
    print()
    for path in written:
        print(path)


def _plain(fit: "Fit", written: "Sequence[Path]") -> dict[str, object]:
    encounters = fit.exposure.encounters
    return {
        "scenario": fit.exposure.scenario.name,
        "rows": fit.rows,
        "used": fit.used,
        "infeasible": fit.infeasible,
        "parameters": {
            name: {
                "form": one.form,
                "distance": None if math.isnan(one.distance) else one.distance,
                "p": None if math.isnan(one.p) else one.p,
                "ranking": [list(each) for each in one.ranking],
            }
            for name, one in fit.parameters.items()
        },
        "correlated": list(fit.correlated),
        "correlation": fit.correlation.tolist(),
        "per_hour": _rate(encounters.per_hour if encounters else None),
        "per_km": _rate(encounters.per_km if encounters else None),
        "feasible_share": fit.exposure.feasible_share.estimate,
        "seed": fit.seed,
        "files": [str(path) for path in written],
    }


def _rate(rate: "Rate | None") -> dict[str, float] | None:
    return None if rate is None else {"estimate": rate.estimate, "low": rate.low, "high": rate.high}
