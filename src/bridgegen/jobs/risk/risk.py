"""Estimates a risk: exposure and driver, an experiment, a method, the result."""

import hashlib
import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from importlib.metadata import version
from pathlib import Path
from typing import Any, cast

import numpy as np

from bridgegen import drivers as egos
from bridgegen.assess.conflict.analysis import CONTACT, VIOLATION, encounters
from bridgegen.assess.conflict.findings import KINDS
from bridgegen.assess.conflict.harm import NEAR_MISS, Count, decisive
from bridgegen.assess.conflict.summary import summarise
from bridgegen.base.arrays import Bool, Float
from bridgegen.base.errors import InputError, Interrupted, StorageError, UnknownNameError
from bridgegen.drivers.identity import digest_of
from bridgegen.engine.options import PipelineOptions, called_with
from bridgegen.engine.pipeline import Pipeline
from bridgegen.engine.workers import Workers, open_workers
from bridgegen.jobs.frame import as_names, command_of, require_ranges
from bridgegen.jobs.risk import experiment as methods
from bridgegen.jobs.risk.cross_simulator import HERE, kept_elsewhere, look_elsewhere
from bridgegen.jobs.risk.estimators import exploration as design_point
from bridgegen.jobs.risk.estimators import monte_carlo
from bridgegen.jobs.risk.estimators.problem import Aim, block_of
from bridgegen.jobs.risk.estimators.weighted import Weighted
from bridgegen.jobs.risk.experiment import Estimated, Experiment
from bridgegen.jobs.risk.ledger import MOST_LIKELY, Ledger
from bridgegen.jobs.risk.options import RiskOptions
from bridgegen.jobs.risk.outcomes import LEAST, Column, data_band
from bridgegen.jobs.risk.outcomes import require as require_event
from bridgegen.jobs.risk.result import Likely, Risk
from bridgegen.jobs.search.run import Run
from bridgegen.jobs.search.scenario_files import write_scenario
from bridgegen.jobs.search.scenarios import driven_by, load, within
from bridgegen.pages.moving import moving_picture
from bridgegen.pages.scenery import Scenery
from bridgegen.results.store import Store
from bridgegen.scenario.exposure import Exposure
from bridgegen.scenario.exposure.fit import Fit, fit_exposure
from bridgegen.scenario.exposure.reader import UNIFORM, chosen_exposure
from bridgegen.scenario.exposure.tables import read_header
from bridgegen.scenario.language.scenario import LogicalScenario
from bridgegen.simulation.choice import EMBEDDED
from bridgegen.simulation.rollout import Rollout

# --- Finds, writes and pictures the most likely harmful encounter of each failure mode ---


_STREAM = 4  # of random numbers, beside those of estimators
MOST_MODES = 5
BEFORE, AFTER = 4.0, 2.0  # s, of the picture, around the conflict's most urgent instant


def find_most_likely(
    experiment: Experiment,
    exposure: Exposure,
    known: Weighted,
    threshold: float,
    budget: int,
    seed: int,
) -> dict[str, Float]:
    """Return the harmful row of each failure mode that is most likely on the road.

    Args:
        experiment: simulates rows.
        exposure: how likely they are.
        known: what an estimator found.
        threshold: of the score, from which a row is harmful.
        budget: the estimate's; a tenth of it is simulated at most.
        seed: of all random numbers.

    Returns:
        By the words of the failure mode, the likeliest first, `MOST_MODES` at most.
    """
    at = known.there(threshold) > 0.0
    Z, numbers = known.Z[at], known.outcomes[at, Column.MODE].astype(np.int64)
    sums = np.bincount(numbers, known.weights[at], len(experiment.modes))
    chosen = [int(k) for k in np.argsort(-sums, kind="stable")[:MOST_MODES] if sums[k] > 0.0]

    def log_density(Z: Float) -> Float:
        return exposure.log_density(exposure.from_normal(Z))

    evaluations = min(design_point.EVALUATIONS, budget // (10 * max(len(chosen), 1)))
    words = list(experiment.modes)
    found = {}
    for mode in chosen:
        # A stream for each mode: which others were found changes no mode's row.
        random = block_of(seed, 0, _STREAM, mode)

        def happens(outcomes: Float, mode: int = mode) -> Bool:
            same = outcomes[:, Column.MODE] == mode
            inside: Bool = same & (outcomes[:, Column.SCORE] >= threshold)
            return inside

        z = design_point.find(
            experiment, log_density, Z[numbers == mode], happens, evaluations, random
        )
        found[words[mode]] = exposure.from_normal(z[np.newaxis])[0]
    return found


def write_most_likely(
    pipeline: Pipeline, rows: Mapping[str, Float], count: Count, folder: Path
) -> tuple[Likely, ...]:
    """Write the most likely harmful row of each failure mode as a scenario, and picture it.

    Raises:
        StorageError: they cannot be written.
    """
    found = []
    for number, (mode, x) in enumerate(rows.items(), 1):
        name = f"{MOST_LIKELY}{number}"
        rollout = pipeline.rollout(x[np.newaxis])
        conflicts = encounters(rollout)
        conflict = summarise(conflicts, count=count)
        try:
            write_scenario(pipeline, x, folder, name, rollout=rollout, conflict=conflict)
        except OSError as error:
            raise StorageError(f"{folder}: cannot be written: {error.strerror}") from None
        other = int(decisive(conflicts, count)[0][0])
        instant, step = int(conflicts.instant[0, other]), rollout.time_step
        first = max(instant - round(BEFORE / step), 0)
        shown = _between(rollout, first, instant + round(AFTER / step) + 1)
        caption = f"the most likely harmful encounter ({mode}), from above"
        road = Scenery(pipeline.runner).road(x).outlines
        picture = moving_picture(shown, other, (instant - first) * step, caption, road=road)
        words = conflict.sentence if conflict is not None else ""
        found.append(Likely(mode, x, name, picture, words))
    return tuple(found)


def _between(rollout: Rollout, first: int, last: int) -> Rollout:
    """Return where everyone is between two instants."""
    there = rollout.present
    return replace(
        rollout,
        x=rollout.x[:, :, first:last],
        y=rollout.y[:, :, first:last],
        h=rollout.h[:, :, first:last],
        present=there[:, :, first:last] if there.size else there,
    )


LEAST_EVALUATIONS, MOST_EVALUATIONS = 20, 10**10
MOST_PRECISION = 0.999
MOST_ELSEWHERE = 10**6  # rows in another simulator
OTHER_ROWS = 2  # added to the seed: no method counts rows of that one
FAR = 4.0
"""Normal score beyond which a row of a search is moved: those of a range's ends are infinite."""


@called_with(RiskOptions)
def estimate_risk(given: RiskOptions) -> Risk:
    """Estimate how likely harm is per encounter, with an interval, and how often it happens.

    Called again with the same arguments after it was stopped, it resumes. The result depends
    neither on that nor on the workers.

    Returns:
        The risk; its record, page and tables are written.

    Raises:
        InputError: an invalid argument or file, or no exposure.
        StorageError: the folder holds something else, or cannot be written.
        Interrupted: Ctrl-C; what is done is kept.
    """
    require(given)
    with open_workers(given.workers) as hands:
        asked = prepare(given, hands)
        return finish(asked, Path("risk", asked.scenario.name))


def require(given: RiskOptions) -> None:
    """Check what does not depend on the scenario.

    Raises:
        InputError: an option is out of its range, or unknown.
    """
    require_event(given.event)
    methods.require(given.method)
    _count(given.count)
    require_ranges(
        given,
        {
            "simulator_rows": (1, MOST_ELSEWHERE),
            "precision": (0.0, MOST_PRECISION),
            "budget": (LEAST_EVALUATIONS, MOST_EVALUATIONS),
            "check": (0, MOST_EVALUATIONS),
            "seed": (0, math.inf),
        },
    )
    if given.simulator is not None and given.simulator.name == EMBEDDED.name:
        raise InputError(
            f"the risk is that in the simulator {EMBEDDED.name}; compare it with another one "
            "(--simulator)"
        )
    if given.ego is not None:
        egos.get(given.ego)


@dataclass(frozen=True)
class Asked:
    """A scenario whose risk is estimated.

    Attributes:
        given: the options.
        scenario: driven and bounded as was asked for.
        exposure: how its parameters are distributed.
        fit: to the events that the exposure was fitted to, if they are given.
        points: of the event that a search found, if there are.
        pipeline: of the driver.
        hands: that simulate.
    """

    given: RiskOptions
    scenario: LogicalScenario
    exposure: Exposure
    fit: Fit | None
    points: Float | None
    pipeline: Pipeline
    hands: Workers

    def settings(self, given: RiskOptions) -> dict[str, Any]:
        """Return what the batches of an estimate depend on, and nothing else."""
        # Workers, for one, may change between two calls.
        name, scenario, Z = self.pipeline.driver.name, self.scenario, self.points
        return {
            "version": version("bridgegen"),
            "scenario": scenario.name,
            "fingerprint": scenario.fingerprint,
            "exposure": _digest(self.exposure),
            "driver": name,
            "file of the driver": digest_of(name) or None,
            "vehicle": self.pipeline.runner.vehicle,
            "event": given.event,
            "count": given.count,
            "method": given.method,
            "precision": given.precision,
            "budget": given.budget,
            "seed": given.seed,
            "check": given.check,
            "start": None if Z is None else hashlib.sha256(Z.tobytes()).hexdigest(),
            "events": None if self.fit is None else self.fit.used,
            **({} if scenario.odd is None else {"odd": scenario.odd.odd.to_record()}),
        }

    def experiment(self, given: RiskOptions, folder: Path, total: int) -> Experiment:
        """Return the experiment of an estimate, whose batches are kept in a folder."""
        ledger, say = Ledger(folder, self.settings(given)), given.callbacks
        whose = _count(given.count)
        return Experiment(
            self.pipeline, self.exposure, self.hands, whose, ledger,
            lambda done: say.progress("simulations", done, total, ""),
        )  # fmt: skip

    def estimate(self, given: RiskOptions, experiment: Experiment) -> Estimated:
        """Return what an experiment says by the method that was asked for."""
        aim = Aim(require_event(given.event).score, LEAST, given.budget, given.precision)
        return methods.estimate(given.method, experiment, aim, given.seed, self.points)


def prepare(given: RiskOptions, hands: Workers) -> Asked:
    """Read a scenario and its exposure.

    Raises:
        InputError: not one scenario, or no exposure of it.
    """
    if len(names := as_names(given.scenario)) != 1:
        raise InputError(
            f"one scenario has a risk, got {len(names)}; of several: estimate_total_risk"
            if names
            else "missing: SCENARIO, or --catalogue for all that ship"
        )
    logical = load(names[0])
    if not isinstance(logical, LogicalScenario):
        raise InputError(
            f"a risk is that of a logical scenario (.yaml) with an exposure, got {names[0]}"
        )
    driven = cast(LogicalScenario, within(driven_by(logical, given.others), given.odd))
    if len(exposures := as_names(given.exposure)) > 1:
        raise InputError(f"one scenario has one exposure (--exposure), got {len(exposures)}")
    met = _exposure(driven, exposures[0] if exposures else None)
    if driven.odd is not None:
        # Hours and kilometres count encounters outside the ODD, too, of which nothing is simulated.
        met = replace(met, encounters=None)
        for name, marginal in met.marginals.items():
            before, now = logical.parameters[name], driven.parameters[name]
            # A beta distribution is of its range: over a narrower one it would be another.
            if (before.low, before.high) != (now.low, now.high) and "Beta" in repr(marginal):
                raise InputError(
                    f"{name} has a beta distribution over its range, which the ODD narrows to "
                    f"{now.low:g} to {now.high:g} {now.unit}: state another distribution"
                )
    if met.dimensions == 0:
        raise InputError(
            f"the exposure of {driven.name} distributes no parameter: nothing is random"
        )
    fitted = _fit_of(driven, met, given.events)
    options = PipelineOptions(ego=given.ego, vehicle=given.vehicle)
    pipeline = Pipeline(driven, met.space, options, workers=hands)
    Z = None if given.start is None else _points_of(Path(given.start), met, given.event)
    return Asked(given, driven, met, fitted, Z, pipeline, hands)


def finish(asked: Asked, default: Path, road: Float | None = None) -> Risk:
    """Estimate the risk of a scenario, and write it.

    Args:
        asked: the scenario.
        default: the folder, if none was given.
        road: ``(n, len(Column))`` further outcomes of rows as on the road, for near misses.
    """
    given, met, pipeline, hands = asked.given, asked.exposure, asked.pipeline, asked.hands
    folder = default if given.out is None else Path(given.out)
    elsewhere, score = given.simulator, require_event(given.event).score
    budget, check, seed, say = given.budget, given.check, given.seed, given.callbacks
    whose = _count(given.count)
    there = None
    if elsewhere is not None:
        options = PipelineOptions(ego=given.ego, vehicle=given.vehicle)
        there = Pipeline(asked.scenario, met.space, options, simulator=elsewhere, workers=hands)
    command = command_of(
        "risk",
        given,
        folder,
        ego=pipeline.driver.name,
        vehicle=pipeline.runner.vehicle,
        exposure=named_exposures(given),
        simulator_rows=given.simulator_rows if elsewhere else None,
    )
    total = budget + check + (HERE if there else 0)
    experiment = asked.experiment(given, folder, total)
    say.compile()
    pipeline.warm_up()
    try:
        found = asked.estimate(given, experiment)
        failed, implausible = experiment.failed, experiment.implausible
        beside = None
        if check:
            plain = Aim(score, LEAST, check, 0.0)
            # Another seed, so that the second estimate shares no row with the first.
            beside = monte_carlo.estimate(experiment, plain, seed + OTHER_ROWS)
        # Looked for, since the likeliest row that the estimate happens to draw had a density
        # too low by factors of 50 to 3,000 in ten dimensions.
        likely = find_most_likely(experiment, met, found.weighted, score, budget, seed)
        other = None
        if there is not None and elsewhere is not None:
            rows = given.simulator_rows
            kept = kept_elsewhere(folder, elsewhere, asked.settings(given))
            beyond = Experiment(
                there,
                met,
                hands,
                whose,
                kept,
                lambda done: say.progress("elsewhere", done, rows, ""),
            )
            other = look_elsewhere(
                experiment, beyond, elsewhere.name, found.weighted, score, rows, seed
            )
    except KeyboardInterrupt:
        raise Interrupted(folder, experiment.evaluations, total, command=command) from None
    data = None
    if asked.fit is not None and not found.weighted.doubts:
        data = data_band(met, found.weighted, score, asked.fit)
    if road is not None and road.size:
        rows_ = [part for part in (road, found.weighted.road) if part.size]
        found = replace(found, weighted=replace(found.weighted, road=np.concatenate(rows_)))
    shown = write_most_likely(pipeline, likely, whose, folder)
    result = Risk(
        met, pipeline.driver.label, given.event, given.count, found, seed, budget,
        tuple(experiment.modes), failed, implausible, beside, data, other, shown, command, folder,
    )  # fmt: skip
    result.write()
    return result


def named_exposures(given: RiskOptions) -> list[Any]:
    """Return exposures as a command names them."""
    return ["EXPOSURE" if isinstance(x, Exposure) else x for x in as_names(given.exposure)]


def _count(name: str) -> Count:
    if name == "ego":
        return "ego"
    if name == "any":
        return "any"
    raise UnknownNameError("count", name, ("ego", "any"))


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
    # A search may count violations of pass criteria as harm; an event of a risk is a conflict.
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
    # Of rows, and not of the file: an exposure may be an object of Python's, and two files may say
    # the same.
    return hashlib.sha256(rows.tobytes() + exposure.source.encode()).hexdigest()
