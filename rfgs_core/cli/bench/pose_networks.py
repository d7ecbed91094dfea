# SPDX-License-Identifier: Apache-2.0
"""`rfgs bench posenets`: pose networks in the manner of published ones."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from rfgs_core.cli.bench.numbers import Part, need_at_least_one

if TYPE_CHECKING:
    from rfgs_core.dataset import Sequence
    from rfgs_core.pose_networks.trial import Outcome, Trial

#: Frames and passes of each size, by manner and by whether there is one room.
_SIZES: dict[str, dict[tuple[str, bool], tuple[int, float]]] = {
    "smoke": {
        ("points", True): (80, 2.0), ("points", False): (80, 2.0),
        ("amplitudes", True): (80, 2.0), ("amplitudes", False): (36, 2.0),
    },
    "full": {
        ("points", True): (6400, 40.0), ("points", False): (8000, 12.0),
        ("amplitudes", True): (1600, 30.0), ("amplitudes", False): (360, 60.0),
    },
}  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class PoseNetworks(Part):
    """Joints by networks in the manner of published ones, trained on our random worlds.

    Without --dataset, on one room split by time, as publications do it. With --dataset, on random
    rooms, and judged on the dataset's one person beside what `rfgs bench limbs` has. Stopped at
    any moment, the same command goes on.
    """

    out: Path
    """Folder of what is learnt from and of the network's weights; what is there is kept."""
    manner: Literal["points", "amplitudes"] = "points"
    """points: a radar's point cloud over frames, as mmMesh; amplitudes: the channel of one layout
    of devices, as Person-in-WiFi 3D."""
    dataset: Path | None = None
    """Dataset with one person, see `rfgs-factory generate`."""
    radio: str | None = None
    """Which radio; left out: mmwave for points, wifi for amplitudes."""
    size: Literal["smoke", "full"] = "smoke"
    """smoke: a minute, to see that it works; full: some ten minutes of one core."""
    frames: int | None = None
    """Frames that are made, a fifth of them to judge by; left out: what the size has."""
    passes: float | None = None
    """How often each frame is seen; left out: what the size has."""
    depth: int = 1
    """Interactions of people's paths that amplitudes are traced with."""
    seed: int = 0
    """Seed of worlds and weights."""

    def numbers(self) -> dict[str, Any]:
        """Trains what is not trained yet, and judges."""
        from rfgs_core.bench import hardware
        from rfgs_core.cli.spreading import need_folder
        from rfgs_core.dataset import open_dataset
        from rfgs_core.errors import RfgsError
        from rfgs_core.threads import one_torch_thread

        need_at_least_one(frames=self.frames)
        if not (self.passes is None or 0.0 < self.passes <= 10_000.0):
            raise RfgsError(f"--passes {self.passes}: expected more than 0")
        if not 0 <= self.seed < 2**63:
            raise RfgsError(f"--seed {self.seed}: expected 0 to 2^63 - 1")
        need_folder(self.out)
        sequence = None if self.dataset is None else open_dataset(self.dataset).sequence()
        trial = self._trial(sequence)
        with one_torch_thread():
            outcome = self._run(trial)
            table = {} if sequence is None else self._table(sequence, trial, outcome)
        return {**outcome.figures, **table, "radio": trial.radio.name, **hardware()}

    def _trial(self, sequence: Sequence | None) -> Trial:
        from rfgs_core.pose_networks.judge import place_of
        from rfgs_core.pose_networks.trial import Trial
        from rfgs_core.radio.presets import preset
        from rfgs_core.worlds.world import refuse_radio

        name = self.radio or {"points": "mmwave", "amplitudes": "wifi"}[self.manner]
        radio = preset(name) if sequence is None else sequence.radio_spec(name)
        refuse_radio(radio)
        frames, passes = _SIZES[self.size][self.manner, sequence is None]
        bound = sequence is not None and self.manner == "amplitudes"
        return Trial(
            self.manner, radio, self.frames or frames, self.passes or passes,
            one_room=sequence is None,
            place=place_of(sequence, name) if bound and sequence is not None else None,
            depth=self.depth, seed=self.seed,
        )  # fmt: skip

    def _run(self, trial: Trial) -> Outcome:
        """Runs the trial beside progress bars."""
        from tqdm import tqdm

        from rfgs_core.pose_networks.trial import run_trial

        with (
            tqdm(total=trial.frames, desc="worlds", unit="frame") as made,
            tqdm(desc=f"training {trial.manner}", unit="step") as bar,
        ):

            def on_step(done: int, steps: int, words: str) -> None:
                bar.total = steps
                bar.set_postfix_str(words, refresh=False)
                bar.update(done - bar.n)

            return run_trial(trial, self.out, made.update, on_step)

    def _table(self, sequence: Sequence, trial: Trial, outcome: Outcome) -> dict[str, Any]:
        """The dataset's table of limbs with the network's row."""
        from tqdm import tqdm

        from rfgs_core.cli.bench.judges import flat
        from rfgs_core.evaluate.limbs import limb_table
        from rfgs_core.limbs.weights import own_network
        from rfgs_core.pose_networks.judge import joints_of

        name = trial.radio.name
        trained = own_network(sequence.coordinates(name)["freq_hz"].values)
        network = None if trained is None else trained.network
        with tqdm(total=len(sequence.frames), desc="limbs") as bar:
            table = limb_table(
                sequence, name, network, sequence.frames, on_frame=bar.update,
                others=partial(joints_of, trial, outcome.network),
            )  # fmt: skip
        return {**flat(table), "frames": len(sequence.frames)}
