"""A scenario file to start from: a commented one, or a copy of one that ships.

Beside it goes the schema that its first line names, from which editors complete and check it.
"""

import os
import re
from importlib import resources
from pathlib import Path

from bridgegen.base.errors import InputError, StorageError, UnknownNameError
from bridgegen.scenario.language.json_schema import FILE, refuse_other_schema, write_schema
from bridgegen.scenario.language.narrowed import narrow
from bridgegen.scenario.language.reader import names, pack_names, shipped_text
from bridgegen.scenario.language.sentence import read_sentence

_WORD = re.compile(r"[A-Za-z][A-Za-z0-9_-]{0,63}")


def start_scenario(name: str, *, like: str | None = None, folder: Path | None = None) -> Path:
    """Write ``NAME.yaml``, a valid scenario that its reader can make their own, and its schema.

    Args:
        name: of the scenario and its file.
        like: a scenario of the catalogue or of a pack to copy; by default a small one that
            explains itself.
        folder: where to; by default here.

    Returns:
        The file.

    Raises:
        InputError: the name is no word.
        UnknownNameError: no such scenario.
        StorageError: there is such a file already, or what is called like the schema and is none,
            or it cannot be written.
    """
    _refuse_name(name)
    if like is None:
        text = (
            resources.files("bridgegen.scenario.language")
            .joinpath("starter.yaml")
            .read_text("utf-8")
        )
        text = text.replace("NAME", name)
    elif like in (known := (*names(), *pack_names())):
        text = shipped_text(like).decode("utf-8")
        text = re.sub(r"^scenario: .*$", f"scenario: {name}", text, count=1, flags=re.M)
    else:
        raise UnknownNameError("scenario", like, known)
    return _write(name, text, folder)


def start_from_sentence(
    name: str, sentence: str, *, like: str | None = None, folder: Path | None = None
) -> tuple[Path, tuple[str, ...]]:
    """Write ``NAME.yaml``, the scenario of the catalogue that a sentence says, and its schema.

    Args:
        name: as of `start_scenario`.
        sentence: see `bridgegen.scenario.language.sentence`.
        like: the scenario of the catalogue that it is about; by default it says so itself.
        folder: as of `start_scenario`.

    Returns:
        The file, and what was understood, see `bridgegen.scenario.language.narrowed.narrow`.

    Raises:
        InputError: the name is no word; or the sentence is not understood, or not possible.
        StorageError: as of `start_scenario`.
    """
    _refuse_name(name)
    text, lines = narrow(read_sentence(sentence, like), name)
    return _write(name, text, folder), lines


def _refuse_name(name: str) -> None:
    if not _WORD.fullmatch(name):
        raise InputError(
            f"a scenario's name is a word of letters, digits, '_' and '-', 64 at most, got '{name}'"
        )
    if name in names():
        raise InputError(f"'{name}' ships with BridgeGen; choose another name")


def _write(name: str, text: str, folder: Path | None) -> Path:
    path = (folder or Path()) / f"{name}.yaml"
    refuse_other_schema(path.with_name(FILE))
    text = f"# yaml-language-server: $schema={FILE}\n{text}"
    try:
        with os.fdopen(
            os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o666), "w", encoding="utf-8"
        ) as file:
            file.write(text)
    except FileExistsError:
        raise StorageError(f"{path}: exists already, and is not overwritten") from None
    except OSError as error:
        raise StorageError(f"{path}: cannot be written: {error.strerror}") from None
    write_schema(path.with_name(FILE))
    return path
