# SPDX-License-Identifier: Apache-2.0
"""How many threads work: many where kernels and matrices are large, one where tensors are small."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from typing import TypeVar

import numba

Item = TypeVar("Item")
Found = TypeVar("Found")


def in_threads(work: Callable[[Item], Found], items: Iterable[Item]) -> list[Found]:
    """What some work makes of each item, as many at a time as numba has threads.

    Args:
        work: Its kernels and routines let other threads go on.
        items: What it is given.
    """
    if numba.get_num_threads() == 1:
        return [work(item) for item in items]
    with ThreadPoolExecutor(numba.get_num_threads()) as pool:
        return list(pool.map(work, items))


@contextmanager
def one_torch_thread() -> Iterator[None]:
    """Runs torch on one thread within the block: faster where tensors are small.

    Compiled kernels keep all their threads. Two thread pools on few cores wait for each other, and
    the order of torch's sums follows the number of threads.
    """
    import torch

    before = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(before)
