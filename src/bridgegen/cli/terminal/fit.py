"""A fit of an exposure as it is made, and what it found."""

import json
import math
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from bridgegen.cli.terminal.live import Live
from bridgegen.cli.terminal.tables import print_table

if TYPE_CHECKING:
    from collections.abc import Sequence

    from bridgegen.scenario.exposure.exposure import Rate
    from bridgegen.scenario.exposure.fit import Fit


class FitProgress(Live):
    """The bar of the parameters that are fitted."""

    def progress(self, done: int, total: int) -> None:
        """Show how many of how many parameters are done."""
        self.show(what="parameters", done=done, total=total)

    def replayed(self, done: int, total: int) -> None:
        """Show how many of how many batches of recorded events are simulated."""
        self.show(what="replays", done=done, total=total)


def print_fit(fit: "Fit", written: "Sequence[Path]", *, as_json: bool) -> None:
    """Print the forms with their goodness of fit, rates and files; on stderr what to know."""
    for text in fit.remarks():
        print(f"bridgegen: warning: {text}", file=sys.stderr)
    if as_json:
        print(json.dumps(_plain(fit, written), indent=2))
        return
    print_table(
        ("parameter", "unit", "form", "D", "p"),
        [
            (
                parameter.name,
                parameter.unit,
                parameter.form,
                None if math.isnan(parameter.distance) else float(f"{parameter.distance:.3g}"),
                None if math.isnan(parameter.p) else float(f"{parameter.p:.3g}"),
            )
            for parameter in fit.parameters.values()
        ],
        as_json=False,
    )
    print()
    for text in (*fit.facts(), fit.exposure.left_out):
        print(text)
    print()
    for path in written:
        print(path)


def _plain(fit: "Fit", written: "Sequence[Path]") -> dict[str, object]:
    encounters, twins = fit.exposure.encounters, fit.exposure.parameterisation
    return {
        "scenario": fit.exposure.scenario.name,
        "rows": fit.rows,
        "used": fit.used,
        "infeasible": fit.infeasible,
        "parameters": {
            name: {
                "form": parameter.form,
                "distance": None if math.isnan(parameter.distance) else parameter.distance,
                "p": None if math.isnan(parameter.p) else parameter.p,
                "ranking": [list(each) for each in parameter.ranking],
            }
            for name, parameter in fit.parameters.items()
        },
        "correlated": list(fit.correlated),
        "correlation": fit.correlation.tolist(),
        "degrees_of_freedom": fit.freedom,
        "per_hour": _rate(encounters.per_hour if encounters else None),
        "per_km": _rate(encounters.per_km if encounters else None),
        "feasible_share": fit.exposure.feasible_share.estimate,
        "parameterisation": twins.figures() if twins else None,
        "seed": fit.seed,
        "files": [str(path) for path in written],
    }


def _rate(rate: "Rate | None") -> dict[str, float] | None:
    return None if rate is None else {"estimate": rate.estimate, "low": rate.low, "high": rate.high}
