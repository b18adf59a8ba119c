"""The share of critical scenarios, with its confidence interval."""

from dataclasses import dataclass
from functools import cached_property

from bridgegen.base.statistics import clopper_pearson


@dataclass(frozen=True)
class Evidence:
    """The results of a set of scenarios.

    Attributes:
        rows: scenarios whose simulation succeeded.
        critical: critical ones among them.
        failed: scenarios whose simulation failed, not part of ``rows``.
    """

    rows: int
    critical: int
    failed: int = 0

    @property
    def share(self) -> float | None:
        """Critical / successful scenarios; None if none succeeded."""
        return self.critical / self.rows if self.rows else None

    @cached_property
    def interval(self) -> tuple[float, float]:
        """The Clopper-Pearson 95 % confidence interval of the share.

        It is valid for independent random scenarios. A search chooses its scenarios, so its
        interval reflects the number of rows only.
        """
        return clopper_pearson(self.critical, self.rows)
