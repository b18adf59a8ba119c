import numpy as np
import pytest

from bridgegen.jobs.compare import figures
from bridgegen.jobs.compare.figures import DARK, LIGHT

PNG = b"\x89PNG\r\n\x1a\n"


@pytest.mark.parametrize("theme", [LIGHT, DARK])
def test_figures_are_pictures_and_the_same_bytes_again(theme):
    shares = {"random": np.array([0.1, 0.2, 0.2]), "pso": np.array([0.8]), "gone": np.array([])}
    drawn = figures.boxes(shares, "random", "R_critic", theme)
    assert drawn.startswith(PNG)
    assert drawn == figures.boxes(shares, "random", "R_critic", theme)
    found = {name: np.outer(values, [1.0, 2.0]) for name, values in shares.items()}
    assert figures.curves(found, [20, 40], "random", "found", theme).startswith(PNG)
    assert figures.curves({"gone": np.empty((0, 2))}, [20, 40], "gone", "f", theme).startswith(PNG)


@pytest.fixture
def axes(monkeypatch):
    """What a figure shows, in place of its bytes."""
    monkeypatch.setattr(figures, "png", lambda figure: figure.axes[0])
    return lambda draw, *given, **more: draw(*given, LIGHT, **more)


def test_boxes_show_every_run_and_the_median(axes):
    """One row each, the first on top; runs of 0.1, 0.2 and 0.6 have their median at 0.2."""
    shares = {"random": np.array([0.6, 0.1, 0.2]), "pso": np.array([0.8])}
    drawn = axes(figures.boxes, shares, "random", "R_critic")
    assert [text.get_text() for text in drawn.get_yticklabels()] == ["random", "pso"]
    assert drawn.get_ylim() == (1.5, -0.5)
    assert drawn.get_xlabel() == "R_critic"
    dots = [one for one in drawn.get_lines() if one.get_marker() == "."]
    assert [one.get_xdata().tolist() for one in dots] == [[0.6, 0.1, 0.2], [0.8]]
    assert [round(float(np.mean(one.get_ydata()))) for one in dots] == [0, 1]
    upright = [one for one in drawn.get_lines() if one.get_linewidth() == 3.2]
    assert [set(one.get_xdata()) for one in upright] == [{0.2}, {0.8}]
    assert {one.get_color() for one in upright} == {LIGHT.ink, LIGHT.colours[0]}


def test_curves_show_median_and_quartiles_by_evaluations(axes):
    """Of 1, 2, 3, 4 and 9 found the median is 3, the quartiles are 2 and 4; all begin at 0."""
    runs = np.outer([9.0, 1.0, 3.0, 2.0, 4.0], [1.0, 10.0])
    drawn = axes(figures.curves, {"random": runs}, [20, 40], "random", "found")
    (line,), (band,) = drawn.get_lines(), drawn.collections
    assert line.get_label() == "random"
    assert line.get_xydata().tolist() == [[0.0, 0.0], [20.0, 3.0], [40.0, 30.0]]
    corners = {tuple(point) for point in band.get_paths()[0].vertices.tolist()}
    assert corners == {(0.0, 0.0), (20.0, 2.0), (20.0, 4.0), (40.0, 20.0), (40.0, 40.0)}
    assert (drawn.get_xlabel(), drawn.get_ylabel()) == ("evaluations", "found")
    assert drawn.get_xlim() == (0.0, 40.0)
    assert drawn.get_ylim()[0] == 0.0


def test_curves_may_begin_where_they_are_after_a_tenth(axes):
    """The lowest is 0.94 there: the axis begins at the twentieth below it, 0.9."""
    runs = np.array([[0.2, 0.94, 0.95, 0.96, 0.97, 0.98, 0.98, 0.99, 0.99, 1.0]])
    drawn = axes(figures.curves, {"a": runs}, range(1, 11), "a", "f", from_zero=False)
    assert drawn.get_ylim()[0] == pytest.approx(0.9)


def test_eighteen_algorithms_look_different():
    names = [f"a{i}" for i in range(19)]
    looks = {(colour, str(style)) for _, colour, style in figures._looks(names, "a0", DARK)}
    assert len(looks) == 19
