# SPDX-License-Identifier: GPL-3.0-or-later
"""Small solids and sheets that furniture is put together from, with few faces."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

import bmesh
import bpy
from mathutils import Matrix, Vector

from blender_scenes.surfaces import material

Point = tuple[float, float, float]


class Builder:
    """Collects parts of one object; lengths in metres, in the axes of the object."""

    def __init__(self, name: str) -> None:
        self.name = name
        self._bm = bmesh.new()
        self._materials: list[str] = []

    def _slot(self, surface: str) -> int:
        if surface not in self._materials:
            self._materials.append(surface)
        return self._materials.index(surface)

    def _finish(self, faces: Sequence[bmesh.types.BMFace], surface: str) -> None:
        slot = self._slot(surface)
        for face in faces:
            face.material_index = slot
            face.smooth = True

    def box(
        self,
        size: Point,
        centre: Point,
        surface: str,
        *,
        bevel: float = 0.0,
        segments: int = 1,
        tilt: tuple[float, float, float] = (0.0, 0.0, 0.0),
    ) -> None:
        """Adds a box.

        Args:
            size: Edge lengths [m].
            centre: Centre [m].
            surface: Name of a surface of `surfaces.SURFACES`.
            bevel: Width of the rounded edges [m].
            segments: Segments of the rounding.
            tilt: Euler angles x, y, z [rad] about the centre.
        """
        turn = Matrix.LocRotScale(Vector(centre), _euler(tilt), Vector(size))
        made = bmesh.ops.create_cube(self._bm, size=1.0, matrix=turn)["verts"]
        faces = list({face for vert in made for face in vert.link_faces})
        self._finish(faces, surface)
        if bevel > 0:
            edges = list({edge for face in faces for edge in face.edges})
            bmesh.ops.bevel(
                self._bm,
                geom=edges,
                offset=bevel,
                offset_type="OFFSET",
                segments=segments,
                profile=0.5,
                affect="EDGES",
                # -1: of the faces beside it; the default is the first material of the object.
                material=-1,
                clamp_overlap=True,
            )

    def lathe(
        self,
        profile: Sequence[tuple[float, float]],
        centre: Point,
        surface: str,
        *,
        sides: int = 16,
        caps: bool = True,
        axis: str = "z",
    ) -> None:
        """Adds a body of revolution about `axis`, z or y.

        `profile` lists (radius, place along the axis) in ascending order.
        """
        rings = []
        for radius, z in profile:
            angles = (2 * math.pi * index / sides for index in range(sides))
            ring = []
            for angle in angles:
                x, y = radius * math.cos(angle), radius * math.sin(angle)
                place = Vector((x, y, z) if axis == "z" else (y, z, x))
                ring.append(self._bm.verts.new(Vector(centre) + place))
            rings.append(ring)
        faces = []
        for low, high in pairwise(rings):
            for index in range(sides):
                after = (index + 1) % sides
                faces.append(self._bm.faces.new((low[index], low[after], high[after], high[index])))
        if caps:
            faces.append(self._bm.faces.new(tuple(reversed(rings[0]))))
            faces.append(self._bm.faces.new(tuple(rings[-1])))
        self._finish(faces, surface)

    def rod(
        self, start: Point, end: Point, radius: float, surface: str, *, taper: float = 1.0
    ) -> None:
        """Adds a closed round rod whose radius becomes `taper` times as large at its end."""
        axis = Vector(end) - Vector(start)
        turn = Vector((0, 0, 1)).rotation_difference(axis).to_matrix().to_4x4()
        made = bmesh.ops.create_cone(
            self._bm,
            cap_ends=True,
            segments=10,
            radius1=radius,
            radius2=radius * taper,
            depth=axis.length,
            matrix=Matrix.Translation((Vector(start) + Vector(end)) / 2) @ turn,
        )["verts"]
        self._finish(list({face for vert in made for face in vert.link_faces}), surface)

    def sheet(self, rows: Sequence[Sequence[Point]], surface: str) -> None:
        """Adds a single-sided grid of quads through `rows` of points."""
        verts = [[self._bm.verts.new(point) for point in row] for row in rows]
        faces = []
        for low, high in pairwise(verts):
            for index in range(len(low) - 1):
                faces.append(
                    self._bm.faces.new((low[index], low[index + 1], high[index + 1], high[index]))
                )
        self._finish(faces, surface)

    def polygons(
        self, points: Sequence[Point], faces: Sequence[Sequence[int]], surfaces: Sequence[str]
    ) -> None:
        """Adds a body of `faces` over `points`, each with its surface; normals turn outwards."""
        verts = [self._bm.verts.new(point) for point in points]
        made = [self._bm.faces.new([verts[index] for index in face]) for face in faces]
        for face, surface in zip(made, surfaces, strict=True):
            self._finish([face], surface)
        bmesh.ops.recalc_face_normals(self._bm, faces=made)

    def build(
        self,
        collection: bpy.types.Collection,
        *,
        location: Point = (0.0, 0.0, 0.0),
        yaw: float = 0.0,
        weld: bool = False,
    ) -> bpy.types.Object:
        """Makes the object, turned by `yaw` [rad] about z and put at `location` [m]."""
        if weld:
            bmesh.ops.remove_doubles(self._bm, verts=self._bm.verts, dist=1e-5)
        mesh = bpy.data.meshes.new(self.name)
        self._bm.to_mesh(mesh)
        self._bm.free()
        for surface in self._materials:
            mesh.materials.append(material(surface))
        mesh.set_sharp_from_angle(angle=math.radians(50))
        item = bpy.data.objects.new(self.name, mesh)
        item.location, item.rotation_euler = location, (0.0, 0.0, yaw)
        item.rfgs.object_class = "STATIC"
        collection.objects.link(item)
        return item


def _euler(angles: tuple[float, float, float]) -> Matrix:
    x, y, z = angles
    return (
        Matrix.Rotation(z, 3, "Z") @ Matrix.Rotation(y, 3, "Y") @ Matrix.Rotation(x, 3, "X")
    ).to_quaternion()
