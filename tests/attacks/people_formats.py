# SPDX-License-Identifier: Apache-2.0
"""What is kept of people: counts, limbs, poses, networks, recordings, halves of a refinement."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path
from typing import Any

import mutations
import numpy as np
import torch
from formats import Format

from rfgs_core.arrays import save_arrays
from rfgs_core.articulated import BONES
from rfgs_core.fit.density.standard import StandardDensity, StandardRule
from rfgs_core.fit.parameters import LearningRates, TrainableGaussians
from rfgs_core.fit.refine import _arrays, _resume
from rfgs_core.gaussians.model import Gaussians
from rfgs_core.limbs.network import LimbNetwork
from rfgs_core.limbs.progress import Progress, keep, resume
from rfgs_core.limbs.weights import load_network, save_network
from rfgs_core.motion_capture.bvh import read_bvh
from rfgs_core.motion_capture.clip import read_clip
from rfgs_core.radio import preset
from rfgs_core.run.limbs import LIMBS_FILE, read_limbs
from rfgs_core.run.people import PEOPLE_FILE, HeadCount
from rfgs_core.view.frames import POSE_FILE, fitted_bones

RECORDING = """HIERARCHY
ROOT Hips
{
 OFFSET 0 0 0
 CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
 JOINT LeftUpLeg
 {
  OFFSET 1 -1 0
  CHANNELS 3 Zrotation Xrotation Yrotation
  End Site
  {
   OFFSET 0 -4 0
  }
 }
}
MOTION
Frames: 2
Frame Time: 0.05
0 8 0 0 0 0 0 5 0
0 8 1 0 0 0 0 5 0
"""


def make_people(folder: Path) -> list[Format]:
    """Writes sound files of all that is kept of people."""
    folder.mkdir(parents=True)
    HeadCount(2, "sensed", {"1": 2, "2": 2, "3": 1}).write(folder)
    posed, fitted = folder / "posed", folder / "fitted"
    _write_limbs(posed)
    _write_pose(fitted)
    return [
        Format(
            "people.json", folder / PEOPLE_FILE, mutations.json_of,
            lambda: HeadCount.read(folder),
        ),
        Format("limbs", posed / LIMBS_FILE, mutations.arrays_of, lambda: _posed(posed)),
        Format("pose", fitted / POSE_FILE, mutations.arrays_of, lambda: fitted_bones(fitted)),
        *_networks(folder),
        _half(folder / "half.npz"),
        *_recordings(folder),
    ]  # fmt: skip


def _write_limbs(run: Path) -> None:
    """Two frames of one person who stands."""
    save_arrays(
        run / LIMBS_FILE,
        {
            "frames": np.array([1, 2]), "axes_xy": np.ones((2, 1, 2)),
            "velocity_xy": np.zeros((2, 1, 2)), "time_s": np.array([0.0, 0.1]),
            "joints": np.ones((2, 1, 17, 3)), "sigma_m": np.ones((2, 1, 17)),
            "coefficients": np.zeros((1, 4)), "root": np.ones((2, 1, 3)),
            "turns": np.tile(np.eye(3, dtype=np.float32), (2, 1, len(BONES), 1, 1)),
        },
    )  # fmt: skip


def _posed(run: Path) -> Any:
    limbs = read_limbs(run)
    assert limbs is not None
    tracks = [dataclasses.asdict(track) for track in limbs.tracks]
    return [limbs.frames, tracks, limbs.joints._asdict(), limbs.people.joints17()]


def _write_pose(run: Path) -> None:
    joints = np.ones((2, 1, 17, 3))
    save_arrays(
        run / POSE_FILE,
        {"frames": np.array([1, 2]), "time_s": np.array([0.0, 0.1]),
         "centroid": np.ones((2, 1, 3)), "joints": joints},
    )  # fmt: skip


def _networks(folder: Path) -> list[Format]:
    """A network, and a training of one that was interrupted."""
    file, state = folder / "wifi.safetensors", folder / "wifi.partial"
    torch.manual_seed(1)
    network = LimbNetwork(4)
    save_network(file, network, preset("wifi"), {"frames": 64, "seed": 3})
    optimiser = torch.optim.AdamW(network.parameters(), 1e-3)
    torch.stack([(value**2).sum() for value in network.parameters()]).sum().backward()
    optimiser.step()
    keep(state, network, optimiser, Progress(640, 12.5))

    def weights() -> Any:
        made = load_network(file)
        return [made.card, dict(made.network.state_dict())]

    def resumed() -> Any:
        other = LimbNetwork(4)
        second = torch.optim.AdamW(other.parameters(), 1e-3)
        progress = resume(state, other, second)
        return [tuple(progress), dict(other.state_dict()), second.state_dict()["state"]]

    return [
        Format("limb network", file, mutations.tensors_of, weights),
        Format("limb training", state, mutations.tensors_of, resumed),
    ]


def _half(file: Path) -> Format:
    """A frame that is half-refined."""
    start = Gaussians(
        means=torch.ones(5, 3), quats=torch.ones(5, 4), log_scales=torch.ones(5, 3),
        logit_opacities=torch.ones(5), features=torch.ones(5, 32),
    )  # fmt: skip
    rates = LearningRates()
    trained = TrainableGaussians(start, rates)
    torch.stack([leaf.sum() for leaf in trained.leaves.values()]).sum().backward()
    trained.optimiser.step()
    density = StandardDensity(StandardRule(), 1.0, gradient_sum=torch.ones(5), steps=3)
    save_arrays(file, _arrays(7, trained, density))

    def resumed() -> Any:
        found, step, memory = _resume(file, start, rates)
        density.resume(memory)
        return [found.state(), step, density.state()]

    return Format("half a refinement", file, mutations.arrays_of, resumed)


def _recordings(folder: Path) -> list[Format]:
    """Motion capture in both formats."""
    bvh, clip = folder / "a.bvh", folder / "a.txt"
    bvh.write_text(RECORDING)
    row = [0.05, 0.0, 0.9, 0.0]
    for width in (4, 4, 4, 4, 1, 4, 4, 1, 4, 1, 4, 4, 1):
        row += [1.0, 0.0, 0.0, 0.0] if width == 4 else [0.1]
    clip.write_text(json.dumps({"Loop": "wrap", "Frames": [row, row]}))
    return [
        Format("bvh", bvh, mutations.text_of, lambda: read_bvh(bvh), theirs=True),
        Format("clip", clip, mutations.json_of, lambda: read_clip(clip), theirs=True),
    ]
