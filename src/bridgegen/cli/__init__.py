"""The command line: it parses, calls, prints; no logic.

`groups.PANELS` lists the commands. `terminal` prints, `verdict` judges (`--fail-if`, JUnit).
Imports `jobs` and below.
"""

from bridgegen.cli import (
    demo,
    files,
    jobs,
    lists,
    regressions,
    reproductions,
    results,
    runs,
)
from bridgegen.cli.app import app, main

__all__ = [
    "app",
    "demo",
    "files",
    "jobs",
    "lists",
    "main",
    "regressions",
    "reproductions",
    "results",
    "runs",
]
