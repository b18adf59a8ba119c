"""Failure modes: harmful rows that fail in the same way, by interpretable keys, then by distance.

Rows of one mode agree in conflict (contact, near miss or violation), conflict type, responsibility,
cause, the other participant's kind, and place on the route. The rule that decides on the
responsibility may differ: it names a breach, and does not change what happens. Such a group is
divided further only where its rows form clusters in the space of parameters that are clearly apart.
"""

from collections import Counter
from collections.abc import Container, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple, TypeVar

import numpy as np

from bridgegen.assess.conflict.findings import Findings
from bridgegen.assess.conflict.types import RULES, ConflictType, Rule
from bridgegen.base.arrays import Float, Int
from bridgegen.scenario.countries import in_the_mirror

APART = 0.25
"""Least distance between clusters: root mean square over the searched parameters, 0 to 1."""

GAPS = 3.0
"""Least distance between clusters, as a multiple of the median distance of a row to the nearest
one."""

LEAST_ROWS, LEAST_SHARE = 5, 0.05
"""Least number of rows of a cluster, and least share of its group's; fewer join the nearest
cluster."""

MOST_CLUSTERED = 500
"""Largest number of rows of a group whose distances are compared; the others join the nearest of
these."""

T = TypeVar("T")


class Key(NamedTuple):
    """What the rows of a mode have in common; all are labels.

    Attributes:
        conflict: "contact", "near miss" or "violation".
        conflict_type: see `ConflictType`.
        responsible: see `Responsible`.
        partner: kind of the other participant.
        place: on the ego's route.
        cause: quick, or tested by neighbours.
    """

    conflict: str
    conflict_type: str
    responsible: str
    partner: str
    place: str
    cause: str = ""

    @property
    def way(self) -> "Key":
        """The same without its cause."""
        return self._replace(cause="")


@dataclass(frozen=True, eq=False)
class Group:
    """A failure mode before it is recorded.

    Attributes:
        key: what its rows have in common.
        rows: ``(n,)`` positions, the worst first.
        part: 0, or the number of the cluster where a key's rows are divided.
    """

    key: Key
    rows: Int
    part: int = 0


def keys_of(
    findings: Findings, kinds: Mapping[str, str], place: Sequence[str], cause: Sequence[str]
) -> list[Key]:
    """Return the key of each of N rows.

    Args:
        findings: of the rows.
        kinds: of the participants, by name.
        place: ``(N,)``.
        cause: ``(N,)``.
    """
    partner = [kinds.get(name, "") for name in findings.partner.tolist()]
    texts = (findings.conflict, findings.conflict_type, findings.responsible)
    columns = zip(*(text.tolist() for text in texts), partner, place, cause, strict=True)
    known: dict[tuple[str, ...], Key] = {}
    return [known.setdefault(column, Key(*column)) for column in columns]


def of_found(found: Container[T], failures: Sequence[T]) -> tuple[int, int] | None:
    """Return how many of some random failures are of a mode that a run found, and of how many.

    Their share is that of the critical volume which is of a known kind. By distance from what was
    found it was 0 % in most scenarios of ten parameters, however much was found.

    Args:
        found: the modes of the run's failures.
        failures: ``(n,)``, the mode of each random failure.

    Returns:
        None where n is 0.
    """
    return (sum(mode in found for mode in failures), len(failures)) if failures else None


def by_harm(harm: Float, U: Float) -> Int:
    """Return the rows, the worst first; equal ones in the order of their parameters."""
    order: Int = np.lexsort((*U.T[::-1], -harm))
    return order


def group(keys: Sequence[Key], harm: Float, U: Float) -> list[Group]:
    """Return the failure modes of N harmful rows; the one with the worst row first.

    The order of the rows does not matter.

    Args:
        keys: ``(N,)``.
        harm: ``(N,)``.
        U: ``(N, n_var)`` in [0, 1], the searched parameters.
    """
    held: dict[Key, list[int]] = {}
    for i in by_harm(harm, U).tolist():
        held.setdefault(keys[i], []).append(i)
    found = []
    for key, members in held.items():
        rows = np.array(members, dtype=np.int64)
        labels = clusters(U[rows])
        parts = [rows[labels == k] for k in range(int(labels.max(initial=0)) + 1)]
        found += [Group(key, part, k if len(parts) > 1 else 0) for k, part in enumerate(parts, 1)]
    rank = by_harm(harm[[item.rows[0] for item in found]], U[[item.rows[0] for item in found]])
    return [found[k] for k in rank.tolist()]


def rekeyed(groups: Sequence[Group], keys: Sequence[Key], harm: Float, U: Float) -> list[Group]:
    """Return groups under other keys; groups with equal keys and parts are merged.

    Args:
        groups: disjoint.
        keys: one for each group.
        harm: of all rows.
        U: likewise.
    """
    held: dict[tuple[Key, int], list[Int]] = {}
    for item, key in zip(groups, keys, strict=True):
        held.setdefault((key, item.part), []).append(item.rows)
    found = []
    for (key, part), rows in held.items():
        joined = np.concatenate(rows)
        found.append(Group(key, joined[by_harm(harm[joined], U[joined])], part))
    return found


def clusters(U: Float) -> Int:
    """Return the cluster of each row, ``(n,)`` from 0 on, that of the first row first.

    Rows are in one cluster if a chain of short distances joins them (single linkage).

    Args:
        U: ``(n, n_var)``, the worst first.
    """
    array = np.zeros(len(U), dtype=np.int64)
    if len(U) < 2 * LEAST_ROWS or not U.shape[1]:
        return array
    from scipy.cluster.hierarchy import fcluster, linkage
    from scipy.spatial import cKDTree

    # So that Euclid's distance is the root mean square over the parameters, whatever their number.
    scaled = U / np.sqrt(U.shape[1])
    some = scaled[:MOST_CLUSTERED]
    # k = 2: the nearest row to each is the row itself.
    distance = np.asarray(cKDTree(some).query(some, k=2)[0])
    cut = max(APART, GAPS * float(np.median(distance[:, 1])))
    labels = fcluster(linkage(some, "single"), cut, "distance").astype(np.int64)
    numbers, counts = np.unique(labels, return_counts=True)
    large = numbers[counts >= max(LEAST_ROWS, LEAST_SHARE * len(some))]
    # Clusters too small to count join others; with one left, nothing is divided.
    if len(large) < 2:
        return array
    core = np.flatnonzero(np.isin(labels, large))
    nearest = np.asarray(cKDTree(some[core]).query(scaled)[1])
    found = labels[core][nearest]
    _, first, inverse = np.unique(found, return_index=True, return_inverse=True)
    rank = np.empty(len(first), dtype=np.int64)
    # Numbered by their first row, which is the worst: scipy's numbers depend on its tree.
    rank[np.argsort(first)] = np.arange(len(first))
    return rank[inverse.reshape(-1)]


_TITLES: Mapping[ConflictType, tuple[str, str]] = {
    ConflictType.NONE: ("collides with {}", "nearly collides with {}"),
    ConflictType.REAR_END_STRIKING: ("runs into the rear of {}", "nearly runs into the rear of {}"),
    ConflictType.REAR_END_STRUCK: ("is hit in the rear by {}", "is nearly hit in the rear by {}"),
    ConflictType.CROSSING: ("hits {} that crosses", "nearly hits {} that crosses"),
    ConflictType.TURNING: ("collides with {} at a turn", "nearly collides with {} at a turn"),
    ConflictType.SIDE_SWIPE: ("side-swipes {}", "nearly side-swipes {}"),
    ConflictType.HEAD_ON: ("collides head-on with {}", "nearly collides head-on with {}"),
    ConflictType.EGO_STANDING: ("is struck standing by {}", "is nearly struck standing by {}"),
    ConflictType.VRU_BY_FRONT: ("hits {} with its front", "nearly hits {} with its front"),
    ConflictType.VRU_INTO_SIDE: ("is hit at its side by {}", "is nearly hit at its side by {}"),
    ConflictType.OBJECT: ("hits an obstacle ({})", "nearly hits an obstacle ({})"),
    ConflictType.LANE_DEPARTURE: ("", "leaves its lane"),
    ConflictType.ROAD_DEPARTURE: ("", "leaves the road"),
    ConflictType.CLOSE_PASS: ("", "passes {} too closely"),
    ConflictType.UNJUSTIFIED_BRAKING: (
        "brakes without a reason and is hit in the rear by {}",
        "brakes without a reason and forces {} to brake hard",
    ),
}
_ARTICLES = {"": "another participant", "other": "an object", "animal": "an animal"}
_RESPONSIBLE = {
    "ego": "ego responsible",
    "shared": "both responsible",
    "other": "other responsible, preventable by the ego",
    "none": "no participant responsible, preventable by the ego",
    "": "responsibility unknown",
}


def by_frequency(rules: Iterable[str]) -> tuple[tuple[str, int], ...]:
    """Return rules with their numbers, the most frequent first; equal ones by name."""
    counts = Counter(rules)
    return tuple(sorted(counts.items(), key=lambda pair: (-pair[1], pair[0])))


def title(
    key: Key, rules: Sequence[str] = (), count: str = "ego", *, left_hand: bool = False
) -> str:
    """Return a mode's key in words, without its cause.

    Args:
        key: of the mode.
        rules: labels of the rules that occur, the most frequent first; see `Rule`.
        count: whose conflicts count, "ego" or "any": with the latter the ego need not be able to
            prevent them.
        left_hand: whether traffic drives on the left; then the labels are those of that side.
    """
    if left_hand:
        return in_the_mirror(title(key, [*map(in_the_mirror, rules)], count))
    kinds = {type_.label: type_ for type_ in ConflictType}
    contact, near = _TITLES[kinds.get(key.conflict_type, ConflictType.NONE)]
    partner = _ARTICLES.get(key.partner, f"a {key.partner}")
    if (*rules[:1], key.responsible) == (Rule.EMERGENCY_VEHICLE.label, "ego"):  # a car by its kind
        partner = "an emergency vehicle"
    # A violation has the words of a near miss: nobody was hit.
    text = (contact if key.conflict == "contact" else near).format(partner)
    if key.place:
        text += f" {key.place}"
    known = {rule.label: words for rule, (words, _) in RULES.items()}
    reason = "; or ".join(known.get(name, name) for name in rules if name)
    responsible = _RESPONSIBLE.get(key.responsible, key.responsible)
    if count == "any":
        responsible = responsible.removesuffix(", preventable by the ego")
    return f"{text} ({responsible}: {reason})" if reason else f"{text} ({responsible})"


def where(U: Float, others: Float, names: Sequence[str]) -> tuple[int, float, float] | None:
    """Return the parameter that best separates a cluster from the others, and its range.

    Args:
        U: ``(n, n_var)`` of the cluster, in any units.
        others: ``(m, n_var)`` of the other clusters of the key.
        names: of the columns.

    Returns:
        Its column, least and largest value; None if there is nothing to compare.
    """
    if not len(others) or not len(names):
        return None
    # Gap over spread, which has no unit: columns may have different ones.
    spread = np.concatenate([U, others]).std(axis=0)
    gap = np.abs(np.median(U, axis=0) - np.median(others, axis=0))
    k = int(np.argmax(np.divide(gap, spread, out=np.zeros_like(gap), where=spread > 0.0)))
    return k, float(U[:, k].min()), float(U[:, k].max())


__all__ = [
    "Group",
    "Key",
    "by_frequency",
    "by_harm",
    "clusters",
    "group",
    "keys_of",
    "rekeyed",
    "title",
    "where",
]
