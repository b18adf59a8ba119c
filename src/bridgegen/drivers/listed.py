"""All drivers as a table: those that ship, planners of others, drivers of other participants."""

from collections.abc import Iterator

from bridgegen.drivers.drivers import DRIVERS, GUESTS, OTHERS, join
from bridgegen.drivers.planners import DOMAINS, Planner, how_to_get, installed, missing, planners

HEAD = ("driver", "description", "can be ideal", "available", "licence", "domain", "source")


def listed() -> list[tuple[str, ...]]:
    """Return a row of `HEAD` for each driver; texts that say nothing are empty."""
    blank = ("", "", "")  # licence, domain, source
    rows: list[tuple[str, ...]] = [
        (one.name, one.description, join(one.stages), "ships", "", in_order(one.domain), "")
        for one in DRIVERS.values()
    ]
    rows += [
        (one.name, one.description, join(one.stages), f"in {one.home}", *blank)
        for one in GUESTS.values()
    ]
    rows += [
        (
            one.name, one.description, "perception", available(one), one.licence,
            in_order(one.domain), one.source,
        )
        for one in planners().values()
    ]  # fmt: skip
    rows += [
        (name, f"Of other participants: {what}", "", "ships", *blank)
        for name, what in OTHERS.items()
    ]
    return rows


def available(planner: Planner) -> str:
    """Return whether a planner is installed, in which version, or how to get it."""
    if problem := missing(planner):
        return f"not installed ({problem}): {how_to_get(planner)}"
    versions = installed(planner)
    state = f"installed: {versions}" if versions else "installed"
    return f"{state}; {planner.how_to_get}" if planner.how_to_get else state


def in_order(domain: frozenset[str]) -> str:
    """Return where a driver means to drive, in the order of `DOMAINS`."""
    return ", ".join(word for word in DOMAINS if word in domain)


def planner_findings() -> Iterator[tuple[str, str, str]]:
    """Yield each planner's name, whether it is installed, and how to get it where it is not."""
    for one in planners().values():
        problem = missing(one)
        state = "not installed" if problem else available(one)
        yield one.name, state, how_to_get(one) if problem else ""
