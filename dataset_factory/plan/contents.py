# SPDX-License-Identifier: Apache-2.0
"""What a dataset shall hold, and which of it is still missing."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field, replace
from importlib import metadata
from pathlib import Path
from typing import Any, Literal

from dataset_factory.plan.tracers import TracerName
from dataset_factory.scene.catalogue import Scene, blend_digest
from dataset_factory.scene.radios import chosen_radios
from rfgs_core.dataset.csi_store import chunk_file
from rfgs_core.dataset.names import SequenceFiles
from rfgs_core.errors import RfgsError
from rfgs_core.frames import parse_frames
from rfgs_core.radio import PRESETS, Radio, preset
from rfgs_core.radio.files import checked_radio, radio_values

#: More packets per frame than any radio sends.
MAX_PACKETS = 10_000
#: Packages whose version may change a byte of the data.
PACKAGES = ("rfgs", "sionna-rt", "mitsuba", "drjit", "numpy", "scipy", "numba", "zarr", "OpenEXR")


@dataclass(frozen=True)
class Plan:
    """Everything that decides the bytes of a dataset."""

    scene: str
    """Name of the scene."""
    blend_sha256: str
    """Digest of the Blender file."""
    radios: list[str]
    """Presets to trace."""
    frames: str
    """Frames `A:B[:STEP]`, empty for the scene's own range."""
    cameras: int
    """How many cameras, 0 for all."""
    resolution: int
    """Longer side of the pictures [px]."""
    samples: int
    """Samples per pixel."""
    depth: int
    """Interactions a path with a person may have."""
    shadow: Literal["kirchhoff", "hard"]
    """How bodies shadow paths."""
    seed: int
    """Root seed."""
    images: bool
    """Whether pictures are rendered."""
    impairments: dict[str, Any] | None = None
    """Settings of the impaired channels beside the clean ones; none makes none."""
    packets_per_frame: int = 1
    """Packets or chirps of each frame; 1 leaves every radio its own number, as do antennas that
    move, whose pulses are their places."""
    paths: bool = False
    """Whether the paths behind every channel are stored."""
    tracer: TracerName = "sionna"
    """What traces the channels."""
    overrides: dict[str, Any] = field(default_factory=dict)
    """What the user says about the scene, in the words of the YAML file."""
    custom_radios: dict[str, dict[str, Any]] = field(default_factory=dict)
    """All fields of the radios that are no presets, by name, as JSON holds them."""

    def radio(self, name: str) -> Radio:
        """One of the plan's radios, with the packets asked for."""
        custom = self.custom_radios.get(name)
        radio = checked_radio(name, custom) if custom else preset(name)
        # Places of antennas that move are no packets.
        if self.packets_per_frame == 1 or radio.antennas_move:
            return radio
        return replace(radio, samples_per_frame=self.packets_per_frame)

    def with_radio(self, radio: Radio) -> Plan:
        """The plan with another definition of one of its radios."""
        return replace(self, custom_radios={**self.custom_radios, radio.name: radio_values(radio)})


def make_plan(scene: Scene, radios: tuple[str, ...], frames: str, **options: Any) -> Plan:
    """Checks the request and fixes it.

    Args:
        scene: Where the data comes from.
        radios: Presets, files of radios, or `scene`.
        frames: Frames `A:B[:STEP]`, one number, or empty.
        **options: The other fields of `Plan`.

    Raises:
        RfgsError: A radio is unknown, unusable or named twice, or a number is out of range.
    """
    if not radios:
        raise RfgsError("no radio given; expected at least one, such as wifi")
    chosen = chosen_radios(radios)
    limits = {"depth": (1, 3), "resolution": (16, 8192), "samples": (1, 65536), "cameras": (0, 999)}
    for name, (low, high) in limits.items():
        if not low <= options[name] <= high:
            raise RfgsError(f"--{name} {options[name]}: expected {low} to {high}")
    moving = [name for name, radio in chosen.items() if radio.antennas_move]
    if options.get("paths") and moving:
        raise RfgsError(
            f"--paths: radio {moving[0]!r} has antennas that move, paths are told between antennas "
            "that stand still; leave one of them out"
        )
    if options.get("tracer") == "fast":
        _refuse_fast(bool(options.get("paths")), moving)
    refuse_packets(options.get("packets_per_frame", 1))
    return Plan(
        scene=scene.name,
        blend_sha256=blend_digest(scene),
        radios=sorted(chosen),
        custom_radios={
            name: radio_values(radio) for name, radio in chosen.items() if name not in PRESETS
        },
        frames=whole_frames(frames),
        **options,
    )


def _refuse_fast(paths: bool, moving: list[str]) -> None:
    """Refuses what the fast tracer does not do.

    Raises:
        RfgsError: Tables of paths are wanted, or a radio's antennas move.
    """
    if paths:
        raise RfgsError("--tracer fast keeps no tables of paths; leave --paths out")
    if moving:
        raise RfgsError(
            f"--tracer fast: radio {moving[0]!r} has antennas that move, the fast tracer's stand "
            "still; use --tracer sionna"
        )


def refuse_packets(packets: int) -> None:
    """Refuses numbers of packets per frame that no radio sends.

    Raises:
        RfgsError: There are none, or too many.
    """
    if not 1 <= packets <= MAX_PACKETS:
        raise RfgsError(f"--packets-per-frame {packets}: expected 1 to {MAX_PACKETS}")


def whole_frames(frames: str) -> str:
    """Frames as the add-on takes them: empty or a range, also where one number was given.

    Raises:
        RfgsError: The text names no frames.
    """
    if frames and len(only := parse_frames(frames)) == 1:
        return f"{only[0]}:{only[0]}"
    return frames


def frame_runs(frames: list[int]) -> list[str]:
    """Ascending frames as few `A:B:STEP` texts.

    Example:
        >>> frame_runs([1, 2, 3, 7, 10, 13])
        ['1:3:1', '7:13:3']
    """
    runs: list[list[int]] = []
    for frame in frames:
        run = runs[-1] if runs else []
        if run and (len(run) == 1 or frame - run[-1] == run[1] - run[0]):
            run.append(frame)
        else:
            runs.append([frame])
    return [f"{run[0]}:{run[-1]}:{run[1] - run[0] if len(run) > 1 else 1}" for run in runs]


def versions() -> dict[str, str]:
    """Versions of the packages that make the data."""
    found = {}
    for name in PACKAGES:
        try:
            found[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            found[name] = "source tree"
    return found


def refuse_other_plan(
    path: Path, plan: Plan, stored: dict[str, Any], stored_versions: dict[str, str]
) -> None:
    """Refuses to mix two configurations in one folder.

    Raises:
        RfgsError: Naming the first field that differs.
    """
    wanted = {**asdict(plan), **{f"version of {k}": v for k, v in versions().items()}}
    found = {**stored, **{f"version of {k}": v for k, v in stored_versions.items()}}
    for name, value in wanted.items():
        if name in found and found[name] != value:
            raise RfgsError(
                f"{path} was made with {name} = {found[name]!r}, this run asks for {value!r}; "
                "use the same settings, or another --out"
            )


def missing_channels(
    files: SequenceFiles, radio: str, frames: list[int], paths: bool = False
) -> list[int | None]:
    """Frames whose channel is not finished, None standing for the static channel.

    Args:
        files: Where things lie.
        radio: Name of the radio.
        frames: All frames.
        paths: Whether a channel needs its table of paths.
    """
    store = files.csi(radio)
    rows: list[tuple[int | None, int | None]] = [(None, None), *enumerate(frames)]
    return [
        frame
        for index, frame in rows
        if not (
            files.csi_done(radio, frame).is_file()
            and chunk_file(store, index).is_file()
            and (files.paths(radio, frame).is_file() or not paths)
        )
    ]


def missing_pictures(files: SequenceFiles, frames: list[int]) -> list[int]:
    """Frames whose pictures are not finished."""
    return [frame for frame in frames if not files.images_done(frame).is_file()]
