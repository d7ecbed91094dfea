# SPDX-License-Identifier: Apache-2.0
"""What the user has asked the viewer to show."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

ColorMode = Literal["display", "power", "phase", "error"]
Drawing = Literal["splats", "points"]

#: Everything that changes how Gaussians look.
GAUSSIAN_FIELDS = ("frame", "mode", "drawn_as", "min_opacity", "below_peak_db", "brightness")


@dataclass(frozen=True)
class Selection:
    """The state of all controls at one moment."""

    frame: int
    """Blender frame number."""
    mode: ColorMode = "display"
    """What the colours of Gaussians say."""
    drawn_as: Drawing = "splats"
    """As Gaussians, or as points that show their exact colours."""
    min_opacity: float = 0.0
    """Gaussians with less opacity are hidden."""
    below_peak_db: float = float("inf")
    """So are those that reflect this much less than the strongest [dB]."""
    brightness: float = 1.0
    """Opacities are multiplied by this before they are drawn."""
    camera: str | None = None
    """Camera whose picture is rendered; None where there are none."""
    truth: bool = True
    """Show the true surface of what moves."""
    room: bool = True
    """Show what stands still."""
    radios: bool = True
    """Show antenna elements and boresights."""
    links: bool = False
    """Show lines between devices that measure each other."""
    cameras: bool = False
    """Show the dataset's cameras."""

    def differs(self, other: Selection | None, *fields: str) -> bool:
        """Whether one of these fields is another one in `other`, or there is no other."""
        return other is None or any(getattr(self, f) != getattr(other, f) for f in fields)
