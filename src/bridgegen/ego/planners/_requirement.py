"""Whether a planner's packages are installed."""

from importlib.metadata import PackageNotFoundError, version

from bridgegen.ego.planners.planner import Planner
from bridgegen.errors import InputError


def require(planner: Planner) -> None:
    """Do nothing if a planner is installed.

    Raises:
        InputError: it is not, or in another version; how to get it.
    """
    from packaging.requirements import Requirement  # takes a while

    for text in planner.requires:
        wanted = Requirement(text)
        try:
            found = version(wanted.name)
        except PackageNotFoundError:
            found = ""
        if not found or not wanted.specifier.contains(found, prereleases=True):
            raise InputError(
                f"the planner '{planner.name}' needs {text}, "
                f"{'has ' + found if found else 'which is not installed'}: pip install '{text}'"
            )
