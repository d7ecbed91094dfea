# SPDX-License-Identifier: GPL-3.0-or-later
"""Which bone of anny stands for each of `rfgs_core.articulated.BONES`, and for the toes."""

from __future__ import annotations

from rfgs_core.articulated.bones import BONES

#: Bone of anny at whose head each bone begins, without side.
_START = {
    "pelvis": "root", "spine_lower": "spine04", "spine_middle": "spine02", "spine_upper": "spine01",
    "neck": "neck01", "head": "head", "clavicle": "clavicle", "upperarm": "upperarm01",
    "lowerarm": "lowerarm01", "hand": "wrist", "upperleg": "upperleg01", "lowerleg": "lowerleg01",
    "foot": "foot", "toe": "toe1-1",
}  # fmt: skip
#: Bones that motion capture may have.
RECORDED = (*BONES, "toe_left", "toe_right")


def anny_name(name: str) -> str:
    """Bone of anny.

    Example:
        >>> anny_name("pelvis"), anny_name("upperarm_left")
        ('root', 'upperarm01.L')
    """
    stem, _, side = name.partition("_")
    if side in ("left", "right"):
        return f"{_START[stem]}.{side[0].upper()}"
    return _START[name]
