# SPDX-License-Identifier: Apache-2.0
"""How much radio it takes: one thing of a radio, its paths or the scene changed at a time."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from rfgs_core.dataset import Sequence, open_dataset
from rfgs_core.device import Device
from rfgs_core.errors import RfgsError, RfgsFormatError
from rfgs_core.evaluate.provenance import hardware, now, versions
from rfgs_core.files import write_json
from rfgs_core.links import refuse_link
from rfgs_core.radio import Radio, preset
from rfgs_core.radio.levels import decibels
from rfgs_core.seals import read_sealed_json, write_sealed_json
from rfgs_core.settings import TrainConfig, TrainOptions
from rfgs_core.study.cases import EVERY_SCENE
from rfgs_core.study.cells import beside_baselines, trained
from rfgs_core.threads import one_torch_thread

#: Devices of our scenes.
DEVICES = tuple(f"access_point_{index}" for index in range(4))
#: Materials of the walls and of the ceiling of our rooms, and scenes without them.
WALLS, CEILING = ("wall_*",), "ceiling_white"
WITHOUT_WALLS = ("parking_lot", "street", "warehouse")
#: Scenes of several people in one room, and how many these are.
CROWDS = {"two_crossing": 2, "crowd_of_four": 4}
#: Fewest subcarriers of a narrow band: fewer hide none from training.
FEWEST_SUBCARRIERS = 8


@dataclass(frozen=True)
class Setup:
    """A scene heard by a changed radio; sweeps share those that agree."""

    scene: str
    """Scene."""
    radio: str
    """Preset that is changed."""
    frames: str
    """Frames A:B:STEP."""
    changes: tuple[tuple[str, float], ...] = ()
    """Fields of the radio, and their values."""
    label: str = ""
    """What the changes are called in names of files."""
    without: tuple[str, ...] = ()
    """Devices of the scene that are left out."""
    metal: tuple[str, ...] = ()
    """Blender materials, as patterns, that are metal instead of what they were built of."""
    depth: int = 2
    """Bounces of the paths that meet people."""
    power_dbm: float | None = None
    """Transmit power of all elements of a channel with thermal noise; None: no noise."""
    seed: int = 0
    """Seed of the training; the data have seed 0."""

    @property
    def heard_by(self) -> str:
        """Name of the radio."""
        return f"{self.radio}-{self.label}" if self.label else self.radio

    @property
    def dataset(self) -> Path:
        """Folder of the dataset within the bench's; seeds share it."""
        noise = "" if self.power_dbm is None else f"-at{self.power_dbm:g}dbm"
        fewer = f"-less{len(self.without)}" if self.without else ""
        metal = f"-metal{len(self.metal)}" if self.metal else ""
        changed = f"{fewer}{metal}{noise}"
        return Path("data") / f"{self.scene}-{self.heard_by}-depth{self.depth}{changed}"

    @property
    def name(self) -> str:
        """Name of its run and file."""
        return f"{self.dataset.name}-seed{self.seed}"

    def generate(self, out: Path) -> tuple[str, ...]:
        """Arguments of the command that makes the dataset, whose radio it writes first.

        Raises:
            RfgsError: A link is where that would lie.
        """
        folder, radio, noise = out / "radios", self.radio, ()
        if self.changes:
            changed = {"like": self.radio, **dict(self.changes)}
            radio = _written(folder / f"{self.heard_by}.json", changed)
        if self.power_dbm is not None:
            thermal = {"thermal_noise": True, "power_dbm": self.power_dbm}
            noise = ("--impairments", _written(folder / f"{self.power_dbm:g}dbm.json", thermal))
        return (
            *("dataset_factory", "generate", self.scene, "--radio", radio),
            *("--frames", self.frames, "--no-images", "--tracer", "fast"),
            *(word for name in self.without for word in ("--drop", name)),
            *(word for name in self.metal for word in ("--material", f"{name}=metal")),
            *("--depth", str(self.depth), *noise, "--out", str(out / self.dataset)),
        )

    @property
    def config(self) -> TrainConfig:
        """How it is trained: as by `rfgs train` without options."""
        channel = "clean" if self.power_dbm is None else "impaired"
        return TrainConfig.chosen(TrainOptions(seed=self.seed, channel=channel))


def _written(path: Path, value: Mapping[str, Any]) -> str:
    """Writes a file that a command of ours reads, and says where it is."""
    refuse_link(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    write_json(path, value)
    return str(path)


#: What a setup is called, in the order of its sweep, and the setup.
Sweep = list[tuple[str, Setup]]


def sweeps(radio: str, scene: str = "living_room_walk", seed: int = 0) -> dict[str, Sweep]:
    """All sweeps of a preset, by what they change; each contains the preset as it is.

    Raises:
        RfgsError: The preset is unknown or its antennas move, or the scene is unknown.
    """
    base = preset(radio)
    if base.antennas_move:
        raise RfgsError(f"--radio {radio}: expected antennas that stand still")
    if scene not in EVERY_SCENE:
        raise RfgsError(f"--scene {scene}: expected one of {', '.join(EVERY_SCENE)}")
    plain = Setup(scene, radio, _frames(scene), seed=seed, depth=min(2, base.deepest))
    found: dict[str, Sweep] = {
        # Twice an ultra-wide band would begin below 0 Hz.
        "bandwidth": [
            _band(plain, base, share)
            for share in (1 / 8, 1 / 4, 1 / 2, 1, 2)
            if share * base.bandwidth_hz < 2.0 * base.centre_hz
        ],
        "elements": [_elements(plain, base, share) for share in (1 / 4, 1 / 2, 1)],
        "devices": [_devices(plain, count) for count in (2, 3, 4)],
        "depth": [
            (f"{depth}", replace(plain, depth=depth)) for depth in range(1, base.deepest + 1)
        ],
        "noise": [_noise(plain, base, less) for less in (None, 0, 10, 20, 30, 40)],
        "people": _people(plain),
    }
    if scene not in WITHOUT_WALLS:
        found["walls"] = [
            ("as built", plain),
            ("metal walls", replace(plain, metal=WALLS)),
            ("metal walls and ceiling", replace(plain, metal=(*WALLS, CEILING))),
        ]
    return found


def _band(plain: Setup, base: Radio, share: float) -> tuple[str, Setup]:
    """A band of the same centre and spacing of subcarriers."""
    width_hz = share * base.bandwidth_hz
    name = f"{width_hz / 1e6:g} MHz"
    count = round(share * base.num_subcarriers)
    if share == 1:
        return name, plain
    changes = (
        ("freq_min_hz", base.centre_hz - width_hz / 2.0),
        ("freq_max_hz", base.centre_hz + width_hz / 2.0),
        ("num_subcarriers", max(count, FEWEST_SUBCARRIERS)),
    )
    return name, replace(plain, changes=changes, label=f"{width_hz / 1e6:.0f}mhz")


def _elements(plain: Setup, base: Radio, share: float) -> tuple[str, Setup]:
    """Arrays with fewer rows and columns, at the same spacing."""
    sides = {side: getattr(base, side) for side in ("tx_rows", "tx_cols", "rx_rows", "rx_cols")}
    fewer = {side: max(round(share * count), min(count, 2)) for side, count in sides.items()}
    tx, rx = (f"{fewer[f'{end}_rows']} × {fewer[f'{end}_cols']}" for end in ("tx", "rx"))
    name = f"TX {tx}, RX {rx}"
    if share == 1:
        return name, plain
    label = "x".join(str(count) for count in fewer.values())
    return name, replace(plain, changes=tuple(fewer.items()), label=label)


def _devices(plain: Setup, count: int) -> tuple[str, Setup]:
    """The first few of a scene's devices."""
    return f"{count}", replace(plain, without=DEVICES[count:])


def _people(plain: Setup) -> Sweep:
    """The scene itself, and scenes of more people, each in a room of its own."""
    others = [scene for scene in CROWDS if scene != plain.scene]
    return [(plain.scene, plain)] + [
        (f"{scene}: {CROWDS[scene]} people", replace(plain, scene=scene, frames=_frames(scene)))
        for scene in others
    ]


def _frames(scene: str) -> str:
    return EVERY_SCENE[scene].frames


def _noise(plain: Setup, base: Radio, less_db: float | None) -> tuple[str, Setup]:
    """Thermal noise at the preset's power or less."""
    if less_db is None:
        return "no noise", plain
    power_dbm = base.power_dbm - less_db
    return f"{power_dbm:g} dBm", replace(plain, power_dbm=power_dbm)


@dataclass(frozen=True)
class SetupPart:
    """A setup as a part of the bench, by itself."""

    setup: Setup
    """Which one."""
    device: Device = "cpu"
    """Where Gaussians are trained."""

    def __str__(self) -> str:
        return self.setup.name

    @property
    def dataset(self) -> Path:
        """Folder of its dataset."""
        return self.setup.dataset

    @property
    def made(self) -> tuple[Path, ...]:
        """Its run and its file."""
        return Path("runs") / self.setup.name, _file(self.setup)

    def make(self, out: Path) -> None:
        """Trains and evaluates it, and writes its file.

        Raises:
            RfgsError: Nobody is heard.
        """
        setup = self.setup
        dataset = open_dataset(out / setup.dataset)
        config = replace(setup.config, device=self.device)
        with one_torch_thread():
            run = trained(dataset, setup.heard_by, config, out / "runs" / setup.name)
            methods = beside_baselines(run)
        noisy = setup.power_dbm is not None
        result = {
            "setup": _plain(setup),
            "dataset": dataset.fingerprint,
            "methods": methods,
            "snr_db": _snr_db(dataset.sequence(), setup.heard_by) if noisy else None,
            "train_s": run.config.train_s,
            "hardware": hardware(),
            "versions": versions(),
            "date": now(),
        }
        write_sealed_json(out / _file(setup), result)


def _snr_db(sequence: Sequence, radio: str) -> float:
    """Power of csi − csi_static over that of the noise in it, both of all measured entries [dB]."""
    static = sequence.csi_static(radio)
    signal = noise = 0.0
    for frame in sequence.frames:
        clean = sequence.csi(radio, frame)
        signal += np.nansum(np.abs(clean - static) ** 2, dtype=np.float64)
        heard = sequence.csi(radio, frame, impaired=True)
        noise += np.nansum(np.abs(heard - clean) ** 2, dtype=np.float64)
    return float(decibels(signal / noise))


def stored(setup: Setup, out: Path) -> dict[str, Any] | None:
    """What a setup's file says; None where there is none.

    Raises:
        RfgsFormatError: The file is damaged, tells of another setup, or lies behind a link.
    """
    path = out / _file(setup)
    refuse_link(path)
    if not path.exists():
        return None
    remedy = "delete it to make it again"
    found = read_sealed_json(path, remedy)
    if found.get("setup") != _plain(setup):
        raise RfgsFormatError(f"{path}: tells of another setup; {remedy}")
    return found


def _file(setup: Setup) -> Path:
    return Path("setups") / f"{setup.name}.json"


def _plain(setup: Setup) -> dict[str, Any]:
    """A setup as JSON holds it."""
    changes = [list(change) for change in setup.changes]
    return {
        **asdict(setup),
        "changes": changes,
        "without": list(setup.without),
        "metal": list(setup.metal),
    }


def every_setup(chosen: Mapping[str, Sweep]) -> list[Setup]:
    """Setups of sweeps, each once."""
    return list(dict.fromkeys(setup for sweep in chosen.values() for _, setup in sweep))
