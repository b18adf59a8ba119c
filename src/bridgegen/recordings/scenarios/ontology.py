"""Mined scenarios and their statistics as individuals of the ontology."""

from collections.abc import Iterator, Sequence

import numpy as np

from bridgegen.recordings.scenarios.mined import MinedScenario
from bridgegen.scenario.ontology.builder import Builder
from bridgegen.scenario.ontology.graph import Individuals

FILE = "mined.owl"
QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95)
"""Of the values that were fitted."""


def mined_individuals(mined: Sequence[MinedScenario]) -> Individuals:
    """Return an individual for each scenario, and for each of its statistics."""
    builder = Builder("mined", {})
    for one in mined:
        node = builder.node(one.name, "MinedScenario")
        builder.put(node, "has_name", one.name)
        for number, (name, unit, value) in enumerate(_statistics(one), 1):
            statistic = builder.node(f"{one.name}_{number}", "Statistic")
            builder.put(statistic, "has_name", name)
            builder.put(statistic, "has_measured_unit", unit)
            builder.put(statistic, "has_estimate", value)
            builder.put(node, "has_statistic", statistic)
    return Individuals(builder.quads)


def _statistics(one: MinedScenario) -> Iterator[tuple[str, str, float]]:
    """Yield name, unit and value of all that sums up a scenario's events."""
    yield "events fitted", "count", float(one.fit.used)
    met = one.fit.exposure.encounters
    if met is not None:
        yield "encounters", "count", float(met.count)
        for name, unit, amount, rate in (
            ("hours", "h", met.hours, met.per_hour), ("kilometres", "km", met.km, met.per_km),
        ):  # fmt: skip
            if amount is not None and rate is not None:
                yield name, unit, amount
                yield f"encounters per {unit}", f"1/{unit}", rate.estimate
                yield f"encounters per {unit}, 2.5 %", f"1/{unit}", rate.low
                yield f"encounters per {unit}, 97.5 %", f"1/{unit}", rate.high
    for each in one.ranges:
        values = one.fit.parameters[each.parameter].values
        yield f"{each.parameter}, low", each.unit, each.mined.low
        yield f"{each.parameter}, high", each.unit, each.mined.high
        yield f"{each.parameter}, mean", each.unit, float(values.mean())
        for share, value in zip(QUANTILES, np.quantile(values, QUANTILES).tolist(), strict=True):
            yield f"{each.parameter}, {share:.0%} quantile", each.unit, value
