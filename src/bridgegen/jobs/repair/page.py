"""A repair on one page without scripts: the numbers, what they mend, and what they do not."""

from pathlib import Path

from bridgegen.base.units import percent
from bridgegen.jobs.repair.repair import DIFF, Repair
from bridgegen.jobs.suite.difference import CHANGES
from bridgegen.pages import templates
from bridgegen.pages.templates import Banner, counted
from bridgegen.pages.thumbnails import drawn

MOST_SHOWN = 20
"""Largest number of failures that are left of which the page shows the values."""


def write_page(path: Path, repair: Repair) -> None:
    """Write the page of a repair.

    Raises:
        StorageError: it cannot be written.
    """
    figures = repair.figures
    found = repair.held_out.difference if repair.held_out else None
    broken, new = figures["broken"], figures["new"]
    kind = "open" if not repair.repaired else "fails" if broken or new else ""
    rates = [
        (change, found.counts[change], " to ".join(map(percent, found.interval(change))))
        for change in CHANGES
        if found is not None
    ]
    templates.write_page(
        path,
        "jobs/repair/page.html",
        title=f"Repair of {repair.ego}",
        facts=[
            repair.work,
            f"mean jerk {repair.trial.jerk - 1.0:+.1%}",
            f"travel time {repair.trial.travel_time - 1.0:+.1%}",
        ],
        verdict=Banner(
            repair.sentence, kind, command=repair.repaired and f"--ego {repair.repaired}"
        ),
        numbers=repair.table,
        modes=[
            (
                f"{mode.scenario}: {mode.title}",
                "gone" if not mode.left else "left",
                f"{mode.left} of {mode.examples} fail",
                "yes" if mode.robust else "knife edge",
            )
            for mode in repair.modes
        ],
        rates=rates,
        diff=f"{DIFF}/{repair.held_out.page.name}" if repair.held_out else "",
        rest=repair.rest,
        left=[
            (item.scenario, item.why, ", ".join(f"{k} {v:.4g}" for k, v in item.values.items()))
            for item in repair.left[:MOST_SHOWN]
        ],
        rounds=[
            (number, evaluations, failures)
            for number, (evaluations, failures) in enumerate(repair.rounds)
        ],
        played=[(drawn(item, f"p{i}"), item.caption) for i, item in enumerate(repair.played)],
        shown=counted(len(repair.left[:MOST_SHOWN]), "failure"),
        command=repair.command,
    )
