"""Random numbers by address: (key, entity, stream, instant) always gives the same ones.

No state is kept, so a number depends on none of batch size, order, threads or what was drawn
before. A block is four words of 32 bits.

Source: Philox4x32-10 of Salmon, Moraes, Dror, Shaw, Parallel Random Numbers: As Easy as 1, 2, 3,
SC11 (2011), doi:10.1145/2063384.2063405; normal numbers by Box and Muller, Ann. Math. Stat. 29
(1958) 610.
"""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

import math

import numpy as np

from bridgegen.base import _elementary_kernels as elementary
from bridgegen.base.compiled import kernel

# Unsigned throughout: numba makes a float of what mixes signed with unsigned.
_LOW = np.uint64(0xFFFFFFFF)
_HALF = np.uint64(32)
_FACTOR_0, _FACTOR_1 = np.uint64(0xD2511F53), np.uint64(0xCD9E8D57)
_WEYL_0, _WEYL_1 = np.uint64(0x9E3779B9), np.uint64(0xBB67AE85)
_ROUNDS = 10
_TO_UNIT = 2.0**-32


@kernel
def philox(c0, c1, c2, c3, key):
    """Return the block at a counter of four 32-bit words under a 64-bit key, all uint64."""
    k0, k1 = key & _LOW, key >> _HALF
    # A block takes 8 ns, four normal numbers 57 ns more.
    for _ in range(_ROUNDS):
        a, b = _FACTOR_0 * c0, _FACTOR_1 * c2
        c0, c1, c2, c3 = (b >> _HALF) ^ c1 ^ k0, b & _LOW, (a >> _HALF) ^ c3 ^ k1, a & _LOW
        k0, k1 = (k0 + _WEYL_0) & _LOW, (k1 + _WEYL_1) & _LOW
    return c0, c1, c2, c3


@kernel
def block(key, entity, stream, instant):
    """Return the four words of an address, uint64 each; its parts are whole numbers ≥ 0."""
    return philox(np.uint64(instant), np.uint64(entity), np.uint64(stream), np.uint64(0), key)


@kernel
def unit(word):
    """Return a word as a uniform number strictly between 0 and 1."""
    # Half a step up: 0 would have no logarithm.
    return (float(word) + 0.5) * _TO_UNIT


@kernel
def normal_pair(word, other):
    """Return two independent standard normal numbers of two words."""
    radius = math.sqrt(-2.0 * elementary.log(unit(word)))
    angle = 2.0 * math.pi * unit(other)
    return radius * elementary.cos(angle), radius * elementary.sin(angle)


@kernel
def uniform(key, entity, stream, instant):
    """Return one uniform number strictly between 0 and 1."""
    return unit(block(key, entity, stream, instant)[0])


@kernel
def normal(key, entity, stream, instant):
    """Return one standard normal number."""
    word, other, _, _ = block(key, entity, stream, instant)
    return normal_pair(word, other)[0]
