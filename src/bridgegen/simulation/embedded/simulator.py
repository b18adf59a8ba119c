"""The embedded simulator: N rows of parameters against one compiled storyboard."""

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from bridgegen.arrays import Int
from bridgegen.errors import InputError
from bridgegen.simulation.embedded.network import Network
from bridgegen.simulation.embedded.program import Program
from bridgegen.simulation.rollout import Rollout


def simulate(
    program: Program,
    network: Network,
    values: Mapping[str, npt.ArrayLike],
    rows: Int,
) -> Rollout:
    """Roll N scenarios out; the result of a row depends on that row alone.

    Args:
        program: the storyboard.
        network: P road networks, compiled for this program.
        values: ``(N,)`` float64 per parameter, in the parameter's unit; missing ones keep the
            value that the file declares.
        rows: ``(N,)`` int64 in 0..P-1, the road network of each row.

    Raises:
        InputError: no rows, or a value that is not finite.
    """
    from bridgegen.simulation.embedded._rollout_kernels import simulate_rows

    n, e, t = len(rows), len(program.names), program.n_steps
    if n and not (rows.min() >= 0 and rows.max() < network.n_networks):
        raise InputError(f"rows must name one of {network.n_networks} road networks")
    slots = program.fill(values, n)
    a, b = network.station[rows, :, 0], network.station[rows, :, 1]
    station = np.ascontiguousarray(a + b * slots[:, program.start_slots])
    x, y, h, v, acceleration, offset = (np.empty((n, e, t)) for _ in range(6))
    n_steps, status = np.empty(n, dtype=np.int64), np.empty(n, dtype=np.int8)
    simulate_rows(
        rows, network.paths, network.counts, network.steps, network.zones,
        station, network.points, slots,
        program.bodies, program.init, program.triggers, program.groups, program.conditions,
        program.acts, program.events, program.friction_slot, program.driver.code,
        program.time_step, x, y, h, v, acceleration, offset, n_steps, status,
    )  # fmt: skip
    return Rollout(
        time_step=program.time_step,
        names=program.names,
        box=program.box,
        x=x, y=y, h=h, v=v, a=acceleration, offset=offset,
        n_steps=n_steps,
        status=status,
    )  # fmt: skip
