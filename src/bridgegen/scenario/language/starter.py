"""A scenario file to start from: a commented one, or a copy of one that ships.

Beside it goes the schema that its first line names, from which editors complete and check it.
"""

import os
import re
from importlib import resources
from pathlib import Path

import yaml

from bridgegen.base.errors import InputError, StorageError, UnknownNameError
from bridgegen.scenario.language.json_schema import FILE, refuse_other_schema, write_schema
from bridgegen.scenario.language.narrowed import narrow
from bridgegen.scenario.language.reader import DSL, document_of, names, pack_names, shipped_text
from bridgegen.scenario.language.sentence import read_sentence

_WORD = re.compile(r"[A-Za-z][A-Za-z0-9_-]{0,63}")


def start_scenario(
    name: str, *, like: str | None = None, says: str | None = None, folder: Path | None = None
) -> Path:
    """Write ``NAME.yaml``, a valid scenario that its reader can make their own, and its schema.

    Args:
        name: of the scenario and its file.
        like: a scenario of the catalogue or of a pack to copy, or an OpenSCENARIO DSL file to
            write as YAML; by default a small one that explains itself.
        says: a sentence, of which the scenario is made (of the catalogue's ``like``, or of the one
            that it says); what was understood stands at the head of the file.
        folder: where to; by default here.

    Returns:
        The file.

    Raises:
        InputError: the name is no word, or the sentence is not understood or not possible.
        UnknownNameError: no such scenario.
        FileFormatError: no such ``.osc`` file, or not one; a ScenarioError or UnsupportedError
            says what is wrong with it.
        StorageError: there is such a file already, or what is called like the schema and is none,
            or it cannot be written.
    """
    if not _WORD.fullmatch(name):
        raise InputError(
            f"a scenario's name is a word of letters, digits, '_' and '-', 64 at most, got '{name}'"
        )
    if name in names():
        raise InputError(f"'{name}' ships with BridgeGen; choose another name")
    if says is not None:
        text = narrow(read_sentence(says, like), name)
    elif like is None:
        text = (
            resources.files("bridgegen.scenario.language")
            .joinpath("starter.yaml")
            .read_text("utf-8")
        )
        text = text.replace("NAME", name)
    elif like in (known := (*names(), *pack_names())):
        text = shipped_text(like).decode("utf-8")
        text = re.sub(r"^scenario: .*$", f"scenario: {name}", text, count=1, flags=re.M)
    elif Path(like).suffix.lower() == DSL:
        document, _ = document_of(like)
        notes = "".join(f"# {' '.join(note.split())}\n" for note in document.notes)
        data = {**document.data, "scenario": name} if isinstance(document.data, dict) else {}
        text = notes + yaml.safe_dump(data, sort_keys=False, allow_unicode=True, width=100)
    else:
        raise UnknownNameError("scenario", like, known)
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
