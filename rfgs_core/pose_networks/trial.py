# SPDX-License-Identifier: Apache-2.0
"""One pose network: what it learns from, how it is trained, and how far off it is."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, NamedTuple

import torch
from torch import nn

from rfgs_core.limbs.progress import Progress
from rfgs_core.pose_networks import rooms
from rfgs_core.pose_networks.cloud_network import CloudNetwork
from rfgs_core.pose_networks.learn import (
    Training,
    as_heard,
    asked,
    errors,
    split,
    train,
    turned,
)
from rfgs_core.pose_networks.lessons import CLIP, RECORDED, Lessons, Part, clip_parts, lessons
from rfgs_core.pose_networks.picture_network import PictureNetwork
from rfgs_core.radio import Radio
from rfgs_core.seeds import sub_seed
from rfgs_core.worlds.world import Place

#: Fewest examples of random rooms: one of five is judged.
_LEAST = 5

Manner = Literal["points", "amplitudes"]
#: What each manner is called in tables.
ROWS: dict[Manner, str] = {
    "points": "points, mmMesh manner",
    "amplitudes": "amplitudes, Person-in-WiFi 3D manner",
}
#: What publications claim on splits of their own, not reproduced here.
CLAIMED: dict[Manner, str] = {
    "points": "mmMesh (MobiSys 2021): vertices 0.025 m off, the same people",
    "amplitudes": "Person-in-WiFi 3D (CVPR 2024): joints 0.092 m off, one person",
}


@dataclass(frozen=True)
class Trial:
    """What is trained."""

    manner: Manner
    radio: Radio
    frames: int
    """Frames that are made, those it is judged by included."""
    passes: float
    """How often each is seen."""
    one_room: bool
    """Recordings of one room, split by time; else random rooms."""
    place: Place | None = None
    """Of amplitudes in random rooms: the extent and devices that all of them share."""
    depth: int = 1
    """Interactions of people's paths; of amplitudes."""
    seed: int = 0

    @property
    def name(self) -> str:
        """Says what the examples depend on."""
        where = "one_room" if self.one_room else "rooms"
        if self.manner == "points":
            return f"points_{where}_{self.radio.name}_seed{self.seed}"
        name = f"amplitudes_{where}_{self.radio.name}_depth{self.depth}_seed{self.seed}"
        if self.place is None:
            return name
        layout = sub_seed(0, str(self.place.bounds_m.tolist()), str(self.place.devices))
        return f"{name}_{layout % 16**6:06x}"

    @property
    def examples(self) -> int:
        """Clips, or frames; of one room whole recordings."""
        asked_for = self.frames // CLIP if self.manner == "points" else self.frames
        least = self._recording if self.one_room else _LEAST
        whole = asked_for - asked_for % self._recording if self.one_room else asked_for
        return max(whole, least)

    @property
    def _recording(self) -> int:
        return RECORDED if self.manner == "points" else rooms.RECORDED

    @property
    def recorded(self) -> int:
        """Examples of a recording whose last fifth is judged; all where rooms are random."""
        return self._recording if self.one_room else self.examples

    def parts(self) -> Iterator[Part]:
        """The stream of examples from its beginning."""
        if self.manner == "points":
            return clip_parts(self.radio, self.seed, one_room=self.one_room)
        if self.one_room or self.place is None:
            return rooms.one_room(self.radio, self.seed, self.depth)
        return rooms.other_rooms(self.radio, self.place, self.seed, self.depth)

    def network(self, known: Lessons) -> nn.Module:
        """An untrained network."""
        torch.manual_seed(self.seed)
        return CloudNetwork() if self.manner == "points" else PictureNetwork.fitting(known)

    @property
    def training(self) -> Training:
        """How it is trained."""
        if self.manner == "points":
            return Training(self.passes, batch=8, rate=3e-3, seed=self.seed)
        return Training(self.passes, batch=32, rate=1e-3, seed=self.seed)


class Outcome(NamedTuple):
    """A trained network and how far off it is on what it did not see."""

    network: nn.Module
    figures: dict[str, Any]


def run_trial(
    trial: Trial,
    out: Path,
    on_frames: Callable[[int], object] = lambda frames: None,
    on_step: Callable[[int, int, str], None] = lambda done, steps, words: None,
) -> Outcome:
    """Makes what is missing, trains, judges.

    Args:
        trial: What to train.
        out: Folder of examples and networks; what is there is kept, and gone on from.
        on_frames: Called after each part with the frames it holds.
        on_step: Called after each step with the steps so far, all of them, and a few words.

    Raises:
        RfgsFormatError: A file in the folder is damaged.
    """
    folder = out / trial.name
    each = CLIP if trial.manner == "points" else 1
    found = lessons(folder, trial.parts(), trial.examples, lambda count: on_frames(count * each))
    known, judged = split(found, trial.recorded)
    network, training = trial.network(known), trial.training
    steps = training.steps(len(known.joints))
    change = turned if trial.manner == "points" and not trial.one_room else as_heard
    progress = train(
        network, known, training, change, folder / "network.safetensors",
        lambda done, words: on_step(done, steps, words),
    )  # fmt: skip
    return Outcome(network, _figures(trial, network, known, judged, progress))


def _figures(
    trial: Trial, network: nn.Module, known: Lessons, judged: Lessons, progress: Progress
) -> dict[str, Any]:
    """The network beside mean poses, on what it did not see."""
    rows = {
        ROWS[trial.manner]: asked(network, judged.inputs),
        "mean pose of training": _mean(known.joints).expand_as(judged.joints),
    }
    if trial.one_room:
        recordings = trial.examples // trial.recorded
        rows["mean pose of the same recording"] = _recording_means(recordings, known, judged)
    table = {
        f"{name}: {key}": value
        for name, said in rows.items()
        for key, value in errors(said, judged.joints).items()
    }
    each = CLIP if trial.manner == "points" else 1
    return {
        **{f"unseen, {key}": value for key, value in table.items()},
        "unseen frames": len(judged.joints) * each,
        "training frames": len(known.joints) * each,
        "training steps": progress.frames,
        "training [s]": progress.spent_s,
        f"claimed, not reproduced: {trial.manner}": CLAIMED[trial.manner],
    }


def _mean(joints: torch.Tensor) -> torch.Tensor:
    """Mean over all frames."""
    return joints.reshape(-1, *joints.shape[-2:]).mean(0)


def _recording_means(recordings: int, known: Lessons, judged: Lessons) -> torch.Tensor:
    """For every judged example the mean pose of what was learnt of its recording."""
    learnt = known.joints.unflatten(0, (recordings, -1))
    means = torch.stack([_mean(one) for one in learnt])
    each = means.repeat_interleave(len(judged.joints) // recordings, 0)
    return each.reshape(len(each), *[1] * (judged.joints.dim() - 3), -1, 3).expand_as(judged.joints)
