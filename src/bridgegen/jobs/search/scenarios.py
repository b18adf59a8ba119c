"""What can be searched: a scenario of the catalogue, of a YAML file, or of an OpenSCENARIO file."""

from pathlib import Path
from typing import NoReturn

from bridgegen.base.errors import InputError
from bridgegen.engine.options import CommonOptions
from bridgegen.openx.file_scenario import FileScenario, load_file_scenario, with_triggers
from bridgegen.openx.file_scenario import with_others as drive_file_by
from bridgegen.openx.openscenario.parameters import values
from bridgegen.scenario.language import reader
from bridgegen.scenario.language.criteria import joined, read_criterion
from bridgegen.scenario.language.others import require, with_others
from bridgegen.scenario.language.scenario import LogicalScenario, SearchedScenario
from bridgegen.simulation.embedded.compiler import compile_storyboard
from bridgegen.simulation.embedded.simulator import EmbeddedSimulator

STORYBOARD = ".xosc"


def is_file(scenario: str | Path) -> bool:
    """Say whether a scenario is named by the path of its file."""
    return Path(scenario).suffix.lower() in (".yaml", ".yml", STORYBOARD)


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
    if Path(scenario).suffix.lower() == STORYBOARD:
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
    return reader.load(scenario)


def margins_of(scenario: str | Path, options: CommonOptions) -> tuple[str, ...]:
    """Return the names of the margins that a search measures: of all pass criteria.

    Raises:
        InputError: as the readers say, or two criteria have one id.
    """
    found = load(scenario, options.distribution, options.empty_trigger)
    given = [read_criterion(one) for one in options.criteria]
    return tuple(one.quantity for one in joined(found.criteria, given))


def driven_by(scenario: SearchedScenario, others: str | None) -> SearchedScenario:
    """Return a scenario with another driver of all participants but the ego.

    Args:
        scenario: of any kind.
        others: of `bridgegen.scenario.language.others.DRIVERS`; None leaves it to the scenario.

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
