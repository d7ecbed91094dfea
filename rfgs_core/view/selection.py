# SPDX-License-Identifier: Apache-2.0
"""What the user has asked the viewer to show."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

ColorMode = Literal["display", "power", "phase", "error", "sigma"]
Drawing = Literal["points", "splats"]
#: How the true surface is shown: not at all, as thin level lines, or as a shaded body.
TruthDrawing = Literal["hidden", "outline", "surface"]

#: Everything that changes how Gaussians look.
GAUSSIAN_FIELDS = ("frame", "mode", "drawn_as", "min_opacity", "below_peak_db", "brightness")
#: Ticks of what stands in the scene beside Gaussians and truth.
SCENE_TICKS = ("skeleton", "room", "radios", "links", "rays", "coverage", "cameras")
#: Those that are hidden at first.
Layer = Literal["links", "rays", "coverage", "cameras"]


@dataclass(frozen=True)
class Selection:
    """The state of all controls at one moment."""

    frame: int
    """Blender frame number."""
    mode: ColorMode = "display"
    """What the colours of Gaussians say."""
    drawn_as: Drawing = "points"
    """As points that show their exact colours, or as Gaussians, which are thin as fog."""
    min_opacity: float = 0.0
    """Gaussians with less opacity are hidden."""
    below_peak_db: float = float("inf")
    """So are those that reflect this much less than the strongest [dB]."""
    brightness: float = 1.0
    """Opacities are multiplied by this before they are drawn."""
    camera: str | None = None
    """Camera whose picture is rendered; None where there are none."""
    truth: TruthDrawing = "outline"
    """How the true surface of what moves is shown, beside what was fitted."""
    skeleton: bool = True
    """Show fitted skeletons."""
    room: bool = True
    """Show what stands still."""
    radios: bool = True
    """Show antenna elements and boresights."""
    links: bool = False
    """Show lines between devices that measure each other."""
    rays: bool = False
    """Show the ways of the waves between devices."""
    coverage: bool = False
    """Show how strongly each place would be heard."""
    cameras: bool = False
    """Show the dataset's cameras."""

    def differs(self, other: Selection | None, *fields: str) -> bool:
        """Whether one of these fields is another one in `other`, or there is no other."""
        return other is None or any(getattr(self, f) != getattr(other, f) for f in fields)
