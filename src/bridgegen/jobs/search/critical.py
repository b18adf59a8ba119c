"""The most critical distinct scenarios of a run, exported as files that other tools run."""

import json
import shutil
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import asdict
from pathlib import Path

import numpy as np

from bridgegen.assess.cause import Cause
from bridgegen.assess.conflict.analysis import analyse
from bridgegen.assess.conflict.harm import NEAR_MISS, Count
from bridgegen.assess.conflict.summary import ConflictSummary, summarise
from bridgegen.base.arrays import Bool, Float, Int
from bridgegen.base.errors import OntologyError, StorageError
from bridgegen.base.statistics import confidence_sequence
from bridgegen.engine.pipeline import Pipeline
from bridgegen.engine.replays import Replays
from bridgegen.jobs.search.exported import FOLDER, NOT_EXPORTED, Exported, Refused
from bridgegen.jobs.search.scenario_files import write_scenario
from bridgegen.results.store import Rows
from bridgegen.scenario.language.prior import rarities
from bridgegen.search.algorithms.dominance import by_merit
from bridgegen.search.triage.judgement import judgement
from bridgegen.search.triage.record import Minimal, Mode, Neighbourhood, Repeated, Triage
from bridgegen.search.triage.what_happened import distinct
from bridgegen.simulation.rollout import Rollout


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


def export_critical(
    pipeline: Pipeline,
    rows: Rows,
    replays: Replays | None,
    folder: Path,
    progress: Callable[[int], None] | None = None,
    triage: Triage | None = None,
    drawn: Mapping[str, Float] | None = None,
) -> tuple[Exported, ...]:
    """Write each row's ``.owl``, ``.xodr``, ``.xosc`` and ``.json`` into ``folder/critical``.

    The folder is replaced as a whole, once all of it is written. A scenario whose individuals break
    a rule is left out, and named in ``NOT_EXPORTED``; see `not_exported`. Minimal scenarios of the
    failure modes are written beside them, as ``minimal-01.*`` and so on, those of fresh random
    draws as ``fresh-01.*``.

    Args:
        pipeline: evaluated the rows.
        rows: the scenarios, most critical first.
        replays: of these rows; None if there are none.
        folder: the run's.
        progress: called with the number of rows written, after each.
        triage: the run's, if there is one.
        drawn: fresh random draws to export, too, by name.

    Raises:
        StorageError: the folder cannot be written.
    """
    # Written beside, then renamed: an interruption never leaves half of an export under its name.
    target, fresh = folder / FOLDER, folder / f"{FOLDER}.part"
    exported, refused = [], []
    motions = _motions(replays, pipeline.objective.count)
    try:
        shutil.rmtree(fresh, ignore_errors=True)
        fresh.mkdir()
        for i, (rollout, row, conflict) in enumerate(motions):
            name, tested = f"{i + 1:04d}", None
            if triage is not None:
                tested = triage.neighbourhood(int(rows.id[i]))
                if tested is not None and pipeline.cause is not None:  # the run counts quick causes
                    tested = tested.model_copy(update={"cause": ""})
            quick, judged = Cause(rows.cause[i]), ""
            if conflict is not None and conflict.happened:
                judged = judgement(
                    tested.cause if tested is not None and tested.cause else quick.label,
                    tested,
                    preventable=conflict.preventable,
                    responsible=conflict.responsible,
                )
                conflict = conflict.reconciled(judged)
            try:
                files = write_scenario(
                    pipeline,
                    rows.X[i],
                    fresh,
                    name,
                    _cause(quick, tested),
                    rollout=rollout,
                    row=row,
                    conflict=conflict,
                )
            except OntologyError as error:
                # One scenario that the ontology refuses costs that one alone.
                refused.append(Refused(name, int(rows.id[i]), error.problems))
                continue
            files.append(fresh / f"{name}.json")
            facts = (
                _facts(pipeline, rows, i, name)
                | _triaged(name, int(rows.id[i]), quick, tested, triage)
                | {"judgement": judged or None}
                | {"conflict": None if conflict is None else conflict.to_dict()}
            )
            files[-1].write_text(_json(facts), encoding="utf-8")
            paths = tuple(f"{FOLDER}/{file.name}" for file in files)
            exported.append(Exported(name, int(rows.id[i]), paths))
            if progress:
                progress(i + 1)
        for mode in triage.modes if triage else ():
            if mode.minimal is not None:
                try:
                    problems = _write_minimal(pipeline, mode, mode.minimal, fresh)
                except OntologyError as error:
                    problems = error.problems
                if problems:
                    refused.append(Refused(mode.minimal.name, mode.worst, problems))
        for name, x in (drawn or {}).items():
            with suppress(OntologyError):  # the verdict counts it all the same
                _write_alone(pipeline, x, None, fresh, name, {"drawn": "fresh"})
        shutil.rmtree(target, ignore_errors=True)
        fresh.rename(target)
        _write_refused(refused, folder / NOT_EXPORTED)
    except OSError as error:
        raise StorageError(
            f"{target}: cannot be written: {error.strerror}; the evaluations are kept, "
            f"'bridgegen resume {folder}' writes the files"
        ) from None
    return tuple(exported)


def _motions(
    replays: Replays | None, count: Count
) -> list[tuple[Rollout, int, ConflictSummary | None]]:
    """Return of each scenario a rollout, its row there and its decisive conflict."""
    found = {}
    for rows, replay in replays.parts if replays else ():
        conflicts = analyse(replay.rollout)
        for k, i in enumerate(rows.tolist()):
            found[i] = (replay.rollout, k, summarise(conflicts, k, count))
    return [found[i] for i in sorted(found)]


def _write_refused(refused: list[Refused], path: Path) -> None:
    """Write the refused scenarios with their problems; remove the file if there is none."""
    if not refused:
        path.unlink(missing_ok=True)
        return
    text = json.dumps([asdict(item) for item in refused], indent=2, ensure_ascii=False)
    path.write_text(f"{text}\n", encoding="utf-8")


def _cause(quick: Cause, tested: Neighbourhood | None) -> Cause:
    """Return the cause that a scenario's files state: that of its neighbours, where tested."""
    if tested is None or not tested.cause:
        return quick
    unknown = tested.cause in ("sensitive", "not known")
    return Cause.NONE if unknown else Cause.named(tested.cause)


def _triaged(
    name: str, row: int, quick: Cause, tested: Neighbourhood | None, triage: Triage | None
) -> dict[str, object]:
    """Return the triage's findings on an exported scenario, as JSON's types."""
    modes = [mode.number for mode in (triage.modes if triage else ()) if name in mode.exports]
    cause = tested.cause if tested is not None and tested.cause else quick.label
    again = triage.of_repeats(row) if triage else None
    return {
        "cause": cause or None,
        "quick_cause": quick.label or None,
        "mode": modes[0] if modes else None,
        "robustness": tested.robustness if tested is not None else None,
        **({} if again is None else {"repeats": _repeats_of(again)}),
    }


def _repeats_of(again: Repeated) -> dict[str, object]:
    low, high = confidence_sequence(again.fails, again.repeats)
    found = again.model_dump(include={"fails", "repeats", "lost"})
    return found | {"p_fail": again.probability, "interval": [low, high]}


def _write_minimal(
    pipeline: Pipeline, mode: Mode, minimal: Minimal, folder: Path
) -> tuple[str, ...]:
    """Write a mode's minimal scenario; its metrics are those of its own rollout.

    Returns:
        Why it is not written; empty if it is. Without a baseline it must be harmful itself.

    Raises:
        OntologyError: its individuals break a rule.
    """
    facts = {
        "mode": mode.number,
        "title": mode.title,
        "sentence": minimal.sentence,
        "conditions": [condition.model_dump() for condition in minimal.conditions],
        "inside": minimal.inside.model_dump(),
        "noise_key": minimal.noise_key,
        "robustness": minimal.robustness,
    }
    key = minimal.noise_key
    return _write_alone(pipeline, np.array(minimal.x), key, folder, minimal.name, facts)


def _write_alone(
    pipeline: Pipeline,
    x: Float,
    noise_key: str | None,
    folder: Path,
    name: str,
    facts: Mapping[str, object],
) -> tuple[str, ...]:
    """Write a row that is no evaluation, with facts of its own; see `_write_minimal`."""
    X = x[np.newaxis]
    noise = None if noise_key is None else np.array([noise_key], dtype=np.uint64)
    rollout = pipeline.runner.run(X, noise=noise)
    conflict = summarise(analyse(rollout), 0, pipeline.objective.count)
    metrics = pipeline.measure(rollout)
    harm = float(metrics[0, pipeline.metrics.index(pipeline.objective.harm)])
    # Written so that NaN is refused, too.
    if not harm >= NEAR_MISS:
        return (f"it is not harmful as it is exported: harm {harm:.2g} of {NEAR_MISS:g}",)
    critical = pipeline.objective.critical(metrics, pipeline.metrics)
    written = noise_key if pipeline.driver.stages else None  # others have no noise
    write_scenario(pipeline, x, folder, name, rollout=rollout, noise=written, conflict=conflict)
    every = {
        "name": name,
        "scenario": pipeline.scenario.name,
        "ego": pipeline.driver.label,
        **facts,
        "critical": bool(critical[0]),
        "conflict": None if conflict is None else conflict.to_dict(),
        "parameters": _parameters(pipeline, x),
        "metrics": _named(
            dict(zip(pipeline.metrics, metrics[0].tolist(), strict=True)),
            pipeline.units,
        ),
        "F": pipeline.objective.F(metrics, pipeline.metrics)[0][0].tolist(),
    }
    (folder / f"{name}.json").write_text(_json(every), encoding="utf-8")
    return ()


def _json(facts: Mapping[str, object]) -> str:
    return json.dumps(facts, indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def _facts(pipeline: Pipeline, rows: Rows, i: int, name: str) -> dict[str, object]:
    """Return one scenario's parameters and metrics; what is infinite or NaN is None."""
    return {
        "name": name,
        "evaluation": int(rows.id[i]) + 1,
        "row": int(rows.id[i]),
        "scenario": pipeline.scenario.name,
        "ego": pipeline.driver.label,
        "critical": bool(rows.critical[i]),
        "implausible": rows.findings.implausible[i] or None,
        "parameters": _parameters(pipeline, rows.X[i]),
        "rarely_met": rarities(pipeline.space.bands(pipeline.space.values(rows.X[i]))),
        "metrics": _named(
            dict(zip(pipeline.metrics, rows.metrics[i].tolist(), strict=True)),
            pipeline.units,
        ),
        "F": rows.F[i].tolist(),
    }


def _parameters(pipeline: Pipeline, x: Float) -> dict[str, dict[str, float | str | None]]:
    """Return the parameters of a row as people read them."""
    units = dict(zip(pipeline.space.names, pipeline.space.units, strict=True))
    values = _named(pipeline.runner.facts(x), units)
    for name in values.keys() & pipeline.space.parameters.keys():
        kind = pipeline.space.parameters[name].kind
        values[name]["value"] = kind.written(float(x[pipeline.space.index(name)]))
    return values


def _named(
    values: Mapping[str, float], units: Mapping[str, str]
) -> dict[str, dict[str, float | str | None]]:
    return {
        name: {"value": value if np.isfinite(value) else None, "unit": units[name]}
        for name, value in values.items()
    }
