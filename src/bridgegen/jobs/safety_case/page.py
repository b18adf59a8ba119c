"""A safety case as one self-contained page without scripts: its drawing, and all of it as text."""

import hashlib
from collections.abc import Iterator
from html import escape
from urllib.parse import quote

from bridgegen.jobs.safety_case.drawing import drawing, layout
from bridgegen.jobs.safety_case.model import FILE, Element, Evidence, SafetyCase, Statement
from bridgegen.pages.page import still_page

PAGE = "safety-case.html"

SITE = "docs/"
"""Where the documentation's pages are in the repository."""

_WORDS = {
    "CounterGoal": "counter goal",
    "CounterSolution": "counter solution",
}
_STATES = {
    "supported": "ok",
    "not supported": "bad",
    "incomplete": "open",
    "undeveloped": "open",
}
_MEANING = {
    "supported": "the evidence supports it",
    "not supported": "evidence speaks against it, or its condition does not hold",
    "incomplete": "nothing here speaks against it, and a goal below it is undeveloped",
    "undeveloped": "nothing here supports it; evidence must come from elsewhere",
}


def page(case: SafetyCase, data: bytes) -> list[bytes]:
    """Return the page of a case in parts.

    Args:
        case: it.
        data: its JSON file, whose digest the page states.
    """
    body = "\n".join(_body(case, data)).encode("utf-8", "replace")
    return still_page("safety_case.html", f"Safety case: {case.title} – BridgeGen", body)


def _body(case: SafetyCase, data: bytes) -> Iterator[str]:
    top = case.elements[0]
    yield f"<h1>Safety case: {escape(case.title)}</h1>"
    facts = [
        _plural(len(case.runs), "run"), _plural(len(case.elements), "element"),
        _plural(len(case.numbers), "number"), _plural(len(case.evidence), "file"),
    ]  # fmt: skip
    yield f'<ul class="facts">{"".join(f"<li>{one}</li>" for one in facts)}</ul>'
    yield f'<p class="lead"><b>The top goal {escape(top.id)} is {_state(top)}.</b></p>'
    yield from _verdicts(case)
    yield "<h2>Argument</h2>"
    yield _legend()
    if len(case.runs) > 1:
        yield _drawn(case, top, "all runs", deep=False)
        for one, goal in zip(case.runs, case.run_goals(), strict=True):
            yield f"<h3>{escape(one.id)}: {escape(one.ego)} in {escape(one.scenario)}</h3>"
            yield _drawn(case, goal, f"{one.ego} in {one.scenario}")
    else:
        yield _drawn(case, top, case.title)
    yield "<h2>Elements</h2>"
    yield _elements(case)
    yield "<h2>Evidence</h2>"
    yield _evidence(case)
    yield "<h2>Check it</h2>"
    yield (
        '<div class="card"><p>The script beside this page recomputes every number from the files, '
        "and needs Python 3.11 alone:</p><pre><code>python recompute.py</code></pre>"
        f"<p>SHA-256 of {FILE}: <code>{hashlib.sha256(data).hexdigest()}</code></p>"
        '<p class="muted">This page certifies nothing. It states what simulated runs support, and '
        f"what they leave open. {escape(case.generator)}; {escape(case.notation)}.</p></div>"
    )


def _verdicts(case: SafetyCase) -> Iterator[str]:
    """Yield the goals that decide: the top one, and those next below each run's."""
    rows = [
        f'<tr><td><a href="#{escape(one.id)}">{escape(one.id)}</a></td>'
        f"<td>{_state(one)}</td><td>{_said(one.statement)}</td></tr>"
        for one in case.main_goals()
    ]
    yield (
        '<div class="card wide"><table class="elements"><thead><tr><th>goal</th><th>status</th>'
        f"<th>claim</th></tr></thead><tbody>{''.join(rows)}</tbody></table></div>"
    )


def _drawn(case: SafetyCase, goal: Element, label: str, *, deep: bool = True) -> str:
    picture = drawing(layout(case, goal.id, deep=deep), f"Argument: {label}")
    return (
        f'<div class="card scroll" tabindex="0" role="group" aria-label="{escape(label)}, '
        f'scrollable">{picture}</div>'
    )


def _legend() -> str:
    words = "".join(
        f'<li><span class="state {_STATES[name]}">{name}</span> {text}</li>'
        for name, text in _MEANING.items()
    )
    return (
        f'<ul class="legend">{words}</ul>'
        '<p class="muted">Goal Structuring Notation: rectangles are '
        "goals, crossed out where they are defeated; parallelograms strategies, circles solutions, "
        "rounded rectangles contexts, ellipses assumptions (A) and justifications (J). A diamond "
        "marks what is undeveloped. Filled arrows lead to support, hollow ones to context, dashed "
        "ones challenge a goal. Texts are cut in the drawing, not in the table.</p>"
    )


def _elements(case: SafetyCase) -> str:
    files = {one.id: one for one in case.evidence}
    rows = []
    for one in case.elements:
        more = ""
        if one.details:
            lines = "".join(f"<li>{_said(text)}</li>" for text in one.details)
            word = _plural(len(one.details), "line")
            more += f"<details><summary>{word} more</summary><ul>{lines}</ul></details>"
        links = ", ".join(_link(files[name]) for name in one.evidence)
        if links:
            more += f'<div class="files">Evidence: {links}</div>'
        if one.link:
            more += f'<div class="files">See {escape(SITE + one.link)}</div>'
        rows.append(
            f'<tr id="{escape(one.id)}" class="{_side(one)}"><td>{escape(one.id)}</td>'
            f"<td>{_WORDS.get(one.kind, one.kind.lower())}</td><td>{_state(one)}</td>"
            f"<td>{_said(one.statement)}{more}{_relations(case, one)}</td></tr>"
        )
    return (
        '<div class="card wide"><table class="elements"><thead><tr><th>id</th><th>kind</th>'
        f"<th>status</th><th>statement</th></tr></thead><tbody>{''.join(rows)}</tbody></table></div>"
    )


def _relations(case: SafetyCase, one: Element) -> str:
    parts = []
    for kind, words in (
        ("SupportedBy", "supported by"), ("InContextOf", "in context of"),
        ("Challenges", "challenges"),
    ):  # fmt: skip
        names = [
            each.target for each in case.relations if (each.source, each.kind) == (one.id, kind)
        ]
        if names:
            links = ", ".join(f'<a href="#{escape(name)}">{escape(name)}</a>' for name in names)
            parts.append(f"{words} {links}")
    return f'<div class="files">{"; ".join(parts)}</div>' if parts else ""


def _evidence(case: SafetyCase) -> str:
    rows = [
        f'<tr id="{escape(one.id)}"><td>{escape(one.id)}</td><td>{_link(one)}</td>'
        f"<td>{escape(one.shows)}</td><td>{one.bytes:,}</td><td><code>{one.sha256}</code></td>"
        f"<td><code>{escape(one.command)}</code></td></tr>"
        for one in case.evidence
    ]
    return (
        '<div class="card wide"><table class="elements files-table"><thead><tr><th>id</th>'
        "<th>file</th><th>shows</th><th>bytes</th><th>SHA-256</th><th>made by</th></tr></thead>"
        f"<tbody>{''.join(rows)}</tbody></table></div>"
    )


def _link(one: Evidence) -> str:
    return f'<a href="{escape(quote(one.file))}">{escape(one.file)}</a>'


def _side(one: Element) -> str:
    return "counter" if one.kind.startswith("Counter") else ""


def _state(one: Element) -> str:
    return f'<span class="state {_STATES[one.status]}">{one.status}</span>' if one.status else ""


def _said(text: Statement) -> str:
    return escape(text.text)


def _plural(n: int, what: str) -> str:
    return f"{n:,} {what}{'s' * (n != 1)}"
