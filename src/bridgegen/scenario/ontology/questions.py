"""Questions that people ask of a scenario's individuals, in SPARQL.

Each ``questions/NAME.rq`` is one: its first line states the question in words. Queries see the
individuals together with ``bridgegen.owl``, so that they can follow subclasses and print labels.
"""

import json
import re
import subprocess
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from pathlib import Path

import pyoxigraph as ox

from bridgegen.base.errors import FileFormatError, InputError, UnknownNameError
from bridgegen.scenario.ontology.files import load
from bridgegen.scenario.ontology.graph import Individuals, as_number
from bridgegen.scenario.ontology.mirror import mirrored
from bridgegen.scenario.ontology.vocabulary import BG, INTEGER, PREFIXES, RDF, local_name, tbox

MAX_ROWS = 10_000
MAX_SECONDS = 10.0
MAX_MEMORY = 2 * 2**30
"""Bounds of a user's own query: rows of the answer, time [s], memory [bytes] (on Unix)."""
MAX_QUERY = 100_000
"""Largest length of a user's own query [bytes]."""

Cell = str | int | float | None


@dataclass(frozen=True)
class Question:
    """A question of the catalogue.

    Attributes:
        name: what it is called on the command line.
        description: what it asks, one sentence.
        query: SPARQL, a SELECT.
    """

    name: str
    description: str
    query: str


@dataclass(frozen=True)
class Answer:
    """A table.

    Attributes:
        columns: names; a unit is the name's end (``speed_m_s``).
        rows: one cell per column; None where there is nothing, an IRI as its last part.
    """

    columns: tuple[str, ...]
    rows: tuple[tuple[Cell, ...], ...]


@cache
def questions() -> Mapping[str, Question]:
    """Return the catalogue, in alphabetical order."""
    found = {}
    folder = files("bridgegen.scenario.ontology").joinpath("questions")
    for file in folder.iterdir():
        if file.name.endswith(".rq"):
            text = file.read_text(encoding="utf-8")
            name = file.name.removesuffix(".rq")
            found[name] = Question(name, text.partition("\n")[0].removeprefix("# "), text)
    return dict(sorted(found.items()))


def ask(individuals: Individuals, question: str) -> Answer:
    """Answer a question of the catalogue.

    Raises:
        UnknownNameError: there is no such question.
    """
    if question not in questions():
        raise UnknownNameError("question", question, questions())
    store = ox.Store()
    store.extend(_quads(individuals))
    found = store.query(questions()[question].query)
    assert isinstance(found, ox.QuerySolutions)
    columns = tuple(name.value for name in found.variables)
    return Answer(columns, tuple(tuple(map(_cell, row)) for row in found))


def ask_sparql(individuals: Individuals, query: str) -> Answer:
    """Answer a user's own SELECT, within bounds.

    It runs in a process of its own, on a copy of the individuals. The prefixes ``bg``, ``owl``,
    ``rdf``, ``rdfs`` and ``xsd`` are there without being declared.

    Raises:
        InputError: not a SELECT, malformed, with the word ``SERVICE`` anywhere (nothing goes to
            the network), or beyond `MAX_ROWS`, `MAX_SECONDS` or `MAX_MEMORY`.
    """
    # Wherever it stands, in a string, too, and spelled with escapes: refusing a harmless query
    # costs less than a parser of ours that overlooks one. Oxigraph would go to the network.
    if "service" in _ESCAPE.sub(_unescape, query).lower():
        raise InputError("a query may not hold the word SERVICE: nothing goes to the network")
    data = ox.serialize(_quads(individuals), format=ox.RdfFormat.N_QUADS)
    assert data is not None
    # In a process of its own, for a query cannot be interrupted in ours.
    task = {
        "data": data.decode(),
        "query": query,
        "prefixes": {**PREFIXES, "rdf": RDF},
        # One more than allowed, which tells a full answer from one that was cut.
        "rows": MAX_ROWS + 1,
        "seconds": MAX_SECONDS,
        "bytes": MAX_MEMORY,
    }
    # -P: the folder of the file must not hide the standard library's modules
    command = [sys.executable, "-P", str(Path(__file__).with_name("_query_process.py"))]
    try:
        done = subprocess.run(
            command, input=json.dumps(task).encode(), capture_output=True, timeout=MAX_SECONDS
        )
    except subprocess.TimeoutExpired:
        raise InputError(f"the query found no end within {MAX_SECONDS:g} s") from None
    if done.returncode:
        raise InputError(f"the query needs more than {MAX_MEMORY / 2**30:g} GiB, or failed")
    answer = json.loads(done.stdout)
    if "error" in answer:
        raise InputError(f"the query cannot be answered: {answer['error']}")
    if len(answer["rows"]) > MAX_ROWS:
        raise InputError(f"an answer may have {MAX_ROWS} rows at most; add a LIMIT")
    rows = (tuple(map(_parsed_cell, row)) for row in answer["rows"])
    return Answer(tuple(answer["columns"]), tuple(rows))


def ask_file(owl: Path, question: str | None = None, sparql: Path | None = None) -> Answer:
    """Answer a question about a file; without one, list the questions that there are.

    Args:
        owl: a scenario's ontology.
        question: of the catalogue.
        sparql: a file that holds a SELECT, instead.

    Raises:
        InputError: both are given, or one of them cannot be answered.
        FileFormatError: a file that cannot be read.
    """
    if question is not None and sparql is not None:
        raise InputError(f"ask either '{question}' or --sparql {sparql}, not both")
    individuals = mirrored(load(owl))
    if sparql is not None:
        return ask_sparql(individuals, _read(sparql))
    if question is not None:
        return ask(individuals, question)
    return Answer(
        ("question", "what it asks"),
        tuple((item.name, item.description) for item in questions().values()),
    )


def _read(path: Path) -> str:
    try:
        if not path.is_file():
            raise FileFormatError(f"{path}: cannot be read: no such file")
        with path.open("rb") as file:
            data = file.read(MAX_QUERY + 1)
        if len(data) > MAX_QUERY:
            raise FileFormatError(f"{path}: may have at most {MAX_QUERY} bytes")
        return data.decode("utf-8-sig")
    except OSError as error:
        raise FileFormatError(f"{path}: cannot be read: {error.strerror}") from None
    except UnicodeDecodeError:
        raise FileFormatError(f"{path}: cannot be read: not UTF-8") from None


def _quads(individuals: Individuals) -> list[ox.Quad]:
    return [*tbox().quads, *individuals.quads]


_ESCAPE = re.compile(r"\\u([0-9A-Fa-f]{4})|\\U([0-9A-Fa-f]{8})")


def _unescape(found: re.Match[str]) -> str:
    code = int(found[1] or found[2], 16)
    return chr(code) if code <= sys.maxunicode else ""


def _parsed_cell(text: str | None) -> Cell:
    """Return the cell for a term in N-Triples' spelling."""
    if text is None or text.startswith("<<"):
        return text
    (quad,) = ox.parse(f"<{BG}x> <{BG}x> {text} .".encode(), format=ox.RdfFormat.N_TRIPLES)
    return _cell(quad.object)


def _cell(term: object) -> Cell:
    if term is None:
        return None
    if not isinstance(term, ox.Literal):
        return local_name(term)
    number = as_number(term)
    if number is None:
        return term.value
    return int(term.value) if term.datatype == INTEGER else number
