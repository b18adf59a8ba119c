"""Mined scenarios as files, and as individuals of the ontology."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict
from pathlib import Path

import numpy as np

from bridgegen.base.disk import write_whole
from bridgegen.base.errors import StorageError
from bridgegen.openx.openscenario.exposure import distribution_xml
from bridgegen.recordings.events.find import FoundEvents
from bridgegen.recordings.events.of_scenarios import ScenarioEvents, Sought
from bridgegen.recordings.events.tables import FOLDER as EVENTS
from bridgegen.recordings.scenarios.draft import mined_name
from bridgegen.recordings.scenarios.mined import MinedScenario, Unmade, mined_scenario
from bridgegen.recordings.scenarios.ranges import held_in_words
from bridgegen.scenario.ontology.builder import Builder
from bridgegen.scenario.ontology.files import save
from bridgegen.scenario.ontology.graph import Individuals

# --- Mined scenarios and their statistics as individuals of the ontology ---


FILE = "mined.owl"
QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95)
"""Quantiles of the fitted values that are stated."""


def mined_individuals(mined: Sequence[MinedScenario]) -> Individuals:
    """Return an individual for each scenario, and for each of its statistics."""
    builder = Builder("mined", {})
    for scenario in mined:
        node = builder.node(scenario.name, "MinedScenario")
        builder.put(node, "has_name", scenario.name)
        for number, (name, unit, value) in enumerate(_statistics(scenario), 1):
            statistic = builder.node(f"{scenario.name}_{number}", "Statistic")
            builder.put(statistic, "has_name", name)
            builder.put(statistic, "has_measured_unit", unit)
            builder.put(statistic, "has_estimate", value)
            builder.put(node, "has_statistic", statistic)
    return Individuals(builder.quads)


def _statistics(scenario: MinedScenario) -> Iterator[tuple[str, str, float]]:
    """Yield name, unit and value of all that sums up a scenario's events."""
    yield "events fitted" if scenario.fit else "events", "count", float(scenario.events)
    met = scenario.met
    if met is not None:
        yield "encounters", "count", float(met.count)
        for name, unit, amount, rate in (
            ("hours", "h", met.hours, met.per_hour),
            ("kilometres", "km", met.km, met.per_km),
        ):
            if amount is not None and rate is not None:
                yield name, unit, amount
                yield f"encounters per {unit}", f"1/{unit}", rate.estimate
                yield f"encounters per {unit}, 2.5 %", f"1/{unit}", rate.low
                yield f"encounters per {unit}, 97.5 %", f"1/{unit}", rate.high
    for each in scenario.ranges:
        yield f"{each.parameter}, low", each.unit, each.mined.low
        yield f"{each.parameter}, high", each.unit, each.mined.high
        if scenario.fit is None:
            continue
        values = scenario.fit.parameters[each.parameter].values
        yield f"{each.parameter}, mean", each.unit, float(values.mean())
        for share, value in zip(QUANTILES, np.quantile(values, QUANTILES).tolist(), strict=True):
            yield f"{each.parameter}, {share:.0%} quantile", each.unit, value


FOLDER = "scenarios"
ENDINGS = (".yaml", ".html", "-distribution.xosc")
"""Endings of a scenario's files: the scenario, the page of its fit, and the distribution for
OpenSCENARIO."""
DATE = "2025-01-01T00:00:00"
"""Date of all distributions, so that the same recordings give the same bytes."""


def write_mined(
    out: Path,
    sought: Sequence[Sought],
    scenarios: Sequence[ScenarioEvents],
    found: Sequence[FoundEvents],
    time_step: float,
    fitting: Callable[[int, int], None] = lambda done, total: None,
) -> tuple[MinedScenario | Unmade, ...]:
    """Make a scenario of the events of each, and write them in the place of earlier ones.

    Their statistics are individuals in `ONTOLOGY`.

    Args:
        out: the folder of all, with the tables of events.
        sought: the source scenarios.
        scenarios: the events of each.
        found: all events.
        time_step: after cleaning [s].
        fitting: is told how many of how many scenarios are done.

    Raises:
        StorageError: a file cannot be written.
    """
    folder = out / FOLDER
    _emptied(folder, [mined_name(item.scenario) for item in sought])
    made: list[MinedScenario | Unmade] = []
    for number, (item, events) in enumerate(zip(sought, scenarios, strict=True)):
        fitting(number, len(scenarios))
        table = out / EVENTS / f"{events.scenario}.csv"
        result = mined_scenario(item, events, found, table, time_step)
        if isinstance(result, MinedScenario):
            scenario, _, distribution = (folder / f"{result.name}{end}" for end in ENDINGS)
            write_whole(scenario, [result.text.encode()])
            if result.fit is not None:
                write_whole(distribution, [distribution_xml(result.fit.exposure, date=DATE)])
        made.append(result)
    fitting(len(scenarios), len(scenarios))
    if scenarios_made := [item for item in made if isinstance(item, MinedScenario)]:
        save(mined_individuals(scenarios_made), folder / FILE)
    return tuple(made)


def _emptied(folder: Path, names: Sequence[str]) -> None:
    """Make the folder, and remove what an earlier call wrote into it, by the scenarios' names."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for end in ENDINGS:
            for name in names:
                (folder / f"{name}{end}").unlink(missing_ok=True)
        (folder / FILE).unlink(missing_ok=True)
    except OSError as error:
        raise StorageError(f"{folder}: cannot be made: {error.strerror}") from None


# --- Mined scenarios in the terminal, and as plain data ---


def made_row(scenario: MinedScenario) -> tuple[str, int, str, str]:
    """Return what the terminal shows of a scenario."""
    rate = scenario.met.per_hour if scenario.met else None
    beyond = [each.parameter for each in scenario.ranges if each.remark]
    return (
        scenario.name,
        scenario.events,
        rate.in_words("h") if rate else "–",
        ", ".join(beyond) or "–",
    )


def made_as_json(scenario: MinedScenario | Unmade, out: Path) -> dict[str, object]:
    """Return a scenario as plain data, or why there is none."""
    if isinstance(scenario, Unmade):
        return {"of": scenario.source, "scenario": None, "reason": scenario.reason}
    return {
        "of": scenario.source,
        "scenario": str(out / FOLDER / f"{scenario.name}{ENDINGS[0]}"),
        "reason": None,
        "events": scenario.events,
        "holds": None if scenario.fit else held_in_words(scenario.events),
        "encounters": asdict(scenario.met) if scenario.met else None,
        "ranges": [asdict(each) for each in scenario.ranges],
        "tightened": scenario.tightened,
    }
