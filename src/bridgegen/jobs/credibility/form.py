"""``yours.yaml``: what people state in a dossier. It is written once, and never changed."""

import textwrap
from collections.abc import Mapping
from pathlib import Path

from bridgegen.base.disk import read_inside, write_whole
from bridgegen.base.errors import FileFormatError
from bridgegen.jobs.credibility.items import FORM
from bridgegen.scenario.language.plain_yaml import read_plain_yaml

FILE = "yours.yaml"

MOST_LETTERS = 4000
"""Largest number of characters of an answer."""

_HEAD = """\
# What people state in this dossier: a text for each question. Without one, the item stays open.
# 'bridgegen credibility' reads this file, shows the texts, and never changes it.
"""


def read_form(folder: Path) -> dict[str, str]:
    """Return the texts that people wrote, by key, without those that are empty.

    Raises:
        FileFormatError: the form is damaged; all that is wrong.
        StorageError: it cannot be read, or is a link to another folder.
    """
    path = folder / FILE
    try:
        data = read_inside(folder, FILE)
    except FileNotFoundError:
        return {}
    found = read_plain_yaml(data, str(path)).data
    found = {} if found is None else found
    if not isinstance(found, Mapping):
        raise FileFormatError(f"the form must be texts by key ({path})")
    problems = [
        f"an answer must be a text of at most {MOST_LETTERS:,} characters under a key of the form, "
        f"got {str(key)[:40]!r} ({path})"
        for key, value in found.items()
        if key not in FORM or not isinstance(value, str | None) or len(value or "") > MOST_LETTERS
    ]
    if problems:
        raise FileFormatError(*problems)
    return {key: value for key, value in found.items() if value and value.strip()}


def write_form(folder: Path) -> None:
    """Write an empty form, unless there is one.

    Raises:
        StorageError: it cannot be written.
    """
    path = folder / FILE
    if path.exists():
        return
    parts = [_HEAD]
    for key, question in FORM.items():
        lines = textwrap.fill(question, 98, initial_indent="# ", subsequent_indent="# ")
        parts.append(f'\n{lines}\n{key}: ""\n')
    write_whole(path, ["".join(parts).encode()])
