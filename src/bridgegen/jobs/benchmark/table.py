"""A benchmark's results as CSV: the drivers, their outcomes by scenario, and every failure mode."""

from collections.abc import Iterable, Sequence

import numpy as np

from bridgegen.base.statistics import quartiles
from bridgegen.jobs.benchmark.failures import CAREFUL
from bridgegen.jobs.benchmark.plan import Plan
from bridgegen.jobs.benchmark.results import Outcome, Standing
from bridgegen.jobs.compare.table import write_csv

DRIVERS_FILE, OUTCOMES_FILE, MODES_FILE = "drivers.csv", "outcomes.csv", "modes.csv"

DRIVERS_HEAD = (
    "driver", "perception", "scenarios", "not_applicable", "failed", "modes", "robust",
    "first_failure", "severity", "failures", "evaluations", "failed_rows", "causes",
    *(f"avoided_by_{name}" for name in CAREFUL),
)  # fmt: skip
"""``first_failure``: median of the runs, inf where most runs have none; ``avoided_by_…``: share of
the failures."""

OUTCOMES_HEAD = (
    "driver", "scenario", "perception", "state", "why", "runs", "evaluations", "failed_rows",
    "failures", "preventable", "first_failure", "severity", "modes", "robust",
    *(f"avoided_by_{name}" for name in CAREFUL),
)  # fmt: skip
"""``preventable``: evaluations in which others are responsible, and the driver could have prevented
the conflict; they are no failures here."""

MODES_HEAD = (
    "driver", "scenario", "perception", "mode", "robust", "harm", "severity", "causes", "minimal",
    "scenario_file", "minimal_file", "script", "playback",
)  # fmt: skip
"""``robust``: empty where it was not tested."""


def write_tables(plan: Plan, found: Sequence[Outcome], standings: Sequence[Standing]) -> None:
    """Write the three tables; the same bytes for the same runs.

    Raises:
        StorageError: they cannot be written.
    """
    write_csv(plan.out / DRIVERS_FILE, DRIVERS_HEAD, map(_of_standing, standings))
    write_csv(plan.out / OUTCOMES_FILE, OUTCOMES_HEAD, map(_of_outcome, found))
    write_csv(plan.out / MODES_FILE, MODES_HEAD, (line for one in found for line in _modes(one)))


def _of_standing(one: Standing) -> Sequence[object]:
    causes = "; ".join(f"{name} {count}" for name, count in one.causes)
    shares = (one.avoided.get(name, float("nan")) for name in CAREFUL)
    return (
        one.driver, one.column, one.driven, one.not_applicable, one.failed, one.modes, one.robust,
        one.first, one.severity, one.failures, one.evaluations, one.failed_rows, causes, *shares,
    )  # fmt: skip


def _of_outcome(one: Outcome) -> Sequence[object]:
    head = (one.driver, one.scenario, one.column, one.state, one.why or one.unjudged)
    if one.state != "driven":
        return (*head, *[""] * (len(OUTCOMES_HEAD) - len(head)))
    shares = [
        (one.avoided or {}).get(name, 0) / one.judged if one.judged else "" for name in CAREFUL
    ]
    return (
        *head, one.runs, one.evaluations, one.failed_rows, one.failures, one.preventable,
        first(one), one.severity, len(one.ways), one.robust, *shares,
    )  # fmt: skip


def first(one: Outcome) -> float:
    """Return the median of the evaluations until the first failure; +inf where most have none."""
    return quartiles(np.array(one.first, dtype=np.float64)).median


def _modes(one: Outcome) -> Iterable[Sequence[object]]:
    for way in one.ways:
        robust = "" if way.robust is None else "yes" if way.robust else "no"
        yield (
            one.driver, one.scenario, one.column, way.title, robust, way.harm, way.severity,
            "; ".join(way.causes), way.minimal, way.scenario, way.minimal_scenario, way.script,
            way.playback,
        )  # fmt: skip
