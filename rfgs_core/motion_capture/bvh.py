# SPDX-License-Identifier: Apache-2.0
"""Reads motion capture in BVH, Biovision's text format."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from rfgs_core.errors import RfgsFormatError
from rfgs_core.motion_capture.joints import named_joints
from rfgs_core.motion_capture.recording import Recording

_ABOUT = dict(zip(("Xrotation", "Yrotation", "Zrotation"), np.eye(3), strict=True))
_ALONG = {"Xposition": 0, "Yposition": 1, "Zposition": 2}
#: Largest file [bytes], most joints, most rotations of all frames, and longest time from frame to
#: frame [s]: beyond them it is no recording of a person, or one to be cut.
_MOST_BYTES, _MOST_JOINTS, _MOST_TURNS, _LONGEST_S = 2**27, 1000, 5_000_000, 10.0
#: What moves by less of the skeleton's size against its parent is held to stay where it is.
_STILL = 1e-3
#: Longest word that a message shows.
_SHOWN = 40


def read_bvh(path: Path) -> Recording:
    """Reads a BVH file.

    Raises:
        RfgsFormatError: The file is no BVH, or is damaged; the message says where.
    """
    if path.stat().st_size > _MOST_BYTES:
        raise RfgsFormatError(f"{path}: larger than {_MOST_BYTES >> 20} MiB; cut the recording")
    try:
        text = path.read_text("utf-8")
    except UnicodeDecodeError as error:
        raise RfgsFormatError(f"{path}: expected a BVH text file, found other bytes") from error
    head, found, body = text.partition("MOTION")
    if not head.strip().startswith("HIERARCHY") or not found:
        raise RfgsFormatError(f"{path}: expected HIERARCHY and MOTION, as BVH files have")
    names, parents, offsets, channels = _hierarchy(path, iter(head.split()[1:]))
    if len(names) > _MOST_JOINTS:
        raise RfgsFormatError(f"{path}: {len(names)} joints; expected at most {_MOST_JOINTS}")
    values, frame_s = _motion(path, body, sum(len(row) for row in channels), len(names))
    turns = np.broadcast_to(np.eye(3), (len(values), len(names), 3, 3)).copy()
    places = np.broadcast_to(np.array(offsets), (len(values), len(names), 3)).copy()
    column = 0
    for joint, row in enumerate(channels):
        for name in row:
            if name in _ALONG:
                places[:, joint, _ALONG[name]] = values[:, column]
            elif name in _ABOUT:
                turn = np.radians(values[:, column, None]) * _ABOUT[name]
                turns[:, joint] @= Rotation.from_rotvec(turn).as_matrix()
            column += 1
    whole = Recording(tuple(names), tuple(parents), np.array(offsets), turns, places[:, 0], frame_s)
    return _from_what_moves(whole, places)


def _from_what_moves(whole: Recording, places: np.ndarray) -> Recording:
    """The part of a skeleton below the last joint that carries the whole person.

    Many rigs have hips that move below a root that stands still. Joints further down keep their
    offsets: bones do not stretch.

    Args:
        whole: The skeleton, whose joints but the first have constant offsets.
        places: Every joint's place against its parent in every frame, shape (F, J, 3).
    """
    below = [{joint} for joint in range(len(whole.joints))]
    for joint in range(len(whole.joints) - 1, 0, -1):
        below[whole.parents[joint]] |= below[joint]
    person = {joint for bone, joint in named_joints(whole).items() if bone != "pelvis"}
    first = replace(whole, turns=whole.turns[:1], root=whole.root[:1]).places()[0]
    moves = np.ptp(places, axis=0).max(axis=1) > _STILL * np.ptp(first, axis=0).max()
    carriers = [joint for joint in range(1, len(moves)) if moves[joint] and person <= below[joint]]
    if not person or not carriers:
        return whole
    hips = carriers[-1]
    root, turn = places[:, 0], whole.turns[:, 0]
    way, joint = [], hips
    while joint > 0:
        way.append(joint)
        joint = whole.parents[joint]
    for joint in reversed(way):
        root = root + np.einsum("fij,fj->fi", turn, places[:, joint])
        turn = turn @ whole.turns[:, joint]
    kept = sorted(below[hips])
    turns = whole.turns[:, kept]
    turns[:, 0] = turn
    return Recording(
        tuple(whole.joints[joint] for joint in kept),
        tuple(kept.index(whole.parents[joint]) if joint != hips else -1 for joint in kept),
        whole.offsets[kept],
        turns,
        root,
        whole.frame_s,
    )


def _hierarchy(
    path: Path, words: Iterator[str]
) -> tuple[list[str], list[int], list[list[float]], list[list[str]]]:
    names: list[str] = []
    parents: list[int] = []
    offsets: list[list[float]] = []
    channels: list[list[str]] = []
    # Open braces: the joint that each belongs to, None for the end of a limb.
    line: list[int | None] = []
    try:
        for word in words:
            if word in ("ROOT", "JOINT"):
                parents.append(_last_joint(line))
                names.append(next(words))
                line.append(len(names) - 1)
            elif word == "End":
                next(words)
                line.append(None)
            elif word == "OFFSET":
                offset = [_number(path, next(words)) for _ in range(3)]
                # The end of a limb has an offset too, but is no joint.
                offsets += [offset] if line[-1] is not None else []
            elif word == "CHANNELS":
                channels.append(_channels(path, words))
            elif word == "}":
                line.pop()
            elif word != "{":
                raise RfgsFormatError(f"{path}: unexpected {word[:_SHOWN]!r} in the hierarchy")
    except (StopIteration, IndexError) as error:
        raise RfgsFormatError(f"{path}: the hierarchy ends within a joint") from error
    if not names or line or not len(names) == len(offsets) == len(channels):
        raise RfgsFormatError(f"{path}: expected an OFFSET and CHANNELS for every joint")
    return names, parents, offsets, channels


def _last_joint(line: list[int | None]) -> int:
    """The innermost joint with an open brace, −1 for none."""
    return next((joint for joint in reversed(line) if joint is not None), -1)


def _channels(path: Path, words: Iterator[str]) -> list[str]:
    row = [next(words) for _ in range(int(_number(path, next(words))))]
    unknown = [name for name in row if name not in _ABOUT and name not in _ALONG]
    if unknown:
        raise RfgsFormatError(f"{path}: unknown channel {unknown[0][:_SHOWN]!r}")
    return row


def _number(path: Path, word: str) -> float:
    """A finite number."""
    try:
        value = float(word)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise RfgsFormatError(f"{path}: expected a number, found {word[:_SHOWN]!r}")
    return value


def _motion(path: Path, body: str, columns: int, joints: int) -> tuple[np.ndarray, float]:
    """Channel values [F, C] and the time from frame to frame [s]."""
    words = body.split()
    try:
        if words[0] != "Frames:" or words[2:4] != ["Frame", "Time:"]:
            raise RfgsFormatError(f"{path}: expected `Frames:` and `Frame Time:` after MOTION")
        count, frame_s = int(_number(path, words[1])), _number(path, words[4])
        values = np.array([_number(path, word) for word in words[5:]])
    except IndexError as error:
        raise RfgsFormatError(f"{path}: the motion has no frames") from error
    if count < 1 or len(values) != count * columns:
        raise RfgsFormatError(
            f"{path}: expected {count} frames of {columns} channels, got {len(values)} numbers"
        )
    if count * joints > _MOST_TURNS:
        raise RfgsFormatError(f"{path}: {count} frames of {joints} joints are too many; cut it")
    if not 0.0 < frame_s <= _LONGEST_S:
        raise RfgsFormatError(
            f"{path}: {frame_s:g} s from frame to frame; expected up to {_LONGEST_S}"
        )
    return values.reshape(count, columns), frame_s
