# SPDX-License-Identifier: Apache-2.0
"""A posed person as motion capture: BVH, Biovision's text format, as animation programs read it.

The file's y axis points up, as is usual: our (x, y, z) is (x, z, −y) there. Lengths are metres.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from jaxtyping import Float64
from scipy.spatial.transform import Rotation, Slerp

from rfgs_core.articulated import BONES, PARENTS
from rfgs_core.files import write_text
from rfgs_core.limbs.skins import PosedPeople

#: From our axes to those of the file.
_TO_FILE = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
#: Channels of a rotation in the order in which the file names them, and SciPy.
_CHANNELS, _ORDER = "Zrotation Xrotation Yrotation", "ZXY"
#: Length that ends a chain of bones, which no other bone gives [m].
_TIP_M = 0.1


def write_bvh(
    path: Path, people: PosedPeople, number: int, time_s: Float64[np.ndarray, "frame"]
) -> None:
    """Writes the motion of one person, at even steps of the shortest time between its frames.

    Args:
        path: File to write.
        people: Everybody.
        number: Who.
        time_s: Times of the frames, ascending [s].
    """
    heads = people.body(number).heads @ _TO_FILE.T
    root, local, step_s = _even(people, number, time_s)
    lines = ["HIERARCHY", *_hierarchy(heads, 0, 0), "MOTION", f"Frames: {len(root)}"]
    lines.append(f"Frame Time: {step_s:.6f}")
    angles = np.stack([rotation.as_euler(_ORDER, degrees=True) for rotation in local], axis=1)
    order = list(_depth_first(0))
    for place, turns in zip(root, angles, strict=True):
        numbers = [*place, *turns[order].ravel()]
        lines.append(" ".join(f"{value:.6f}" for value in numbers))
    write_text(path, "\n".join(lines) + "\n")


def _even(
    people: PosedPeople, number: int, time_s: Float64[np.ndarray, "frame"]
) -> tuple[Float64[np.ndarray, "step 3"], list[Rotation], float]:
    """Root [m] in the file's axes and rotations against the parent, at even steps [s]."""
    poses = [people.pose(frame, number) for frame in range(len(time_s))]
    local = np.array([pose.local() for pose in poses])
    local = _TO_FILE @ local @ _TO_FILE.T
    root = np.array([pose.root for pose in poses]) @ _TO_FILE.T
    if len(time_s) == 1:
        return root, [Rotation.from_matrix(local[:, bone]) for bone in range(len(BONES))], 1.0
    # About the shortest step there is, and one that ends with the last pose.
    steps = round(float((time_s[-1] - time_s[0]) / np.diff(time_s).min()))
    even, step_s = np.linspace(time_s[0], time_s[-1], steps + 1, retstep=True)
    places = np.stack([np.interp(even, time_s, root[:, axis]) for axis in range(3)], axis=1)
    turns = [
        Slerp(time_s, Rotation.from_matrix(local[:, bone]))(even) for bone in range(len(BONES))
    ]
    return places, turns, float(step_s)


def _children(bone: int) -> list[int]:
    return [child for child, parent in enumerate(PARENTS) if parent == bone]


def _depth_first(bone: int) -> Iterator[int]:
    """Bones in the order in which the file lists them."""
    yield bone
    for child in _children(bone):
        yield from _depth_first(child)


def _hierarchy(heads: Float64[np.ndarray, "bone 3"], bone: int, depth: int) -> Iterator[str]:
    """Lines of a bone and of all that hang on it."""
    indent = "\t" * depth
    parent = PARENTS[bone]
    offset = np.zeros(3) if parent < 0 else heads[bone] - heads[parent]
    yield f"{indent}{'ROOT' if parent < 0 else 'JOINT'} {BONES[bone]}"
    yield f"{indent}{{"
    yield f"{indent}\tOFFSET {offset[0]:.6f} {offset[1]:.6f} {offset[2]:.6f}"
    if parent < 0:
        yield f"{indent}\tCHANNELS 6 Xposition Yposition Zposition {_CHANNELS}"
    else:
        yield f"{indent}\tCHANNELS 3 {_CHANNELS}"
    children = _children(bone)
    for child in children:
        yield from _hierarchy(heads, child, depth + 1)
    if not children:
        along = offset / max(float(np.linalg.norm(offset)), 1e-9) * _TIP_M
        yield f"{indent}\tEnd Site"
        yield f"{indent}\t{{"
        yield f"{indent}\t\tOFFSET {along[0]:.6f} {along[1]:.6f} {along[2]:.6f}"
        yield f"{indent}\t}}"
    yield f"{indent}}}"
