"""What a job's result is judged by: fail conditions and a JUnit XML, checked before the job."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar, Self

from bridgegen.cli.verdict.fail_if import FailCondition, read_conditions
from bridgegen.cli.verdict.junit import refuse_junit


@dataclass(frozen=True)
class Conditions:
    """The pass/fail criteria of one kind of result; a class of its own judges each.

    Attributes:
        known: the names of the figures that a condition may compare.
        conditions: each fails the result if it holds.
        junit: path of the JUnit XML, or None.
    """

    known: ClassVar[Collection[str]]
    conditions: tuple[FailCondition, ...]
    junit: Path | None

    @classmethod
    def read(
        cls, texts: Sequence[str], junit: Path | None = None, more: Sequence[str] = ()
    ) -> Self:
        """Read the criteria.

        Args:
            texts: see `read_conditions`.
            junit: a new file, or an earlier JUnit XML.
            more: further figures, the margins of pass criteria say.

        Raises:
            InputError: a text is not a condition, or a figure is unknown.
            StorageError: the JUnit XML cannot be written.
        """
        found = cls(read_conditions(texts, (*cls.known, *more)), junit)
        if junit is not None:
            refuse_junit(junit)
        return found
