# SPDX-License-Identifier: Apache-2.0
"""What training does to frames: other gains, noise, silent devices, and a mirror."""

from __future__ import annotations

import functools
import math

import torch
from jaxtyping import Bool, Float
from torch import Tensor

from rfgs_core.limbs.tokens import Packed, Tokens, relative_power, tokens

#: Share of frames that miss one device (pair), and a second one.
_ONE_SILENT, _TWO_SILENT = 0.5, 0.1
#: Noise below the peak of a pair, log10: quietest, and how much louder it may be.
_QUIET, _LOUDER = -3.2, 2.0
#: Share of frames whose packets were filtered against thermal noise, and that noise below the peak
#: of the pair that hears the body best, log10: loudest, and how much quieter it may be.
_FILTERED, _LOUD, _QUIETER = 0.3, -0.5, 3.0
#: A filter drops what is less than this over the noise.
_DROPPED = 2.0
#: Samples of noise that are kept.
_POOL = 2**22
#: Deviation of a pair's gain, log10 of power.
_GAIN = 0.35 / math.log(10.0)


def disturbed(packed: Packed, generator: torch.Generator) -> tuple[Tokens, Bool[Tensor, "frame"]]:
    """Frames with other gains and noise, some of their devices silent, half of them mirrored."""
    count, pairs = packed.there.shape
    device = packed.there.device
    draw = functools.partial(torch.rand, generator=generator, device=device)
    power = relative_power(packed)
    noise = draw(count, pairs, 1, 1, 1) * _LOUDER + _QUIET
    power = power + _speckle(power.shape, generator) * 10.0**noise
    power = filtered(power, packed, generator)
    packed = packed._replace(there=packed.there & (power.amax((2, 3, 4)) > 0.0))
    gain = torch.randn(packed.level.shape, generator=generator, device=device)
    packed = packed._replace(level=packed.level + _GAIN * gain)
    there = _heard(packed, generator)
    order = torch.where(there, draw(count, pairs), -1.0)
    mirror = draw(count) < 0.5
    return tokens(packed, power, there, order.argmax(1), mirror), mirror


def filtered(
    power: Float[Tensor, "frame pair elevation azimuth range"],
    packed: Packed,
    generator: torch.Generator,
) -> Float[Tensor, "frame pair elevation azimuth range"]:
    """Power after a Wiener filter of packets, in some frames; see `measure.packets`.

    Thermal noise is the same in all channels, and grows by (d_t d_r)² in maps, as echoes are.
    """
    count = len(power)
    draw = functools.partial(torch.rand, generator=generator, device=power.device)
    heard = 10.0**packed.level / packed.vectors[:, :, :2].norm(dim=-1).prod(-1).square()
    heard = torch.where(packed.there, heard, 0.0)
    loudness = 10.0 ** (_LOUD - _QUIETER * draw(count, 1)) * (draw(count, 1) < _FILTERED)
    noise = heard.amax(1, keepdim=True) * loudness / heard.clamp_min(1e-30)
    noise = noise.clamp_max(1e6)[:, :, None, None, None]
    total = power + noise * (0.9 + 0.1 * _speckle(power.shape, generator))
    kept = (1.0 - noise / total.clamp_min(1e-30)).clamp_min(0.0)
    return torch.where(total > _DROPPED * noise, total * kept.square(), 0.0)


def _speckle(shape: torch.Size, generator: torch.Generator) -> Tensor:
    """Power of complex normal noise of mean 1; on a CPU a stretch of a pool, from anywhere."""
    if generator.device.type != "cpu":
        return torch.empty(shape, device=generator.device).exponential_(generator=generator)
    first = int(torch.randint(_POOL, (1,), generator=generator))
    count, pool = math.prod(shape), _speckle_pool()
    stretch = torch.cat([pool[first:], pool.repeat(-(-count // _POOL))])[:count]
    return stretch.reshape(shape)


@functools.cache
def _speckle_pool() -> Float[Tensor, "sample"]:
    """Noise; drawing it anew would take a CPU longer than the network."""
    return torch.empty(_POOL).exponential_(generator=torch.Generator().manual_seed(0))


def _heard(packed: Packed, generator: torch.Generator) -> Bool[Tensor, "frame pair"]:
    """Pairs of which a few are left out, in both directions."""
    there = packed.there
    draw = functools.partial(torch.rand, generator=generator, device=there.device)
    both = packed.vectors[:, :, :2]
    rows = torch.arange(len(there), device=there.device)
    for share in (_ONE_SILENT, _TWO_SILENT):
        chosen = torch.where(there, draw(there.shape), -1.0).argmax(1)
        ends = both[rows, chosen]
        same = _near(both[:, :, 1], ends[:, 1]) & _near(both[:, :, 0], ends[:, 0])
        # The way back: transmitter and receiver of a device are a few decimetres apart.
        back = _near(both[:, :, 1], ends[:, 0], 0.5) & _near(both[:, :, 0], ends[:, 1], 0.5)
        silent = (same | back) & (draw(len(there)) < share)[:, None]
        left = there & ~silent
        there = torch.where(left.any(1, keepdim=True), left, there)
    return there


def _near(
    places: Float[Tensor, "frame pair 3"], other: Float[Tensor, "frame 3"], m: float = 1e-3
) -> Bool[Tensor, "frame pair"]:
    return (places - other[:, None]).norm(dim=2) < m
