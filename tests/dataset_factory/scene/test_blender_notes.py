# SPDX-License-Identifier: Apache-2.0
"""What the add-on says while the factory waits for it."""

from __future__ import annotations

from pathlib import Path

import pytest

from dataset_factory.scene.blender import Blender
from rfgs_core.errors import RfgsError


def test_notes_are_passed_on_and_other_lines_kept_for_failures(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    program, steps = tmp_path / "blender", []
    program.write_text(
        "#!/bin/sh\necho progress 1 2\necho note: pictures are noisy\necho Saved it\nexit $RC\n"
    )
    program.chmod(0o755)
    blender = Blender(tmp_path / "a.blend", program)
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("RC", "0")
        blender.run("groundtruth", progress=lambda done, total: steps.append((done, total)))
        assert capsys.readouterr().err == "note: pictures are noisy\n" and steps == [(1, 2)]
        patch.setenv("RC", "3")
        with pytest.raises(RfgsError, match="groundtruth stopped with code 3: Saved it"):
            blender.run("groundtruth")
