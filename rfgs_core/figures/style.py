# SPDX-License-Identifier: Apache-2.0
"""Pictures for reports: matplotlib figures and arrays as data URIs, for light and dark pages."""

from __future__ import annotations

import base64
import io
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from jaxtyping import Float, UInt8

from rfgs_core.files import replacing

if TYPE_CHECKING:
    from matplotlib.colors import LinearSegmentedColormap
    from matplotlib.figure import Figure

#: Text and frame of figures: readable on white and on near-black.
INK = "#848b95"
#: Colours of the method, of the truth and of baselines.
METHOD, TRUTH, BASELINE = "#e4572e", "#8d99a6", "#3f88c5"

_STYLE: dict[Any, Any] = {
    "font.size": 9.0, "axes.edgecolor": INK, "axes.labelcolor": INK, "axes.titlecolor": INK,
    "axes.titlesize": 9.5, "axes.linewidth": 0.7, "axes.spines.top": False,
    "axes.spines.right": False, "xtick.color": INK, "ytick.color": INK, "text.color": INK,
    "legend.frameon": False, "legend.labelcolor": INK, "figure.facecolor": "none",
    "axes.facecolor": "none", "savefig.facecolor": "none",
}  # fmt: skip


@contextmanager
def new_figure(width_in: float, height_in: float) -> Iterator[Figure]:
    """A transparent figure in the report's style; no window system is touched."""
    import matplotlib
    from matplotlib.figure import Figure

    with matplotlib.rc_context(_STYLE):
        yield Figure(figsize=(width_in, height_in), layout="constrained")


def power_colours() -> LinearSegmentedColormap:
    """Weak to strong, of medium lightness throughout: visible on light and dark pages."""
    from matplotlib.colors import LinearSegmentedColormap

    return LinearSegmentedColormap.from_list("power", ["#7aa6c2", "#d9a03c", "#d6331f"])


def write_picture(figure: Figure, path: Path) -> None:
    """Writes a figure as a PNG file on white: not every viewer puts a page below it."""
    with replacing(path) as temporary:
        # Without this entry the version of matplotlib would change the bytes.
        figure.savefig(
            temporary, format="png", dpi=110, facecolor="white", metadata={"Software": None}
        )


def figure_uri(figure: Figure) -> str:
    """A figure as an embedded PNG."""
    stream = io.BytesIO()
    # Without this entry the version of matplotlib would change the bytes.
    figure.savefig(stream, format="png", dpi=150, metadata={"Software": None})
    return bytes_uri(stream.getvalue(), "png")


def picture_uri(rgb: UInt8[np.ndarray, "h w 3"] | Float[np.ndarray, "h w 3"]) -> str:
    """A picture, 8 bit or in [0, 1], as an embedded PNG."""
    from PIL import Image

    if rgb.dtype != np.uint8:
        rgb = (np.clip(rgb, 0.0, 1.0) * 255.0 + 0.5).astype(np.uint8)
    stream = io.BytesIO()
    Image.fromarray(rgb).save(stream, format="png", optimize=True)
    return bytes_uri(stream.getvalue(), "png")


def file_uri(data: bytes) -> str:
    """The bytes of a PNG file as an embedded picture."""
    return bytes_uri(data, "png")


def bytes_uri(data: bytes, kind: str) -> str:
    """The bytes of a picture file of a kind, say png, as an embedded picture."""
    return f"data:image/{kind};base64,{base64.b64encode(data).decode('ascii')}"
