# SPDX-License-Identifier: Apache-2.0
"""`rfgs render`: pictures of a run's Gaussians, alone and beside the true ones."""

from __future__ import annotations

import logging
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import tyro

from rfgs_core.device import Device, need_device
from rfgs_core.errors import RfgsError
from rfgs_core.frames import chosen_frames
from rfgs_core.video import check_video

if TYPE_CHECKING:
    import numpy as np

    from rfgs_core.render.view import TrainedRun

_LOG = logging.getLogger(__name__)


@dataclass(frozen=True)
class RenderArgs:
    """Renders a run's Gaussians through the cameras of its dataset."""

    run: tyro.conf.Positional[Path]
    """Folder of a trained run."""
    out: Path | None = None
    """Folder for OUT/cam00/000001.png, and 000001_beside_true.png where a true picture exists."""
    split: Literal["train", "test"] = "test"
    """Pictures the shader was fitted to, or those it never saw."""
    frames: tuple[str, ...] = ()
    """Frames to render, as numbers or A:B[:STEP] (inclusive); all of the run if none is given."""
    person_only: bool = False
    """Only what moves, on mid-grey, instead of in the room."""
    video: Path | None = None
    """Video to write, .mp4 (by ffmpeg) or .webp: the chosen frames in their own
    time through one camera, rendered beside true."""
    camera: str | None = None
    """Camera of the video; left out: the first that the shader never saw, else the first."""
    device: Device = "cpu"
    """Where pictures are drawn: cpu, or cuda, the current GPU, by gsplat."""


def run(args: RenderArgs) -> int:
    """Writes the pictures; exit code 0."""
    from rfgs_core.run import open_run

    if args.out is None and args.video is None:
        raise RfgsError("render: give --out FOLDER for pictures, --video FILE, or both")
    if args.camera is not None and args.video is None:
        raise RfgsError("--camera: chooses the camera of a --video; give that too")
    if args.video is not None:
        check_video(args.video)
    need_device(args.device)
    trained = open_run(args.run)
    if args.out is not None:
        render_run(trained, args)
    if args.video is not None:
        render_video(trained, args, args.video)
        sys.stdout.write(f"{args.video} written\n")
    return 0


def render_video(trained: TrainedRun, args: RenderArgs, file: Path) -> None:
    """Writes the video of an opened run.

    Raises:
        RfgsError: The run has no such frame or camera, or the video cannot be written.
    """
    import numpy as np
    from tqdm import tqdm

    from rfgs_core.render.side_by_side import WIDTH_PX, enlarged, side_by_side, to_bytes
    from rfgs_core.render.view import camera_of, render_person, render_view
    from rfgs_core.video import write_video

    frames = _chosen_frames(trained, args)
    camera = camera_of(trained.sequence, args.camera or _unseen_camera(trained))
    draw = render_person if args.person_only else render_view

    def picture(frame: int) -> np.ndarray:
        rendered = to_bytes(draw(trained, camera, frame, args.device).rgb)
        true = _true_picture(trained, camera.name, frame, args.person_only)
        both = rendered if true is None else side_by_side(rendered, true)
        return enlarged(both, WIDTH_PX)

    times_s = [trained.sequence.time_s(frame) for frame in frames]
    step_s = float(np.median(np.diff(times_s))) if len(frames) > 1 else 1.0
    bar = tqdm(frames, desc="render", unit="picture")
    write_video(file, (picture(frame) for frame in bar), 1.0 / step_s)


def _unseen_camera(trained: TrainedRun) -> str:
    names = [str(row["name"]) for row in trained.sequence.cameras]
    if not names:
        raise RfgsError(f"{trained.path}: the dataset has no camera to render through")
    test_cameras = trained.sequence.splits["images"]["test_cameras"]
    return next((name for name in names if name in test_cameras), names[0])


def render_run(trained: TrainedRun, args: RenderArgs) -> None:
    """Writes the pictures of an opened run; `args` says where.

    Raises:
        RfgsError: The run has no such frame, or the split no picture of it.
    """
    from tqdm import tqdm

    from rfgs_core.dataset.pictures import write_png
    from rfgs_core.render.side_by_side import side_by_side, to_bytes
    from rfgs_core.render.view import camera_of, fitted_shader, render_person, render_view

    assert args.out is not None
    if fitted_shader(trained) is None:
        _LOG.warning("%s: no shader has been fitted, so the Gaussians are grey", args.run)
    draw = render_person if args.person_only else render_view
    for name, frame in tqdm(_chosen(trained, args), desc="render", unit="picture"):
        camera = camera_of(trained.sequence, name)
        rendered = to_bytes(draw(trained, camera, frame, args.device).rgb)
        write_png(args.out / name / f"{frame:06d}.png", rendered)
        true = _true_picture(trained, name, frame, args.person_only)
        if true is not None:
            file = args.out / name / f"{frame:06d}_beside_true.png"
            write_png(file, side_by_side(rendered, true))


def _chosen(trained: TrainedRun, args: RenderArgs) -> list[tuple[str, int]]:
    from rfgs_core.render.view import pictures_of

    wanted = set(_chosen_frames(trained, args))
    pictures = [row for row in pictures_of(trained, args.split) if row[1] in wanted]
    if not pictures:
        raise RfgsError(f"{args.run}: the {args.split} split holds no picture of these frames")
    return pictures


def _chosen_frames(trained: TrainedRun, args: RenderArgs) -> list[int]:
    texts = args.frames or (None,)
    return sorted({frame for text in texts for frame in chosen_frames(text, trained.frames)})


def _true_picture(
    trained: TrainedRun, name: str, frame: int, person_only: bool
) -> np.ndarray | None:
    from rfgs_core.render.side_by_side import to_bytes
    from rfgs_core.render.view import camera_of, true_person

    if not trained.sequence.files.image(name, frame).is_file():
        return None
    if person_only:
        return to_bytes(true_person(trained.sequence, camera_of(trained.sequence, name), frame))
    return trained.sequence.image(name, frame)[..., :3]
