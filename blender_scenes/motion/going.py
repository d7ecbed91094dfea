# SPDX-License-Identifier: GPL-3.0-or-later
"""Pieces on foot: walk along a path, turn on the spot, stay."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from blender_scenes.motion.feet import feet_at
from blender_scenes.motion.footsteps import Footprint, PlannedSteps, footprint_on
from blender_scenes.motion.gait import Gait, Manner, pelvis_at
from blender_scenes.motion.path import Path, RoundedPath, Spot
from blender_scenes.motion.rotations import about, smoothstep
from blender_scenes.motion.score import Clip, Figure, Posture
from blender_scenes.motion.skeleton import Pose
from blender_scenes.motion.walking import walking_pose

#: Legs are never stretched further than this share of their length.
_STRETCH = 0.992
#: Grid on which the height of the pelvis is found, per step.
_PER_STEP = 12


@dataclass(frozen=True)
class Walk:
    """Walks through points on the floor, from where the person is.

    From standing to standing unless told otherwise. Where the first leg leads off to the side,
    the person first turns on the spot.

    Example:
        >>> Walk([(2.0, 0.0), (2.0, 1.5)], speed_m_s=1.2)  # one rounded corner
        Walk(points=[(2.0, 0.0), (2.0, 1.5)], speed_m_s=1.2, radius_m=0.6, open_start=False, \
open_end=False, label='walk')
    """

    points: Sequence[tuple[float, float]]
    """Points to pass [m]; the person's place comes before them."""
    speed_m_s: float = 1.1
    """Speed in full stride [m/s]."""
    radius_m: float = 0.6
    """Radius of rounded corners [m]."""
    open_start: bool = False
    """In full stride from the beginning: only as the first piece of a score."""
    open_end: bool = False
    """In full stride at the end: only as the last piece of a score."""
    label: str = "walk"
    """Name of the action."""

    def clips(self, figure: Figure, start: Posture) -> list[Clip]:
        """See `Piece`."""
        _must_stand(start, self.label)
        path = RoundedPath([start.place_m, *self.points], self.radius_m)
        aside = _wrapped(float(path.heading(0.0)) - start.heading_rad)
        before: list[Clip] = []
        if abs(aside) > np.radians(8) and not self.open_start:
            before = Turn(float(np.degrees(aside))).clips(figure, start)
            start = before[-1].end
        gait = Gait.for_speed(self.speed_m_s, figure.skeleton.legs, figure.manner)
        count = max(round(path.length_m / gait.step_m), 1)
        step_m = path.length_m / count
        gait = replace(gait, step_m=step_m, step_s=gait.step_s * step_m / gait.step_m)
        steps = self._steps(figure, gait, path, count, start.floor_m)
        return [*before, walk_clip(figure, gait, steps, self.label)]

    def _steps(
        self, figure: Figure, gait: Gait, path: Path, count: int, floor_m: float
    ) -> PlannedSteps:
        inner = gait.step_m * np.arange(0 if not self.open_start else -3, count + 1)
        along = list(inner) + [inner[-1] + gait.step_m * k for k in (1, 2, 3) if self.open_end]
        if not self.open_start:
            along = [0.0, *along]
        if not self.open_end:
            along = [*along, along[-1]]
        return plan_steps(
            gait,
            path,
            np.array(along),
            np.zeros(len(along)),
            np.full(len(along), floor_m),
            open_start=self.open_start,
            open_end=self.open_end,
        )


@dataclass(frozen=True)
class Turn:
    """Turns on the spot with small steps; positive is to the left."""

    angle_deg: float
    """By how much [degrees]."""
    label: str = "turn"
    """Name of the action."""

    def clips(self, figure: Figure, start: Posture) -> list[Clip]:
        """See `Piece`."""
        _must_stand(start, self.label)
        angle = np.radians(self.angle_deg)
        gait = replace(
            Gait.for_speed(0.5 * figure.skeleton.legs.hip[0, 2], figure.skeleton.legs, Manner()),
            step_s=0.55 / figure.manner.cadence,
            toe_out_rad=figure.manner.toe_out_rad,
            toe_off_rad=0.3,
            lift_m=0.05,
            bob_m=0.004,
            lean_rad=0.0,
            pelvis_yaw_rad=0.0,
            drop_m=0.012,
            arm_swing=0.15,
        )
        pairs = max(int(np.ceil(abs(angle) / np.radians(62))), 1)
        # The inner foot leads, the outer one closes up.
        headings = angle * np.repeat(np.arange(pairs + 1), 2) / pairs
        spot = Spot(start.place_m, start.heading_rad)
        steps = plan_steps(
            gait,
            spot,
            np.zeros(len(headings)),
            headings,
            np.full(len(headings), start.floor_m),
            first=0 if angle > 0 else 1,
            flat=True,
        )
        return [walk_clip(figure, gait, steps, self.label)]


@dataclass(frozen=True)
class Stay:
    """Stays as she or he is, standing, sitting or lying, with a little idle sway."""

    duration_s: float
    """How long [s]."""
    label: str = ""
    """Name of the action; by default that of the posture."""

    def clips(self, figure: Figure, start: Posture) -> list[Clip]:
        """See `Piece`."""
        rest = start.pose(figure)
        sway = {"stand": 1.0, "sit": 0.6}.get(start.kind, 0.0)

        def pose(time_s: float) -> Pose:
            fade = smoothstep(time_s / 0.8) * smoothstep((self.duration_s - time_s) / 0.8)
            return _idle(figure, start, rest, time_s, sway * fade)

        return [Clip(self.label or start.kind, self.duration_s, pose, start)]


def plan_steps(
    gait: Gait,
    path: Path,
    along_m: np.ndarray,
    turn_rad: np.ndarray,
    floor_m: np.ndarray,
    first: int = 0,
    flat: bool = False,
    open_start: bool = False,
    open_end: bool = False,
) -> PlannedSteps:
    """Footprints beside a path.

    Args:
        gait: How the person walks.
        path: Where to.
        along_m: Length along the path of each footprint [m], shape (N,).
        turn_rad: What each turns beyond the path's heading, shape (N,).
        floor_m: Height of the ground under each [m], shape (N,).
        first: Number of the first footprint: 0 if it is a left foot, 1 if a right one.
        flat: Feet come down flat, not on the heel.
        open_start: In full stride from the beginning.
        open_end: In full stride to the end.
    """
    prints = []
    for index in range(len(along_m)):
        number, s, turn = first + index, float(along_m[index]), float(turn_rad[index])
        made = footprint_on(path, s, number, gait.width_m, gait.toe_out_rad, turn)
        # The first step rises and the last lands from a short way: less roll of the foot.
        ends = (
            index in (0, 1) and not open_start,
            index >= len(along_m) - 2 and not open_end,
        )
        landing = 0.0 if flat or ends[0] else 0.35 if ends[1] else 1.0
        leaving = 0.75 if ends[0] else 1.0
        place = made.place + np.array([0.0, 0.0, floor_m[index]])
        prints.append(Footprint(place, made.yaw_rad, landing, leaving))
    return PlannedSteps(path, prints, along_m, turn_rad, gait.stance, first, open_start, open_end)


def walk_clip(figure: Figure, gait: Gait, steps: PlannedSteps, label: str) -> Clip:
    """The motion along planned footprints."""
    begin, end = steps.rest_phases
    if steps.open_start:
        # The pelvis passes the beginning of the path.
        begin = steps.first + 3 + gait.stance
    if steps.open_end:
        end = steps.last - 3 + gait.stance
    grid, drops = _drops(gait, figure, steps)
    guide = steps.guide(end)
    last = steps.prints[-1]
    posture = Posture(
        (float(guide.place[0]), float(guide.place[1])),
        guide.heading_rad,
        float(last.place[2]),
    )

    def pose(time_s: float) -> Pose:
        phase = min(begin + time_s / gait.step_s, end)
        drop_m = float(np.interp(phase, grid, drops))
        return walking_pose(gait, figure.skeleton, steps, phase, drop_m)

    return Clip(label, (end - begin) * gait.step_s, pose, posture)


def _drops(gait: Gait, figure: Figure, steps: PlannedSteps) -> tuple[np.ndarray, np.ndarray]:
    """How much lower the pelvis must be carried so that both legs reach the ground.

    Returns:
        Phases and drops [m], shape (N,) each; smooth, and never less than needed.

    Raises:
        ValueError: A footprint is too far away for these legs.
    """
    legs = figure.skeleton.legs
    length = np.linalg.norm(legs.knee - legs.hip, axis=1)
    length = _STRETCH * (length + np.linalg.norm(legs.ankle - legs.knee, axis=1))
    grid = np.arange(steps.first - 1.0, steps.last + 3.0, 1 / _PER_STEP)
    needed = np.zeros(len(grid))
    for index, phase in enumerate(grid):
        feet = feet_at(gait, legs, steps, phase)
        root, pelvis = pelvis_at(gait, legs, steps, phase)
        hips = root + (legs.hip - legs.root) @ pelvis.T
        across = np.linalg.norm(hips[:, :2] - feet.ankle[:, :2], axis=1)
        if (across >= length).any():
            raise ValueError(
                f"a step of {gait.step_m:.2f} m is too long for legs of {length[0]:.2f} m; "
                "walk more slowly"
            )
        highest = feet.ankle[:, 2] + np.sqrt(length**2 - across**2)
        needed[index] = max(float((hips[:, 2] - highest).max()), 0.0)
    # The largest need within a step around, then a mean over no more than that.
    half = _PER_STEP
    padded = np.pad(needed, half, mode="edge")
    windows = np.lib.stride_tricks.sliding_window_view(padded, 2 * half + 1)
    kernel = np.hanning(2 * half + 3)[1:-1]
    spread = np.pad(windows.max(axis=1), half, mode="edge")
    drops = np.convolve(spread, kernel / kernel.sum(), mode="valid")
    # Both ends are plain standing.
    begin, end = steps.rest_phases
    for index, phase in enumerate(grid):
        rise = 1.0 if steps.open_start else smoothstep((phase - begin) / 0.9)
        drops[index] *= rise if steps.open_end else rise * smoothstep((end - phase) / 0.9)
    return grid, drops


def _idle(figure: Figure, start: Posture, rest: Pose, time_s: float, amount: float) -> Pose:
    """Sways the trunk about the ankles or the seat by a few millimetres."""
    if amount <= 0:
        return rest
    # Two slow incommensurable waves, shifted by where the person is, so that two people differ.
    seed = 7.1 * start.place_m[0] + 3.7 * start.place_m[1]
    aside = np.sin(2 * np.pi * 0.21 * time_s + seed) + 0.6 * np.sin(2 * np.pi * 0.37 * time_s)
    ahead = np.sin(2 * np.pi * 0.17 * time_s + 2 * seed)
    tilt = about(start.ahead, -0.006 * amount * aside) @ about(start.left, 0.006 * amount * ahead)
    look = about(np.array([0.0, 0.0, 1.0]), 0.05 * amount * np.sin(0.9 * time_s + seed))
    turns = {}
    for name, turn in rest.turns.items():
        leg = name.startswith(("root", "upperleg", "lowerleg", "foot", "toe"))
        turns[name] = turn if leg else tilt @ turn
    turns["head"] = look @ turns["head"]
    return Pose(rest.root, turns)


def _must_stand(start: Posture, label: str) -> None:
    if start.kind != "stand":
        raise ValueError(f"expected to {label} from standing, but the person does: {start.kind}")


def _wrapped(angle_rad: float) -> float:
    """The same angle between -pi and pi."""
    return float(np.angle(np.exp(1j * angle_rad)))
