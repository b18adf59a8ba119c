"""A safety case as one self-contained page without scripts: its drawing, and all of it as text."""

import hashlib

from bridgegen.jobs.safety_case.drawing import drawing, layout
from bridgegen.jobs.safety_case.model import FILE, Element, SafetyCase
from bridgegen.pages import templates

PAGE = "safety-case.html"

SITE = "docs/"
"""Folder of the documentation's pages in the repository."""

_STATES = {
    "supported": "ok",
    "not supported": "bad",
    "incomplete": "open",
    "undeveloped": "open",
}
_BANNERS = {"supported": "passes", "not supported": "fails"}
_MEANING = {
    "supported": "the evidence supports it",
    "not supported": "evidence speaks against it, or its condition does not hold",
    "incomplete": "nothing here speaks against it, and a goal below it is undeveloped",
    "undeveloped": "nothing here supports it; evidence must come from elsewhere",
}
_RELATIONS = {
    "SupportedBy": "supported by",
    "InContextOf": "in context of",
    "Challenges": "challenges",
}


def page(case: SafetyCase, data: bytes) -> bytes:
    """Return the page of a case.

    Args:
        case: it.
        data: its JSON file, whose digest the page states.
    """
    top = case.elements[0]
    drawn = [("", case.title, _drawn(case, top, case.title))]
    if len(case.runs) > 1:
        drawn = [("", "all runs", _drawn(case, top, "all runs", deep=False))]
        for run, goal in zip(case.runs, case.run_goals(), strict=True):
            label = f"{run.ego} in {run.scenario}"
            drawn.append((f"{run.id}: {label}", label, _drawn(case, goal, label)))
    return templates.page(
        "jobs/safety_case/page.html",
        title=f"Safety case: {case.title}",
        case=case,
        verdict=_banner(case, top),
        drawn=drawn,
        elements=[(element, _relations(case, element)) for element in case.elements],
        files={evidence.id: evidence for evidence in case.evidence},
        states=_STATES,
        meaning=_MEANING,
        site=SITE,
        file=FILE,
        digest=hashlib.sha256(data).hexdigest(),
    )


def _banner(case: SafetyCase, top: Element) -> templates.Banner:
    """Return what the case claims; where that does not hold, what speaks against it."""
    text = f"{top.id}: {top.statement.text}"
    refuted = [one for one in case.elements if one.status == "not supported"]
    ids = [one.id for one in refuted]
    # A goal's id begins with that of the goal above it: the lowest ones say why.
    first = [one for one in refuted if not any(id.startswith(f"{one.id}.") for id in ids)]
    if first:
        more = f", and {len(first) - 1} more" if len(first) > 1 else ""
        text = f"What does not hold is {first[0].id}: {first[0].statement.text.rstrip('.')}{more}."
    kind = _BANNERS.get(top.status, "open")
    return templates.Banner(text, kind, top.status.upper(), "python recompute.py")


def _drawn(case: SafetyCase, goal: Element, label: str, *, deep: bool = True) -> str:
    return drawing(layout(case, goal.id, deep=deep), f"Argument: {label}")


def _relations(case: SafetyCase, element: Element) -> list[tuple[str, list[str]]]:
    """Return what an element is related to: how, and the ids of the others."""
    found = (
        (
            words,
            [
                each.target
                for each in case.relations
                if (each.source, each.kind) == (element.id, kind)
            ],
        )
        for kind, words in _RELATIONS.items()
    )
    return [(words, names) for words, names in found if names]
