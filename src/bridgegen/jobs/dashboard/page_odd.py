"""The page's part on the operational design domain: the taxonomy, then parameters."""

from itertools import groupby

from bridgegen.jobs.dashboard.charts import strip
from bridgegen.jobs.dashboard.dashboard import Dashboard
from bridgegen.jobs.dashboard.markup import counted, folded, joined, section, table, text, within
from bridgegen.jobs.dashboard.odd import Coverage, Covered
from bridgegen.jobs.dashboard.taxonomy import SOURCE

SIZE = 1_000_000
"""Characters of the parameters of all scenarios."""

MOST_PARAMETERS = 60

_MARK = {"covered": "✓", "not covered": "○"}


def odd_part(found: Dashboard) -> str:
    """Return the section."""
    of = found.coverage
    covered, open_, cannot = of.counts
    lead = (
        f"Attributes of {SOURCE}: {covered} are covered by a scenario, {open_} are not covered, "
        f"{cannot} are not expressible in BridgeGen. Evaluations of runs and variations of suites "
        "count, with whatever driver; the cells of preventability maps do not. A covered attribute "
        "occurs; nothing says that it occurs often enough."
    )
    tree = "".join(
        folded(_summary(top, some), _groups(some), is_open=True)
        for top, some in _by(list(of.attributes), 0)
    )
    partly = sorted({one.partly for name, one in of.sceneries.items() if one.partly})
    notes = "".join(f'<p class="muted">Not read of some scenarios: {text(one)}.</p>'
                    for one in partly)  # fmt: skip
    parts = [tree + notes]
    if of.seen:
        parts.append(_parameters(of))
    return section("odd", "Coverage of the operational design domain", *parts, lead=lead)


def _by(some: list[Covered], level: int) -> list[tuple[str, list[Covered]]]:
    return [(key, list(each)) for key, each in groupby(some, lambda one: one.attribute.path[level])]


def _state(one: Covered) -> str:
    if not one.attribute.expressible:
        return "not expressible"
    return "covered" if one.scenarios else "not covered"


def _summary(name: str, some: list[Covered]) -> str:
    states = [_state(one) for one in some]
    covered, cannot = states.count("covered"), states.count("not expressible")
    words = f"{name}: {covered} of {len(some) - cannot} covered"
    return words + (f", {cannot} not expressible" if cannot else "")


def _groups(some: list[Covered]) -> str:
    body = []
    for path, each in groupby(some, lambda one: one.attribute.path[1:-1]):
        members = list(each)
        rows = [_row(one) for one in members if one.attribute.expressible]
        name = " / ".join(path)
        heads = ("attribute", "evaluations", "covered by")
        lines = table(name, heads, rows, "list odd") if rows else ""
        body.append(f'<div class="group"><h3>{text(name)}</h3>{lines}{_cannot(members)}</div>')
    return f'<div class="groups">{"".join(body)}</div>'


def _cannot(some: list[Covered]) -> str:
    """Return the attributes of a group that are not expressible, in a line."""
    names = [
        one.attribute.path[-1] + (f" ({one.attribute.note})" if one.attribute.note else "")
        for one in some
        if not one.attribute.expressible
    ]
    words = f"Not expressible: {'; '.join(names)}."
    return f'<p class="not-expressible">{text(words)}</p>' if names else ""


def _row(one: Covered) -> list[str]:
    state, attribute = _state(one), one.attribute
    note = f"<small>{text(attribute.note)}</small>" if attribute.note else ""
    names = [f"{name} ({count:,})" for name, count in one.scenarios.items()]
    kind = state.replace(" ", "-")
    mark = f'<span class="{kind}" aria-hidden="true">{_MARK[state]}</span>'
    by = text(joined(names, 2)) if names else f'<span class="{kind}">{state}</span>'
    if one.unread and not names:
        by += f"<small>not read of {counted(one.unread, 'scenario')}</small>"
    return [f"{mark} {text(attribute.path[-1])}{note}", f"{one.evaluations:,}", by]


def _parameters(of: Coverage) -> str:
    scenarios = (
        folded(f"{name}: {_in_words(of, name)}", _of_scenario(of, name)) for name in of.seen
    )
    lead = (
        '<h3>By parameter</h3><p class="muted">The declared range of each parameter in bins, the '
        "darker the more evaluations; an outlined bin has none. A bin may be empty because the "
        "scenario's constraints leave nothing there.</p>"
    )
    return lead + within(scenarios, SIZE, "scenario")


def _in_words(of: Coverage, name: str) -> str:
    seen = of.seen[name]
    bins = [count for counts in seen.bins.values() for count in counts]
    met = sum(count > 0 for count in bins)
    words = counted(seen.evaluations, "evaluation")
    return f"{words}, {met:,} of {counted(len(bins), 'bin')}" if bins else words


def _of_scenario(of: Coverage, name: str) -> str:
    seen, scenery = of.seen[name], of.sceneries[name]
    rows = []
    for one in scenery.parameters[:MOST_PARAMETERS]:
        counts = seen.bins.get(one.name, [])
        unit = "" if one.unit in ("1", "count") else f" {one.unit}"
        declared = one.kind.span_text(one.low, one.high, "{:.4g}".format, unit)
        outside = seen.outside.get(one.name, 0)
        more = f"<small>{outside:,} outside</small>" if outside else ""
        met = sum(count > 0 for count in counts)
        rows.append(
            [text(one.name), text(declared), f"{met} of {len(counts)}", strip(counts) + more]
        )
    heads = ("parameter", "declared", "bins met", "evaluations by bin")
    left = len(scenery.parameters) - len(rows)
    after = f'<p class="muted">and {counted(left, "parameter")} more</p>' if left > 0 else ""
    return table(f"Parameters of {name}", heads, rows) + after
