"""Run the notebooks, cell by cell, and write their outputs: python docs/make_notebooks.py."""

import ast
import base64
import json
import os
from contextlib import redirect_stdout
from io import BytesIO, StringIO
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

FOLDER = Path(__file__).parent / "notebooks"


def run(path: Path) -> dict[str, Any]:
    """Return a notebook with the outputs of its cells, as Jupyter has them.

    Its files are written to the working directory. The cells run without Jupyter, so that the
    outputs hold no name of a user, no path and no time of this machine.
    """
    notebook: dict[str, Any] = json.loads(path.read_text("utf-8"))
    names: dict[str, Any] = {"__name__": "__main__"}
    code = [cell for cell in notebook["cells"] if cell["cell_type"] == "code"]
    for number, cell in enumerate(code, 1):
        body = ast.parse("".join(cell["source"]), f"{path.stem}, code cell {number}")
        last = body.body.pop() if isinstance(body.body[-1], ast.Expr) else None
        printed, value = StringIO(), None
        with redirect_stdout(printed):
            exec(compile(body, path.stem, "exec"), names)
            if last is not None:
                value = eval(compile(ast.Expression(last.value), path.stem, "eval"), names)
        cell["execution_count"], cell["outputs"] = number, []
        if printed.getvalue():
            stream = {"name": "stdout", "output_type": "stream", "text": lines(printed.getvalue())}
            cell["outputs"].append(stream)
        if value is not None:
            shown = {"data": shown_as(value), "execution_count": number, "metadata": {}}
            cell["outputs"].append(shown | {"output_type": "execute_result"})
    return notebook


def shown_as(value: object) -> dict[str, Any]:
    """Return what Jupyter keeps of a value: its text, and HTML or a picture if it has one."""
    data: dict[str, Any] = {"text/plain": lines(repr(value))}
    if hasattr(value, "savefig"):
        image = BytesIO()
        value.savefig(image, format="png", dpi=60, metadata={"Software": None})
        data["image/png"] = base64.b64encode(image.getvalue()).decode("ascii") + "\n"
    elif hasattr(value, "_repr_svg_"):
        data["image/svg+xml"] = lines(value._repr_svg_())
    elif hasattr(value, "_repr_html_"):
        data["text/html"] = lines(value._repr_html_())
    return data


def lines(text: str) -> list[str]:
    return text.splitlines(keepends=True)


if __name__ == "__main__":
    for path in sorted(FOLDER.glob("*.ipynb")):
        with TemporaryDirectory() as folder:
            os.chdir(folder)
            found = run(path)
            os.chdir(FOLDER)
        path.write_text(json.dumps(found, indent=1, ensure_ascii=False) + "\n", "utf-8")
