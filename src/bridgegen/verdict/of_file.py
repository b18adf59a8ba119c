"""Is what one scenario file came to good enough? Criteria held against its metrics."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from bridgegen.conflict.quantities import QUANTITIES
from bridgegen.simulate import FileResult
from bridgegen.verdict.criteria import Criterion, Outcome, read_criteria
from bridgegen.verdict.junit import Suite, case_of, refuse_junit, write_junit


@dataclass(frozen=True)
class FileGate:
    """What a scenario file must keep, read and checked before it is simulated.

    Attributes:
        criteria: each fails the file if it holds.
        junit: where the JUnit XML goes, if it is wanted.
    """

    criteria: tuple[Criterion, ...]
    junit: Path | None

    @classmethod
    def read(cls, texts: Sequence[str], junit: Path | None) -> "FileGate":
        """Read the criteria.

        Args:
            texts: as `read_criteria` has them, of metrics.
            junit: a new file, or an earlier JUnit XML.

        Raises:
            InputError: no criterion, or an unknown metric.
            StorageError: no JUnit XML can be written there.
        """
        gate = cls(read_criteria(texts, QUANTITIES), junit)
        if junit is not None:
            refuse_junit(junit)
        return gate

    @property
    def metrics(self) -> tuple[str, ...]:
        """Those that must be measured."""
        return tuple(dict.fromkeys(name for one in self.criteria for name in one.figures))

    def judge(self, file: Path, result: FileResult) -> tuple[Outcome, ...]:
        """Hold the criteria against a result, and write the JUnit XML if it is wanted.

        Nothing is judged where nothing is asked for. Otherwise the first outcome is the
        simulation's own: one that failed proves nothing.
        """
        if not self.criteria and self.junit is None:
            return ()
        ran = Outcome(
            "the simulation succeeds",
            "passed" if result.status == "ok" else "unknown",
            f"{result.status}, {result.seconds:g} s simulated",
        )
        outcomes = (ran, *(one.judge(result.metrics) for one in self.criteria))
        if self.junit is not None:
            units = {name: QUANTITIES[name].unit for name in result.metrics}
            metrics = {
                name: f"{value:.6g}" + ("" if units[name] in ("1", "count") else f" {units[name]}")
                for name, value in result.metrics.items()
            }
            parameters = {name: f"{value:.6g}" for name, value in result.parameters.items()}
            facts = {"file": str(file), "ego": result.driver, **metrics, **parameters}
            group = f"bridgegen.{file.stem}.{result.driver.replace('.', '_')}"
            cases = [case_of(group, one) for one in outcomes]
            write_junit(self.junit, [Suite(file.name, cases, facts)])
        return outcomes
