"""What an OpenSCENARIO file is, without reading all of it."""

import os
from pathlib import Path
from typing import Literal

from bridgegen.base.errors import FileFormatError
from bridgegen.openx.openscenario.read import DISTRIBUTION
from bridgegen.openx.openscenario.tier4 import root_of

_PATHS = ("path", "filepath")
"""Attributes that name files and folders."""

Kind = Literal["storyboard", "distribution", "catalog", "other"]


def files_named_in(path: Path) -> tuple[Path, ...]:
    """Return the files that an OpenSCENARIO file may read: its map, those of its catalogues.

    Also the maps that values of its parameters name.

    Raises:
        FileFormatError: it cannot be read.
    """
    found: dict[Path, None] = {}
    for element in root_of(path).iter():
        for name, value in element.attrib.items():
            text = str(value)
            if (
                not (str(name) in _PATHS or text.lower().endswith((".xodr", ".osm")))
                or "\0" in text
            ):
                continue
            named = path.parent / text
            # Of a name that is too long, they say "no", where those of Path raise.
            some = sorted(named.glob("*.xosc")) if os.path.isdir(named) else [named]
            found.update(dict.fromkeys(item for item in some if os.path.isfile(item)))
    return tuple(found)


def kind_of_file(path: Path) -> tuple[Kind, str, str]:
    """Return the kind of an OpenSCENARIO file.

    Returns:
        The kind; of a distribution the scenario file that it names; and what is wrong with the
        file, empty if it is well-formed.
    """
    try:
        root = root_of(path)
    except FileFormatError as error:
        return "other", "", "; ".join(error.problems)
    if root.find("Storyboard") is not None:
        return "storyboard", "", ""
    if root.find("Catalog") is not None:
        return "catalog", "", ""
    distribution = root.find(DISTRIBUTION)
    if distribution is None:
        return "other", "", ""
    named = distribution.find("ScenarioFile")
    file = "" if named is None else named.get("filepath", "")
    problem = "" if file else f"{path}: a {DISTRIBUTION} must name a ScenarioFile"
    return "distribution", file, problem
