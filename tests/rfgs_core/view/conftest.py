# SPDX-License-Identifier: Apache-2.0
"""A run on the tiny dataset whose every Gaussian has known values."""

from __future__ import annotations

from pathlib import Path

import pytest
from known_run import write_run

from rfgs_core.run import Run, open_run


@pytest.fixture(scope="session")
def known_run(tiny_dataset: Path, tmp_path_factory: pytest.TempPathFactory) -> Run:
    """The run; nothing in its folder is changed."""
    return open_run(write_run(tmp_path_factory.mktemp("view") / "run", tiny_dataset))
