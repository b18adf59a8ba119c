"""The exceptions that BridgeGen raises, one small tree.

    BridgeGenError
     ├── InputError               what the user gave breaks a rule; exit status 2
     │    ├── UnknownNameError    no such scenario, algorithm, metric …; suggests the nearest
     │    ├── FileFormatError     a file that is missing, unreadable, malformed, hostile, too big
     │    ├── ScenarioError       a logical scenario (YAML) that breaks a rule
     │    ├── OntologyError       individuals that lack what a scenario needs, or contradict it
     │    └── UnsupportedError    valid, but outside what this version can do
     ├── StorageError             a run folder that exists, is read-only, is full, is not a run
     ├── WorkersError             workers cannot be had, or are lost; the run can be gone on with
     └── Interrupted              Ctrl-C; what is done is kept, and the run can be gone on with

Every message states the rule, the value with its unit and the place; ``problems`` holds all that
were found at once.
"""

from collections.abc import Iterable
from difflib import get_close_matches
from pathlib import Path
from typing import Any


class BridgeGenError(Exception):
    """Base of everything that BridgeGen raises on purpose.

    Args:
        problems: one sentence each; all that were found, not only the first.
    """

    def __init__(self, *problems: str) -> None:
        super().__init__("\n".join(problems))
        self.problems = problems

    def __reduce__(self) -> tuple[Any, ...]:
        return _again, (type(self), self.problems), self.__dict__


def _again(kind: type[BridgeGenError], problems: tuple[str, ...]) -> BridgeGenError:
    """Return an error that was pickled, whatever its own arguments were: a worker raised it."""
    error = kind.__new__(kind)
    BridgeGenError.__init__(error, *problems)
    return error


class InputError(BridgeGenError):
    """What the user gave breaks a rule."""


class UnknownNameError(InputError):
    """A name that is not in a registry.

    Args:
        kind: what was looked up, for the message ("scenario", "metric").
        name: what the user gave.
        known: the names there are.
    """

    def __init__(self, kind: str, name: str, known: Iterable[str]) -> None:
        names = sorted(known)
        near = get_close_matches(name, names, n=1, cutoff=0.5)
        hint = f"did you mean '{near[0]}'?" if near else f"known: {', '.join(names)}"
        super().__init__(f"unknown {kind} '{name}'; {hint}")


class FileFormatError(InputError):
    """A file that is missing, unreadable, malformed, hostile or too large."""


class ScenarioError(InputError):
    """A logical scenario that breaks a rule."""


class OntologyError(InputError):
    """Individuals that lack what a scenario needs, or contradict it."""


class UnsupportedError(InputError):
    """Valid input that this version cannot run; names the element and its line."""


class StorageError(BridgeGenError):
    """A run folder that exists already, cannot be written, is full, or is not a run."""


class WorkersError(BridgeGenError):
    """Workers cannot be had, or are lost."""


class Interrupted(BridgeGenError):
    """Ctrl-C ended a search, or a comparison.

    Args:
        folder: the run's; holds what was done.
        evaluations: how many that is.
        budget: how many it was to be.
        what: they are, if not evaluations.
        command: that goes on, if not ``bridgegen resume``.
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
            f"go on with '{command or f'bridgegen resume {folder}'}'"
        )
        self.folder, self.evaluations, self.budget = folder, evaluations, budget
