"""The Pareto front of a search for many objectives, as the page is told of it and draws it."""

from dataclasses import replace

import numpy as np
import pytest

from bridgegen.pages.data import Column
from bridgegen.pages.page import write_report
from bridgegen.pages.payload import payload


@pytest.fixture(scope="module")
def many(report):
    """The report with two objectives; the first ten rows have failed."""
    e = report.evaluations
    values = {c.name: c.values for c in e.metrics}
    objectives = (
        Column("F of d_min", "1", np.round(values["d_min"], 2)),
        Column("F of v_d", "1", -np.round(values["v_d"], 2)),
    )
    status = np.where(np.arange(120) < 10, 1, 0)
    return replace(report, evaluations=replace(e, objectives=objectives, status=status))


def front_of(data):
    """Return the places of the front, by comparing every row with every other."""
    e = data.evaluations
    F = np.stack([c.values for c in e.objectives], axis=1)[e.status == 0]
    worse = [((row >= F).all(axis=1) & (row > F).any(axis=1)).any() for row in F]
    return np.flatnonzero(~np.array(worse)).tolist()


def test_the_page_is_told_of_those_that_no_other_dominates(many, report):
    told = payload(many)["rows"]["front"]
    assert told == front_of(many)
    assert 1 < len(told) < 110
    assert payload(report)["rows"]["front"] == []  # one objective has no front


@pytest.mark.browser
def test_a_button_puts_the_objectives_on_the_axes_and_draws_the_front(browser, many, tmp_path):
    write_report(tmp_path / "report.html", many)
    page = browser.new_page()
    page.goto((tmp_path / "report.html").as_uri())
    page.locator("#scatter").scroll_into_view_if_needed()
    page.wait_for_function("bridgegen.scatter.points")
    page.click("#show-front")
    assert [page.input_value("#axis-x"), page.input_value("#axis-y")] == ["F of d_min", "F of v_d"]
    front = "bridgegen.scatter.series.find((one) => one.name === 'front').items"
    x, y = page.evaluate(
        f"'xy'.split('').map((a) => {front}.map((i) => bridgegen.scatter.values[a][i]))"
    )
    e = many.evaluations
    F = np.stack([c.values[e.status == 0][front_of(many)] for c in e.objectives], axis=1)
    order = np.lexsort((-F[:, 1], F[:, 0]))
    assert np.stack([x, y], axis=1) == pytest.approx(F[order], abs=1e-3)
    page.close()
