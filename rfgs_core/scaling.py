# SPDX-License-Identifier: Apache-2.0
"""How cost grows with size: CPU time over two decades, and the exponent of its power law.

An exponent of 1 is linear; below it, part of the work does not depend on what grows. That part,
and how the rest grows, are fitted too.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from scipy.optimize import nnls

from rfgs_core.articulated import people
from rfgs_core.bench import PropagationBench, cloud_and_links, hardware, with_gradients
from rfgs_core.radio import Radio, layout, preset
from rfgs_core.radio.layout import DevicePose
from rfgs_core.radio.placement import place_devices
from rfgs_core.radio.sites import centres
from rfgs_core.simulate.geometry import Sight
from rfgs_core.simulate.geometry.bvh import build_bvh
from rfgs_core.simulate.geometry.room import SlabMaterial, box_room
from rfgs_core.simulate.scatter.people import PeopleChannel
from rfgs_core.simulate.surface.lloyd import triangle_areas
from rfgs_core.simulate.surface.points import LIFT_M
from rfgs_core.simulate.surface.posed import Facets

#: What grows, and through which sizes.
FACETS = (250, 800, 2500, 8000, 25_000)
ARRAYS = ((1, 1), (1, 3), (3, 3), (4, 8), (10, 10))
SUBCARRIERS = (16, 50, 160, 500, 1600)
GAUSSIANS = (1000, 3200, 10_000, 32_000, 100_000)
LINKS = (4, 13, 40, 130, 400)
#: Exponents that are tried of what grows.
_EXPONENTS = np.arange(30, 251) / 100
#: Runs of each size; the quickest counts.
_RUNS = 3
#: The room [m], and where somebody stands in it.
_LOW_M, _HIGH_M = np.array([-3.0, -2.5, 0.0]), np.array([3.0, 2.5, 2.7])
_STANDS_M = np.array([0.4, -0.3, 0.0])


@dataclass(frozen=True)
class Growth:
    """CPU seconds at some sizes."""

    name: str
    """What was timed, and what grew."""
    sizes: tuple[int, ...]
    """The sizes."""
    seconds: tuple[float, ...]
    """CPU time at each [s]."""

    @property
    def exponent(self) -> float:
        """Slope of the logarithm of time over that of size, by least squares."""
        return float(np.polyfit(np.log(self.sizes), np.log(self.seconds), 1)[0])

    @property
    def law(self) -> tuple[float, float]:
        """CPU time that does not grow [s], and the exponent of the rest, 0 where nothing grows.

        Time is fixed + c · size^exponent, no part below 0, by least squares of relative errors.
        """
        sizes, seconds = np.array(self.sizes, dtype=np.float64), np.array(self.seconds)

        def fit(exponent: float) -> tuple[float, float, np.ndarray]:
            terms = np.stack([np.ones(len(sizes)), (sizes / sizes[-1]) ** exponent], axis=1)
            parts, off = nnls(terms / seconds[:, None], np.ones(len(sizes)))
            return float(off), exponent, parts

        _, exponent, (fixed_s, grows) = min(map(fit, _EXPONENTS), key=lambda tried: tried[0])
        return float(fixed_s), float(exponent) if grows > 0.0 else 0.0


def growths(on_size: Callable[[str], None] = lambda words: None) -> tuple[Growth, ...]:
    """Cost of the fast tracer and of the propagation model over two decades of each size.

    The fast tracer: one person in a box of six walls, Wi-Fi, depth 2, four devices in the corners.
    The propagation model: a cloud of Gaussians with gradients, 64 links and 64 subcarriers where
    they do not grow.

    Args:
        on_size: Told what is timed next.
    """
    return (*_of_tracer(on_size), *_of_propagation(on_size))


def bench_scaling(on_size: Callable[[str], None] = lambda words: None) -> dict[str, float | str]:
    """What `growths` measures, as numbers with names.

    Args:
        on_size: Told what is timed next.

    Returns:
        A flat dictionary: for each growth its exponent and the seconds at each size; hardware.
    """
    flat: dict[str, float | str] = {}
    for growth in growths(on_size):
        fixed_s, rest = growth.law
        flat[f"{growth.name}: exponent"] = growth.exponent
        flat[f"{growth.name}: fixed [s]"] = fixed_s
        flat[f"{growth.name}: exponent of the rest"] = rest
        flat |= {
            f"{growth.name}: {size} [s]": seconds
            for size, seconds in zip(growth.sizes, growth.seconds, strict=True)
        }
    return {**flat, **hardware()}


def _of_tracer(on_size: Callable[[str], None]) -> Iterator[Growth]:
    wifi, body = preset("wifi"), people().body(np.zeros(0))

    def traced(radio: Radio, count: int) -> Callable[[], object]:
        devices = place_devices(radio, np.stack([_LOW_M, _HIGH_M]))
        channel = _people_channel(radio, devices)
        facets = spread_evenly(body.vertices + _STANDS_M, body.faces, count)
        gamma = np.full((1, len(channel.node_hz)), 0.7 + 0.1j)
        return lambda: channel.channel(facets, channel.arrivals(facets), gamma)

    arrays = [replace(wifi, rx_rows=rows, rx_cols=cols) for rows, cols in ARRAYS]
    # The band stays as it is: more subcarriers, nearer to each other.
    bands = [replace(wifi, num_subcarriers=count) for count in SUBCARRIERS]
    links = tuple(16 * rows * cols for rows, cols in ARRAYS)
    of_facets = [partial(traced, wifi, count) for count in FACETS]
    of_links = [partial(traced, radio, 2500) for radio in arrays]
    of_bands = [partial(traced, radio, 2500) for radio in bands]
    yield _growth("fast tracer, facets", FACETS, of_facets, on_size)
    yield _growth("fast tracer, links", links, of_links, on_size)
    yield _growth("fast tracer, subcarriers", SUBCARRIERS, of_bands, on_size)


def _people_channel(radio: Radio, devices: list[DevicePose]) -> PeopleChannel:
    """The fast tracer's part for people, in a closed box of plasterboard."""
    room = box_room(_LOW_M, _HIGH_M, SlabMaterial("plasterboard", 0.0125))
    elements = layout(radio, devices)
    still = np.zeros(len(room.triangles), dtype=bool)
    around = Sight(*centres(elements)).of(room.faces, still)
    return PeopleChannel(room, around, elements, devices, radio, depth=2)


def spread_evenly(vertices: np.ndarray, faces: np.ndarray, count: int) -> Facets:
    """Facets of equal area by chance over a mesh, any number of them: for timing, not for physics.

    Args:
        vertices: Vertices [m], shape (V, 3).
        faces: Triangles, shape (T, 3).
        count: How many.
    """
    rng = np.random.default_rng(0)
    triangles = vertices[faces].astype(np.float64)
    areas = triangle_areas(vertices.astype(np.float64), faces)
    chosen = rng.choice(len(faces), count, p=areas / areas.sum())
    share = rng.dirichlet(np.ones(3), count)
    points = np.einsum("pc,pcx->px", share, triangles[chosen])
    across = np.cross(*(triangles[chosen, i] - triangles[chosen, 0] for i in (1, 2)))
    normals = across / np.linalg.norm(across, axis=1, keepdims=True)
    # Neighbours one after the other, as the tracer has them.
    order = build_bvh(np.repeat(points[:, None], 3, axis=1)).triangle
    points, normals = points[order], normals[order]
    nothing = np.zeros(count, dtype=np.int64)
    return Facets(
        points=points,
        lifted=points + LIFT_M * normals,
        normals=normals,
        areas=np.full(count, areas.sum() / count),
        material=nothing,
        body=nothing,
        vertices=vertices.astype(np.float64),
        corners=faces,
        triangles=triangles,
        bvh=build_bvh(triangles),
    )


def _of_propagation(on_size: Callable[[str], None]) -> Iterator[Growth]:
    base = PropagationBench(num_gaussians=10_000)

    def run(config: PropagationBench) -> Callable[[], object]:
        return partial(with_gradients, cloud_and_links(config))

    for name, field, sizes in (
        ("Gaussians", "num_gaussians", GAUSSIANS),
        ("links", "num_links", LINKS),
        ("subcarriers", "num_subcarriers", SUBCARRIERS),
    ):
        # The band stays as it is.
        configs = [replace(base, **{field: size}) for size in sizes]
        if field == "num_subcarriers":
            width_hz = base.spacing_hz * base.num_subcarriers
            configs = [replace(c, spacing_hz=width_hz / c.num_subcarriers) for c in configs]
        makes = [partial(run, config) for config in configs]
        yield _growth(f"propagation with gradients, {name}", sizes, makes, on_size)


def _growth(
    name: str,
    sizes: tuple[int, ...],
    makes: list[partial[Callable[[], object]]],
    on_size: Callable[[str], None],
) -> Growth:
    """Times what each of `makes` makes."""
    seconds = []
    for size, make in zip(sizes, makes, strict=True):
        on_size(f"{name}: {size}")
        run = make()
        # Compiles, or loads compiled code.
        run()
        spent = []
        for _ in range(_RUNS):
            start = time.process_time()
            run()
            spent.append(time.process_time() - start)
        seconds.append(min(spent))
    return Growth(name, sizes, tuple(seconds))
