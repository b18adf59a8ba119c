"""Compiled reading of Protocol Buffers' wire format; public wrapper: ``wire``.

Source: Protocol Buffers, Encoding (protobuf.dev).
"""

import numpy as np

from bridgegen.base.arrays import Float, Int
from bridgegen.base.compiled import inlined_kernel, kernel

VARINT, FIXED64, LENGTH, FIXED32 = 0, 1, 2, 5
CUT_OFF, BAD_TAG, WRONG_TYPE = 1, 2, 3
DEEPEST = 16
"""Largest number of levels of messages in messages that a shape may have."""


@inlined_kernel
def varint(data: Int, at: int, end: int) -> tuple[int, int]:
    """Return the number at a place, as int64, and the place behind it; −1 if it is cut off."""
    value = np.int64(0)
    # Ten bytes at most, as the format allows for 64 bits: a longer run of continued bytes is no
    # number.
    for shift in range(0, 70, 7):
        if at >= end:
            return 0, -1
        byte = np.int64(data[at])
        at += 1
        value |= (byte & 127) << np.int64(shift)
        if byte < 128:
            return int(value), at
    return 0, -1


@inlined_kernel
def content(data: Int, at: int, end: int, wire: int) -> tuple[int, int]:
    """Return where a field's content begins and ends; (−1, −1) if it is cut off."""
    begin = at
    if wire == VARINT:
        _, at = varint(data, at, end)
    elif wire == FIXED64:
        at += 8
    elif wire == FIXED32:
        at += 4
    else:
        size, begin = varint(data, at, end)
        # A length of 2⁶³ or more is negative as int64, and `begin + size` could wrap; so the size
        # is compared with what is left, not the sum with the end.
        if begin < 0 or size < 0 or size > end - begin:
            return -1, -1
        at = begin + size
    if at < 0 or at > end:
        return -1, -1
    return begin, at


@kernel
def find(data: Int, begin: int, end: int, fields: Int, spans: Int) -> tuple[int, int, int]:
    """Find a message's fields that are messages or texts.

    Args:
        data: ``(n,)`` uint8.
        begin: of the message in it.
        end: of the message in it.
        fields: numbers of those wanted.
        spans: ``(m, 3)`` written: number, begin and end of each, as far as there is room.

    Returns:
        How many there are; where the message breaks the format, and how (0 for not at all).
    """
    count, at = 0, begin
    while at < end:
        tag, after = varint(data, at, end)
        if after < 0:
            return count, at, CUT_OFF
        field, wire = tag >> 3, tag & 7
        if field < 1 or field >= 2**29 or not (wire <= LENGTH or wire == FIXED32):
            return count, at, BAD_TAG
        first, last = content(data, after, end, wire)
        if first < 0:
            return count, at, CUT_OFF
        if wire == LENGTH:
            for wanted in fields:
                if field == wanted:
                    if count < len(spans):
                        spans[count, 0], spans[count, 1], spans[count, 2] = field, first, last
                    count += 1
        at = last
    return count, 0, 0


@kernel
def read_each(
    data: Int, spans: Int, step: Int, wires: Int, own: Int, numbers: Float, whole: Int
) -> tuple[int, int]:
    """Read messages of one shape.

    Args:
        data: ``(n,)`` uint8.
        spans: ``(k, 2)`` begin and end of each message.
        step: ``(nodes, fields)`` what a field of a node is: 0 nothing that is wanted, c > 0 the
            node c, −(c + 1) the column c.
        wires: of its wire type; that of a column says of which table it is.
        own: ``(nodes, 4)`` the columns that are a node's own, first and last + 1 in both tables.
        numbers: ``(k, ...)`` written: numbers; NaN where the message around them is missing.
        whole: ``(k, ...)`` written: whole numbers; −1 likewise.

    Returns:
        Where a message breaks the format, and how (0 for not at all).
    """
    ends = np.empty(DEEPEST, dtype=np.int64)
    nodes = np.empty(DEEPEST, dtype=np.int64)
    bits = np.empty(1, dtype=np.int64)
    for k in range(len(spans)):
        numbers[k, :], whole[k, :] = np.nan, -1
        at, depth = spans[k, 0], 0
        ends[0], nodes[0] = spans[k, 1], 0
        numbers[k, own[0, 0] : own[0, 1]] = 0.0
        whole[k, own[0, 2] : own[0, 3]] = 0
        while True:
            # Without recursion: depth is bounded by the shape, for only wanted fields are entered,
            # however deep a stranger's message nests.
            while depth > 0 and at >= ends[depth]:
                depth -= 1
            end, node = ends[depth], nodes[depth]
            if at >= end:
                break
            tag, after = varint(data, at, end)
            if after < 0:
                return at, CUT_OFF
            field, wire = tag >> 3, tag & 7
            if field < 1 or field >= 2**29 or not (wire <= LENGTH or wire == FIXED32):
                return at, BAD_TAG
            first, last = content(data, after, end, wire)
            if first < 0:
                return at, CUT_OFF
            target = step[node, field] if field < step.shape[1] else 0
            if target != 0 and wire != wires[node, field]:
                return at, WRONG_TYPE
            at = last
            if target > 0:
                depth += 1
                ends[depth], nodes[depth], at = last, target, first
                for c in range(own[target, 0], own[target, 1]):
                    # Only where it is not known yet: a message that comes in two parts is one, and
                    # the second must not erase the first.
                    if np.isnan(numbers[k, c]):
                        numbers[k, c] = 0.0
                for c in range(own[target, 2], own[target, 3]):
                    if whole[k, c] == -1:
                        whole[k, c] = 0
            elif target < 0 and wire == FIXED64:
                bits[0] = 0
                for j in range(8):
                    bits[0] |= np.int64(data[first + j]) << (8 * j)
                numbers[k, -target - 1] = bits.view(np.float64)[0]
            elif target < 0:
                whole[k, -target - 1] = varint(data, first, last)[0]
    return 0, 0
