"""The files of mined scenarios, in a folder of their own."""

from collections.abc import Callable, Sequence
from pathlib import Path

from bridgegen.base.disk import write_whole
from bridgegen.base.errors import StorageError
from bridgegen.openx.openscenario.exposure import distribution_xml
from bridgegen.recordings.events.find import FoundEvents
from bridgegen.recordings.events.of_scenarios import ScenarioEvents, Sought
from bridgegen.recordings.events.tables import FOLDER as EVENTS
from bridgegen.recordings.scenarios.draft import mined_name
from bridgegen.recordings.scenarios.mined import MinedScenario, Unmade, mined_scenario
from bridgegen.recordings.scenarios.ontology import FILE as ONTOLOGY
from bridgegen.recordings.scenarios.ontology import mined_individuals
from bridgegen.scenario.exposure.page import write_page
from bridgegen.scenario.ontology.files import save

FOLDER = "scenarios"
ENDINGS = (".yaml", ".html", "-distribution.xosc")
"""Of a scenario's files: it, the page of its fit, and the distribution for OpenSCENARIO."""
DATE = "2025-01-01T00:00:00"
"""Of all distributions, so that the same recordings give the same bytes."""


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
    _emptied(folder, [mined_name(one.scenario) for one in sought])
    made: list[MinedScenario | Unmade] = []
    for number, (one, events) in enumerate(zip(sought, scenarios, strict=True)):
        fitting(number, len(scenarios))
        table = out / EVENTS / f"{events.scenario}.csv"
        result = mined_scenario(one, events, found, table, time_step)
        if isinstance(result, MinedScenario):
            scenario, page, distribution = (folder / f"{result.name}{end}" for end in ENDINGS)
            write_whole(scenario, [result.text.encode()])
            write_page(page, result.fit)
            write_whole(distribution, [distribution_xml(result.fit.exposure, date=DATE)])
        made.append(result)
    fitting(len(scenarios), len(scenarios))
    if scenarios_made := [one for one in made if isinstance(one, MinedScenario)]:
        save(mined_individuals(scenarios_made), folder / ONTOLOGY)
    return tuple(made)


def _emptied(folder: Path, names: Sequence[str]) -> None:
    """Make the folder, and remove what an earlier call wrote into it, by the scenarios' names."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for end in ENDINGS:
            for name in names:
                (folder / f"{name}{end}").unlink(missing_ok=True)
        (folder / ONTOLOGY).unlink(missing_ok=True)
    except OSError as error:
        raise StorageError(f"{folder}: cannot be made: {error.strerror}") from None
