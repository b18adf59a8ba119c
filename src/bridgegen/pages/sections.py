"""The sections of the report: the data of each, and the module of ``web`` that draws it.

A section is a module that registers itself (``addSection`` in ``web/sections.js``) with its style
beside it, a function here that returns its data, and its line in `SECTIONS`.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

from bridgegen.assess.conflict.happening import Happening, Share
from bridgegen.base.arrays import Bool
from bridgegen.pages.batches_payload import TRENDS, TRENDS_OF_HARM, batches_payload
from bridgegen.pages.causes_payload import causes_payload
from bridgegen.pages.confirmation_payload import confirmations_payload
from bridgegen.pages.coverage_payload import coverage_payload
from bridgegen.pages.criteria_payload import criteria_payload
from bridgegen.pages.data import ReportData
from bridgegen.pages.findings_payload import triage_payload
from bridgegen.pages.notes import notes_payload
from bridgegen.pages.regions_payload import regions_payload


@dataclass(frozen=True)
class Section:
    """A section of the report.

    Attributes:
        module: of ``web``.
        key: of its data in the page's data.
        payload: returns them, as plain data, from the report's data and the rows that the page
            holds, ``(N,)`` bool; None where there is nothing to draw. Without it the section draws
            the rows, which every page holds.
        grows: whether a served page updates it with every batch.
    """

    module: str
    key: str = "rows"
    payload: Callable[[ReportData, Bool], Any] | None = None
    grows: bool = False


def _criteria(data: ReportData, _shown: Bool) -> Any:
    return criteria_payload(data)


def _triage(data: ReportData, _shown: Bool) -> Any:
    return triage_payload(data.triage) if data.triage else None


def _causes(data: ReportData, _shown: Bool) -> Any:
    return causes_payload(data.evaluations)


def _confirmations(data: ReportData, _shown: Bool) -> Any:
    return confirmations_payload(data.confirmations)


def _batches(data: ReportData, _shown: Bool) -> Any:
    return batches_payload(data.evaluations, TRENDS_OF_HARM if data.summary.harm else TRENDS)


def _regions(data: ReportData, shown: Bool) -> Any:
    return regions_payload(data.regions, data.evaluations, shown) if data.regions else None


def _coverage(data: ReportData, _shown: Bool) -> Any:
    return coverage_payload(data.coverage) if data.coverage else None


def _happening(data: ReportData, _shown: Bool) -> Any:
    found = data.happening
    if found is None or not found.rows:
        return None
    groups = [("Events that began", found.events), ("Who came near the ego", found.near)]
    if found.end is not None and found.stuck is not None:
        whole = (replace(found.end, name="the end of its route"),)
        groups.append(("What the ego reached", whole))
        groups.append(("Stuck", (Share("the ego stands for no reason", found.stuck, found.rows),)))
    return {
        "lead": [one for one in (_verdict(found), found.stuck_in_words, found.domain) if one],
        "groups": [
            {"title": title, "shares": [vars(one) for one in shares]}
            for title, shares in groups
            if shares
        ],
    }


def _verdict(found: Happening) -> str:
    if found.happened:
        return ""
    return f"The scenario did not happen: {'; '.join(found.reasons)}."


def _screened(data: ReportData, _shown: Bool) -> Any:
    return data.screened


def _notes(data: ReportData, _shown: Bool) -> Any:
    return notes_payload(data.notes)


SECTIONS = (
    Section("criteria.js", "criteria", _criteria, grows=True),
    Section("modes.js", "triage", _triage),
    Section("causes.js", "causes", _causes, grows=True),
    Section("elsewhere.js", "confirmations", _confirmations, grows=True),
    Section("screened.js", "screened", _screened),
    Section("happening.js", "happening", _happening, grows=True),
    Section("trends.js", "batches", _batches, grows=True),
    Section("regions.js", "regions", _regions, grows=True),
    Section("scatter.js"),
    Section("parallel.js"),
    Section("coverage.js", "coverage", _coverage),
    Section("notes.js", "notes", _notes),
)


def sections_payload(data: ReportData, shown: Bool, *, grown: bool = False) -> dict[str, Any]:
    """Return the sections' data, by key.

    Args:
        data: of the report.
        shown: ``(N,)``, the rows that the page holds.
        grown: only those of the sections that a served page updates.
    """
    return {
        one.key: one.payload(data, shown)
        for one in SECTIONS
        if one.payload is not None and (one.grows or not grown)
    }
