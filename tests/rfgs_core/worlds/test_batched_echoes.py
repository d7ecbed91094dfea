# SPDX-License-Identifier: Apache-2.0
"""Many moments heard at once by products of matrices, beside one after another."""

from __future__ import annotations

from itertools import islice

import numpy as np
import pytest
import torch

from rfgs_core.encode.body_maps import View
from rfgs_core.limbs.stream import MOMENTS, chunks, heard_chunk, pairs_of
from rfgs_core.limbs.tokens import Packed, pack
from rfgs_core.radio import preset
from rfgs_core.radio.delay import band_window, hann
from rfgs_core.seeds import sub_seed
from rfgs_core.worlds.batch import Batch, batch_of
from rfgs_core.worlds.batched_echoes import BatchedEchoes
from rfgs_core.worlds.echoes import Band
from rfgs_core.worlds.heard import body_echoes, skin_reflection
from rfgs_core.worlds.moments import Acted, acted


def tensors(name: str, done: Acted) -> Batch:
    radio = preset(name)
    return batch_of(radio, done, pairs_of(radio))


def one_by_one(name: str, done: Acted) -> list[tuple[list[View], np.ndarray, np.ndarray]]:
    """Views, maps and centre of each moment, by the loop over facets."""
    radio, out = preset(name), []
    for pose, room, sight, views, centre in done.moments:
        window = band_window(sight.subcarriers, hann)
        band = Band.of(sight.freq_hz, window, skin_reflection(radio.centre_hz))
        posed = done.figure.posed(pose)
        maps = body_echoes(done.figure, posed, views, centre, band, room, sight)
        out.append((views, maps, centre))
    return out


@pytest.mark.parametrize("name", ["mmwave", "wifi"])
def test_many_at_once_hear_what_each_hears(name: str) -> None:
    """Walls, shadows, gaps in the band, shortened arrays and furniture as they come."""
    radio = preset(name)
    echoes = BatchedEchoes(radio, "cpu")
    for done in islice(acted(radio, 7, 4), 2):
        found = echoes.maps(tensors(name, done))
        for own, (views, expected, _) in zip(found, one_by_one(name, done), strict=True):
            assert float(own[len(views) :].sum()) == 0.0
            for one, other in zip(own.numpy(), expected, strict=False):
                peak = np.sqrt(other.max())
                # A facet on the edge of a cell may fall to either side of it in single precision.
                off = np.abs(np.sqrt(one) - np.sqrt(other)) / peak
                assert np.median(off) < 1e-3 and off.max() < 0.05


@pytest.mark.parametrize("name", ["mmwave", "wifi"])
def test_the_kernel_writes_the_factors_of_the_plain_product(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In Triton's interpreter where there is no GPU: one moment of few facets."""
    pytest.importorskip("triton", reason="kernels for a GPU need triton: pip install triton")
    device = "cuda" if torch.cuda.is_available() else "cpu"
    batch = tensors(name, next(acted(preset(name), 4, 1)))
    few = slice(None, None, 40)
    points, normals, areas = batch.points[few], batch.normals[few], 10.0 * batch.areas_m2[few]
    pairs, there = batch.pairs[:, :2], batch.there[:, :2]
    batch = batch._replace(points=points, normals=normals, areas_m2=areas, pairs=pairs, there=there)
    found = []
    for where, kernels in (("cpu", False), (device, True)):
        echoes = BatchedEchoes(preset(name), where, kernels)
        monkeypatch.setattr(echoes, "_shares", echoes._shares[few])
        found.append(echoes.maps(Batch(*(value.to(where) for value in batch))).cpu().sqrt())
    peak = found[0].amax((2, 3, 4), keepdim=True).clamp_min(1e-20)
    assert float(found[0].max()) > 0.0
    assert float(((found[0] - found[1]).abs() / peak).max()) < 2e-3


def test_a_chunk_is_the_frames_packed() -> None:
    done = next(acted(preset("mmwave"), 3, 3))
    found = heard_chunk(BatchedEchoes(preset("mmwave"), "cpu"), tensors("mmwave", done))
    expected = pack(one_by_one("mmwave", done), 5)
    for name in Packed._fields[1:]:
        own, other = getattr(found.packed, name), getattr(expected, name)
        torch.testing.assert_close(own, other, atol=2e-3, rtol=1e-4)
    joints = done.figure.body.joints17(done.moments[0].pose) - done.moments[0].centre
    np.testing.assert_allclose(found.joints[0].numpy(), joints, atol=1e-5)
    there = expected.there[..., None, None, None].expand_as(expected.maps)
    steps = (found.packed.maps.int() - expected.maps.int()).abs()[there & (expected.maps > 100)]
    assert float((steps > 2).float().mean()) < 0.01


def test_bodies_share_their_bones() -> None:
    """The batch takes the mean body's weights for everybody."""
    one, other = (done.figure for done in islice(acted(preset("mmwave"), 1, 1), 2))
    assert one is not other
    np.testing.assert_array_equal(one.bone, other.bone)
    np.testing.assert_array_equal(one.weight, other.weight)


@pytest.mark.gpu
@pytest.mark.skipif(not torch.cuda.is_available(), reason="no GPU")
def test_a_gpu_hears_what_the_processor_hears() -> None:
    chunk = next(chunks(preset("mmwave"), 5, "cuda", workers=0))
    done = next(acted(preset("mmwave"), sub_seed(5, 0), MOMENTS))
    expected = heard_chunk(BatchedEchoes(preset("mmwave"), "cpu"), tensors("mmwave", done))
    torch.testing.assert_close(chunk.joints.cpu(), expected.joints)
    torch.testing.assert_close(chunk.packed.level.cpu(), expected.packed.level, atol=5e-3, rtol=0)
