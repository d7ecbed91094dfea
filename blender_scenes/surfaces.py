# SPDX-License-Identifier: GPL-3.0-or-later
"""What things are made of: one row per surface, for the eye and for the radio."""

from __future__ import annotations

import bpy

from blender_scenes.surface import Colour, Surface
from blender_scenes.surfaces_outdoor import OUTDOOR

#: Textiles and leaves have no model of their own: wood of their thickness stands in for them.
SURFACES: dict[str, Surface] = {
    "wall_paint": Surface((0.79, 0.75, 0.68), "plasterboard", 0.0125, roughness=0.9),
    "wall_outer": Surface((0.79, 0.75, 0.68), "concrete", 0.20, roughness=0.9),
    "wall_accent": Surface((0.13, 0.24, 0.24), "concrete", 0.20, roughness=0.9),
    "ceiling_white": Surface((0.86, 0.86, 0.84), "ceiling_board", 0.012, roughness=0.95),
    "white_wood": Surface((0.80, 0.79, 0.76), "wood", 0.03, roughness=0.45),
    "oak_floor": Surface(
        (0.42, 0.26, 0.13), "concrete", 0.20, "planks", (0.30, 0.175, 0.085), roughness=0.45
    ),
    "rug": Surface((0.66, 0.60, 0.50), "concrete", 0.20, "rug", (0.32, 0.12, 0.08), 0.95),
    "rug_border": Surface((0.24, 0.075, 0.05), "concrete", 0.20, roughness=0.95),
    "window_pane": Surface((0.80, 0.90, 1.0), "glass", 0.006, "pane", roughness=0.1),
    "oak": Surface((0.46, 0.29, 0.15), "wood", 0.03, "grain", (0.34, 0.20, 0.095), 0.4),
    "walnut": Surface((0.17, 0.085, 0.045), "wood", 0.03, "grain", (0.10, 0.048, 0.026), 0.4),
    "door_wood": Surface((0.36, 0.20, 0.10), "wood", 0.04, roughness=0.45),
    "door_panel": Surface((0.30, 0.16, 0.078), "wood", 0.04, roughness=0.45),
    "sofa_cloth": Surface(
        (0.12, 0.20, 0.29), "chipboard", 0.03, "weave", (0.09, 0.155, 0.23), 0.95
    ),
    "armchair_cloth": Surface(
        (0.52, 0.27, 0.06), "chipboard", 0.03, "weave", (0.42, 0.21, 0.045), 0.95
    ),
    "cushion_rust": Surface((0.47, 0.13, 0.06), "chipboard", 0.03, "weave", (0.39, 0.1, 0.05), 0.9),
    "cushion_sand": Surface(
        (0.66, 0.55, 0.38), "chipboard", 0.03, "weave", (0.57, 0.47, 0.32), 0.9
    ),
    "curtain_linen": Surface((0.70, 0.64, 0.53), "wood", 0.001, "weave", (0.62, 0.56, 0.46), 0.95),
    "lamp_shade": Surface((0.90, 0.78, 0.58), "wood", 0.001, "glow", roughness=0.8),
    "ceiling_light": Surface((1.0, 0.95, 0.86), "glass", 0.004, "glow", roughness=0.3),
    "black_metal": Surface((0.02, 0.02, 0.022), "metal", 0.002, roughness=0.4, metallic=0.6),
    "brass": Surface((0.62, 0.42, 0.16), "metal", 0.002, roughness=0.3, metallic=1.0),
    "tv_screen": Surface((0.008, 0.009, 0.012), "glass", 0.005, roughness=0.12),
    "terracotta": Surface((0.50, 0.20, 0.10), "concrete", 0.01, roughness=0.8),
    "soil": Surface((0.045, 0.028, 0.018), "concrete", 0.05, roughness=1.0),
    "leaf": Surface((0.07, 0.22, 0.06), "wood", 0.001, roughness=0.5),
    "book_red": Surface((0.42, 0.06, 0.05), "chipboard", 0.02, roughness=0.7),
    "book_blue": Surface((0.06, 0.14, 0.33), "chipboard", 0.02, roughness=0.7),
    "book_cream": Surface((0.72, 0.65, 0.50), "chipboard", 0.02, roughness=0.7),
    "book_green": Surface((0.10, 0.24, 0.15), "chipboard", 0.02, roughness=0.7),
    "book_ochre": Surface((0.58, 0.36, 0.08), "chipboard", 0.02, roughness=0.7),
    "paper_white": Surface((0.85, 0.83, 0.78), "wood", 0.002, roughness=0.9),
    "paint_rust": Surface((0.50, 0.15, 0.07), "wood", 0.002, roughness=0.9),
    "paint_teal": Surface((0.05, 0.22, 0.24), "wood", 0.002, roughness=0.9),
    "paint_sand": Surface((0.72, 0.55, 0.33), "wood", 0.002, roughness=0.9),
    "desk_top": Surface((0.78, 0.77, 0.74), "chipboard", 0.028, roughness=0.4),
    "desk_panel": Surface((0.30, 0.33, 0.35), "chipboard", 0.018, roughness=0.6),
    "screen_on": Surface((0.10, 0.28, 0.50), "glass", 0.005, "glow", roughness=0.2),
    "chair_cloth": Surface((0.10, 0.13, 0.15), "chipboard", 0.03, "weave", (0.07, 0.09, 0.11), 0.9),
    "cabinet_metal": Surface((0.42, 0.44, 0.45), "metal", 0.002, roughness=0.45, metallic=0.4),
    "board_white": Surface((0.90, 0.90, 0.90), "metal", 0.002, roughness=0.2),
    "ink_blue": Surface((0.03, 0.08, 0.35), "wood", 0.002, roughness=0.6),
    "ink_red": Surface((0.50, 0.04, 0.03), "wood", 0.002, roughness=0.6),
    "box_card": Surface((0.46, 0.31, 0.17), "wood", 0.004, roughness=0.9),
    "carpet_grey": Surface((0.20, 0.21, 0.23), "concrete", 0.20, "weave", (0.16, 0.17, 0.19), 0.95),
    "linoleum": Surface((0.34, 0.38, 0.37), "concrete", 0.20, "weave", (0.29, 0.33, 0.32), 0.35),
    "terrazzo": Surface((0.40, 0.38, 0.35), "concrete", 0.20, "weave", (0.33, 0.31, 0.285), 0.3),
    "screed": Surface((0.38, 0.37, 0.36), "concrete", 0.20, "weave", (0.33, 0.32, 0.31), 0.7),
    "wall_sage": Surface((0.50, 0.57, 0.47), "concrete", 0.20, roughness=0.9),
    "wall_blue": Surface((0.30, 0.40, 0.50), "concrete", 0.20, roughness=0.9),
    "wall_rose": Surface((0.66, 0.50, 0.46), "concrete", 0.20, roughness=0.9),
    "wall_grey": Surface((0.55, 0.56, 0.57), "plasterboard", 0.0125, roughness=0.9),
    "bare_concrete": Surface(
        (0.42, 0.41, 0.40), "concrete", 0.20, "weave", (0.35, 0.345, 0.34), 0.95
    ),
    "locker_blue": Surface((0.08, 0.20, 0.36), "metal", 0.002, roughness=0.4),
    "locker_grey": Surface((0.50, 0.53, 0.56), "metal", 0.002, roughness=0.4),
    "cork": Surface((0.48, 0.30, 0.15), "wood", 0.02, "weave", (0.40, 0.24, 0.115), 0.95),
    "fire_red": Surface((0.60, 0.02, 0.02), "metal", 0.002, roughness=0.3),
    "sign_green": Surface((0.05, 0.50, 0.20), "glass", 0.004, "glow", roughness=0.3),
    "planter_grey": Surface((0.28, 0.29, 0.30), "concrete", 0.03, roughness=0.8),
    "stone": Surface((0.42, 0.39, 0.35), "concrete", 0.20, "weave", (0.35, 0.325, 0.29), 0.6),
    "linen_white": Surface((0.84, 0.82, 0.78), "chipboard", 0.03, roughness=0.95),
    "blanket": Surface((0.18, 0.26, 0.34), "chipboard", 0.03, "weave", (0.14, 0.21, 0.28), 0.95),
    "wardrobe_door": Surface((0.72, 0.70, 0.66), "wood", 0.02, roughness=0.5),
    "mirror": Surface((0.85, 0.87, 0.88), "glass", 0.006, roughness=0.03, metallic=1.0),
    "skin": Surface((0.60, 0.33, 0.22), "skin", 0.30, roughness=0.5),
    "lips": Surface((0.48, 0.19, 0.14), "skin", 0.30, roughness=0.4),
    "eyes": Surface((0.05, 0.03, 0.025), "skin", 0.30, roughness=0.15),
    "hair": Surface((0.045, 0.025, 0.015), "skin", 0.30, roughness=0.6),
    "shirt": Surface((0.55, 0.085, 0.065), "skin", 0.30, "weave", (0.47, 0.07, 0.055), 0.9),
    "trousers": Surface((0.035, 0.05, 0.10), "skin", 0.30, "weave", (0.045, 0.065, 0.125), 0.9),
    "shoes": Surface((0.70, 0.68, 0.63), "skin", 0.30, roughness=0.6),
    "soles": Surface((0.16, 0.14, 0.12), "skin", 0.30, roughness=0.8),
    **OUTDOOR,
}


def material(name: str) -> bpy.types.Material:
    """The Blender material of surface `name`, made at first use."""
    made = bpy.data.materials.get(name)
    return made if made is not None else new_material(name, SURFACES[name])


def new_material(name: str, surface: Surface) -> bpy.types.Material:
    """Makes a Blender material that looks and reflects like `surface`."""
    made = bpy.data.materials.new(name)
    made.use_nodes = True
    # Solid view shows the colour too, so that the scene reads well before the first render.
    made.diffuse_color = (*surface.colour, 1.0)
    made.roughness, made.metallic = surface.roughness, surface.metallic
    made.rfgs.radio_material = surface.radio
    made.rfgs.thickness_m = surface.thickness_m
    nodes = Nodes(made)
    if surface.texture == "pane":
        nodes.pane(surface)
    else:
        nodes.plain(surface)
        if surface.texture != "plain":
            getattr(nodes, surface.texture)(surface)
    return made


class Nodes:
    """Puts a surface's texture into the node tree of a new material."""

    def __init__(self, made: bpy.types.Material) -> None:
        self.tree = made.node_tree
        self.shader = next(n for n in self.tree.nodes if n.type == "BSDF_PRINCIPLED")
        self.output = next(n for n in self.tree.nodes if n.type == "OUTPUT_MATERIAL")

    def add(self, kind: str, column: int, **inputs: object) -> bpy.types.Node:
        """A new node, placed in a `column` left of the shader, with default `inputs`."""
        node = self.tree.nodes.new(kind)
        node.location = (self.shader.location.x - 220 * column, self.shader.location.y)
        for name, value in inputs.items():
            node.inputs[name].default_value = value
        return node

    def plain(self, surface: Surface) -> None:
        """One colour."""
        self.shader.inputs["Base Color"].default_value = (*surface.colour, 1.0)
        self.shader.inputs["Roughness"].default_value = surface.roughness
        self.shader.inputs["Metallic"].default_value = surface.metallic

    def _coordinates(self, scale: Colour) -> bpy.types.NodeSocket:
        source = self.add("ShaderNodeTexCoord", 4)
        mapping = self.add("ShaderNodeMapping", 3, Scale=scale)
        self.tree.links.new(source.outputs["Object"], mapping.inputs["Vector"])
        return mapping.outputs["Vector"]

    def _mix(self, surface: Surface, factor: bpy.types.NodeSocket) -> None:
        ramp = self.add("ShaderNodeValToRGB", 1)
        ramp.color_ramp.elements[0].color = (*surface.colour, 1.0)
        ramp.color_ramp.elements[1].color = (*surface.second, 1.0)
        ramp.color_ramp.elements[0].position = 0.3
        ramp.color_ramp.elements[1].position = 0.7
        self.tree.links.new(factor, ramp.inputs["Fac"])
        self.tree.links.new(ramp.outputs["Color"], self.shader.inputs["Base Color"])

    def grain(self, surface: Surface) -> None:
        """Wood: noise stretched along x."""
        noise = self.add("ShaderNodeTexNoise", 2, Scale=3.0, Detail=3.0)
        self.tree.links.new(self._coordinates((0.8, 9.0, 9.0)), noise.inputs["Vector"])
        self._mix(surface, noise.outputs["Fac"])

    def weave(self, surface: Surface) -> None:
        """Cloth: soft blotches, large enough to survive a small picture."""
        noise = self.add("ShaderNodeTexNoise", 2, Scale=26.0, Detail=2.0)
        self.tree.links.new(self._coordinates((1.0, 1.0, 1.0)), noise.inputs["Vector"])
        self._mix(surface, noise.outputs["Fac"])

    def planks(self, surface: Surface) -> None:
        """Floor boards, 1.4 m by 0.16 m, each of its own shade."""
        brick = self.add("ShaderNodeTexBrick", 2, Scale=1.0)
        brick.inputs["Brick Width"].default_value = 1.4
        brick.inputs["Row Height"].default_value = 0.16
        brick.inputs["Mortar Size"].default_value = 0.0025
        brick.inputs["Color1"].default_value = (*surface.colour, 1.0)
        brick.inputs["Color2"].default_value = (*surface.second, 1.0)
        brick.inputs["Mortar"].default_value = (0.09, 0.05, 0.025, 1.0)
        self.tree.links.new(self._coordinates((1.0, 1.0, 1.0)), brick.inputs["Vector"])
        self.tree.links.new(brick.outputs["Color"], self.shader.inputs["Base Color"])

    def bricks(self, surface: Surface) -> None:
        """Courses of bricks on upright walls along x or y."""
        brick = self.add("ShaderNodeTexBrick", 2, Scale=1.0)
        brick.inputs["Brick Width"].default_value = 0.25
        brick.inputs["Row Height"].default_value = 0.083
        brick.inputs["Mortar Size"].default_value = 0.008
        brick.inputs["Color1"].default_value = (*surface.colour, 1.0)
        brick.inputs["Color2"].default_value = (*surface.second, 1.0)
        brick.inputs["Mortar"].default_value = (0.33, 0.30, 0.27, 1.0)
        vector = self._coordinates((1.0, 1.0, 1.0))
        # The texture lies in x and y: the wall's height has to become y.
        parts, joined = self.add("ShaderNodeSeparateXYZ", 3), self.add("ShaderNodeCombineXYZ", 3)
        along = self.add("ShaderNodeMath", 3)
        self.tree.links.new(vector, parts.inputs[0])
        self.tree.links.new(parts.outputs["X"], along.inputs[0])
        self.tree.links.new(parts.outputs["Y"], along.inputs[1])
        self.tree.links.new(along.outputs[0], joined.inputs["X"])
        self.tree.links.new(parts.outputs["Z"], joined.inputs["Y"])
        self.tree.links.new(joined.outputs[0], brick.inputs["Vector"])
        self.tree.links.new(brick.outputs["Color"], self.shader.inputs["Base Color"])

    def rug(self, surface: Surface) -> None:
        """A rug with fine diamonds between two shades of wool."""
        checker = self.add("ShaderNodeTexChecker", 1, Scale=9.0)
        checker.inputs["Color1"].default_value = (*surface.colour, 1.0)
        checker.inputs["Color2"].default_value = (*[0.82 * c for c in surface.colour], 1.0)
        vector = self._coordinates((1.0, 1.0, 1.0))
        vector.node.inputs["Rotation"].default_value = (0.0, 0.0, 0.7854)
        self.tree.links.new(vector, checker.inputs["Vector"])
        self.tree.links.new(checker.outputs["Color"], self.shader.inputs["Base Color"])

    def glow(self, surface: Surface) -> None:
        """A lamp that is switched on."""
        self.shader.inputs["Emission Color"].default_value = (*surface.colour, 1.0)
        self.shader.inputs["Emission Strength"].default_value = 0.85

    def beam(self, surface: Surface) -> None:
        """A lamp that one sees from afar."""
        self.glow(surface)
        self.shader.inputs["Emission Strength"].default_value = 3.0

    def lacquer(self, _surface: Surface) -> None:
        """Car paint: a clear coat over the colour."""
        self.shader.inputs["Coat Weight"].default_value = 1.0
        self.shader.inputs["Coat Roughness"].default_value = 0.03

    def pane(self, surface: Surface) -> None:
        """Bright sky to the eye, clear glass to the sun's light."""
        sky = self.add("ShaderNodeEmission", 1, Color=(*surface.colour, 1.0), Strength=1.9)
        clear = self.add("ShaderNodeBsdfTransparent", 1)
        ray = self.add("ShaderNodeLightPath", 1)
        mix = self.add("ShaderNodeMixShader", 0)
        self.tree.links.new(ray.outputs["Is Shadow Ray"], mix.inputs[0])
        self.tree.links.new(sky.outputs[0], mix.inputs[1])
        self.tree.links.new(clear.outputs[0], mix.inputs[2])
        self.tree.links.new(mix.outputs[0], self.output.inputs["Surface"])
        self.tree.nodes.remove(self.shader)
