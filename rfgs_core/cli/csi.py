# SPDX-License-Identifier: Apache-2.0
"""`rfgs csi`: measured and predicted channel of one link as a picture."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path

import tyro


@dataclass(frozen=True)
class CsiArgs:
    """Draws what was measured and what a run predicts of one link, over its frames.

    Shows csi − csi_static between two devices over subcarriers and over path length, the mean power
    of their antenna pairs; entries held out of training are in it. In Blender, Show CSI of the
    Channels panel draws the same.

    Example: rfgs csi run --tx-device 0 --rx-device 2 --out link.png
    """

    run: tyro.conf.Positional[Path]
    """Folder of a trained run."""
    tx_device: int = 0
    """Transmitting device, counted from 0 as in the dataset."""
    rx_device: int | None = None
    """Receiving device; the first that hears the transmitter when left out."""
    out: Path | None = None
    """PNG to write; RUN/predictions/link_TX_RX.png when left out."""


def run(args: CsiArgs) -> int:
    """Writes the picture and prints how much is explained; exit code 0."""
    from rfgs_core.errors import RfgsError
    from rfgs_core.figures.links import link_channels, write_link_chart
    from rfgs_core.run import open_run

    if args.out is not None and args.out.suffix.lower() != ".png":
        raise RfgsError(f"--out {args.out}: expected a file name that ends in .png")
    trained = open_run(args.run)
    trained.need_frames()
    rx_device = args.rx_device
    if rx_device is None:
        pairs = trained.sequence.layout(trained.config.radio).device_pairs
        rx_device = next((rx for tx, rx in pairs if tx == args.tx_device), None)
        if rx_device is None:
            senders = ", ".join(str(tx) for tx in sorted({tx for tx, _ in pairs}))
            raise RfgsError(
                f"--tx-device {args.tx_device}: nothing of it is measured; expected one of "
                f"{senders}"
            )
    link = link_channels(trained, args.tx_device, rx_device)
    name = f"link_{args.tx_device}_{rx_device}.png"
    out = args.out or args.run / "predictions" / name
    write_link_chart(out, link)
    sys.stdout.write(
        f"{out}: device {args.tx_device} to {rx_device}, {len(link.frames)} frames; "
        f"{link.explained}\n"
    )
    return 0
