# SPDX-License-Identifier: Apache-2.0
"""What it saves to move meshes in a scene that stays, beside loading the scene again."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import sionna.rt as rt

from dataset_factory.scene.bundle import read_bundle
from dataset_factory.trace.rays.scene import BODY, environment_scene, mesh, move_meshes
from rfgs_core.radio import preset


def load_scene(bundle_path: Path, radio: str, frame: int) -> rt.Scene:
    """A scene with the body in place at a frame, from the bundle's files."""
    bundle = read_bundle(bundle_path)
    scene = environment_scene(bundle, preset(radio))
    body = rt.SceneObject(
        mi_mesh=mesh(BODY, bundle.frame(frame).vertices, bundle.topology.faces),
        name=BODY,
        radio_material=rt.AbsorberRadioMaterial(name="absorber"),
    )
    scene.edit(add=body)
    return scene


def load_and_move_s(bundle_path: Path, radio: str, repeats: int) -> tuple[float, float]:
    """CPU time to load a scene at a frame, and to move the body of a loaded one [s].

    Both read the frame's file and end with a scene that rays can be cast in; medians.
    """
    bundle = read_bundle(bundle_path)
    frames = (bundle.frames * repeats)[:repeats]
    scene = load_scene(bundle_path, radio, frames[0])
    load_s = [_timed(lambda frame=frame: load_scene(bundle_path, radio, frame)) for frame in frames]
    move_s = [
        _timed(lambda frame=frame: move_meshes(scene, {BODY: bundle.frame(frame).vertices}))
        for frame in [*frames, *frames]
    ]
    return float(np.median(load_s)), float(np.median(move_s[1:]))


def _timed(work: Callable[[], object]) -> float:
    start = time.process_time()
    work()
    return time.process_time() - start
