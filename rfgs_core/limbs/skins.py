# SPDX-License-Identifier: Apache-2.0
"""Bodies posed as joints say, and Gaussians that keep their place on the skin."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float32, Float64, Int64

from rfgs_core.articulated import Body, Pose, facets_of, fit_pose, fit_shape, people
from rfgs_core.limbs.propose import Joints
from rfgs_core.seeds import sub_seed

#: Components of the shape that bone lengths tell.
_SHAPE = 3
#: σ of a joint that pulls at a body with weight 1 [m]; see `articulated.fit_pose`.
_SUREST_M = 0.005


def pulls(joints: Joints) -> Float64[np.ndarray, "*body 17"]:
    """How strongly each joint pulls at a body, at most 1; see `articulated.fit_pose`."""
    return np.minimum((_SUREST_M / joints.sigma_m) ** 2, 1.0)


def shapes_of(said: Joints) -> Float64[np.ndarray, "body K"]:
    """Shapes of people by how long their limbs are in what the network says of them.

    Args:
        said: Of all frames, shape (frame, body, 17, ·).
    """
    bodies = range(said.xyz.shape[1])
    return np.array([fit_shape(said.xyz[:, b], _SHAPE, said.sigma_m[:, b]) for b in bodies])


def sized(joints: Joints, shapes: Float64[np.ndarray, "body K"], floor_m: float) -> Joints:
    """Joints of bodies of the mean shape, as bodies of these shapes would have them.

    Each is scaled by its height about the ground below its pelvis.

    Args:
        joints: Of all frames, shape (frame, body, 17, ·).
        shapes: Coefficients of each, see `shapes_of`.
        floor_m: Height of the floor [m].
    """
    tall = np.array([people().body(shape).height_m for shape in shapes])
    ratio = tall / people().body(np.zeros(0)).height_m
    ground = joints.xyz[:, :, :1].copy()
    ground[..., 2] = floor_m
    return Joints(ground + ratio[:, None, None] * (joints.xyz - ground), joints.sigma_m)


@dataclass(frozen=True)
class OnSkin:
    """Gaussians of one frame on the skins of its people."""

    points: Float64[np.ndarray, "M 3"]
    """Where they are [m]."""
    normals: Float64[np.ndarray, "M 3"]
    """How they face."""
    body: Int64[np.ndarray, "M"]
    """Whose skin each is on."""
    bone: Int64[np.ndarray, "M"]
    """Bone that carries most of it, as numbered in `articulated.BONES`."""


@dataclass(frozen=True)
class PosedPeople:
    """People of a sequence: one shape each, a pose per frame."""

    coefficients: Float64[np.ndarray, "body K"]
    """Shape of each [standard deviations]; see `articulated.ShapeSpace`."""
    root: Float64[np.ndarray, "frame body 3"]
    """Where each pelvis is [m]."""
    turns: Float32[np.ndarray, "frame body bone 3 3"]
    """How each bone is turned against the world, from rest."""

    @staticmethod
    def through(joints: Joints, shapes: Float64[np.ndarray, "body K"] | None = None) -> PosedPeople:
        """Bodies whose joints are where they are said to be, as far as bones allow.

        Args:
            joints: Of all frames, shape (frame, body, 17, ·).
            shapes: Coefficients of each, see `shapes_of`; None for the mean shape.
        """
        frames, bodies = joints.xyz.shape[:2]
        if shapes is None:
            shapes = np.zeros((bodies, len(people().components)))
        weight, roots, turns = pulls(joints), np.zeros((frames, bodies, 3)), []
        for body in range(bodies):
            figure = people().body(shapes[body])
            own, pose = [], None
            for frame in range(frames):
                pose = fit_pose(figure, joints.xyz[frame, body], weight[frame, body], pose)
                roots[frame, body] = pose.root
                own.append(pose.turns.astype(np.float32))
            turns.append(own)
        return PosedPeople(shapes, roots, np.array(turns).swapaxes(0, 1))

    def body(self, number: int) -> Body:
        """One of the people at rest."""
        return people().body(self.coefficients[number])

    def pose(self, frame: int, number: int) -> Pose:
        """How one of them holds themselves in the frame of this index."""
        return Pose(self.root[frame, number], self.turns[frame, number].astype(np.float64))

    def joints17(self) -> Float64[np.ndarray, "frame body 17 3"]:
        """Joints of the posed bodies [m]."""
        bodies = [self.body(number) for number in range(len(self.coefficients))]
        return np.array(
            [
                [body.joints17(self.pose(frame, number)) for number, body in enumerate(bodies)]
                for frame in range(len(self.root))
            ]
        )

    def gaussians(self, frame: int, count: int, seed: int) -> OnSkin:
        """Gaussians spread evenly over all skins, at the same places of them in every frame.

        Args:
            frame: Index of the frame.
            count: How many on all bodies together.
            seed: Seed of their places.
        """
        bodies = [self.body(number) for number in range(len(self.coefficients))]
        area = np.array([facets_of(body.vertices, body.faces)[2].sum() for body in bodies])
        bounds = np.round(np.cumsum(area) / area.sum() * count).astype(int)
        parts = []
        for number, (body, many) in enumerate(
            zip(bodies, np.diff(bounds, prepend=0).tolist(), strict=True)
        ):
            rng = np.random.default_rng(sub_seed(seed, "skin", number))
            at_rest = facets_of(body.vertices, body.faces)[2]
            face = rng.choice(len(at_rest), many, p=at_rest / at_rest.sum())
            share = rng.dirichlet([1.0, 1.0, 1.0], many)
            skin = body.skin(self.pose(frame, number))
            points = np.einsum("mc,mcx->mx", share, skin[body.faces[face]])
            normals = facets_of(skin, body.faces)[1][face]
            main = np.take_along_axis(
                body.weights[0], body.weights[1].argmax(axis=1)[:, None], axis=1
            )[:, 0]
            corner = body.faces[face, share.argmax(axis=1)]
            parts.append((points, normals, np.full(many, number), main[corner].astype(np.int64)))
        return OnSkin(*(np.concatenate(values) for values in zip(*parts, strict=True)))
