"""The critical regions of a run on disk, verified with its own scenario, ego and objective."""

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from bridgegen.base.arrays import Bool, Float
from bridgegen.base.disk import write_whole
from bridgegen.base.errors import InputError
from bridgegen.engine.pipeline import Pipeline
from bridgegen.engine.workers import Choice, open_workers
from bridgegen.jobs.search.report import rewrite_report
from bridgegen.jobs.search.restored import pipeline_of, searched
from bridgegen.jobs.search.run import Run
from bridgegen.scenario.exposure import Exposure
from bridgegen.scenario.exposure.reader import chosen_exposure, rows_on_the_road
from bridgegen.scenario.language.space import SearchSpace
from bridgegen.scenario.ontology.files import save
from bridgegen.search.regions.box import Evidence
from bridgegen.search.regions.find import AT_LEAST, SAMPLES, Found, Region, check, find_regions
from bridgegen.search.regions.owl import carriers, classes, statable
from bridgegen.search.regions.record import JSON_FILE, to_json
from bridgegen.simulation.choice import SimulatorChoice

OWL_FILE = "regions.owl"
MAX_SEED = 2**32 - 1


@dataclass(frozen=True, eq=False)
class RunRegions:
    """The critical regions of a run.

    Attributes:
        folder: the run's.
        space: what was searched.
        found: the regions.
        record: how they were found, and their figures, as JSON's types.
        files: those that were written.
        unstated: confirmed regions that the ontology cannot state, for it does not carry a
            parameter that they name.
    """

    folder: Path
    space: SearchSpace
    found: Found
    record: Mapping[str, Any]
    files: tuple[Path, ...]
    unstated: tuple[Region, ...]


def regions_of(
    folder: Path | str,
    *,
    ego: str | None = None,
    worse_than: str | None = None,
    metrics: Sequence[str] | None = None,
    simulator: SimulatorChoice | None = None,
    samples: int = SAMPLES,
    at_least: float = AT_LEAST,
    seed: int | None = None,
    exposure: str | Path | Exposure | None = None,
    workers: Choice = None,
    stage: Callable[[str], None] | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> RunRegions:
    """Find and verify the critical regions of a run, finished or not; write them beside it.

    ``regions.json`` has all of them, ``regions.owl`` a class for each that is confirmed. A
    report that exists is written again, with the regions.

    Args:
        folder: of the run.
        ego: where a driver of your own drives, that same driver.
        worse_than: likewise, the driver that the ego's is compared with.
        metrics: likewise, those of your own.
        simulator: the run's, with its place on this machine; as recorded by default.
        samples: fresh scenarios to simulate in each region.
        at_least: the share of critical scenarios that makes a region critical.
        seed: of the fresh scenarios; the run's by default.
        exposure: how parameters are distributed on the road, see `chosen_exposure`; the record then
            says how likely it is to meet the regions.
        workers: simulate, see ``run_search``; the results do not depend on them.
        stage: called as a stage begins: "compile", "regions", "report".
        progress: called with the number of fresh scenarios simulated, and of all.

    Raises:
        StorageError: not a run, its scenario or map is not what it was, or not writable.
        WorkersError: there are no workers, or they are lost.
        InputError: a number out of range, no critical row, the scenario or the map is missing, or
            the ego has to be named.
    """
    stage = stage or (lambda name: None)
    if seed is not None and not 0 <= seed <= MAX_SEED:
        raise InputError(f"0 <= seed <= {MAX_SEED} must hold, got {seed}")
    run = Run(folder)
    met = chosen_exposure(searched(run)[0], exposure)
    rows, settings, place = run.rows(), run.settings, run.folder
    with open_workers(workers) as pool:
        pipeline = pipeline_of(
            run,
            "analyse regions",
            ego=ego,
            worse_than=worse_than,
            metrics=metrics or (),
            compares=True,
            simulator=simulator,
            workers=pool,
        )
        space, ok = pipeline.space, rows.status == 0
        check(space, rows.critical[ok], samples, at_least)
        stage("compile")
        pipeline.warm_up()
        stage("regions")
        seed = settings.seed if seed is None else seed
        found = find_regions(
            space,
            pipeline.evaluate,
            rows.X[ok],
            rows.critical[ok],
            samples=samples,
            at_least=at_least,
            seed=seed,
            progress=progress,
        )
    driver = pipeline.driver.label
    record: dict[str, Any] = {
        "run": str(place),
        "scenario": space.name,
        "ego": driver,
        "cause": settings.cause,
        "algorithm": settings.algorithm,
        "evaluations": len(rows),
        "finished": run.finished,
        "samples": samples,
        "at_least": at_least,
        "seed": seed,
        **to_json(found, space, driver),
    }
    if met is not None:
        record["exposure"] = met.source
        _add_exposure(record, found, rows_on_the_road(met, space), space)
    text = json.dumps(record, indent=2, ensure_ascii=False, allow_nan=False) + "\n"
    write_whole(place / JSON_FILE, [text.encode()])
    origin = f"{len(rows)} evaluations of {settings.algorithm} with seed {settings.seed}"
    stated = _state(pipeline, found, place / OWL_FILE, origin)
    files = [place / JSON_FILE, *([place / OWL_FILE] if stated else [])]
    files += rewrite_report(run, pipeline, stage)
    return RunRegions(
        place,
        space,
        found,
        record,
        files=tuple(files),
        unstated=tuple(region for region in found.confirmed if region not in stated),
    )


def _add_exposure(record: dict[str, Any], found: Found, X: Float, space: SearchSpace) -> None:
    """Add how likely it is to meet each region, and any confirmed one, with 95 % intervals.

    Args:
        record: of the regions.
        found: they.
        X: ``(n, len(space.names))``, what is met on the road.
        space: what was searched.
    """
    columns = X[:, [space.index(name) for name in space.variables]]
    anywhere = np.zeros(len(X), np.bool_)
    for told, region in zip(record["regions"], found.regions, strict=True):
        inside = region.box.holds(columns)
        told["exposure"] = _share_of(inside)
        anywhere |= inside & region.confirmed
    record["exposure_share"] = _share_of(anywhere)


def _share_of(inside: Bool) -> dict[str, Any]:
    met = Evidence(len(inside), int(inside.sum()))
    return {"share": met.share, "interval": list(met.interval)}


def _state(pipeline: Pipeline, found: Found, path: Path, origin: str) -> list[Region]:
    """Write a class for each confirmed region that the ontology can state; return these regions."""
    space = pipeline.space
    # Any row would do; in this one no two parameters have the same value.
    x = space.decode(np.random.default_rng(0).random((1, space.n_var)))[0]
    individuals = pipeline.runner.concrete(x).individuals if found.confirmed else None
    carried = (
        {} if individuals is None else carriers(individuals, space.values(x), space.parameters)
    )
    stated = {
        number: region
        for number, region in enumerate(found.confirmed, start=1)
        if individuals is not None and statable(region, space, carried)
    }
    if stated:
        driver = pipeline.driver.label
        save(classes(stated, space, carried, driver=driver, origin=origin), path)
    else:
        path.unlink(missing_ok=True)  # an earlier one would state regions that were not found now
    return list(stated.values())
