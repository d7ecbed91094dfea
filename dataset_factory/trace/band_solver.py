# SPDX-License-Identifier: Apache-2.0
"""Paths found once and evaluated at many frequencies.

Where paths run does not depend on frequency, only what materials and antennas make of them.
Finding them takes seconds per receiver; evaluating them again takes a fraction of that, so an
ultra-wide band can have as many frequencies as its materials ask for.
"""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
import sionna.rt as rt

from dataset_factory.trace.scene import set_frequency


class BandSolver(rt.PathSolver):
    """`PathSolver` that evaluates the paths it has found at other frequencies too."""

    def at_frequencies(
        self, scene: rt.Scene, paths: rt.Paths, freq_hz: np.ndarray, samples_per_src: int
    ) -> list[rt.Paths]:
        """The same paths at several frequencies [Hz].

        Args:
            scene: Scene they were found in, with the same antennas; its frequency is changed.
            paths: Result of this solver with `synthetic_array=True`; used up.
            freq_hz: Frequencies, shape (node,).
            samples_per_src: Rays per transmitter they were found with.
        """
        sources, source_turns, tx_offsets, tx_speeds = scene.sources(True, True)
        targets, target_turns, rx_offsets, rx_speeds = scene.targets(True, True)
        buffer: Any = paths._paths_buffer
        make: Any = rt.Paths
        arrays: Any = (scene.tx_array, scene.rx_array)
        valid = dr.copy(buffer.valid)
        found = []
        for freq in freq_hz:
            set_frequency(scene, float(freq))
            buffer.valid = dr.copy(valid)
            # Sionna's own field calculator, called as `PathSolver` calls it.
            self._field_calculator(
                wavelength=scene.wavelength,
                paths=buffer,
                samples_per_src=samples_per_src,
                diffraction=False,
                src_positions=sources,
                tgt_positions=targets,
                src_orientations=source_turns,
                tgt_orientations=target_turns,
                src_antenna_patterns=arrays[0].antenna_pattern.patterns,
                tgt_antenna_patterns=arrays[1].antenna_pattern.patterns,
            )
            ends = (sources, targets, tx_speeds, rx_speeds)
            result = make(scene, *ends, True, buffer, tx_offsets, rx_offsets)
            # Read now: the next frequency writes into the same buffer.
            dr.eval(result.a, result.valid, mi.Float(0.0))
            found.append(result)
        return found
