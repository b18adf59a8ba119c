"""Findings of the conflict analysis for each row, as texts of a table."""

from collections.abc import Sequence
from dataclasses import dataclass, field, fields
from sys import intern
from typing import Any, Self

import numpy as np
import numpy.typing as npt

from bridgegen.assess.conflict.analysis import CONTACT, COURSE, NEAR_MISS, VIOLATION, Conflicts
from bridgegen.assess.conflict.harm import NEAR_MISS as SERIOUS
from bridgegen.assess.conflict.harm import Count, decisive
from bridgegen.assess.conflict.types import ConflictType, Responsible, Rule
from bridgegen.base.arrays import Bool, Float, Int
from bridgegen.scenario.countries import in_the_mirror

KINDS = {
    COURSE: "collision course",
    NEAR_MISS: "near miss",
    CONTACT: "contact",
    VIOLATION: "violation",
}
"""Labels of the kinds of conflicts by code, see `Conflicts.kind`."""


UNSAFE = "no time to act from the start on"


def why_unjudged(implausible: str, unsafe_start: bool) -> str:
    """Return why a scenario without a failure says nothing of its ego; "" if it does.

    Args:
        implausible: why its traffic could not happen, or "".
        unsafe_start: see `is_unsafe_start`.
    """
    return f"implausible traffic ({implausible})" if implausible else UNSAFE if unsafe_start else ""


def with_whom(conflict: str, partner: str) -> str:
    """Return a conflict and its partner in words; a departure has none."""
    return f"{conflict} with {partner}" if partner else conflict


@dataclass(frozen=True)
class Findings:
    """The decisive conflict of each of N rows; empty texts where there is none.

    Attributes:
        conflict: ``(N,)`` of "contact", "near miss", "violation", "collision course".
        conflict_type: ``(N,)`` of `ConflictType`'s labels.
        responsible: ``(N,)`` of `Responsible`'s labels.
        rule: ``(N,)`` of `Rule`'s labels.
        partner: ``(N,)`` name of the other participant; "" of a departure.
        implausible: ``(N,)`` why the row's traffic could not happen.
        happened: ``(N,)`` of the texts of `bridgegen.assess.conflict.happening.happened`; empty
            ones where it was not recorded.
    """

    conflict: npt.NDArray[np.object_]
    conflict_type: npt.NDArray[np.object_]
    responsible: npt.NDArray[np.object_]
    rule: npt.NDArray[np.object_]
    partner: npt.NDArray[np.object_]
    implausible: npt.NDArray[np.object_]
    happened: npt.NDArray[np.object_] = field(default_factory=lambda: np.zeros(0, dtype=object))

    def __post_init__(self) -> None:
        if not len(self.happened):
            blank = np.full(len(self.conflict), "", dtype=object)
            # The dataclass is frozen; the default depends on the length of another field.
            object.__setattr__(self, "happened", blank)

    def __len__(self) -> int:
        return len(self.conflict)

    @classmethod
    def none(cls, n: int) -> Self:
        """Return empty findings of N rows."""
        return cls(*(np.full(n, "", dtype=object) for _ in fields(cls)))

    @classmethod
    def of(
        cls,
        conflicts: Conflicts,
        implausible: Sequence[str],
        count: Count = "ego",
        happened: npt.NDArray[np.object_] | None = None,
    ) -> Self:
        """Return the findings of a rollout's conflicts.

        Args:
            conflicts: of N rows.
            implausible: ``(N,)`` why the row's traffic could not happen; "" where it could.
            count: whose conflicts decide; see `harm.decisive`.
            happened: ``(N,)`` texts, if it is to be recorded.
        """
        other, _ = decisive(conflicts, count)
        rows = np.arange(len(other))

        def words(codes: Int, labels: Sequence[str]) -> npt.NDArray[np.object_]:
            return np.array(labels, dtype=object)[codes[rows, other]]

        # A collision course that came to nothing has nobody responsible.
        serious = conflicts.kind[rows, other] >= NEAR_MISS
        names = np.array(conflicts.names, dtype=object)
        vehicle, partner = conflicts.parties(rows, other)
        met = (conflicts.kind[rows, other] >= COURSE) & (partner != vehicle)
        return cls(
            words(conflicts.kind, [KINDS.get(kind, "") for kind in range(VIOLATION + 1)]),
            words(conflicts.type, [type_.label for type_ in ConflictType]),
            np.where(
                serious,
                words(conflicts.responsible, [responsible.label for responsible in Responsible]),
                "",
            ),
            words(
                conflicts.rule,
                [in_the_mirror(r.label) if conflicts.left_hand else r.label for r in Rule],
            ),
            np.where(met, names[partner], ""),
            np.array(implausible, dtype=object).reshape(len(other)),
            np.zeros(0, dtype=object) if happened is None else happened,
        )

    @classmethod
    def join(cls, parts: Sequence["Findings"]) -> "Findings":
        """Return the findings of several parts, at least one, in their order."""
        return cls(
            *(np.concatenate([getattr(p, item.name) for p in parts]) for item in fields(cls))
        )

    def take(self, at: Int | Bool | slice) -> Self:
        """Return the findings of some rows."""
        return type(self)(*(getattr(self, item.name)[at] for item in fields(self)))

    def columns(self) -> dict[str, npt.NDArray[np.object_]]:
        """Return the columns by name."""
        return {item.name: getattr(self, item.name) for item in fields(self)}

    def row(self, i: int) -> dict[str, str | None]:
        """Return one row's texts by name; None instead of empty ones."""
        return {name: texts[i] or None for name, texts in self.columns().items()}


def is_excused(findings: Findings, harm: Float) -> Bool:
    """Return ``(N,)``: rows of plausible traffic whose contact or near miss is no failure.

    Args:
        findings: of N rows.
        harm: ``(N,)``.
    """
    happened = np.isin(findings.conflict, [KINDS[CONTACT], KINDS[NEAR_MISS]])
    found: Bool = happened & np.equal(findings.implausible, "").astype(np.bool_) & (harm < SERIOUS)
    return found


def is_unsafe_start(findings: Findings, harm: Float) -> Bool:
    """Return ``(N,)``: such rows that left the ego no time to act from the start on."""
    by_rule: Bool = np.equal(findings.rule, Rule.UNSAFE_START.label).astype(np.bool_)
    return is_excused(findings, harm) & by_rule


COLUMNS = tuple(item.name for item in fields(Findings))
"""The names of a table's columns of findings."""


def unpacked(rows: Sequence[Sequence[Any]]) -> Findings:
    """Return findings from rows of texts or None, in the order of ``COLUMNS``.

    Raises:
        TypeError: a value is something else.
    """
    columns = list(zip(*rows, strict=True))
    for name, column in zip(COLUMNS, columns, strict=False):
        if odd := {*map(type, column)} - {str, type(None)}:
            raise TypeError(f"{name} must be a text, got a {odd.pop().__name__}")
    # Interns the texts: there are few different ones, and SQL creates an object for each.
    texts = [[intern(item) if item else "" for item in column] for column in columns]
    if not texts:
        return Findings.none(0)
    return Findings(*(np.array(column, dtype=object) for column in texts))
