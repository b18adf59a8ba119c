"""The notebooks of the documentation hold the outputs that their cells have."""

import importlib.util
import json
from pathlib import Path

import pytest

DOCS = Path(__file__).parents[1] / "docs"
FOLDER = DOCS / "notebooks"
NAMES = ["analyse-with-pandas", "first-search", "your-own-driver"]
LARGEST = 300_000
"""bytes: GitHub shows no notebook that is much larger."""


@pytest.fixture(scope="module")
def make():
    spec = importlib.util.spec_from_file_location("make_notebooks", DOCS / "make_notebooks.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def outputs(notebook):
    """Return the outputs of each cell as text; of pictures, and of pages with times, the kind."""
    for cell in notebook["cells"]:
        if cell["cell_type"] == "code":
            yield [
                {kind: text if is_text(kind, text) else "" for kind, text in shown(output)}
                for output in cell["outputs"]
            ]


def shown(output):
    return output["data"].items() if "data" in output else [("text/plain", output["text"])]


def is_text(kind, text):
    return kind == "text/plain" or (kind == "text/html" and 'class="dataframe"' in "".join(text))


def test_there_is_a_test_for_each():
    assert sorted(one.stem for one in FOLDER.glob("*.ipynb")) == NAMES


@pytest.mark.thorough
@pytest.mark.parametrize("name", NAMES)
def test_a_notebook_prints_what_it_shows(make, name, tmp_path, monkeypatch):
    """Otherwise: python docs/make_notebooks.py."""
    monkeypatch.chdir(tmp_path)
    path = FOLDER / f"{name}.ipynb"
    kept = json.loads(path.read_text("utf-8"))
    found = list(outputs(kept))
    assert sum(bool(one) for one in found) > len(found) / 2
    assert list(outputs(make.run(path))) == found


@pytest.mark.parametrize("name", NAMES)
def test_a_notebook_says_nothing_of_the_machine(name):
    text = (FOLDER / f"{name}.ipynb").read_text("utf-8")
    assert len(text.encode()) <= LARGEST
    notebook = json.loads(text)
    assert {*notebook["metadata"]} == {"kernelspec", "language_info"}
    assert all(cell["metadata"] == {} for cell in notebook["cells"])
    assert [word for word in ("/tmp/", "/home/", "/root", "/work", "\\Users") if word in text] == []
