# SPDX-License-Identifier: Apache-2.0
"""One torch thread where tensors are small: faster, and sums do not depend on the cores."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import torch


@contextmanager
def one_torch_thread() -> Iterator[None]:
    """Runs torch on one thread within the block; compiled kernels keep all theirs.

    Two thread pools on few cores wait for each other, and the order of torch's sums follows
    the number of threads.
    """
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(before)
