# SPDX-License-Identifier: Apache-2.0
"""The notebook docs/first_steps.ipynb runs without a screen, and is kept without outputs."""

from __future__ import annotations

import base64
import os
from io import BytesIO
from pathlib import Path

import nbformat
import numpy as np
import pytest
from nbclient import NotebookClient
from PIL import Image

ROOT = Path(__file__).resolve().parents[2]
NOTEBOOK = ROOT / "docs" / "first_steps.ipynb"


def test_the_notebook_is_kept_without_outputs() -> None:
    for cell in nbformat.read(NOTEBOOK, as_version=4).cells:
        assert not cell.get("outputs") and cell.get("execution_count") is None, cell.source[:60]


@pytest.mark.slow
def test_the_notebook_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """As a reader runs it: on the dataset that comes with the package."""
    monkeypatch.delenv("RFGS_DATASET", raising=False)
    monkeypatch.setenv("RFGS_RUN", str(tmp_path / "run"))
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")]))
    # Nothing of it may end up in the user's home.
    monkeypatch.setenv("IPYTHONDIR", str(tmp_path / "ipython"))
    monkeypatch.setenv("JUPYTER_RUNTIME_DIR", str(tmp_path / "jupyter"))
    notebook = nbformat.read(NOTEBOOK, as_version=4)
    NotebookClient(notebook, timeout=300, resources={"metadata": {"path": tmp_path}}).execute()
    outputs = [row for cell in notebook.cells for row in cell.get("outputs", [])]
    text = "".join(row.get("text", "") for row in outputs)
    assert "500 Gaussians" in text and "all links:" in text
    drawn = [row["data"]["image/png"] for row in outputs if "image/png" in row.get("data", {})]
    assert len(drawn) == 3
    for code in drawn:
        with Image.open(BytesIO(base64.b64decode(code))) as picture:
            assert np.asarray(picture.convert("L")).std() > 10
