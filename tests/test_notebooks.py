"""The notebooks of the documentation run, cell by cell, and hold no outputs."""

import ast
import json
import re
from pathlib import Path

import pytest

FOLDER = Path(__file__).parents[1] / "docs" / "notebooks"
NAMES = ["analyse-with-pandas", "first-search", "your-own-driver"]


def cells(name):
    return json.loads((FOLDER / f"{name}.ipynb").read_text("utf-8"))["cells"]


def test_there_is_a_test_for_each():
    assert sorted(one.stem for one in FOLDER.glob("*.ipynb")) == NAMES


@pytest.mark.parametrize("name", NAMES)
def test_a_notebook_runs(name, tmp_path, monkeypatch):
    """As Jupyter does: the value of a cell's last expression is shown, as HTML if it can be."""
    monkeypatch.chdir(tmp_path)
    names, shown = {"__name__": "__main__"}, []
    for number, cell in enumerate(one for one in cells(name) if one["cell_type"] == "code"):
        assert cell["outputs"] == []
        assert cell["execution_count"] is None
        short = 'budget=60, triage="none"'
        source = re.sub(r"budget=\d+", short, "".join(cell["source"]))
        body = ast.parse(source, f"{name}, code cell {number + 1}")
        last = body.body.pop() if isinstance(body.body[-1], ast.Expr) else None
        exec(compile(body, name, "exec"), names)
        if last is not None:
            value = eval(compile(ast.Expression(last.value), name, "eval"), names)
            ways = [getattr(value, f"_repr_{kind}_", None) for kind in ("html", "png")]
            shown.append([one() for one in ways if one] if any(ways) else [repr(value)])
    assert all(any(one) for one in shown)
    assert names["run"].summary.evaluations > 0
