"""A risk: one bar for its simulations, then its sentence and its table."""

import json
from typing import TYPE_CHECKING

from bridgegen.cli.terminal.live import Live
from bridgegen.cli.terminal.tables import print_table

if TYPE_CHECKING:
    from bridgegen.jobs.risk import Risk
    from bridgegen.jobs.risk.risk import RiskCallbacks


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
