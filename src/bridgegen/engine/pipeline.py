"""The evaluation in one file: rows of X → rollouts → metrics → objectives → causes.

Read this first. `Pipeline.evaluate_rows` is the whole path of a batch, one line per stage;
everything else here prepares it, or shares the rows among workers.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from typing import Any, Self, TypeVar, TypeVarTuple

import numpy as np
import numpy.typing as npt

from bridgegen import drivers as egos
from bridgegen.assess import metrics as measures
from bridgegen.assess.cause import Cause, Counterfactual, causes, require
from bridgegen.assess.conflict import quantities
from bridgegen.assess.conflict.analysis import analyse
from bridgegen.assess.conflict.findings import Findings
from bridgegen.assess.conflict.happening import happened
from bridgegen.assess.conflict.harm import Count
from bridgegen.assess.conflict.plausibility import Implausible, plausibility
from bridgegen.assess.criteria import Monitor, quantity
from bridgegen.assess.criteria import evaluate as measure
from bridgegen.assess.metrics import OF_BASELINE
from bridgegen.assess.objective import CLASSIFYING, Objective, Objectives, needs_sample
from bridgegen.base.arrays import Bool, Float, Int
from bridgegen.base.errors import InputError, UnknownNameError
from bridgegen.engine.baseline import RECORDED, difference, difference_of_trials
from bridgegen.engine.evaluation import Evaluation
from bridgegen.engine.options import PipelineOptions
from bridgegen.engine.replays import Replays, replay_of
from bridgegen.engine.runner import Runner
from bridgegen.engine.trials import Trials, try_rows
from bridgegen.engine.workers import CarriedDriver, Lost, Part, Recipe, Stream, Threads, Workers
from bridgegen.engine.workers.compile_ahead import compiled_ahead
from bridgegen.openx.opendrive.road_map import RoadMap
from bridgegen.scenario.language.criteria import PREFIX, read_criterion
from bridgegen.scenario.language.criteria import joined as joined_criteria
from bridgegen.scenario.language.scenario import SearchedScenario
from bridgegen.scenario.language.space import SearchSpace
from bridgegen.simulation.adversary import AdversarySource, Arena
from bridgegen.simulation.choice import EMBEDDED, SimulatorChoice
from bridgegen.simulation.rollout import WORKER_ENDED, Rollout, joined
from bridgegen.simulation.vehicles import KINEMATIC

# The simulator, which knows its own number, is not on this machine.
REMOTE_CHUNK_ROWS = 8
"""Number of rows per chunk if only the workers' machines have the simulator."""

SAMPLE = 400
"""Random scenarios that set an objective's weights and scales where it needs a sample."""

Result = TypeVar("Result")
Args = TypeVarTuple("Args")


class Pipeline:
    """Everything between a row and its objectives, for one scenario, ego and road network.

    Attributes:
        runner: rolls rows out, with the embedded simulator if only the workers' machines have the
            chosen one.
        scenario: the logical scenario.
        space: its search space; names the columns of X.
        driver: the ego's driver.
        objective: set by ``choose_objective``.
        metrics: the names of all metrics that are recorded: those requested, and those that the
            objective and the thresholds need; then the margins of criteria, and the baseline's.
        held: what its rollouts hold besides motion.
        monitor: the pass criteria, of the scenario and of the options.
        cause: the only one that makes a scenario count as critical, if one was requested.
        seeks_causes: whether ``evaluate`` finds causes.
        baseline: the same with the driver that the ego's is compared with; None without one.
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
            road_map: the map to use; the scenario's own road network by default.
            recorded: the names of all metrics to record, CLASSIFYING and the objective's among
                them; what ``metrics_of`` says by default.
            simulator: runs the scenarios.
            workers: evaluate the rows; threads by default, one per core. Results do not depend on
                them.

        Raises:
            UnknownNameError: no such driver or metric.
            InputError: a metric, or harm by the cause, does not exist with this driver; or the
                simulator is unavailable.
        """
        self.scenario = scenario
        self.space = space
        self._options = options = PipelineOptions.of(options or PipelineOptions())
        self._made_with: dict[str, Any] = {
            "scenario": scenario,
            "space": space,
            "road_map": road_map,
            "simulator": simulator,
        }
        self._simulated_by = simulator
        self.cause = None if options.cause is None else Cause.named(options.cause)
        self.seeks_causes = options.causes or self.cause is not None
        self._workers = workers or Threads()
        # A machine that only searches need not have CARLA or esmini: the embedded simulator of the
        # same storyboard knows the same parameters, drivers and roads.
        self._runs_remotely_only = simulator != EMBEDDED and not self._workers.are_here
        self.runner = Runner(
            scenario,
            space,
            options,
            road_map=road_map,
            simulator=EMBEDDED if self._runs_remotely_only else simulator,
        )
        self.driver = self.runner.driver
        if self._runs_remotely_only and self.runner.vehicle != KINEMATIC:
            raise InputError(
                f"{scenario.place}: the vehicle '{self.runner.vehicle}' is of the embedded "
                f"simulator (--vehicle {KINEMATIC})"
            )
        if self.cause is not None:
            require(self.cause, self.driver, self.runner.vehicle)
        sees, embedded = simulator.detects, self.runner.embedded
        self.held = held = measures.held_by(self.driver, detects=sees)
        named = f"the driver '{self.driver.name}'"
        self.monitor = Monitor(
            joined_criteria(
                scenario.criteria, [read_criterion(criterion) for criterion in options.criteria]
            ),
            embedded.program.names,
            held,
            embedded.duration,
            named,
            has_odd=len(embedded.program.limits) > 0,
        )
        named_metrics = measures.read(options.metrics)
        if recorded is None:
            also = (*named_metrics, *self.monitor.metrics)
            recorded = metrics_of(scenario, self.driver, also, detects=sees)
        self.baseline = self._baseline_of(options)
        margins = [name for name in recorded if name.startswith(PREFIX)]
        beside = [name for name in recorded if name.startswith(OF_BASELINE)]
        own = [name for name in recorded if name not in (*margins, *beside)]
        known = quantities.require(own, held, named)
        if not beside and self.baseline is not None:
            beside = list(RECORDED)
        self.metrics = (*known, *(margins or self.monitor.names), *beside)

    def _baseline_of(self, options: PipelineOptions) -> "Pipeline | None":
        """Return the pipeline of the driver that the ego's is compared with, if there is one.

        Raises:
            InputError: it is the ego's own, or the ego has none.
        """
        if options.worse_than is None:
            return None
        if self.driver == egos.STORYBOARD:
            raise InputError(
                f"{self.scenario.place}: a baseline is compared with the ego's driver, and the "
                "file's own actions move the ego; name a driver (ego)"
            )
        alone = replace(
            options,
            ego=options.worse_than,
            driver_name=None,
            worse_than=None,
            metrics=(),
            causes=False,
            cause=None,
        )
        pipeline = Pipeline(options=alone, workers=self._workers, **self._made_with)
        if pipeline.driver == self.driver:
            raise InputError(
                "a baseline must be another driver than the ego's, both are "
                f"{pipeline.driver.label}"
            )
        return pipeline

    def elsewhere(self, simulator: SimulatorChoice) -> "Pipeline":
        """Return the same with another simulator, which seeks no causes unless one counts.

        Raises:
            InputError: see ``__init__``.
        """
        here = self._workers if self._workers.are_here else Threads()
        pipeline = Pipeline(
            options=replace(self._options, causes=False),
            recorded=self.metrics,
            workers=here,
            **self._made_with | {"simulator": simulator},
        )
        pipeline.choose_objective(self.objective)
        return pipeline

    @cached_property
    def recipe(self) -> Recipe:
        """Builds this pipeline in a worker, without the objective, which is sent with the rows."""
        # Pickled once: with Town05 it is 4 MB, and takes 50 ms; reading the map's text again takes
        # six times as long.
        return self._recipe_of(_remade)

    def _recipe_of(self, make: Callable[..., Any]) -> Recipe:
        named = (self._options.ego, self._options.worse_than, *self._options.metrics)
        carried = tuple(CarriedDriver.of(name) if name else None for name in named)
        # Drivers and metrics go with the bytes of their files: a path on this machine says nothing
        # on another, and the file may be edited while the search runs.
        options = replace(self._options, ego=None, worse_than=None, metrics=())
        return Recipe.of(make, carried, options, recorded=self.metrics, **self._made_with)

    @property
    def units(self) -> Mapping[str, str]:
        """The unit of each recorded quantity."""
        margins = dict(zip(self.monitor.names, self.monitor.units, strict=True))
        return {name: margins.get(name) or quantity(name).unit for name in self.metrics}

    @property
    def rows_at_once(self) -> int:
        """The number of rows of a chunk that is fastest; see `Simulator`."""
        if self._runs_remotely_only:
            return REMOTE_CHUNK_ROWS
        own = self.runner.simulator.rows_at_once
        return own if self.baseline is None else max(own, self.baseline.rows_at_once)

    @property
    def runs_at_once(self) -> int:
        """The number of threads that is fastest; see `Simulator`."""
        own = self.runner.simulator.runs_at_once
        return own if self.baseline is None else min(own, self.baseline.runs_at_once)

    @property
    def device(self) -> str:
        """The device that each worker needs; see `bridgegen.simulation.choice.Kind`."""
        return self._simulated_by.device

    def arena(self) -> Arena:
        """Return the arena in which an agent drives the adversary's participant in closed loop.

        Raises:
            InputError: there is no adversary, the ego's driver cannot be called step by step, or
                the simulator is not the embedded one.
        """
        source, embedded = self.runner.source, self.runner.embedded
        if not isinstance(source, AdversarySource):
            raise InputError(f"{self.scenario.place}: no participant is driven by an adversary")
        if self._runs_remotely_only or self.runner.simulator is not embedded:
            raise InputError(
                f"{self.scenario.place}: an agent drives in closed loop in the embedded simulator "
                "only; search there, and confirm its results in another simulator"
            )
        return Arena(source, embedded, self.space)

    def choose_objective(
        self,
        objective: Objective | None = None,
        *,
        objectives: Objectives = "one",
        seed: int = 0,
    ) -> Objective:
        """Set the objective: the given one, or the scenario's, with a random sample if needed.

        Args:
            objective: as an earlier run recorded it.
            objectives: "one", the terms' weighted sum, or "many", one for each term.
            seed: of the random sample that sets entropy weights and scales. Its scenarios are not
                part of the search and do not count towards its budget.
        """
        if objective is None:
            spec = self.scenario.objective
            if margins := [item.metric for item in spec.terms if item.metric.startswith(PREFIX)]:
                self._margins_that_count(margins)
            sample = None
            if needs_sample(spec.weights, spec.scale, objectives):
                # A stream of its own: other parts draw by the same seed and another second number.
                rng = np.random.Generator(np.random.PCG64([seed, 1]))
                U = rng.random((SAMPLE, self.space.n_var))
                parts = self._map(type(self)._measure_rows, self.space.decode(U))
                lost = np.full((1, len(self.metrics)), np.nan)
                rows = [lost if isinstance(part.result, Lost) else part.result for part in parts]
                sample = (np.concatenate(rows), self.metrics)
            objective = Objective.build(
                [(term.metric, term.weight) for term in spec.terms],
                weights=spec.weights,
                scale=spec.scale,
                objectives=objectives,
                thresholds=spec.critical,
                rule=spec.rule,
                count=spec.count,
                criteria=self._margins_that_count(spec.criteria) if spec.rule == "criteria" else (),
                gated=spec.gated,
                sample=sample,
            )
        self.objective = objective
        return objective

    def _margins_that_count(self, asked: Sequence[str]) -> tuple[str, ...]:
        """Return the margins that make a scenario critical: those asked for, or all.

        Raises:
            InputError: there are no criteria.
            UnknownNameError: no such criterion.
        """
        known = self.monitor.names
        if not known:
            raise InputError(
                f"{self.scenario.place}: criteria make a scenario critical, and there are none; "
                "state some with --criterion, or in the scenario file"
            )
        for name in asked:
            if name not in known:
                raise UnknownNameError("criterion", name, known)
        return tuple(asked) or known

    def warm_up(self) -> None:
        """Roll out the nominal row once, so that the kernels are compiled before time is measured.

        In this thread if rows are simulated on this machine: Ctrl-C ends a compilation at once.
        """
        nominal = self.space.row({})[np.newaxis]
        if not self._workers.are_here:
            self._map(type(self)._measure_rows, nominal)
            return
        # How two processes divide the first compilation matters: with an empty cache and two cores
        # crossroads-s4 had its report after 40.8 s where this one waited and then compiled alone,
        # after 31 s as it is.
        with compiled_ahead(self._recipe_of(_compile_ahead)) as is_shared:
            if is_shared and self.tries:
                self._compile_first()
            self._measure_rows(nominal)
        if self.baseline is not None:
            self.baseline.warm_up()

    # What a rollout's start, the metrics and the gate need, in an order that keeps this process off
    # what the other one compiles: instants and the conflict analysis, see ``_compile_rest``.
    def _compile_first(self) -> None:
        batch = self.runner.nominal_batch()
        batch.compile_start()
        standing = batch.standing()
        apart = (*quantities.MEASURED, *self.monitor.names)
        quantities.evaluate(standing, [metric for metric in self.metrics if metric not in apart])
        plausibility(standing)
        for fix in self.runner.fixes:
            self.runner.nominal_batch(fix).take_addresses()

    def _compile_rest(self) -> None:
        """Compile what ``_compile_first`` leaves: instants and the conflict analysis."""
        batch = self.runner.nominal_batch()
        batch.compile_instants()
        analyse(batch.standing())

    def evaluate(self, X: Float, repeat: int = 0) -> Evaluation:
        """Evaluate N rows; a row's result depends on that row alone.

        Args:
            X: ``(N, len(space.names))`` float64, feasible rows.
            repeat: which evaluation of them it is; see `Runner.run`. After the first one, 0, no
                causes are sought, unless only one counts.
        """
        return self._joined(self._map(type(self).evaluate_rows, X, self.objective, repeat))

    def stream(self) -> "EvaluationStream":
        """Return what evaluates rows while its caller does something else."""
        rows = self._workers.stream(self, type(self).evaluate_rows, self.objective)
        return EvaluationStream(self, rows)

    def _joined(self, parts: Sequence[Part[Evaluation]]) -> Evaluation:
        """Return the evaluation of consecutive rows from the workers' results."""
        return Evaluation.join(
            [
                self._lost(part.rows, part.result) if isinstance(part.result, Lost) else part.result
                for part in parts
            ]
        )

    @property
    def repeats(self) -> bool:
        """Whether it is known that a row's result is the same each time: all that moves is ours."""
        own = self.driver.is_own or (self.baseline is not None and not self.baseline.repeats)
        return not own and self.tries

    def evaluate_rows(self, X: Float, objective: Objective, repeat: int = 0) -> Evaluation:
        """Evaluate N rows at once, in this thread; ``evaluate`` shares them among workers."""
        return Evaluation.gathered(
            [
                (at, self._evaluate(runner, X[at], objective, repeat))
                for at, runner in self.runner.by_variant(X)
            ]
        )

    def _evaluate(self, runner: Runner, X: Float, objective: Objective, repeat: int) -> Evaluation:
        """Evaluate N rows of one storyboard."""
        # Once: the rollouts by which causes are found take place on the same roads.
        roads, rows = runner.roads_of(X)
        rollout = runner.run(X, roads=(roads, rows), repeat=repeat)
        metrics = self.measure(rollout)
        gate = plausibility(rollout)
        texts = happened(rollout, may_stop=self.is_protocol)
        findings = Findings.of(analyse(rollout), gate.labels, objective.count, texts)
        fit = gate.code == Implausible.NONE if objective.gated else True
        F, ok = objective.F(metrics, self.metrics, fit)
        critical = objective.critical(metrics, self.metrics) & ok
        found = Evaluation(metrics, F, critical, rollout.status, findings, rollout.messages)
        if self.baseline is not None:
            other = self.baseline.evaluate_rows(X, objective, repeat)
            found = difference(
                found, self.metrics, other, self.baseline.metrics, gated=objective.gated
            )
        if not self.seeks_causes or (repeat and self.cause is None):
            return found

        def harmless(at: Int, fix: Counterfactual) -> Bool:
            # With the noise of the row's values, as before: so the fix is all that differs.
            changed = runner.run(X[at], fix=fix, roads=(roads, rows[at]))
            return self._harmless(changed, objective)

        cause = causes(runner.fixes, found.critical, harmless)
        counts = found.critical if self.cause is None else cause == self.cause
        return replace(found, critical=counts, cause=cause)

    @property
    def is_protocol(self) -> bool:
        """Whether the scenario's own clauses or criteria decide what its ego fails.

        Not where criteria stand beside harm: they need not ask for what the scenario is about.
        """
        own = self.scenario
        asks = any(clause.collisions != "critical" for clause in own.clauses)
        return asks or (bool(own.criteria) and own.objective.rule == "criteria")

    def _harmless(self, rollout: Rollout, objective: Objective) -> Bool:
        """Return which rows succeed and are not critical."""
        names = objective.classifying
        metrics = measure(rollout, names, self.monitor)
        harmless: Bool = (rollout.status == 0) & ~objective.critical(metrics, names)
        return harmless

    @property
    def tries(self) -> bool:
        """Whether ``try_all`` is available: rows are simulated by the embedded simulator."""
        return self._simulated_by == EMBEDDED

    @property
    def draws(self) -> bool:
        """Whether results may follow from random numbers: its driver's, or the baseline's."""
        beside = self.baseline is not None and self.baseline.driver.draws
        return self.driver.draws or beside

    def try_all(self, X: Float, fix: Int | None = None, noise: Float | None = None) -> Trials:
        """Simulate N rows again, each unchanged or with one stage idealised; see `Trials`.

        Args:
            X: ``(N, len(space.names))`` feasible rows.
            fix: ``(N,)`` number of each row's change in ``runner.fixes``; −1, the default: none.
            noise: ``(N, len(space.names))`` rows whose random numbers these rows use, so that a
                row and its neighbours differ only in X; their own by default.
        """
        numbers = np.full(len(X), -1) if fix is None else fix
        keys = X if noise is None else noise
        # Workers cut one array into chunks, so all that belongs to a row travels in its columns.
        rows = np.concatenate([X, keys, numbers[:, np.newaxis].astype(np.float64)], axis=1)
        if not len(rows):
            return Trials.none(0)
        order = np.arange(len(rows))
        if self.runner.has_one_network:  # chunks with one driver are faster
            order = np.argsort(numbers, kind="stable")
        parts = self._map(
            type(self)._try_rows, rows[order], self.objective.harm, self.objective.count
        )
        trials = [
            Trials.none(part.rows) if isinstance(part.result, Lost) else part.result
            for part in parts
        ]
        return Trials.join(trials).take(np.argsort(order))

    def _try_rows(self, rows: Float, harm: str, count: Count) -> Trials:
        """Simulate N rows at once, in this thread; see `try_rows`."""
        found = try_rows(self.runner, rows, harm, count)
        if self.baseline is None:
            return found
        # The changes are numbered for the ego's driver; the baseline drives as it is.
        unchanged = rows.copy()
        unchanged[:, -1] = -1.0
        return difference_of_trials(found, try_rows(self.baseline.runner, unchanged, harm, count))

    def rollout(self, X: Float) -> Rollout:
        """Roll out N rows as ``evaluate`` does, wherever the simulator is, and keep the motion.

        Args:
            X: ``(N, len(space.names))`` float64.
        """
        if not self._runs_remotely_only:
            return self.runner.run(X)
        parts, start = [], 0
        for part in self._map(type(self).rollout, X):
            rows, rollout = np.arange(start, start := start + part.rows), part.result
            if isinstance(rollout, Lost):
                # The embedded simulator's motion fills the arrays; the status says that it does not
                # count.
                lost = self.runner.run(X[rows])
                status = np.full(part.rows, WORKER_ENDED, np.int8)
                rollout = replace(lost, status=status, messages={0: rollout.reason})
            parts.append((rows, rollout))
        return joined(parts)

    def rollouts(self, X: Float) -> list[Rollout | Lost]:
        """Roll out N rows in the workers; return the rollouts of consecutive parts of them."""
        return [part.result for part in self._map(type(self).rollout, X)]

    def replays(
        self, X: Float, *, plans: bool = True, noise: npt.NDArray[np.uint64] | None = None
    ) -> Replays:
        """Roll out N rows as ``evaluate`` does, with the egos' plans and the weather.

        Args:
            X: ``(N, len(space.names))`` float64.
            plans: whether to compute the egos' planned paths, which takes many times as long; only
                the embedded simulator can.
            noise: ``(N,)`` keys of the rows' random numbers, in the embedded simulator; their own
                by default.
        """
        parts = []
        for at, runner in self.runner.by_variant(X):
            if noise is None:
                rollout = self.rollout(X[at]) if self._runs_remotely_only else runner.run(X[at])
            else:
                rollout = runner.run(X[at], noise=noise[at])
            parts.append(
                (
                    at,
                    replay_of(runner, X[at], rollout, plans=plans and not self._runs_remotely_only),
                )
            )
        return Replays(tuple(parts))

    def _measure_rows(self, X: Float) -> Float:
        """Return the metrics of N rows, ``(N, M)``, in this thread."""
        return self.measure(self.runner.run(X))

    def measure(self, rollout: Rollout) -> Float:
        """Return all recorded quantities of a rollout, ``(N, len(metrics))``.

        Those of the baseline's driver, which drives in another rollout, are NaN.
        """
        own = [name for name in self.metrics if not name.startswith(OF_BASELINE)]
        found = measure(rollout, own, self.monitor)
        beside = len(self.metrics) - len(own)  # the last ones
        return np.pad(found, ((0, 0), (0, beside)), constant_values=np.nan) if beside else found

    def _map(
        self, work: Callable[[Self, Float, *Args], Result], X: Float, *args: *Args
    ) -> list[Part[Result]]:
        """Have the workers call a method of this pipeline for rows; see `Workers.map`."""
        try:
            return self._workers.map(self, work, X, *args)
        except KeyboardInterrupt:
            self.runner.simulator.stop()
            raise

    def _lost(self, rows: int, lost: Lost) -> Evaluation:
        """Return the evaluation of rows that ended their workers."""
        metrics = np.full((rows, len(self.metrics)), np.nan)
        # Of metrics that are NaN no row is valid, so what `F` returns second is False in all.
        F, critical = self.objective.F(metrics, self.metrics)
        status = np.full(rows, WORKER_ENDED, np.int8)
        cause = np.full(rows, Cause.NONE, np.int8) if self.seeks_causes else None
        findings = Findings.none(rows)
        return Evaluation(metrics, F, critical, status, findings, {0: lost.reason}, cause)


class EvaluationStream:
    """Rows that a pipeline's workers evaluate one by one; their results in the order of submission.

    A context manager; at its end, rows that have not been taken are abandoned.
    """

    def __init__(self, pipeline: Pipeline, rows: Stream[Evaluation]) -> None:
        self._pipeline, self._rows = pipeline, rows
        self._pending = 0

    def submit(self, X: Float) -> None:
        """Add rows, ``(n, len(space.names))`` float64, feasible ones."""
        self._rows.submit(X)
        self._pending += len(X)

    def take(self, n: int) -> Evaluation:
        """Wait for the evaluation of the next n rows; as many must have been added."""
        parts = self._rows.take(n)
        self._pending -= n
        return self._pipeline._joined(parts)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        # A simulator may be in the middle of a row that nobody will take.
        if self._pending:
            self._pipeline.runner.simulator.stop()
        self._rows.close()


Carried = tuple[CarriedDriver | None, ...]
"""The ego's driver and the baseline's."""


def _remade(carried: Carried, options: PipelineOptions, **made_with: Any) -> Pipeline:
    """Return a pipeline for a worker, in one thread, with its kernels compiled."""
    ego, baseline, *metrics = (code.here() if code else None for code in carried)
    named = tuple(name for name in metrics if name)
    options = replace(options, ego=ego, worse_than=baseline, metrics=named)
    # One thread: a worker is one core, and its chunks come from outside.
    pipeline = Pipeline(options=options, **made_with, workers=Threads(1))
    pipeline.warm_up()
    return pipeline


def _compile_ahead(carried: Carried, options: PipelineOptions, **made_with: Any) -> None:
    """Compile what a pipeline will need; a driver of the user's own is not made for it."""
    ego, _, *metrics = carried
    measures.read(code.here() for code in metrics if code)
    made_with["recorded"] = [n for n in made_with["recorded"] if not n.startswith(OF_BASELINE)]
    if ego and (egos.is_spec(ego.name) or egos.is_planner(ego.name)):
        options = replace(options, ego=None, ideal=(), metrics=())
        made_with["recorded"] = None
    else:
        options = replace(options, ego=ego.name if ego else None)
    Pipeline(options=options, **made_with, workers=Threads(1))._compile_rest()


def metrics_of(
    scenario: SearchedScenario,
    driver: egos.Driver,
    also: Sequence[str] = (),
    *,
    detects: bool = False,
) -> tuple[str, ...]:
    """Return the quantities that a search records.

    The metrics of `bridgegen.assess.metrics.to_record`, then the quantities of the conflict
    analysis.

    Raises:
        UnknownNameError: no such metric.
        InputError: a metric does not exist with this driver.
    """
    terms = (term.metric for term in scenario.objective.terms)
    asked = [
        name
        for name in (*terms, *CLASSIFYING, *also)
        if name not in quantities.MEASURED and not name.startswith(PREFIX)
    ]
    recorded = measures.to_record(driver, asked, detects=detects)
    return (*recorded, *quantities.MEASURED)
