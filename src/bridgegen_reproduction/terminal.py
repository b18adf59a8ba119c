"""A reproduction in the terminal: one bar for all its runs, then its results."""

from typing import Any

from rich.console import Console

from bridgegen.cli.terminal.live import JobProgress
from bridgegen_reproduction.reproduction import Reproduction, reproduce


def reproduce_and_print(**arguments: Any) -> Reproduction:
    """Reproduce the evaluation with its progress on the terminal, and print what was found.

    Args:
        arguments: of ``reproduce``, but for ``callbacks``.
    """
    with JobProgress() as live:
        result = reproduce(**arguments, callbacks=live.callbacks)
    print_reproduction(result, live.seconds)
    return result


def print_reproduction(result: Reproduction, seconds: float) -> None:
    """Print the findings in sentences, and the files' paths."""
    console = Console(markup=False, emoji=False, highlight=False)
    for title, text in result.in_short:
        console.print(f"{title}: {text}\n")
    for name, path in (
        ("page", result.page),
        ("tables", result.folder / "tables"),
        ("figures", result.folder / "figures"),
        ("runs", result.folder / "runs.csv"),
    ):
        print(f"{name:<10}{path}")
    print(f"{'wall time':<10}{seconds:.1f} s")
