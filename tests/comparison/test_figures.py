"""Figures of a comparison: what is drawn where, read from the SVG."""

from xml.etree import ElementTree

import numpy as np
import pytest

from bridgegen.jobs.compare import figures

SVG = "{http://www.w3.org/2000/svg}"


def drawn(figure):
    return ElementTree.fromstring(figure)


def of(root, tag, kind):
    """Return the elements of a tag that have a class."""
    return [one for one in root.iter(tag) if kind in (one.get("class") or "").split()]


def labelled(root):
    """Return what turns pixels across into values, by the numbers below the axis."""
    words = [(one.text, float(one.get("x")), float(one.get("y") or 0)) for one in root.iter("text")
             if one.get("x")]  # fmt: skip
    at = [(x, float(text)) for text, x, y in words if text.replace(".", "").isdigit()]
    (x0, v0), *_, (x1, v1) = at
    return lambda x: v0 + (x - x0) * (v1 - v0) / (x1 - x0)


def test_figures_are_the_same_again_and_files_stand_alone():
    shares = {"random": np.array([0.1, 0.2, 0.2]), "<b>": np.array([0.8]), "gone": np.array([])}
    box = figures.boxes(shares, "random", "R_critic")
    assert box == figures.boxes(shares, "random", "R_critic")
    found = {name: np.outer(values, [1.0, 2.0]) for name, values in shares.items()}
    for figure in (
        box,
        figures.curves(found, [20, 40], "random", "found"),
        figures.curves({"gone": np.empty((0, 2))}, [20, 40], "gone", "f"),
        figures.boxes({"gone": np.empty(0)}, "gone", "f"),
    ):
        root = ElementTree.fromstring(figures.as_file(figure))
        assert root.tag == f"{SVG}svg"
        assert figures.LIGHT[1] in root.find(f"{SVG}style").text
        assert "nan" not in figure


def test_boxes_show_every_run_and_the_median():
    """One row each, the first on top; runs of 0.1, 0.2 and 0.6 have their median at 0.2."""
    shares = {"random": np.array([0.6, 0.1, 0.2]), "pso": np.array([0.8])}
    root = drawn(figures.boxes(shares, "random", "R_critic"))
    names = [one.text for one in root.iter("text")]
    assert names[:2] == ["random", "pso"]
    assert "R_critic" in names
    value = labelled(root)
    for kind, runs in (("k0", [0.6, 0.1, 0.2]), ("k1", [0.8])):
        dots = of(root, "circle", kind)
        assert [value(float(one.get("cx"))) for one in dots] == pytest.approx(runs, abs=2e-3)
    assert max(float(one.get("cy")) for one in of(root, "circle", "k0")) < min(
        float(one.get("cy")) for one in of(root, "circle", "k1")
    )
    medians = [one.get("d")[1:].split()[0] for one in of(root, "path", "median")]
    assert [value(float(x)) for x in medians] == pytest.approx([0.2, 0.8], abs=2e-3)


def test_curves_show_median_and_quartiles_by_evaluations():
    """Of 1, 2, 3, 4 and 9 found the median is 3, the quartiles are 2 and 4; all begin at 0."""
    runs = np.outer([9.0, 1.0, 3.0, 2.0, 4.0], [1.0, 10.0])
    root = drawn(figures.curves({"random": runs}, [20, 40], "random", "found"))
    (line,), (band,) = of(root, "polyline", "line"), of(root, "polygon", "band")

    def points(one):
        return np.array([pair.split(",") for pair in one.get("points").split()], float)

    across, up = points(line).T
    assert np.diff(across).tolist() == pytest.approx([across[1] - across[0]] * 2, abs=0.11)
    by_one = (up[0] - up[1]) / 3.0
    assert (up[0] - up) / by_one == pytest.approx([0.0, 3.0, 30.0], abs=0.1)
    heights = (up[0] - points(band)[:, 1]) / by_one
    assert heights == pytest.approx([0.0, 4.0, 40.0, 20.0, 2.0, 0.0], abs=0.2)
    assert {"evaluations", "found", "random"} <= {one.text for one in root.iter("text")}


def test_curves_may_begin_where_they_are_after_a_tenth():
    """The lowest is 0.94 there: the axis begins at the twentieth below it, 0.9."""
    runs = np.array([[0.2, 0.94, 0.95, 0.96, 0.97, 0.98, 0.98, 0.99, 0.99, 1.0]])
    root = drawn(figures.curves({"a": runs}, range(1, 11), "a", "f", from_zero=False))
    numbers = [one for one in root.iter("text") if one.get("text-anchor") == "end"]
    assert float(numbers[0].text) == pytest.approx(0.9)


def test_eighteen_algorithms_look_different():
    names = [f"a{i}" for i in range(19)]
    assert len({(kind, dash) for _, kind, dash in figures._looks(names, "a0")}) == 19
    assert len(figures.LIGHT) == len(figures.DARK)
