"""Rows → rollouts, in this thread: a scenario, its ego's driver and a simulator, made ready once.

Nothing here knows metrics, objectives or workers; `bridgegen.engine.pipeline` adds them.
"""

from collections.abc import Iterator, Mapping
from copy import copy
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache, partial
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from bridgegen import drivers as egos
from bridgegen.assess.cause import Counterfactual, counterfactuals
from bridgegen.base.arrays import Float, Int
from bridgegen.base.errors import InputError
from bridgegen.drivers import Driver
from bridgegen.drivers.identity import checked_name
from bridgegen.drivers.kinds import NAMES
from bridgegen.engine.options import PipelineOptions
from bridgegen.openx.opendrive.road_map import RoadMap
from bridgegen.openx.source import ConcreteScenario, OntologySource, Source, source_of
from bridgegen.scenario.language.scenario import SearchedScenario
from bridgegen.scenario.language.space import SearchSpace
from bridgegen.simulation.adversary import AdversarySource
from bridgegen.simulation.choice import EMBEDDED, SimulatorChoice
from bridgegen.simulation.embedded.simulator import EmbeddedSimulator
from bridgegen.simulation.rollout import NO_SCENARIO, Rollout, joined
from bridgegen.simulation.simulator import Simulator

if TYPE_CHECKING:
    from bridgegen.simulation.embedded.batch import Batch

# --- The storyboards of one search: rows share one, unless what they vary is part of its structure.
# A compiled storyboard takes numbers from each row. A text (a catalogue's entry, a map's name) and
# a number in a place that is compiled as a constant (a clothoid's length, the stop time) give each
# of their values a storyboard of its own.


MOST_SHOWN = 60
"""Largest number of characters of what a parameter is used for, in a note."""


@dataclass(frozen=True)
class Variants:
    """What the storyboards of a search differ in.

    Attributes:
        names: the searched parameters whose values each need a storyboard of their own.
        notes: what is run otherwise than one may expect, a sentence each.
        kinds: what each participant is, "car", "pedestrian" or "car or truck" say, by its name.
    """

    names: tuple[str, ...]
    notes: tuple[str, ...]
    kinds: Mapping[str, str]

    @classmethod
    def of(
        cls,
        scenario: SearchedScenario,
        space: SearchSpace,
        source: Source,
        nominal: EmbeddedSimulator,
        driver: Driver | None,
    ) -> "Variants":
        """Return those of a scenario.

        Args:
            scenario: the logical scenario.
            space: its search space.
            source: makes its concrete scenarios.
            nominal: with the storyboard of the defaults.
            driver: of the ego; None leaves it to the storyboards.

        Raises:
            UnsupportedError: what one of the storyboards needs and cannot be run.
            InputError: see `EmbeddedSimulator`.
        """
        moving = {*space.variables}
        moving |= {derived.name for derived in scenario.derived if derived.names & moving}
        texts, programs = moving & {*source.variant_names}, [nominal.program]
        for key in source.variants if texts else ():  # all, so that what is wrong is found now
            values = dict(zip(source.variant_names, key, strict=True))
            storyboard = nominal_of(source, space, values).storyboard
            programs.append(EmbeddedSimulator(storyboard, scenario.name, driver=driver).program)
        fixed = {name: use for program in programs for name, use in program.fixed.items()}
        varied = texts | (moving & fixed.keys())
        notes = [note for program in programs for note in program.notes]
        notes += [
            f"{scenario.place}: parameter '{name}' is used for {_short(fixed[name])}: each of its "
            "values is compiled by itself, which takes longer than its simulation"
            for name in space.names
            if name in varied - texts
        ]
        kinds: dict[str, dict[str, None]] = {}
        for program in programs:
            for name, kind in zip(program.names, program.kinds.tolist(), strict=True):
                kinds.setdefault(name, {})[NAMES[kind]] = None
        return cls(
            tuple(name for name in space.names if name in varied),
            tuple(dict.fromkeys(notes)),
            {name: " or ".join(found) for name, found in kinds.items()},
        )


def _short(use: str) -> str:
    """Return what a parameter is used for, a long formula cut."""
    return use if len(use) <= MOST_SHOWN else f"{use[: MOST_SHOWN - 1]}…"


def nominal_of(source: Source, space: SearchSpace, values: Mapping[str, float]) -> ConcreteScenario:
    """Return the concrete scenario of the defaults but for some values, whatever limits these."""
    return source.concrete(space.values(space.row({})) | dict(values))


# A storyboard of its own costs a row 33 ms in all, 7 ms of them to compile (Vector's CBNA with a
# continuous speed); a row that shares one costs 0.2 ms.
KEPT_VARIANTS = 64
"""Number of storyboards that stay compiled."""

Roads = tuple[Any, Int]
"""P road networks that a simulator has made ready, and each row's network ``(N,)``."""


class Runner:
    """Runs rows of one scenario with one driver in one simulator.

    Rows share a storyboard, unless what they vary is part of its structure: ``by_variant`` yields
    the runner of each storyboard that rows have.

    Attributes:
        scenario: the logical scenario.
        space: its search space; names the columns of X.
        source: makes its concrete scenarios.
        driver: the ego's driver.
        embedded: the embedded simulator with the storyboard.
        simulator: runs the storyboard; may be ``embedded``.
        refused: why no row of this storyboard makes a scenario; "" if they do.
        left_hand: whether it is the mirror image of left-hand traffic.
    """

    def __init__(
        self,
        scenario: SearchedScenario,
        space: SearchSpace,
        options: PipelineOptions,
        *,
        road_map: RoadMap | None = None,
        simulator: SimulatorChoice = EMBEDDED,
    ) -> None:
        """Prepare a scenario.

        Args:
            scenario: the logical scenario.
            space: its search space.
            options: the ego's driver, what of it is ideal, and its vehicle.
            road_map: the map to use; the scenario's own road network by default.
            simulator: runs the scenarios.

        Raises:
            UnknownNameError: no such driver.
            InputError: the simulator is unavailable, or cannot run the scenario.
        """
        self.scenario, self.space = scenario, space
        name = options.ego or scenario.driver
        if name is None and options.ideal:
            raise InputError(f"{scenario.place}: to make stages of its driver ideal, name it (ego)")
        driver = egos.get(name, options.ideal, options.time_limit) if name else None
        self._given_driver, self._vehicle, self._choice = driver, options.vehicle, simulator
        self.refused = ""
        self.source = _source(scenario, driver, road_map, space)
        nominal = self.concrete(space.row({}), road_map.path.name if road_map else "")
        self._take_storyboard(nominal)
        self.driver = self.embedded.program.driver
        if options.driver_name is not None:
            self.driver = replace(self.driver, called=checked_name(options.driver_name))
        # The driver is known only once the storyboard is compiled.
        if driver is None and self.driver != egos.STORYBOARD:  # write the file's choice, too
            self.source = _source(scenario, self.driver, road_map, space)
        self._roads = self._static_roads(nominal)
        self._variants = Variants.of(scenario, space, self.source, self.embedded, driver)
        self._variant = lru_cache(maxsize=KEPT_VARIANTS)(self._make_variant)

    def _take_storyboard(self, nominal: ConcreteScenario) -> None:
        """Make the simulators ready for the storyboard of a concrete scenario."""
        make = partial(
            EmbeddedSimulator,
            nominal.storyboard,
            self.scenario.name,
            driver=self._given_driver,
            vehicle=self._vehicle,
        )
        self.left_hand = nominal.storyboard.left_hand
        self.embedded = make()
        if (finer := self._choice.finer) > 1:
            self.embedded = make(time_step=self.embedded.time_step / finer)
        self.simulator: Simulator[Any] = self._choice.around(self.embedded, nominal.storyboard)

    def _static_roads(self, nominal: ConcreteScenario) -> Any:
        """Return the compiled road network, None if rows have several."""
        if {*self._road_names} & {*self.space.variables}:
            return None
        return self.simulator.roads([nominal.roads])

    @property
    def vehicle(self) -> str:
        """How the ego moves, one of `bridgegen.simulation.vehicles.VEHICLES`."""
        return self.embedded.program.vehicle

    @property
    def notes(self) -> tuple[str, ...]:
        """What is run otherwise than one may expect, a sentence each."""
        return self._variants.notes

    @property
    def kinds(self) -> Mapping[str, str]:
        """What each participant is, "car", "pedestrian" or "car or truck" say, by its name."""
        return self._variants.kinds

    @cached_property
    def fixes(self) -> tuple[Counterfactual, ...]:
        """The changes to find causes by: each stage of the driver made ideal, a dry road, …."""
        return counterfactuals(self.driver, self.vehicle)

    def run(
        self,
        X: Float,
        *,
        fix: Counterfactual | None = None,
        noise: npt.NDArray[np.uint64] | None = None,
        until_collision: bool = False,
        roads: Roads | None = None,
        repeat: int = 0,
    ) -> Rollout:
        """Roll out N rows; a row's result depends on that row alone.

        Args:
            X: ``(N, len(space.names))`` float64, feasible rows.
            fix: a change of the driver, its vehicle or the road; none by default.
            noise: ``(N,)`` keys of the rows' random numbers, in the embedded simulator; their own
                by default.
            until_collision: whether rows may end where the ego collides, to save time.
            roads: of these rows, all of one storyboard; see ``roads_of``.
            repeat: which evaluation it is: the embedded simulator gives other seeds in each.
        """
        if roads is not None:
            return self._run(X, fix, noise, roads, until_collision=until_collision, repeat=repeat)
        parts = []
        for at, runner in self.by_variant(X):
            keys = None if noise is None else noise[at]
            found = runner._run(X[at], fix, keys, until_collision=until_collision, repeat=repeat)
            parts.append((at, found))
        return joined(parts)

    def _run(
        self,
        X: Float,
        fix: Counterfactual | None,
        noise: npt.NDArray[np.uint64] | None,
        roads: Roads | None = None,
        *,
        until_collision: bool,
        repeat: int,
    ) -> Rollout:
        """Roll out N rows of one storyboard."""
        # A refused row gets a rollout with a status: its values are a result of the search, not an
        # error of the run.
        if self.refused:
            return self._failed(X)
        networks, rows = roads or self.roads_of(X)
        columns, embedded = self.columns(X), self.embedded
        early = until_collision and self.simulator is embedded
        # Other simulators know neither keys of noise, nor another vehicle, nor an early end.
        if noise is not None or early or (fix is not None and fix.kinematic):
            return embedded.run(
                networks, rows, columns, noise=noise, until_collision=early, **_changed(fix)
            )
        if repeat and self.simulator is embedded:
            return embedded.run(networks, rows, columns, repeat=repeat, **_changed(fix))
        if fix is None:
            return self.simulator.run(networks, rows, columns)
        return self.simulator.run(networks, rows, columns, driver=fix.driver, dry=fix.dry)

    def _failed(self, X: Float) -> Rollout:
        """Return the rollout of N rows whose values make no scenario."""
        fixed = self.embedded.fixed
        # The nominal storyboard has other values as constants, and would refuse these.
        columns = {name: column for name, column in self.columns(X).items() if name not in fixed}
        batch = self.embedded.batch(*self.roads_of(X), columns)
        batch.start()
        batch.fail(NO_SCENARIO, self.refused)
        return batch.rollout()

    def nominal_batch(self, fix: Counterfactual | None = None) -> "Batch":
        """Return the batch of the row of the defaults, in the embedded simulator, not run yet."""
        nominal = self.space.row({})[np.newaxis]
        return self.embedded.batch(*self.roads_of(nominal), self.columns(nominal), **_changed(fix))

    def by_variant(self, X: Float) -> "Iterator[tuple[Int, Runner]]":
        """Yield the rows of each storyboard, and the runner that has it.

        Args:
            X: ``(N, len(space.names))``.

        Yields:
            Their numbers in X, ascending; and the runner, this one where one serves every row.
        """
        if self.scenario.checks and not self.refused:
            wrong = np.zeros(len(X), np.bool_)
            for rule, rows in self.scenario.broken(self.columns(X)).items():
                # A row that breaks several rules is refused by the first one only, for it is
                # yielded once.
                if (fresh := rows & ~wrong).any():
                    yield np.flatnonzero(fresh), self._refusing(rule)
                wrong |= rows
            if wrong.any():
                right = np.flatnonzero(~wrong)
                if right.size:
                    yield from ((right[at], runner) for at, runner in self._by_key(X[right]))
                return
        yield from self._by_key(X)

    def _refusing(self, rule: str) -> "Runner":
        """Return a runner in which every row fails, for it breaks a rule."""
        runner = copy(self)
        runner._variants, runner.refused = replace(self._variants, names=()), rule
        return runner

    def _by_key(self, X: Float) -> "Iterator[tuple[Int, Runner]]":
        """Yield rows that keep all checks, see ``by_variant``."""
        names = self._variants.names
        if not (names and len(X)):
            yield np.arange(len(X)), self
            return
        columns = [self.space.index(name) for name in names]
        # Which rows run together does not matter: a row has the same bits as in a search of its own
        # storyboard alone.
        keys, which = np.unique(X[:, columns], axis=0, return_inverse=True)
        for k, key in enumerate(keys.tolist()):
            yield np.flatnonzero(which.reshape(-1) == k), self._variant(tuple(key))

    def _make_variant(self, key: tuple[float, ...]) -> "Runner":
        """Return the runner of the rows that have these values of what storyboards differ in."""
        # Shallow: source, space and road map are shared, the storyboard is its own.
        runner = copy(self)
        runner._variants = replace(self._variants, names=())
        try:
            values = dict(zip(self._variants.names, key, strict=True))
            # A number that makes no scenario (a place beyond the road) costs its rows alone.
            # Combinations of texts are all checked at the start.
            nominal = nominal_of(self.source, self.space, values)
            runner._take_storyboard(nominal)
            runner._roads = runner._static_roads(nominal)
        except InputError as error:  # it is a result of these rows; the others go on
            runner.embedded, runner.simulator = self.embedded, self.simulator
            runner.refused = "; ".join(error.problems)
        return runner

    @property
    def has_variants(self) -> bool:
        """Whether rows may have several storyboards; see ``by_variant``."""
        return bool(self._variants.names)

    @property
    def has_one_network(self) -> bool:
        """Whether all rows have the same road network."""
        return self._roads is not None

    def roads_of(self, X: Float) -> Roads:
        """Return the compiled road networks of rows, and each row's network, ``(N,)``."""
        # The usual case: nothing that the roads depend on is searched, and they are compiled once.
        if self._roads is not None:
            return self._roads, np.zeros(len(X), dtype=np.int64)
        source, names = self.source, self._road_names
        columns = [self.space.index(name) for name in names]
        # Rows with equal values share a network: only the columns that it depends on are compared.
        distinct, rows = np.unique(X[:, columns], axis=0, return_inverse=True)
        values = [dict(zip(names, row, strict=True)) for row in distinct.tolist()]
        roads = self.simulator.roads(
            [source.roads(value) for value in values], [source.courses(value) for value in values]
        )
        # NumPy 2.0.0 gives the inverse an axis more than later versions do.
        return roads, rows.reshape(-1).astype(np.int64)

    @property
    def _road_names(self) -> tuple[str, ...]:
        """The parameters that a row's road network, and the courses on it, depend on."""
        return tuple(dict.fromkeys((*self.source.static_names, *self.source.course_names)))

    def columns(self, X: Float) -> dict[str, Float]:
        """Return the values of N rows, ``(N,)`` by parameter."""
        return {name: X[:, i] for i, name in enumerate(self.space.names)}

    def noise_keys(self, X: Float) -> npt.NDArray[np.uint64]:
        """Return the keys of N rows' random numbers, ``(N,)``."""
        return self.embedded.noise_keys(self.columns(X), len(X))

    def facts(self, x: Float) -> dict[str, float]:
        """Return the parameters of one row that its scenario depends on, by name.

        Without an adversary's decisions, which the scenario contains as a course.
        """
        unused = {*self.source.unused_names, *self.space.decisions}
        return {name: value for name, value in self.space.values(x).items() if name not in unused}

    def concrete(self, x: Float, road_file: str = "") -> ConcreteScenario:
        """Return the concrete scenario of one row.

        Args:
            x: ``(len(space.names),)``.
            road_file: the name of its OpenDRIVE file; the map's own name by default.
        """
        return self.source.concrete(self.space.values(x), road_file)

    def bodies(self, x: Float) -> Mapping[str, str]:
        """Return what the entities of a row are, by name: a car, a pedestrian, a cone."""
        return self.source.bodies(self.space.values(x))


def _changed(fix: Counterfactual | None) -> dict[str, Any]:
    """Return what a fix changes, as arguments of the embedded simulator."""
    if fix is None:
        return {}
    return {"driver": fix.driver, "dry": fix.dry, "kinematic": fix.kinematic}


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
