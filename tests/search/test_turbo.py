import numpy as np
from tests.approval import refuses

from bridgegen.base.errors import InputError
from bridgegen.search.algorithms import Problem, Results
from bridgegen.search.algorithms.turbo import TuRBO


def told(search: TuRBO, value: float, critical: bool = False) -> np.ndarray:
    """Give all rows of a batch one objective."""
    U = search.ask()
    plain = Results.of_F(np.full((len(U), 1), value))
    flags = np.full(len(U), critical)
    search.tell(U, Results(plain.F, plain.ok, flags, plain.metrics, plain.cause))
    return U


def length(search: TuRBO) -> float:
    (region,) = search._regions
    return region.length


def test_a_region_doubles_after_successes_and_halves_after_failures():
    search = TuRBO(Problem.unnamed(3), 0, regions=1, length=0.4, successes=2, failures=10)
    told(search, 0.0)
    assert length(search) == 0.4
    told(search, -1.0)
    told(search, -2.0)
    assert length(search) == 0.8
    told(search, -2.001)  # less than a thousandth better
    assert length(search) == 0.4
    told(search, -3.0)
    told(search, 0.0)
    assert length(search) == 0.2


def test_rows_lie_in_a_box_around_the_best_one():
    search = TuRBO(Problem.unnamed(5), 0, regions=1, length=0.05)
    U = search.ask()
    search.tell(U, Results.of_F(((U - 0.5) ** 2).sum(axis=1, keepdims=True)))
    best = U[((U - 0.5) ** 2).sum(axis=1).argmin()]
    sides = np.ptp(np.vstack([search.ask(), best]), axis=0)
    assert np.exp(np.log(sides).mean()) <= 0.05 + 1e-12  # they stretch at constant volume


def test_a_region_that_shrank_to_a_point_begins_elsewhere_away_from_what_is_critical():
    search = TuRBO(
        Problem.unnamed(3), 0, regions=1, initial=8, length=0.2, shortest=0.15, failures=1,
        avoid=0.2,
    )  # fmt: skip
    known = [told(search, 0.0), told(search, 0.0, critical=True)]
    fresh = [told(search, 0.0), told(search, 1.0)]
    assert len(fresh[0]) == 8
    for rows in fresh:
        off = np.sqrt(((rows[:, None] - known[1]) ** 2).mean(axis=2)).min(axis=1)
        assert off.min() >= 0.1  # 0.2 from distinct ones, which are at most 0.2 from the others


def test_several_regions_share_a_batch():
    search = TuRBO(Problem.unnamed(2), 0, regions=4, initial=5, batch=12)
    U = search.ask()
    assert len(U) == 20
    search.tell(U, Results.of_F(U[:, :1]))
    assert len(search.ask()) == 12


def test_a_region_that_begins_too_short_is_refused():
    with refuses(InputError, "0.3", "0.1"):
        TuRBO(Problem.unnamed(2), 0, length=0.1, shortest=0.3)
