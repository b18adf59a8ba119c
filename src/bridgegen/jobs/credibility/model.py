"""A credibility dossier as ``credibility.json``."""

from collections import Counter
from typing import Literal

from pydantic import BaseModel, ConfigDict

from bridgegen.jobs.safety_case.model import Evidence, Number, RunFacts, Statement
from bridgegen.results.validated import Region

FILE = "credibility.json"

Status = Literal["filled", "partly", "stated", "yours", "gap"]
"""Status of an item; "stated": people have filled it; "yours": people have yet to."""


class _Model(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class Item(_Model):
    """A claim that a chapter asks for.

    Attributes:
        id: "6.1".
        title: of it, a few words.
        claim: what is stated, or what is missing.
        details: further sentences.
        how: how it was measured.
        again: the command that measures it anew.
        sources: keys of `Dossier.sources`.
        needs: ids of numbers without which the item is a gap.
        status: of it.
        note: why it is filled in part only.
    """

    id: str
    title: str
    claim: Statement
    details: tuple[Statement, ...] = ()
    how: str = ""
    again: str = ""
    sources: tuple[str, ...] = ()
    needs: tuple[str, ...] = ()
    status: Status
    note: str = ""


class Gap(_Model):
    """What the dossier lacks.

    Attributes:
        place: a run's folder, or the id of an item.
        why: it is missing.
        command: that fills it; "" where none does.
    """

    place: str
    why: str
    command: str = ""


class Flip(_Model):
    """A finding, or an evaluation without failure, that depends on the time step.

    Attributes:
        run: id of the run.
        evaluation: its number, from 1.
        is_finding: whether it is a failure at the scenario's step.
        text: what it is at which step.
    """

    run: str
    evaluation: int
    is_finding: bool
    text: str


class Comparison(_Model):
    """Real tests beside the simulation of the same scenarios; figures are numbers of the dossier.

    Attributes:
        run: its id.
        series: what is compared together.
        quantity: name of the metric.
        unit: of it.
        tests: how many.
        threshold: greatest area that people accept; None if they state none.
        verdict: on the area: its interval is below the threshold, above it, or holds it.
    """

    run: str
    series: str
    quantity: str
    unit: str
    tests: int
    threshold: float | None
    verdict: str


class Dossier(_Model):
    """A credibility dossier.

    Attributes:
        schema_version: 1.
        generator: what wrote it.
        machine: interpreter and processor on which it was written.
        confidence: of each interval.
        unread: how many of the runs could not be read.
        chapters: titles by number.
        sources: texts that ask for the items, by key.
        runs: that it is about.
        commands: that make each run again, by its id.
        numbers: every number in the texts.
        items: in the order of the chapters.
        flips: what depends on the time step.
        comparisons: with real tests.
        validated: the region of each scenario that has evidence.
        gaps: everything that is missing.
        installed: installed distributions with their versions.
        evidence: the files that the numbers are of.
    """

    schema_version: Literal[1] = 1
    generator: str
    machine: str
    confidence: float
    unread: int
    chapters: dict[str, str]
    sources: dict[str, str]
    runs: tuple[RunFacts, ...]
    commands: dict[str, str]
    numbers: tuple[Number, ...]
    items: tuple[Item, ...]
    flips: tuple[Flip, ...]
    comparisons: tuple[Comparison, ...] = ()
    validated: tuple[Region, ...] = ()
    gaps: tuple[Gap, ...]
    installed: dict[str, str]
    evidence: tuple[Evidence, ...]

    @property
    def figures(self) -> dict[str, float]:
        """What ``--fail-if`` judges, see `bridgegen.jobs.credibility.options`."""
        status = Counter(item.status for item in self.items)
        value = {number.id: number.value for number in self.numbers}
        flips = [flip.is_finding for flip in self.flips]
        return {
            **{name: status[name] for name in ("filled", "partly", "stated", "yours", "gap")},
            "gaps": len(self.gaps),
            "runs": len(self.runs),
            "unread": self.unread,
            "findings": float(value.get("all.findings", 0)),
            "flips": sum(flips),
            "sample_flips": len(flips) - sum(flips),
            "refused": float(value.get("all.refused", 0)),
        }
