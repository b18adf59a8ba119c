"""Settings of the whole suite hold (`conftest.py`)."""

import numpy as np
import scipy.linalg
from threadpoolctl import threadpool_info


def test_linear_algebra_has_one_thread():
    """With a thread for each core, the risk estimators' tests took seven times as long."""
    scipy.linalg.cholesky(np.eye(2))
    libraries = [one for one in threadpool_info() if one["user_api"] == "blas"]
    assert len(libraries) >= 1
    assert {one["num_threads"] for one in libraries} == {1}
