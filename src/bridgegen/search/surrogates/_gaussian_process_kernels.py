"""Linear algebra and covariances of a Gaussian process.

NumPy's and SciPy's products and factorisations differ in their last bits with the number of BLAS
threads; these do not.
"""

import math

import numpy as np

from bridgegen.base import _elementary_kernels as elementary
from bridgegen.base.arrays import Float
from bridgegen.base.compiled import kernel

ROOT5 = math.sqrt(5.0)


@kernel
def product(A: Float, B: Float) -> Float:
    """Return A B, ``(n, k)`` and ``(k, m)`` → ``(n, m)``."""
    n, m = A.shape[0], B.shape[1]
    C = np.zeros((n, m))
    for i in range(n):
        # This order of loops adds in one order, whatever the number of threads: a BLAS would give
        # other last bits on a loaded machine.
        for k in range(A.shape[1]):
            a = A[i, k]
            for j in range(m):
                C[i, j] += a * B[k, j]
    return C


@kernel
def covariance(A: Float, B: Float, variance: float) -> Float:
    """Return the Matérn 5/2 covariances of points in units of the lengths, ``(n, m)``."""
    n, m, d = A.shape[0], B.shape[0], A.shape[1]
    K = np.empty((n, m))
    for i in range(n):
        for j in range(m):
            square = 0.0
            for c in range(d):
                step = A[i, c] - B[j, c]
                square += step * step
            r = ROOT5 * np.sqrt(square)
            K[i, j] = variance * (1.0 + r + r * r / 3.0) * elementary.exp(-r)
    return K


@kernel
def factorise(A: Float) -> bool:
    """Turn a symmetric matrix into its upper Cholesky factor R, A = Rᵀ R, in place.

    Only the upper triangle is read and written. Returns False where A is not positive definite.
    """
    n = A.shape[0]
    for k in range(n):
        pivot = A[k, k]
        if not pivot > 0.0:
            return False
        root = np.sqrt(pivot)
        for j in range(k, n):
            A[k, j] /= root
        for i in range(k + 1, n):
            a = A[k, i]
            for j in range(i, n):
                A[i, j] -= a * A[k, j]
    return True


@kernel
def solve_transposed(R: Float, B: Float) -> None:
    """Turn B, ``(n, m)``, into R⁻ᵀ B in place; R is an upper triangle."""
    n, m = B.shape
    for i in range(n):
        for j in range(m):
            B[i, j] /= R[i, i]
        for k in range(i + 1, n):
            a = R[i, k]
            for j in range(m):
                B[k, j] -= a * B[i, j]


@kernel
def solve(R: Float, B: Float) -> None:
    """Turn B, ``(n, m)``, into R⁻¹ B in place; R is an upper triangle."""
    n, m = B.shape
    for back in range(n):
        i = n - 1 - back
        for k in range(i + 1, n):
            a = R[i, k]
            for j in range(m):
                B[i, j] -= a * B[k, j]
        for j in range(m):
            B[i, j] /= R[i, i]


@kernel
def inverse(R: Float) -> Float:
    """Return the inverse of Rᵀ R, ``(n, n)``, of which only the upper triangle is filled."""
    n = R.shape[0]
    # W = R⁻¹, an upper triangle, row by row from the last.
    W = np.zeros((n, n))
    for back in range(n):
        i = n - 1 - back
        for k in range(i + 1, n):
            a = R[i, k]
            for j in range(k, n):
                W[i, j] -= a * W[k, j]
        W[i, i] = 1.0
        for j in range(i, n):
            W[i, j] /= R[i, i]
    # W Wᵀ by the columns of W, which are rows of its transpose.
    V = W.T.copy()
    result = np.zeros((n, n))
    for k in range(n):
        for i in range(k + 1):
            a = V[k, i]
            for j in range(i, k + 1):
                result[i, j] += a * V[k, j]
    return result


@kernel
def likelihood_gradient(X: Float, K: Float, G: Float, alpha: Float, variance: float) -> Float:
    """Return the gradient of the log marginal likelihood by the logarithms of the parameters.

    Args:
        X: ``(n, d)`` points in units of the lengths.
        K: ``(n, n)`` their covariances, without noise.
        G: ``(n, n)`` the inverse of the covariances with noise, its upper triangle.
        alpha: ``(n,)`` that inverse times the values.
        variance: of the process.

    Returns:
        ``(d + 2,)``: by each length, the variance of the process, that of the noise over the
        noise; the caller multiplies the last by it.
    """
    n, d = X.shape
    gradient = np.zeros(d + 2)
    for i in range(n):
        for j in range(i, n):
            weight = alpha[i] * alpha[j] - G[i, j]
            if i == j:
                gradient[d] += 0.5 * weight * K[i, i]
                gradient[d + 1] += 0.5 * weight
                continue
            gradient[d] += weight * K[i, j]
            square = 0.0
            for c in range(d):
                step = X[i, c] - X[j, c]
                square += step * step
            r = ROOT5 * np.sqrt(square)
            slope = weight * variance * (5.0 / 3.0) * (1.0 + r) * elementary.exp(-r)
            for c in range(d):
                step = X[i, c] - X[j, c]
                gradient[c] += slope * step * step
    return gradient
