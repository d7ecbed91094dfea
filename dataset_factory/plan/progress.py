# SPDX-License-Identifier: Apache-2.0
"""Progress on the terminal."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from tqdm import tqdm

from dataset_factory.scene.blender import Progress


@contextmanager
def progress_bar(name: str, unit: str = "picture") -> Iterator[Progress]:
    """A bar on the terminal, with the time left; yields what moves it."""
    with tqdm(desc=name, unit=unit) as bar:

        def progress(done: int, total: int) -> None:
            bar.total = total
            bar.update(done - bar.n)

        yield progress
