"""Pass/fail criteria for the metrics of one scenario file."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Self

from bridgegen.assess.conflict.quantities import QUANTITIES
from bridgegen.cli.verdict.fail_if import (
    FailCondition,
    Outcome,
    outcome_of,
    read_conditions,
    unless_judged,
)
from bridgegen.cli.verdict.junit import Suite, case_of, refuse_junit, write_junit
from bridgegen.engine.simulate import FileResult
from bridgegen.scenario.language.criteria import Criterion, read_criteria


@dataclass(frozen=True)
class FileCriteria:
    """The criteria for a scenario file, checked before the simulation.

    Attributes:
        conditions: each fails the file if it holds.
        junit: path of the JUnit XML, or None.
        criteria: pass criteria that were asked for.
    """

    conditions: tuple[FailCondition, ...]
    junit: Path | None
    criteria: tuple[Criterion, ...] = ()

    @classmethod
    def read(cls, texts: Sequence[str], junit: Path | None, criteria: Sequence[str] = ()) -> Self:
        """Read the criteria.

        Args:
            texts: see `read_conditions`; their figures are metrics.
            junit: a new file, or an earlier JUnit XML.
            criteria: see `bridgegen.scenario.language.criteria.read_criteria`.

        Raises:
            InputError: a text is not a condition, or a metric is unknown.
            StorageError: the JUnit XML cannot be written.
        """
        found = cls(read_conditions(texts, QUANTITIES), junit, read_criteria(criteria))
        if junit is not None:
            refuse_junit(junit)
        return found

    @property
    def metrics(self) -> tuple[str, ...]:
        """The metrics that must be measured."""
        return tuple(
            dict.fromkeys(name for condition in self.conditions for name in condition.figures)
        )

    def judge(self, file: Path, result: FileResult) -> tuple[Outcome, ...]:
        """Apply the criteria to a result, and write the JUnit XML if requested.

        Without conditions, criteria and JUnit XML there are no outcomes. Otherwise the first is
        whether the simulation succeeded; the file's own criteria are among the others. Of these
        none passes where the scenario is not judged.
        """
        if not self.conditions and not self.criteria and self.junit is None:
            return ()
        ran = Outcome(
            "the simulation succeeds",
            "passed" if result.status == "ok" else "unknown",
            f"{result.status}, {result.seconds:g} s simulated",
        )
        stated = (
            *(condition.judge(result.metrics) for condition in self.conditions),
            *(outcome_of(criterion) for criterion in result.criteria),
        )
        outcomes = (ran, *unless_judged(stated, result.unjudged))
        if self.junit is not None:
            units = {name: QUANTITIES[name].unit for name in result.metrics}
            metrics = {
                name: f"{value:.6g}" + ("" if units[name] in ("1", "count") else f" {units[name]}")
                for name, value in result.metrics.items()
            }
            parameters = {name: f"{value:.6g}" for name, value in result.parameters.items()}
            facts = {"file": str(file), "ego": result.driver, **metrics, **parameters}
            group = f"bridgegen.{file.stem}.{result.driver.replace('.', '_')}"
            cases = [case_of(group, outcome) for outcome in outcomes]
            write_junit(self.junit, [Suite(file.name, cases, facts)])
        return outcomes
