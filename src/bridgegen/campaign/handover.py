"""The most critical distinct scenarios of a run, each as files that other tools run."""

import json
import shutil
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pyoxigraph as ox

from bridgegen.arrays import Bool, Float, Int
from bridgegen.cause import Cause
from bridgegen.errors import OntologyError, StorageError
from bridgegen.metrics import METRICS
from bridgegen.ontology.check import check
from bridgegen.ontology.files import save
from bridgegen.ontology.graph import Individuals
from bridgegen.ontology.vocabulary import bg
from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.declarations import CAUSE
from bridgegen.openx.openscenario.write import to_xml as scenario_xml
from bridgegen.pipeline import Pipeline
from bridgegen.search.dominance import by_merit
from bridgegen.simulation.outcomes import with_outcomes
from bridgegen.store import Rows

DISTINCT = (0.2, 0.1)
"""Two kept scenarios differ by at least this much: root mean square over the searched parameters,
each scaled to 0..1. The second distance counts where too few differ by the first."""

FOLDER = "critical"


@dataclass(frozen=True)
class Kept:
    """A scenario that was handed over.

    Attributes:
        name: of its files, "0001" the most critical.
        evaluation: its row in the store.
        files: their paths relative to the run's folder.
    """

    name: str
    evaluation: int
    files: tuple[str, ...]


def most_critical(U: Float, F: Float, critical: Bool, keep: int) -> Int:
    """Return the rows of the most critical scenarios that differ from each other, best first.

    Args:
        U: ``(N, n_var)`` unit-cube rows.
        F: ``(N, n_obj)``, minimised; `by_merit` orders them.
        critical: ``(N,)``, only these are kept.
        keep: how many at most.
    """
    order = np.flatnonzero(critical)
    order = order[by_merit(F[order])]
    kept: list[int] = []
    for distance in DISTINCT:
        near = np.zeros(len(order), dtype=bool)
        for row in kept:
            near |= _apart(U[order], U[row]) < distance
        rest = order[~near]
        while len(rest) and len(kept) < keep:
            best = int(rest[0])
            kept.append(best)
            rest = rest[_apart(U[rest], U[best]) >= distance]
    return order[np.isin(order, kept)]


def _apart(U: Float, u: Float) -> Float:
    distance: Float = np.sqrt(((U - u) ** 2).mean(axis=1))
    return distance


def hand_over(
    pipeline: Pipeline,
    rows: Rows,
    folder: Path,
    progress: Callable[[int], None] | None = None,
) -> tuple[Kept, ...]:
    """Write each row's ``.owl``, ``.xodr``, ``.xosc`` and ``.json`` into ``folder/critical``.

    The folder is replaced as a whole, once all of it is written.

    Args:
        pipeline: what evaluated the rows.
        rows: the scenarios, most critical first.
        folder: the run's.
        progress: told after each, how many are written.

    Raises:
        OntologyError: a scenario's individuals break a constraint.
        StorageError: the folder cannot be written.
    """
    target, fresh = folder / FOLDER, folder / f"{FOLDER}.part"
    names = [f"{rank:04d}" for rank in range(1, len(rows) + 1)]
    kept = []
    try:
        shutil.rmtree(fresh, ignore_errors=True)
        fresh.mkdir()
        for i, name in enumerate(names):
            files = write_scenario(pipeline, rows.X[i], fresh, name, Cause(rows.cause[i]))
            files.append(fresh / f"{name}.json")
            files[-1].write_text(_facts(pipeline, rows, i, name), encoding="utf-8")
            paths = tuple(f"{FOLDER}/{file.name}" for file in files)
            kept.append(Kept(name, int(rows.id[i]), paths))
            if progress:
                progress(i + 1)
        shutil.rmtree(target, ignore_errors=True)
        fresh.rename(target)
    except OSError as error:
        raise StorageError(
            f"{target}: cannot be written: {error.strerror}; the evaluations are kept, "
            f"'bridgegen resume {folder}' writes the files"
        ) from None
    return tuple(kept)


def handed_over(folder: Path) -> tuple[Kept, ...]:
    """Return what a run has handed over, most critical first; nothing before it has.

    Args:
        folder: the run's.

    Raises:
        StorageError: a scenario's ``.json`` is not what was written.
    """
    kept = []
    for path in sorted((folder / FOLDER).glob("*.json")):
        try:
            evaluation = int(json.loads(path.read_text(encoding="utf-8"))["evaluation"])
        except (OSError, ValueError, KeyError, TypeError) as error:
            raise StorageError(
                f"{path}: is not what was handed over: {error}; "
                f"'bridgegen resume {folder}' writes the files again"
            ) from None
        files = (path.with_suffix(f".{kind}") for kind in ("owl", "xodr", "xosc", "json"))
        names = tuple(f"{FOLDER}/{file.name}" for file in files if file.is_file())
        kept.append(Kept(path.stem, evaluation, names))
    return tuple(kept)


def write_scenario(
    pipeline: Pipeline, x: Float, folder: Path, name: str, cause: Cause = Cause.NONE
) -> list[Path]:
    """Write one row as ``name.owl``, ``name.xodr`` and ``name.xosc``; return their paths.

    The ontology also holds what the scenario's rollout brought about (``has_outcome``) and the
    cause of it, if it is known (``has_cause``); so does the header of the storyboard.

    Raises:
        OntologyError: its individuals break a constraint (SHACL).
        OSError: the folder cannot be written.
    """
    owl, xodr, xosc = (folder / f"{name}.{kind}" for kind in ("owl", "xodr", "xosc"))
    concrete = pipeline.concrete(x, xodr.name)
    rollout = pipeline.rollout(x[np.newaxis])
    xodr.write_bytes(concrete.road_data)
    xosc.write_bytes(scenario_xml(_caused(concrete.storyboard, cause)))
    if concrete.individuals is None:
        return [xodr, xosc]
    individuals = with_outcomes(concrete.individuals, rollout, concrete.roads)
    if cause:
        individuals = _with_cause(individuals, cause)
    violations = check(individuals, pipeline.source.constraints)
    if violations:
        raise OntologyError(*(f"{name}.owl: {violation}" for violation in violations))
    save(individuals, owl)
    return [owl, xodr, xosc]


def _caused(storyboard: osc.OpenScenario, cause: Cause) -> osc.OpenScenario:
    """Return a scenario whose header says its cause, from version 1.2 on: earlier ones cannot."""
    header = storyboard.file_header
    if not cause or header.rev_minor in (0, 1):
        return storyboard
    said = header.properties or osc.Properties()
    others = tuple(one for one in said.properties if one.name != CAUSE)
    properties = replace(said, properties=(*others, osc.Property(CAUSE, cause.label)))
    return replace(storyboard, file_header=replace(header, properties=properties))


def _with_cause(individuals: Individuals, cause: Cause) -> Individuals:
    scenario = individuals.one("Scenario")
    quad = ox.Quad(scenario, bg("has_cause"), ox.Literal(cause.label))
    return Individuals([*individuals.quads, quad])


def _facts(pipeline: Pipeline, rows: Rows, i: int, name: str) -> str:
    """Return one scenario's parameters and metrics as JSON; what is infinite or NaN is null."""
    units = dict(zip(pipeline.space.names, pipeline.space.units, strict=True))
    facts = {
        "name": name,
        "evaluation": int(rows.id[i]),
        "scenario": pipeline.scenario.name,
        "ego": pipeline.driver.label,
        "critical": bool(rows.critical[i]),
        "cause": Cause(rows.cause[i]).label or None,
        "parameters": _named(pipeline.facts(rows.X[i]), units),
        "metrics": _named(
            dict(zip(pipeline.metrics, rows.metrics[i].tolist(), strict=True)),
            {name: METRICS[name].unit for name in pipeline.metrics},
        ),
        "F": rows.F[i].tolist(),
    }
    return json.dumps(facts, indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def _named(
    values: Mapping[str, float], units: Mapping[str, str]
) -> dict[str, dict[str, float | str | None]]:
    return {
        name: {"value": value if np.isfinite(value) else None, "unit": units[name]}
        for name, value in values.items()
    }
