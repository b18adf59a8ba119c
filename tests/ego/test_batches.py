import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from tests.approval import refuses

from bridgegen.base.errors import InputError
from bridgegen.drivers.batches import FixedBatch, blocks

N = 150  # two blocks and a part of a third


def layers(dtype, width):
    """Two layers in NumPy, of 89 inputs and two outputs."""
    rng = np.random.default_rng(width)
    first, last = (rng.normal(size=size).astype(dtype) for size in ((89, width), (width, 2)))
    return lambda seen: np.tanh(np.tanh(seen @ first) @ last)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("width", [17, 64, 256])
def test_a_rows_bits_depend_on_that_row_alone(dtype, width):
    network = FixedBatch(layers(dtype, width))
    seen = np.random.default_rng(0).normal(size=(N, 89)).astype(dtype)
    whole = network(seen)
    np.testing.assert_allclose(whole, layers(dtype, width)(seen), rtol=0, atol=1e-4)
    order = np.random.default_rng(1).permutation(N)
    np.testing.assert_array_equal(network(seen[order]), whole[order])
    for n in (1, 2, 3, 7, 63, 64, 65):
        np.testing.assert_array_equal(network(seen[-n:]), whole[-n:])
    np.testing.assert_array_equal(network(np.repeat(seen[9:10], N, axis=0))[77], whole[9])
    shifted = np.empty(N * 89 + 1, dtype)[1:].reshape(N, 89)  # elsewhere in memory
    shifted[...] = seen
    np.testing.assert_array_equal(network(shifted), whole)


TORCH = """
import numpy as np, torch
from bridgegen.drivers.batches import FixedBatch
torch.set_num_threads(1)
for dtype in (torch.float32, torch.float64):
    for width in (8, 17, 64, 256):
        torch.manual_seed(0)
        net = torch.nn.Sequential(
            torch.nn.Linear(89, width), torch.nn.Tanh(), torch.nn.Linear(width, width),
            torch.nn.ELU(), torch.nn.LayerNorm(width), torch.nn.Linear(width, 2),
        ).to(dtype)
        network = FixedBatch(lambda seen: net(torch.from_numpy(seen)).detach())
        seen = torch.randn(150, 89, dtype=dtype).numpy()
        whole, order = network(seen), np.random.default_rng(1).permutation(150)
        assert np.array_equal(network(seen[order]), whole[order]), (dtype, width)
        for n in (1, 2, 7, 64, 65):
            assert np.array_equal(network(seen[-n:]), whole[-n:]), (dtype, width, n)
"""


def test_a_rows_bits_depend_on_that_row_alone_in_pytorch():
    # A process of its own: MKL reads how it shall round when it is first used.
    subprocess.run([sys.executable, "-c", TORCH], check=True, timeout=100)


@given(
    arrays(np.int16, st.tuples(st.integers(0, 200), st.integers(1, 3))), st.sampled_from([1, 64])
)
def test_a_function_of_rows_is_what_it_was(seen, size):
    def both(one, other):
        assert one.shape[0] == other.shape[0] == size
        return one.astype(np.int64) * 2, other.sum(axis=1)

    twice, total = FixedBatch(both, size=size)(seen, seen)
    np.testing.assert_array_equal(twice, seen.astype(np.int64) * 2)
    np.testing.assert_array_equal(total, seen.sum(axis=1))


@pytest.mark.parametrize("dtype", [np.float32, np.float64, np.int8])
def test_blocks_are_copies_that_are_aligned_and_padded_with_the_last_row(dtype):
    seen = np.arange(140, dtype=dtype).reshape(70, 2)
    found = list(blocks(seen))
    assert [(rows.start, rows.stop) for rows, _ in found] == [(0, 64), (64, 70)]
    for _, (block,) in found:
        assert block.shape == (64, 2)
        assert block.ctypes.data % 64 == 0
        assert not np.shares_memory(block, seen)
    assert (found[1][1][0][5:] == seen[-1]).all()


def test_memory_that_the_network_uses_again_is_no_matter():
    memory = np.empty((64, 1))

    def network(seen):
        memory[...] = seen
        return memory

    seen = np.arange(100.0)[:, None]
    np.testing.assert_array_equal(FixedBatch(network)(seen), seen)


@pytest.mark.parametrize("size", [0, -64, 2, 63, 96])
def test_a_size_that_cuts_vectors_is_refused(size):
    with refuses(InputError, "64", size):
        FixedBatch(abs, size=size)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ((), "of none"),
        ((np.zeros(3), np.zeros(4)), r"\(3,\), \(4,\)"),
        ((1.0,), r"the shapes \(\)"),
    ],
)
def test_arrays_of_other_rows_are_refused(given, message):
    with pytest.raises(InputError, match=message):
        FixedBatch(abs)(*given)


def test_a_network_that_answers_other_rows_is_refused():
    with refuses(InputError, "64"):
        FixedBatch(lambda seen: seen.mean(axis=0))(np.zeros((5, 2)))
