"""The table of what each driver of the embedded simulator demands."""

from bridgegen.drivers.drivers import DRIVERS, GUESTS
from bridgegen.simulation.embedded.drivers import DEMANDS


def test_every_driver_that_ships_has_a_kernel_and_no_other() -> None:
    assert set(DEMANDS) == set(DRIVERS)
    assert not set(DEMANDS) & set(GUESTS)
