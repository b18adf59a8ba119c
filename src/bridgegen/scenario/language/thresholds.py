"""When a scenario is critical by the rule "thresholds"."""

from dataclasses import asdict, dataclass
from math import isfinite

from bridgegen.base.errors import InputError


@dataclass(frozen=True)
class Thresholds:
    """The paper: a scenario is critical if it has a collision, or comes close to one in motion.

    Attributes:
        n_collision_above: [count]; critical if n_collision > this.
        d_min_below: [m]; critical if d_min < this while v_d ≥ ``v_d_at_least``.
        v_d_at_least: [m/s].

    Raises:
        InputError: one of them is not finite.

    Source: paper, Table III, "Thresholds for Scenario Classifications".
    """

    n_collision_above: float = 0.0
    d_min_below: float = 2.0
    v_d_at_least: float = 1.0

    def __post_init__(self) -> None:
        problems = [
            f"the threshold {name} must be finite, got {value}"
            for name, value in asdict(self).items()
            if not isfinite(value)
        ]
        if problems:
            raise InputError(*problems)
