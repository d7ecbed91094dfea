# SPDX-License-Identifier: Apache-2.0
"""What a study consists of: its scenes, conditions and radios, and where each case lies."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from rfgs_core.dataset.observed import Observed
from rfgs_core.errors import RfgsError
from rfgs_core.radio import preset


@dataclass(frozen=True)
class StudyScene:
    """One scene of ours and the part of it that is looked at."""

    frames: str
    """Evenly spaced frames A:B:STEP."""
    least_depth: int = 1
    """Bounces without which people would not be heard at all."""
    radio: str = "mmwave"
    """Radio of the gallery."""


@dataclass(frozen=True)
class Condition:
    """How the channels come about."""

    label: str
    """In words."""
    depth: int
    """Bounces of the paths that meet people."""
    channel: Observed
    """Which channel is fitted."""


SCENES: dict[str, StudyScene] = {
    "living_room_walk": StudyScene("10:55:15"),
    "two_crossing": StudyScene("10:64:18"),
    # Nothing is heard of people behind a wall unless waves pass it on both ways, and 60 GHz do not.
    "through_wall": StudyScene("10:70:20", least_depth=3, radio="wifi"),
    "office_sit_stand": StudyScene("10:85:25"),
}

#: All scenes of ours: the study's four, and those that the gallery shows beside them.
EVERY_SCENE: dict[str, StudyScene] = SCENES | {
    "corridor": StudyScene("5:55:10"),
    # Four people take minutes a frame.
    "crowd_of_four": StudyScene("25:55:30"),
    # One frame of each of its six gestures.
    "gestures": StudyScene("15:175:32"),
    "bedroom_fall": StudyScene("10:65:11"),
    "stairs": StudyScene("10:75:13"),
    # Paths are longer here than what `mmwave` tells apart.
    "parking_lot": StudyScene("6:66:20", radio="wifi"),
    "street": StudyScene("8:68:20", radio="wifi"),
    "warehouse": StudyScene("10:70:20", radio="wifi"),
}

CONDITIONS: dict[str, Condition] = {
    "clean": Condition("clean, direct paths only: an inverse crime", 1, "clean"),
    "impaired": Condition(
        "thermal noise, 10 bits, phase noise (`lab`); `mmwave` with 64 chirps per frame",
        1,
        "impaired",
    ),
    "bounces": Condition("clean, up to two wall bounces", 3, "clean"),
}

#: What names of earlier studies are called now.
_RENAMED = {"walls": "bounces"}

#: Radios of the study. Those that are not traced deep enough have no case of a condition or scene.
RADIOS = ("wifi", "mmwave", "uwb")

#: Impairments that every dataset of the study carries beside its clean channels.
IMPAIRMENTS = "lab"

#: Packets per frame of impaired radios whose noise hides people in a single one.
PACKETS = {"mmwave": 64}


@dataclass(frozen=True)
class Case:
    """One training and its evaluation."""

    scene: str
    """Name of the scene."""
    condition: str
    """Name of the condition."""
    radio: str
    """Name of the radio."""
    seed: int
    """Root seed of the training; the data have seed 0 in every case."""

    @property
    def depth(self) -> int:
        """Bounces of the paths that meet people."""
        return max(CONDITIONS[self.condition].depth, SCENES[self.scene].least_depth)

    @property
    def packets(self) -> int:
        """Packets per frame."""
        impaired = CONDITIONS[self.condition].channel == "impaired"
        return PACKETS.get(self.radio, 1) if impaired else 1

    @property
    def dataset(self) -> Path:
        """Folder of the dataset within the study; seeds share one, and channels of one packet."""
        several = f"-packets{self.packets}" if self.packets > 1 else ""
        return Path("data") / f"{self.scene}-{self.radio}-depth{self.depth}{several}"

    @property
    def run(self) -> Path:
        """Folder of the run within the study."""
        return Path("runs") / f"{self.scene}-{self.condition}-{self.radio}-seed{self.seed}"

    def generate(self, out: Path) -> tuple[str, ...]:
        """Arguments of the command that makes the dataset."""
        return (
            *("dataset_factory", "generate", self.scene, "--radio", self.radio),
            *("--frames", SCENES[self.scene].frames, "--depth", str(self.depth)),
            *("--no-images", "--impairments", IMPAIRMENTS),
            *("--packets-per-frame", str(self.packets)),
            *("--out", str(out / self.dataset)),
        )

    def train(self, out: Path) -> tuple[str, ...]:
        """Arguments of the command that trains; pictures play no part in the study."""
        return (
            *("rfgs_core.cli", "train", str(out / self.dataset), "--radio", self.radio),
            *("--channel", CONDITIONS[self.condition].channel, "--seed", str(self.seed)),
            *("--no-shader", "--out", str(out / self.run)),
        )

    def evaluate(self, out: Path) -> tuple[str, ...]:
        """Arguments of the command that evaluates."""
        return "rfgs_core.cli", "eval", str(out / self.run)


def cases(
    scenes: Sequence[str], conditions: Sequence[str], radios: Sequence[str], seeds: int
) -> list[Case]:
    """All cases, those of one dataset beside each other.

    Raises:
        RfgsError: A scene, condition or radio is unknown, or nothing is left to do.
    """
    for kind, asked, known in (
        ("scene", scenes, SCENES),
        ("condition", conditions, CONDITIONS),
        ("radio", radios, RADIOS),
    ):
        if not asked:
            raise RfgsError(f"--{kind}s without any: expected some of {', '.join(known)}")
        for name in asked:
            if name not in known:
                now = f" (it is called {_RENAMED[name]} now)" if name in _RENAMED else ""
                raise RfgsError(f"{kind} {name!r}{now}: expected some of {', '.join(known)}")
    if seeds < 1:
        raise RfgsError(f"--seeds {seeds}: expected at least 1")
    chosen = [
        Case(scene, condition, radio, seed)
        for scene in dict.fromkeys(scenes)
        for radio in dict.fromkeys(radios)
        for condition in dict.fromkeys(conditions)
        for seed in range(seeds)
    ]
    traced = [case for case in chosen if case.depth <= preset(case.radio).deepest]
    if not traced:
        raise RfgsError(
            f"no case: {', '.join(radios)} is not traced as deep as {', '.join(scenes)} under "
            f"{', '.join(conditions)} needs"
        )
    return traced
