"""One row of X as files that other tools run: ontology, OpenDRIVE map, OpenSCENARIO storyboard."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pyoxigraph as ox

from bridgegen.assess.cause import Cause
from bridgegen.assess.conflict.analysis import analyse
from bridgegen.assess.conflict.outcomes import with_outcomes
from bridgegen.assess.conflict.summary import ConflictSummary, summarise
from bridgegen.base.arrays import Float
from bridgegen.base.errors import OntologyError
from bridgegen.engine.pipeline import Pipeline
from bridgegen.engine.stated import keyed, with_vehicle
from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.declarations import (
    CAUSE,
    CONFLICT_TYPE,
    RESPONSIBLE,
    SEVERITY,
)
from bridgegen.openx.openscenario.from_owl.notes import FINDINGS
from bridgegen.openx.openscenario.values import format_double
from bridgegen.openx.openscenario.write import to_xml as scenario_xml
from bridgegen.scenario.odd.domain import cod
from bridgegen.scenario.ontology.check import check
from bridgegen.scenario.ontology.files import save
from bridgegen.scenario.ontology.graph import Individuals
from bridgegen.scenario.ontology.vocabulary import bg
from bridgegen.simulation.rollout import Rollout


def write_scenario(
    pipeline: Pipeline,
    x: Float,
    folder: Path,
    name: str,
    cause: Cause = Cause.NONE,
    *,
    rollout: Rollout | None = None,
    row: int = 0,
    noise: str | None = None,
    conflict: ConflictSummary | None = None,
) -> list[Path]:
    """Write one row as ``name.owl``, ``name.xodr`` and ``name.xosc``; return their paths.

    A scenario that an ODD bounds has its current operational domain beside it, ``name.cod.yaml``.

    The ontology also holds the outcomes of the scenario's rollout (``has_outcome``), its cause, if
    it is known (``has_cause``), and type, responsibility and severity of its decisive conflict; the
    last four are in the header of the storyboard, too.

    Args:
        pipeline: evaluated the row.
        x: ``(len(space.names),)``.
        folder: an existing one.
        name: of the files.
        cause: of its harm, if it is known.
        rollout: a simulation of the row; simulated here by default.
        row: of the rollout.
        noise: the key of its random numbers, which the storyboard then states.
        conflict: its decisive conflict; of the rollout made here by default.

    Raises:
        OntologyError: its individuals break a constraint (SHACL).
        OSError: the folder cannot be written.
    """
    owl, xodr, xosc = (folder / f"{name}.{kind}" for kind in ("owl", "xodr", "xosc"))
    concrete = pipeline.runner.concrete(x, xodr.name)
    if rollout is None:
        rollout = pipeline.rollout(x[np.newaxis])
        conflict = summarise(analyse(rollout))
    individuals = concrete.individuals
    if individuals is not None:
        individuals = with_outcomes(individuals, rollout, concrete.roads, row)
        individuals = _with_findings(individuals, cause, conflict)
        violations = check(individuals, pipeline.runner.source.constraints)
        if violations:
            # Before any file is written: a refused scenario leaves none behind.
            raise OntologyError(*(f"{name}.owl: {violation}" for violation in violations))
    xodr.write_bytes(concrete.road_data)
    storyboard = _with_header(concrete.storyboard, cause, conflict)
    storyboard = with_vehicle(storyboard, pipeline.runner.vehicle)
    xosc.write_bytes(scenario_xml(keyed(storyboard, noise) if noise else storyboard))
    files = [xodr, xosc]
    if pipeline.scenario.odd is not None:
        files.append(folder / f"{name}.cod.yaml")
        files[-1].write_text(
            cod(pipeline.scenario.odd, pipeline.space.values(x), xosc.name), encoding="utf-8"
        )
    if individuals is None:
        return files
    save(individuals, owl)
    return [owl, *files]


def _with_header(
    storyboard: osc.OpenScenario, cause: Cause, conflict: ConflictSummary | None
) -> osc.OpenScenario:
    """Return a scenario whose header states cause and decisive conflict, as far as they are known.

    They replace those that a searched file states, which are another run's. From version 1.2 on:
    earlier headers have no properties.
    """
    header = storyboard.file_header
    stated = {CAUSE: cause.label} if cause else {}
    if conflict is not None and conflict.happened:
        stated |= {CONFLICT_TYPE: conflict.type, RESPONSIBLE: conflict.responsible}
        stated[SEVERITY] = format_double(conflict.severity)
    if header.rev_minor in (0, 1):
        return storyboard
    before = header.properties or osc.Properties()
    others = tuple(
        property_ for property_ in before.properties if property_.name not in (*FINDINGS, SEVERITY)
    )
    added = tuple(osc.Property(name, value) for name, value in stated.items())
    # Untouched then, so that a header without properties does not get an empty element.
    if (*others, *added) == before.properties:
        return storyboard
    properties = replace(before, properties=(*others, *added))
    return replace(storyboard, file_header=replace(header, properties=properties))


def _with_findings(
    individuals: Individuals, cause: Cause, conflict: ConflictSummary | None
) -> Individuals:
    """Return individuals that state cause and decisive conflict, in place of a searched file's."""
    scenario = individuals.one("Scenario")
    values: dict[str, str | float] = {"has_cause": cause.label} if cause else {}
    if conflict is not None and conflict.happened:
        values |= {"has_conflict_type": conflict.type, "has_responsibility": conflict.responsible}
        values["has_severity"] = conflict.severity
    terms = {bg(name) for name in (*FINDINGS.values(), "has_severity")}
    others = [
        quad
        for quad in individuals.quads
        if quad.subject != scenario or quad.predicate not in terms
    ]
    quads = [ox.Quad(scenario, bg(name), ox.Literal(value)) for name, value in values.items()]
    return Individuals([*others, *quads])
