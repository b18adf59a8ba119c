"""Pages of their own: an ontology file with violated constraints in red, a logical scenario."""

from pathlib import Path

from bridgegen.base.disk import refuse_other
from bridgegen.openx.convert import scenario_of
from bridgegen.pages.page import write_page
from bridgegen.pages.painter import paint
from bridgegen.pages.payload import script_json
from bridgegen.pages.picture_payload import pictures_payload
from bridgegen.pages.scenario_page import write_scenario_page
from bridgegen.scenario.language.reader import load as load_scenario
from bridgegen.scenario.ontology.check import check, constraints_in_words
from bridgegen.scenario.ontology.files import load

GENERATOR = "bridgegen show"
"""The generator that its pages name."""


def show_scenario(name_or_path: str, out: Path | None = None) -> Path:
    """Draw a logical scenario as a page.

    Args:
        name_or_path: a name of the catalogue, or a scenario file.
        out: the page; by default with the scenario's name, beside its file or, of the catalogue,
            here.

    Raises:
        InputError: no such scenario, one that breaks a rule, or a page whose name does not end in
            .html.
        StorageError: the page cannot be written, or is something else already.
    """
    scenario = load_scenario(name_or_path)
    path = Path(name_or_path)
    beside = path.parent if path.suffix in (".yaml", ".yml") else Path()
    out = out or beside / f"{scenario.name}.html"
    refuse_other(out, GENERATOR, "picture")
    write_scenario_page(out, scenario)
    return out


def show_file(owl: Path, out: Path | None = None) -> tuple[Path, int]:
    """Draw an ontology file's individuals as a page.

    An ``.owl`` of a scenario of the catalogue is checked against that scenario's constraints, any
    other against the ranges that it declares itself.

    Args:
        owl: the file, as written or edited.
        out: the page; by default beside the file, with its name and ``.html``. An earlier picture
            is replaced, any other file is not.

    Returns:
        The page, and how many violations it shows.

    Raises:
        InputError: the page's name does not end in .html.
        FileFormatError: not an ontology that can be read.
        OntologyError: it cannot be checked.
        StorageError: the page cannot be written, or is something else already.
    """
    out = out or owl.with_suffix(".html")
    refuse_other(out, GENERATOR, "picture")
    individuals = load(owl)
    scenario = scenario_of(individuals)
    violations = check(individuals, scenario)
    one = paint(individuals, violations, constraints_in_words(scenario))
    title = f"{owl.name}: {one.name}" if one.name else owl.name
    write_page(out, "show.js", title, script_json(pictures_payload([one])))
    return out, len(violations)
