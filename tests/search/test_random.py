import numpy as np

from bridgegen.search.algorithms import Problem
from bridgegen.search.algorithms.sampling import Random


def test_the_stream_is_pcg64():
    """The baseline can be redrawn by anybody, without BridgeGen."""
    stream = np.random.Generator(np.random.PCG64(11))
    search = Random(Problem.unnamed(3), 11)
    assert (search.ask() == stream.random((40, 3))).all()
    assert (search.ask() == stream.random((40, 3))).all()


def test_rows_are_uniform():
    U = np.concatenate([Random(Problem.unnamed(2), seed).ask() for seed in range(100)])
    counts = np.histogram2d(*U.T, bins=4, range=[[0, 1], [0, 1]])[0]
    # χ² with 15 degrees of freedom is below 37.7 with probability 0.999.
    assert ((counts - 250) ** 2 / 250).sum() < 37.7


def test_population_is_the_batch():
    assert Random(Problem.unnamed(2), 0, population=7).ask().shape == (7, 2)
