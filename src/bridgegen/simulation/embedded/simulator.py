"""The embedded simulator: N rows of parameters against one compiled storyboard."""

from collections.abc import Mapping, Sequence

import numpy as np
import numpy.typing as npt

from bridgegen.arrays import Int
from bridgegen.ego import Driver
from bridgegen.errors import InputError
from bridgegen.openx.opendrive.model import OpenDrive
from bridgegen.openx.openscenario.model import OpenScenario
from bridgegen.simulation.embedded.compiler import compile_storyboard
from bridgegen.simulation.embedded.network import Network, compile_network
from bridgegen.simulation.rollout import Rollout


class EmbeddedSimulator:
    """A `Simulator` in this process, compiled to machine code.

    Args:
        storyboard: the scenario file, validated.
        place: its name, for messages.
        driver: who drives the ego; what the file says by default.
        time_step: [s]; what the file says by default.

    Attributes:
        program: the compiled storyboard.

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
        time_step: float | None = None,
    ) -> None:
        self.program = compile_storyboard(storyboard, place, driver=driver, time_step=time_step)

    @property
    def driver(self) -> str:
        """See `Simulator`."""
        return self.program.driver.name

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

    def roads(self, models: Sequence[OpenDrive]) -> Network:
        """See `Simulator`: each entity's route, planned and sampled."""
        return compile_network(self.program, models)

    def run(self, roads: Network, rows: Int, values: Mapping[str, npt.ArrayLike]) -> Rollout:
        """See `Simulator`; runs without the GIL."""
        from bridgegen.simulation.embedded._rollout_kernels import simulate_rows

        program, n = self.program, len(rows)
        if n and not (rows.min() >= 0 and rows.max() < roads.n_networks):
            raise InputError(f"rows must name one of {roads.n_networks} road networks")
        slots = program.fill(values, n)
        a, b = roads.station[rows, :, 0], roads.station[rows, :, 1]
        at = slots[:, np.maximum(program.start_slots, 0)]  # b is 0 where there is no slot
        station = np.ascontiguousarray(a + b * at)
        varied = slots[:, np.maximum(program.aside_slots, 0)]
        aside = np.where(program.aside_slots >= 0, roads.sides[rows] * varied, 0.0)
        shape = (n, len(program.names), program.n_steps)
        x, y, h, v, acceleration, offset = (np.empty(shape) for _ in range(6))
        lights = np.empty((n, len(program.lights), program.n_steps), dtype=np.int8)
        began = np.full((n, len(program.events)), -1, dtype=np.int64)
        n_steps, status = np.empty(n, dtype=np.int64), np.empty(n, dtype=np.int8)
        simulate_rows(
            rows, roads.paths, roads.counts, roads.steps, roads.zones, station, aside,
            roads.points, program.timed, roads.tracks, slots, program.bodies, program.init,
            program.triggers, program.groups, program.conditions, program.acts, program.events,
            program.actions, program.first_states, program.friction_slot, program.driver.code,
            program.time_step,
            x, y, h, v, acceleration, offset, lights, began, n_steps, status,
        )  # fmt: skip
        return Rollout(
            time_step=program.time_step,
            names=program.names,
            box=program.box,
            x=x, y=y, h=h, v=v, a=acceleration, offset=offset,
            light_names=program.lights,
            lights=lights,
            event_names=program.event_names,
            began=began,
            n_steps=n_steps,
            status=status,
        )  # fmt: skip
