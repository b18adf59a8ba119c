import numpy as np
import pytest
from scipy import stats

from bridgegen.drivers._random_kernels import block, normal, philox, uniform

KEY = np.uint64(0x1234_5678_9ABC_DEF0)

KNOWN_ANSWERS = [
    # Random123's kat_vectors, philox4x32 with 10 rounds: counter, key, result.
    ([0] * 4, [0] * 2, [0x6627E8D5, 0xE169C58D, 0xBC57AC4C, 0x9B00DBD8]),
    (
        [0xFFFFFFFF] * 4,
        [0xFFFFFFFF] * 2,
        [0x408F276D, 0x41C83B0E, 0xA20BC7C6, 0x6D5451FD],
    ),
    (
        [0x243F6A88, 0x85A308D3, 0x13198A2E, 0x03707344],
        [0xA4093822, 0x299F31D0],
        [0xD16CFE09, 0x94FDCCEB, 0x5001E420, 0x24126EA1],
    ),
]


@pytest.mark.parametrize(("counter", "key", "result"), KNOWN_ANSWERS)
def test_philox_gives_the_published_answers(counter, key, result):
    packed = np.uint64(key[0] | key[1] << 32)
    assert [int(word) for word in philox(*map(np.uint64, counter), packed)] == result


def test_the_interpreted_generator_is_the_compiled_one():
    interpreted = getattr(philox, "py_func", philox)  # itself where the compiler is off
    for counter, key, _ in KNOWN_ANSWERS:
        packed = np.uint64(key[0] | key[1] << 32)
        words = list(map(np.uint64, counter))
        assert interpreted(*words, packed) == philox(*words, packed)


def test_uniform_numbers_are_uniform_along_each_part_of_the_address():
    n = 20_000
    along = {
        "instant": [uniform(KEY, 1, 0, k) for k in range(n)],
        "entity": [uniform(KEY, k, 0, 7) for k in range(n)],
        "stream": [uniform(KEY, 1, k, 7) for k in range(n)],
        "key": [uniform(np.uint64(k), 1, 0, 7) for k in range(n)],
    }
    for part, sample in along.items():
        assert stats.kstest(sample, "uniform").pvalue > 1e-3, part
        # neighbours along the counter do not know of each other
        assert abs(np.corrcoef(sample[:-1], sample[1:])[0, 1]) < 4.0 / np.sqrt(n), part
    assert np.max(np.abs(np.corrcoef(list(along.values())) - np.eye(4))) < 4.0 / np.sqrt(n)


def test_normal_numbers_are_standard_normal():
    sample = [normal(KEY, 3, 2, k) for k in range(20_000)]
    assert stats.kstest(sample, "norm").pvalue > 1e-3


def test_the_words_of_a_block_are_independent():
    words = np.array([block(KEY, 1, 0, k) for k in range(20_000)], dtype=np.float64)
    assert np.max(np.abs(np.corrcoef(words.T) - np.eye(4))) < 4.0 / np.sqrt(len(words))


def test_parts_of_an_address_are_not_confused():
    found = {
        uniform(KEY, entity, stream, instant)
        for entity in range(8)
        for stream in range(8)
        for instant in range(8)
    }
    assert len(found) == 8**3
