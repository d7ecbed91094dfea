# SPDX-License-Identifier: GPL-3.0-or-later
"""How people move: pieces of motion that are strung together into a score.

NumPy only; `blender_scenes.people` writes scores into a Blender scene. A piece says what to do
(`Walk`, `Turn`, `Stay` in going.py, `Gesture`, `Sit` and `Rise` in seat.py, `Climb` in stairs.py,
`Fall`, `Recorded`), a posture where it begins and ends, a score gives the pose and the
label at any time:

    >>> score = compose(figure, Posture((0, 0), 0.0), [Walk([(2, 0)]), Turn(90), Stay(2)])
    >>> score.label(1.0), round(score.duration_s, 1)
    ('walk', 7.8)
"""
