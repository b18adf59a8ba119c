"""One scenario file, of any origin, or one row of a logical scenario: simulated and measured.

The stages are the pipeline's, without imports of the search: this must start fast.
"""

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path

import numpy as np
import numpy.typing as npt

from bridgegen import drivers as egos
from bridgegen.assess import metrics as measures
from bridgegen.assess.conflict import quantities
from bridgegen.assess.conflict.analysis import Conflicts, analyse
from bridgegen.assess.conflict.findings import Findings, is_unsafe_start, why_unjudged
from bridgegen.assess.conflict.happening import Happening, happened
from bridgegen.assess.conflict.harm import NEAR_MISS, decisive
from bridgegen.assess.conflict.plausibility import plausibility
from bridgegen.assess.criteria import CriterionResult, Monitor
from bridgegen.assess.metrics import Need
from bridgegen.base.errors import FileFormatError, UnknownNameError
from bridgegen.drivers import STORYBOARD
from bridgegen.drivers.kinds import NAMES
from bridgegen.engine.domain import against_ego, needed, unhaunted, why_outside
from bridgegen.engine.options import checked
from bridgegen.openx.opendrive.model import OpenDrive
from bridgegen.openx.openscenario import validate as openscenario_validate
from bridgegen.openx.openscenario.declarations import CAUSE
from bridgegen.openx.openscenario.model import OpenScenario
from bridgegen.openx.openscenario.pruning import NEVER, read_empty_triggers
from bridgegen.openx.openscenario.read import read as read_scenario
from bridgegen.openx.openscenario.stated_criteria import stated_criteria
from bridgegen.openx.openscenario.tier4 import is_storyboard
from bridgegen.openx.prepared import prepared, roads_of
from bridgegen.scenario.language.criteria import Criterion, joined
from bridgegen.simulation.choice import EMBEDDED, SimulatorChoice
from bridgegen.simulation.embedded.places.network import Network
from bridgegen.simulation.embedded.simulator import EmbeddedSimulator
from bridgegen.simulation.osi.trace import Surroundings
from bridgegen.simulation.rollout import STATUS_MESSAGES, Incident, Rollout


@dataclass(frozen=True)
class FileResult:
    """The result of one scenario file, or of one row of a logical scenario.

    Attributes:
        driver: of the ego, by name.
        status: "ok", or why there is no result.
        seconds: simulated until the stop trigger fired [s].
        parameters: the file's numeric parameters, or the row's.
        metrics: by name, in the metric's unit; the quantities of the conflict analysis too.
        rollout: the motion, N = 1.
        criteria: the pass criteria, those that the file states among them, with their margins.
        conflicts: the conflict analysis, N = 1; `bridgegen.assess.conflict.summary.summarise` gives
            the decisive conflict.
        cause: of its harm, by the search that exported the file, as its header states; None where
            it states none, or another driver than the file's drives.
        notes: what runs otherwise than a reader of the file may expect, a sentence each.
        unjudged: why the scenario says nothing of the ego: its traffic could not happen, or left no
            time to act from the start on; or the ego does not fail, and nothing happened, or its
            driver is not made for the scenario. "" if it does.
        around: returns its map and its weather.
    """

    driver: str
    status: str
    seconds: float
    parameters: Mapping[str, float]
    metrics: Mapping[str, float]
    rollout: Rollout
    conflicts: Conflicts
    criteria: tuple[CriterionResult, ...] = ()
    cause: str | None = None
    notes: tuple[str, ...] = ()
    unjudged: str = ""
    around: Callable[[], Surroundings] = field(default=Surroundings, repr=False, compare=False)

    @property
    def incidents(self) -> tuple[Incident, ...]:
        """The incidents that the simulator itself reported."""
        return self.rollout.incidents.get(0, ())

    def unless(self, unjudged: str) -> "FileResult":
        """Return the same, not judged for another reason unless there is one already."""
        return replace(self, unjudged=self.unjudged or unjudged)


@checked
def simulate_file(
    path: Path | str,
    *,
    ego: str | None = None,
    ideal: Iterable[str] | None = None,
    vehicle: str | None = None,
    others: str | None = None,
    empty_trigger: str = NEVER,
    time_limit: float | None = None,
    metrics: Sequence[str] | None = None,
    also: Sequence[str] = (),
    time_step: float | None = None,
    skipped: list[str] | None = None,
    simulator: SimulatorChoice = EMBEDDED,
    criteria: Sequence[Criterion] = (),
) -> FileResult:
    """Run an OpenSCENARIO file with the OpenDRIVE map that it names.

    Args:
        path: the ``.xosc`` file.
        ego: the ego's driver; what the file's controller says by default.
        ideal: stages of the driver to be ideal; what the file's controller says by default, none
            with another ``ego``.
        vehicle: how the ego moves, see `bridgegen.simulation.vehicles`; what the file says by
            default, or kinematically.
        others: "attentive", "insistent", "lawful" or "scripted": who drives the other participants;
            what their controllers say by default.
        empty_trigger: when acts and events start whose StartTrigger is empty: "never", or "now".
        time_limit: [s] that one call of a user's own driver may take.
        metrics: names; all that the driver gives rise to by default.
        also: names of metrics that must be among them.
        time_step: [s]; what the file's header says by default.
        skipped: takes a sentence for each thing that is not supported, which is left out then
            instead of refused, with the event, action, entity or condition group around it.
        simulator: which one runs it.
        criteria: pass criteria, besides those that the file states.

    Raises:
        InputError: a time step out of range, a stage that the driver has not, or a simulator that
            is not where it should be.
        FileFormatError: a file is missing, malformed or inconsistent.
        UnsupportedError: an element that the simulator cannot run, by name and line.
        UnknownNameError: no such driver, vehicle, stage, metric or reading of empty triggers.
    """
    path = Path(path)
    if path.suffix.lower() in (".yaml", ".yml", ".osc") and not is_storyboard(path):
        raise FileFormatError(
            f"{path}: one OpenSCENARIO file (.xosc) is simulated; a YAML file describes many "
            f"scenarios, of which 'bridgegen simulate' and bridgegen.model simulate one"
        )
    driver = egos.get(ego, time_limit=time_limit) if ego else None
    if others is not None and others not in egos.OTHERS:
        raise UnknownNameError("driver of other participants", others, egos.OTHERS)
    warnings: list[str] = []
    scenario = read_scenario(path, skipped=skipped, warnings=warnings)
    scenario = read_empty_triggers(scenario, empty_trigger)
    roads = roads_of(scenario, path)
    scenario = prepared(scenario, roads, str(path))
    problems = openscenario_validate.problems(scenario, roads)
    if problems:
        raise FileFormatError(*(f"{path}: {problem}" for problem in problems))
    embedded = EmbeddedSimulator(
        scenario,
        str(path),
        driver=driver,
        ideal=ideal,
        vehicle=vehicle,
        others=others,
        time_step=time_step,
        skipped=skipped,
    )
    runs = simulator.around(embedded, scenario)
    held = measures.held_by(embedded.program.driver, detects=simulator.detects)
    names = measured(metrics, also, held, embedded.driver)
    # The cause in the header was found with the file's own drivers and vehicle; it says nothing of
    # others.
    changes = any(iterable is not None for iterable in (ego, ideal, vehicle, others))
    stated, unknown = stated_criteria(scenario)
    monitor = Monitor(
        joined(stated, criteria),
        embedded.program.names,
        held,
        embedded.duration,
        f"the driver '{embedded.driver}'",
        has_odd=len(embedded.program.limits) > 0,
    )
    network = embedded.roads([roads])
    # Ways are planned once: another simulator's roads are files besides.
    made = network if runs is embedded else runs.roads([roads])
    rollout = runs.run(made, np.zeros(1, dtype=np.int64), {})
    return replace(
        result_of(rollout, names, embedded.driver, monitor, may_stop=bool(stated)),
        parameters=embedded.parameters,
        cause=None if changes else _stated_cause(scenario),
        notes=(*warnings, *(f"{path}: {name}" for name in unknown), *embedded.program.notes),
        around=partial(surroundings, embedded, roads, {}, rollout),
    ).unless(_outside(embedded, roads, network, rollout, path.stem))


def surroundings(
    embedded: EmbeddedSimulator,
    roads: OpenDrive,
    values: Mapping[str, npt.ArrayLike],
    rollout: Rollout,
) -> Surroundings:
    """Return the map and the weather of a rollout, N = 1, of these values of the parameters."""
    known = rollout.began.size or not rollout.event_names
    return Surroundings(roads, embedded.weathers(values, rollout, 0) if known else ())


def measured(
    metrics: Sequence[str] | None, also: Sequence[str], held: Collection[Need], driver: str
) -> tuple[str, ...]:
    """Return the names of the metrics to report, all of which exist."""
    names = (*measures.existing(tuple(measures.METRICS), held), *quantities.MEASURED)
    asked = tuple(dict.fromkeys((*measures.read(metrics or names), *also)))
    return quantities.require(asked, held, f"the driver '{driver}'")


def result_of(
    rollout: Rollout, names: Sequence[str], driver: str, monitor: Monitor, *, may_stop: bool
) -> FileResult:
    """Return the result of a rollout, N = 1, without what it is of."""
    conflicts = analyse(rollout)
    values = quantities.evaluate(rollout, names)[0]
    return FileResult(
        driver=driver,
        status=": ".join([STATUS_MESSAGES[int(rollout.status[0])], *rollout.messages.values()]),
        seconds=float(rollout.n_steps[0] - 1) * rollout.time_step,
        parameters={},
        metrics=dict(zip(names, values.tolist(), strict=True)),
        rollout=rollout,
        conflicts=conflicts,
        criteria=monitor.results(rollout, 0),
        unjudged=_unjudged(rollout, conflicts, may_stop=may_stop),
    )


def _unjudged(rollout: Rollout, conflicts: Conflicts, *, may_stop: bool) -> str:
    """Return why a run says nothing of its ego, by the rules of a suite's entry; "" if it does."""
    findings = Findings.of(conflicts, plausibility(rollout).labels)
    _, harm = decisive(conflicts)
    unsafe = bool(is_unsafe_start(findings, harm)[0])
    if why := why_unjudged(str(findings.implausible[0]), unsafe):
        return why
    happening = Happening.of(happened(rollout, may_stop=may_stop))
    if harm[0] >= NEAR_MISS or happening.happened:
        return ""
    return "the scenario did not happen: " + "; ".join(happening.reasons)


def _outside(
    embedded: EmbeddedSimulator, roads: OpenDrive, network: Network, rollout: Rollout, name: str
) -> str:
    """Return a sentence if the scenario says nothing of the ego's driver; "" if it does."""
    if embedded.program.driver == STORYBOARD or rollout.status[0]:
        return ""
    program = embedded.program
    if why := unhaunted(program.driver, name, program):
        return why
    headings = rollout.h[0, :, 0]
    kinds = [NAMES[kind] for kind in rollout.kinds[1:].tolist()]
    needs = needed(roads, network.roads_ahead(0), headings, kinds)
    return why_outside(program.driver, name, needs, bool(against_ego(headings).any()))


def _stated_cause(scenario: OpenScenario) -> str | None:
    properties = scenario.file_header.properties
    stated = properties.get(CAUSE) if properties else None
    return None if stated is None else str(stated)
