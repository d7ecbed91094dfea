# SPDX-License-Identifier: Apache-2.0
"""Articulated human bodies: shapes, poses, skin and inverse kinematics.

Example:
    >>> body = people().body(np.zeros(3))
    >>> body.joints17(body.rest).shape
    (17, 3)
"""

from rfgs_core.articulated.body import Body, grounded
from rfgs_core.articulated.bones import BONES, PARENTS
from rfgs_core.articulated.inverse import fit_pose
from rfgs_core.articulated.pose import Pose
from rfgs_core.articulated.shape_fit import fit_shape
from rfgs_core.articulated.space import ShapeSpace, people
from rfgs_core.articulated.surface import facets_of, skinned

__all__ = [
    "BONES",
    "PARENTS",
    "Body",
    "Pose",
    "ShapeSpace",
    "facets_of",
    "fit_pose",
    "fit_shape",
    "grounded",
    "people",
    "skinned",
]
