"""A run's critical regions: the bar while they are verified, then the table."""

import json
from typing import TYPE_CHECKING

from rich.console import Console
from rich.table import Table

from bridgegen.cli.terminal.live import Live

if TYPE_CHECKING:
    from bridgegen.jobs.search.regions import RunRegions
    from bridgegen.search.regions import Evidence


class RegionsProgress(Live):
    """The live progress of simulating fresh scenarios."""

    def stage(self, stage: str) -> None:
        """Show the stage that begins."""
        if stage == "compile":
            self.say_compiling()
        if stage == "report":
            self.show(what="writing the report")

    def progress(self, done: int, total: int) -> None:
        """Show how many scenarios are done, and how many there are."""
        self.show(what="simulating", done=done, total=total)


def print_regions(run: "RunRegions", *, as_json: bool) -> None:
    """Print a run's regions: the confirmed ones, the others, then the totals."""
    facts, found = run.record, run.found
    if as_json:
        print(json.dumps(facts, indent=2))
        return
    confirmed = len(found.confirmed)
    by = f" by {facts['cause']}" if facts["cause"] else ""
    print(
        f"{run.folder}: {facts['scenario']}, ego {facts['ego']}, {facts['algorithm']}, "
        f"{facts['evaluations']} evaluations{'' if facts['finished'] else ' so far'}, "
        f"{found.critical} critical{by}\n"
    )
    least = _percent(facts["at_least"])
    asked = f"at least {least} of all scenarios are critical, with 95 % confidence"
    if confirmed:
        print(f"Regions where {asked}:\n")
        _print_regions(run, 0, confirmed)
    else:
        print(f"No region is confirmed where {asked}.")
    if others := len(found.regions) - confirmed:
        print("\nNot confirmed:\n")
        _print_regions(run, confirmed, confirmed + others)
    if found.regions:
        print(
            "\nfresh: random scenarios of the region, simulated for this table: the unbiased "
            "share, with\nits 95 % interval. run: those that the search chose there, a biased "
            "share. space: share\nof all random scenarios that lie in the region."
        )
    else:
        print(
            "No part of the parameters' ranges stands out in a decision tree of the evaluations:\n"
            "too few are critical, or they are not concentrated enough."
        )
    if confirmed:
        print(
            f"\nThe confirmed {'region holds' if confirmed == 1 else 'regions hold'} "
            f"{found.critical_held} of the run's {found.critical} critical scenarios, and "
            f"{_percent(found.space_share)} of all random scenarios."
        )
        if "exposure" in facts:
            low, high = map(_percent, facts["exposure_share"]["interval"])
            print(
                f"Of the encounters that the exposure describes, "
                f"{_percent(facts['exposure_share']['share'])} ({low.removesuffix(' %')} to "
                f"{high}) lie in them. Its source: {facts['exposure']}"
            )
    files = ", ".join(map(str, run.files))
    print(f"{found.simulations} fresh scenarios, seed {facts['seed']}: {files}")
    if run.unstated:
        print(
            f"{len(run.unstated)} of the confirmed regions cannot be stated as classes: the "
            "ontology cannot express this\nscenario, or has no value of a parameter that the rule "
            "names."
        )


def _print_regions(run: "RunRegions", start: int, stop: int) -> None:
    from bridgegen.search.regions.box import ANYWHERE, conditions

    failed = any(region.fresh.failed for region in run.found.regions[start:stop])
    table = Table(box=None, pad_edge=False, header_style="bold", padding=(0, 2, 1, 0))
    told = run.record["regions"][start:stop]
    met = ["road"] if "exposure" in run.record else []
    for name in ("#", "region", "fresh", "run", "space", *met, *(["failed"] if failed else [])):
        table.add_column(name, overflow="fold")
    for number, region in enumerate(run.found.regions[start:stop], start=start + 1):
        rule = "\nand ".join(conditions(region.box, run.space)) or ANYWHERE
        note = "\n(narrowed to others)" if region.narrowed else ""
        table.add_row(
            str(number),
            rule + note,
            _shares(region.fresh),
            _shares(region.search),
            _percent(region.space_share),
            *([_percent(told[number - start - 1]["exposure"]["share"])] if met else []),
            *([str(region.fresh.failed)] if failed else []),
        )
    Console(markup=False, emoji=False, highlight=False).print(table)


def _shares(evidence: "Evidence") -> str:
    if evidence.share is None:
        return "none"
    low, high = map(_percent, evidence.interval)
    low = low.removesuffix(" %")
    return f"{_percent(evidence.share)}\n{low} to {high}\n{evidence.critical} of {evidence.rows}"


def _percent(share: float) -> str:
    from bridgegen.base.units import percent

    return percent(share)
