# SPDX-License-Identifier: Apache-2.0
r"""The moving picture of the README: the true person, and beside it a run's Gaussians.

After `make demo`, these made docs/person.webp, some minutes in Blender:

    for f in $(seq 10 5 45); do
        python -m addon_rfgs --blend blender_scenes/living_room_walk.blend import demo/run-wifi \
            --frame $f --camera cam_03 --resolution 400 --picture shots/$f.png
    done
    python docs/animate.py demo/run-wifi --pictures shots --out docs/person.webp

Without `--pictures` the Gaussians are drawn as splats over the picture of the empty room, from a
camera of the dataset, in seconds. Their places come from radio alone; their colours were fitted to
pictures afterwards, for display.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from rfgs_core import open_run
from rfgs_core.errors import RfgsError
from rfgs_core.files import replacing
from rfgs_core.render.side_by_side import side_by_side, to_bytes
from rfgs_core.render.view import camera_of, render_view
from rfgs_core.run import Run

#: Pixels of the page per pixel of the picture.
ZOOM = 2
#: Names of the radios in words.
WORDS = {"wifi": "Wi-Fi", "mmwave": "60 GHz radar", "uwb": "ultra-wide band"}


def splats(run: Run, camera: str, frame: int) -> Image.Image:
    """The true picture of a frame, and Gaussians over the empty room."""
    true = run.sequence.image(camera, frame)[..., :3]
    fitted = to_bytes(render_view(run, camera_of(run.sequence, camera), frame).rgb)
    image = Image.fromarray(side_by_side(np.ascontiguousarray(true), fitted))
    return image.resize((ZOOM * image.width, ZOOM * image.height), Image.Resampling.LANCZOS)


def shot(folder: Path, frame: int) -> Image.Image:
    """The picture of a frame that the command `import` of the add-on wrote.

    Raises:
        RfgsError: There is none.
    """
    path = folder / f"{frame}.png"
    if not path.is_file():
        raise RfgsError(f"{path}: no such picture; `import RUN --frame {frame}` writes one")
    with Image.open(path) as image:
        return image.convert("RGB")


def named(image: Image.Image, radio: str) -> Image.Image:
    """Says what its two halves are."""
    size = max(image.height // 24, 10)
    draw, font = ImageDraw.Draw(image), ImageFont.load_default(size)
    for left, text in ((0, "true person"), (image.width // 2, f"from {WORDS.get(radio, radio)}")):
        where = (left + size // 2, size // 3)
        draw.text(where, text, fill="white", stroke_width=1, stroke_fill="black", font=font)
    return image


def animate(run: Run, drawn: Callable[[int], Image.Image], out: Path, pace: float) -> None:
    """Writes all frames of a run as one moving picture.

    Args:
        run: A trained run.
        drawn: Makes the picture of a frame, truth at the left.
        out: The .webp or .gif to write.
        pace: Speed beside that of the scene.

    Raises:
        RfgsError: The run is not finished, or a picture is missing.
    """
    run.need_frames()
    times_s = [run.sequence.time_s(frame) for frame in run.frames]
    step_ms = 1000.0 * (times_s[-1] - times_s[0]) / max(len(times_s) - 1, 1) / pace
    pictures = [named(drawn(frame), run.config.radio) for frame in run.frames]
    with replacing(out) as file:
        pictures[0].save(
            file,
            format=out.suffix[1:].upper(),
            save_all=True,
            append_images=pictures[1:],
            duration=max(round(step_ms), 20),
            loop=0,
            quality=80,
            method=6,
        )
    print(f"{out}: {len(pictures)} frames, {out.stat().st_size / 1e6:.2f} MB")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("run", type=Path, help="folder of a run")
    parser.add_argument("--camera", help="camera of the dataset for splats; default: the first")
    parser.add_argument("--pictures", type=Path, help="folder of pictures by frame, as 10.png")
    parser.add_argument("--pace", type=float, default=1.0, help="speed beside the scene's")
    parser.add_argument("--out", type=Path, default=Path("person.webp"), help="picture to write")
    args = parser.parse_args()
    try:
        trained = open_run(args.run)
        if args.pictures:
            source = partial(shot, args.pictures)
        else:
            name = args.camera or trained.sequence.cameras[0]["name"]
            source = partial(splats, trained, name)
        animate(trained, source, args.out, args.pace)
    except RfgsError as error:
        parser.exit(2, f"error: {error}\n")
