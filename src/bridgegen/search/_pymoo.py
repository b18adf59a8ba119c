"""What the algorithms built on pymoo share. Imported only when one of them is built."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from pymoo.config import Config
from pymoo.core.problem import Problem


def unit_cube(n_var: int, n_obj: int) -> Problem:
    """Return pymoo's description of the search space; it is never evaluated by pymoo."""
    return Problem(n_var=n_var, n_obj=n_obj, xl=0.0, xu=1.0)


@contextmanager
def quiet() -> Iterator[None]:
    """Keep pymoo from printing its hint about compiled modules; the user's choice is restored."""
    before: Any = Config.warnings["not_compiled"]
    Config.warnings["not_compiled"] = False
    try:
        yield
    finally:
        Config.warnings["not_compiled"] = before
