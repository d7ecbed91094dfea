# SPDX-License-Identifier: Apache-2.0
"""From a description to a scene bundle, by the way that every dataset takes: Blender and export."""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from dataset_factory.plan.tracers import TracerName
from dataset_factory.scene.blender import Blender
from dataset_factory.scene.builder import build_scene
from dataset_factory.scene.bundle import Bundle, read_bundle
from dataset_factory.scene.devices import choose_devices
from dataset_factory.verify.description import Description
from rfgs_core.files import write_json
from rfgs_core.radio import DevicePose, Radio


@dataclass(frozen=True)
class Workshop:
    """A folder in which scenes are built and exported, each once."""

    folder: Path
    """Where `.blend` files and bundles lie."""
    tracer: TracerName = "sionna"
    """Which tracer is verified."""

    def traces(self, radio: Radio) -> bool:
        """Whether the tracer has such radios at all."""
        return self.tracer == "sionna" or not radio.antennas_move

    def traced(
        self, bundle: Bundle, radio: Radio, devices: list[DevicePose] | None = None, **options: Any
    ) -> Any:
        """The tracer of a radio in a scene.

        Args:
            bundle: The scene.
            radio: The radio.
            devices: Its devices; None takes the scene's own.
            **options: More arguments of the tracer.
        """
        from dataset_factory.trace import tracer_class

        poses = devices_of(bundle, radio) if devices is None else devices
        return tracer_class(self.tracer, radio)(bundle, radio, poses, **options)

    def blend(self, description: Description) -> Path:
        """The Blender file of a description.

        Raises:
            RfgsError: The builder failed.
        """
        text = json.dumps(description.as_json(), sort_keys=True)
        stem = hashlib.sha256(text.encode("utf-8")).hexdigest()[:12]
        out, source = self.folder / f"{stem}.blend", self.folder / f"{stem}.json"
        if out.is_file():
            return out
        write_json(source, description.as_json())
        fresh = self.folder / f"{stem}.new.blend"
        build_scene("a scene of the card", "shapes", str(source), "--out", str(fresh))
        fresh.rename(out)
        return out

    def bundle(self, description: Description, *options: str) -> Bundle:
        """The exported scene of a description.

        Args:
            description: The scene.
            *options: More arguments of the add-on's `export`.
        """
        blend = self.blend(description)
        folder = blend.with_suffix("".join(["", *options]).replace("-", ".") + ".bundle")
        if not folder.is_dir():
            fresh = folder.with_name(f"new.{folder.name}")
            Blender(blend).run("export", "--out", str(fresh), *options)
            fresh.rename(folder)
        return read_bundle(folder)


def devices_of(bundle: Bundle, radio: Radio) -> list[DevicePose]:
    """The scene's own devices, as `generate` chooses them."""
    return choose_devices(bundle, radio)[0]
