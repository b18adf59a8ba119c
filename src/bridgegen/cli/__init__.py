"""The command line: it parses, calls, prints; no logic.

Commands are listed in the order of these imports. `terminal` prints, `verdict` judges
(`--fail-if`, JUnit). Imports `jobs` and below.
"""

# ruff: noqa: I001
from bridgegen.cli import (
    demo,
    runs,
    views,
    confirmations,
    regressions,
    files,
    jobs,
    reproductions,
    exposures,
    maps,
    lists,
    doctor,
)
from bridgegen.cli.app import app, main

__all__ = [
    "app",
    "confirmations",
    "demo",
    "doctor",
    "exposures",
    "files",
    "jobs",
    "lists",
    "main",
    "maps",
    "regressions",
    "reproductions",
    "runs",
    "views",
]
