# SPDX-License-Identifier: Apache-2.0
"""What a training run is asked to do."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Literal

from rfgs_core.dataset.observed import Observed
from rfgs_core.device import Device
from rfgs_core.errors import RfgsError

Objective = Literal["paper", "csi", "both"]
Recipe = Literal["rfgs", "paper"]
#: prior: where bodies are likely; random: anywhere in the bounds, every frame anew.
Start = Literal["prior", "random"]
EncoderKind = Literal["matched_filter", "cnn", "paths"]
#: complex: the channel itself; power: |csi|² per link and subcarrier; delay_power: the power of
#: each link's delay profile; csi_ratio, conjugate: what the links of one packet between two devices
#: say relative to each other, which knows no phase or timing that they share.
Observe = Literal["complex", "power", "delay_power", "csi_ratio", "conjugate"]
#: all: every packet of a frame helps to tell its change from noise; first: the one at its own time.
Packets = Literal["all", "first"]
#: told: the likelier of standing and sitting, per frame; standing: everybody stands.
Posture = Literal["told", "standing"]
#: auto: where a network for the radio comes with the package; off: a body is a column of a seat.
Limbs = Literal["auto", "off"]
#: empty_room: the capture without anything that moves; learned: the median over the frames.
Background = Literal["empty_room", "learned"]
#: Offsets of devices that are estimated: none, of oscillators, of clocks, or of both.
Calibrate = Literal["none", "phase", "timing", "both"]
#: Parts of the paper's recipe that an ablation leaves out (its table 2): the weight ‖φ‖ in eq. 5,
#: new Gaussians, the frequency gradient as their condition, and pruning.
Part = Literal["rf_weights", "densify", "feature_gradients", "prune"]
#: none; paper: section 3.5; 3dgs: clone, split, prune, reset; residual: at peaks of the
#: back-projected residual; motion: between frames, as many as suit the pace of the bodies.
Density = Literal["none", "paper", "3dgs", "residual", "motion"]


@dataclass(frozen=True, kw_only=True)
class TrainOptions:
    """What a user chooses of a training run; each is an option of `rfgs train`."""

    objective: Objective | None = None
    """csi: the propagation model; paper: eq. 4-7 of the paper; both: their sum. Left out: the
    recipe's own."""
    channel: Observed = "clean"
    """clean: the traced channel; impaired: what `rfgs-factory impair` made of it. The empty room
    stays clean, since its capture can be averaged."""
    observe: Observe = "complex"
    """What the radio reports, and all that any stage sees: complex, the channel itself; power,
    |CSI|^2 per link and subcarrier; delay_power, the power of each link's delay profile; csi_ratio,
    ratios of the links of one packet between two devices; conjugate, products of one with the
    conjugate of another, at an unknown level. The last two share no phase between packets or
    devices, as commodity cards."""
    background: Background = "empty_room"
    """What the moving part is told from: empty_room, its capture; learned, the median over all
    frames of the sequence, where nobody recorded the empty room."""
    static_set: int = 0
    """Gaussians of what stands still, shared by all frames and fitted to the background less the
    direct paths; 0: none. With --background learned, what moves is then taken out of every frame
    before the median is taken again. Needs --observe complex."""
    density: Density | None = None
    """How Gaussians come and go: none; paper, section 3.5 of the paper (needs its losses); 3dgs,
    clone, split, prune and reset; residual, new ones where the back-projected residual peaks;
    motion, between frames, more for a body that moves fast and fewer for one that stands still.
    Left out: paper with the paper's losses, else none."""
    recipe: Recipe = "rfgs"
    """rfgs: our start, objective, rates and steps; paper: the paper's (sections 3.2-3.6)."""
    start: Start | None = None
    """Where Gaussians start: prior, where the radio finds bodies, on what is likely of them;
    random, anywhere in the bounds, which knows of no bodies. Left out: random with the paper's
    recipe and its objective, else prior."""
    calibrate: Calibrate = "none"
    """Estimate each device's phase and timing offset and take them out: of oscillators (phase), of
    clocks (timing) or both. From the empty room first, then together with the Gaussians."""
    seed: int = 0
    """Root seed; 0 is a seed like any other."""
    device: Device = "cpu"
    """Where reflectivities are solved and Gaussians refined: cpu, or cuda, the current GPU."""
    without: tuple[Part, ...] = ()
    """Leave out parts of the paper's recipe, as its table 2 does: rf_weights (in eq. 5), densify,
    feature_gradients (their condition for new Gaussians), prune; see `rfgs bench table2`."""
    temporal: float = 0.0
    """Weight with which Gaussians are held to their place on the body from frame to frame."""
    posture: Posture = "told"
    """told: the radio decides in every frame who stands, who sits and where the knees point, and
    who lies and which way; standing: everybody stands, as is assumed without phases anyway, unless
    limbs are told, see `limbs`."""

    limbs: Limbs = "auto"
    """auto: evidence tells the limbs of people who walk, and of others where six device pairs or
    more are visible; a network that was trained on random worlds those of everybody where one for
    the radio is at hand; Gaussians start on the skins of posed bodies; off: they start around the
    bodies' places, knowing nothing but whether somebody stands, sits or lies."""

    def __post_init__(self) -> None:
        """Refuses values that no option may have.

        Raises:
            RfgsError: One is out of range, or two do not go together.
        """
        if self.without and _objective(self) == "csi":
            raise RfgsError(
                "--without leaves out parts of the paper's losses; expected --objective paper or "
                "both"
            )
        self._need_density()
        if not self.temporal >= 0.0:
            raise RfgsError(f"--temporal {self.temporal}: expected at least 0")

    def _need_density(self) -> None:
        """Refuses to leave out parts of a rule that is not followed."""
        if self.density in (None, "paper"):
            return
        unused = [part for part in self.without if part != "rf_weights"]
        if unused:
            raise RfgsError(
                f"--without {' '.join(unused)} leaves out parts of the paper's density rule, and "
                f"--density {self.density} has others; expected --density paper"
            )


def _objective(options: TrainOptions) -> Objective:
    """The objective that is asked for, or else the recipe's own."""
    return options.objective or ("paper" if options.recipe == "paper" else "csi")


#: Gaussians of a random start, the least of the paper's M (section 3.3).
RANDOM_GAUSSIANS = 100_000

#: What numbers may be; beyond these something else was meant.
_LIMITS: dict[str, tuple[float, float]] = {
    "seed": (-(2**63), 2**64), "static_set": (0, 10**7), "num_gaussians": (1, 10**7),
    "iterations": (0, 10**9), "bodies": (1, 10**4), "excess_m": (0.0, 20.0),
    "solver_steps": (0, 10**6), "batch_entries": (1, 2**31), "batch_points": (1, 2**31),
    "grid_side": (1, 1024), "refine_levels": (0, 64), "unexplained": (0.0, 1.0),
    "temporal": (0.0, 1e9),
}  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class TrainConfig(TrainOptions):
    """Settings of the fit of one frame; saved as JSON beside every result."""

    objective: Objective = "csi"
    """What is descended on."""
    start: Start = "prior"
    """Where Gaussians start."""
    packets: Packets = "first"
    """Which packets of a frame are read; see `packets_to_read`."""
    num_gaussians: int = 6000
    """Moving Gaussians at the start of the first frame."""
    bodies: int = 1
    """Moving bodies in the scene; taken from the dataset's instances."""
    excess_m: float = 0.0
    """What paths over moving bodies are longer than straight lines [m]; taken off before the fit
    and put on again in what is predicted."""
    solver_steps: int = 8
    """Conjugate-gradient steps for the reflectivities."""
    iterations: int = 80
    """Adam steps per frame (the paper: 10,000)."""
    batch_entries: int = 4096
    """Channel entries (links times subcarriers) per Adam step of the channel loss."""
    batch_points: int = 1024
    """Sample points per Adam step of the paper's loss (section 3.6)."""
    grid_side: int = 64
    """Voxels per side of the paper's sample grid (section 3.2)."""
    refine_levels: int = 2
    """How often sample points are refined around energy (the paper: not at all)."""
    encoder: EncoderKind = "matched_filter"
    """What gives φ (eq. 2)."""
    encoder_sha256: str = ""
    """Digest of the learned encoder's file; empty for the others."""
    unexplained: float = 0.5
    """Share of each device pair's power that the model is not asked to explain."""

    def __post_init__(self) -> None:
        """Refuses values that no setting may have.

        Raises:
            RfgsError: One is out of range, or two do not go together.
        """
        super().__post_init__()
        for name, (least, most) in _LIMITS.items():
            value = getattr(self, name)
            if not least <= value <= most:
                option = {"num_gaussians": "gaussians"}.get(name, name)
                bounds = f"at least {least}" if value < least else f"at most {most}"
                raise RfgsError(f"--{option.replace('_', '-')} {value}: expected {bounds}")
        if self.start == "random":
            self._need_paper()

    def _need_paper(self) -> None:
        """Refuses what knows of bodies or of the frame before, beside a start that does not."""
        if self.recipe != "paper" or self.objective != "paper":
            raise RfgsError(
                "--start random is the paper's: its losses draw Gaussians to where echoes come "
                "from; expected --recipe paper with --objective paper"
            )
        if self.temporal:
            raise RfgsError(
                f"--temporal {self.temporal:g} holds Gaussians from frame to frame, and --start "
                "random draws every frame anew; expected --start prior"
            )
        if self.calibrate != "none":
            raise RfgsError(
                f"--calibrate {self.calibrate} finds offsets by the echoes of bodies, and --start "
                "random knows of none; expected --start prior"
            )
        if self.density in ("motion", "residual"):
            raise RfgsError(
                f"--density {self.density} puts Gaussians on bodies, and --start random knows of "
                "none; expected --start prior"
            )

    @staticmethod
    def chosen(
        options: TrainOptions, *, iterations: int | None = None, num_gaussians: int | None = None
    ) -> TrainConfig:
        """Settings of the chosen recipe; what is None is the recipe's own."""
        paper, objective = options.recipe == "paper", _objective(options)
        start = options.start or ("random" if paper and objective == "paper" else "prior")
        own = {"iterations": 10_000, "refine_levels": 0} if paper else {}
        if start == "random":
            own["num_gaussians"] = RANDOM_GAUSSIANS
        asked = {"iterations": iterations, "num_gaussians": num_gaussians}
        values = {field.name: getattr(options, field.name) for field in fields(TrainOptions)}
        values |= {"objective": objective, "start": start}
        asked = {name: value for name, value in asked.items() if value is not None}
        return TrainConfig(**{**values, **own, **asked})
