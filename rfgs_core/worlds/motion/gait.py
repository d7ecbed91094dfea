# SPDX-License-Identifier: Apache-2.0
"""Walking from joint angles over the stride; the foot that bears stays where it is.

Angles are those of adults at their own pace in Winter, Biomechanics and Motor Control of Human
Movement (4th edition, 2009), and Perry and Burnfield, Gait Analysis (2010), read off every 5 % of
the stride from heel strike on and kept as seven harmonics. Their swing is scaled until a stride
is as long as asked. Step length over cadence follows the walk ratio (Sekiya and Nagasaki 1998).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rfgs_core.articulated import Body
from rfgs_core.worlds.motion.arms import Shoulder, place_arm
from rfgs_core.worlds.motion.contact import bearing_soles, carried
from rfgs_core.worlds.motion.curves import X, Y, Z, about, between, noise, smoothed
from rfgs_core.worlds.motion.manner import carry, gesture, quiet_arm
from rfgs_core.worlds.motion.motion import RATE_HZ
from rfgs_core.worlds.motion.track import SIDES, SIGN, Track

_HARMONICS = 7
#: Flexion of hip and knee and dorsiflexion of the ankle every 5 % of the stride [degree].
_HIP = (20, 19, 17, 13, 9, 4, 0, -4, -8, -10, -11, -9, -4, 4, 12, 18, 22, 23, 22, 21)
_KNEE = (4, 11, 17, 19, 18, 15, 12, 9, 7, 8, 13, 23, 38, 54, 63, 61, 50, 32, 13, 4)
_ANKLE = (0, -4, -4, 0, 2, 4, 6, 8, 9, 10, 7, -2, -14, -17, -8, 0, 2, 3, 2, 1)
#: Step length over cadence of a person of 1.7 m [m per step/min].
_WALK_RATIO = 0.0060
#: A foot bears from heel strike to here of its stride, and takes this long to begin or end.
_TOE_OFF, _FADE = 0.60, 0.08
#: Its sole comes down until the first of these and lies flat until the second; after the third the
#: ankle alone lifts the heel (Perry and Burnfield: foot flat at 12 %, heel off at 31 %).
_FLAT, _HEEL_LIFTS, _HEEL_OFF = 0.10, 0.30, 0.48
#: Toes that bend at the ball take this share of a lifted heel's angle until they leave the floor
#: (by the heights of an ankle over the ball and over the tip of a foot); ours is one piece.
_TOES_BEND = 0.4


@dataclass(frozen=True)
class Gait:
    """How somebody walks."""

    speed_m_s: float
    """Mean speed."""
    stride_s: float
    """Time from one heel strike of a foot to the next."""
    knee: float = 1.0
    """How far knees are lifted, as a share of the ordinary."""
    stoop: float = 0.03
    """How far the trunk leans ahead [rad]."""
    adduction: float = 0.07
    """How far legs are held inwards [rad]."""
    toe_out: float = 0.12
    """How far feet point outwards [rad]."""
    list_rad: float = 0.06
    """How far the pelvis drops on the side of the swinging leg [rad]."""
    turn_rad: float = 0.07
    """How far it turns with the leg ahead [rad]."""
    limp: float = 0.0
    """How much later than half a stride the right foot follows, as a share of the stride."""


def random_gait(rng: np.random.Generator, body: Body, speed_m_s: float) -> Gait:
    """A random gait at a speed [m/s]."""
    ratio = _WALK_RATIO * body.height_m / 1.7 * np.clip(rng.normal(1.0, 0.13), 0.7, 1.35)
    step_m = np.sqrt(ratio * speed_m_s * 60.0)
    return Gait(
        speed_m_s,
        2.0 * step_m / speed_m_s,
        rng.uniform(0.85, 1.15),
        np.clip(rng.normal(0.05, 0.09), -0.06, 0.45),
        rng.normal(0.06, 0.025),
        rng.normal(0.10, 0.09),
        rng.uniform(0.02, 0.09),
        rng.uniform(0.02, 0.12),
        rng.choice([0.0, rng.normal(0.0, 0.03)]),
    )


def curve(table: tuple[int, ...], phase: np.ndarray) -> np.ndarray:
    """Angle [rad] at phases of the stride (1 is a whole one) from a table in degrees."""
    waves = np.fft.rfft(np.radians(table))[: _HARMONICS + 1] / len(table)
    turns = np.exp(2j * np.pi * phase[:, None] * np.arange(_HARMONICS + 1))
    return 2.0 * (turns @ waves).real - waves[0].real


def set_legs(
    track: Track, gait: Gait, phase: np.ndarray, swing: np.ndarray | float, going: np.ndarray
) -> None:
    """Pelvis and legs at phases of the left foot's stride [T].

    Args:
        track: Gets pelvis, without heading, and legs.
        gait: How.
        phase: Phase of the left foot's stride; the right one's is half a stride on.
        swing: How far hips swing, as a share of the ordinary.
        going: From 0, standing, to 1, walking, shape [T].
    """
    tilt = 0.1 + 0.4 * gait.stoop
    wave = 2.0 * np.pi * phase
    track.pelvis(
        0.0,
        tilt,
        gait.list_rad * going * np.sin(wave + 0.3),
        -gait.turn_rad * going * np.cos(wave),
    )
    for side in SIDES:
        own = phase if side == "left" else phase + 0.5 - gait.limp
        hip, knee, ankle = (curve(table, own) for table in (_HIP, _KNEE, _ANKLE))
        middle = np.radians(6.0)
        lifted = gait.knee * (0.6 + 0.4 * np.minimum(swing, 1.2))
        # Slow steps lift the knee less, but toes must still pass over the floor.
        knee = lifted * knee + (1 - lifted) * np.radians(8.0)
        knee = np.radians(4.0) + going * (knee - np.radians(4.0))
        hip = np.radians(4.0) + going * (middle + swing * (hip - middle) - np.radians(4.0))
        in_swing = np.exp(-0.5 * (((own % 1.0) - 0.8) / 0.07) ** 2)
        hip = hip + 0.06 * going * in_swing
        ankle = going * (np.minimum(swing, 1.1) * ankle + 0.08 * in_swing)
        # Angles of several sources would leave whoever bears on the tips of their toes.
        flat, rolls = _bears_flat(own % 1.0)
        level = flat + (1.0 - flat) * _TOES_BEND * rolls
        track.leg(
            side,
            hip + tilt,
            knee,
            ankle + level * (knee - hip - ankle),
            -gait.adduction,
            gait.toe_out,
        )


def _bears_flat(own: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """How far a sole lies flat, and how far it rolls over the floor, at phases of its stride."""
    down = between(own, 0.0, _FLAT)
    lifted = between(own, _HEEL_LIFTS, _HEEL_OFF)
    return down * (1.0 - lifted), down * (1.0 - between(own, _TOE_OFF, _TOE_OFF + _FADE))


def travel(track: Track, gait: Gait, phase: np.ndarray) -> np.ndarray:
    """Where the root goes on the floor [T, 2] if the foot that bears stays where it is."""
    track.root[:, :2] = 0.0
    bears = {}
    for side in SIDES:
        own = (phase if side == "left" else phase + 0.5 - gait.limp) % 1.0
        # Heel strike is at 0 and 1; fades reach half a width to both sides.
        since = (own + 0.5 * _FADE) % 1.0
        bears[side] = between(since, 0.0, _FADE) * (
            1.0 - between(since, _TOE_OFF, _TOE_OFF + _FADE)
        )
    return carried(*bearing_soles(track, bears))


def swing_for(body: Body, gait: Gait) -> float:
    """Share by which hips must swing so that strides are as long as speed and time ask."""
    wanted = gait.speed_m_s * gait.stride_s

    def stride_m(swing: float) -> float:
        track = Track(body, 2.0)
        phase = np.linspace(0.0, 2.0, len(track.times))
        set_legs(track, gait, phase, swing, np.ones(len(phase)))
        return 0.5 * float(travel(track, gait, phase)[-1, 0])

    low, high = 0.1, 2.2
    for _ in range(12):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if stride_m(middle) < wanted else (low, middle)
    return 0.5 * (low + high)


def walk(rng: np.random.Generator, body: Body) -> Track:
    """Walks: any speed, straight or in curves, from or to a halt, arms as they come."""
    return _walking(rng, body, rng.uniform(0.3, 1.8), gesturing=False)


def walk_and_gesture(rng: np.random.Generator, body: Body) -> Track:
    """Walks and does something with the arms."""
    return _walking(rng, body, rng.uniform(0.3, 1.3), gesturing=True)


def _walking(rng: np.random.Generator, body: Body, speed_m_s: float, gesturing: bool) -> Track:
    track = Track(body, rng.uniform(4.0, 8.0))
    gait = random_gait(rng, body, speed_m_s)
    swing = swing_for(body, gait)
    going = np.ones(len(track.times))
    if rng.uniform() < 0.25:
        going = going * between(track.times, 0.3, 1.5)
    if rng.uniform() < 0.25:
        going = going * (1.0 - between(track.times, track.times[-1] - 1.6, track.times[-1] - 0.4))
    rate = (0.5 + 0.5 * going) / gait.stride_s
    phase = rng.uniform() + np.cumsum(rate) / RATE_HZ
    set_legs(track, gait, phase, swing, going)
    heading = _headings(rng, track.times, speed_m_s)
    track.local[:, 0] = about(Z, heading) @ track.local[:, 0]
    _upper_body(rng, track, gait, phase, going * swing, gesturing)
    track.root[:, :2] = smoothed(travel(track, gait, phase), RATE_HZ, 0.03)
    track.ground()
    return track


def _headings(rng: np.random.Generator, times: np.ndarray, speed_m_s: float) -> np.ndarray:
    """Where somebody looks who walks [rad]: straight on, in a curve, wandering, or turning."""
    kind = rng.choice(["straight", "curve", "wander", "turn"], p=[0.3, 0.25, 0.25, 0.2])
    if kind == "curve":
        return rng.uniform(-0.7, 0.7) * times
    if kind == "wander":
        rate = rng.uniform(0.1, 0.8) * noise(rng, times, 0.3)
        return np.cumsum(rate) / RATE_HZ
    if kind == "turn":
        angle = rng.uniform(-np.pi, np.pi)
        start = rng.uniform(0.5, times[-1] - 2.0)
        # Nobody turns on the spot at full speed.
        lasts = abs(angle) / rng.uniform(0.9, 1.8) * (0.7 + 0.3 * speed_m_s) * 1.5
        return angle * between(times, start, start + lasts)
    return 0.03 * noise(rng, times, 0.2)


def _upper_body(
    rng: np.random.Generator, track: Track, gait: Gait, phase: np.ndarray, swing: np.ndarray,
    gesturing: bool,
) -> None:  # fmt: skip
    """Trunk against the pelvis, head, and arms against the legs."""
    times, wave = track.times, 2.0 * np.pi * phase
    track.trunk(
        0.6 * gait.stoop - 0.05 + 0.015 * np.cos(2.0 * wave + 1.0),
        -0.6 * gait.list_rad * np.sin(wave + 0.3) * swing,
        (gait.turn_rad + rng.uniform(0.0, 0.12)) * np.cos(wave) * swing,
    )
    track.gaze(
        -0.5 * gait.stoop + rng.normal(0.0, 0.1) + 0.04 * noise(rng, times, 0.4),
        0.0,
        rng.uniform(0.0, 0.4) * noise(rng, times, 0.3) - 0.03 * np.cos(wave) * swing,
    )
    loads = rng.choice(["none", "both", "one"], p=[0.8, 0.1, 0.1])
    busy: tuple[str, ...] = ()
    if gesturing:
        busy = SIDES if rng.uniform() < 0.4 else (str(rng.choice(SIDES)),)
        for side in busy:
            gesture(rng, track, side)
    elif loads != "none":
        busy = SIDES if loads == "both" else (str(rng.choice(SIDES)),)
        carry(rng, track, both=loads == "both", side=busy[0])
    size = rng.choice([0.0, rng.uniform(0.1, 0.5), rng.uniform(0.4, 0.8)], p=[0.15, 0.6, 0.25])
    if not busy and rng.uniform() < 0.1:
        for side in SIDES:
            quiet_arm(rng, track, side)
        return
    for side in SIDES:
        if side not in busy:
            _swing_arm(rng, track, side, wave, size * np.minimum(swing, 1.4))


def _swing_arm(
    rng: np.random.Generator, track: Track, side: str, wave: np.ndarray, size: np.ndarray
) -> None:
    """An arm that swings against the leg of its side."""
    own = wave if side == "left" else wave + np.pi
    own = own + rng.normal(0.0, 0.15)
    shoulder = Shoulder(track.body, side)
    hang = shoulder.hang(0.0, rng.uniform(0.0, 0.1))
    forward = -size * np.cos(own)
    flexion = rng.uniform(-0.05, 0.08) + forward * np.where(forward > 0.0, 0.8, 1.0)
    elbow = rng.uniform(0.15, 0.5) + rng.uniform(0.2, 0.9) * (size + forward) * 0.5
    # The hand comes a little inwards ahead of the trunk.
    inward = about(X, -SIGN[side] * 0.25 * np.maximum(forward, 0.0))
    place_arm(track, side, inward @ hang.shoulder @ about(Y, -flexion), elbow)
