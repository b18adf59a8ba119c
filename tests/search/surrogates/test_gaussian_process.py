import numpy as np
import pytest
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import ConstantKernel, Matern

from bridgegen.search.surrogates import _gaussian_process_kernels as kernels
from bridgegen.search.surrogates.gaussian_process import (
    GaussianProcess,
    Parameters,
    _density,
    learnt,
    prior,
)


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(0)


def valley(X: np.ndarray) -> np.ndarray:
    """Depends on the first two columns alone."""
    return np.sin(5.0 * X[:, 0]) + 2.0 * (X[:, 1] - 0.4) ** 2


def of_scikit_learn(parameters: Parameters, X: np.ndarray, y: np.ndarray):
    kernel = ConstantKernel(parameters.variance) * Matern(parameters.lengths, nu=2.5)
    theirs = GaussianProcessRegressor(kernel, alpha=parameters.noise, optimizer=None)
    return theirs.fit(X, y)


@pytest.mark.parametrize("n", [1, 2, 17])
def test_factors_and_solutions_are_those_of_numpy(rng, n: int):
    A = rng.random((n, n + 3))
    A = A @ A.T + 0.1 * np.eye(n)
    R = A.copy()
    assert kernels.factorise(R)
    np.testing.assert_allclose(np.triu(R), np.linalg.cholesky(A).T, rtol=1e-9)
    np.testing.assert_allclose(np.triu(kernels.inverse(R)), np.triu(np.linalg.inv(A)), atol=1e-7)
    B = rng.random((n, 4))
    X = B.copy()
    kernels.solve_transposed(R, X)
    kernels.solve(R, X)
    np.testing.assert_allclose(A @ X, B, rtol=1e-7)
    np.testing.assert_allclose(kernels.product(A, B), A @ B, rtol=1e-12)


def test_a_matrix_that_is_not_positive_definite_is_refused():
    assert not kernels.factorise(np.array([[1.0, 2.0], [2.0, 1.0]]))


def test_the_posterior_is_that_of_scikit_learn(rng):
    X, there = rng.random((60, 3)), rng.random((40, 3))
    y = valley(X)
    model = GaussianProcess(X, y)
    mean, deviation = model.predict(there)
    theirs = of_scikit_learn(model.parameters, X, y - y.mean())
    their_mean, their_deviation = theirs.predict(there, return_std=True)
    np.testing.assert_allclose(mean - y.mean(), their_mean, atol=1e-7)
    np.testing.assert_allclose(deviation, their_deviation, atol=1e-6)


def test_the_density_is_likelihood_times_prior(rng):
    X = rng.random((30, 3))
    y = valley(X) - valley(X).mean()
    logs = np.log([0.3, 0.7, 2.0, 1.5, 0.02])
    mean, spread = prior(3)
    theirs = of_scikit_learn(Parameters(logs), X, y).log_marginal_likelihood_value_
    theirs += 15.0 * np.log(2.0 * np.pi) - 0.5 * np.sum(((logs - mean) / spread) ** 2)
    assert _density(X, y, logs)[0] == pytest.approx(theirs)


def test_the_gradient_is_that_of_differences(rng):
    X = rng.random((30, 3))
    y = valley(X) - valley(X).mean()
    logs = np.log([0.3, 0.7, 2.0, 1.5, 0.02])
    gradient = _density(X, y, logs)[1]
    for k, step in enumerate(1e-5 * np.eye(5)):
        by = (_density(X, y, logs + step)[0] - _density(X, y, logs - step)[0]) / 2e-5
        assert gradient[k] == pytest.approx(by, rel=1e-5, abs=1e-6)


def test_learning_raises_the_density_and_tells_which_columns_matter(rng):
    X = rng.random((100, 4))
    y = valley(X) - valley(X).mean()
    found = learnt(X, y, None)
    assert _density(X, y, found.logs)[0] > _density(X, y, Parameters.usual(4).logs)[0] + 20.0
    assert found.lengths[2:].min() > 2.0 * found.lengths[:2].max()
    again = learnt(X, y, found)
    assert _density(X, y, again.logs)[0] >= _density(X, y, found.logs)[0]


def test_sample_paths_have_mean_and_deviation_of_the_posterior(rng):
    X, there = rng.random((30, 2)), rng.random((8, 2))
    y = valley(X) + 0.3 * rng.standard_normal(30)
    model = GaussianProcess(X, y)
    mean, deviation = model.predict(there)
    paths = np.concatenate([model.sample(there, 200, rng) for _ in range(20)])
    error = deviation / np.sqrt(len(paths))
    assert (np.abs(paths.mean(axis=0) - mean) < 6.0 * error + 0.02).all()
    np.testing.assert_allclose(paths.std(axis=0), deviation, rtol=0.15, atol=0.01)


@pytest.mark.parametrize("values", [np.zeros(5), np.full(5, 3.0)])
def test_constant_values_are_expected_everywhere(rng, values):
    model = GaussianProcess(rng.random((5, 2)), values)
    mean, deviation = model.predict(rng.random((3, 2)))
    np.testing.assert_allclose(mean, values[0])
    assert (deviation > 0.0).all()
    assert np.isfinite(model.sample(rng.random((3, 2)), 2, rng)).all()


def test_equal_rows_with_other_values_do_no_harm(rng):
    X = np.repeat(rng.random((1, 3)), 20, axis=0)
    model = GaussianProcess(X, rng.standard_normal(20))
    assert np.isfinite(model.predict(X)[0]).all()
