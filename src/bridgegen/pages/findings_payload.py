"""Conflicts of the rows, and the failure modes of the run, as data of the page."""

from collections import Counter
from typing import Any

from bridgegen.assess.conflict.findings import Findings
from bridgegen.base.arrays import Bool
from bridgegen.pages.playback import Conflict
from bridgegen.search.triage.influence import ends_in_words
from bridgegen.search.triage.judgement import judgement
from bridgegen.search.triage.record import Minimal, Mode, Neighbourhood, Treatment, Triage
from bridgegen.search.triage.words import (
    covered_in_words,
    repeats_in_words,
    step_in_words,
    steps_in_words,
)

FINDING_FIELDS = ("conflict", "conflict_type", "responsible", "rule", "partner")
"""The fields of a row's finding, in the page's order."""

MOST_REASONS = 5
"""Maximum number of reasons of implausible rows that the page names."""

MOST_MODES = 12
"""Maximum number of failure modes that the page shows."""


def findings_payload(findings: Findings, shown: Bool) -> dict[str, Any]:
    """Return the findings of the rows that the page holds.

    ``keys`` are the different findings, five texts each, see ``FINDING_FIELDS``; ``at`` is the
    number of each row's.
    """
    columns = findings.columns()
    texts = list(zip(*(columns[name][shown].tolist() for name in FINDING_FIELDS), strict=True))
    keys = {key: number for number, key in enumerate(dict.fromkeys(texts))}
    return {"keys": [list(key) for key in keys], "at": [keys[key] for key in texts]}


def implausible_payload(findings: Findings | None) -> dict[str, Any]:
    """Return the number of implausible rows, and the reasons, the most frequent first."""
    if findings is None:
        return {"count": 0, "reasons": []}
    reasons = Counter(item for item in findings.implausible.tolist() if item)
    return {
        "count": sum(reasons.values()),
        "reasons": [[text, n] for text, n in reasons.most_common(MOST_REASONS)],
    }


def conflict_payload(conflict: Conflict, cause: str = "") -> dict[str, Any]:
    """Return a scenario's conflict; numbers are rounded to what a page can show.

    Args:
        conflict: the conflict.
        cause: the quick label of its cause, with which its sentence is reconciled.
    """
    said = conflict.summary
    if said.happened:
        said = said.reconciled(
            judgement(cause, None, preventable=said.preventable, responsible=said.responsible)
        )
    facts = said.to_dict()
    numbers = {name: value for name, value in facts.items() if isinstance(value, dict)}
    return {
        **{name: value for name, value in facts.items() if name not in numbers},
        "bare": conflict.summary.bare,
        "numbers": {
            name: [None if v["value"] is None else float(f"{v['value']:.4g}"), v["unit"]]
            for name, v in numbers.items()
        },
        "partner_number": conflict.partner,
        **({"vehicle_number": conflict.vehicle} if conflict.vehicle else {}),
        "instant": conflict.instant,
        "decided": conflict.decided,
        "zones": list(conflict.zones),
    }


def triage_payload(found: Triage) -> dict[str, Any]:
    """Return the failure modes, or without any the bound and the nearest scenarios."""
    return {
        "ego": found.ego,
        "baseline": found.baseline,
        "modes": [
            _mode(mode, found.neighbourhood(mode.shown))
            | {"step": step_in_words(mode, found) or repeats_in_words(mode, found)}
            for mode in found.modes[:MOST_MODES]
        ],
        "more": max(0, len(found.modes) - MOST_MODES) + found.unrecorded_modes,
        "robust": found.robust,
        "neighbours": found.neighbours,
        "radius": found.radius,
        "untested": found.untested,
        "influences": [
            {
                "name": influence.name,
                "distance": round(influence.distance, 3),
                "end": "".join(
                    f"{end}: widen the range?" for end in ends_in_words([influence])[:1]
                ),
            }
            for influence in found.influences
        ],
        "steps": steps_in_words(found),
        "missed": found.missed,
        "extrapolated": found.extrapolated,
        "covered": covered_in_words(found),
        **({"rate": found.rate.sentence} if found.rate else {}),
        "judged": _judged(found),
        "bound": {
            "sentence": found.bound.in_full,
            "judged": found.bound.judged,
            "failures": found.bound.failures,
            "evaluations": found.bound.evaluations,
            "failed": found.bound.failed,
            "implausible": found.bound.implausible,
            "least": [least.model_dump() for least in found.bound.least],
        },
    }


def _judged(found: Triage) -> dict[int, str]:
    """Return what is said of evaluations: their root cause, and if they hang on the time step."""
    said = {item.evaluation: [item.judgement] for item in found.neighbourhoods if item.judgement}
    for check in found.step_checks:
        if check.sentence:
            said.setdefault(check.evaluation, []).append(check.sentence)
    for item in found.repeated:
        played = "" if item.agrees else "; what is played is one more, which may not fail"
        said.setdefault(item.evaluation, []).append(f"{item.sentence}{played}")
    return {evaluation: "; ".join(texts) for evaluation, texts in said.items()}


def _mode(mode: Mode, tested: Neighbourhood | None) -> dict[str, Any]:
    facts = mode.model_dump(
        include={
            "number", "title", "conflict", "conflict_type", "responsible", "rule", "partner",
            "place", "cause", "judgement", "tested", "count", "harm", "severity", "shown", "worst",
            "robustness", "space", *(["probability"] if mode.probability else []),
        }
    )  # fmt: skip
    return facts | {
        "knife_edge": mode.knife_edge,
        "exports": list(mode.exports[:5]),
        "rules": [rule for rule, _ in mode.rules] or [mode.rule],
        "rows": tested.rows if tested else 0,
        "harmful": tested.harmful if tested else 0,
        "fix": _fix(tested.fix) if tested else None,
        "placebo": _fix(tested.placebo) if tested else None,
        "minimal": _minimal(mode.minimal),
    }


def _fix(treatment: Treatment | None) -> dict[str, Any] | None:
    return (
        None
        if treatment is None
        else treatment.model_dump(include={"name", "drop", "low", "high", "rows"})
    )


def _minimal(minimal: Minimal | None) -> dict[str, Any] | None:
    if minimal is None:
        return None
    return minimal.model_dump(
        include={"name", "sentence", "rows", "harmful", "robustness", "harm", "severity"}
    ) | {"knife_edge": minimal.knife_edge}
