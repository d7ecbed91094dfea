# SPDX-License-Identifier: GPL-3.0-or-later
"""Numbers out of large texts, many at a time.

Plain decimals are taken apart eight digits at once: a 64-bit word of digits becomes a number by
three multiplications (D. Lemire, "Quickly parsing eight digits", 2018). What is not plain, or so
near the middle between two single-precision numbers that the last bit could differ, is left to
Python's `float`, which rounds exactly.
"""

from __future__ import annotations

import re

import numpy as np

#: Bytes that are looked at together: they and what is made of them stay in the cache.
_BLOCK = 1 << 18
#: Spaces around a block, so that three words in front of each digit can be read.
_MARGIN = 24
#: Share of a block's numbers that may be left to `float`; with more, the text is not plain.
_MOST_ODD = 0.02
#: Digits that fit into 64 bits whatever they are; more do after zeros.
_SURE_DIGITS, _LARGEST_TOP = 18, 1800
_POWERS = 10.0 ** np.arange(_MARGIN + 1)
_WHOLE_POWERS = np.array([10**n for n in range(20)], np.uint64)
#: By number of digits, which stand at the end of a word: the bytes that count.
_MASKS = np.array([2**64 - 2 ** (8 * (8 - n)) for n in range(9)], np.uint64)
_SPACE, _POINT, _MINUS, _ZERO, _SMALL_E = (np.uint8(ord(letter)) for letter in " .-0e")
#: Single precision drops so many bits of double precision.
_DROPPED = 29
_NUMBER = re.compile(rb"[-+0-9.eE]+")


def plain_numbers(text: bytes, count: int) -> np.ndarray | None:
    """Numbers of a text of plain decimals with white space between them.

    Args:
        text: Digits, points and signs; exponents may be rare.
        count: How many numbers there are.

    Returns:
        Single-precision numbers, each as if read in double precision and rounded; None if the
        text is not of this kind or holds another count, which does not mean that it is damaged.
    """
    out = np.zeros(count, np.float32)
    done = start = 0
    while start < len(text):
        end = min(start + _BLOCK, len(text))
        if end < len(text):  # What is cut off begins the next block.
            end = max(text.rfind(b" ", start, end), text.rfind(b"\n", start, end)) + 1
        numbers = _block(text[start:end]) if end > start else None
        if numbers is None or done + len(numbers) > count:
            return None
        out[done : done + len(numbers)] = numbers
        done, start = done + len(numbers), end
    return out if done == count else None


def _block(text: bytes) -> np.ndarray | None:
    margin = b" " * _MARGIN
    letters = np.frombuffer(bytearray().join((margin, text, margin)), np.uint8)
    if not text.strip():
        return np.zeros(0, np.float32)
    point = letters == _POINT
    # A piece is what stands before a point, or behind it.
    apart = (letters <= _SPACE) | point
    edges = np.flatnonzero(apart[1:] != apart[:-1]) + 1
    starts, ends = edges[::2].copy(), edges[1::2]
    behind = point[starts - 1]
    whole, fractions = np.flatnonzero(~behind), np.flatnonzero(behind)
    if len(fractions) != np.count_nonzero(point) or (len(starts) and behind[0]):
        return None
    if (ends[fractions - 1] + 1 != starts[fractions]).any() or behind[fractions - 1].any():
        return None
    begins, stops = starts[whole], ends[np.append(whole[1:], len(starts)) - 1]
    odd = _blank_exponents(letters, begins, stops)
    negative = letters[begins] == _MINUS
    digits = np.count_nonzero((letters - _ZERO) <= 9)
    known = digits + np.count_nonzero(negative) + np.count_nonzero(apart)
    control = np.count_nonzero(letters < 9) + np.count_nonzero((letters - np.uint8(14)) < 18)
    starts[whole] += negative
    length = ends - starts
    # Signs stand only in front, every piece has a digit, and nothing else is there.
    if known != len(letters) or control or (length < 1).any():
        return None
    values, top = _pieces(letters, ends, length)
    odd[np.cumsum(~behind)[(length > _MARGIN) | (top > _LARGEST_TOP)] - 1] = True
    mantissa, power = values[whole], np.zeros(len(whole), np.intp)
    mine = np.cumsum(~behind)[fractions] - 1
    power[mine] = length[fractions]
    odd |= (mantissa > 0) & (length[whole] + power > _SURE_DIGITS)
    mantissa[mine] *= _WHOLE_POWERS[np.minimum(power[mine], 19)]
    mantissa[mine] += values[fractions]
    numbers = mantissa.astype(np.float64) / _POWERS[np.minimum(power, _MARGIN)]
    np.negative(numbers, out=numbers, where=negative)
    odd |= _doubtful(numbers)
    return _exact(text, numbers, odd, begins - _MARGIN, stops - _MARGIN)


def _blank_exponents(letters: np.ndarray, begins: np.ndarray, stops: np.ndarray) -> np.ndarray:
    """Which numbers have an exponent, bool [N]; zeros take the place of their letters."""
    odd = np.zeros(len(begins), bool)
    marks = np.flatnonzero((letters | 32) == _SMALL_E)
    if len(marks) <= _MOST_ODD * len(begins):
        odd[np.searchsorted(begins, marks, side="right") - 1] = True
    for index in np.flatnonzero(odd):
        number = letters[begins[index] : stops[index]]
        number[number != _POINT] = _ZERO
    return odd


def _pieces(
    letters: np.ndarray, ends: np.ndarray, length: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Whole numbers [P] of up to 24 digits that end before `ends`, and the first 8 of 24 digits."""
    words = np.ndarray((len(letters) - 7,), "<u8", letters, strides=(1,))
    values = _eight_digits(words[ends - 8] & _MASKS[np.minimum(length, 8)])
    top = np.zeros_like(values)
    for group, unit in ((1, 10**8), (2, 10**16)):
        longer = np.flatnonzero(length > 8 * group)
        mask = _MASKS[np.minimum(length[longer] - 8 * group, 8)]
        part = _eight_digits(words[ends[longer] - 8 * (group + 1)] & mask)
        values[longer] += part * np.uint64(unit)
        if group == 2:
            top[longer] = part
    return values, top


def _eight_digits(words: np.ndarray) -> np.ndarray:
    """Numbers of words whose bytes are digits, the first in the lowest byte; zero bytes are 0."""
    for mask, factor, shift in (
        (0x0F0F0F0F0F0F0F0F, 2561, 8),
        (0x00FF00FF00FF00FF, 6553601, 16),
        (0x0000FFFF0000FFFF, 42949672960001, 32),
    ):
        words &= np.uint64(mask)
        words *= np.uint64(factor)
        words >>= np.uint64(shift)
    return words


def _doubtful(numbers: np.ndarray) -> np.ndarray:
    """Which are so near the middle of two single-precision numbers that an error could decide."""
    half = 1 << (_DROPPED - 1)
    rest = (numbers.view(np.int64) & (2 * half - 1)) - half
    return np.abs(rest) <= 8


def _exact(
    text: bytes, numbers: np.ndarray, odd: np.ndarray, begins: np.ndarray, stops: np.ndarray
) -> np.ndarray | None:
    """Single-precision numbers, odd ones read one by one; None if they are many, or one is none."""
    rows = np.flatnonzero(odd)
    if len(rows) > _MOST_ODD * len(numbers) + 1:
        return None
    for row in rows:
        word = text[begins[row] : stops[row]]
        if not _NUMBER.fullmatch(word):
            return None
        try:
            numbers[row] = float(word)
        except ValueError:
            return None
    with np.errstate(over="ignore"):
        return numbers.astype(np.float32)
