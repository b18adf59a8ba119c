"""The documentation site: sphinx-build -W -b html docs site. Extra: docs. It needs no network."""

import shutil
import sys
from importlib.metadata import version as version_of
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE)]

project = "BridgeGen"
author = "The BridgeGen developers"
copyright = "The BridgeGen developers, Apache-2.0"
version = release = version_of("bridgegen")

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
exclude_patterns = ["examples", "generated/weather.md", "generated/constants.md"]

myst_enable_extensions = ["attrs_inline", "colon_fence", "deflist"]
myst_heading_anchors = 3
smartquotes = False  # "--ego" is an option

# Extras: their classes are only bases here.
autodoc_mock_imports = ["gymnasium", "stable_baselines3", "torch"]
autodoc_member_order = "bysource"
autodoc_typehints = "description"
autodoc_typehints_description_target = "documented"
napoleon_google_docstring = True
napoleon_use_ivar = True
add_module_names = False

html_theme = "furo"
html_title = "BridgeGen"
html_static_path = ["static"]
html_css_files = ["site.css"]
html_extra_path = ["generated/extra"]
html_copy_source = False
html_show_sphinx = False
html_show_search_summary = False  # from disk, a browser may not fetch the pages for it
html_theme_options: dict[str, Any] = {"navigation_with_keys": True}


def setup(app: Any) -> None:
    """Write the pages that are made of the code before Sphinx reads them."""
    import make_reference

    write_trial(HERE / "generated" / "extra")
    app.connect("builder-inited", lambda _: make_reference.write(HERE / "generated"))
    app.connect("doctree-resolved", dash)


def write_trial(folder: Path) -> None:
    """Write ``try.html``: the report of a search, which simulates in the reader's browser."""
    import bridgegen as bg

    with TemporaryDirectory() as runs:
        run = bg.run_search("crossroads-s4", budget=300, keep=6, out=Path(runs) / "run")
        folder.mkdir(parents=True, exist_ok=True)
        shutil.copy(run.folder / "report.html", folder / "try.html")


def dash(_app: Any, tree: Any, _page: str) -> None:
    """Put a dash between a parameter and its text, as Sphinx's own quotes would have done."""
    from docutils.nodes import Text

    for one in tree.findall(lambda node: isinstance(node, Text) and node.astext() == " -- "):
        one.parent.replace(one, Text(" – "))
