"""Estimates a risk: exposure and driver, an experiment, a method, the result."""

import hashlib
import shlex
from collections.abc import Callable
from dataclasses import dataclass, field
from importlib.metadata import version
from pathlib import Path
from typing import Any, cast

import numpy as np

from bridgegen import drivers as egos
from bridgegen.assess.conflict.analysis import CONTACT, VIOLATION
from bridgegen.assess.conflict.findings import KINDS
from bridgegen.assess.conflict.harm import NEAR_MISS, Count
from bridgegen.base.arrays import Float
from bridgegen.base.errors import InputError, Interrupted, UnknownNameError
from bridgegen.engine.options import PipelineOptions, checked
from bridgegen.engine.pipeline import Pipeline
from bridgegen.engine.workers import CarriedDriver, Choice, open_workers
from bridgegen.jobs.risk import experiment as methods
from bridgegen.jobs.risk.elsewhere import HERE, kept_elsewhere, look_elsewhere
from bridgegen.jobs.risk.estimators import monte_carlo
from bridgegen.jobs.risk.estimators.problem import Aim
from bridgegen.jobs.risk.experiment import Experiment
from bridgegen.jobs.risk.ledger import Ledger
from bridgegen.jobs.risk.most_likely import find_most_likely, write_most_likely
from bridgegen.jobs.risk.outcomes import LEAST, data_band
from bridgegen.jobs.risk.outcomes import require as require_event
from bridgegen.jobs.risk.result import Risk
from bridgegen.jobs.search.run import Run
from bridgegen.jobs.search.scenarios import driven_by, is_file, load
from bridgegen.results.store import Store
from bridgegen.scenario.exposure import Exposure
from bridgegen.scenario.exposure.fit import Fit, fit_exposure
from bridgegen.scenario.exposure.reader import UNIFORM, chosen_exposure
from bridgegen.scenario.exposure.tables import read_header
from bridgegen.scenario.language.scenario import LogicalScenario
from bridgegen.simulation.choice import EMBEDDED, SimulatorChoice

LEAST_EVALUATIONS, MOST_EVALUATIONS = 20, 10**10
MOST_ELSEWHERE = 10**6  # rows in another simulator
OTHER_ROWS = 2  # added to the seed: no method counts rows of that one
FAR = 4.0
"""Normal scores beyond which a row of a search is moved: those of a range's ends are infinite."""


@dataclass(frozen=True)
class RiskCallbacks:
    """Called as an estimate progresses.

    Attributes:
        compile: before kernels are compiled.
        evaluations: with the number of evaluations so far, and the budget.
        elsewhere: with the number of rows in another simulator so far, and of all.
    """

    compile: Callable[[], None] = field(default=lambda: None)
    evaluations: Callable[[int, int], None] = field(default=lambda done, total: None)
    elsewhere: Callable[[int, int], None] = field(default=lambda done, total: None)


@checked
def estimate_risk(
    scenario: str | Path,
    *,
    ego: str | None = None,
    exposure: str | Path | Exposure | None = None,
    event: str = "collision",
    count: str = "ego",
    method: str = methods.AUTO,
    precision: float = 0.2,
    budget: int = 200_000,
    seed: int = 0,
    start: str | Path | None = None,
    check: int = 0,
    events: str | Path | Fit | None = None,
    vehicle: str | None = None,
    others: str | None = None,
    simulator: SimulatorChoice | str | None = None,
    simulator_rows: int = 200,
    workers: Choice = None,
    out: Path | str | None = None,
    callbacks: RiskCallbacks | None = None,
) -> Risk:
    """Estimate how likely harm is per encounter, with an interval, and how often it happens.

    Called again with the same arguments after it was stopped, it resumes. The result depends
    neither on that nor on the workers.

    Args:
        scenario: a name of the catalogue or of a pack, or the path of a YAML file.
        ego: the driver under test; the scenario's choice by default.
        exposure: a file, the name of an example, `UNIFORM`, or the exposure itself; by default
            that of the scenario's own file.
        event: the one that is aimed at, see `events.EVENTS`.
        count: "ego": conflicts that the ego is responsible for or could prevent; "any": all.
        method: one of `methods.METHODS`.
        precision: half of the 95 % interval over the estimate, at which it stops; 0: use the whole
            budget.
        budget: evaluations of the estimate, at most; a tenth more, 2,048 at most for each failure
            mode, look for its most likely harmful row.
        seed: where all chance comes from, at least 0.
        start: a search's run, whose harmful rows importance sampling may use.
        check: evaluations of Monte Carlo beside, to compare with; 0 for none.
        events: the table (.csv) that the exposure was fitted to, or the fit, to say how much few
            data leave open.
        vehicle: how the ego moves.
        others: driver of the other participants; the scenario's choice by default.
        simulator: another simulator in which rows around the harmful ones are simulated, too, to
            say by which factor the event is more or less likely there; none by default.
        simulator_rows: how many.
        workers: a number of processes, ``"ray"``, or ``"ray://HOST:PORT"``; threads by default.
        out: the folder; ``risk/SCENARIO`` by default.
        callbacks: called as it progresses.

    Raises:
        InputError: an invalid argument or file, or no exposure.
        StorageError: the folder holds something else, or cannot be written.
        Interrupted: Ctrl-C; what is done is kept.
    """
    say = callbacks or RiskCallbacks()
    aimed = require_event(event)
    methods.require(method)
    whose = _count(count)
    _require_numbers(precision, budget, seed, check, simulator_rows)
    elsewhere = SimulatorChoice(simulator) if isinstance(simulator, str) else simulator
    if elsewhere is not None and elsewhere.name == EMBEDDED.name:
        raise InputError(
            f"the risk is that in the simulator {EMBEDDED.name}; compare it with another one "
            "(--simulator)"
        )
    if ego is not None:
        egos.get(ego)
    logical = load(scenario)
    if not isinstance(logical, LogicalScenario):
        raise InputError(
            f"a risk is that of a logical scenario (.yaml) with an exposure, got {scenario}"
        )
    driven = cast(LogicalScenario, driven_by(logical, others))
    met = _exposure(driven, exposure)
    if met.dimensions == 0:
        raise InputError(
            f"the exposure of {driven.name} distributes no parameter: nothing is random"
        )
    fitted = _fit_of(driven, met, events)
    folder = Path("risk", driven.name) if out is None else Path(out)
    with open_workers(workers) as hands:
        options = PipelineOptions(ego=ego, vehicle=vehicle)
        pipeline = Pipeline(driven, met.space, options, workers=hands)
        name = pipeline.driver.name
        Z = None if start is None else _points_of(Path(start), met, event)
        settings = {
            "version": version("bridgegen"),
            "scenario": driven.name,
            "fingerprint": driven.fingerprint,
            "exposure": _digest(met),
            "driver": name,
            "file of the driver": CarriedDriver.of(name).digest,
            "vehicle": pipeline.runner.vehicle,
            "event": event,
            "count": count,
            "method": method,
            "precision": precision,
            "budget": budget,
            "seed": seed,
            "check": check,
            "start": None if Z is None else hashlib.sha256(Z.tobytes()).hexdigest(),
            "events": None if fitted is None else fitted.used,
        }
        there = None
        if elsewhere is not None:
            there = Pipeline(driven, met.space, options, simulator=elsewhere, workers=hands)
        asked = {"check": check, "from": start, "others": others, "events": events}
        if elsewhere is not None:
            asked |= {"simulator": elsewhere.name, "simulator-rows": simulator_rows}
        command = _command(scenario, exposure, settings, asked, elsewhere, folder)
        ledger = Ledger(folder, settings)
        say.compile()
        pipeline.warm_up()
        total = budget + check + (HERE if there else 0)
        experiment = Experiment(
            pipeline, met, hands, whose, ledger, lambda done: say.evaluations(done, total)
        )
        try:
            aim = Aim(aimed.score, LEAST, budget, precision)
            found = methods.estimate(method, experiment, aim, seed, Z)
            failed, implausible = experiment.failed, experiment.implausible
            beside = None
            if check:
                plain = Aim(aimed.score, LEAST, check, 0.0)
                beside = monte_carlo.estimate(experiment, plain, seed + OTHER_ROWS)
            likely = find_most_likely(experiment, met, found.weighted, aimed.score, budget, seed)
            other = None
            if there is not None and elsewhere is not None:
                kept = kept_elsewhere(folder, elsewhere, settings)
                beyond = Experiment(
                    there, met, hands, whose, kept,
                    lambda done: say.elsewhere(done, simulator_rows),
                )  # fmt: skip
                other = look_elsewhere(
                    experiment, beyond, elsewhere.name, found.weighted, aimed.score,
                    simulator_rows, seed,
                )  # fmt: skip
        except KeyboardInterrupt:
            raise Interrupted(folder, experiment.evaluations, total, command=command) from None
        data = None
        if fitted is not None and not found.weighted.doubts:
            data = data_band(met, found.weighted, aimed.score, fitted)
        shown = write_most_likely(pipeline, likely, whose, folder)
    result = Risk(
        met, pipeline.driver.label, event, count, found, seed, budget, tuple(experiment.modes),
        failed, implausible, beside, data, other, shown, command, folder,
    )  # fmt: skip
    result.write()
    return result


def _count(name: str) -> Count:
    if name == "ego":
        return "ego"
    if name == "any":
        return "any"
    raise UnknownNameError("count", name, ("ego", "any"))


def _require_numbers(precision: float, budget: int, seed: int, check: int, rows: int) -> None:
    problems = []
    if not 1 <= rows <= MOST_ELSEWHERE:
        problems.append(f"--simulator-rows must be 1 to {MOST_ELSEWHERE:,}, got {rows}")
    if not 0.0 <= precision < 1.0:
        problems.append(f"--precision must be at least 0 and below 1, got {precision:g}")
    if not LEAST_EVALUATIONS <= budget <= MOST_EVALUATIONS:
        problems.append(
            f"--budget must be {LEAST_EVALUATIONS} to {MOST_EVALUATIONS:,} evaluations, "
            f"got {budget}"
        )
    if not 0 <= check <= MOST_EVALUATIONS:
        problems.append(f"--check must be 0 to {MOST_EVALUATIONS:,} evaluations, got {check}")
    if seed < 0:
        problems.append(f"--seed must be at least 0, got {seed}")
    if problems:
        raise InputError(*problems)


def _exposure(scenario: LogicalScenario, given: str | Path | Exposure | None) -> Exposure:
    """Return the exposure that was asked for.

    Raises:
        InputError: there is none, or it is that of another scenario.
    """
    found = chosen_exposure(scenario, given)
    if found is None:
        raise InputError(
            f"{scenario.name} has no exposure: how likely its parameters' values are is not known. "
            "Name a file (--exposure FILE; 'bridgegen fit' makes one of recorded events), or "
            f"--exposure {UNIFORM}, which says what share of the ranges is harmful"
        )
    return found


def _fit_of(
    scenario: LogicalScenario, exposure: Exposure, events: str | Path | Fit | None
) -> Fit | None:
    """Return the fit to the events that an exposure was fitted to, if they are given.

    Raises:
        FileFormatError: the table cannot be read.
        InputError: it has none of the exposure's parameters, or too few rows.
    """
    if events is None or isinstance(events, Fit):
        return events
    columns = read_header(Path(events))
    if not (wanted := [name for name in columns if name in exposure.marginals]):
        raise InputError(
            f"{events}: has none of the exposure's parameters, {', '.join(exposure.marginals)}"
        )
    others = [name for name in columns if name not in wanted]
    is_whole = len(wanted) == len(exposure.marginals)
    return fit_exposure(
        scenario, events, ignore=others, others="default" if is_whole else "uniform"
    )


def _points_of(run: Path, exposure: Exposure, event: str) -> Float:
    """Return the points that a search's rows stand for, of those in which the event happens.

    Rows at an end of a range stand for points near it.

    Raises:
        StorageError: it is no run.
        InputError: it is one of another scenario, or found none.
    """
    found = Run(run)
    with Store.open(run) as store:
        rows = store.read()
    space = exposure.space
    if tuple(found.parameters) != tuple(space.names):
        raise InputError(f"{run}: a run of another scenario than {exposure.scenario.name}, or axes")
    if "harm" not in found.metrics:
        raise InputError(f"{run}: does not record harm")
    happens = rows.metrics[:, found.metrics.index("harm")] >= NEAR_MISS
    if event == "collision":
        happens &= rows.findings.conflict == KINDS[CONTACT]
    happens &= rows.findings.conflict != KINDS[VIOLATION]
    good = happens & exposure.feasible(rows.X)
    X = rows.X[good]
    X = X[np.isfinite(exposure.log_density(X))] if len(X) else X
    if not len(X):
        raise InputError(f"{run}: found no {event} that the exposure allows")
    return np.clip(exposure.to_normal(X), -FAR, FAR)


def _digest(exposure: Exposure) -> str:
    """Return a digest of an exposure: of 64 of its rows, and of its source."""
    rows = exposure.sample(64, 0).X
    return hashlib.sha256(rows.tobytes() + exposure.source.encode()).hexdigest()


def _command(
    scenario: str | Path, exposure: str | Path | Exposure | None, settings: dict[str, Any],
    asked: dict[str, Any], elsewhere: SimulatorChoice | None, folder: Path,
) -> str:  # fmt: skip
    """Return the command line that makes the risk again.

    ``settings`` are those that it always names, ``asked`` those that have a value.
    """
    where = str(Path(scenario).resolve()) if is_file(scenario) else str(scenario)
    words: list[Any] = ["bridgegen", "risk", where, "--ego", settings["driver"]]
    if exposure is not None:
        words += ["--exposure", "EXPOSURE" if isinstance(exposure, Exposure) else exposure]
    for name in ("event", "count", "method", "precision", "budget", "seed", "vehicle"):
        words += [f"--{name}", settings[name]]
    words += [word for name, value in asked.items() if value for word in (f"--{name}", value)]
    if elsewhere is not None:
        for name, value in elsewhere.settings.items():
            words += ["--simulator-set", f"{name}={value}"]
    return shlex.join([str(one) for one in (*words, "--out", folder)])
