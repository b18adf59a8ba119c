"""Compiled reading of comma-separated numbers; public wrapper: ``columns.read_columns``."""

import math

from bridgegen.base.arrays import Float, Int
from bridgegen.base.compiled import inlined_kernel, kernel

COMMA, QUOTE, SPACE, TAB, NEWLINE, RETURN = 44, 34, 32, 9, 10, 13
FEW_FIELDS, MANY_FIELDS, NOT_A_NUMBER, BAD_QUOTE = 1, 2, 3, 4


@inlined_kernel
def number(data: Int, begin: int, end: int) -> tuple[float, bool]:
    """Return the number in a field, and whether it is a finite one; NaN for an empty field.

    Correctly rounded up to 15 digits and 10 to the ±22, within 2 units in the last place beyond.
    """
    while begin < end and (data[begin] == SPACE or data[begin] == TAB):
        begin += 1
    while end > begin and (data[end - 1] == SPACE or data[end - 1] == TAB):
        end -= 1
    n = end - begin
    if n == 0:
        return float("nan"), True
    negative = data[begin] == 45
    if negative or data[begin] == 43:
        begin += 1
    if (
        end - begin == 3
        and (data[begin] | 32) == 110
        and (data[begin + 1] | 32) == 97
        and (data[begin + 2] | 32) == 110
    ):
        return float("nan"), True
    mantissa, digits, shift, seen, point = 0, 0, 0, False, False
    while begin < end:
        c = int(data[begin])
        if 48 <= c <= 57:
            seen = True
            if digits < 18:
                mantissa = mantissa * 10 + c - 48
                if mantissa > 0:
                    digits += 1
                if point:
                    shift -= 1
            elif not point:
                shift += 1
        elif c == 46 and not point:
            point = True
        else:
            break
        begin += 1
    if not seen:
        return 0.0, False
    if begin < end:
        if (data[begin] | 32) != 101 or begin + 1 >= end:
            return 0.0, False
        begin += 1
        minus = data[begin] == 45
        if minus or data[begin] == 43:
            begin += 1
        if begin >= end or end - begin > 3:
            return 0.0, False
        exponent = 0
        while begin < end:
            if not 48 <= data[begin] <= 57:
                return 0.0, False
            exponent = exponent * 10 + int(data[begin]) - 48
            begin += 1
        shift += -exponent if minus else exponent
    value = float(mantissa)
    while shift > 22:
        value *= 1e22
        shift -= 22
    while shift < -22:
        value /= 1e22
        shift += 22
    power = 1.0
    for _ in range(abs(shift)):
        power *= 10.0
    value = value * power if shift >= 0 else value / power
    return (-value if negative else value), not math.isinf(value)


@kernel
def read_lines(
    data: Int,
    separator: int,
    n_fields: int,
    slot: Int,
    values: Float,
    hashes: Int,
    spans: Int,
    found: Int,
) -> None:
    """Read whole lines.

    Args:
        data: ``(B,)`` uint8, ends with a line break.
        separator: of fields; `SPACE` for any run of spaces and tabs.
        n_fields: of each line.
        slot: ``(n_fields,)`` k ≥ 0: the field is column k of ``values``; −1: it is not used;
            −2 − k: it is column k of ``hashes`` and ``spans``.
        values: ``(R, K)`` [out].
        hashes: ``(R, H)`` [out], of the fields' text.
        spans: ``(R, H, 2)`` [out], the text's begin and end.
        found: ``(4,)`` [out]: lines with fields, all lines, code of the first problem, its field.
    """
    rows, lines, i, size, blank = 0, 0, 0, len(data), False
    while i < size:
        end = i
        quotes = False
        while data[end] != NEWLINE:
            if data[end] == QUOTE:
                quotes = True
            end += 1
        last = end - 1 if end > i and data[end - 1] == RETURN else end
        begin, after = i, last
        i = end + 1
        lines += 1
        if separator == SPACE:
            while begin < after and (data[begin] == SPACE or data[begin] == TAB):
                begin += 1
            while after > begin and (data[after - 1] == SPACE or data[after - 1] == TAB):
                after -= 1
        if begin == after:
            blank = True
            continue
        if blank:  # the lines' numbers are those of the states: empty lines are at the end only
            found[2], found[3] = FEW_FIELDS, 0
            found[0], found[1] = rows, lines - 1
            return
        field = 0
        while True:
            stop = begin
            inside = False
            while stop < after:
                c = data[stop]
                if quotes and c == QUOTE:
                    inside = not inside
                elif not inside and (c == separator or (separator == SPACE and c == TAB)):
                    break
                stop += 1
            if inside:
                found[2], found[3] = BAD_QUOTE, field
                found[0], found[1] = rows, lines
                return
            if field >= n_fields:
                found[2], found[3] = MANY_FIELDS, field
                found[0], found[1] = rows, lines
                return
            k = slot[field]
            if k != -1:
                a, b = begin, stop
                if quotes and b - a >= 2 and data[a] == QUOTE and data[b - 1] == QUOTE:
                    a, b = a + 1, b - 1
                if k >= 0:
                    value, good = number(data, a, b)
                    if not good:
                        found[2], found[3] = NOT_A_NUMBER, field
                        found[0], found[1] = rows, lines
                        return
                    values[rows, k] = value
                else:
                    high, low = 0, 0  # 62 bits, and no overflow
                    for at in range(a, b):
                        high = (high * 257 + int(data[at]) + 1) % 2147483647
                        low = (low * 263 + int(data[at]) + 1) % 2147483629
                    hashes[rows, -2 - k] = high * 2147483648 + low
                    spans[rows, -2 - k, 0], spans[rows, -2 - k, 1] = a, b
            field += 1
            if stop >= after:
                break
            begin = stop + 1
            if separator == SPACE:
                while begin < after and (data[begin] == SPACE or data[begin] == TAB):
                    begin += 1
        if field < n_fields:
            found[2], found[3] = FEW_FIELDS, field
            found[0], found[1] = rows, lines
            return
        rows += 1
    found[0], found[1] = rows, lines
