"""What a simulator beside the embedded one says of a storyboard just as that one does."""

from collections.abc import Mapping

from bridgegen.simulation.embedded.simulator import EmbeddedSimulator


class AroundEmbedded:
    """The part of `Simulator` that the embedded one answers for any other.

    Args:
        embedded: the embedded one of the same storyboard and driver.

    Attributes:
        embedded: see `Simulator`.
    """

    def __init__(self, embedded: EmbeddedSimulator) -> None:
        self.embedded = embedded

    @property
    def driver(self) -> str:
        """See `Simulator`."""
        return self.embedded.driver

    @property
    def time_step(self) -> float:
        """See `Simulator`."""
        return self.embedded.time_step

    @property
    def duration(self) -> float:
        """See `Simulator`."""
        return self.embedded.duration

    @property
    def fixed(self) -> Mapping[str, str]:
        """See `Simulator`."""
        return self.embedded.fixed

    @property
    def parameters(self) -> Mapping[str, float]:
        """See `Simulator`."""
        return self.embedded.parameters
