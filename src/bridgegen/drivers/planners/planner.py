"""What each file of this folder says of the planner that it drives: ``PLANNER``."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Planner:
    """A planner that others wrote, and our adapter for it.

    Attributes:
        name: as given to ``--ego``.
        description: one sentence: what it is, and what of the driving is its own.
        spec: of the adapter, ``module:Class``, see `bridgegen.drivers.interface.BatchDriver`.
        requires: requirements of pip, as ``fiss-planner>=1.0,<2``, that it needs to drive.
        licence: of the planner.
        source: its publication or page.
        how_to_get: one sentence, where pip alone is not enough; else empty.
        domain: where it means to drive: words of `DOMAINS`; elsewhere it is not judged.
        variables: environment variables that must be set, to the folder of a checkout for example.
    """

    name: str
    description: str
    spec: str
    requires: tuple[str, ...]
    licence: str
    source: str
    how_to_get: str = ""
    domain: frozenset[str] = frozenset()
    variables: tuple[str, ...] = ()


DOMAINS = {
    "motorway": "carriageways of one direction, without crossing traffic",
    "road": "roads with oncoming traffic, without junctions on the way",
    "junction": "junctions, where others cross or turn",
    "oncoming": "a vehicle that drives the wrong way towards the ego",
    "vulnerable": "pedestrians and cyclists on the way or beside it",
}
"""Parts of an operational design domain, as planners state them."""
