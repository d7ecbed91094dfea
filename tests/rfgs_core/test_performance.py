# SPDX-License-Identifier: Apache-2.0
"""The page of speed says what was measured."""

from __future__ import annotations

import re
from dataclasses import replace

import pytest

from rfgs_core.performance import Performance, page
from rfgs_core.render.bench import Distant, Picture, time_distant, time_picture
from rfgs_core.scaling import Growth
from rfgs_core.selftest import Throughput

SIZES = (100, 1000, 10_000)


def measured() -> Performance:
    ratios = {"forward_ratio": 90.0, "forward_backward_ratio": 61.0}
    tuned = {"tuned_forward_ratio": 55.0, "tuned_forward_backward_ratio": 57.0}
    times = {"forward_s": 0.025, "forward_backward_s": 0.078, "max_relative_error": 1.3e-5}
    sizes = {"num_gaussians": 20_000, "num_links": 64, "num_subcarriers": 32}
    return Performance(
        propagation={**ratios, **tuned, **times, **sizes},
        share=Throughput(0.02, 5e10, 2e11),
        raster={"raster_s": 0.03, "twin_s": 6.0, "raster_ratio": 200.0, "max_abs_error": 1e-5},
        pictures=(Picture(100_000, 512, 0.41, 0.052, 0.31),),
        distant=(Distant(100_000, 50.0, 0.06, 0.043, 27_905, 1e-6),),
        memory_gib=1.25,
        growths=(Growth("law", SIZES, (0.1, 0.9, 8.1)), Growth("flat", SIZES, (0.1, 0.1, 0.1))),
        device="cpu",
        machine={"cpu": "a chip", "cores": 2, "gpu": "none"},
    )


def test_every_number_stands_on_the_page() -> None:
    text = page(measured(), "2026-11-25")
    for word in ("a chip, 2 cores, no GPU, 2026-11-25", "64 links × 32 subcarriers", "1.3e-05"):
        assert word in text
    assert "| forward | 25.0 ms | 90× | 55× |" in text
    assert "| with gradients | 78.0 ms | 61× | 57× |" in text
    assert "25% of the 200 billion" in text
    assert "| 100,000 | 512 × 512 | 0.41 s | 0.052 s | 0.31 s |" in text
    assert "| 100,000 | 50 m | 60 ms | 43 ms | 27,905 | 1e-06 |" in text
    assert re.search(r"\| law \| 100 to 10,000 \| 0.1 s to 8.1 s \| 0.95 \|", text)
    # Where hardly anything grows, nothing is said of how it does.
    assert re.search(r"\| law \|.*\| 0\.9\d \|\n", text)
    assert re.search(r"\| flat \|.*\| 0\.1 s \| – \|\n", text)
    assert "1.2 GiB" in text and "Nothing grows more than linearly" in text


def test_the_page_of_a_gpu_has_frames_per_second_and_gradients() -> None:
    found = measured()
    drawn = (Picture(1_000_000, 512, 0.004, 0.004, 0.0125),)
    told = replace(found, device="cuda", pictures=drawn, distant=(), growths=())
    told.machine["gpu"], told.propagation["torch"] = "a card", "2.13.0"
    text = page(told, "2026-11-26")
    assert "bench performance --device cuda --out FILE` on a card, torch 2.13.0, 2026-11-26" in text
    assert "| 1,000,000 | 512 × 512 | 4.00 ms | 250 | 12.50 ms |" in text
    assert "GPU has held 1.2 GiB" in text and "How cost grows" not in text


def test_what_grows_faster_than_its_size_is_named() -> None:
    square = Growth("square", SIZES, (0.1, 10.0, 1000.0))
    text = page(replace(measured(), growths=(square,)), "2026-11-25")
    assert "More than linear: square." in text


def test_a_picture_is_timed_whole_and_drawn_again() -> None:
    told = time_picture(2000, 64)
    assert (told.num_gaussians, told.size_px) == (2000, 64)
    assert told.again_s > 0.0 and told.first_s > 0.0


def test_a_crowd_is_timed_from_near_and_afar() -> None:
    near, far = time_distant(60_000, 2.0, 64, 1), time_distant(60_000, 50.0, 64, 1)
    assert near.shown > 3 * far.shown > 0
    assert far.every_s > 0.0 and far.shown_s > 0.0 and far.max_abs_error < 1e-5


@pytest.mark.parametrize("gpu", ["none", "a card"])
def test_tables_are_tables(gpu: str) -> None:
    machine = {**measured().machine, "gpu": gpu}
    rows = [
        line
        for line in page(replace(measured(), machine=machine), "x").splitlines()
        if line[:1] == "|"
    ]
    assert len(rows) > 8 and all(row.endswith("|") for row in rows)
