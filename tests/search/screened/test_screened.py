"""A search in two simulators, whose results are functions of the unit cube."""

import numpy as np
import pytest
from scipy.stats import mannwhitneyu
from tests.approval import approve

from bridgegen.assess.cause import Cause
from bridgegen.search.algorithms import ALGORITHMS, Problem, Results
from bridgegen.search.screened import Screened
from bridgegen.search.screened.screened import CHECKS, LEAST

N_VAR = 6
PROBLEM = Problem.unnamed(N_VAR)


def bump(centre, width=0.16):
    """Return objectives that fall towards a point; rows near to it are critical."""

    def results(U):
        away = np.sqrt(((U - centre) ** 2).mean(axis=1))
        F, ok = away[:, np.newaxis], np.ones(len(U), np.bool_)
        none = np.full(len(U), Cause.NONE, np.int8)
        return Results(F, ok, away < width, np.empty((len(U), 0)), none)

    return results


HERE = bump(np.full(N_VAR, 0.35))


class Counted:
    """A screen that counts, and refuses to exceed its budget."""

    name = "cheap"

    def __init__(self, results, budget):
        self._results, self.budget, self._known = results, budget, set()

    @property
    def evaluations(self):
        return len(self._known)

    def evaluate(self, U):
        new = np.zeros(len(U), np.bool_)
        for k, row in enumerate(U):
            new[k] = row.tobytes() not in self._known
            self._known.add(row.tobytes())
        assert self.evaluations <= self.budget
        return self._results(U), new


def search(screen, simulator, budget=80, *, algorithm="es", seed=0, batch=8, each=20, alone=True):
    """Run a search; return its rows, whether they are critical, the search and what it said."""
    kind, said = ALGORITHMS[algorithm], []
    counted = Counted(screen, each * budget)
    screened = Screened(
        kind(PROBLEM, seed), (lambda: kind(PROBLEM, seed)) if alone else None, counted, PROBLEM,
        simulator="dear", seed=seed, budget=budget, batch=batch, say=said.append,
    )  # fmt: skip
    rows, critical = [], []
    while len(rows) < budget and len(U := screened.ask()):
        found = simulator(U)
        screened.tell(U, found)
        rows.extend(U)
        critical.extend(found.critical)
    return np.array(rows), np.array(critical), screened, said


def unscreened(simulator, budget, seed, algorithm="es"):
    """Return whether each row of a search without a screen is critical."""
    one, critical = ALGORITHMS[algorithm](PROBLEM, seed), []
    while len(critical) < budget:
        U = one.ask()
        found = simulator(U)
        one.tell(U, found)
        critical.extend(found.critical)
    return np.array(critical[:budget])


def first(critical):
    return int(np.argmax(critical)) + 1 if critical.any() else np.inf


def test_a_failure_is_found_earlier_though_the_screen_is_biased():
    dear = bump(np.full(N_VAR, 0.45))
    seeds = range(6)
    with_screen = [first(search(HERE, dear, seed=seed)[1]) for seed in seeds]
    without = [first(unscreened(dear, 400, seed)) for seed in seeds]
    assert max(with_screen) < min(without)  # a chance of 1 in 924 if they were alike


def test_the_bias_is_learnt():
    """Half of what the screen calls critical is not; later it proposes less of that."""

    def half(U):
        found = HERE(U)
        wrong = U[:, 0] < 0.35
        F = np.where(wrong[:, np.newaxis], 0.5, found.F)
        return Results(F, found.ok, found.critical & ~wrong, found.metrics, found.cause)

    early = late = 0
    for seed in range(4):
        told = search(HERE, half, 160, seed=seed)[2].agreement()
        early, late = early + told.false_early, late + told.false_late
        assert told.place is None or told.place.parameter == "x0"
    assert late < 0.7 * early


@pytest.mark.parametrize("algorithm", ["es", "random", "nsga2-dt", "cma-es"])
@pytest.mark.parametrize("batch", [1, 7])
def test_the_rows_do_not_depend_on_anything_else(algorithm, batch):
    dear = bump(np.full(N_VAR, 0.4))
    one, again = (search(HERE, dear, 40, algorithm=algorithm, batch=batch) for _ in range(2))
    assert one[0].tobytes() == again[0].tobytes()
    assert one[2].notes() == again[2].notes()
    assert len(one[0]) == 40
    assert len(np.unique(one[0], axis=0)) == 40


@pytest.mark.parametrize(("budget", "each"), [(30, 1), (30, 2), (7, 1), (100, 20)])
def test_the_account_is_exact(budget, each):
    rows, critical, screened, _ = search(HERE, HERE, budget, each=each)
    told = screened.agreement()
    assert len(rows) == told.compared == budget
    assert told.screen_budget == each * budget
    assert 0.8 * each * budget <= told.screen_evaluations <= each * budget
    assert told.both == critical.sum()
    assert (told.screen_only, told.simulator_only) == (0, 0)
    assert told.rank_correlation == pytest.approx(1.0)


def test_one_row_in_eight_is_random():
    rows = search(HERE, HERE, 16 * CHECKS, batch=CHECKS)[0]
    away = np.sqrt(((rows - 0.35) ** 2).mean(axis=1))
    at = np.arange(len(rows)) % CHECKS == CHECKS - 1
    rng = np.random.default_rng(0)
    drawn = np.sqrt(((rng.random((1000, N_VAR)) - 0.35) ** 2).mean(axis=1))
    assert mannwhitneyu(away[at], drawn).pvalue > 0.01
    assert mannwhitneyu(away[~at], drawn).pvalue < 1e-9


def reverse(U):
    """Worst where the screen is best; critical is a place far from it."""
    found = HERE(U)
    far = bump(np.full(N_VAR, 0.8))(U)
    return Results(1.0 - found.F, found.ok, far.critical, found.metrics, found.cause)


def test_a_screen_that_disagrees_is_given_up():
    rows, _, screened, said = search(HERE, reverse, 120)
    told = screened.agreement()
    assert LEAST <= told.ended_after < LEAST + 16
    assert told.rank_correlation < 0.0
    (line,) = said
    approve(line, told.ended_after)
    assert "\n" not in line
    # From there on, it is the algorithm alone.
    alone = ALGORITHMS["es"](PROBLEM, 0)
    np.testing.assert_array_equal(rows[told.ended_after :][:6], alone.ask()[:6])


def test_a_screen_that_fails_everywhere_is_given_up_at_once():
    def fails(U):
        return Results.of_F(np.full((len(U), 1), np.nan), np.zeros(len(U), np.bool_))

    _, _, screened, said = search(fails, HERE, 60)
    assert screened.agreement().ended_after == 0
    approve(said[0], "scenario")


def test_it_is_kept_where_there_is_nothing_else():
    assert search(HERE, reverse, 60, alone=False)[2].agreement().ended_after is None


def test_failures_of_the_simulator_are_not_compared():
    def some(U):
        found, ok = HERE(U), U[:, 0] < 0.5
        F = np.where(ok[:, np.newaxis], found.F, np.nan)
        return Results(F, ok, found.critical & ok, found.metrics, found.cause)

    rows, _, screened, _ = search(HERE, some, 40)
    assert screened.agreement().compared == (rows[:, 0] < 0.5).sum() < 40


def test_a_constant_objective_ends_no_search():
    def same(U):
        found = HERE(U)
        return Results(np.zeros((len(U), 1)), found.ok, found.critical, found.metrics, found.cause)

    rows, _, screened, said = search(same, same, 60)
    assert len(rows) == 60
    assert screened.agreement().rank_correlation is None
    assert len(said) <= 1


def test_a_finite_design_is_followed_by_steps_from_its_best_rows():
    one = Problem.unnamed(1)
    grid = ALGORITHMS["grid"](one, 0)
    design = []
    while len(U := grid.ask()):
        grid.tell(U, Results.of_F(U))
        design.extend(U)
    budget = 4 * len(design)
    screened = Screened(
        ALGORITHMS["grid"](one, 0), None, Counted(lambda U: Results.of_F(U.copy()), 20 * budget),
        one, simulator="dear", seed=0, budget=budget, batch=4,
    )  # fmt: skip
    rows = []
    while len(rows) < budget and len(U := screened.ask()):
        screened.tell(U, Results.of_F(U))
        rows.extend(U)
    assert {float(row[0]) for row in design} <= {float(row[0]) for row in rows}
    assert len(rows) > len(design)
