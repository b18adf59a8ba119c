"""Exposures as files: which one a command takes, read, and written."""

import json
import math
from collections.abc import Mapping
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from bridgegen.base.arrays import Float
from bridgegen.base.disk import write_whole
from bridgegen.base.errors import InputError, ScenarioError, StorageError, UnknownNameError
from bridgegen.scenario.exposure.dependence import FREEDOMS, MOST_FREEDOM, Copula
from bridgegen.scenario.exposure.exposure import Encounters, Exposure
from bridgegen.scenario.exposure.forms import Naming, build_marginal
from bridgegen.scenario.exposure.marginals import Conditional, Marginal, Shared
from bridgegen.scenario.language.distributions import Discrete
from bridgegen.scenario.language.exposure_schema import ExposureFile, ExposureSection, FormSection
from bridgegen.scenario.language.parameterisation import Parameterisation
from bridgegen.scenario.language.parameters import nearest
from bridgegen.scenario.language.plain_yaml import Document, read_plain_yaml
from bridgegen.scenario.language.reader import load, names, pack_names, read_document
from bridgegen.scenario.language.scenario import LogicalScenario, SearchedScenario
from bridgegen.scenario.language.schema_types import section, shape_problems
from bridgegen.scenario.language.space import SearchSpace

_EXAMPLES = "bridgegen.scenario.exposure.examples"
_EVENLY = FormSection(distribution="uniform")


def example_names() -> tuple[str, ...]:
    """Return the names of the example exposures that ship."""
    return tuple(
        sorted(
            path.name.removesuffix(".yaml")
            for path in resources.files(_EXAMPLES).iterdir()
            if path.name.endswith(".yaml")
        )
    )


def read_exposure(source: str | Path, scenario: SearchedScenario | None = None) -> Exposure:
    """Read the exposure of a scenario from a file of its own.

    Args:
        source: the path of a YAML file, or the name of an example that ships.
        scenario: of which; by default the one that the file names, of the catalogue, of a pack, or
            ``NAME.yaml`` beside the file.

    Raises:
        FileFormatError: the file cannot be read.
        UnknownNameError: no such example or scenario.
        ScenarioError: it breaks a rule, or is the exposure of another scenario; all that is wrong.
        InputError: the exposure contradicts the scenario's constraints.
    """
    document, folder = _document(source)
    problems = shape_problems(ExposureFile, document)
    given = section(ExposureFile, document.data)
    if given is None:
        raise ScenarioError(*problems)
    if scenario is None:
        scenario = _named(given.exposure_of, Path(source) if folder else None, document)
    elif given.exposure_of.rpartition("/")[2] != scenario.name:
        raise ScenarioError(
            f"the exposure must be that of {scenario.name}, got one of {given.exposure_of} "
            f"({document.at(('exposure_of',))})"
        )
    return build_exposure(document.below("exposure"), scenario, folder)


def scenario_of(source: str | Path) -> str:
    """Return the name of the scenario of which a file, or an example that ships, is an exposure.

    Raises:
        FileFormatError: the file cannot be read.
        UnknownNameError: no such example.
    """
    document, _ = _document(source)
    data = document.data if isinstance(document.data, dict) else {}
    return str(data.get("exposure_of", "no scenario")).rpartition("/")[2]


def exposure_of(scenario: LogicalScenario) -> Exposure | None:
    """Return the exposure that a scenario's own file declares; None where it has no such block.

    Raises:
        ScenarioError: the block breaks a rule; all that it breaks.
        InputError: the exposure contradicts the scenario's constraints.
    """
    if scenario.exposure is None:
        return None
    path = Path(scenario.place)
    return build_exposure(scenario.exposure, scenario, path.parent if path.is_file() else None)


def is_exposure(document: Document) -> bool:
    """Return whether a YAML file is an exposure rather than a scenario."""
    return isinstance(document.data, dict) and "exposure_of" in document.data


def build_exposure(document: Document, scenario: SearchedScenario, folder: Path | None) -> Exposure:
    """Return an exposure.

    Args:
        document: its block.
        scenario: of which.
        folder: where tables lie that it names; None: nowhere.

    Raises:
        ScenarioError: it breaks a rule; all that it breaks.
        InputError: it contradicts the scenario's constraints.
    """
    problems = shape_problems(ExposureSection, document)
    given = section(ExposureSection, document.data)
    if given is None:
        raise ScenarioError(*problems)
    marginals = _marginals(given, document, scenario, folder, problems)
    copula = _copula(given, document, tuple(marginals), problems)
    encounters = None
    if given.encounters is not None:
        encounters_section = given.encounters
        try:
            encounters = Encounters(
                encounters_section.count,
                encounters_section.hours,
                encounters_section.km,
                encounters_section.source,
            )
        except InputError as error:
            place = document.at(("encounters",))
            problems += [f"encounters: {text} ({place})" for text in error.problems]
    if problems:
        raise ScenarioError(*problems)
    made = Exposure(
        scenario,
        scenario.space(),
        marginals,
        copula,
        encounters,
        given.source,
        document.at(()),
        given.parameterisation,
    )
    _ = made.feasible_share  # formulas have values everywhere, and constraints leave enough
    return made


def read_parameterisation(path: Path) -> Parameterisation | None:
    """Return what the file of a fit says of recorded twins; None where it says nothing.

    Raises:
        FileFormatError: the file cannot be read.
        ScenarioError: it breaks a rule.
    """
    document = read_document(path)
    given = section(ExposureFile, document.data)
    if given is None:
        raise ScenarioError(*shape_problems(ExposureFile, document))
    return given.exposure.parameterisation


def _document(source: str | Path) -> tuple[Document, Path | None]:
    text, path = str(source), Path(source)
    if isinstance(source, Path) or text.endswith((".yaml", ".yml")) or path.is_file():
        return read_document(path), path.parent
    if text not in (known := example_names()):
        raise UnknownNameError("exposure", text, known)
    data = resources.files(_EXAMPLES).joinpath(f"{text}.yaml").read_bytes()
    return read_plain_yaml(data, f"{text}.yaml"), None


def _named(name: str, path: Path | None, document: Document) -> LogicalScenario:
    """Return the scenario that an exposure's file names, which lies beside it or ships."""
    beside = path.with_name(f"{name}.yaml") if path is not None and "/" not in name else None
    if beside is not None and beside != path and beside.is_file():
        return load(beside)
    place = document.at(("exposure_of",))
    if name not in (known := (*names(), *pack_names())):
        raise ScenarioError(
            f"exposure_of must be a scenario of the catalogue, of a pack, or NAME.yaml beside the "
            f"file, got '{name}'{nearest(name, known)} ({place})"
        )
    return load(name)


def _marginals(
    given: ExposureSection,
    document: Document,
    scenario: SearchedScenario,
    folder: Path | None,
    problems: list[str],
) -> dict[str, Marginal | Conditional]:
    """Return the distributions in the scenario's order, and note what is wrong."""
    parameters = scenario.parameters
    derived = {item.name: item for item in scenario.derived}
    categories = {
        name: parameter.kind.names for name, parameter in parameters.items() if parameter.kind.names
    }
    naming = Naming(frozenset({*parameters, *derived}), categories, folder)
    made: dict[str, Marginal | Conditional] = {}
    for name, parameter in given.parameters.items():
        place = document.at(("parameters", name))
        if name in derived:
            problems.append(f"{name} follows from '{derived[name]}': distribute that ({place})")
        elif name not in parameters:
            hint = nearest(name, parameters)
            problems.append(f"exposure of the unknown parameter '{name}'{hint} ({place})")
        elif parameters[name].low == parameters[name].high:
            problems.append(f"{name} does not vary, and has no distribution ({place})")
        else:
            try:
                made[name] = build_marginal(parameter, parameters[name], naming, place)
            except InputError as error:
                problems += [f"parameters.{name}: {text} ({place})" for text in error.problems]
    rest = [name for name in scenario.space().variables if name not in given.parameters]
    if rest and given.others is None:
        problems.append(
            f"others must say what the searched parameters are that are not named, uniform or "
            f"default: {', '.join(rest)} ({document.at(())})"
        )
    if given.others == "uniform":
        for name in rest:
            made[name] = build_marginal(_EVENLY, parameters[name], naming, "others")
    return {name: made[name] for name in parameters if name in made}


def _copula(
    given: ExposureSection, document: Document, names_: tuple[str, ...], problems: list[str]
) -> Copula:
    """Return the dependence, and note what is wrong."""
    matrix = np.eye(len(names_))
    freedom = math.inf if (given_ := given.dependence.degrees_of_freedom) is None else given_
    named = {name for item in given.dependence.correlation for name in item.between}
    seen: set[frozenset[str]] = set()
    wrong = False
    for number, correlation_section in enumerate(given.dependence.correlation):
        place = document.at(("dependence", "correlation", number))
        pair = frozenset(correlation_section.between)
        unknown = [name for name in correlation_section.between if name not in names_]
        if unknown and unknown[0] in given.parameters:
            continue  # its distribution is wrong, which is said already
        if unknown:
            hint = nearest(unknown[0], names_)
            rule = f"must be between distributed parameters, got '{unknown[0]}'{hint}"
        elif len(pair) < 2:
            rule = f"must be between two parameters, got {correlation_section.between[0]} twice"
        elif pair in seen:
            rule = f"of {' and '.join(correlation_section.between)} is given twice"
        elif not -1.0 < correlation_section.value < 1.0:
            rule = (
                f"of {' and '.join(correlation_section.between)} must be above -1 and below 1, got "
                f"{correlation_section.value:g}"
            )
        else:
            i, j = (names_.index(name) for name in correlation_section.between)
            matrix[i, j] = matrix[j, i] = correlation_section.value
            seen.add(pair)
            continue
        problems.append(f"a correlation {rule} ({place})")
        wrong = True
    if given_ is not None and not (FREEDOMS[0] <= freedom <= MOST_FREEDOM and named):
        problems.append(
            f"degrees_of_freedom must be {FREEDOMS[0]:g} to {MOST_FREEDOM:g}, and stand with a "
            f"correlation (0 is one), got {freedom:g} and {len(given.dependence.correlation)} "
            "correlations "
            f"({document.at(('dependence', 'degrees_of_freedom'))})"
        )
    elif not wrong:
        try:
            tied = tuple(name for name in names_ if name in named and math.isfinite(freedom))
            return Copula(names_, tuple(map(tuple, matrix.tolist())), freedom, tied)
        except InputError as error:
            place = document.at(("dependence",))
            problems += [f"{text} ({place})" for text in error.problems]
    return Copula.independent(names_)


# --- Which exposure a command takes: the one that is named, or the scenario's own ---


UNIFORM = "uniform"
"""Name of the exposure in which each parameter is uniform over its range: no road is like that."""
ROWS = 200_000
"""Number of rows of an exposure, always the same ones, that show how likely parts of a search space
are."""

_UNIFORM_BLOCK = b"source: Uniform over the ranges, which no road is like.\nothers: uniform\n"


def chosen_exposure(
    scenario: SearchedScenario, given: str | Path | Exposure | None
) -> Exposure | None:
    """Return the exposure that was asked for; None where none was, and the scenario has none.

    Args:
        scenario: of which.
        given: a file, the name of an example, `UNIFORM`, or the exposure itself; by default that of
            the scenario's file.

    Raises:
        FileFormatError: a file cannot be read.
        UnknownNameError: no such example.
        ScenarioError: it breaks a rule.
        InputError: it is that of another scenario, or contradicts the scenario's constraints.
    """
    if isinstance(given, Exposure):
        if given.scenario.name != scenario.name:
            raise InputError(
                f"the exposure must be that of {scenario.name}, got one of {given.scenario.name}"
            )
        return given
    if given == UNIFORM:
        return build_exposure(read_plain_yaml(_UNIFORM_BLOCK, UNIFORM), scenario, None)
    if given is not None:
        return read_exposure(given, scenario)
    return exposure_of(scenario) if isinstance(scenario, LogicalScenario) else None


def evenly(exposure: Exposure) -> Exposure:
    """Return the exposure that distributes the same parameters, each uniformly over its range.

    One that takes single values of its range takes each of them equally often.
    """
    even = {name: _even(marginal) for name, marginal in exposure.marginals.items()}
    node = {"source": "Uniform over the ranges.", "others": "default", "parameters": even}
    text = json.dumps(node).encode()
    return build_exposure(read_plain_yaml(text, UNIFORM), exposure.scenario, None)


def _even(marginal: Marginal | Conditional) -> dict[str, object]:
    if isinstance(marginal, Shared) and isinstance(marginal.distribution, Discrete):
        return {"distribution": "discrete", "values": list(marginal.distribution.values)}
    return {"distribution": "uniform"}


def rows_on_the_road(exposure: Exposure, space: SearchSpace, n: int = ROWS) -> Float:
    """Return rows of an exposure in the columns of a search space of its scenario.

    A parameter that the exposure does not distribute stands at its default.

    Args:
        exposure: of the space's scenario.
        space: it may search other parameters than the exposure distributes.
        n: how many.

    Returns:
        ``(n, len(space.names))``, always the same rows.

    Raises:
        InputError: the exposure contradicts the constraints.
    """
    X = exposure.sample(n, 0).X
    rows = np.empty((n, len(space.names)))
    for column, name in enumerate(space.names):
        if name in exposure.space.names:
            rows[:, column] = X[:, exposure.space.index(name)]
        else:
            rows[:, column] = space.parameters[name].default
    return rows


# --- An exposure's file as text, and where one is written ---


_HEAD = "# Fitted by 'bridgegen fit'. A later fit replaces this file."


def exposure_text(data: Mapping[str, Any]) -> str:
    """Return a file's data as YAML; numbers keep all their digits."""
    body = yaml.safe_dump(
        dict(data), sort_keys=False, allow_unicode=True, width=100, default_flow_style=None
    )
    return f"{_HEAD}\n{body}"


def refuse_other_file(path: Path) -> None:
    """Refuse a place where something else is than an earlier fit.

    Raises:
        StorageError: there is one, or it cannot be read.
    """
    try:
        with path.open("rb") as file:
            ours = file.read(len(_HEAD)) == _HEAD.encode()
    except FileNotFoundError:
        return
    except OSError as error:
        raise StorageError(f"{path}: cannot be written: {error.strerror}") from None
    if not ours:
        raise StorageError(f"{path}: exists already, is no fit of ours, and is not overwritten")


def write_exposure(path: Path, text: str) -> None:
    """Write the file of a fit; an earlier one is replaced.

    Raises:
        StorageError: something else is there, or it cannot be written.
    """
    refuse_other_file(path)
    write_whole(path, [text.encode()])
