# SPDX-License-Identifier: Apache-2.0
"""Random worlds on disk that several files of tests compare theirs with."""

from __future__ import annotations

from pathlib import Path

import pytest

from dataset_factory.cli import main


@pytest.fixture(scope="session")
def two_worlds(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two random worlds of two frames, made by this process alone."""
    out = tmp_path_factory.mktemp("worlds") / "two"
    asked = ("--radio", "wifi_commodity", "--frames", "2", "--depth", "1", "--count", "2")
    assert main(["worlds", *asked, "--out", str(out)]) == 0
    return out
