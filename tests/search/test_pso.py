import numpy as np
import pytest
from tests.approval import refuses

from bridgegen.search.algorithms import Problem, Results
from bridgegen.search.algorithms.evolved import PSO
from bridgegen.search.algorithms.sampling import Random


def search(algorithm, function, n_batches=25, n_var=10):
    """Return the rows of a whole run, (n_batches, 40, n_var), and their objectives."""
    rows, values = [], []
    for _ in range(n_batches):
        U = algorithm.ask()
        F = function(U)
        algorithm.tell(U, Results.of_F(F[:, None]))
        rows.append(U)
        values.append(F)
    return np.array(rows), np.array(values)


def sphere(U):
    return ((U - 0.7) ** 2).sum(axis=1)


def conflict(U):
    """A wall of harmless rows around a small region: what d_min looks like."""
    return np.maximum(np.abs(U[:, :3] - 0.6).max(axis=1) - 0.1, 0.0) - 0.05 * U[:, 3]


@pytest.mark.parametrize("seed", range(5))
def test_it_beats_random_on_a_sphere(seed):
    _, pso = search(PSO(Problem.unnamed(10), seed), sphere)
    _, random = search(Random(Problem.unnamed(10), seed), sphere)
    assert pso.min() < 0.05 * random.min()
    assert np.median(pso[-1]) < 0.1 * np.median(random[-1])


def test_it_finds_far_more_critical_rows_than_random():
    share = {}
    for algorithm in (PSO, Random):
        runs = [search(algorithm(Problem.unnamed(10), seed), conflict)[1] for seed in range(10)]
        share[algorithm] = [float((F <= 0.0).mean()) for F in runs]
    assert max(share[Random]) < 0.05  # about (0.2 + 2·0.025)³ of the cube is critical
    assert min(share[PSO]) > 0.3


def test_the_swarm_does_not_collapse():
    rows, _ = search(PSO(Problem.unnamed(10), 0), conflict)
    last = rows[-5:].reshape(-1, 10)
    assert len(np.unique(last, axis=0)) > 0.95 * len(last)
    # Parameters without influence stay spread: many different critical scenarios, not one.
    assert (last[:, 4:].std(axis=0) > 0.03).all()


def test_a_converged_swarm_starts_afresh():
    """A long run goes on to find rows that matter, not one row again and again."""
    rows, values = search(PSO(Problem.unnamed(3), 0), sphere, n_batches=600)
    spread = rows.std(axis=1).mean(axis=1)
    starts = np.flatnonzero(spread > 0.25)  # a Latin hypercube's is 0.289
    assert spread[0] > 0.25
    assert 2 <= len(starts) <= 20
    assert len(np.unique(rows.reshape(-1, 3), axis=0)) > 0.95 * 600 * 40
    assert len(np.unique(rows[starts].reshape(-1, 3), axis=0)) == 40 * len(starts)
    assert values.min() < 1e-4
    never, _ = search(PSO(Problem.unnamed(3), 0, restart_within=0.0), sphere, n_batches=600)
    assert (never.std(axis=1).mean(axis=1)[100:] < 0.1).all()


def test_the_papers_run_is_too_short_to_start_afresh():
    for seed in range(5):
        pso = PSO(Problem.unnamed(10), seed)
        search(pso, sphere)
        assert pso._search.starts == 1


def test_the_first_step_is_towards_the_best_row_only():
    """From rest, and each at its own best, V = c2·r2·(S − X), cut at max_velocity."""
    pso = PSO(Problem.unnamed(4), 3, mutate_best=False)
    first = pso.ask()
    F = sphere(first)
    pso.tell(first, Results.of_F(F[:, None]))
    second = pso.ask()
    pull = first[F.argmin()] - first
    step = second - first
    assert (step * pull >= 0).all()
    assert (np.abs(step) <= np.minimum(1.5 * np.abs(pull), 0.2) + 1e-15).all()
    assert (step[F.argmin()] == 0).all()


def test_steps_are_bounded_by_max_velocity():
    rows, _ = search(PSO(Problem.unnamed(4), 3, mutate_best=False, max_velocity=0.03), sphere)
    assert np.abs(np.diff(rows, axis=0)).max() <= 0.03 + 1e-15


def test_the_first_generation_is_space_filling():
    """A Latin hypercube: one row in each fortieth of every axis."""
    U = PSO(Problem.unnamed(5), 0).ask()
    cells = np.sort(np.floor(U * 40).astype(int), axis=0)
    assert (cells == np.arange(40)[:, None]).all()


def test_a_failed_row_is_no_particles_best_for_long():
    """Its penalty rises with the worst value told, so any finite row replaces it."""
    pso = PSO(Problem.unnamed(1), 0, mutate_best=False)
    for generation in range(6):
        U = pso.ask()
        # All fail but one at first; then every value is worse than the penalty of that time.
        ok = np.arange(40) == 0 if generation == 0 else np.ones(40, bool)
        F = np.full((40, 1), float(generation) * 1e6)
        F[0] = 0.0
        pso.tell(U, Results.of_F(F, ok))
        best = pso._search.algorithm.pop.get("F")[:, 0]
        assert np.isfinite(best).all()
        assert best[0] == 0.0
        if generation == 1:
            assert (best[1:] == 1e6).all()
    assert (best[1:] == 1e6).all()


def test_only_what_was_asked_can_be_told():
    pso = PSO(Problem.unnamed(2), 0)
    U = pso.ask()
    with refuses(ValueError):
        pso.tell(U[::-1], Results.of_F(np.zeros((40, 1))))
    with refuses(ValueError):
        pso.tell(U[:20], Results.of_F(np.zeros((20, 1))))  # particles move together
    pso.tell(U, Results.of_F(np.zeros((40, 1))))
    with refuses(ValueError):
        pso.tell(U, Results.of_F(np.zeros((40, 1))))


def test_pymoos_hint_is_not_printed_and_its_switch_restored(monkeypatch, capfd):
    from pymoo import functions
    from pymoo.config import Config

    monkeypatch.setattr(functions, "is_compiled", lambda: False)
    monkeypatch.setattr(functions.FunctionLoader, "_FunctionLoader__instance", None)
    PSO(Problem.unnamed(2), 0)
    assert capfd.readouterr().out == ""
    assert Config.warnings["not_compiled"] is True
