"""What every simulator does: take a storyboard and roads once, then rows by the thousand."""

from collections.abc import Mapping, Sequence
from typing import Protocol, TypeVar

import numpy.typing as npt

from bridgegen.base.arrays import Float, Int
from bridgegen.drivers import Driver
from bridgegen.openx.opendrive.model import OpenDrive
from bridgegen.simulation.rollout import Rollout

Roads = TypeVar("Roads")


class Simulator(Protocol[Roads]):
    """A simulator that holds one storyboard; its rollouts depend on nothing else.

    What the storyboard says (its driver, parameters, duration and time step) is known from the
    embedded simulator, which compiles each storyboard whoever runs it.
    """

    @property
    def rows_at_once(self) -> int:
        """How many rows a call of ``run`` had best be given."""

    @property
    def runs_at_once(self) -> int:
        """How many calls of ``run`` had best go on at a time, each in a thread."""

    def roads(
        self, models: Sequence[OpenDrive], courses: Sequence[Mapping[str, Float]] = ()
    ) -> Roads:
        """Make P road networks ready for this storyboard.

        Args:
            models: the road networks.
            courses: timed trajectories on each of them, ``(V, 4)`` time [s], x, y [m], heading
                [rad] by the name of an entity, in place of those in the file; none by default.

        Raises:
            InputError: a position that is not on a road, or a route that no lane leads along.
        """

    def run(
        self,
        roads: Roads,
        rows: Int,
        values: Mapping[str, npt.ArrayLike],
        *,
        driver: Driver | None = None,
        dry: bool = False,
    ) -> Rollout:
        """Roll N scenarios out; the result of a row depends on that row alone.

        Args:
            roads: P road networks, made ready by this simulator.
            rows: ``(N,)`` int64 in 0..P-1, the road network of each row.
            values: ``(N,)`` float64 per parameter, in the parameter's unit; missing ones keep
                the value that the file declares, others than the file's are not looked at.
            driver: who drives an ego that has a driver, instead of its own.
            dry: whether the road has the friction of a dry one, whatever the file says.

        Raises:
            InputError: a road network that is not there, or a value that is not finite.
        """

    def stop(self) -> None:
        """Let what is being rolled out in other threads end soon; it is of no use afterwards."""
