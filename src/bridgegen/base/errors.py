"""The exceptions that BridgeGen raises, one small tree.

    BridgeGenError
     ├── InputError               the user's input breaks a rule; exit status 2
     │    ├── UnknownNameError    no such scenario, algorithm, metric …; suggests the closest
     │    ├── FileFormatError     a file that is missing, unreadable, malformed, hostile, too big
     │    ├── ScenarioError       a logical scenario (YAML) that breaks a rule
     │    ├── OntologyError       individuals that are incomplete for a scenario, or contradict it
     │    └── UnsupportedError    valid, but not supported by this version
     ├── StorageError             a run folder that exists, is read-only, is full, is not a run
     ├── WorkersError             workers are unavailable or lost; the run can be resumed
     └── Interrupted              Ctrl-C; the results so far are kept, and the run can be resumed

Every message states the rule, the value with its unit and the place; ``problems`` holds all
problems that were found.
"""

from collections.abc import Iterable
from difflib import get_close_matches
from pathlib import Path
from typing import Any


class BridgeGenError(Exception):
    """Base class of the exceptions that BridgeGen raises.

    Args:
        problems: one sentence each; all that were found, not only the first.
    """

    def __init__(self, *problems: str) -> None:
        super().__init__("\n".join(problems))
        self.problems = problems

    def __reduce__(self) -> tuple[Any, ...]:
        return _rebuild, (type(self), self.problems), self.__dict__


def _rebuild(kind: type[BridgeGenError], problems: tuple[str, ...]) -> BridgeGenError:
    """Rebuild a pickled error of a worker, whatever the arguments of its class are."""
    error = kind.__new__(kind)
    BridgeGenError.__init__(error, *problems)
    return error


class InputError(BridgeGenError):
    """The user's input breaks a rule."""


class UnknownNameError(InputError):
    """A name that is not in a registry.

    Args:
        kind: of the name, for the message ("scenario", "metric").
        name: the user's input.
        known: the registered names.
    """

    def __init__(self, kind: str, name: str, known: Iterable[str]) -> None:
        names = sorted(known)
        near = get_close_matches(name, names, n=1, cutoff=0.5 if len(name) < 3 else 0.55)
        hint = f"did you mean '{near[0]}'?" if near else f"known: {', '.join(names)}"
        super().__init__(f"unknown {kind} '{name}'; {hint}")


class FileFormatError(InputError):
    """A file that is missing, unreadable, malformed, hostile or too large."""


class ScenarioError(InputError):
    """A logical scenario that breaks a rule."""


class OntologyError(InputError):
    """Individuals that are incomplete for a scenario, or contradict it."""


class UnsupportedError(InputError):
    """Valid input that this version cannot run; names the element and its line."""


class StorageError(BridgeGenError):
    """A run folder that exists already, cannot be written, is full, or is not a run."""


class WorkersError(BridgeGenError):
    """Workers are unavailable or lost."""


class Interrupted(BridgeGenError):
    """Ctrl-C ended a search, or a comparison.

    Args:
        folder: of the run; holds the results so far.
        evaluations: number of results.
        budget: number of results that were planned.
        what: the unit of both numbers, if not evaluations.
        command: resumes the work, if not ``bridgegen resume``.
    """

    def __init__(
        self,
        folder: Path,
        evaluations: int,
        budget: int,
        *,
        what: str = "evaluations",
        command: str | None = None,
    ) -> None:
        super().__init__(
            f"stopped after {evaluations} of {budget} {what}; "
            f"resume with '{command or f'bridgegen resume {folder}'}'"
        )
        self.folder, self.evaluations, self.budget = folder, evaluations, budget
