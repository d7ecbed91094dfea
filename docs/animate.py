# SPDX-License-Identifier: Apache-2.0
r"""The moving picture of the README: the true person, and beside it a run's Gaussians.

After `make demo`, this made docs/person.webp in a few seconds:

    python docs/animate.py demo/run-wifi --camera cam04 --out docs/person.webp

The Gaussians are drawn over the picture of the empty room. Their places come from radio alone;
their colours were fitted to pictures afterwards, for display.
"""

from __future__ import annotations

import argparse
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


def picture(run: Run, camera: str, frame: int) -> Image.Image:
    """One frame, the true picture at the left."""
    true = run.sequence.image(camera, frame)[..., :3]
    fitted = to_bytes(render_view(run, camera_of(run.sequence, camera), frame).rgb)
    image = Image.fromarray(side_by_side(np.ascontiguousarray(true), fitted))
    image = image.resize((ZOOM * image.width, ZOOM * image.height), Image.Resampling.LANCZOS)
    radio = run.config.radio
    draw, font = ImageDraw.Draw(image), ImageFont.load_default(10 * ZOOM)
    right = image.width - ZOOM * fitted.shape[1]
    for left, text in ((0, "true person"), (right, f"from {WORDS.get(radio, radio)}")):
        where = (left + 6 * ZOOM, 4 * ZOOM)
        draw.text(where, text, fill="white", stroke_width=1, stroke_fill="black", font=font)
    return image


def animate(run: Run, camera: str, out: Path, pace: float) -> None:
    """Writes all frames of a run as one moving picture.

    Args:
        run: A trained run.
        camera: Name of one of the dataset's cameras.
        out: The .webp or .gif to write.
        pace: Speed beside that of the scene.

    Raises:
        RfgsError: The run is not finished.
    """
    run.need_frames()
    times_s = [run.sequence.time_s(frame) for frame in run.frames]
    step_ms = 1000.0 * (times_s[-1] - times_s[0]) / max(len(times_s) - 1, 1) / pace
    pictures = [picture(run, camera, frame) for frame in run.frames]
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
    parser.add_argument("--camera", help="name of a camera; default: the first")
    parser.add_argument("--pace", type=float, default=1.0, help="speed beside the scene's")
    parser.add_argument("--out", type=Path, default=Path("person.webp"), help="picture to write")
    args = parser.parse_args()
    try:
        trained = open_run(args.run)
        name = args.camera or trained.sequence.cameras[0]["name"]
        animate(trained, name, args.out, args.pace)
    except RfgsError as error:
        parser.exit(2, f"error: {error}\n")
