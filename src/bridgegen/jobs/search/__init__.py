"""A search: ask → evaluate → tell → record, triage, export, report; and what is done with runs."""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from bridgegen.jobs.search.campaign import SearchCallbacks, resume, run_search
    from bridgegen.jobs.search.run import Run

__all__ = ["Run", "SearchCallbacks", "resume", "run_search"]


def __getattr__(name: str) -> Any:
    """Import what is asked for: the check of a file needs no search."""
    from importlib import import_module

    if name not in __all__:
        raise AttributeError(f"module 'bridgegen.jobs.search' has no attribute '{name}'")
    home = "run" if name == "Run" else "campaign"
    return getattr(import_module(f"bridgegen.jobs.search.{home}"), name)
