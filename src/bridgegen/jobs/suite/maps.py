"""Preventability maps of a suite's scenarios: the egos beside the regulation's models."""

import hashlib
import json
from pathlib import Path
from typing import Any

import numpy as np

from bridgegen.base.errors import ScenarioError
from bridgegen.drivers.identity import digest_of
from bridgegen.jobs.frame import JobCallbacks
from bridgegen.jobs.preventability.classes import CellClass
from bridgegen.jobs.preventability.grid import coarse_axes
from bridgegen.jobs.preventability.page import COLOURS, data_uri
from bridgegen.jobs.preventability.preventability import map_preventability
from bridgegen.jobs.preventability.result import PreventabilityMap
from bridgegen.jobs.search.scenarios import driven_by, load, within
from bridgegen.jobs.suite.suite import SuiteRun
from bridgegen.openx.openscenario.tier4 import is_storyboard
from bridgegen.scenario.language.scenario import LogicalScenario

MOST_CELLS = 20_000
"""Largest number of cells of a map."""

BESIDE = ("un-r157", "fsm", "computed:rss", "reference")
"""The drivers that a map compares the egos with."""

COLUMNS = 3
"""Number of pictures of each driver in the suite's page."""

FOLDER = "maps"


def map_suite(
    suite: SuiteRun, callbacks: JobCallbacks | None = None
) -> tuple[PreventabilityMap, ...]:
    """Map each scenario of a suite that has a grid of its own, with all egos.

    The maps lie in the suite's folder, and resume as it does.

    Args:
        suite: finished.
        callbacks: called as maps progress.

    Raises:
        StorageError: a map cannot be written.
        Interrupted: Ctrl-C; what is done is kept.
    """
    found = []
    for name in dict.fromkeys(job.entry.scenario for job in suite.jobs if not job.entry.problem):
        if is_storyboard(name):
            continue
        others = suite.settings["others"]
        odd = suite.settings.get("odd")
        try:
            scenario = within(driven_by(load(name), others), odd)
        except ScenarioError:
            continue  # outside the ODD, as its entry says
        assert isinstance(scenario, LogicalScenario)
        axes = coarse_axes(scenario.name, scenario.space(), MOST_CELLS)
        if axes is None:
            continue
        egos = dict.fromkeys([ego or scenario.driver for ego in suite.egos] + list(BESIDE))
        found.append(
            map_preventability(
                name,
                list(egos),
                grid=axes,
                others=others,
                odd=odd,
                out=suite.folder / FOLDER / _folder(scenario, list(egos)),
                callbacks=callbacks or JobCallbacks(),
            )
        )
    return tuple(found)


def _folder(scenario: LogicalScenario, egos: list[str]) -> str:
    """Return a folder's name, another one where a map would be another."""
    settings = [scenario.fingerprint, {ego: digest_of(ego) or None for ego in egos}]
    digest = hashlib.sha256(json.dumps(settings).encode()).hexdigest()
    return f"{scenario.name}-{digest[:8]}"


def picture_payload(preventability_map: PreventabilityMap, folder: Path) -> dict[str, Any]:
    """Return what the suite's page shows of a map, as plain data.

    Args:
        preventability_map: the map.
        folder: of the page.
    """
    grid = preventability_map.grid
    third = grid.values[2] if len(grid.shape) > 2 else np.zeros(1)
    columns = sorted({round(i) for i in np.linspace(0, len(third) - 1, COLUMNS).tolist()})
    labels = [f"{grid.names[2]} {third[k]:.3g} {grid.units[2]}" for k in columns]
    further = (-1,) * max(0, len(grid.shape) - 3)  # the last values, the highest speeds say
    return {
        "title": preventability_map.scenario.title,
        "page": preventability_map.page.relative_to(folder).as_posix(),
        "axes": [
            f"{name} {values[0]:.3g} to {values[-1]:.3g} {unit}"
            for name, values, unit in zip(grid.names[:2], grid.values, grid.units, strict=False)
        ],
        "held": [
            f"{name} {values[-1]:.3g} {unit}"
            for name, values, unit in zip(
                grid.names[3:], grid.values[3:], grid.units[3:], strict=True
            )
        ],
        "columns": labels,
        "classes": [[class_.label, COLOURS[class_]] for class_ in CellClass],
        "drivers": [
            {
                "name": name,
                "counts": list(preventability_map.counts(name).values()),
                "pictures": [
                    data_uri(
                        preventability_map.classes[name][(slice(None), slice(None), k, *further)].T[
                            ::-1
                        ]
                    )
                    for k in columns
                ],
            }
            for name in preventability_map.drivers
        ],
    }
