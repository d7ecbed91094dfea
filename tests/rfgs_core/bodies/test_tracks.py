# SPDX-License-Identifier: Apache-2.0
"""Bodies are expected where they walk to, and looked for further away the longer it takes."""

from __future__ import annotations

import numpy as np
import pytest

from rfgs_core.bodies.tracks import FASTEST_M_S, REACH_M, TURNING_M_S, Tracks


def test_a_first_frame_says_nothing_about_velocity() -> None:
    first = Tracks.begun(np.array([[1.0, 2.0]]), time_s=3.0)
    near, reach_m = first.expected(3.4)
    np.testing.assert_array_equal(near, [[1.0, 2.0]])
    assert reach_m == pytest.approx([REACH_M + 0.4 * FASTEST_M_S])


def test_bodies_walk_on_at_their_own_velocity() -> None:
    first = Tracks.begun(np.array([[0.0, 0.0], [2.0, 0.0]]), time_s=0.0)
    second = first.moved(np.array([[0.5, 0.0], [1.0, 0.0]]), time_s=0.5)
    near, reach_m = second.expected(1.0)
    # They have passed each other: each is expected beyond where the other one is now.
    np.testing.assert_allclose(near, [[1.0, 0.0], [0.0, 0.0]])
    np.testing.assert_allclose(reach_m, REACH_M + 0.5 * TURNING_M_S)


def test_frames_may_be_visited_backwards_and_twice() -> None:
    late = Tracks.begun(np.array([[1.0, 0.0]]), time_s=2.0)
    earlier = late.moved(np.array([[0.0, 0.0]]), time_s=1.0)
    np.testing.assert_allclose(earlier.velocity_xy, [[1.0, 0.0]])
    near, reach_m = earlier.expected(0.0)
    np.testing.assert_allclose(near, [[-1.0, 0.0]])
    assert reach_m > REACH_M
    again = earlier.moved(np.array([[0.1, 0.0]]), time_s=1.0)
    np.testing.assert_array_equal(again.velocity_xy, earlier.velocity_xy)
