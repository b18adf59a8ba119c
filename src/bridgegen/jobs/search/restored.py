"""A run's scenario, search space, map and pipeline, built again from its settings."""

import hashlib
import shlex
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from bridgegen.assess.metrics import stand_in
from bridgegen.assess.objective import Objective
from bridgegen.base.errors import InputError, StorageError
from bridgegen.base.plugins import is_own
from bridgegen.drivers import STORYBOARD, is_spec
from bridgegen.engine.options import PipelineOptions
from bridgegen.engine.pipeline import Pipeline
from bridgegen.engine.workers import Workers
from bridgegen.jobs.search.run import Run
from bridgegen.jobs.search.scenarios import as_judged, driven_by, load, within
from bridgegen.jobs.search.settings import Settings
from bridgegen.openx.on_map import on_map, searchable
from bridgegen.openx.opendrive.road_map import RoadMap, load_map
from bridgegen.scenario.language.adversary import adversarial
from bridgegen.scenario.language.objectives import PAPERS
from bridgegen.scenario.language.scenario import LogicalScenario, SearchedScenario
from bridgegen.scenario.language.space import SearchSpace
from bridgegen.simulation.choice import SimulatorChoice


def pipeline_of(
    run: Run,
    command: str,
    *,
    ego: str | None = None,
    worse_than: str | None = None,
    metrics: Sequence[str] | None = None,
    compares: bool = False,
    causes: bool = False,
    simulator: SimulatorChoice | None = None,
    elsewhere: SimulatorChoice | None = None,
    workers: Workers | None = None,
) -> Pipeline:
    """Return the pipeline of a run, its objective included.

    Args:
        run: on disk.
        command: the BridgeGen command that asks, for messages.
        ego: where a driver of the user's drives, that same driver.
        worse_than: likewise, the driver that the ego's was compared with.
        metrics: likewise, the metrics of the user's own; None where none is to be computed.
        compares: whether rows are evaluated; else a baseline that is a driver of the user's, and is
            not named, is left out.
        causes: whether to determine causes as the run did; where only one cause counts, they are
            determined all the same.
        simulator: the run's, with its place on this machine; as recorded by default.
        elsewhere: another simulator than the run's, to compare with; there, no cause is asked for.
        workers: evaluate the rows; threads by default, one for each core.

    Raises:
        StorageError: the scenario or the map is not what it was.
        InputError: the scenario or the map is missing; or the ego or the simulator is another, or
            must be named.
    """
    settings, folder = run.settings, run.folder
    if elsewhere is not None:
        # Where to compare with another simulator, neither causes nor the other driver are asked
        # for.
        settings = replace(settings, simulator=elsewhere, cause=None, worse_than=None)
    # A run's folder may come from somebody else: code that it names is not imported unless the user
    # names it again.
    check_named(settings.ego, ego, "ego", folder, command)
    if settings.worse_than is not None:
        if compares or worse_than is not None or not is_spec(settings.worse_than):
            check_named(settings.worse_than, worse_than, "worse-than", folder, command)
        else:
            # No row is evaluated, so nothing asks the other driver: its code need not be imported.
            settings = replace(settings, worse_than=None)
    settings = _with_metrics(settings, metrics, folder, command)
    scenario, space, roads = searched(run)
    pipeline = Pipeline(
        scenario,
        space,
        PipelineOptions.of(
            settings,
            ego=_ego(settings),
            causes=settings.causes and causes,
        ),
        road_map=roads,
        recorded=run.metrics,
        simulator=_simulator(settings, simulator, folder),
        workers=workers,
    )
    pipeline.choose_objective(Objective.from_dict(settings.optimised))
    return pipeline


def _with_metrics(
    settings: Settings, given: Sequence[str] | None, folder: Path, command: str
) -> Settings:
    """Return settings with the metrics to import: those of the user's own that are named again.

    Raises:
        InputError: they must be named, or are others than the run's.
        StorageError: what is recorded of one is damaged.
    """
    own = tuple(name for name in settings.metrics if is_own(name))
    if given is not None:
        if own and not given:
            names = shlex.quote(",".join(own))
            raise InputError(
                f"{folder}: its metrics {', '.join(own)} are code; to run them, name them: "
                f"bridgegen {command} {folder} --metrics {names}"
            )
        if tuple(name for name in given if is_own(name)) != own:
            raise InputError(
                f"{folder}: the metrics of one's own of this run (--metrics) must be "
                f"{', '.join(own) or 'none'}, got {', '.join(given)}"
            )
        return settings
    for known in settings.own_metrics:
        try:
            stand_in(known)
        except ValueError as error:
            raise StorageError(f"{folder}: the run's settings are damaged: {error}") from None
    return replace(settings, metrics=tuple(name for name in settings.metrics if name not in own))


def _ego(settings: Settings) -> str | None:
    """Return the driver to ask for; None where the file's own actions move the ego."""
    return None if settings.ego == STORYBOARD.name else settings.ego


def _simulator(settings: Settings, given: SimulatorChoice | None, folder: Path) -> SimulatorChoice:
    """Return the run's simulator, where it is said to be.

    Raises:
        InputError: another one is given.
    """
    screen = settings.screen
    is_screen = given is not None and screen is not None and given.name == screen.name
    if given is None or (is_screen and given.name != settings.simulator.name):
        return settings.simulator
    if given.name != settings.simulator.name:
        raise InputError(
            f"{folder}: the simulator of this run must be {settings.simulator.name}, got "
            f"{given.name}"
        )
    return replace(settings.simulator, access=given.access)


def check_named(recorded: str, given: str | None, option: str, folder: Path, command: str) -> None:
    """Refuse another driver or algorithm than the run's, and the user's own if not named again.

    Args:
        recorded: the run's.
        given: by the user, if at all.
        option: "ego", "worse-than" or "algorithm", which names it.
        folder: of the run.
        command: the BridgeGen command that asks.
    """
    is_algorithm = option == "algorithm"
    what = "algorithm" if is_algorithm else "driver"
    if given is None and (is_own(recorded) if is_algorithm else is_spec(recorded)):
        raise InputError(
            f"{folder}: its {what} {recorded} is code; to run it, name it: "
            f"bridgegen {command} {folder} --{option} {shlex.quote(recorded)}"
        )
    if given not in (None, recorded):
        raise InputError(
            f"{folder}: the {what} of this run (--{option}) must be {recorded}, got {given}"
        )


def searched(run: Run) -> tuple[SearchedScenario, SearchSpace, RoadMap | None]:
    """Return the scenario of a run, the space that it searched, and its map if it has one.

    Raises:
        StorageError: the scenario or the map is not what it was.
        InputError: the scenario or the map is missing.
    """
    settings, folder = run.settings, run.folder
    read = load(settings.scenario, settings.distribution, settings.empty_trigger)
    logical = within(driven_by(read, settings.others), settings.odd, settings.road_map)
    # The scenarios of the paper had its objective by default; a run's own is in its settings.
    earlier = replace(logical, objective=PAPERS)
    if settings.fingerprint not in (logical.fingerprint, earlier.fingerprint):
        what = " or its distribution" if settings.distribution else ""
        raise StorageError(
            f"{folder}: scenario {settings.scenario}{what} is not what it was when the run began; "
            "its results can still be read"
        )
    logical = as_judged(logical, Objective.from_dict(settings.optimised).gated)
    there, roads = placed(logical, settings.road_map, settings.junction)
    # The fingerprint above is of the scenario without its map: the map has a digest of its own.
    if roads and hashlib.sha256(roads.data).hexdigest() != settings.map_digest:
        raise StorageError(
            f"{folder}: map {settings.road_map} is not what it was when the run began"
        )
    if settings.adversary is not None:
        there = adversarial(there, settings.adversary)
    return there, there.space(settings.axes, settings.fixed), roads


def placed(
    scenario: SearchedScenario, road_map: Path | str | None, junction: str | None
) -> tuple[SearchedScenario, RoadMap | None]:
    """Return a scenario as it is on a map, and the map; as it was, without one.

    Raises:
        InputError: a scenario that brings its own map, or a map that it cannot take place on.
    """
    if road_map is None:
        return scenario, None
    if not isinstance(scenario, LogicalScenario):
        raise InputError(f"{scenario.name}: a scenario file names its map, it takes no other")
    roads = searchable(scenario, load_map(Path(road_map), junction, scenario))
    return on_map(scenario, roads), roads
