"""The result in words: a summary to copy, and the small table beside it."""

import math

import numpy as np

from bridgegen.assess.cause import CAUSES, Cause
from bridgegen.assess.conflict.analysis import VIOLATION
from bridgegen.assess.conflict.findings import KINDS, Findings
from bridgegen.assess.criteria import headline
from bridgegen.base.arrays import Bool
from bridgegen.base.statistics import wilson
from bridgegen.pages.data import ReportData, RunSummary
from bridgegen.pages.templates import counted
from bridgegen.results.confirmation.words import sentences as verdicts

NARROW = "\N{NARROW NO-BREAK SPACE}"

MOST_TITLES = 3
"""Maximum number of failure modes that the text names."""

AVOIDED = {
    Cause.PERCEPTION: "would not happen with ideal perception",
    Cause.PLANNING: "would not happen to a careful and competent driver",
    Cause.VEHICLE_DYNAMICS: "would not happen to a kinematic vehicle",
    Cause.CONTROL: "would not happen with ideal control or on a dry road",
    Cause.UNAVOIDABLE: "would happen all the same",
}


def sentences(data: ReportData) -> list[str]:
    """Return a few sentences: the search, its findings, their severity and confirmation.

    Where there are pass criteria, how they are met comes first.
    """
    s = data.summary
    if s.n_evaluations == 0:
        return [f"No scenario of “{s.title}” has been simulated yet."]
    judged = headline(s.ego, data.criteria)
    return [*([f"{judged}."] if judged else []), *_sentences(data)]


def _sentences(data: ReportData) -> list[str]:
    s = data.summary
    also = f", and with {s.baseline} to compare," if s.baseline else ""
    words = [
        f"{counted(s.n_evaluations, 'concrete scenario')} of “{s.title}” "
        f"{'was' if s.n_evaluations == 1 else 'were'} simulated with the driver {s.ego}{also} "
        f"on {s.road}, chosen by {s.algorithm} in {duration(s.wall_seconds)}."
    ]
    if not s.finished:
        words[0] = words[0][:-1] + f", so far, of a budget of {s.budget:,}."
    words += _implausible(data)
    if s.n_critical == 0:
        none = "It is not" if s.n_evaluations == 1 else "None of them is"
        words.append(f"{none} critical (critical means {s.critical_rule}).")
        return [*words, *(_not_exported(data) or _bound(data))]
    found = f"{s.n_critical:,} of them ({share(s.r_critic)}) "
    found += f"{'is' if s.n_critical == 1 else 'are'} critical ({s.critical_rule})"
    if s.first_critical is not None:
        found += f"; the first was found at evaluation {s.first_critical:,}"
        if s.fiftieth_critical is not None:
            found += f", the 50th at {s.fiftieth_critical:,}"
    words.append(found + ".")
    confirmed = [
        verdicts(confirmation.label, confirmation.scenarios)[0]
        for confirmation in data.confirmations
    ]
    worst = _worst_harm(data) if s.harm else _worst(data)
    findings = filter(None, (_modes(data), _causes(data), worst))
    return [*words, *findings, *_not_exported(data), *confirmed]


def _bound(data: ReportData) -> list[str]:
    return [data.triage.bound.in_full] if data.triage else []


def _not_exported(data: ReportData) -> list[str]:
    """Return that nothing is exported and why, where no failure was found."""
    if not data.summary.finished or data.kept or data.triage is None or data.triage.modes:
        return []
    if data.triage.bound.space.harmful:
        return [*_bound(data), "These draws are exported: critical/fresh-01.xosc and so on."]
    return [*_bound(data), "No scenario is exported: only failures are."]


def summary_table(data: ReportData) -> list[tuple[str, str]]:
    """Return the rows of the small table: quantity, and value with unit.

    The paper's distances and speeds where its thresholds make a scenario critical; else collisions,
    near misses and severity.
    """
    s = data.summary
    return [
        ("Simulated", _simulated(s)),
        ("Critical", f"{s.n_critical:,} ({share(s.r_critic)})"),
        *([("95 % interval of the critical share", _interval(s))] if s.independent else []),
        ("First critical", _at(s.first_critical)),
        ("50th critical", _at(s.fiftieth_critical)),
        *(_of_harm(data) if s.harm and data.evaluations.findings else _of_paper(s)),
    ]


def _of_paper(s: RunSummary) -> list[tuple[str, str]]:
    return [
        ("Minimum distance d_min, least", metres(s.d_min_best)),
        ("Minimum distance d_min, median", metres(s.d_min_median)),
        ("Speed v_d at d_min, highest", speed(s.v_d_best)),
        ("Speed v_d at d_min, median", speed(s.v_d_median)),
    ]


def _of_harm(data: ReportData) -> list[tuple[str, str]]:
    e = data.evaluations
    assert e.findings is not None
    critical = e.critical & (e.status == 0)
    contact = critical & (e.findings.conflict == "contact")
    near = critical & (e.findings.conflict == "near miss")
    rows = [
        ("Critical: collisions", f"{np.count_nonzero(contact):,}"),
        ("Critical: near misses", f"{np.count_nonzero(near):,}"),
        ("Critical: violations", f"{np.count_nonzero(critical & _violates(e.findings)):,}"),
    ]
    for column in e.metrics:
        if column.name == "severity":
            worst = float(column.whole[contact].max()) if contact.any() else float("nan")
            rows.append(("Severity (MAIS3+), highest", share(worst)))
        if column.name == data.summary.harm:
            values = column.whole[(e.status == 0) & np.isfinite(column.whole)]
            rows.append(("Harm, highest", f"{values.max():.3f}" if values.size else "–"))
    return rows


def provenance(s: RunSummary) -> list[tuple[str, str]]:
    """Return the data to repeat the run, name and text."""
    rows = [
        ("Scenario", s.scenario),
        ("Road", s.road),
        ("Ego", s.ego),
        ("Baseline", s.baseline),
        ("Algorithm", s.algorithm),
        ("Seed", str(s.seed)),
        ("Budget", counted(s.budget, "evaluation")),
        ("Done", counted(s.n_evaluations, "evaluation") + ("" if s.finished else ", interrupted")),
        ("Started", s.started),
        ("BridgeGen", s.version),
    ]
    return [row for row in rows if row[1]] + [
        *(s.settings or {}).items(),
        *(s.hashes or {}).items(),
    ]


def share(value: float) -> str:
    """Return a share of 1 in per cent."""
    return f"{100.0 * value:.1f}{NARROW}%" if math.isfinite(value) else "–"


def metres(value: float) -> str:
    """Return a distance [m]."""
    return f"{value:.2f}{NARROW}m" if math.isfinite(value) else "–"


def speed(value: float) -> str:
    """Return a speed [m/s], with km/h beside it."""
    if not math.isfinite(value):
        return "–"
    return f"{value:.1f}{NARROW}m/s ({3.6 * value:.0f}{NARROW}km/h)"


def duration(seconds: float) -> str:
    """Return a time span in a suitable unit."""
    if not math.isfinite(seconds):
        return "–"
    if seconds < 120.0:
        return f"{seconds:.1f}{NARROW}s"
    minutes, rest = divmod(round(seconds), 60)
    if minutes < 120:
        return f"{minutes}{NARROW}min {rest}{NARROW}s"
    hours, minutes = divmod(minutes, 60)
    return f"{hours:,}{NARROW}h {minutes}{NARROW}min"


def _causes(data: ReportData) -> str:
    """Return the causes by one re-simulation of each critical scenario."""
    causes = data.evaluations.cause
    if causes is None:
        return ""
    counts = [
        f"{n:,} {AVOIDED[cause]} ({cause.label})"
        for cause in CAUSES
        if (n := int(np.count_nonzero(causes == cause)))
    ]
    return f"Quick labels, of one replay each with one stage idealised: {', '.join(counts)}."


def _modes(data: ReportData) -> str:
    """Return the failure modes in one sentence; nothing before the run has finished."""
    if data.triage is None or not data.triage.modes:
        return ""
    n = len(data.triage.modes) + data.triage.unrecorded_modes
    titles = [f"{mode.title} ({mode.count:,})" for mode in data.triage.modes[:MOST_TITLES]]
    more = ", …" if n > MOST_TITLES else ""
    other = f" and {data.summary.baseline} does not" if data.summary.baseline else ""
    return f"{_ways(n)} in which {data.summary.ego} fails{other}: {'; '.join(titles)}{more}."


def _ways(n: int) -> str:
    return "One way" if n == 1 else f"{n:,} ways"


def _implausible(data: ReportData) -> list[str]:
    """Return how many rows are implausible and not counted."""
    findings = data.evaluations.findings
    n = int(np.count_nonzero(findings.implausible != "")) if findings else 0
    if not n:
        return []
    part = share(n / data.summary.n_evaluations)
    return [
        f"{counted(n, 'scenario')} ({part}) {'has' if n == 1 else 'have'} traffic that could not "
        f"happen and {'is' if n == 1 else 'are'} not counted."
    ]


def _worst_harm(data: ReportData) -> str:
    """Return how many critical scenarios are collisions, how severe, and how many near misses."""
    e = data.evaluations
    if e.findings is None:
        return _worst(data)
    critical = e.critical & (e.status == 0)
    contact = critical & (e.findings.conflict == "contact")
    n_contact = int(np.count_nonzero(contact))
    n_near = int(np.count_nonzero(critical & (e.findings.conflict == "near miss")))
    others = counted(n_near, "near miss")
    if n_violations := int(np.count_nonzero(critical & _violates(e.findings))):
        others += f", {counted(n_violations, 'violation')}"
    if not n_contact and n_near < np.count_nonzero(critical):  # violations, or other criteria
        return f"{others} among them; no collision."
    if not n_contact:
        return f"{'It is a near miss' if n_near == 1 else 'All are near misses'}; no collision."
    text = f"{counted(n_contact, 'collision')}"
    severity = next((metric.whole for metric in e.metrics if metric.name == "severity"), None)
    if severity is not None:
        worst = float(severity[contact].max())
        text += f", the most severe with a probability of {share(worst)} of a MAIS3+ injury"
    return f"{text}; {others}."


def _violates(findings: Findings) -> Bool:
    """Return ``(N,)``: where the decisive conflict is a violation."""
    return np.array(findings.conflict == KINDS[VIOLATION], dtype=np.bool_)


def _worst(data: ReportData) -> str:
    e = data.evaluations
    columns = {
        metric.name: metric.whole for metric in e.metrics if metric.name in ("n_collision", "v_d")
    }
    ok = e.status == 0
    hits = columns.get("n_collision")
    n_hits = 0 if hits is None else int(np.count_nonzero(hits[ok] > 0))
    v_d = columns.get("v_d")
    if n_hits:
        text = f"{counted(n_hits, 'scenario')} {'ends' if n_hits == 1 else 'end'} in a collision"
        if hits is not None and v_d is not None:
            top = v_d[ok & (hits > 0) & np.isfinite(v_d)]
            text += f", the fastest at {speed(float(top.max()))}" if top.size else ""
        return text + "."
    if math.isfinite(data.summary.d_min_best):
        return f"There is no collision; the closest pass leaves {metres(data.summary.d_min_best)}."
    return ""


def _simulated(s: RunSummary) -> str:
    text = f"{s.n_evaluations:,} in {duration(s.wall_seconds)}"
    return text if s.finished else f"{text}, of a budget of {s.budget:,}"


def _interval(s: RunSummary) -> str:
    """Return Wilson's interval, which holds for independent draws only."""
    if not s.n_evaluations:
        return "–"
    low, high = wilson(s.n_critical, s.n_evaluations)
    digits = 1 if high - low > 0.01 else 2
    return f"{100.0 * low:.{digits}f} to {100.0 * high:.{digits}f}{NARROW}%"


def _at(evaluation: int | None) -> str:
    return "not reached" if evaluation is None else f"evaluation {evaluation:,}"
