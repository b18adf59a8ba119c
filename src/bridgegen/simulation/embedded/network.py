"""The roads of a compiled storyboard: every path on P road networks."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from bridgegen.arrays import Float, Int
from bridgegen.openx.opendrive.model import OpenDrive
from bridgegen.simulation.embedded.program import BesideLanes, Program
from bridgegen.simulation.embedded.ways import Ways, padded, position


@dataclass(frozen=True)
class Network:
    """P road networks as the rollout reads them.

    Attributes:
        paths: ``(P, K, L, 6)`` float64: x, y [m], heading [rad], its cosine and sine, curvature
            [1/m]; rows from ``counts`` on are padding.
        counts: ``(P, K)`` int64, samples of each path.
        steps: ``(P, K)`` float64 [m], between two samples.
        zones: ``(P, K, 5)`` float64: where the route of the ego meets each other path; see
            ``bridgegen.ego._reference_kernels``.
        station: ``(P, E, 2)`` float64: an entity that starts at s on its road starts a + b·s along
            its path.
        sides: ``(P, E)`` float64: 1 for an entity that starts along its road's direction, -1
            against it; what is to its left, then, of what is to the road's.
        points: ``(P, Q, 2)`` float64 [m], the positions that conditions name.
        tracks: ``(P, M, T, 6)`` float64, the states of the M entities with a timetable at every
            instant: x, y [m], heading [rad], speed [m/s], acceleration [m/s²], metres travelled.
    """

    paths: Float
    counts: Int
    steps: Float
    zones: Float
    station: Float
    sides: Float
    points: Float
    tracks: Float

    @property
    def n_networks(self) -> int:
        """P."""
        return len(self.paths)


def compile_network(program: Program, models: Sequence[OpenDrive]) -> Network:
    """Plan and sample every path on every road network.

    Args:
        program: the storyboard.
        models: P road networks.

    Raises:
        InputError: a position that is not on a road, or a route that no lane leads along.
    """
    from bridgegen.ego._reference_kernels import find_zone  # numba is slow to import

    shape = (len(models), len(program.paths))
    n_entities = len(program.names)
    ways = [Ways(program, model) for model in models]
    points = np.zeros((len(models), len(program.points), 2))
    for p, model in enumerate(models):
        for i, point in enumerate(program.points):
            points[p, i] = position(program, model, point)
    tables = [table for each in ways for table in each.tables]
    counts = np.array([len(table) for table in tables], dtype=np.int64).reshape(shape)
    steps = np.array([each.steps for each in ways]).reshape(shape)
    station = np.array([each.station[:n_entities] for each in ways])
    sides = np.array([each.sides[:n_entities] for each in ways], dtype=np.float64)
    paths = padded(tables, shape)
    bodies = _bodies(program)
    zones = np.full((*shape, 5), np.inf)
    for p, k in product(range(shape[0]), range(1, shape[1])):
        find_zone(
            paths[p, 0], counts[p, 0], steps[p, 0], program.bodies[0],
            paths[p, k], counts[p, k], steps[p, k], bodies[k], zones[p, k],
        )  # fmt: skip
    tracks = np.array([each.tracks for each in ways])
    if not tracks.size:
        tracks = np.zeros((len(models), 0, program.n_steps, 6))
    return Network(paths, counts, steps, zones, station, sides, points, tracks)


def _bodies(program: Program) -> list[Float]:
    """Return the body that each path is for."""
    owners = list(range(len(program.names)))
    for spec in program.paths[len(owners) :]:
        assert isinstance(spec, BesideLanes)  # entities' own paths come first
        owners.append(owners[spec.of])
    return [program.bodies[owner] for owner in owners]
