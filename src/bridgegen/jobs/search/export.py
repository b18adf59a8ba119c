"""Exported scenarios in the flavours that other tools ask for, each with its map."""

import os
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from importlib.resources import files as resources
from pathlib import Path

import numpy as np

from bridgegen.base.errors import (
    FileFormatError,
    InputError,
    StorageError,
    UnknownNameError,
    UnsupportedError,
)
from bridgegen.base.extras import require
from bridgegen.drivers.drivers import CODES, DRIVERS, SCRIPTED
from bridgegen.drivers.noise import noise_key
from bridgegen.engine.simulate import FileResult, simulate_file
from bridgegen.engine.stated import keyed
from bridgegen.jobs.search.exported import FOLDER, MINIMAL, read_parameters
from bridgegen.jobs.search.openlabel import openlabel
from bridgegen.jobs.search.restored import searched
from bridgegen.jobs.search.run import Run
from bridgegen.jobs.search.scenarios import load
from bridgegen.openx.opendrive.model import OpenDrive
from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario import validate
from bridgegen.openx.openscenario.parameters import numbers
from bridgegen.openx.openscenario.read import read
from bridgegen.openx.openscenario.recorded import Recording, recorded
from bridgegen.openx.openscenario.resolve import resolved
from bridgegen.openx.openscenario.scenario_runner.convert import CONTROL, for_scenario_runner
from bridgegen.openx.openscenario.tier4 import is_storyboard
from bridgegen.openx.openscenario.write import VERSIONS, least_version, to_version, to_xml
from bridgegen.openx.prepared import logic_path, prepared, roads_of
from bridgegen.openx.xml import read_bytes
from bridgegen.pages.rerun import write_rerun
from bridgegen.scenario.odd.states import states_of
from bridgegen.simulation.embedded.compiler import compile_storyboard
from bridgegen.simulation.osi.trace import ENDINGS, Surroundings, write_osi
from bridgegen.simulation.recording import MAX_STATES
from bridgegen.simulation.rollout import Rollout

EXPORT = "export"

Flavour = Callable[[osc.OpenScenario, Path, str | None], osc.OpenScenario]


def export(
    source: Path,
    flavour: str,
    *,
    scenarios: Sequence[str] = (),
    out: Path | None = None,
    town: str | None = None,
    ego: str | None = None,
    notes: list[str] | None = None,
) -> list[Path]:
    """Write scenarios in another flavour, each beside a copy of its map.

    The same source gives the same bytes. Files of the same names are replaced, but never the
    source's own.

    Args:
        source: the folder of a run, for its exported scenarios, or one ``.xosc`` file.
        flavour: one of `FLAVOURS`.
        scenarios: names of a run's scenarios ("0001", "minimal-01"); all but the minimal ones by
            default.
        out: the folder to write to; ``export/FLAVOUR`` in the run's or the file's by default.
        town: for the flavour "carla", CARLA's own map to run on, which is then named instead of
            a file; that of a run on a map called ``TownNN.xodr`` by default.
        ego: the driver of the files, which has to be named where it is the user's own and drives
            for the flavour ("recorded", "carla").
        notes: takes a sentence for each file in which participants other than the ego have a
            driver that the tools which read the flavour do not know.

    Returns:
        The files written: an ``.xosc`` and its ``.xodr`` each, and what the flavour needs besides.

    Raises:
        UnknownNameError: no such flavour, or no such scenario in the run.
        InputError: a run that kept no scenario; scenarios chosen of a file; a scenario that cannot
            be recorded because its simulation fails; a town that is not asked for.
        FileFormatError: a scenario or its map is missing, malformed or inconsistent.
        UnsupportedError: what the reader, the version or the simulator cannot do, by name and line.
        StorageError: not a run, or the files cannot be written.
    """
    if flavour not in FLAVOURS:
        raise UnknownNameError("flavour", flavour, FLAVOURS)
    if town is not None and flavour != CARLA:
        raise InputError(f"a town is for the flavour '{CARLA}' only, got '{town}' for '{flavour}'")
    if town is not None and not _LEVEL.fullmatch(town):
        raise InputError(f"a town must be the name of one of CARLA's maps, got '{town}'")
    paths = _chosen(source, scenarios)
    if flavour == CARLA and town is None and not is_storyboard(source):
        town = _town_of(source)
    base = source.parent if is_storyboard(source) else source
    folder = out or base / EXPORT / flavour
    found = []
    for path in paths:
        found += _export(path, FLAVOURS[flavour], folder, town, ego)
        if notes is not None:
            notes += _ignored_drivers(path, flavour)
    beside = {folder / name: data() for name, data in _BESIDE.get(flavour, {}).items()}
    _write(beside, folder, ())
    return [*found, *beside]


OSI = "osi"


def export_traces(
    source: Path,
    *,
    scenarios: Sequence[str] = (),
    out: Path | None = None,
    ego: str | None = None,
    notes: list[str] | None = None,
) -> list[Path]:
    """Write motion as ASAM OSI: a GroundTruth and a SensorView file of each scenario or recording.

    Args:
        source: the folder of a run, or one ``.xosc`` file, simulated in the embedded simulator;
            or a recording of a format that `bridgegen.recordings.readers` knows.
        scenarios: names of a run's scenarios; all but the minimal ones by default.
        out: the folder to write to; ``export/osi`` in the run's or the file's by default.
        ego: the driver of the ego; the files' by default.
        notes: takes a sentence for what a recording leaves open.

    Returns:
        The files written.

    Raises:
        BridgeGenError: as `export`; or scenarios or a driver are chosen of a recording, or one is
            too large or of no known format.
    """
    traces: Iterable[tuple[str, Rollout, Surroundings]]
    if source.is_dir() or is_storyboard(source):
        chosen = _chosen(source, scenarios)
        results = ((path.stem, _simulated(path, ego)) for path in chosen)
        traces = ((name, result.rollout, result.around()) for name, result in results)
    elif scenarios or ego is not None:
        raise InputError(f"{source}: is a recording, of which no scenario or driver is chosen")
    else:
        traces = _of_recording(source, [] if notes is None else notes)
    folder = out or (source if source.is_dir() else source.parent) / EXPORT / OSI
    written: list[Path] = []
    for name, rollout, around in traces:
        _write({}, folder, ())
        paths = [folder / f"{name}{ending}" for ending in ENDINGS.values()]
        write_osi(paths, rollout, around)
        written += paths
    return written


RERUN, OPENLABEL = "rerun", "openlabel"
_ENDINGS = {RERUN: ".rrd", OPENLABEL: ".openlabel.json"}


def export_beside(
    source: Path,
    flavour: str,
    *,
    scenarios: Sequence[str] = (),
    out: Path | None = None,
    ego: str | None = None,
) -> list[Path]:
    """Write of each scenario, as it is simulated, one file that no simulator runs.

    Args:
        source: the folder of a run, or one ``.xosc`` file.
        flavour: "rerun", see `bridgegen.pages.rerun`, or "openlabel", tags of the scenario.
        scenarios: names of a run's scenarios; all but the minimal ones by default.
        out: the folder to write to; ``export/FLAVOUR`` in the run's or the file's by default.
        ego: the driver of the ego; the files' by default.

    Returns:
        The files written.

    Raises:
        BridgeGenError: as `export`; or an extra is missing, or the scenario of the run is not what
            it was.
    """
    if flavour == RERUN:
        require(RERUN, "--flavour rerun")
    paths = _chosen(source, scenarios)
    folder = out or (source if source.is_dir() else source.parent) / EXPORT / flavour
    tagged = None if flavour == RERUN else _tagging(source)
    for path in paths:
        result = _simulated(path, ego)
        target = folder / f"{path.stem}{_ENDINGS[flavour]}"
        _write({} if tagged is None else {target: tagged(path, result.rollout)}, folder, ())
        if tagged is None:
            write_rerun(target, result, path.stem)
    return [folder / f"{path.stem}{_ENDINGS[flavour]}" for path in paths]


def _tagging(source: Path) -> Callable[[Path, Rollout], bytes]:
    """Return what tags a scenario of a run, or a file."""
    if source.is_dir():
        searched_scenario, _, roads = searched(Run(source))
        states = states_of(searched_scenario, on_map=roads is not None)
    else:
        searched_scenario = load(source)
        states = states_of(searched_scenario, on_map=True)
    codes = {
        name: {word: float(code) for code, word in enumerate(parameter.kind.names)}
        for name, parameter in searched_scenario.parameters.items()
    }

    def tagged(path: Path, rollout: Rollout) -> bytes:
        row: dict[str, float] = {}
        if source.is_dir():
            for name, of in read_parameters(path.with_suffix(".json")).items():
                value = codes.get(name, {}).get(of.value) if isinstance(of.value, str) else of.value
                row |= {} if value is None else {name: value}
        else:
            space = searched_scenario.space()
            row = space.values(space.row({}))
        scenario, _ = _read(path)
        return openlabel(path.stem, _resolved(scenario, path), states, row, rollout)

    return tagged


def _of_recording(path: Path, notes: list[str]) -> Iterator[tuple[str, Rollout, Surroundings]]:
    """Yield name and motion of each recording in a file; its ego is who is there longest."""
    from bridgegen.recordings.excerpt import clock_of, excerpt
    from bridgegen.recordings.readers.clean import clean
    from bridgegen.recordings.readers.formats import read as read_recordings

    for number, recorded_traffic in enumerate(read_recordings(path), 1):
        traffic = clean(recorded_traffic, recorded_traffic.facts.time_step).traffic
        clock = clock_of(traffic)
        begin, end, count = int(clock.begin.min()), int(clock.end.max()), len(traffic.names)
        if (states := (end - begin + 1) * count) > MAX_STATES:
            raise InputError(
                f"{path}: a recording may have {MAX_STATES:,} instants times participants, got "
                f"{states:,}"
            )
        ego = int(np.argmax(clock.end - clock.begin))
        others = [p for p in range(count) if p != ego]
        name = path.stem if number == 1 else f"{path.stem}-{number}"
        notes.append(f"{path}: the host vehicle of {name} is '{traffic.names[ego]}'; no map")
        yield name, excerpt(traffic, clock, ego, others, begin, end), Surroundings()


def _ignored_drivers(path: Path, flavour: str) -> list[str]:
    """Return what a flavour cannot say of who drives the participants other than the ego."""
    if flavour == RECORDED:  # their motion is in the file
        return []
    scenario, _ = _read(path)
    # Any driver of the ego: the question is about the others.
    program = compile_storyboard(scenario, str(path), driver=DRIVERS["route-follower"])
    driven = np.flatnonzero(program.others != SCRIPTED)
    names = ", ".join(f"'{program.names[e]}'" for e in driven.tolist())
    if not names:
        return []
    codes = {code: name for name, code in CODES.items()}
    driver = "' or '".join(codes[code] for code in np.unique(program.others[driven]))
    what = (
        f"other tools than BridgeGen ignore their driver '{driver}' and move them as the "
        f"storyboard says; --flavour {RECORDED} has them move as they did"
    )
    if flavour == CARLA:
        what = (
            f"they repeat the motion that their driver '{driver}' gave them when the exported ego "
            "drove; they do not react to another one"
        )
    return [f"{path}: participants {names}: {what}"]


def _town_of(run: Path) -> str | None:
    """Return the town that a run was made on; None if it was made on another map."""
    made_on = Run(run).settings.road_map
    stem = Path(made_on).stem if made_on else ""
    return stem if _TOWN.fullmatch(stem) else None


def _chosen(source: Path, scenarios: Sequence[str]) -> list[Path]:
    """Return the files to export, in the order of their names."""
    if is_storyboard(source):
        if scenarios:
            raise InputError(f"{source}: scenarios are chosen of a run; this is one scenario")
        return [source]
    Run(source)  # refuses what is not a run
    kept = {path.stem: path for path in sorted((source / FOLDER).glob("*.xosc"))}
    if not kept:
        raise InputError(
            f"{source}: no scenario was exported ({FOLDER}/ has none): the run found nothing "
            f"critical, or is to be finished first: bridgegen resume {source}"
        )
    for name in scenarios:
        if name not in kept:
            raise UnknownNameError(f"scenario of {source}", name, kept)
    if scenarios:
        return [path for name, path in kept.items() if name in scenarios]
    return [path for name, path in kept.items() if not name.startswith(MINIMAL)]


def _read(path: Path) -> tuple[osc.OpenScenario, OpenDrive]:
    """Return a scenario file with its map, as it is simulated."""
    scenario = read(path)
    roads = roads_of(scenario, path)
    return prepared(scenario, roads, str(path)), roads


def _export(
    path: Path, flavour: Flavour, folder: Path, town: str | None, ego: str | None
) -> list[Path]:
    scenario, roads = _read(path)
    if problems := validate.problems(scenario, roads):
        raise FileFormatError(*(f"{path}: {problem}" for problem in problems))
    made, maps = flavour(scenario, path, ego), []
    if scenario.road_network.logic_file is not None and town is None:
        maps = [logic_path(scenario, path)]
    made = _moved(made, path, [item.name for item in maps], folder)
    if town is not None:
        made = replace(made, road_network=osc.RoadNetwork(osc.File(town)))
    if flavour is _carla and made.road_network.logic_file is None:
        raise InputError(f"{path}: a map, or a town, must be named for ScenarioRunner")
    files = {folder / path.name: to_xml(made)} | {
        folder / item.name: read_bytes(item) for item in maps
    }
    _write(files, folder, (path, *maps))
    return list(files)


def _write(files: Mapping[Path, bytes], folder: Path, sources: Sequence[Path]) -> None:
    """Write files, but over none of the sources."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for target in files:
            # Links make other names of one file: samefile asks the disk.
            if target.exists() and any(target.samefile(source) for source in sources):
                raise StorageError(f"{target}: is what is exported, and is not overwritten")
        # Only after all targets are checked: a refusal leaves no part of an export.
        for target, data in files.items():
            target.write_bytes(data)
    except OSError as error:
        raise StorageError(f"{folder}: cannot be written: {error.strerror}") from None


def _moved(
    scenario: osc.OpenScenario, path: Path, maps: Sequence[str], folder: Path
) -> osc.OpenScenario:
    """Return a scenario for another folder, where its map, if it has one, lies beside it."""
    roads = scenario.road_network
    scene = roads.scene_graph_file
    if scene is not None and isinstance(scene.filepath, str) and scene.filepath:
        scene = osc.File(Path(os.path.relpath(path.parent / scene.filepath, folder)).as_posix())
    return replace(
        scenario,
        road_network=replace(
            roads, logic_file=osc.File(maps[0]) if maps else None, scene_graph_file=scene
        ),
    )


def _resolved(scenario: osc.OpenScenario, path: Path, ego: str | None = None) -> osc.OpenScenario:
    made = resolved(_keyed(scenario), str(path))
    return to_version(made, least_version(made), str(path))


def _keyed(scenario: osc.OpenScenario) -> osc.OpenScenario:
    """Return a scenario that says the key of its driver's random numbers.

    Without parameters it would follow from nothing, and the driver would see other things.
    """
    return keyed(scenario, str(noise_key(numbers(scenario), 1)[0]))


def _recorded(scenario: osc.OpenScenario, path: Path, ego: str | None) -> osc.OpenScenario:
    """Return a scenario as its own ego drives it in the embedded simulator."""
    return recorded(_resolved(scenario, path), _recording(path, ego))


def _simulated(path: Path, ego: str | None) -> FileResult:
    result = simulate_file(path, ego=ego)
    if result.status != "ok":
        raise InputError(f"{path}: its simulation must succeed to be recorded: {result.status}")
    return result


def _recording(path: Path, ego: str | None) -> Recording:
    """Return what the embedded simulator records of a file until it stops."""
    rollout = _simulated(path, ego).rollout
    n = rollout.n_steps[0]
    x, y, h, v = (array[0, :, :n] for array in (rollout.x, rollout.y, rollout.h, rollout.v))
    return Recording(
        names=rollout.names,
        time_step=rollout.time_step,
        x=x,
        y=y,
        h=h,
        v=v,
        began=rollout.began[0].tolist(),
        present=rollout.present[0, :, :n] if rollout.present.size else None,
        light_names=rollout.light_names,
        lights=rollout.lights[0, :, :n],
    )


def _in_version(
    version: str, scenario: osc.OpenScenario, path: Path, ego: str | None
) -> osc.OpenScenario:
    return to_version(scenario, version, str(path))


def _carla(scenario: osc.OpenScenario, path: Path, ego: str | None) -> osc.OpenScenario:
    """Return a scenario for CARLA's ScenarioRunner, which all but its ego go through again."""
    plain = _resolved(scenario, path)
    name, recording = f"{plain.file_header.description}-{path.stem}", _recording(path, ego)
    try:
        return for_scenario_runner(plain, recording, roads_of(scenario, path), name)
    except UnsupportedError as error:
        raise UnsupportedError(*(f"{path}: {problem}" for problem in error.problems)) from None


def _control() -> bytes:
    package = "bridgegen.openx.openscenario.scenario_runner"
    return (resources(package) / CONTROL).read_bytes()


CARLA, RECORDED = "carla", "recorded"
_BESIDE: Mapping[str, Mapping[str, Callable[[], bytes]]] = {CARLA: {CONTROL: _control}}
"""Further files that a flavour needs: functions that return the contents, by file name."""
_LEVEL = re.compile(r"\w+")
_TOWN = re.compile(r"Town\d\d(HD)?(_Opt)?")

FLAVOURS: dict[str, Flavour] = {
    **{version: partial(_in_version, version) for version in VERSIONS},
    "resolved": _resolved,
    RECORDED: _recorded,
    CARLA: _carla,
}
"""Formats of an export: a version of the standard with parameters; 1.2 without; the motion as the
embedded simulator recorded it, in 1.2; or 1.0 for CARLA's ScenarioRunner."""
