"""Write what is made of the code: the command line's help, and the scenario files' language.

conf.py calls it for each build; ``python docs/make_reference.py`` does it for a look.
"""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from typer.main import get_command

from bridgegen.cli import app
from bridgegen.cli.groups import DEFAULT
from bridgegen.engine.constants import CONSTANTS, NOT_VARIED
from bridgegen.scenario.language.json_schema import schema, schema_text
from bridgegen.scenario.language.parameters import Axis
from bridgegen.scenario.language.reader import load

HERE = Path(__file__).parent


def write(folder: Path) -> None:
    """Write all pages, and the schema itself; a page that has not changed is left as it is."""
    folder.mkdir(exist_ok=True)
    for name, text in (
        ("command-line.md", command_line()),
        ("scenario-files.md", scenario_files()),
        ("weather.md", weather()),
        ("constants.md", constants()),
        ("bridgegen.schema.json", schema_text()),
    ):
        path = folder / name
        if not path.exists() or path.read_text("utf-8") != text:
            path.write_text(text, "utf-8")


def command_line() -> str:
    """Return the page of all commands with their options."""
    parts = [
        "# Command line\n",
        "What `bridgegen COMMAND --help-all` says.\n",
        "Exit status: 0 is success; 1 a driver that `validate` finds fault with, or a run of "
        "`reproduce` that failed (or a bug of ours); 2 a mistake in what was given, with one line "
        "on stderr for each; 3 a criterion of `--fail-if` that is met; 130 Ctrl-C, 143 SIGTERM.\n",
    ]
    for path, command in sorted(commands(get_command(app), ("bridgegen",))):
        words = " ".join(path)
        context = command.context_class(command, info_name=words)
        usage = " ".join(command.collect_usage_pieces(context))
        parts += [f"## {words}\n", f"{command.help}\n", f"```text\n{words} {usage}\n```\n"]
        rows = [row(one, context) for one in command.params if not one.is_eager]
        if rows:
            parts.append("| | |\n|---|---|\n" + "\n".join(rows) + "\n")
    return "\n".join(parts)


def commands(command: Any, path: tuple[str, ...]) -> Iterator[tuple[tuple[str, ...], Any]]:
    """Yield each command with its words."""
    if not hasattr(command, "commands"):
        yield path, command
        return
    for name, one in command.commands.items():
        yield from commands(one, path if name == DEFAULT else (*path, name))


def row(one: Any, context: Any) -> str:
    """Return an option or argument as a row of a table."""
    record = one.get_help_record(context)
    names, text = record or (one.make_metavar(context), getattr(one, "help", ""))
    return f"| {code(names)} | {cell(text)} |"


def scenario_files() -> str:
    """Return the page of all keys of a scenario file, made of its JSON Schema."""
    whole = schema()
    parts = [
        "# Keys of a scenario file\n",
        "All keys, made of the same declarations as the reader and as the "
        "[JSON Schema](bridgegen.schema.json), which `bridgegen validate --schema` prints and "
        "`bridgegen new` puts beside your scenario so that an editor completes from it. "
        "[Writing a scenario](../scenarios.md) tells how they work together.\n",
        "A *quantity* is a number, or the name of a parameter or derived quantity. Keys in "
        "**bold** are needed.\n",
    ]
    sections = {"ScenarioFile": whole, **whole["definitions"]}
    sections |= {"FragmentFile": schema("fragment")}
    for name, one in sections.items():
        parts += [f"## {title(name)}\n", f"{one['description']}\n", keys(one)]
    return "\n".join(parts)


def weather() -> str:
    """Return the list of the weather's constraints, as its fragment declares them."""
    scenario = load("crossroads-s1")
    of_weather = {one.name for one in scenario.parameters.values() if one.axis == Axis.WEATHER}
    of_weather |= {one.name for one in scenario.derived if one.axis == Axis.WEATHER}
    rules = [
        (f"{one.target} {sign} {formula}", one.why, one.source)
        for one in scenario.bounds
        for sign, formula in (("≥", one.lo), ("≤", one.hi))
        if one.target in of_weather and formula is not None
    ]
    rules += [
        (f"{one.name} = {one.value}", one.why, one.source)
        for one in scenario.derived
        if one.name in of_weather
    ]
    return "".join(
        f"- `{rule}`\\\n  {cell(why)}\\\n  *Source:* {cell(source)}\n"
        for rule, why, source in rules
    )


def constants() -> str:
    """Return the table of constants that can be varied, and the list of those that are not."""
    rows = "\n".join(
        f"| `{one.name}` | {cell(one.words)} | {one.value:.4g} | {one.low:g} to {one.high:g} | "
        f"{one.unit} | {cell(one.influences)} | {cell(one.source)} |"
        for one in CONSTANTS
    )
    head = "| name | constant | nominal | plausible | unit | influences | source |\n" + "|---" * 7
    others = "".join(f"- {cell(what)}: {cell(why)}\n" for what, why in NOT_VARIED.items())
    return f"{head}|\n{rows}\n\nNot varied:\n\n{others}"


def title(name: str) -> str:
    """Return a section's name for people."""
    return {"ScenarioFile": "Scenario", "FragmentFile": "Fragment"}.get(
        name, name.removesuffix("Section")
    )


def keys(section: dict[str, Any]) -> str:
    """Return the table of a section's keys."""
    rows = []
    for name, one in section["properties"].items():
        needed = "**" if name in section.get("required", ()) else ""
        text = one.get("description", "")
        if "default" in one and one["default"] not in ([], {}):
            text += f" Default: {json.dumps(one['default'])}."
        rows.append(f"| {needed}`{name}`{needed} | {kind(one)} | {cell(text)} |")
    return "| key | takes | |\n|---|---|---|\n" + "\n".join(rows) + "\n"


def kind(one: dict[str, Any]) -> str:
    """Return in words what a key takes."""
    if "allOf" in one and "$ref" in one["allOf"][0]:
        return kind(one["allOf"][0])
    if "$ref" in one:
        name = title(one["$ref"].rpartition("/")[2])
        return f"[{name}](#{name.lower()})"
    if "anyOf" in one:
        found = [each for each in one["anyOf"] if each != {"type": "null"}]
        if [each.get("type") for each in found] == ["number", "string"]:
            return "quantity" if "pattern" in found[1] else "formula"
        return " or ".join(dict.fromkeys(kind(each) for each in found))
    if "enum" in one:
        return ", ".join(f"`{each}`" for each in one["enum"])
    if one.get("type") == "array":
        return f"list of {kind(one['items'])}"
    if "additionalProperties" in one and isinstance(one["additionalProperties"], dict):
        return f"by name: {kind(one['additionalProperties'])}"
    low, high = (one.get(name) for name in ("minimum", "maximum"))
    limits = f" {low:g} to {high:g}" if low is not None and high is not None else ""
    words = {"boolean": "true or false", "string": "text", "integer": "whole number"}
    return words.get(one.get("type", ""), str(one.get("type"))) + limits


def code(text: str) -> str:
    """Return a text as code in a table's cell."""
    return f"`{text}`".replace("|", "\\|")


def cell(text: str) -> str:
    """Return a text as a table's cell."""
    return " ".join(text.replace("``", "`").replace("|", "\\|").split())


if __name__ == "__main__":
    write(HERE / "generated")
