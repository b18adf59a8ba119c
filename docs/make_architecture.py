"""Write the table of rooms in docs/architecture.md, made of the packages' docstrings.

python docs/make_architecture.py
"""

import ast
import tomllib
from pathlib import Path

HERE = Path(__file__).parent
SOURCES = HERE.parent / "src" / "bridgegen"
BEGIN, END = "<!-- rooms: python docs/make_architecture.py -->\n", "<!-- end of rooms -->\n"


def page(text: str) -> str:
    """Return the page with its table as the docstrings are now."""
    before, _, rest = text.partition(BEGIN)
    _, _, after = rest.partition(END)
    return f"{before}{BEGIN}\n{table()}\n{END}{after}"


def table() -> str:
    """Return the rooms from the bottom up, each with its parts: first lines of docstrings."""
    project = tomllib.loads((HERE.parent / "pyproject.toml").read_text("utf-8"))
    house = project["tool"]["importlinter"]["contracts"][0]["layers"]
    lines = ["| room | holds |", "|---|---|"]
    for room in reversed(house):
        lines.append(f"| **`{room}/`** | **{said(SOURCES / room)}** |")
        for part in sorted((SOURCES / room).iterdir()):
            if (part / "__init__.py").exists():
                lines.append(f"| `{room}/{part.name}/` | {said(part)} |")
    return "\n".join(lines) + "\n"


def said(package: Path) -> str:
    """Return the first line of a package's docstring."""
    text = ast.get_docstring(ast.parse((package / "__init__.py").read_text("utf-8"))) or ""
    return text.partition("\n")[0]


if __name__ == "__main__":
    path = HERE / "architecture.md"
    path.write_text(page(path.read_text("utf-8")), "utf-8")
