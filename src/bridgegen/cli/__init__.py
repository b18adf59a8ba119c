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
    comparisons,
    benchmarks,
    suites,
    regressions,
    preventability,
    risks,
    dashboard,
    reproductions,
    safety_cases,
    files,
    recordings,
    exposures,
    maps,
    lists,
    doctor,
)
from bridgegen.cli.app import app, main

__all__ = [
    "app",
    "benchmarks",
    "comparisons",
    "confirmations",
    "dashboard",
    "demo",
    "doctor",
    "exposures",
    "files",
    "lists",
    "main",
    "maps",
    "preventability",
    "recordings",
    "regressions",
    "reproductions",
    "risks",
    "runs",
    "safety_cases",
    "suites",
    "views",
]
