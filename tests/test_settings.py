"""Settings of the whole suite hold (`conftest.py`)."""

from collections import Counter
from itertools import groupby
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import scipy.linalg
from threadpoolctl import threadpool_info


def test_linear_algebra_has_one_thread():
    """With a thread for each core, the risk estimators' tests took seven times as long."""
    scipy.linalg.cholesky(np.eye(2))
    libraries = [one for one in threadpool_info() if one["user_api"] == "blas"]
    assert len(libraries) >= 1
    assert {one["num_threads"] for one in libraries} == {1}


def test_processes_take_the_longest_files_first(request):
    """Then those with the most tests; a file's tests stay together, in their order."""
    here = Path(__file__).parent
    path = str(here / "conftest.py")
    (settings,) = (
        one
        for one in request.config.pluginmanager.get_plugins()
        if getattr(one, "__file__", None) == path
    )
    longest = [here / name for name in settings.LONGEST]
    assert all(file.is_file() for file in longest)
    few, many = here / "test_few.py", here / "test_many.py"
    files = [few, longest[1], many, longest[0], longest[1], many, many]
    items = [SimpleNamespace(path=file, k=k) for k, file in enumerate(sorted(files))]
    settings.sort_by_file(items)
    assert [file for file, _ in groupby(item.path for item in items)] == [*longest[:2], many, few]
    for file in Counter(files):
        order = [item.k for item in items if item.path == file]
        assert order == sorted(order)
