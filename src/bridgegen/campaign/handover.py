"""The most critical distinct scenarios of a run, each as files that other tools run."""

import json
import shutil
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Annotated, TypeVar

import numpy as np
import pyoxigraph as ox
from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError

from bridgegen.arrays import Bool, Float, Int
from bridgegen.cause import Cause
from bridgegen.conflict import quantities
from bridgegen.conflict.analysis import analyse
from bridgegen.conflict.outcomes import with_outcomes
from bridgegen.conflict.quantities import QUANTITIES
from bridgegen.conflict.summary import ConflictSummary, summarise
from bridgegen.errors import OntologyError, StorageError
from bridgegen.ontology.check import check
from bridgegen.ontology.files import save
from bridgegen.ontology.graph import Individuals
from bridgegen.ontology.vocabulary import bg
from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.declarations import (
    CAUSE,
    CONFLICT_TYPE,
    DRIVER,
    NOISE_KEY,
    RESPONSIBLE,
    SEVERITY,
)
from bridgegen.openx.openscenario.from_owl.notes import FINDINGS
from bridgegen.openx.openscenario.values import format_double
from bridgegen.openx.openscenario.write import to_xml as scenario_xml
from bridgegen.pipeline import Pipeline
from bridgegen.records import parse_json, read_bytes
from bridgegen.search.dominance import by_merit
from bridgegen.simulation.rollout import Rollout
from bridgegen.store import Rows
from bridgegen.triage.distinct import distinct
from bridgegen.triage.record import Minimal, Mode, Neighbourhood, Triage

_Read = TypeVar("_Read", bound=BaseModel)

FOLDER = "critical"
MINIMAL = "minimal-"
"""How the files of minimal scenarios are called, in the same folder."""

NOT_EXPORTED = "not-exported.json"
"""The file of a run's folder that names the scenarios whose export was refused; none without."""


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


@dataclass(frozen=True)
class Refused:
    """A scenario that could not be exported.

    Attributes:
        name: that its files would have.
        evaluation: its row in the store.
        problems: why not.
    """

    name: str
    evaluation: Annotated[int, Field(ge=0)]
    problems: tuple[str, ...]


_REFUSED = TypeAdapter(list[Refused])


class Quantity(BaseModel):
    """A value in a scenario's ``.json``: None is infinite or NaN."""

    model_config = ConfigDict(allow_inf_nan=False)

    value: float | None
    unit: str


class ParameterValue(BaseModel):
    """A parameter's value in a scenario's ``.json``: a number, or the name of a category's."""

    model_config = ConfigDict(allow_inf_nan=False)

    value: float | Annotated[str, Field(max_length=1000)] | None
    unit: str


class _Handed(BaseModel):
    """Which evaluation a scenario's ``.json`` is of."""

    evaluation: Annotated[int, Field(ge=0)]


class Facts(_Handed):
    """What a scenario's ``.json`` says, as far as a verdict needs it; see `_facts`."""

    parameters: dict[str, ParameterValue]
    metrics: dict[str, Quantity]
    cause: str | None
    quick_cause: str | None = None
    mode: int | None = None
    robustness: Annotated[float, Field(ge=0.0, le=1.0)] | None = None


def read_facts(path: Path) -> Facts:
    """Return what the ``.json`` of a scenario says.

    Raises:
        StorageError: it is not what was written.
    """
    return _read(path, Facts)


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
    kept = distinct(U, order, keep)
    return order[np.isin(order, kept)]


def hand_over(
    pipeline: Pipeline,
    rows: Rows,
    folder: Path,
    progress: Callable[[int], None] | None = None,
    found: Triage | None = None,
) -> tuple[Kept, ...]:
    """Write each row's ``.owl``, ``.xodr``, ``.xosc`` and ``.json`` into ``folder/critical``.

    The folder is replaced as a whole, once all of it is written. A scenario whose individuals break
    a rule is left out, and named in ``NOT_EXPORTED``; see `not_exported`. Minimal scenarios of the
    failure modes are written beside them, as ``minimal-01.*`` and so on.

    Args:
        pipeline: what evaluated the rows.
        rows: the scenarios, most critical first.
        folder: the run's.
        progress: told after each row, how many are written.
        found: the run's triage, if there is one.

    Raises:
        StorageError: the folder cannot be written.
    """
    target, fresh = folder / FOLDER, folder / f"{FOLDER}.part"
    names = [f"{rank:04d}" for rank in range(1, len(rows) + 1)]
    kept, refused = [], []
    try:
        shutil.rmtree(fresh, ignore_errors=True)
        fresh.mkdir()
        for i, name in enumerate(names):
            tested = found.neighbourhood(int(rows.id[i])) if found else None
            if pipeline.cause is not None:  # the run asked for the quick one
                tested = tested.model_copy(update={"cause": ""}) if tested else None
            cause = _cause(Cause(rows.cause[i]), tested)
            rollout = pipeline.rollout(rows.X[i][np.newaxis])
            conflict = summarise(analyse(rollout), 0, pipeline.objective.count)
            try:
                files = write_scenario(
                    pipeline, rows.X[i], fresh, name, cause, rollout=rollout, found=conflict
                )
            except OntologyError as error:
                refused.append(Refused(name, int(rows.id[i]), error.problems))
                continue
            files.append(fresh / f"{name}.json")
            facts = (
                _facts(pipeline, rows, i, name)
                | _tested(name, Cause(rows.cause[i]), tested, found)
                | {"conflict": None if conflict is None else conflict.to_dict()}
            )
            files[-1].write_text(_json(facts), encoding="utf-8")
            paths = tuple(f"{FOLDER}/{file.name}" for file in files)
            kept.append(Kept(name, int(rows.id[i]), paths))
            if progress:
                progress(i + 1)
        for mode in found.modes if found else ():
            if mode.minimal is not None:
                try:
                    _write_minimal(pipeline, mode, mode.minimal, fresh)
                except OntologyError as error:
                    refused.append(Refused(mode.minimal.name, mode.worst, error.problems))
        shutil.rmtree(target, ignore_errors=True)
        fresh.rename(target)
        _name_refused(refused, folder / NOT_EXPORTED)
    except OSError as error:
        raise StorageError(
            f"{target}: cannot be written: {error.strerror}; the evaluations are kept, "
            f"'bridgegen resume {folder}' writes the files"
        ) from None
    return tuple(kept)


def _name_refused(refused: list[Refused], path: Path) -> None:
    """Write which scenarios were refused, and why; no file where none was."""
    if not refused:
        path.unlink(missing_ok=True)
        return
    said = [asdict(one) for one in refused]
    path.write_text(json.dumps(said, indent=2, ensure_ascii=False) + "\n", encoding="utf-8")


def not_exported(folder: Path) -> tuple[Refused, ...]:
    """Return the critical scenarios of a run that could not be exported, most critical first.

    Args:
        folder: the run's.

    Raises:
        StorageError: the file that names them is not what was written.
    """
    path = folder / NOT_EXPORTED
    try:
        data = read_bytes(path)
        parse_json(data)
        return tuple(_REFUSED.validate_json(data, strict=True))
    except FileNotFoundError:
        return ()
    except (OSError, ValueError) as error:
        raise StorageError(
            f"{path}: is not what was written: {_why(error)}; 'bridgegen resume {folder}' writes "
            "it again"
        ) from None


def handed_over(folder: Path, evaluations: int | None = None) -> tuple[Kept, ...]:
    """Return what a run has handed over, most critical first; nothing before it has.

    Args:
        folder: the run's.
        evaluations: how many the run has, if known; no exported scenario may be of another one.

    Raises:
        StorageError: a scenario's ``.json`` is not what was written.
    """
    kept = []
    for path in sorted((folder / FOLDER).glob("[0-9]*.json")):
        evaluation = _read(path, _Handed).evaluation
        if evaluations is not None and evaluation >= evaluations:
            raise _not_written(path, f"the run has no evaluation {evaluation}")
        files = (path.with_suffix(f".{kind}") for kind in ("owl", "xodr", "xosc", "json"))
        names = tuple(f"{FOLDER}/{file.name}" for file in files if file.is_file())
        kept.append(Kept(path.stem, evaluation, names))
    return tuple(kept)


def _read(path: Path, model: type[_Read]) -> _Read:
    try:
        data = read_bytes(path)
        parse_json(data)
        return model.model_validate_json(data, strict=True)
    except (OSError, ValueError) as error:
        raise _not_written(path, _why(error)) from None


def _not_written(path: Path, why: str) -> StorageError:
    run = path.parent.parent
    return StorageError(
        f"{path}: is not what was handed over: {why}; 'bridgegen resume {run}' writes the files "
        "again"
    )


def _why(error: OSError | ValueError) -> str:
    """Return what is wrong with a record, in one line."""
    if isinstance(error, ValidationError):
        first = error.errors(include_input=False, include_url=False)[0]
        return f"{'.'.join(map(str, first['loc']))}: {first['msg']}"
    return str(error)


def write_scenario(
    pipeline: Pipeline,
    x: Float,
    folder: Path,
    name: str,
    cause: Cause = Cause.NONE,
    *,
    rollout: Rollout | None = None,
    noise: str | None = None,
    found: ConflictSummary | None = None,
) -> list[Path]:
    """Write one row as ``name.owl``, ``name.xodr`` and ``name.xosc``; return their paths.

    The ontology also holds the outcomes of the scenario's rollout (``has_outcome``), its cause, if
    it is known (``has_cause``), and type, responsibility and severity of its decisive conflict; the
    last four are in the header of the storyboard, too.

    Args:
        pipeline: what evaluated the row.
        x: ``(len(space.names),)``.
        folder: that is there.
        name: of the files.
        cause: of its harm, if it is known.
        rollout: of the row alone; made here if it is not given.
        noise: the key of its random numbers, which the storyboard then states.
        found: its decisive conflict; from the rollout, if that is not given.

    Raises:
        OntologyError: its individuals break a constraint (SHACL).
        OSError: the folder cannot be written.
    """
    owl, xodr, xosc = (folder / f"{name}.{kind}" for kind in ("owl", "xodr", "xosc"))
    concrete = pipeline.concrete(x, xodr.name)
    if rollout is None:
        rollout = pipeline.rollout(x[np.newaxis])
        found = summarise(analyse(rollout))
    individuals = concrete.individuals
    if individuals is not None:
        individuals = with_outcomes(individuals, rollout, concrete.roads)
        individuals = _with_findings(individuals, cause, found)
        violations = check(individuals, pipeline.source.constraints)
        if violations:
            raise OntologyError(*(f"{name}.owl: {violation}" for violation in violations))
    xodr.write_bytes(concrete.road_data)
    storyboard = _explained(concrete.storyboard, cause, found)
    xosc.write_bytes(scenario_xml(keyed(storyboard, noise) if noise else storyboard))
    if individuals is None:
        return [xodr, xosc]
    save(individuals, owl)
    return [owl, xodr, xosc]


def _explained(
    storyboard: osc.OpenScenario, cause: Cause, found: ConflictSummary | None
) -> osc.OpenScenario:
    """Return a scenario whose header says cause and decisive conflict, as far as they are known.

    What a file said of them before was another run's, and is left out. From version 1.2 on: earlier
    headers have no properties.
    """
    header = storyboard.file_header
    stated = {CAUSE: cause.label} if cause else {}
    if found is not None and found.happened:
        stated |= {CONFLICT_TYPE: found.type, RESPONSIBLE: found.responsible}
        stated[SEVERITY] = format_double(found.severity)
    if header.rev_minor in (0, 1):
        return storyboard
    said = header.properties or osc.Properties()
    others = tuple(one for one in said.properties if one.name not in (*FINDINGS, SEVERITY))
    added = tuple(osc.Property(name, value) for name, value in stated.items())
    if (*others, *added) == said.properties:
        return storyboard
    properties = replace(said, properties=(*others, *added))
    return replace(storyboard, file_header=replace(header, properties=properties))


def keyed(scenario: osc.OpenScenario, key: str) -> osc.OpenScenario:
    """Return a scenario that states the key of its driver's random numbers, unless it does."""

    def stated(one: osc.ObjectController) -> osc.ObjectController:
        said = one.controller.properties
        if said is None or said.get(DRIVER) is None or said.get(NOISE_KEY) is not None:
            return one
        properties = replace(said, properties=(*said.properties, osc.Property(NOISE_KEY, key)))
        return replace(one, controller=replace(one.controller, properties=properties))

    objects = tuple(
        replace(one, object_controllers=tuple(stated(each) for each in one.object_controllers))
        for one in scenario.entities.scenario_objects
    )
    return replace(scenario, entities=replace(scenario.entities, scenario_objects=objects))


def _with_findings(
    individuals: Individuals, cause: Cause, found: ConflictSummary | None
) -> Individuals:
    """Return individuals that say cause and decisive conflict, and no longer what a file said."""
    scenario = individuals.one("Scenario")
    values: dict[str, str | float] = {"has_cause": cause.label} if cause else {}
    if found is not None and found.happened:
        values |= {"has_conflict_type": found.type, "has_responsibility": found.responsible}
        values["has_severity"] = found.severity
    terms = {bg(name) for name in (*FINDINGS.values(), "has_severity")}
    others = [
        one for one in individuals.quads if one.subject != scenario or one.predicate not in terms
    ]
    quads = [ox.Quad(scenario, bg(name), ox.Literal(value)) for name, value in values.items()]
    return Individuals([*others, *quads])


def _cause(quick: Cause, tested: Neighbourhood | None) -> Cause:
    """Return the cause that a scenario's files state: tested by neighbours, where it is."""
    if tested is None or not tested.cause:
        return quick
    return Cause.NONE if tested.cause == "sensitive" else Cause.named(tested.cause)


def _tested(
    name: str, quick: Cause, tested: Neighbourhood | None, found: Triage | None
) -> dict[str, object]:
    """Return what the triage says of an exported scenario, as JSON's types."""
    modes = [one.number for one in (found.modes if found else ()) if name in one.exports]
    cause = tested.cause if tested is not None and tested.cause else quick.label
    return {
        "cause": cause or None,
        "quick_cause": quick.label or None,
        "mode": modes[0] if modes else None,
        "robustness": tested.robustness if tested is not None else None,
    }


def _write_minimal(pipeline: Pipeline, mode: Mode, minimal: Minimal, folder: Path) -> None:
    """Write a mode's minimal scenario; its metrics are those of its own rollout."""
    X = np.array([minimal.x])
    rollout = pipeline.rollout_again(X, np.array([minimal.noise_key], dtype=np.uint64))
    conflict = summarise(analyse(rollout), 0, pipeline.objective.count)
    metrics = quantities.evaluate(rollout, pipeline.metrics)
    critical = pipeline.objective.critical(metrics, pipeline.metrics)
    noise = minimal.noise_key if pipeline.driver.stages else None  # others have no noise
    write_scenario(
        pipeline, X[0], folder, minimal.name, rollout=rollout, noise=noise, found=conflict
    )
    facts = {
        "name": minimal.name,
        "scenario": pipeline.scenario.name,
        "ego": pipeline.driver.label,
        "mode": mode.number,
        "title": mode.title,
        "sentence": minimal.sentence,
        "conditions": [one.model_dump() for one in minimal.conditions],
        "critical": bool(critical[0]),
        "noise_key": minimal.noise_key,
        "robustness": minimal.robustness,
        "conflict": None if conflict is None else conflict.to_dict(),
        "parameters": _parameters(pipeline, X[0]),
        "metrics": _named(
            dict(zip(pipeline.metrics, metrics[0].tolist(), strict=True)),
            {name: QUANTITIES[name].unit for name in pipeline.metrics},
        ),
        "F": pipeline.objective.F(metrics, pipeline.metrics)[0][0].tolist(),
    }
    (folder / f"{minimal.name}.json").write_text(_json(facts), encoding="utf-8")


def _json(facts: Mapping[str, object]) -> str:
    return json.dumps(facts, indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def _facts(pipeline: Pipeline, rows: Rows, i: int, name: str) -> dict[str, object]:
    """Return one scenario's parameters and metrics; what is infinite or NaN is None."""
    return {
        "name": name,
        "evaluation": int(rows.id[i]),
        "scenario": pipeline.scenario.name,
        "ego": pipeline.driver.label,
        "critical": bool(rows.critical[i]),
        "implausible": rows.findings.implausible[i] or None,
        "parameters": _parameters(pipeline, rows.X[i]),
        "metrics": _named(
            dict(zip(pipeline.metrics, rows.metrics[i].tolist(), strict=True)),
            {name: QUANTITIES[name].unit for name in pipeline.metrics},
        ),
        "F": rows.F[i].tolist(),
    }


def _parameters(pipeline: Pipeline, x: Float) -> dict[str, dict[str, float | str | None]]:
    """Return the parameters of a row as people read them."""
    units = dict(zip(pipeline.space.names, pipeline.space.units, strict=True))
    said = _named(pipeline.facts(x), units)
    for name in said.keys() & pipeline.space.parameters.keys():
        kind = pipeline.space.parameters[name].kind
        said[name]["value"] = kind.written(float(x[pipeline.space.index(name)]))
    return said


def _named(
    values: Mapping[str, float], units: Mapping[str, str]
) -> dict[str, dict[str, float | str | None]]:
    return {
        name: {"value": value if np.isfinite(value) else None, "unit": units[name]}
        for name, value in values.items()
    }
