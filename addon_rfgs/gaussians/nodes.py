# SPDX-License-Identifier: GPL-3.0-or-later
"""The geometry nodes that show Gaussians, built in code; files need no add-on to play them."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np

from .coloring import COLOR_ATTRIBUTE
from .look import material, splat_material

#: Name of the node group, and of the modifiers that use it.
GROUP = "RFGS Gaussians"
#: Radius of a point at size 1 [m].
POINT_RADIUS_M = 0.012
#: A threshold of power that every Gaussian reaches [dB].
NO_POWER_DB = -300.0

#: Attributes that nothing is drawn from.
_KEPT_FOR_FILES = ("ply_*", "f_*")
#: Attributes that nothing is drawn from once shapes are there.
_USED = ("rf_*", "opacity", "scale", "rotation", "radius", "gid", "body", "error_m")

#: Input sockets: name, type, default, minimum, maximum, what it does.
_INPUTS = (
    ("Ellipsoids", "NodeSocketBool", False, None, None, "Ellipsoids instead of equal points"),
    ("Splats", "NodeSocketBool", False, None, None, "Ellipsoids that fade out as Gaussians do"),
    ("Opacity Threshold", "NodeSocketFloat", 0.005, 0.0, 1.0, "Hide Gaussians below this opacity"),
    ("Power Threshold", "NodeSocketFloat", NO_POWER_DB, NO_POWER_DB, 300.0,
     "Hide Gaussians known to reflect less power [dB]"),
    ("Size", "NodeSocketFloat", 1.0, 0.0, 100.0, "Size of points, or standard deviations shown"),
    ("Solid View", "NodeSocketBool", False, None, None,
     "Real meshes, which the Solid view can colour; slower"),
    ("Crop", "NodeSocketBool", False, None, None, "Hide Gaussians outside the crop box"),
    ("Crop Box", "NodeSocketObject", None, None, None,
     "Gaussians within one unit of its axes are shown: an Empty drawn as a cube"),
)  # fmt: skip


def socket_ids(group: Any) -> dict[str, str]:
    """Name of each input of a group → its identifier."""
    return {
        item.name: item.identifier
        for item in group.interface.items_tree
        if item.item_type == "SOCKET" and item.in_out == "INPUT"
    }


def node_group() -> Any:
    """The group of this version; a file of an older one keeps its own beside it."""
    wanted = {"Geometry", *(row[0] for row in _INPUTS)}
    for group in bpy.data.node_groups:
        if group.name.split(".")[0] == GROUP and set(socket_ids(group)) == wanted:
            return group
    return _build_group()


def _build_group() -> Any:
    group: Any = bpy.data.node_groups.new(GROUP, "GeometryNodeTree")
    group.is_modifier = True
    interface = group.interface
    interface.new_socket("Geometry", in_out="INPUT", socket_type="NodeSocketGeometry")
    for name, kind, default, low, high, text in _INPUTS:
        socket = interface.new_socket(name, in_out="INPUT", socket_type=kind, description=text)
        if default is not None:
            socket.default_value = default
        if low is not None:
            socket.min_value, socket.max_value = low, high
    interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    inputs, output = group.nodes.new("NodeGroupInput"), group.nodes.new("NodeGroupOutput")
    build = _Builder(group, inputs)
    cloud = group.nodes.new("GeometryNodeMeshToPoints")
    lean = _without(build, build.input("Geometry"), *_KEPT_FOR_FILES)
    build.link(lean, cloud.inputs["Mesh"])
    build.link(_kept(build), cloud.inputs["Selection"])
    points = _points(build, cloud.outputs[0])
    shapes = _shapes(build, cloud.outputs[0])
    solid = build.input("Solid View")
    shown = build.switch(build.either(build.input("Ellipsoids"), solid), points, shapes)
    real = _real(build, lean, shapes)
    build.link(build.switch(solid, shown, real), output.inputs["Geometry"])
    # All at once: the group is updated after every single assignment.
    index = np.arange(len(group.nodes))
    group.nodes.foreach_set(
        "location", np.stack([220 * (index % 8), -260 * (index // 8)], 1).ravel().astype(np.float32)
    )
    return group


class _Builder:
    """Adds nodes to a group and joins them."""

    def __init__(self, group: Any, inputs: Any) -> None:
        self.nodes, self.link, self._inputs = group.nodes, group.links.new, inputs

    def input(self, name: str) -> Any:
        return self._inputs.outputs[name]

    def attribute(self, name: str, kind: str) -> Any:
        node = self.nodes.new("GeometryNodeInputNamedAttribute")
        node.data_type = kind
        node.inputs["Name"].default_value = name
        return next(socket for socket in node.outputs if socket.enabled and socket.name[0] == "A")

    def either(self, first: Any, second: Any) -> Any:
        return self._boolean("OR", first, second)

    def both(self, first: Any, second: Any) -> Any:
        return self._boolean("AND", first, second)

    def negated(self, value: Any) -> Any:
        return self._boolean("NOT", value)

    def _boolean(self, operation: str, *values: Any) -> Any:
        node = self.nodes.new("FunctionNodeBooleanMath")
        node.operation = operation
        for value, socket in zip(values, node.inputs, strict=False):
            self.link(value, socket)
        return node.outputs[0]

    def compare(self, operation: str, first: Any, second: Any, kind: str = "FLOAT") -> Any:
        node = self.nodes.new("FunctionNodeCompare")
        node.data_type, node.operation = kind, operation
        places = {socket.name: socket for socket in node.inputs if socket.enabled}
        for value, socket in ((first, places["A"]), (second, places["B"])):
            if isinstance(value, int | float):
                socket.default_value = value
            else:
                self.link(value, socket)
        return node.outputs["Result"]

    def switch(self, condition: Any, false: Any, true: Any, kind: str = "GEOMETRY") -> Any:
        node = self.nodes.new("GeometryNodeSwitch")
        node.input_type = kind
        places = {socket.name: socket for socket in node.inputs if socket.enabled}
        self.link(condition, places["Switch"])
        for value, socket in ((false, places["False"]), (true, places["True"])):
            if isinstance(value, int):
                socket.default_value = value
            else:
                self.link(value, socket)
        return next(socket for socket in node.outputs if socket.enabled)

    def vector(self, operation: str, first: Any, second: Any = None) -> Any:
        node = self.nodes.new("ShaderNodeVectorMath")
        node.operation = operation
        self.link(first, node.inputs[0])
        if second is not None:
            self.link(second, node.inputs["Scale" if operation == "SCALE" else 1])
        return next(socket for socket in node.outputs if socket.enabled)

    def material(self, geometry: Any, domain: str) -> Any:
        return self.with_material(geometry, material(domain, COLOR_ATTRIBUTE))

    def with_material(self, geometry: Any, shown: bpy.types.Material) -> Any:
        node = self.nodes.new("GeometryNodeSetMaterial")
        node.inputs["Material"].default_value = shown
        self.link(geometry, node.inputs["Geometry"])
        return node.outputs["Geometry"]


def _without(build: _Builder, geometry: Any, *patterns: str) -> Any:
    """The geometry without attributes of these names: copying them would cost time."""
    for pattern in patterns:
        node = build.nodes.new("GeometryNodeRemoveAttribute")
        if hasattr(node, "pattern_mode"):
            node.pattern_mode = "WILDCARD"
        else:  # Blender 5.0 made it a socket.
            node.inputs["Pattern Mode"].default_value = "Wildcard"
        node.inputs["Name"].default_value = pattern
        build.link(geometry, node.inputs["Geometry"])
        geometry = node.outputs[0]
    return geometry


def _kept(build: _Builder) -> Any:
    """Which Gaussians are shown."""
    opaque = build.compare(
        "GREATER_EQUAL", build.attribute("opacity", "FLOAT"), build.input("Opacity Threshold")
    )
    power = build.attribute("rf_power_db", "FLOAT")
    weak = build.compare("LESS_THAN", power, build.input("Power Threshold"))
    box = build.nodes.new("GeometryNodeObjectInfo")
    box.transform_space = "RELATIVE"
    build.link(build.input("Crop Box"), box.inputs["Object"])
    invert = build.nodes.new("FunctionNodeInvertMatrix")
    build.link(box.outputs["Transform"], invert.inputs[0])
    place = build.nodes.new("FunctionNodeTransformPoint")
    build.link(build.nodes.new("GeometryNodeInputPosition").outputs[0], place.inputs["Vector"])
    build.link(invert.outputs[0], place.inputs["Transform"])
    split = build.nodes.new("ShaderNodeSeparateXYZ")
    build.link(build.vector("ABSOLUTE", place.outputs[0]), split.inputs[0])
    inside = build.negated(build.input("Crop"))
    within = [build.compare("LESS_EQUAL", axis, 1.0) for axis in split.outputs]
    inside = build.either(inside, build.both(within[0], build.both(within[1], within[2])))
    return build.both(build.both(opaque, build.negated(weak)), inside)


def _points(build: _Builder, cloud: Any) -> Any:
    """Equal spheres as a point cloud; the fastest to draw."""
    node = build.nodes.new("GeometryNodeSetPointRadius")
    build.link(cloud, node.inputs[0])
    build.link(_radius(build), node.inputs["Radius"])
    return build.material(node.outputs[0], "GEOMETRY")


def _radius(build: _Builder) -> Any:
    node = build.nodes.new("ShaderNodeMath")
    node.operation = "MULTIPLY"
    node.inputs[1].default_value = POINT_RADIUS_M
    build.link(build.input("Size"), node.inputs[0])
    return node.outputs[0]


def _shapes(build: _Builder, cloud: Any) -> Any:
    """One instanced sphere per Gaussian, coarse for the Solid view, stretched as an ellipsoid."""
    fine = build.nodes.new("GeometryNodeMeshIcoSphere")
    fine.inputs["Subdivisions"].default_value, fine.inputs["Radius"].default_value = 3, 1.0
    coarse = build.nodes.new("GeometryNodeMeshUVSphere")  # eight faces
    coarse.inputs["Segments"].default_value, coarse.inputs["Rings"].default_value = 4, 2
    coarse.inputs["Radius"].default_value = 1.0
    sphere = build.switch(build.input("Solid View"), fine.outputs["Mesh"], coarse.outputs["Mesh"])
    smooth = build.nodes.new("GeometryNodeSetShadeSmooth")
    build.link(sphere, smooth.inputs[0])
    stretched = build.vector("SCALE", build.attribute("scale", "FLOAT_VECTOR"), build.input("Size"))
    ball = build.nodes.new("ShaderNodeCombineXYZ")
    for socket in ball.inputs:
        build.link(_radius(build), socket)
    node = build.nodes.new("GeometryNodeInstanceOnPoints")
    build.link(cloud, node.inputs["Points"])
    firm = build.material(smooth.outputs[0], "INSTANCER")
    soft = build.with_material(smooth.outputs[0], splat_material(COLOR_ATTRIBUTE))
    build.link(build.switch(build.input("Splats"), firm, soft), node.inputs["Instance"])
    build.link(build.attribute("rotation", "QUATERNION"), node.inputs["Rotation"])
    scale = build.switch(build.input("Ellipsoids"), ball.outputs[0], stretched, "VECTOR")
    build.link(scale, node.inputs["Scale"])
    return node.outputs["Instances"]


def _real(build: _Builder, cloud: Any, shapes: Any) -> Any:
    """The shapes as one mesh whose active colour is the cloud's.

    One loose point of the cloud comes first: from it the mesh takes over which colour is
    active. Nothing shows it, as it has no face.
    """
    index = build.nodes.new("GeometryNodeInputIndex").outputs[0]
    rest = build.nodes.new("GeometryNodeDeleteGeometry")
    build.link(cloud, rest.inputs["Geometry"])
    build.link(build.compare("GREATER_THAN", index, 0, "INT"), rest.inputs["Selection"])
    join = build.nodes.new("GeometryNodeJoinGeometry")
    for part in (shapes, rest.outputs[0]):
        build.link(part, join.inputs[0])
    real = build.nodes.new("GeometryNodeRealizeInstances")
    build.link(_without(build, join.outputs[0], *_USED), real.inputs["Geometry"])
    return build.material(real.outputs[0], "GEOMETRY")
