"""The measures of a run, and which direction is better."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import ceil

import numpy as np

from bridgegen.base.arrays import Float
from bridgegen.base.statistics import quartiles
from bridgegen.jobs.compare.fronts import Scale, front, generational_distance, hypervolume, spread
from bridgegen.jobs.compare.plan import Cell
from bridgegen.jobs.compare.record import DISTINCT, MODES, Record
from bridgegen.search.triage.modes import of_found

RANDOM = "random"
"""The algorithm whose scenarios are drawn from the space without regard to results."""

SHARE = 0.05
"""Share of the budget that must be critical for T_critic: 50 evaluations of 1000."""


@dataclass(frozen=True)
class Measure:
    """A number of each run.

    Attributes:
        name: in files.
        title: in tables.
        text: description, one line.
        larger: whether larger is better; else smaller is.
        timed: whether it depends on wall time, so that it is not repeatable.
        digits: after the decimal point, in tables.
    """

    name: str
    title: str
    text: str
    larger: bool
    timed: bool = False
    digits: int = 0


def waited_for(budget: int) -> int:
    """Return k: T_critic is the time to the k-th critical scenario."""
    return max(1, ceil(SHARE * budget - 1e-9))


def counts(budget: int) -> tuple[int, ...]:
    """Return the k of the time to the k-th critical scenario: 1, 10, 50, and that of T_critic."""
    return tuple(sorted({1, 10, 50, waited_for(budget)}))


def measures(budget: int) -> tuple[Measure, ...]:
    """Return all measures of a comparison with this budget: what was found first, time last."""
    k = waited_for(budget)
    best = "divided by the best method's median"
    return (
        Measure(
            "modes", "modes", "different conflicts of the critical scenarios: type, responsible, "
            "rule, partner", True,
        ),
        Measure("distinct", "distinct", "different critical scenarios", True),
        Measure(
            "covered", "covered", "share of the critical scenarios of random search, with other "
            "seeds, whose conflict was found, too", True, digits=3,
        ),
        Measure("to_1", "to 1st", "evaluations until the 1st critical scenario", False),
        Measure(
            f"to_{DISTINCT}_distinct", f"to {DISTINCT} distinct",
            f"evaluations until {DISTINCT} different critical scenarios", False,
        ),
        Measure(
            f"to_{MODES}_modes", f"to {MODES} modes", f"evaluations until {MODES} modes", False
        ),
        Measure("critical_bins", "bins", "bins of parameters that hold a critical scenario", True),
        Measure(
            "critical_pairs", "pairs", "pairs of two parameters' bins that hold a critical "
            "scenario", True,
        ),
        Measure("r_critic", "R_critic", "critical share of the evaluations made", True, digits=3),
        Measure(
            "t_critic", "T_critic", f"evaluations until critical scenario {k}, {best}", False,
            digits=2,
        ),
        *(
            Measure(f"to_{n}", f"to {ordinal(n)}", f"evaluations until the {ordinal(n)} critical "
                    "scenario", False)
            for n in counts(budget)[1:]
        ),
        Measure(
            "hypervolume", "hypervolume", "share of the objective box that is dominated", True,
            digits=4,
        ),
        Measure(
            "gd", "GD", "generational distance: mean distance of the front from the front of all "
            "runs", False, digits=4,
        ),
        Measure("spread", "spread Δ", "unevenness of the front, Deb's Δ", False, digits=3),
        Measure(
            "t_critic_seconds", "T_critic, s", f"seconds until critical scenario {k}, {best}",
            False, timed=True, digits=2,
        ),
        Measure(
            f"seconds_to_{k}", f"s to {ordinal(k)}", f"seconds until the {ordinal(k)} critical "
            "scenario", False, timed=True, digits=2,
        ),
        Measure("seconds", "seconds", "seconds of search", False, timed=True, digits=2),
    )  # fmt: skip


def ordinal(n: int) -> str:
    """Return 1 as "1st", 50 as "50th"."""
    endings = {1: "st", 2: "nd", 3: "rd"}
    return f"{n}{'th' if n % 100 in (11, 12, 13) else endings.get(n % 10, 'th')}"


@dataclass(frozen=True)
class Measured:
    """One scenario's runs in figures.

    Attributes:
        values: by run and by measure's name; NaN where it is not defined, +inf where the event
            never occurred.
        curves: by run ``(c,)`` float64, the hypervolume at each point of the run's curve.
        scale: of the objectives, the same for all these runs.
        reference: ``(k, m)`` float64, the front of all runs together, as objectives in [0, 1].
    """

    values: Mapping[Cell, Mapping[str, float]]
    curves: Mapping[Cell, Float]
    scale: Scale
    reference: Float


def others(records: Mapping[Cell, Record], baseline: str) -> set[str]:
    """Return the algorithms that did not search the same parameters as the baseline.

    If the baseline has no run, the first algorithm that has one replaces it.
    """
    usual = next(iter(records.values())).parameters
    usual = next((r.parameters for cell, r in records.items() if cell.algorithm == baseline), usual)
    return {cell.algorithm for cell, record in records.items() if record.parameters != usual}


def measure(records: Mapping[Cell, Record], budget: int, baseline: str) -> Measured:
    """Measure the runs of one scenario, at least one.

    Bins and differences of parameters are not defined (NaN) for algorithms that search other
    parameters than the baseline, for example an adversary's.
    """
    m = len(next(iter(records.values())).terms)
    ranges = [(record.low, record.high) for record in records.values()]
    known = [(low, high) for low, high in ranges if low is not None and high is not None]
    # Scaled by what all runs met, not by the metrics' caps: d_min's is 200 m where S4 knows 33, and
    # v_d has none on the critical side.
    scale = Scale.pooled(known, m)
    final = {cell: scale.objectives(record.fronts[-1]) for cell, record in records.items()}
    reference = front(np.concatenate(list(final.values())))
    curves = {cell: _curve(record, scale) for cell, record in records.items()}
    k = waited_for(budget)
    reached = {cell: record.reached[k] for cell, record in records.items()}
    seconds = {cell: record.seconds_reached[k] for cell, record in records.items()}
    relative, relative_seconds = _by_the_best(reached), _by_the_best(seconds)
    strange = others(records, baseline)
    values = {
        cell: {
            "r_critic": record.critical / record.evaluations
            if record.evaluations
            else float("nan"),
            "t_critic": relative[cell],
            **{f"to_{n}": count for n, count in record.reached.items()},
            "modes": float(len(record.modes)),
            **{f"to_{n}_modes": count for n, count in record.modes_reached.items()},
            # Bins and distances of other parameters (an adversary's decisions) cannot be
            # compared.
            **(
                dict.fromkeys(_in_parameters(record), float("nan"))
                if cell.algorithm in strange
                else _in_parameters(record)
            ),
            "covered": _covered(cell, records),
            "hypervolume": float(curves[cell][-1]),
            "gd": generational_distance(final[cell], reference),
            "spread": spread(final[cell], reference),
            "t_critic_seconds": relative_seconds[cell],
            f"seconds_to_{k}": seconds[cell],
            "seconds": record.seconds,
        }
        for cell, record in records.items()
    }
    return Measured(values, curves, scale, reference)


def _covered(cell: Cell, records: Mapping[Cell, Record]) -> float:
    """Return the share of critical random scenarios whose conflict a run found: `of_found`.

    The random scenarios are those of random search with other seeds; NaN without any.
    """
    drawn = [
        mode
        for other, record in records.items()
        if other.algorithm == RANDOM and other.seed != cell.seed
        for mode in record.modes.elements()
    ]
    known = of_found(records[cell].modes, drawn)
    return known[0] / known[1] if known else float("nan")


def _in_parameters(record: Record) -> dict[str, float]:
    return {
        "distinct": float(record.distinct),
        **{f"to_{n}_distinct": count for n, count in record.distinct_reached.items()},
        "critical_bins": float(record.critical_bins),
        "critical_pairs": float(record.critical_pairs),
    }


def _curve(record: Record, scale: Scale) -> Float:
    """Return the hypervolume at each point; an unchanged front is not measured again."""
    volumes, last = [], None
    for array in record.fronts:
        if last is None or array is not last:
            volume = hypervolume(scale.objectives(array))
        last = array
        volumes.append(volume)
    return np.array(volumes)


def _by_the_best(reached: Mapping[Cell, float]) -> dict[Cell, float]:
    """Divide by the least median of all algorithms; NaN where all of them are +inf."""
    algorithms: dict[str, list[float]] = {}
    for cell, count in reached.items():
        algorithms.setdefault(cell.algorithm, []).append(count)
    best = min(quartiles(np.array(counts)).median for counts in algorithms.values())
    if not 0.0 < best < float("inf"):
        return dict.fromkeys(reached, float("nan"))
    return {cell: count / best for cell, count in reached.items()}
