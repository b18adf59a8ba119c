"""A run in a notebook: its figure, and the HTML that is shown."""

import re

import pytest

import bridgegen as bg


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    folder = tmp_path_factory.mktemp("runs") / "s4"
    return bg.run_search("crossroads-s4", budget=150, keep=2, seed=0, triage="none", out=folder)


def test_the_figure_shows_all_evaluations_and_the_worst_scenario(run):
    space, worst = run.plot().axes
    grey, red = space.lines
    frame = run.frame()
    assert len(red.get_xdata()) == frame.critical.sum() > 0
    assert len(grey.get_xdata()) + len(red.get_xdata()) == 150
    drawn = frame[frame.critical][[space.get_xlabel(), space.get_ylabel()]].to_numpy()
    assert (red.get_xydata() == drawn).all()
    gap = next(line for line in worst.lines if "distance" in line.get_label())
    result = bg.simulate_file(run.scenarios[0])
    assert gap.get_ydata().min() == pytest.approx(result.metrics["d_min"])


def test_what_a_notebook_shows(run):
    shown = run._repr_html_()
    assert "data:image/png;base64," in shown
    assert run.triage.bound.sentence in shown
    assert 'sandbox="allow-scripts"' in shown
    assert "srcdoc=" in shown
    assert len(shown) < 500_000
    assert not re.search(r"https?://", shown)


def test_nothing_critical(tmp_path):
    run = bg.run_search(
        "crossroads-s1", ego="reference", budget=20, algorithm="random", objective={"harm": None},
        triage="none", out=tmp_path / "r",
    )  # fmt: skip
    assert len(run.plot().axes) == 1
    assert "srcdoc" not in run._repr_html_()


def test_a_comparison_is_its_table(tmp_path):
    found = bg.compare(
        ["crossroads-s4"], algorithms=["random", "pso"], seeds=2, budget=40, workers=1,
        out=tmp_path / "<c>",
    )  # fmt: skip
    shown = found._repr_html_()
    assert shown.count("<tr") == 1 + min(len(found.summary()), 61)
    assert "&lt;c&gt;" in shown
