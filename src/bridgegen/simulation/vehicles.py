"""How the ego's body moves: the vehicles that ``--vehicle`` names."""

from bridgegen.base.errors import UnknownNameError

KINEMATIC, SINGLE_TRACK, MULTI_BODY = "kinematic", "single-track", "multi-body"

VEHICLES = {
    KINEMATIC: "A bicycle that goes where it steers, within a friction circle.",
    SINGLE_TRACK: "Tyres that slip, load transfer, and actuators that lag: of cars, trucks, buses.",
    MULTI_BODY: "Roll, pitch, heave, axles on springs and four wheels besides: of cars.",
}
"""Descriptions of the vehicle models by name."""


def require(name: str) -> None:
    """Check that there is a vehicle of that name.

    Raises:
        UnknownNameError: there is none.
    """
    if name not in VEHICLES:
        raise UnknownNameError("vehicle", name, VEHICLES)
