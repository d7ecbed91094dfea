# SPDX-License-Identifier: GPL-3.0-or-later
"""The material of Gaussians."""

from __future__ import annotations

import bpy


def material(domain: str, attribute: str) -> bpy.types.Material:
    """Shows a colour attribute; part of the light is its own, so dark rooms do not hide it.

    Args:
        domain: `GEOMETRY` for points and meshes, `INSTANCER` for instances.
        attribute: Name of the colour attribute.
    """
    name = f"RFGS Gaussians {domain.lower()}"
    found = bpy.data.materials.get(name)
    if found is not None:
        return found
    made = bpy.data.materials.new(name)
    if made.node_tree is None:
        made.use_nodes = True
    tree = made.node_tree
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
