"""The evaluation in one file: rows of X → scenarios → rollouts → metrics → objectives → causes.

Read this first. `Pipeline.evaluate_rows` is the whole path of a batch, one line per stage;
everything else here prepares it.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from copy import copy
from dataclasses import replace
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Any, Self, TypeVar, TypeVarTuple

import numpy as np
import numpy.typing as npt

from bridgegen import drivers as egos
from bridgegen.assess import metrics as measures
from bridgegen.assess.cause import Cause, Counterfactual, causes, counterfactuals, require
from bridgegen.assess.conflict import quantities
from bridgegen.assess.conflict.analysis import analyse
from bridgegen.assess.conflict.findings import Findings
from bridgegen.assess.conflict.happening import happened
from bridgegen.assess.conflict.harm import Count
from bridgegen.assess.conflict.plausibility import Implausible, plausibility
from bridgegen.assess.criteria import OF_BASELINE, Monitor, quantity
from bridgegen.assess.criteria import evaluate as measure
from bridgegen.assess.objective import CLASSIFYING, Objective, Objectives, needs_sample
from bridgegen.base.arrays import Bool, Float, Int
from bridgegen.base.errors import InputError, UnknownNameError
from bridgegen.engine.baseline import RECORDED, difference, difference_of_trials
from bridgegen.engine.evaluation import Evaluation, Replay, Replays, Trials
from bridgegen.engine.options import PipelineOptions
from bridgegen.engine.variants import Variants, nominal_of
from bridgegen.engine.workers import CarriedDriver, Lost, Part, Recipe, Stream, Threads, Workers
from bridgegen.engine.workers.compile_ahead import compiled_ahead
from bridgegen.openx.opendrive.road_map import RoadMap
from bridgegen.openx.source import ConcreteScenario, OntologySource, Source, source_of
from bridgegen.scenario.language.criteria import PREFIX, joined, read_criterion
from bridgegen.scenario.language.scenario import SearchedScenario
from bridgegen.scenario.language.space import SearchSpace
from bridgegen.simulation.adversary import AdversarySource, Arena
from bridgegen.simulation.choice import EMBEDDED, SimulatorChoice
from bridgegen.simulation.rollout import NO_SCENARIO, WORKER_ENDED, Rollout
from bridgegen.simulation.rollout import joined as joined_rollouts
from bridgegen.simulation.simulator import Simulator
from bridgegen.simulation.vehicles import KINEMATIC

if TYPE_CHECKING:
    from bridgegen.simulation.embedded.batch import Batch

FAR_ROWS = 8
"""Rows per chunk if only the workers' machines have the simulator."""

KEPT_VARIANTS = 64
"""Storyboards that stay compiled."""

SAMPLE = 400
"""Random scenarios that set an objective's weights and scales where it needs a sample."""

Result = TypeVar("Result")
Args = TypeVarTuple("Args")


class Pipeline:
    """Everything between a row and its objectives, for one scenario, ego and road network.

    Attributes:
        scenario: the logical scenario.
        space: its search space; names the columns of X.
        driver: the ego's driver.
        source: makes its concrete scenarios.
        objective: set by ``choose_objective``.
        metrics: the names of all metrics that are recorded: those requested, and those that the
            objective and the thresholds need; then the margins of criteria, and the baseline's.
        monitor: the pass criteria, of the scenario and of the options.
        simulator: runs the scenario's storyboard; the embedded one if only the workers' machines
            have the chosen one.
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
        self._simulates = EMBEDDED if self._is_far else simulator
        self._given_driver, self._refused = driver, ""
        self.simulator: Simulator[Any] = self._simulator_of(nominal)
        self.driver = self.simulator.embedded.program.driver
        if driver is None and self.driver != egos.STORYBOARD:  # write the file's choice, too
            self.source = _source(scenario, self.driver, road_map, space)
        if self._is_far and self.vehicle != KINEMATIC:
            raise InputError(
                f"{scenario.place}: the vehicle '{self.vehicle}' is of the embedded simulator "
                f"(--vehicle {KINEMATIC})"
            )
        if self.cause is not None:
            require(self.cause, self.driver, self.vehicle)
        sees, embedded = simulator.detects, self.simulator.embedded
        held = measures.held_by(self.driver, detects=sees)
        named = f"the driver '{self.driver.name}'"
        self.monitor = Monitor(
            joined(scenario.criteria, [read_criterion(one) for one in options.criteria]),
            embedded.program.names, held, embedded.duration, named,
        )  # fmt: skip
        if recorded is None:
            also = (*options.metrics, *self.monitor.metrics)
            recorded = metrics_of(scenario, self.driver, also, detects=sees)
        self.baseline = self._baseline_of(options)
        margins = [name for name in recorded if name.startswith(PREFIX)]
        beside = [name for name in recorded if name.startswith(OF_BASELINE)]
        own = [name for name in recorded if name not in (*margins, *beside)]
        known = quantities.require(own, held, named)
        if not beside and self.baseline is not None:
            beside = list(RECORDED)
        self.metrics = (*known, *(margins or self.monitor.names), *beside)
        self._roads: Any = self._static_roads(nominal)
        self._variants = Variants.of(scenario, space, self.source, embedded, driver)
        self._variant = lru_cache(maxsize=KEPT_VARIANTS)(self._make_variant)

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
            options, ego=options.worse_than, worse_than=None, metrics=(), causes=False, cause=None
        )
        one = Pipeline(options=alone, workers=self._workers, **self._made_with)
        if one.driver == self.driver:
            raise InputError(
                f"a baseline must be another driver than the ego's, both are {one.driver.label}"
            )
        return one

    def elsewhere(self, simulator: SimulatorChoice) -> "Pipeline":
        """Return the same with another simulator, which seeks no causes unless one counts.

        Raises:
            InputError: see ``__init__``.
        """
        here = self._workers if self._workers.are_here else Threads()
        one = Pipeline(
            options=replace(self._options, causes=False), recorded=self.metrics, workers=here,
            **self._made_with | {"simulator": simulator},
        )  # fmt: skip
        one.choose_objective(self.objective)
        return one

    @property
    def vehicle(self) -> str:
        """How the ego moves, one of `bridgegen.simulation.vehicles.VEHICLES`."""
        return self.simulator.embedded.program.vehicle

    def _simulator_of(self, nominal: ConcreteScenario) -> Simulator[Any]:
        place = self.scenario.name
        return self._simulates.simulator(
            nominal.storyboard, place, self._given_driver, self._options.vehicle
        )

    def _static_roads(self, nominal: ConcreteScenario) -> Any:
        """Return the compiled road network, None if rows have several."""
        if {*self._road_names} & {*self.space.variables}:
            return None
        return self.simulator.roads([nominal.roads])

    def _make_variant(self, key: tuple[float, ...]) -> "Pipeline":
        """Return the pipeline of the rows that have these values of what storyboards differ in."""
        one = copy(self)
        one._variants = replace(self._variants, names=())
        try:
            values = dict(zip(self._variants.names, key, strict=True))
            nominal = nominal_of(self.source, self.space, values)
            one.simulator = self._simulator_of(nominal)
            one._roads = one._static_roads(nominal)
        except InputError as error:  # it is a result of these rows; the others go on
            one.simulator, one._refused = self.simulator, "; ".join(error.problems)
        return one

    @property
    def notes(self) -> tuple[str, ...]:
        """What is run otherwise than one may expect, a sentence each."""
        return self._variants.notes

    def by_variant(self, X: Float) -> "Iterator[tuple[Int, Pipeline]]":
        """Yield the rows of each storyboard, and the pipeline that has it.

        Args:
            X: ``(N, len(space.names))``.

        Yields:
            Their numbers in X, ascending; and the pipeline, this one where one serves every row.
        """
        if self.scenario.checks and not self._refused:
            table = {name: X[:, i] for i, name in enumerate(self.space.names)}
            wrong = np.zeros(len(X), np.bool_)
            for rule, rows in self.scenario.broken(table).items():
                if (fresh := rows & ~wrong).any():
                    yield np.flatnonzero(fresh), self._refusing(rule)
                wrong |= rows
            if wrong.any():
                right = np.flatnonzero(~wrong)
                if right.size:
                    yield from ((right[at], one) for at, one in self._by_key(X[right]))
                return
        yield from self._by_key(X)

    def _refusing(self, rule: str) -> "Pipeline":
        """Return a pipeline in which every row fails, for it breaks a rule."""
        one = copy(self)
        one._variants, one._refused = replace(self._variants, names=()), rule
        return one

    def _by_key(self, X: Float) -> "Iterator[tuple[Int, Pipeline]]":
        """Yield rows that keep all checks, see ``by_variant``."""
        names = self._variants.names
        if not (names and len(X)):
            yield np.arange(len(X)), self
            return
        columns = [self.space.index(name) for name in names]
        keys, which = np.unique(X[:, columns], axis=0, return_inverse=True)
        for k, key in enumerate(keys.tolist()):
            yield np.flatnonzero(which.reshape(-1) == k), self._variant(tuple(key))

    @cached_property
    def recipe(self) -> Recipe:
        """Builds this pipeline in a worker, without the objective, which is sent with the rows."""
        return self._recipe_of(_remade)

    def _recipe_of(self, make: Callable[..., Any]) -> Recipe:
        named = (self._options.ego, self._options.worse_than)
        carried = tuple(CarriedDriver.of(name) if name else None for name in named)
        options = replace(self._options, ego=None, worse_than=None)
        return Recipe.of(make, carried, options, recorded=self.metrics, **self._made_with)

    @property
    def units(self) -> Mapping[str, str]:
        """The unit of each recorded quantity."""
        margins = dict(zip(self.monitor.names, self.monitor.units, strict=True))
        return {name: margins.get(name) or quantity(name).unit for name in self.metrics}

    @property
    def rows_at_once(self) -> int:
        """The number of rows of a chunk that is fastest; see `Simulator`."""
        if self._is_far:
            return FAR_ROWS
        own = self.simulator.rows_at_once
        return own if self.baseline is None else max(own, self.baseline.rows_at_once)

    @property
    def runs_at_once(self) -> int:
        """The number of threads that is fastest; see `Simulator`."""
        own = self.simulator.runs_at_once
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
        if not isinstance(self.source, AdversarySource):
            raise InputError(f"{self.scenario.place}: no participant is driven by an adversary")
        if self._is_far or self.simulator is not self.simulator.embedded:
            raise InputError(
                f"{self.scenario.place}: an agent drives in closed loop in the embedded simulator "
                "only; search there, and confirm its results in another simulator"
            )
        return Arena(self.source, self.simulator.embedded, self.space)

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
            if margins := [one.metric for one in spec.terms if one.metric.startswith(PREFIX)]:
                self._margins_that_count(margins)
            sample = None
            if needs_sample(spec.weights, spec.scale, objectives):
                rng = np.random.Generator(np.random.PCG64([seed, 1]))
                U = rng.random((SAMPLE, self.space.n_var))
                parts = self._map(type(self).measure_rows, self.space.decode(U))
                lost = np.full((1, len(self.metrics)), np.nan)
                rows = [lost if isinstance(one.result, Lost) else one.result for one in parts]
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
            self._map(type(self).measure_rows, nominal)
            return
        with compiled_ahead(self._recipe_of(_compile_ahead)) as is_shared:
            if is_shared and self.tries:
                self._compile_first()
            self.measure_rows(nominal)
        if self.baseline is not None:
            self.baseline.warm_up()

    def _compile_first(self) -> None:
        batch = self._nominal_batch()
        batch.compile_start()
        standing = batch.standing()
        apart = (*quantities.MEASURED, *self.monitor.names)
        quantities.evaluate(standing, [one for one in self.metrics if one not in apart])
        plausibility(standing)
        for fix in self.fixes:
            self._nominal_batch(fix).take_addresses()

    def compile_ahead(self) -> None:
        """Compile what ``_compile_first`` leaves: instants and the conflict analysis."""
        batch = self._nominal_batch()
        batch.compile_instants()
        analyse(batch.standing())

    def _nominal_batch(self, fix: Counterfactual | None = None) -> "Batch":
        nominal = self.space.row({})[np.newaxis]
        columns = {name: nominal[:, i] for i, name in enumerate(self.space.names)}
        roads, rows = self._roads_of(nominal)
        return self.simulator.embedded.batch(roads, rows, columns, **_changed(fix))

    def evaluate(self, X: Float) -> Evaluation:
        """Evaluate N rows; a row's result depends on that row alone.

        Args:
            X: ``(N, len(space.names))`` float64, feasible rows.
        """
        return self.joined(self._map(type(self).evaluate_rows, X, self.objective))

    def stream(self) -> "EvaluationStream":
        """Return what evaluates rows while its caller does something else."""
        rows = self._workers.stream(self, type(self).evaluate_rows, self.objective)
        return EvaluationStream(self, rows)

    def joined(self, parts: Sequence[Part[Evaluation]]) -> Evaluation:
        """Return the evaluation of consecutive rows from the workers' results."""
        return Evaluation.join(
            [
                self._lost(one.rows, one.result) if isinstance(one.result, Lost) else one.result
                for one in parts
            ]
        )

    def evaluate_rows(self, X: Float, objective: Objective) -> Evaluation:
        """Evaluate N rows at once, in this thread; ``evaluate`` shares them among workers."""
        return Evaluation.gathered(
            [(at, one._evaluate(X[at], objective)) for at, one in self.by_variant(X)]
        )

    def _evaluate(self, X: Float, objective: Objective) -> Evaluation:
        """Evaluate N rows of one storyboard."""
        roads, rows = self._roads_of(X)
        rollout = self._run(roads, rows, X)
        metrics = self.measure(rollout)
        gate = plausibility(rollout)
        texts = happened(rollout, may_stop=self._is_protocol)
        findings = Findings.of(analyse(rollout), gate.labels, objective.count, texts)
        fit = gate.code == Implausible.NONE if objective.gated else True
        F, ok = objective.F(metrics, self.metrics, fit)
        critical = objective.critical(metrics, self.metrics) & ok
        found = Evaluation(metrics, F, critical, rollout.status, findings, rollout.messages)
        if self.baseline is not None:
            other = self.baseline.evaluate_rows(X, objective)
            found = difference(
                found, self.metrics, other, self.baseline.metrics, gated=objective.gated
            )
        if not self.seeks_causes:
            return found

        def harmless(at: Int, replay: Counterfactual) -> Bool:
            return self._harmless(self._run(roads, rows[at], X[at], replay), objective)

        cause = causes(self.fixes, found.critical, harmless)
        counts = found.critical if self.cause is None else cause == self.cause
        return replace(found, critical=counts, cause=cause)

    @property
    def _is_protocol(self) -> bool:
        """Whether the scenario's own clauses or criteria decide what its ego fails.

        Not where criteria stand beside harm: they need not ask for what the scenario is about.
        """
        own = self.scenario
        return bool(own.clauses) or (bool(own.criteria) and own.objective.rule == "criteria")

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

    @cached_property
    def fixes(self) -> tuple[Counterfactual, ...]:
        """The changes that ``try_all`` takes by number: the counterfactuals of causes."""
        return counterfactuals(self.driver, self.vehicle)

    @property
    def kinds(self) -> Mapping[str, str]:
        """What each participant is, "car", "pedestrian" or "car or truck" say, by its name."""
        return self._variants.kinds

    def try_all(self, X: Float, fix: Int | None = None, noise: Float | None = None) -> Trials:
        """Simulate N rows again, each unchanged or with one stage idealised; see `Trials`.

        Args:
            X: ``(N, len(space.names))`` feasible rows.
            fix: ``(N,)`` number of each row's change in ``fixes``; −1, the default, for unchanged.
            noise: ``(N, len(space.names))`` rows whose random numbers these rows use, so that a
                row and its neighbours differ only in X; their own by default.
        """
        numbers = np.full(len(X), -1) if fix is None else fix
        keys = X if noise is None else noise
        rows = np.concatenate([X, keys, numbers[:, np.newaxis].astype(np.float64)], axis=1)
        if not len(rows):
            return Trials.none(0)
        order = np.arange(len(rows))
        if self._roads is not None:  # chunks with one driver are faster
            order = np.argsort(numbers, kind="stable")
        parts = self._map(
            type(self).try_rows, rows[order], self.objective.harm, self.objective.count
        )
        trials = [
            Trials.none(one.rows) if isinstance(one.result, Lost) else one.result for one in parts
        ]
        return Trials.join(trials).take(np.argsort(order))

    def try_rows(self, rows: Float, harm: str, count: Count) -> Trials:
        """Simulate N rows at once, in this thread; ``try_all`` shares them among workers.

        Args:
            rows: ``(N, 2 n + 1)``: X, the rows whose random numbers they use, number of the fix.
            harm: the quantity that is measured.
            count: the conflicts that count.
        """
        parts = [(at, one._try(rows[at], harm, count)) for at, one in self.by_variant(rows)]
        return Trials.join([one for _, one in parts]).take(
            np.argsort(np.concatenate([at for at, _ in parts]))
        )

    def _try(self, rows: Float, harm: str, count: Count) -> Trials:
        """Simulate N rows of one storyboard; see ``try_rows``."""
        n = len(self.space.names)
        X, keys, numbers = rows[:, :n], rows[:, n : 2 * n], rows[:, -1].astype(np.int64)
        if self._refused:
            return Trials.none(len(rows))
        roads, which = self._roads_of(X)
        parts, order = [], []
        for number in np.unique(numbers).tolist():
            at = np.flatnonzero(numbers == number)
            replay = self.fixes[number] if number >= 0 else None
            rollout = self.simulator.embedded.run(
                roads, which[at], self._columns(X[at]), noise=self.noise_keys(keys[at]),
                **_changed(replay),
            )  # fmt: skip
            order.append(at)
            parts.append(Trials.of(rollout, roads, which[at], harm, count))
        found = Trials.join(parts).take(np.argsort(np.concatenate(order)))
        if self.baseline is None:
            return found
        unchanged = np.concatenate([X, keys, np.full((len(X), 1), -1.0)], axis=1)
        return difference_of_trials(found, self.baseline.try_rows(unchanged, harm, count))

    def noise_keys(self, X: Float) -> npt.NDArray[np.uint64]:
        """Return the keys of N rows' random numbers, ``(N,)``."""
        return self.simulator.embedded.noise_keys(self._columns(X), len(X))

    def rollout_again(self, X: Float, noise: npt.NDArray[np.uint64]) -> Rollout:
        """Roll out N rows in the embedded simulator with the random numbers of some keys."""
        return joined_rollouts(
            [(at, one._again(X[at], noise[at])) for at, one in self.by_variant(X)]
        )

    def _again(self, X: Float, noise: npt.NDArray[np.uint64]) -> Rollout:
        """Roll out N rows of one storyboard; see ``rollout_again``."""
        if self._refused:
            return self._failed(X)
        roads, rows = self._roads_of(X)
        return self.simulator.embedded.run(roads, rows, self._columns(X), noise=noise)

    def _columns(self, X: Float) -> dict[str, Float]:
        return {name: X[:, i] for i, name in enumerate(self.space.names)}

    def facts(self, x: Float) -> dict[str, float]:
        """Return the parameters of one row that its scenario depends on, by name.

        Without an adversary's decisions, which the scenario contains as a course.
        """
        unused = {*self.source.unused_names, *self.space.decisions}
        return {name: one for name, one in self.space.values(x).items() if name not in unused}

    def concrete(self, x: Float, road_file: str = "") -> ConcreteScenario:
        """Return the concrete scenario of one row.

        Args:
            x: ``(len(space.names),)``.
            road_file: the name of its OpenDRIVE file; the map's own name by default.
        """
        return self.source.concrete(self.space.values(x), road_file)

    def rollout(self, X: Float, *, until_collision: bool = False) -> Rollout:
        """Roll out N rows as ``evaluate`` does, and keep the motion.

        Args:
            X: ``(N, len(space.names))`` float64.
            until_collision: whether rows may end where the ego collides, to save time.
        """
        if not self._is_far:
            return joined_rollouts(
                [
                    (at, one._run(*one._roads_of(X[at]), X[at], until_collision=until_collision))
                    for at, one in self.by_variant(X)
                ]
            )
        parts, start = [], 0
        for part in self._map(type(self).rollout, X):
            rows, rollout = np.arange(start, start := start + part.rows), part.result
            if isinstance(rollout, Lost):
                lost = self._run(*self._roads_of(X[rows]), X[rows])
                status = np.full(part.rows, WORKER_ENDED, np.int8)
                rollout = replace(lost, status=status, messages={0: rollout.reason})
            parts.append((rows, rollout))
        return joined_rollouts(parts)

    def rollouts(self, X: Float) -> list[Rollout | Lost]:
        """Roll out N rows in the workers; return the rollouts of consecutive parts of them."""
        return [one.result for one in self._map(type(self).rollout, X)]

    def replays(
        self, X: Float, *, plans: bool = True, noise: npt.NDArray[np.uint64] | None = None
    ) -> Replays:
        """Roll out N rows, of one storyboard or of several, as ``replay`` does."""
        return Replays(
            tuple(
                (at, one.replay(X[at], plans=plans, noise=None if noise is None else noise[at]))
                for at, one in self.by_variant(X)
            )
        )

    def replay(
        self, X: Float, *, plans: bool = True, noise: npt.NDArray[np.uint64] | None = None
    ) -> Replay:
        """Roll out N rows of one storyboard as ``evaluate`` does, with the egos' plans and weather.

        Args:
            X: ``(N, len(space.names))`` float64.
            plans: whether to compute the egos' planned paths, which takes many times as long; only
                the embedded simulator can.
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

    def bodies(self, x: Float) -> Mapping[str, str]:
        """Return what the entities of a row are, by name: a car, a pedestrian, a cone."""
        return self.source.bodies(self.space.values(x))

    def _failed(self, X: Float) -> Rollout:
        """Return the rollout of N rows whose values make no scenario."""
        columns = {
            name: X[:, i]
            for i, name in enumerate(self.space.names)
            if name not in self.simulator.fixed
        }
        batch = self.simulator.embedded.batch(*self._roads_of(X), columns)
        batch.start()
        batch.fail(NO_SCENARIO, self._refused)
        return batch.rollout()

    def _run(
        self,
        roads: Any,
        rows: Int,
        X: Float,
        replay: Counterfactual | None = None,
        *,
        until_collision: bool = False,
    ) -> Rollout:
        """Roll out N rows of one storyboard."""
        if self._refused:
            return self._failed(X)
        columns = {name: X[:, i] for i, name in enumerate(self.space.names)}
        if until_collision and self.simulator is self.simulator.embedded:
            return self.simulator.run(roads, rows, columns, until_collision=True)
        if replay is not None and replay.kinematic:  # another vehicle has the embedded one alone
            return self.simulator.embedded.run(roads, rows, columns, **_changed(replay))
        if replay is None:
            return self.simulator.run(roads, rows, columns)
        return self.simulator.run(roads, rows, columns, driver=replay.driver, dry=replay.dry)

    def measure_rows(self, X: Float) -> Float:
        """Return the metrics of N rows, ``(N, M)``, in this thread."""
        return self.measure(self.rollout(X))

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
            self.simulator.stop()
            raise

    def _lost(self, rows: int, lost: Lost) -> Evaluation:
        """Return the evaluation of rows that ended their workers."""
        metrics = np.full((rows, len(self.metrics)), np.nan)
        F, critical = self.objective.F(metrics, self.metrics)
        status = np.full(rows, WORKER_ENDED, np.int8)
        cause = np.full(rows, Cause.NONE, np.int8) if self.seeks_causes else None
        findings = Findings.none(rows)
        return Evaluation(metrics, F, critical, status, findings, {0: lost.reason}, cause)

    def _roads_of(self, X: Float) -> tuple[Any, Int]:
        """Return the compiled road networks of rows, and each row's network, ``(N,)``."""
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
        return self._pipeline.joined(parts)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        if self._pending:
            self._pipeline.simulator.stop()
        self._rows.close()


def _changed(fix: Counterfactual | None) -> dict[str, Any]:
    """Return what a replay changes, as arguments of the embedded simulator."""
    if fix is None:
        return {}
    return {"driver": fix.driver, "dry": fix.dry, "kinematic": fix.kinematic}


Carried = tuple[CarriedDriver | None, CarriedDriver | None]
"""The ego's driver and the baseline's."""


def _remade(carried: Carried, options: PipelineOptions, **made_with: Any) -> Pipeline:
    """Return a pipeline for a worker, in one thread, with its kernels compiled."""
    ego, baseline = (one.here() if one else None for one in carried)
    options = replace(options, ego=ego, worse_than=baseline)
    pipeline = Pipeline(options=options, **made_with, workers=Threads(1))
    pipeline.warm_up()
    return pipeline


def _compile_ahead(carried: Carried, options: PipelineOptions, **made_with: Any) -> None:
    """Compile what a pipeline will need; a driver of the user's own is not made for it."""
    ego, _ = carried
    made_with["recorded"] = [n for n in made_with["recorded"] if not n.startswith(OF_BASELINE)]
    if ego and (egos.is_spec(ego.name) or egos.is_planner(ego.name)):
        options = replace(options, ego=None, ideal=(), metrics=())
        made_with["recorded"] = None
    else:
        options = replace(options, ego=ego.name if ego else None)
    Pipeline(options=options, **made_with, workers=Threads(1)).compile_ahead()


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
        if source.variant_names:
            raise InputError(
                f"{scenario.place}: an adversary drives in one storyboard, so no type may vary "
                f"({', '.join(source.variant_names)})"
            )
        return AdversarySource(source, space.values(space.row({})))
    return source


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
