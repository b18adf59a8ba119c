"""The job in one file: rows of X → scenarios → rollouts → metrics → objectives → causes.

Read this first. `Pipeline.evaluate_rows` is the whole path of a batch, one line per stage;
everything else here prepares it.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from bridgegen import ego as egos
from bridgegen import metrics as measures
from bridgegen.adversary import AdversarySource, Arena
from bridgegen.arrays import Bool, Float, Int
from bridgegen.cause import Cause, Counterfactual, causes, counterfactuals, require
from bridgegen.conflict import quantities
from bridgegen.conflict.analysis import analyse
from bridgegen.conflict.findings import Findings
from bridgegen.conflict.harm import Count
from bridgegen.conflict.plausibility import Implausible, plausibility
from bridgegen.ego.kinds import NAMES
from bridgegen.errors import InputError
from bridgegen.evaluation import Evaluation, Replay, Trials
from bridgegen.objective import CLASSIFYING, Objective, Objectives, needs_sample
from bridgegen.odd.scenario import SearchedScenario
from bridgegen.odd.space import SearchSpace
from bridgegen.openx.opendrive.road_map import RoadMap
from bridgegen.openx.source import ConcreteScenario, OntologySource, Source, source_of
from bridgegen.options import PipelineOptions
from bridgegen.simulation.choice import EMBEDDED, SimulatorChoice
from bridgegen.simulation.rollout import WORKER_ENDED, Rollout, joined
from bridgegen.simulation.simulator import Simulator
from bridgegen.workers import CarriedDriver, Lost, Part, Recipe, Threads, Workers

FAR_ROWS = 8
"""Rows that a worker is given at a time whose simulator only its machine has."""

SAMPLE = 400
"""Random scenarios from which weights and scales are taken, where an objective needs them."""


class Pipeline:
    """Everything between a row and its objectives, for one scenario, ego and road network.

    Attributes:
        scenario: the logical scenario.
        space: its search space; names the columns of X.
        driver: the ego's driver.
        source: makes its concrete scenarios.
        objective: set by ``choose_objective``.
        metrics: the names of all metrics that are recorded: what was asked for and what the
            objective and the thresholds need.
        simulator: holds the scenario's storyboard. The embedded one, where another is asked for and
            only the workers' machines have it.
        cause: the only one that makes a scenario count as critical, if one was asked for.
        seeks_causes: whether ``evaluate`` finds causes.
    """

    objective: Objective

    def __init__(
        self,
        scenario: SearchedScenario,
        space: SearchSpace,
        options: PipelineOptions | None = None,
        *,
        road_map: RoadMap | None = None,
        recorded: Sequence[str] | None = None,
        simulator: SimulatorChoice = EMBEDDED,
        workers: Workers | None = None,
    ) -> None:
        """Prepare a scenario.

        Args:
            scenario: the logical scenario.
            space: its search space.
            options: how its rows are evaluated; the defaults by default.
            road_map: the map that it takes place on; its own road network by default.
            recorded: the names of all metrics to record, CLASSIFYING and the objective's among
                them; what ``metrics_of`` says by default.
            simulator: which one runs the scenarios.
            workers: who evaluates; threads by default, one for each core. No result depends on it.

        Raises:
            UnknownNameError: no such driver or metric.
            InputError: a metric, or harm by the cause, does not exist with this driver; or the
                simulator is not where it should be.
        """
        self.scenario = scenario
        self.space = space
        self._options = options = PipelineOptions.of(options or PipelineOptions())
        self._made_with: dict[str, Any] = {
            "scenario": scenario, "space": space, "road_map": road_map, "simulator": simulator,
        }  # fmt: skip
        self._simulated_by = simulator
        name = options.ego or scenario.driver
        if name is None and options.ideal:
            raise InputError(f"{scenario.place}: to make stages of its driver ideal, name it (ego)")
        driver = egos.get(name, options.ideal, options.time_limit) if name else None
        self.source = _source(scenario, driver, road_map, space)
        self.cause = None if options.cause is None else Cause.named(options.cause)
        self.seeks_causes = options.causes or self.cause is not None
        nominal = self.concrete(space.row({}), road_map.path.name if road_map else "")
        self._workers = workers or Threads()
        self._is_far = simulator != EMBEDDED and not self._workers.are_here
        near = EMBEDDED if self._is_far else simulator
        self.simulator: Simulator[Any] = near.simulator(nominal.storyboard, scenario.name, driver)
        self.driver = self.simulator.embedded.program.driver
        if driver is None and self.driver != egos.STORYBOARD:  # the file's choice is written, too
            self.source = _source(scenario, self.driver, road_map, space)
        if self.cause is not None:
            require(self.cause, self.driver)
        sees = simulator.detects
        if recorded is None:
            recorded = metrics_of(scenario, self.driver, options.metrics, detects=sees)
        held = measures.held_by(self.driver, detects=sees)
        self.metrics = quantities.require(recorded, held, f"the driver '{self.driver.name}'")
        _refuse_fixed(scenario, space, self.simulator.fixed)
        self._roads: Any = None
        if not {*self._road_names} & {*space.variables}:
            self._roads = self.simulator.roads([nominal.roads])

    @cached_property
    def recipe(self) -> Recipe:
        """Makes this pipeline in a worker, but for the objective, which is given with the rows."""
        ego = self._options.ego
        carried = CarriedDriver.of(ego) if ego else None
        options = replace(self._options, ego=None)
        return Recipe.of(_remade, carried, options, recorded=self.metrics, **self._made_with)

    @property
    def rows_at_once(self) -> int:
        """How many rows a worker had best be given; see `Simulator`."""
        return FAR_ROWS if self._is_far else self.simulator.rows_at_once

    @property
    def runs_at_once(self) -> int:
        """How many threads had best work on rows; see `Simulator`."""
        return self.simulator.runs_at_once

    @property
    def device(self) -> str:
        """What a worker needs one of; see `bridgegen.simulation.choice.Kind`."""
        return self._simulated_by.device

    def arena(self) -> Arena:
        """Return where an agent drives the adversary's participant in closed loop.

        Raises:
            InputError: there is no adversary, or the ego's driver cannot be asked instant by
                instant; or another simulator than the embedded one is to run it.
        """
        if not isinstance(self.source, AdversarySource):
            raise InputError(f"{self.scenario.place}: no adversary drives anybody")
        if self._is_far or self.simulator is not self.simulator.embedded:
            raise InputError(
                f"{self.scenario.place}: an agent drives in closed loop in the embedded simulator "
                "alone; search there, and confirm elsewhere what it finds"
            )
        return Arena(self.source, self.simulator.embedded, self.space)

    def choose_objective(
        self,
        objective: Objective | None = None,
        *,
        objectives: Objectives = "one",
        seed: int = 0,
    ) -> Objective:
        """Set the objective: the given one, or the scenario's, sampled where it says so.

        Args:
            objective: as an earlier run recorded it.
            objectives: "one", the terms' weighted sum, or "many", one for each term.
            seed: of the random sample that entropy weights and scales are taken from. Its
                scenarios are not part of the search and not charged to its budget.
        """
        if objective is None:
            spec = self.scenario.objective
            sample = None
            if needs_sample(spec.weights, spec.scale, objectives):
                rng = np.random.Generator(np.random.PCG64([seed, 1]))
                U = rng.random((SAMPLE, self.space.n_var))
                parts = self._share_out("measure_rows", self.space.decode(U))
                lost = np.full((1, len(self.metrics)), np.nan)
                rows = [lost if isinstance(one.came, Lost) else one.came for one in parts]
                sample = (np.concatenate(rows), self.metrics)
            objective = Objective.build(
                [(term.metric, term.weight) for term in spec.terms],
                weights=spec.weights,
                scale=spec.scale,
                objectives=objectives,
                thresholds=spec.critical,
                rule=spec.rule,
                count=spec.count,
                sample=sample,
            )
        self.objective = objective
        return objective

    def warm_up(self) -> None:
        """Roll out the nominal row once, so that the kernels are compiled before time counts.

        In this thread, if it is here that rows are simulated: Ctrl-C ends a compilation at once.
        """
        nominal = self.space.row({})[np.newaxis]
        if self._workers.are_here:
            self.measure_rows(nominal)
        else:
            self._share_out("measure_rows", nominal)

    def evaluate(self, X: Float) -> Evaluation:
        """Evaluate N rows; a row's result depends on that row alone.

        Args:
            X: ``(N, len(space.names))`` float64, feasible rows.
        """
        parts = self._share_out("evaluate_rows", X, self.objective)
        return Evaluation.join(
            [self._lost(one) if isinstance(one.came, Lost) else one.came for one in parts]
        )

    def evaluate_rows(self, X: Float, objective: Objective) -> Evaluation:
        """Evaluate N rows at once, in this thread; ``evaluate`` has it done by many."""
        roads, rows = self._roads_of(X)
        rollout = self._run(roads, rows, X)
        metrics = quantities.evaluate(rollout, self.metrics)
        gate = plausibility(rollout)
        findings = Findings.of(analyse(rollout), gate.labels, objective.count)
        fit = gate.code == Implausible.NONE if objective.rule == "harm" else True
        F, ok = objective.F(metrics, self.metrics, fit)
        critical = objective.critical(metrics, self.metrics) & ok
        if not self.seeks_causes:
            return Evaluation(metrics, F, critical, rollout.status, findings, rollout.messages)

        def harmless(at: Int, replay: Counterfactual) -> Bool:
            return _harmless(self._run(roads, rows[at], X[at], replay), objective)

        cause = causes(self.driver, critical, harmless)
        counts = critical if self.cause is None else cause == self.cause
        return Evaluation(metrics, F, counts, rollout.status, findings, rollout.messages, cause)

    @property
    def tries(self) -> bool:
        """Whether ``try_all`` can be asked: rows are simulated by the embedded simulator."""
        return self._simulated_by == EMBEDDED

    @cached_property
    def fixes(self) -> tuple[Counterfactual, ...]:
        """The changes that ``try_all`` knows by number: those by which causes are sought."""
        return counterfactuals(self.driver)

    @property
    def kinds(self) -> dict[str, str]:
        """What each participant is, "car" or "pedestrian" say, by its name."""
        program = self.simulator.embedded.program
        return dict(zip(program.names, (NAMES[k] for k in program.kinds), strict=True))

    def try_all(self, X: Float, fix: Int | None = None, noise: Float | None = None) -> Trials:
        """Drive N rows once more, each as is or with one thing put right; see `Trials`.

        Args:
            X: ``(N, len(space.names))`` feasible rows.
            fix: ``(N,)`` number of each row's change in ``fixes``; −1 as is, which is the default.
            noise: ``(N, len(space.names))`` rows whose random numbers these rows get, so that a
                row and its neighbours differ in nothing else; their own by default.
        """
        numbers = np.full(len(X), -1) if fix is None else fix
        keys = X if noise is None else noise
        rows = np.concatenate([X, keys, numbers[:, np.newaxis].astype(np.float64)], axis=1)
        given = (self.objective.harm, self.objective.count)
        if not len(rows):
            return Trials.none(0)
        order = np.arange(len(rows))
        if self._roads is not None:  # a worker had best have rows of one driver
            order = np.argsort(numbers, kind="stable")
        parts = self._share_out("try_rows", rows[order], *given)
        came = [Trials.none(one.rows) if isinstance(one.came, Lost) else one.came for one in parts]
        return Trials.join(came).take(np.argsort(order))

    def try_rows(self, rows: Float, harm: str, count: Count) -> Trials:
        """Drive N rows at once, in this thread; ``try_all`` has it done by many.

        Args:
            rows: ``(N, 2 n + 1)``: X, the rows whose random numbers they get, number of the fix.
            harm: the quantity that counts.
            count: whose conflicts do.
        """
        n = len(self.space.names)
        X, keys, numbers = rows[:, :n], rows[:, n : 2 * n], rows[:, -1].astype(np.int64)
        roads, which = self._roads_of(X)
        parts, order = [], []
        for number in np.unique(numbers).tolist():
            at = np.flatnonzero(numbers == number)
            replay = self.fixes[number] if number >= 0 else None
            rollout = self.simulator.embedded.run(
                roads, which[at], self._columns(X[at]), noise=self.noise_keys(keys[at]),
                driver=replay.driver if replay else None, dry=replay is not None and replay.dry,
            )  # fmt: skip
            order.append(at)
            parts.append(Trials.of(rollout, roads, which[at], harm, count))
        return Trials.join(parts).take(np.argsort(np.concatenate(order)))

    def noise_keys(self, X: Float) -> npt.NDArray[np.uint64]:
        """Return the keys of N rows' random numbers, ``(N,)``."""
        return self.simulator.embedded.noise_keys(self._columns(X), len(X))

    def rollout_again(self, X: Float, noise: npt.NDArray[np.uint64]) -> Rollout:
        """Roll out N rows in the embedded simulator with the random numbers of some keys."""
        roads, rows = self._roads_of(X)
        return self.simulator.embedded.run(roads, rows, self._columns(X), noise=noise)

    def _columns(self, X: Float) -> dict[str, Float]:
        return {name: X[:, i] for i, name in enumerate(self.space.names)}

    def facts(self, x: Float) -> dict[str, float]:
        """Return the parameters of one row that its scenario depends on, by name.

        Without an adversary's decisions: what came of them is the scenario's.
        """
        unused = {*self.source.unused_names, *self.space.decisions}
        return {name: one for name, one in self.space.values(x).items() if name not in unused}

    def concrete(self, x: Float, road_file: str = "") -> ConcreteScenario:
        """Return the concrete scenario of one row.

        Args:
            x: ``(len(space.names),)``.
            road_file: what its OpenDRIVE file will be called; a map's own name by default.
        """
        return self.source.concrete(self.space.values(x), road_file)

    def rollout(self, X: Float) -> Rollout:
        """Roll out N rows as ``evaluate`` does, and keep the motion."""
        if not self._is_far:
            return self._run(*self._roads_of(X), X)
        parts, start = [], 0
        for part in self._share_out("rollout", X):
            rows, came = np.arange(start, start := start + part.rows), part.came
            if isinstance(came, Lost):
                lost = self._run(*self._roads_of(X[rows]), X[rows])
                status = np.full(part.rows, WORKER_ENDED, np.int8)
                came = replace(lost, status=status, messages={0: came.reason})
            parts.append((rows, came))
        return joined(parts)

    def rollouts(self, X: Float) -> list[Rollout | Lost]:
        """Have N rows rolled out by many; return what came of them, a part of the rows in each."""
        return [one.came for one in self._share_out("rollout", X)]

    def replay(
        self, X: Float, *, plans: bool = True, noise: npt.NDArray[np.uint64] | None = None
    ) -> Replay:
        """Roll out N rows as ``evaluate`` does, and find out what went on besides.

        Args:
            X: ``(N, len(space.names))`` float64.
            plans: whether to find out what the egos meant to do, which takes many times as long;
                only the embedded simulator can.
            noise: ``(N,)`` keys of the rows' random numbers, in the embedded simulator; their own
                by default.
        """
        embedded = self.simulator.embedded
        roads, rows = self._roads_of(X)
        rollout = self.rollout(X) if noise is None else self.rollout_again(X, noise)
        columns = {name: X[:, i] for i, name in enumerate(self.space.names)}
        intentions, ways = None, []
        if plans and self.simulator is embedded and not self._is_far:
            intentions = embedded.intentions(roads, rows, columns, rollout)
            ways = [
                {way: roads.way(p, way) for way in np.unique(named[named >= 0]).tolist()}
                for p, named in zip(rows.tolist(), intentions.way, strict=True)
            ]
        weathers = [embedded.weathers(columns, rollout, i) for i in range(len(X))]
        return Replay(rollout, intentions, ways, weathers)

    def _run(
        self, roads: Any, rows: Int, X: Float, replay: Counterfactual | None = None
    ) -> Rollout:
        columns = {name: X[:, i] for i, name in enumerate(self.space.names)}
        if replay is None:
            return self.simulator.run(roads, rows, columns)
        return self.simulator.run(roads, rows, columns, driver=replay.driver, dry=replay.dry)

    def measure_rows(self, X: Float) -> Float:
        """Return the metrics of N rows, ``(N, M)``, in this thread."""
        return quantities.evaluate(self.rollout(X), self.metrics)

    def _share_out(self, work: str, X: Float, *given: Any) -> list[Part]:
        """Have the workers do this pipeline's work on rows; return what came of them, in order."""
        try:
            return self._workers.map(self, work, X, *given)
        except KeyboardInterrupt:
            self.simulator.stop()
            raise

    def _lost(self, part: Part) -> Evaluation:
        """Return what a row came to that nobody could evaluate."""
        metrics = np.full((part.rows, len(self.metrics)), np.nan)
        F, critical = self.objective.F(metrics, self.metrics)
        status = np.full(part.rows, WORKER_ENDED, np.int8)
        cause = np.full(part.rows, Cause.NONE, np.int8) if self.seeks_causes else None
        findings = Findings.none(part.rows)
        return Evaluation(metrics, F, critical, status, findings, {0: part.came.reason}, cause)

    def _roads_of(self, X: Float) -> tuple[Any, Int]:
        """Return the compiled road networks of some rows, and which row has which."""
        if self._roads is not None:
            return self._roads, np.zeros(len(X), dtype=np.int64)
        source, names = self.source, self._road_names
        columns = [self.space.index(name) for name in names]
        distinct, rows = np.unique(X[:, columns], axis=0, return_inverse=True)
        values = [dict(zip(names, row, strict=True)) for row in distinct.tolist()]
        roads = self.simulator.roads(
            [source.roads(one) for one in values], [source.courses(one) for one in values]
        )
        return roads, rows.reshape(-1).astype(np.int64)

    @property
    def _road_names(self) -> tuple[str, ...]:
        """The parameters that a row's road network, and the courses on it, depend on."""
        return tuple(dict.fromkeys((*self.source.static_names, *self.source.course_names)))


def _remade(ego: CarriedDriver | None, options: PipelineOptions, **made_with: Any) -> Pipeline:
    """Return a pipeline for a worker, which is one thread; its kernels are compiled by then."""
    options = replace(options, ego=ego.here() if ego else None)
    pipeline = Pipeline(options=options, **made_with, workers=Threads(1))
    pipeline.warm_up()
    return pipeline


def _harmless(rollout: Rollout, objective: Objective) -> Bool:
    """Return which rows succeed and are not critical."""
    names = objective.classifying
    metrics = quantities.evaluate(rollout, names)
    harmless: Bool = (rollout.status == 0) & ~objective.critical(metrics, names)
    return harmless


def _source(
    scenario: SearchedScenario,
    driver: egos.Driver | None,
    road_map: RoadMap | None,
    space: SearchSpace,
) -> Source:
    if driver is None:
        return source_of(scenario, None, road_map)
    source = source_of(scenario, driver.name, road_map, egos.join(driver.ideal))
    if isinstance(source, OntologySource) and source.constraints.adversary:
        return AdversarySource(source, space.values(space.row({})))
    return source


def _refuse_fixed(scenario: SearchedScenario, space: SearchSpace, fixed: Mapping[str, str]) -> None:
    """Refuse a search of parameters that must be the same in every row."""
    moving = {*space.variables}
    moving |= {one.name for one in scenario.derived if one.names & moving}
    if problems := [
        f"{scenario.place}: parameter '{name}' cannot vary: it is used for {use}"
        for name, use in fixed.items()
        if name in moving
    ]:
        raise InputError(*problems)


def metrics_of(
    scenario: SearchedScenario,
    driver: egos.Driver,
    also: Sequence[str] = (),
    *,
    detects: bool = False,
) -> tuple[str, ...]:
    """Return the quantities that a search records.

    The metrics that `bridgegen.metrics.to_record` says, then what the conflict analysis measures.

    Raises:
        UnknownNameError: no such metric.
        InputError: a metric does not exist with this driver.
    """
    terms = (term.metric for term in scenario.objective.terms)
    asked = [name for name in (*terms, *CLASSIFYING, *also) if name not in quantities.MEASURED]
    recorded = measures.to_record(driver, asked, detects=detects)
    return (*recorded, *quantities.MEASURED)
