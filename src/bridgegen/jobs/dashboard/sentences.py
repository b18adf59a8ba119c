"""What fails now, in two sentences."""

from bridgegen.jobs.dashboard.dashboard import Dashboard
from bridgegen.pages.templates import counted, joined

MOST_NAMED = 3


def failing_sentence(found: Dashboard) -> str:
    """Return who fails now, where, in how many ways, and what of it is decided."""
    if not found.project.results:
        return "No run and no suite is here yet."
    modes = found.failing
    drawn = sorted({result.scenario for result in found.rare})
    rare = f"In {joined(drawn, MOST_NAMED)}, random draws alone fail." if drawn else ""
    if not modes:
        return rare or "No failure mode is in any current result."
    drivers = sorted({mode.key.driver for mode in modes})
    scenarios = {mode.key.scenario for mode in modes}
    verb = "fails" if len(drivers) == 1 else "fail"
    some = joined(drivers, MOST_NAMED)
    ways = counted(len(modes), "way")
    words = f"{some} {verb} in {len(scenarios):,} of {counted(len(found.scenarios), 'scenario')}, "
    words += f"in {ways}"
    parts = []
    if found.regressions:
        number = len(found.regressions)
        parts.append(f"{number:,} {'is a regression' if number == 1 else 'are regressions'}")
    for status in ("new", "known", "accepted"):
        number = int(found.figures[status])
        parts += [f"{number:,} {status}"] if number else []
    return f"{words}: {joined(parts, 4)}. {rare}".rstrip()


def requirements_sentence(found: Dashboard) -> str:
    """Return which requirements are violated, and which are not tested."""
    scenarios = counted(len(found.without_requirement), "scenario")
    if not found.criteria:
        if not found.scenarios:
            return ""
        return "No pass criterion is stated: all scenarios are judged by harm alone."
    total, violated = len(found.criteria), found.violated
    if violated:
        named = [_violation(found, name) for name in list(violated)[:MOST_NAMED]]
        more = f" and {len(violated) - MOST_NAMED:,} others" if len(violated) > MOST_NAMED else ""
        verb = "is" if len(violated) == 1 else "are"
        head = f"{len(violated):,} of {counted(total, 'requirement')} {verb} violated: "
        words = head + "; ".join(named) + more
    else:
        words = "No requirement is violated" if total > 1 else "The requirement is not violated"
    if found.untested:
        words += f"; {joined(found.untested)} {_is(len(found.untested))} tested by no scenario"
    if found.without_requirement:
        verb = "tests" if len(found.without_requirement) == 1 else "test"
        words += f"; {scenarios} {verb} none"
    return f"{words}."


def _violation(found: Dashboard, name: str) -> str:
    criterion = next(each for each in found.criteria if each.id == name)
    by = [matrix.driver for matrix, _ in found.violated[name]]
    places = sorted({place for _, some in found.violated[name] for place in some})
    return f"{name} ({criterion.severity}) by {joined(by, 2)} in {joined(places, 2)}"


def _is(number: int) -> str:
    return "is" if number == 1 else "are"
