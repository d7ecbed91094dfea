# SPDX-License-Identifier: GPL-3.0-or-later
"""How Gaussians look: a geometry-nodes modifier and its materials, built in code."""

from __future__ import annotations

from typing import Any

import bpy

#: Name of the node group.
GROUP = "RFGS Gaussians"
#: Radius of a point at size 1 [m].
POINT_RADIUS_M = 0.012

#: Input sockets: name, type, default, minimum, maximum, what it does.
_INPUTS = (
    ("Ellipsoids", "NodeSocketBool", False, None, None, "Ellipsoids instead of equal points"),
    ("Opacity Threshold", "NodeSocketFloat", 0.005, 0.0, 1.0, "Hide Gaussians below this opacity"),
    ("Size", "NodeSocketFloat", 1.0, 0.0, 10.0, "Size of points, or standard deviations shown"),
)


def add_modifier(item: bpy.types.Object, mode: str, opacity_threshold: float) -> None:
    """Shows the Gaussians of `item` as `points` or `ellipsoids`."""
    group = bpy.data.node_groups.get(GROUP) or _build_group()
    modifier = item.modifiers.new(GROUP, "NODES")
    modifier.node_group = group
    set_display(item, mode, opacity_threshold)


def set_display(item: bpy.types.Object, mode: str, opacity_threshold: float) -> None:
    """Changes what the modifier shows."""
    modifier = item.modifiers[GROUP]
    sockets = _socket_ids(modifier.node_group)
    _set_input(modifier, sockets["Ellipsoids"], mode == "ellipsoids")
    _set_input(modifier, sockets["Opacity Threshold"], opacity_threshold)
    item.update_tag()


def _set_input(modifier: Any, socket: str, value: Any) -> None:
    if hasattr(modifier, "properties"):  # Blender 5.2 moved the inputs out of the modifier.
        holder = getattr(modifier.properties.inputs, socket, None)
        if holder is not None:
            holder.value = value
            return
    modifier[socket] = value


def _socket_ids(group: Any) -> dict[str, str]:
    return {
        item.name: item.identifier
        for item in group.interface.items_tree
        if item.item_type == "SOCKET" and item.in_out == "INPUT"
    }


def _build_group() -> Any:
    group = bpy.data.node_groups.new(GROUP, "GeometryNodeTree")
    group.is_modifier = True
    interface = group.interface
    interface.new_socket("Geometry", in_out="INPUT", socket_type="NodeSocketGeometry")
    for name, kind, default, low, high, text in _INPUTS:
        socket = interface.new_socket(name, in_out="INPUT", socket_type=kind, description=text)
        socket.default_value = default
        if low is not None:
            socket.min_value, socket.max_value = low, high
    interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    nodes, link = group.nodes, group.links.new
    inputs, output = nodes.new("NodeGroupInput"), nodes.new("NodeGroupOutput")

    keep = nodes.new("FunctionNodeCompare")
    keep.operation = "GREATER_EQUAL"
    link(_attribute(group, "opacity", "FLOAT"), keep.inputs["A"])
    link(inputs.outputs["Opacity Threshold"], keep.inputs["B"])
    cloud = nodes.new("GeometryNodeMeshToPoints")
    link(inputs.outputs["Geometry"], cloud.inputs["Mesh"])
    link(keep.outputs["Result"], cloud.inputs["Selection"])

    switch = nodes.new("GeometryNodeSwitch")
    switch.input_type = "GEOMETRY"
    link(inputs.outputs["Ellipsoids"], switch.inputs["Switch"])
    link(_points(group, inputs, cloud), switch.inputs["False"])
    link(_ellipsoids(group, inputs, cloud), switch.inputs["True"])
    link(switch.outputs["Output"], output.inputs["Geometry"])
    for index, node in enumerate(nodes):
        node.location = (220 * (index % 5), -220 * (index // 5))
    return group


def _points(group: Any, inputs: Any, cloud: Any) -> Any:
    """Equal spheres; returns the geometry socket."""
    radius = group.nodes.new("ShaderNodeMath")
    radius.operation = "MULTIPLY"
    radius.inputs[1].default_value = POINT_RADIUS_M
    group.links.new(inputs.outputs["Size"], radius.inputs[0])
    node = group.nodes.new("GeometryNodeSetPointRadius")
    group.links.new(cloud.outputs["Points"], node.inputs[0])
    group.links.new(radius.outputs[0], node.inputs["Radius"])
    return _set_material(group, node.outputs[0], "GEOMETRY")


def _ellipsoids(group: Any, inputs: Any, cloud: Any) -> Any:
    """One instanced sphere per Gaussian; returns the geometry socket."""
    sphere = group.nodes.new("GeometryNodeMeshIcoSphere")
    sphere.inputs["Subdivisions"].default_value = 3
    sphere.inputs["Radius"].default_value = 1.0
    smooth = group.nodes.new("GeometryNodeSetShadeSmooth")
    group.links.new(sphere.outputs["Mesh"], smooth.inputs[0])
    scale = group.nodes.new("ShaderNodeVectorMath")
    scale.operation = "SCALE"
    group.links.new(_attribute(group, "scale", "FLOAT_VECTOR"), scale.inputs[0])
    group.links.new(inputs.outputs["Size"], scale.inputs["Scale"])
    node = group.nodes.new("GeometryNodeInstanceOnPoints")
    group.links.new(cloud.outputs["Points"], node.inputs["Points"])
    shaped = _set_material(group, smooth.outputs[0], "INSTANCER")
    group.links.new(shaped, node.inputs["Instance"])
    group.links.new(_attribute(group, "rotation", "QUATERNION"), node.inputs["Rotation"])
    group.links.new(scale.outputs["Vector"], node.inputs["Scale"])
    return node.outputs["Instances"]


def _attribute(group: Any, name: str, kind: str) -> Any:
    node = group.nodes.new("GeometryNodeInputNamedAttribute")
    node.data_type = kind
    node.inputs["Name"].default_value = name
    return next(socket for socket in node.outputs if socket.enabled and socket.name == "Attribute")


def _set_material(group: Any, geometry: Any, domain: str) -> Any:
    node = group.nodes.new("GeometryNodeSetMaterial")
    node.inputs["Material"].default_value = _material(domain)
    group.links.new(geometry, node.inputs["Geometry"])
    return node.outputs["Geometry"]


def _material(domain: str) -> bpy.types.Material:
    """Shows `rfgs_color`; part of the light is the surface's own, so dark rooms do not hide it."""
    name = f"{GROUP} {domain.lower()}"
    material = bpy.data.materials.get(name)
    if material is not None:
        return material
    material = bpy.data.materials.new(name)
    if material.node_tree is None:
        material.use_nodes = True
    tree = material.node_tree
    shader = next(node for node in tree.nodes if node.type == "BSDF_PRINCIPLED")
    colour = tree.nodes.new("ShaderNodeAttribute")
    colour.attribute_type, colour.attribute_name = domain, "rfgs_color"
    colour.location = (-300, 200)
    tree.links.new(colour.outputs["Color"], shader.inputs["Base Color"])
    tree.links.new(colour.outputs["Color"], shader.inputs["Emission Color"])
    shader.inputs["Emission Strength"].default_value = 0.5
    shader.inputs["Roughness"].default_value = 0.9
    shader.inputs["Specular IOR Level"].default_value = 0.1
    return material
