# SPDX-License-Identifier: Apache-2.0
"""Which joint of a recording is which bone: every rig has names of its own."""

from __future__ import annotations

import re

from rfgs_core.errors import RfgsFormatError
from rfgs_core.motion_capture.recording import Recording

#: Names that recordings use for each of our bones, in plain lower case, without sides.
_NAMES = {
    "pelvis": ("hips", "pelvis", "root", "hip"),
    "spine_lower": ("spine04", "spinelower", "spine", "abdomen", "lowerback"),
    "spine_middle": ("spine02", "spinemiddle", "spine1", "chest"),
    "spine_upper": ("spine01", "spineupper", "spine2", "chest2", "upperchest", "thorax"),
    "neck": ("neck01", "neck", "neck1"),
    "head": ("head",),
    "clavicle": ("clavicle", "collar", "shoulder"),
    "upperarm": ("upperarm01", "upperarm", "arm", "uparm", "shoulder"),
    "lowerarm": ("lowerarm01", "lowerarm", "forearm", "lowarm", "elbow"),
    "hand": ("wrist", "hand"),
    "upperleg": ("upperleg01", "upleg", "thigh", "upperleg", "hip", "hipjoint"),
    "lowerleg": ("lowerleg01", "leg", "shin", "calf", "lowerleg", "knee", "lowleg"),
    "foot": ("foot", "ankle"),
    "toe": ("toe1-1", "toebase", "toe", "toes"),
}
#: Bones of which there are two.
_PAIRED = ("clavicle", "upperarm", "lowerarm", "hand", "upperleg", "lowerleg", "foot", "toe")
#: Sides in names of bones, by their letters in `plain_name`.
SIDES = {"L": "left", "R": "right"}
#: Bones without which nobody is told.
_NEEDED = ("pelvis", *(f"{b}_{side}" for b in ("upperleg", "lowerleg") for side in SIDES.values()))


def plain_name(joint: str) -> tuple[str, str]:
    """Lower-case name without prefix and side, and the side: `L`, `R` or nothing.

    Example:
        >>> plain_name("mixamorig:LeftUpLeg"), plain_name("rThigh"), plain_name("foot.R")
        (('upleg', 'L'), ('thigh', 'R'), ('foot', 'R'))
    """
    name = joint.rpartition(":")[2]
    for pattern in (
        r"^(?P<side>left|right)[ ._]*(?P<name>.+)$",
        r"^(?P<name>.+?)[ ._-](?P<side>left|right|l|r)$",
        r"^(?P<side>[lr])[ ._](?P<name>.+)$",
    ):
        match = re.match(pattern, name, re.IGNORECASE)
        if match:
            return _bare(match["name"]), match["side"][0].upper()
    # lThigh, rShin: a small letter before a capital one.
    match = re.match(r"^([lr])([A-Z].+)$", name)
    return (_bare(match[2]), match[1].upper()) if match else (_bare(name), "")


def _bare(name: str) -> str:
    return re.sub(r"[ ._]", "", name).lower()


def named_joints(recording: Recording) -> dict[str, int]:
    """Which recorded joint stands for each of our bones, as far as names tell."""
    rows = reversed(list(enumerate(recording.joints)))
    known = {plain_name(joint): index for index, joint in rows}
    found: dict[str, int] = {}
    for bone, names in _NAMES.items():
        for side in SIDES if bone in _PAIRED else ("",):
            joint = next((known[name, side] for name in names if (name, side) in known), None)
            if joint is not None:
                found[f"{bone}_{SIDES[side]}" if side else bone] = joint
    for side in SIDES.values():
        # A shoulder is the clavicle where an arm follows, else it is where the arm begins.
        if found.get(f"clavicle_{side}", -1) == found.get(f"upperarm_{side}"):
            del found[f"clavicle_{side}"]
    return found


def match_joints(recording: Recording) -> dict[str, int]:
    """Which recorded joint stands for each of our bones (`articulated.BONES`, and toes).

    Raises:
        RfgsFormatError: Hips, thighs or shins are not among the joints.
    """
    found = named_joints(recording)
    missing = [bone for bone in _NEEDED if bone not in found]
    if missing:
        raise RfgsFormatError(
            f"expected joints of a person; none of {', '.join(recording.joints)[:400]} is "
            f"{' or '.join(missing)}"
        )
    return found
