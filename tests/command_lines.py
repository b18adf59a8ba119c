"""Command lines as the application takes them apart."""

import re
from collections.abc import Iterator, Sequence
from typing import Any

from typer.main import get_command

from bridgegen.cli import app
from bridgegen.cli.groups import DEFAULT


def must_parse(words: list[str]) -> None:
    """Fail unless the words after ``bridgegen`` are a command with its options and arguments."""
    command: Any = get_command(app)
    rest = list(words)
    while hasattr(command, "commands"):
        named = command.commands.get(rest[0])
        command = named or command.commands[DEFAULT]
        rest = rest[1:] if named else rest
    command.make_context(command.name, rest)


def commands(command: Any, name: str = "") -> Iterator[tuple[str, Any]]:
    """Yield the commands of a group and of the groups in it, with their words."""
    for word, one in command.commands.items():
        words = f"{name} {word}".strip()
        if hasattr(one, "commands"):
            yield from commands(one, words)
        else:
            yield words, one


def missing_lines(shown: str, printed: Sequence[str]) -> list[str]:
    """Return the lines of a text block that an output does not have, in the order shown."""
    rest, missing = iter(printed), []
    for line in shown.splitlines():
        if line.strip() in ("", "…"):
            continue
        words = re.sub(r"[\d.,]+(?= m?s\b)", "0", " ".join(line.split()))
        wanted = re.compile(".*".join(map(re.escape, words.split("…"))))
        if not any(wanted.fullmatch(re.sub(r"[\d.,]+(?= m?s\b)", "0", " ".join(one.split())))
                   for one in rest):  # fmt: skip
            missing.append(line)
    return missing
