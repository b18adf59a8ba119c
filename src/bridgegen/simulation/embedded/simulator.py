"""The embedded simulator: N rows of parameters against one compiled storyboard."""

import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from copy import copy
from dataclasses import replace
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from bridgegen.base.arrays import Float, Int
from bridgegen.base.cuda import DEVICE
from bridgegen.base.errors import InputError
from bridgegen.drivers import Driver
from bridgegen.drivers._weather_columns import WEATHER
from bridgegen.drivers.address import is_remote
from bridgegen.drivers.noise import noise_key
from bridgegen.drivers.user_drivers import Traits
from bridgegen.openx.opendrive.model import OpenDrive
from bridgegen.openx.openscenario.model import OpenScenario
from bridgegen.simulation.embedded._codes import (
    DOES,
    EVENT,
    EVENT_NUMBER,
    FIRST,
    KIND,
    LAST,
    ROW,
    WEATHER_CHANGE,
)
from bridgegen.simulation.embedded.compiler import compile_storyboard
from bridgegen.simulation.embedded.intentions import Intentions, intentions
from bridgegen.simulation.embedded.places.network import Network
from bridgegen.simulation.embedded.program import Program
from bridgegen.simulation.rollout import Rollout

if TYPE_CHECKING:
    from bridgegen.simulation.embedded.batch import Batch
    from bridgegen.simulation.embedded.co_simulation import CoSimulation
    from bridgegen.simulation.embedded.user_drivers import OwnDriver

# --- The weather of rows as a rollout went through it, from what the storyboard states and did ---


def weathers(
    program: Program, values: Mapping[str, npt.ArrayLike], rollout: Rollout, row: int
) -> list[tuple[int, Float]]:
    """Return one row's weather: from which instant on, and ``(WEATHER,)`` as sensors feel it.

    The first is the start's; then one for each event that changes it. Of an event that takes place
    more than once, the last time counts, as the rollout records it.

    Args:
        program: the compiled storyboard.
        values: ``(N,)`` float64 per parameter, as of the rollout.
        rollout: of these N rows.
        row: which of them.
    """
    from bridgegen.drivers._weather_kernels import change, set_clear  # numba is slow to import

    slots = program.fill(values, rollout.shape[0])[row]
    changes = [(0, 0)]
    for j in program.initial.tolist():
        if program.actions[j, DOES] == WEATHER_CHANGE:
            changes.append((0, int(program.actions[j, ROW])))
    for element in program.elements.tolist():
        if element[KIND] != EVENT:
            continue
        began = int(rollout.began[row, element[EVENT_NUMBER]])
        for j in range(element[FIRST], element[LAST]) if began >= 0 else ():
            if program.actions[j, DOES] == WEATHER_CHANGE:
                changes.append((began, int(program.actions[j, ROW])))
    now = np.zeros(WEATHER)
    set_clear(now)
    found: list[tuple[int, Float]] = []
    for k, environment in sorted(changes, key=lambda pair: pair[0]):
        change(now, program.weathers, environment, slots)
        if found and found[-1][0] == k:
            found.pop()
        found.append((k, now.copy()))
    return found


CHUNK = 128
"""Largest number of rows that one thread rolls out at a time: enough to keep it busy."""

CHUNK_BYTES, INSTANT_BYTES, VERTEX_BYTES = 16 * 2**20, 112, 80
"""Largest size of the records of a chunk of rows, size of an entity's instant, and of a vertex of
its path [bytes]; a small chunk is traversed quickly."""

DEVICE_ROWS, DEVICE_BYTES = 16_384, 2**30
"""Likewise of a batch that a GPU rolls out: it is busy from some ten thousand rows on."""

LOCK_STEP_ROWS = 1024
"""Number of rows that a driver in Python drives at a time: a thousand take it little longer than
one."""


class EmbeddedSimulator:
    """A `Simulator` in this process, compiled to machine code.

    Args:
        storyboard: the scenario file, validated.
        place: its name, for messages.
        driver: of the ego; the file's by default.
        ideal: idealised stages of the driver; its own by default.
        others: "attentive", "insistent", "lawful" or "scripted": the driver of all other
            participants; the file's by default.
        vehicle: how the ego moves, see `bridgegen.simulation.vehicles`; the file's by default.
        time_step: [s]; the file's by default.
        skipped: gets a sentence for each unsupported element, which is then left out instead of
            rejected, with the event, action, entity or condition group that contains it.

    Attributes:
        program: the compiled storyboard.
        partners: of each further vehicle that the ego's driver drives, a simulator of the same
            storyboard in which that vehicle is the ego; see `together`.

    Raises:
        UnsupportedError: what it cannot run, by name and line, all of it at once.
        InputError: an entity without a start, no entity at all, or a step out of range.
    """

    def __init__(
        self,
        storyboard: OpenScenario,
        place: str,
        *,
        driver: Driver | None = None,
        ideal: Iterable[str] | None = None,
        others: str | None = None,
        vehicle: str | None = None,
        time_step: float | None = None,
        skipped: list[str] | None = None,
    ) -> None:
        compiled = partial(
            compile_storyboard,
            storyboard,
            place,
            driver=driver,
            ideal=ideal,
            others=others,
            vehicle=vehicle,
            time_step=time_step,
        )
        self.program = compiled(skipped=skipped)
        self.partners: tuple[EmbeddedSimulator, ...] = ()
        for e in self.program.tested.tolist():
            partner = copy(self)
            partner.program, partner.partners = compiled(ego=e, skipped=skipped and []), ()
            self.partners += (partner,)

    def __getstate__(self) -> dict[str, Any]:
        """Another process has the same storyboard, and processes of its own for a user's driver."""
        return {"program": self.program, "partners": self.partners}

    @property
    def embedded(self) -> "EmbeddedSimulator":
        """See `Simulator`: itself."""
        return self

    @property
    def driver(self) -> str:
        """See `Simulator`."""
        return self.program.driver.label

    @property
    def rows_at_once(self) -> int:
        """See `Simulator`."""
        if self._asks_python:
            return LOCK_STEP_ROWS
        entities, vertices = len(self.program.names), self.program.most_vertices
        if os.environ.get(DEVICE):
            rows = DEVICE_BYTES // (entities * self.program.n_steps * INSTANT_BYTES)
            return max(1, min(DEVICE_ROWS, rows))
        # With 30 actors a chunk of 128 rows records more than the cache holds: 9.4 ms a row,
        # instead of 7.2 in chunks of 12.
        each = entities * (INSTANT_BYTES * self.program.n_steps + VERTEX_BYTES * vertices)
        return max(1, min(CHUNK, CHUNK_BYTES // each))

    @property
    def runs_at_once(self) -> int:
        """See `Simulator`."""
        if self._asks_python:
            return 1  # the user's driver is one, and has all rows at once
        return os.cpu_count() or 1

    @property
    def _asks_python(self) -> bool:
        return self.program.driver.is_own and self._own.traits.memory is None

    @property
    def time_step(self) -> float:
        """See `Simulator`."""
        return self.program.time_step

    @property
    def duration(self) -> float:
        """See `Simulator`."""
        return (self.program.n_steps - 1) * self.program.time_step

    @property
    def fixed(self) -> Mapping[str, str]:
        """See `Simulator`."""
        return self.program.fixed

    @property
    def parameters(self) -> Mapping[str, float]:
        """See `Simulator`."""
        return self.program.parameters

    def roads(
        self, models: Sequence[OpenDrive], courses: Sequence[Mapping[str, Float]] = ()
    ) -> Network:
        """See `Simulator`: each entity's route, planned and sampled."""
        network = Network(self.program, models, courses)
        network.partners = tuple(each.roads(models, courses) for each in self.partners)
        return network

    def run(
        self,
        roads: Network,
        rows: Int,
        values: Mapping[str, npt.ArrayLike],
        *,
        driver: Driver | None = None,
        dry: bool = False,
        kinematic: bool = False,
        noise: npt.NDArray[np.uint64] | None = None,
        until_collision: bool = False,
        repeat: int = 0,
    ) -> Rollout:
        """See `Simulator`; runs without the GIL.

        Args:
            roads: see `Simulator`, as for those that follow.
            rows: row i's road network.
            values: by parameter.
            driver: another one.
            dry: the road.
            kinematic: whether the ego's vehicle is, whatever its own is.
            noise: ``(N,)`` keys of the rows' random numbers; see ``noise_keys``.
            until_collision: whether a row ends soon after the ego collides; see `Batch`.
            repeat: which evaluation of the rows it is; see `Batch`.

        Raises:
            InputError: see `Simulator`; or a user's driver that cannot be made, or a driver that
                lives in another simulator.
        """
        chosen = self.program.changed(driver=driver)
        if chosen.driver.home:
            raise InputError(
                f"the driver '{chosen.driver.name}' drives in {chosen.driver.home} alone"
            )
        if not chosen.driver.is_own:
            batch = self.batch(
                roads,
                rows,
                values,
                driver=driver,
                dry=dry,
                kinematic=kinematic,
                noise=noise,
                until_collision=until_collision,
            )
            if not os.environ.get(DEVICE):
                return batch.run()
            from bridgegen.simulation.embedded.device import current

            return batch.run(partial(current().simulate_rows, chosen))
        # The driver's process may have to be given some of the rows again, so it is handed what
        # makes batches, not a batch.
        some = self._some(
            roads,
            rows,
            values,
            driver=driver,
            dry=dry,
            kinematic=kinematic,
            noise=noise,
            until_collision=until_collision,
            repeat=repeat,
        )
        return self._own.drive(chosen.changed(dry=dry, kinematic=kinematic), some, len(rows))

    def _some(
        self,
        roads: Network,
        rows: Int,
        values: Mapping[str, npt.ArrayLike],
        *,
        noise: npt.NDArray[np.uint64] | None = None,
        **how: Any,
    ) -> "Callable[[Int], Batch]":
        """Return what sets up some of the rows for the user's driver."""
        spec, others = self.program.driver.spec, [each.program.names[0] for each in self.partners]
        if others and (is_remote(spec) or self._own.traits.memory is not None):
            raise InputError(
                f"the driver '{spec}' drives one vehicle ({', '.join(others)} would be another); "
                "drivers that ship, classes in Python and co-simulation units drive several"
            )
        traits = self._own.traits
        for network in (roads, *roads.partners):
            network.provide(traits.wants)
        columns = {name: np.broadcast_to(value, len(rows)) for name, value in values.items()}

        def some(at: Int) -> "Batch":
            taken = {name: column[at] for name, column in columns.items()}
            key = None if noise is None else noise[at]
            return self.batch(roads, rows[at], taken, own=traits, noise=key, **how)

        return some

    def co_simulation(
        self,
        roads: Network,
        row: int,
        values: Mapping[str, float],
        *,
        driver: Driver | None = None,
        dry: bool = False,
    ) -> "CoSimulation":
        """Return one row, to be run together with another simulator.

        Args:
            roads: P road networks, made ready by this simulator.
            row: in 0..P-1, its road network.
            values: per parameter; see `Simulator.run`, as for the other arguments.
            driver: likewise.
            dry: likewise.

        Raises:
            InputError: see `run`.
            DriverError: a driver of the user's own failed as it began.
        """
        from bridgegen.simulation.embedded.co_simulation import CoSimulation

        program = self.program.changed(driver=driver)
        own = self._own if program.driver.is_own else None
        if own:
            roads.provide(own.traits.wants)
        batch = self.batch(
            roads, np.array([row]), values, driver=driver, dry=dry, own=own.traits if own else None
        )
        wheel = partial(own.wheel, program.changed(dry=dry)) if own else None
        return CoSimulation(
            batch, program.names, program.time_step, program.n_steps, program.actors, wheel
        )

    def failed(
        self, roads: Network, row: int, values: Mapping[str, float], status: int, message: str
    ) -> Rollout:
        """Return the rollout of a row that something went wrong with, N = 1.

        Args:
            roads: P road networks, made ready by this simulator.
            row: in 0..P-1, its road network.
            values: per parameter; see `Simulator.run`.
            status: of `STATUS_MESSAGES`.
            message: further details.
        """
        batch = self.batch(roads, np.array([row]), values)
        batch.start()
        batch.fail(status, message)
        return batch.rollout()

    def stop(self) -> None:
        """See `Simulator`."""
        for simulator in (self, *self.partners) if self.program.driver.is_own else ():
            simulator._own.stop()

    @property
    def own_driver(self) -> "OwnDriver":
        """The user's driver; only if the storyboard's is the user's own."""
        return self._own

    @cached_property
    def _own(self) -> "OwnDriver":
        from bridgegen.simulation.embedded.user_drivers import (
            OwnDriver,  # numba is slow to import
        )

        return OwnDriver(self.program.driver)

    def weathers(
        self, values: Mapping[str, npt.ArrayLike], rollout: Rollout, row: int
    ) -> list[tuple[int, Float]]:
        """Return one row's weather as a rollout went through it; see `weathers.weathers`."""
        return weathers(self.program, values, rollout, row)

    def noise_keys(self, values: Mapping[str, npt.ArrayLike], n: int) -> npt.NDArray[np.uint64]:
        """Return the keys of n rows' random numbers, see `batch.noise_keys`."""
        from bridgegen.simulation.embedded.batch import noise_keys  # numba is slow to import

        return noise_keys(self.program, values, n)

    def intentions(
        self, roads: Network, rows: Int, values: Mapping[str, npt.ArrayLike], rollout: Rollout
    ) -> Intentions:
        """Return what the egos of a rollout meant to do; see `intentions.intentions`.

        A user's driver that plans drives these rows once more, and its trajectories are kept.
        """
        found = intentions(self.program, roads, rows, values, rollout)
        if not (self._asks_python and self._own.has_planned):
            return found
        some = self._some(roads, rows, values)
        return replace(found, plans=self._own.plans(self.program, some, len(rows)))

    def batch(
        self,
        roads: Network,
        rows: Int,
        values: Mapping[str, npt.ArrayLike],
        *,
        driver: Driver | None = None,
        dry: bool = False,
        kinematic: bool = False,
        own: Traits | None = None,
        noise: npt.NDArray[np.uint64] | None = None,
        until_collision: bool = False,
        repeat: int = 0,
    ) -> "Batch":
        """Set N rows up, for a driver that is asked at every instant.

        Args:
            roads: as of ``run``, and so are those that follow.
            rows: row i's road network.
            values: by parameter.
            driver: another one.
            dry: the road.
            kinematic: the vehicle.
            own: what a driver of the user's own needs; None without one.
            noise: likewise.
            until_collision: likewise.
            repeat: likewise.
        """
        from bridgegen.simulation.embedded.batch import Batch  # numba is slow to import

        program = self.program.changed(driver=driver, dry=dry, kinematic=kinematic)
        if not self.partners:
            return Batch(program, roads, rows, values, own, noise, until_collision, repeat)
        from bridgegen.simulation.embedded.together import Together

        keys = self.noise_keys(values, len(rows)) if noise is None else noise
        found = []
        for simulator, network in zip(self.partners, roads.partners, strict=True):
            there = simulator.program.changed(driver=driver, dry=dry, kinematic=kinematic)
            its = keys ^ noise_key({there.names[0]: 0.0}, 1)  # sensors err independently
            other = Batch(there, network, rows, values, own, its, repeat=repeat)
            wheel = partial(getattr, other, "demand")
            found.append((other, partial(simulator._own.wheel, there, other) if own else wheel))
        # A row in which one vehicle collides goes on for the other.
        return Together(found, program, roads, rows, values, own, keys, False, repeat)
