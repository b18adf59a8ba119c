"""What figures show: their data, not their looks."""

import math

import numpy as np
import pytest
from matplotlib.patches import FancyBboxPatch

from bridgegen.scenario.language.reader import load
from bridgegen.scenario.ontology.structure import LAYERS
from bridgegen_reproduction.figures.causes import causes
from bridgegen_reproduction.figures.distributions import Violin, by_iteration, iterations, violins
from bridgegen_reproduction.figures.look import DARK, LIGHT, blank, pdf, png
from bridgegen_reproduction.figures.ontology import blocks, ontology, picture_of
from bridgegen_reproduction.perception import Causes
from bridgegen_reproduction.runs import Run


def run(seed: int) -> Run:
    """120 evaluations of nobody, of which one failed."""
    d, v, fitness = np.random.default_rng(seed).random((3, 120)) * 30.0
    d[7] = v[7] = fitness[7] = math.nan
    no = np.zeros(120, np.bool_)
    return Run("", "", {}, (), np.empty((120, 0)), d, v, fitness, no, no, no.astype(np.int8), 1.0,
               d)  # fmt: skip


def test_an_iteration_is_forty_evaluations_of_every_run():
    runs = [run(0), run(1)]
    spans = by_iteration(runs, "d_min")
    assert len(spans) == 3
    for k, one in enumerate(spans):
        pooled = np.concatenate([run.d_min[40 * k : 40 * k + 40] for run in runs])
        assert len(pooled) == 80
        expected = np.nanpercentile(pooled, [25, 50, 75])
        assert [one.low, one.median, one.high] == pytest.approx(expected)


def test_lines_are_the_medians():
    runs = {"pso": [run(0), run(1)]}
    figure = iterations(runs, ("d_min", "v_d"), LIGHT)
    for axes, quantity in zip(figure.axes, ("d_min", "v_d"), strict=True):
        (line,) = axes.lines
        medians = [one.median for one in by_iteration(runs["pso"], quantity)]
        assert line.get_ydata() == pytest.approx(medians)
        assert "[" in axes.get_ylabel()  # its unit


@pytest.mark.parametrize("theme", [LIGHT, DARK])
def test_violins_show_median_and_the_paper_s(theme):
    values = np.array([1.0, 2.0, 3.0, np.nan])
    still = np.zeros(5)
    figure = violins(
        {"d_min": {"random": Violin("RS", values, (13.38, 12.19)),
                   "pso": Violin("PSO", still, (math.nan, math.nan)),
                   "nsga2-dt": Violin("NSGA-II-DT", np.array([]), (2.9, 0.69))}}, theme
    )  # fmt: skip
    (axes,) = figure.axes
    points = {(line.get_marker(), float(line.get_ydata()[0])) for line in axes.lines}
    assert {("o", 2.0), ("o", 0.0), ("x", 13.38), ("_", 12.19), ("x", 2.9)} <= points
    assert png(figure).startswith(b"\x89PNG")


def test_bars_are_the_shares_of_the_causes():
    counts = {"random": (1, 2, 3, 4), "ppo": (0, 0, 0, 7), "pso": (5, 0, 1, 0)}
    found = [Causes("paper-crossroads-s3", name, 100, by, (0.1,)) for name, by in counts.items()]
    found.append(Causes("paper-crossroads-s4", "random", 100, (0, 0, 0, 0), (0.0,)))
    figure = causes(found, LIGHT)
    bars = [patch for patch in figure.axes[0].patches if patch.get_width() > 0]
    assert sum(bar.get_width() for bar in bars) == pytest.approx(100.0 * len(counts))
    shares = [100.0 * n / sum(by) for by in counts.values() for n in by if n]
    assert [bar.get_width() for bar in bars] == pytest.approx(shares)
    assert "0 of 100" in {text.get_text() for text in figure.axes[0].texts}


def test_the_ontology_shows_every_individual_in_its_layer():
    picture = picture_of(load("paper/crossroads-s4"))
    columns = blocks(picture)
    drawn = {one: number for number, column in enumerate(columns, 1) for b in column
             for one in b.ids}  # fmt: skip
    assert drawn == {one.id: one.layer for one in picture.all_boxes()}
    assert [bool(column) for column in columns] == [True, False, False, True, True]
    figure = ontology(picture, list(LAYERS.values()), LIGHT)
    png(figure)
    axes = figure.axes[0]
    renderer = figure.canvas.get_renderer()
    patches = [p.get_window_extent(renderer) for p in axes.patches if isinstance(p, FancyBboxPatch)]
    assert len(patches) == sum(map(len, columns))
    for text in axes.texts:  # nothing hangs out of its box
        at = text.get_window_extent(renderer)
        for patch in patches:
            if text.get_ha() == "left" and patch.contains(at.x0, (at.y0 + at.y1) / 2):
                assert at.x1 <= patch.x1 + 1, text.get_text()


def test_a_pdf_is_the_same_bytes_again():
    def made() -> bytes:
        figure = blank(2.0, 1.0, LIGHT)
        figure.add_subplot().set_title("R_critic")
        return pdf(figure)

    first = made()
    assert first.startswith(b"%PDF")
    assert made() == first
    assert b"/CreationDate" not in first
    assert b"/Type3" not in first  # publishers refuse such fonts
