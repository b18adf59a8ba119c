"""The page's part on trends: a chart for each scenario or suite, and driver."""

from urllib.parse import quote

from bridgegen.jobs.dashboard.charts import chart
from bridgegen.jobs.dashboard.dashboard import Dashboard
from bridgegen.jobs.dashboard.markup import counted, folded, link, section, span, table, text, when
from bridgegen.jobs.dashboard.results import versions
from bridgegen.jobs.dashboard.trends import Point, Series
from bridgegen.pages.sentences import NARROW

MOST_CHARTS = 48
"""Charts of the page: those that grew the most, then those with the largest share."""

MOST_ROWS = 300


def trends_part(found: Dashboard, base: str) -> str:
    """Return the section: versions, charts of what was measured again, a table of the rest."""
    again = [one for one in found.trends if len(one.points) > 1]
    once = [one for one in found.trends if len(one.points) == 1]
    links = {
        point.source: f"./{quote(_address(base, point))}"
        for one in again
        for point in one.points
        if point.page
    }
    parts = [_versions(found)]
    if again:
        figures = "".join(_figure(one, links) for one in again[:MOST_CHARTS])
        more = len(again) - MOST_CHARTS
        after = f'<p class="muted">and {counted(more, "chart")} more</p>' if more > 0 else ""
        parts.append(f'<div class="charts">{figures}</div>{after}')
    if once:
        summary = f"Measured once: {counted(len(once), 'scenario and driver', 'pairs')}"
        parts.append(folded(summary, _once(once, base), is_open=not again))
    lead = (
        "Harmful share of the search space, of random rows, with its 95"
        f"{NARROW}% interval; of suites the share of variations that fail. Results are in the "
        "order of time; a version ends the name of a driver behind a hyphen: stack-1.2."
    )
    return section("trends", "Trends over driver versions", *parts, lead=lead)


def _address(base: str, point: Point) -> str:
    return point.page if base == "." else f"{base}/{point.page}"


def _figure(one: Series, links: dict[str, str]) -> str:
    left = f", {counted(one.left_out, 'earlier result')} left out" if one.left_out else ""
    return (
        f"<figure>{chart(one, links)}<figcaption><b>{text(one.title)}</b> {text(one.driver)}"
        f"<small>{text(one.measure)}{left}</small></figcaption></figure>"
    )


def _versions(found: Dashboard) -> str:
    rows = []
    for _, some in sorted(versions(found.project.results).items()):
        for driver in some:
            of_it = [one for one in found.project.results if one.driver == driver]
            keys = {failure.key for one in of_it for failure in one.failures}
            rows.append(
                [
                    text(driver.label),
                    text(driver.version or "not known"),
                    when(min(one.time for one in of_it)),
                    f"{len({one.scenario for one in of_it}):,}",
                    f"{sum(one.evaluations for one in of_it):,}",
                    f"{len(keys):,}",
                ]
            )
    heads = ("driver", "version", "first result (UTC)", "scenarios", "evaluations",
             "failure modes")  # fmt: skip
    shown = rows[-MOST_ROWS:]
    return table("Versions of drivers", heads, shown)


def _once(some: list[Series], base: str) -> str:
    rows = []
    for one in some[:MOST_ROWS]:
        point = one.points[0]
        rows.append(
            [
                text(one.title),
                text(point.driver),
                text(one.measure),
                span(point.share, point.low, point.high),
                f"{point.count:,} of {point.of:,}",
                link(base, point.page, point.source),
            ]
        )
    heads = ("scenario or suite", "driver", "measure", "share", "count", "result")
    more = len(some) - len(rows)
    after = f'<p class="muted">and {more:,} more</p>' if more else ""
    return table("Measured once", heads, rows) + after
