"""What can be searched, and the objective as options change it."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, NoReturn, cast, get_args

from bridgegen.assess.conflict.harm import Count
from bridgegen.assess.conflict.quantities import HARM, QUANTITIES
from bridgegen.assess.metrics import read
from bridgegen.assess.objective import RULES, Objectives
from bridgegen.base.errors import InputError, UnknownNameError
from bridgegen.engine.options import CommonOptions
from bridgegen.engine.options.forms import read_names
from bridgegen.openx.file_scenario import FileScenario, load_file_scenario, with_triggers
from bridgegen.openx.file_scenario import with_others as drive_file_by
from bridgegen.openx.openscenario.parameters import values
from bridgegen.openx.openscenario.tier4 import is_storyboard
from bridgegen.scenario.language import reader
from bridgegen.scenario.language.adversary import require, with_others
from bridgegen.scenario.language.criteria import PREFIX, joined, read_criterion
from bridgegen.scenario.language.objectives import PAPERS
from bridgegen.scenario.language.scenario import (
    LogicalScenario,
    ObjectiveSpec,
    SearchedScenario,
    Term,
)
from bridgegen.scenario.odd.exit import watched
from bridgegen.search.algorithms import Algorithm
from bridgegen.simulation.embedded.compiler import compile_storyboard
from bridgegen.simulation.embedded.simulator import EmbeddedSimulator

STORYBOARD = ".xosc"


def is_file(scenario: str | Path) -> bool:
    """Say whether a scenario is named by the path of its file."""
    return Path(scenario).suffix.lower() in (".yaml", ".yml", reader.DSL, STORYBOARD)


def load(
    scenario: str | Path,
    distribution: str | Path | None = None,
    empty_trigger: str | None = None,
) -> SearchedScenario:
    """Read a logical scenario.

    Args:
        scenario: a name of the catalogue, or the path of a YAML file or of an OpenSCENARIO file.
        distribution: of the parameters of an OpenSCENARIO file.
        empty_trigger: when what has an empty StartTrigger starts there, "never" or "now".

    Raises:
        UnknownNameError: no such reading of empty triggers.
        InputError: a distribution, or that reading, for another kind of scenario; or as the
            readers say.
    """
    if is_storyboard(scenario):
        found = load_file_scenario(Path(scenario), Path(distribution) if distribution else None)
        return found if empty_trigger is None else with_triggers(found, empty_trigger)
    if empty_trigger is not None:
        raise InputError(
            f"empty triggers are those of an OpenSCENARIO file ({STORYBOARD}), got {scenario}"
        )
    if distribution is not None:
        raise InputError(
            f"a distribution is for the parameters of an OpenSCENARIO file ({STORYBOARD}), got "
            f"{scenario}"
        )
    logical = reader.load(scenario)
    odd = watched(logical)
    return replace(logical, notes=(*logical.notes, *odd.to_lines())) if odd else logical


def margins_of(scenario: str | Path, options: CommonOptions) -> tuple[str, ...]:
    """Return the names of the margins that a search measures: of all pass criteria.

    Raises:
        InputError: as the readers say, or two criteria have one id.
    """
    found = load(scenario, options.distribution, options.empty_trigger)
    given = [read_criterion(criterion) for criterion in options.criteria]
    return tuple(criterion.quantity for criterion in joined(found.criteria, given))


def driven_by(scenario: SearchedScenario, others: str | None) -> SearchedScenario:
    """Return a scenario with another driver of all participants but the ego.

    Args:
        scenario: of any kind.
        others: of `bridgegen.scenario.language.adversary.DRIVERS`; None leaves it to the scenario.

    Raises:
        UnknownNameError: no such driver.
        UnsupportedError: a scenario file that cannot be run.
    """
    if others is None:
        return scenario
    require(others)
    if isinstance(scenario, LogicalScenario):
        return with_others(scenario, others)
    if isinstance(scenario, FileScenario):
        program = compile_storyboard(scenario.storyboard, scenario.place, others=others)
        able = (program.names[e] for e in program.attends.tolist())
        return drive_file_by(scenario, dict.fromkeys(able, others))
    return scenario


def within(
    scenario: SearchedScenario,
    odd: Mapping[str, Any] | Path | str | None,
    road_map: Path | str | None = None,
) -> SearchedScenario:
    """Return a scenario bounded by an operational design domain.

    Args:
        scenario: of any kind.
        odd: its file's path, or what the option ``odd`` keeps of it; None: unbounded.
        road_map: on which the scenario is placed; its roads are then not read.

    Raises:
        FileFormatError: it is damaged, or has a unit of another dimension.
        ScenarioError: it excludes every row.
    """
    if odd is None:
        return scenario
    from bridgegen.scenario.odd.bounding import bounded
    from bridgegen.scenario.odd.reader import odd_of, read_odd

    read = odd_of(odd) if isinstance(odd, Mapping) else read_odd(odd)
    return bounded(scenario, read, on_map=road_map is not None)


def refuse_standstill(scenario: SearchedScenario) -> NoReturn:
    """Refuse a search in which nothing varies, and say what could.

    Raises:
        InputError: always.
    """
    if not isinstance(scenario, FileScenario) or scenario.definition is not None:
        raise InputError(f"{scenario.name}: nothing to search, every parameter is fixed")
    simulator = EmbeddedSimulator(scenario.storyboard, scenario.place)
    quick, others = [], []
    for name, value in values(scenario.storyboard).items():
        if name in simulator.fixed:
            others.append(
                f"{name} can vary, but each value is compiled by itself: it is used for "
                f"{simulator.fixed[name]}"
            )
        elif name in simulator.parameters:
            quick.append(name)
        else:
            others.append(f"{name} can vary within a set of values, it is no number: '{value}'")
    could = f"these parameters can vary: {', '.join(quick)}" if quick else "no number can vary"
    raise InputError(
        f"{scenario.place}: say what may vary with --distribution FILE, an OpenSCENARIO file with "
        f"a ParameterValueDistribution; {could}",
        *(f"{scenario.place}: parameter {text}" for text in others),
    )


# --- The objective as the user's options change the scenario's ---


PAPER = "paper"
"""The name in ``--objective`` of the paper's objective and criticality rule."""

BESIDE_HARM = "d_min"
"""Second objective of a multi-objective search whose only term is harm."""


def columns_of(method: type[Algorithm], objectives: str | None) -> Objectives:
    """Return whether one objective or many are searched: the user's choice, or the algorithm's."""
    if objectives is None:
        return "many" if method.objectives == "many" else "one"
    for known in get_args(Objectives):
        if objectives == known:
            return cast(Objectives, known)
    raise UnknownNameError("number of objectives", objectives, get_args(Objectives))


def counted(count: str | None) -> Count | None:
    """Return whose conflicts count as harm, by the user's choice.

    Raises:
        UnknownNameError: no such choice.
    """
    for known in get_args(Count):
        if count == known:
            return cast(Count, known)
    if count is not None:
        raise UnknownNameError("choice of whose conflicts count", count, get_args(Count))
    return None


def as_judged(scenario: SearchedScenario, gated: bool) -> SearchedScenario:
    """Return a scenario adapted to whether implausible traffic counts (``Objective.gated``).

    Vehicles that stop dead at the end of a road are implausible. Where they would not count, they
    drive on and leave there, whatever the scenario says for the paper's evaluation. A scenario file
    stays as it is.
    """
    if gated and isinstance(scenario, LogicalScenario):
        return replace(scenario, road_end="leave")
    return scenario


def _judged_by(spec: ObjectiveSpec, critical: str | None) -> ObjectiveSpec:
    """Return an objective with the user's choice of what makes a scenario critical.

    Raises:
        UnknownNameError: no such choice.
    """
    if critical is None:
        return spec
    names = tuple(read_names(critical))
    if names and all(name.startswith(PREFIX) for name in names):
        return replace(spec, rule="criteria", criteria=names, gated=True)
    for known in RULES:
        if critical == known:
            gated = spec.gated or known != "thresholds"
            return replace(spec, rule=known, criteria=(), gated=gated)
    raise UnknownNameError("choice of what is critical", critical, (*RULES, f"{PREFIX}ID"))


def chosen_objective(
    spec: ObjectiveSpec, options: CommonOptions, columns: Objectives
) -> ObjectiveSpec:
    """Return the scenario's objective with the user's choices applied.

    Args:
        spec: the scenario's.
        options: the user's; the objective ``{"harm": None}`` or ``{"paper": None}`` chooses the
            criticality rule, too.
        columns: one or many objectives.

    Raises:
        InputError: weights that nothing uses; ``paper`` among other metrics.
        UnknownNameError: no such metric, or choice of whose conflicts count.
    """
    read(options.metrics)  # those of the user's own may be its terms
    metrics, weights, scale = options.objective, options.weights, options.scale
    count = counted(options.count)
    for name in metrics or ():
        if name not in (*QUANTITIES, PAPER) and not name.startswith(PREFIX):
            raise UnknownNameError("metric", name, (*QUANTITIES, PAPER))
    if metrics is not None and PAPER in metrics:
        if len(metrics) > 1 or metrics[PAPER] is not None:
            raise InputError(f"the objective '{PAPER}' stands alone, without a weight")
        spec, metrics = replace(PAPERS, critical=spec.critical), None
    # Who optimises harm means it to decide what is critical, too.
    if metrics is not None and HARM in metrics:
        spec = replace(spec, rule="harm", weights="fixed", gated=True)
        if len(metrics) == 1:
            metrics = {HARM: 1.0 if columns == "one" and weights != "entropy" else None}
    if metrics and all(name.startswith(PREFIX) for name in metrics):
        spec = replace(spec, rule="criteria", criteria=tuple(metrics), weights="fixed")
        if len(metrics) == 1 and columns == "one" and weights != "entropy":
            metrics = {name: weight or 1.0 for name, weight in metrics.items()}
    spec = _judged_by(spec, options.critical)
    if columns == "many":
        given = [f"{name}={w:g}" for name, w in (metrics or {}).items() if w is not None]
        given += [f"--weights {weights}"] if weights else []
        if given:
            raise InputError(
                f"weights have no part in many objectives, got {', '.join(given)}; "
                "leave them out, or search their sum: --objectives one"
            )
    way = weights or ("fixed" if metrics and None not in metrics.values() else spec.weights)
    terms = spec.terms
    if metrics is not None:
        terms = tuple(Term(name, weight) for name, weight in metrics.items())
    elif way == "entropy":
        terms = tuple(Term(term.metric) for term in terms)
    # One column would leave nothing to trade off.
    if columns == "many" and [term.metric for term in terms] == [HARM]:
        terms = (*terms, Term(BESIDE_HARM))
    ways: dict[str, Any] = {"weights": way, "scale": scale or spec.scale}
    return replace(spec, terms=terms, count=count or spec.count, **ways)
