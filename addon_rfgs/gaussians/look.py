# SPDX-License-Identifier: GPL-3.0-or-later
"""The material of Gaussians."""

from __future__ import annotations

from typing import Any

import bpy


def material(domain: str, attribute: str) -> bpy.types.Material:
    """Shows a colour attribute; part of the light is its own, so dark rooms do not hide it.

    Args:
        domain: `GEOMETRY` for points and meshes, `INSTANCER` for instances.
        attribute: Name of the colour attribute.
    """
    made, tree = _material(f"RFGS Gaussians {domain.lower()}")
    if tree is None:
        return made
    shader = next(node for node in tree.nodes if node.type == "BSDF_PRINCIPLED")
    colour = tree.nodes.new("ShaderNodeAttribute")
    colour.attribute_type, colour.attribute_name = domain, attribute
    colour.location = (-300, 200)
    tree.links.new(colour.outputs["Color"], shader.inputs["Base Color"])
    tree.links.new(colour.outputs["Color"], shader.inputs["Emission Color"])
    shader.inputs["Emission Strength"].default_value = 0.5
    shader.inputs["Roughness"].default_value = 0.9
    shader.inputs["Specular IOR Level"].default_value = 0.1
    return made


#: Splats are drawn out to so many standard deviations: less than a hundredth of their opacity.
SPLAT_SIGMAS = 3.0


def splat_material(attribute: str) -> bpy.types.Material:
    """Shows instances as Gaussians: opacity falls off from the middle as exp(−r²/2).

    A ray that meets a sphere at an angle of cosine c between ray and normal passes its middle at
    sin = √(1 − c²) of its radius, which stands for `SPLAT_SIGMAS` standard deviations. Front faces
    alone count, as each ray leaves where it entered. Exact for round Gaussians.

    Args:
        attribute: Name of the colour attribute of the instances.
    """
    made, tree = _material("RFGS Gaussians splats")
    if tree is None:
        return made
    made.surface_render_method = "BLENDED"
    tree.nodes.clear()
    build = _Shading(tree)
    place = build.add("ShaderNodeNewGeometry")
    facing = build.add("ShaderNodeVectorMath")
    facing.operation = "DOT_PRODUCT"
    tree.links.new(place.outputs["Normal"], facing.inputs[0])
    tree.links.new(place.outputs["Incoming"], facing.inputs[1])
    cosine = facing.outputs["Value"]
    aside = build.math("SUBTRACT", 1.0, build.math("MULTIPLY", cosine, cosine))
    falloff = build.math("EXPONENT", build.math("MULTIPLY", aside, -0.5 * SPLAT_SIGMAS**2))
    opacity = build.attribute("opacity").outputs["Fac"]
    front = build.math("SUBTRACT", 1.0, place.outputs["Backfacing"])
    alpha = build.math("MULTIPLY", build.math("MULTIPLY", falloff, opacity), front)
    light, clear = build.add("ShaderNodeEmission"), build.add("ShaderNodeBsdfTransparent")
    tree.links.new(build.attribute(attribute).outputs["Color"], light.inputs["Color"])
    mix, output = build.add("ShaderNodeMixShader"), build.add("ShaderNodeOutputMaterial")
    for value, socket in zip((alpha, clear.outputs[0], light.outputs[0]), mix.inputs, strict=True):
        tree.links.new(value, socket)
    tree.links.new(mix.outputs[0], output.inputs["Surface"])
    return made


def _material(name: str) -> tuple[bpy.types.Material, Any]:
    """A material, and its nodes if it is new; None instead of them if it was made before."""
    found = bpy.data.materials.get(name)
    if found is not None:
        return found, None
    made = bpy.data.materials.new(name)
    if made.node_tree is None:
        made.use_nodes = True
    return made, made.node_tree


class _Shading:
    """Adds nodes to a material."""

    def __init__(self, tree: Any) -> None:
        self._tree = tree

    def add(self, kind: str) -> Any:
        node = self._tree.nodes.new(kind)
        count = len(self._tree.nodes)
        node.location = (200 * (count % 6), -200 * (count // 6))
        return node

    def attribute(self, name: str) -> Any:
        node = self.add("ShaderNodeAttribute")
        node.attribute_type, node.attribute_name = "INSTANCER", name
        return node

    def math(self, operation: str, *values: Any) -> Any:
        node = self.add("ShaderNodeMath")
        node.operation = operation
        for value, socket in zip(values, node.inputs, strict=False):
            if isinstance(value, float):
                socket.default_value = value
            else:
                self._tree.links.new(value, socket)
        return node.outputs[0]
