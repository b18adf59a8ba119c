"""What Table VI says of a method: one number of each run and quantity, then over the seeds."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from bridgegen.base.arrays import Float
from bridgegen.base.statistics import Quartiles, quartiles
from bridgegen.jobs.compare.measures import waited_for
from bridgegen_reproduction.paper import GROUPS
from bridgegen_reproduction.protocol import PRINTED, Protocol
from bridgegen_reproduction.runs import Run, Runs, of


@dataclass(frozen=True)
class Quantity:
    """A row of Table VI.

    Attributes:
        name: in files.
        title: in tables.
        unit: of it; empty for none.
        digits: after the decimal point, as the paper has them.
        groups: of methods that have it.
    """

    name: str
    title: str
    unit: str
    digits: int
    groups: tuple[str, ...] = ("single", "many")


QUANTITIES = (
    Quantity("r_critic", "R_critic", "", 3),
    Quantity("t_critic", "T_critic", "", 3),
    Quantity("avg_d_min", "Avg(d_min)", "m", 2),
    Quantity("median_d_min", "Median(d_min)", "m", 2),
    Quantity("avg_v_d", "Avg(v_d)", "km/h", 2),
    Quantity("median_v_d", "Median(v_d)", "km/h", 2),
    Quantity("avg_fitness", "Avg(fitness)", "", 2, ("single",)),
    Quantity("median_fitness", "Median(fitness)", "", 2, ("single",)),
)
"""Those that are the same every time."""

TIMED = (
    Quantity("t_critic_seconds", "T_critic, of seconds", "", 3),
    Quantity("runtime", "Runtime", "s", 2),
)
"""Those made of seconds, which are not."""

Sample = Mapping[str, Float]
"""By quantity's name ``(n,)`` float64, a value of each run; +inf where what is waited for never
came, NaN where there is none."""


def of_run(run: Run, k: int) -> dict[str, float]:
    """Return a run's own numbers; T_critic is not among them, for it compares with other methods.

    Args:
        run: that has ended.
        k: T_critic waits for the k-th critical scenario.
    """

    def over(values: Float) -> tuple[float, float]:
        known = values[~np.isnan(values)]
        if not len(known):
            return float("nan"), float("nan")
        return float(known.mean()), float(np.median(known))

    found = len(run.hits) >= k
    at = int(run.hits[k - 1]) if found else 0
    numbers = {
        "r_critic": float(run.critical.mean()) if len(run.critical) else float("nan"),
        "evaluations_to_k": float(at) if found else float("inf"),
        "seconds_to_k": float(run.seconds_at[at - 1]) if found else float("inf"),
        "runtime": run.seconds,
    }
    for name in ("d_min", "v_d", "fitness"):
        numbers[f"avg_{name}"], numbers[f"median_{name}"] = over(getattr(run, name))
    return numbers


def sample(runs: Sequence[Run], k: int) -> dict[str, Float]:
    """Return the numbers of several runs by quantity, ``(n,)`` each."""
    each = [of_run(run, k) for run in runs]
    names = list(each[0]) if each else []
    return {name: np.array([record[name] for record in each]) for name in names}


@dataclass(frozen=True)
class Results:
    """Table VI of one scenario.

    Attributes:
        scenario: name.
        samples: by group and algorithm, those with a run only.
        k: T_critic waits for the k-th critical scenario.
    """

    scenario: str
    samples: Mapping[tuple[str, str], Sample]
    k: int

    def values(self, group: str, algorithm: str, quantity: str) -> Float:
        """Return a quantity of every run, ``(n,)``; none where no run of it has ended."""
        found = self.samples.get((group, algorithm), {}).get(quantity)
        return np.empty(0) if found is None else found

    def quartiles(self, group: str, algorithm: str, quantity: str) -> Quartiles:
        """Return a quantity over the seeds."""
        return quartiles(self.values(group, algorithm, quantity))


def results_of(protocol: Protocol, runs: Runs, scenario: str) -> Results:
    """Return the methods' results in a scenario, with the driver of Section V.

    T_critic is a run's number of evaluations until the k-th critical scenario, divided by the
    least median of the group's methods; NaN where no method's median run found as many.
    """
    k = waited_for(protocol.budget)
    samples: dict[tuple[str, str], dict[str, Float]] = {}
    for group, methods in GROUPS.items():
        found = {
            method.algorithm: sample(these, k)
            for method in methods
            if (these := of(runs, PRINTED, scenario, method.algorithm))
        }
        for name, source in (
            ("t_critic", "evaluations_to_k"),
            ("t_critic_seconds", "seconds_to_k"),
        ):
            best = min(
                (quartiles(record[source]).median for record in found.values()),
                default=float("inf"),
            )
            is_defined = 0.0 < best < float("inf")
            for record in found.values():
                record[name] = (
                    record[source] / best if is_defined else np.full(len(record[source]), np.nan)
                )
        samples |= {(group, algorithm): record for algorithm, record in found.items()}
    return Results(scenario, samples, k)
