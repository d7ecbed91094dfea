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
    """Shows instances as Gaussians: opacity is the largest that a ray meets, exp(−r²/2).

    In the Gaussian's own axes, where its sphere of radius one stands for `SPLAT_SIGMAS` standard
    deviations, a ray through p along d passes the middle at √(|p|² − (p·d)²/|d|²). This holds for
    every shape and needs nothing of the surface but some point of the ray on it. Front faces alone
    count, as each ray leaves where it entered.

    Args:
        attribute: Name of the colour attribute of the instances.
    """
    made, tree = _material("RFGS Gaussians as splats")
    if tree is None:
        return made
    made.surface_render_method = "BLENDED"
    tree.nodes.clear()
    build = _Shading(tree)
    place = build.add("ShaderNodeNewGeometry")
    point = build.add("ShaderNodeTexCoord").outputs["Object"]
    ray = build.add("ShaderNodeVectorTransform")
    ray.vector_type, ray.convert_from, ray.convert_to = "VECTOR", "WORLD", "OBJECT"
    tree.links.new(place.outputs["Incoming"], ray.inputs[0])
    along = build.dot(point, ray.outputs[0])
    nearest = build.math(
        "DIVIDE", build.math("MULTIPLY", along, along), build.dot(ray.outputs[0], ray.outputs[0])
    )
    aside = build.math("SUBTRACT", build.dot(point, point), nearest)
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

    def dot(self, first: Any, second: Any) -> Any:
        node = self.add("ShaderNodeVectorMath")
        node.operation = "DOT_PRODUCT"
        for value, socket in zip((first, second), node.inputs, strict=False):
            self._tree.links.new(value, socket)
        return node.outputs["Value"]

    def math(self, operation: str, *values: Any) -> Any:
        node = self.add("ShaderNodeMath")
        node.operation = operation
        for value, socket in zip(values, node.inputs, strict=False):
            if isinstance(value, float):
                socket.default_value = value
            else:
                self._tree.links.new(value, socket)
        return node.outputs[0]
