# SPDX-License-Identifier: Apache-2.0
"""What pose networks learn from: clips or frames with their joints, made part by part on disk."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import islice
from pathlib import Path
from typing import NamedTuple

import torch
from jaxtyping import Float
from safetensors.torch import save
from torch import Tensor

from rfgs_core.encode.body_maps import Ranges
from rfgs_core.errors import RfgsFormatError
from rfgs_core.files import write_bytes
from rfgs_core.limbs.stream import pairs_of
from rfgs_core.limbs.tensor_file import read_tensors
from rfgs_core.limbs.tokens import pack
from rfgs_core.pose_networks.cloud import cloud_of
from rfgs_core.radio import Radio
from rfgs_core.seals import BLANK, sealed
from rfgs_core.worlds.heard import hear
from rfgs_core.worlds.moments import Acted, followed

#: Frames of a clip, clips of a part, and clips of one recording in one room, 4 s at 10 frames/s.
CLIP, CLIPS, RECORDED = 8, 25, 5
#: What the people of one room do: upright, as in the publications' recordings.
UPRIGHT = ("walk", "gesture", "walk_gesture", "stand", "squat", "reach_high", "exercise")
_REMEDY = "delete it to make it anew"


class Lessons(NamedTuple):
    """Examples in the order of time; what a network reads is its own business."""

    inputs: tuple[Tensor, ...]
    """What it reads; the first axis counts examples."""
    joints: Float[Tensor, "example *frame 17 3"]
    """What it should say [m]."""

    def rows(self, which: Tensor | slice) -> Lessons:
        """Some of the examples."""
        return Lessons(tuple(value[which] for value in self.inputs), self.joints[which])


#: Makes a part's examples when asked.
Part = Callable[[], Lessons]


def clip_parts(radio: Radio, seed: int, *, one_room: bool) -> Iterator[Part]:
    """Parts of clips without end: points of every frame, joints around the maps' centre.

    Args:
        radio: Radio of the devices.
        seed: Seed of everything.
        one_room: Whether all clips are of one room, its devices and its people, who stay upright;
            `RECORDED` of them follow each other.
    """
    if one_room:
        stream = followed(radio, seed, CLIP * RECORDED, one_room=True, families=UPRIGHT)
    else:
        stream = followed(radio, seed, CLIP)
    while True:
        acted = list(islice(stream, CLIPS // RECORDED if one_room else CLIPS))
        yield lambda acted=acted: _clips(radio, acted)


def _clips(radio: Radio, acted: list[Acted]) -> Lessons:
    """A part of clips."""
    points, there, joints = [], [], []
    ranges = Ranges.of(radio.bandwidth_hz)
    for done in acted:
        rows = list(hear(radio, done))
        packed = pack([(row.views, row.maps, row.centre) for row in rows], pairs_of(radio))
        cloud = cloud_of(packed, ranges)
        points.append(cloud.points)
        there.append(cloud.there)
        joints += [torch.from_numpy(row.joints - row.centre) for row in rows]
    clips = [torch.cat(points), torch.cat(there), torch.stack(joints).float()]
    clips = [value.unflatten(0, (-1, CLIP)) for value in clips]
    return Lessons((clips[0], clips[1]), clips[2])


def lessons(
    folder: Path, parts: Iterator[Part], examples: int, on_examples: Callable[[int], object]
) -> Lessons:
    """The first examples of a stream; parts that are on disk are read, others made and kept.

    Args:
        folder: Folder of the stream's parts.
        parts: The stream, from its beginning.
        examples: How many.
        on_examples: Called after each part with how many it holds.

    Raises:
        RfgsFormatError: A part is damaged.
    """
    found: list[Lessons] = []
    count = 0
    for number, part in enumerate(parts):
        path = folder / f"part_{number:04d}.safetensors"
        found.append(_read(path) if path.exists() else _kept(path, part()))
        count += len(found[-1].joints)
        on_examples(len(found[-1].joints))
        if count >= examples:
            break
    inputs = zip(*(one.inputs for one in found), strict=True)
    joints = torch.cat([one.joints for one in found])
    return Lessons(tuple(torch.cat(rows) for rows in inputs), joints).rows(slice(0, examples))


def _kept(path: Path, made: Lessons) -> Lessons:
    """Writes a part in one step."""
    state = {f"input_{k}": value.contiguous() for k, value in enumerate(made.inputs)}
    write_bytes(path, sealed(save({**state, "joints": made.joints}, {"seal": BLANK})))
    return made


def _read(path: Path) -> Lessons:
    """Reads what `_kept` wrote."""
    state, _ = read_tensors(path, _REMEDY)
    inputs = tuple(state[name] for name in sorted(state) if name.startswith("input_"))
    if not inputs or "joints" not in state or {len(v) for v in inputs} != {len(state["joints"])}:
        raise RfgsFormatError(f"{path}: expected inputs and joints of as many; {_REMEDY}")
    return Lessons(inputs, state["joints"])
