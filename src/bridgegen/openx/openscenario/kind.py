"""What an OpenSCENARIO file is, without reading all of it."""

from pathlib import Path
from typing import Literal

from bridgegen.errors import FileFormatError
from bridgegen.openx.openscenario.read import DISTRIBUTION
from bridgegen.openx.xml import parse_xml

Kind = Literal["storyboard", "distribution", "catalog", "other"]


def kind_of_file(path: Path) -> tuple[Kind, str, str]:
    """Return the kind of an OpenSCENARIO file.

    Returns:
        The kind; of a distribution the scenario file that it names; and what is wrong with the
        file, empty if it is well-formed.
    """
    try:
        root = parse_xml(path)
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
