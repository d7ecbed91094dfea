# SPDX-License-Identifier: GPL-3.0-or-later
"""What a look at a scene brings to light, as data: for tables, panels and refusals."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from ..errors import AddonError

#: From what stops the work to what is merely good to know.
SEVERITIES = ("error", "warning", "info")


@dataclass(frozen=True)
class Finding:
    """One thing a user should know about a scene."""

    severity: str
    """error: the scene is refused; warning: the data differ from what the scene shows; info."""
    object: str
    """Name of the object, or `the scene`."""
    message: str
    """What is so."""
    remedy: str = ""
    """What to do about it."""
    kind: str = ""
    """Which finding it is where something can be done by a button; see `check.repairs`."""
    material: str = ""
    """Name of the Blender material it is about."""

    @property
    def sentence(self) -> str:
        """Message and remedy in one line."""
        subject = "" if self.object == "the scene" else f"object {self.object!r} "
        return f"{subject}{self.message}" + (f"; {self.remedy}" if self.remedy else "")


def refuse(label: str, findings: Iterable[Finding]) -> None:
    """Raises if a scene cannot be used as it is.

    Args:
        label: Name of the file.
        findings: All that was found.

    Raises:
        AddonError: Every error, in one line.
    """
    errors = [finding.sentence for finding in findings if finding.severity == "error"]
    if errors:
        raise AddonError(f"{label}: " + "; also: ".join(dict.fromkeys(errors)))
