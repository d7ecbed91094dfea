# SPDX-License-Identifier: GPL-3.0-or-later
"""Surfaces of vehicles, streets and halls, for the table in `surfaces`.

Rubber and asphalt have no model of their own: wood and concrete of their thickness stand in.
"""

from __future__ import annotations

from blender_scenes.surface import Surface

OUTDOOR: dict[str, Surface] = {
    "car_red": Surface((0.42, 0.016, 0.014), "metal", 0.001, "lacquer", roughness=0.35),
    "car_silver": Surface(
        (0.46, 0.48, 0.50), "metal", 0.001, "lacquer", roughness=0.3, metallic=0.7
    ),
    "car_blue": Surface((0.015, 0.06, 0.20), "metal", 0.001, "lacquer", roughness=0.35),
    "car_green": Surface((0.03, 0.10, 0.055), "metal", 0.001, "lacquer", roughness=0.35),
    "car_sand": Surface((0.50, 0.42, 0.30), "metal", 0.001, "lacquer", roughness=0.35),
    "van_white": Surface((0.74, 0.75, 0.74), "metal", 0.001, "lacquer", roughness=0.4),
    "van_stripe": Surface((0.02, 0.22, 0.30), "metal", 0.001, "lacquer", roughness=0.4),
    "underbody": Surface((0.018, 0.018, 0.02), "metal", 0.001, roughness=0.9),
    "car_glass": Surface((0.012, 0.016, 0.02), "glass", 0.004, roughness=0.04),
    "plastic_black": Surface((0.022, 0.022, 0.024), "chipboard", 0.003, roughness=0.6),
    "plate_white": Surface((0.78, 0.78, 0.74), "metal", 0.001, roughness=0.5),
    "headlight": Surface((1.0, 0.93, 0.80), "glass", 0.004, "beam", roughness=0.1),
    "headlight_off": Surface((0.62, 0.66, 0.70), "glass", 0.004, roughness=0.08, metallic=0.6),
    "tail_lamp": Surface((0.60, 0.01, 0.008), "glass", 0.004, "glow", roughness=0.1),
    "tail_lamp_off": Surface((0.20, 0.006, 0.006), "glass", 0.004, roughness=0.15),
    "beacon": Surface((1.0, 0.42, 0.03), "glass", 0.004, "glow", roughness=0.2),
    "tyre": Surface((0.014, 0.014, 0.015), "wood", 0.02, roughness=0.9),
    "rim_dark": Surface((0.03, 0.03, 0.032), "metal", 0.003, roughness=0.6),
    "alloy": Surface((0.62, 0.63, 0.65), "metal", 0.003, roughness=0.3, metallic=0.9),
    "machine_yellow": Surface((0.72, 0.36, 0.012), "metal", 0.004, "lacquer", roughness=0.4),
    "machine_grey": Surface((0.10, 0.105, 0.11), "metal", 0.004, roughness=0.5),
    "fork_steel": Surface((0.16, 0.16, 0.17), "metal", 0.02, roughness=0.45, metallic=0.8),
    "seat_vinyl": Surface((0.02, 0.02, 0.022), "chipboard", 0.03, roughness=0.6),
    "asphalt": Surface(
        (0.060, 0.060, 0.064), "concrete", 0.20, "weave", (0.045, 0.045, 0.049), 0.85
    ),
    "asphalt_wet": Surface(
        (0.030, 0.032, 0.038), "concrete", 0.20, "weave", (0.022, 0.024, 0.028), 0.32
    ),
    "line_white": Surface((0.72, 0.72, 0.69), "concrete", 0.20, roughness=0.8),
    "line_yellow": Surface((0.70, 0.45, 0.05), "concrete", 0.20, roughness=0.8),
    "kerb_stone": Surface((0.34, 0.33, 0.31), "concrete", 0.20, "weave", (0.29, 0.28, 0.265), 0.9),
    "paving": Surface((0.30, 0.285, 0.265), "concrete", 0.20, "weave", (0.25, 0.24, 0.22), 0.85),
    "rubber_hump": Surface((0.03, 0.03, 0.03), "concrete", 0.20, roughness=0.8),
    "lawn": Surface((0.055, 0.12, 0.022), "concrete", 0.20, "weave", (0.035, 0.085, 0.016), 1.0),
    "bark": Surface((0.11, 0.075, 0.05), "wood", 0.20, "grain", (0.07, 0.047, 0.03), 0.95),
    "foliage": Surface((0.06, 0.17, 0.035), "wood", 0.002, "weave", (0.035, 0.11, 0.02), 0.8),
    "foliage_gold": Surface((0.42, 0.22, 0.03), "wood", 0.002, "weave", (0.27, 0.12, 0.015), 0.8),
    "post_steel": Surface((0.20, 0.21, 0.22), "metal", 0.004, roughness=0.4, metallic=0.7),
    "post_green": Surface((0.02, 0.055, 0.045), "metal", 0.004, roughness=0.45),
    "lamp_warm": Surface((1.0, 0.66, 0.30), "glass", 0.004, "beam", roughness=0.3),
    "lamp_cold": Surface((0.82, 0.92, 1.0), "glass", 0.004, "beam", roughness=0.3),
    "shop_glow": Surface((1.0, 0.72, 0.40), "glass", 0.008, "glow", roughness=0.2),
    "shop_glow_cool": Surface((0.62, 0.80, 1.0), "glass", 0.008, "glow", roughness=0.2),
    "glass_dark": Surface((0.03, 0.04, 0.055), "glass", 0.008, roughness=0.05),
    "facade_cream": Surface(
        (0.56, 0.47, 0.34), "concrete", 0.20, "weave", (0.50, 0.42, 0.30), 0.95
    ),
    "facade_brick": Surface(
        (0.30, 0.105, 0.06), "concrete", 0.20, "bricks", (0.22, 0.075, 0.045), 0.9
    ),
    "facade_slate": Surface(
        (0.16, 0.19, 0.23), "concrete", 0.20, "weave", (0.13, 0.155, 0.19), 0.9
    ),
    "facade_white": Surface((0.68, 0.68, 0.66), "concrete", 0.20, roughness=0.9),
    "awning_red": Surface((0.50, 0.03, 0.03), "wood", 0.001, "weave", (0.42, 0.025, 0.025), 0.9),
    "awning_cream": Surface((0.74, 0.68, 0.55), "wood", 0.001, "weave", (0.67, 0.61, 0.49), 0.9),
    "sign_blue": Surface((0.02, 0.10, 0.42), "metal", 0.002, roughness=0.4),
    "hall_floor": Surface(
        (0.25, 0.255, 0.26), "concrete", 0.20, "weave", (0.215, 0.22, 0.225), 0.3
    ),
    "cladding": Surface((0.40, 0.43, 0.45), "metal", 0.001, roughness=0.5),
    "roof_sheet": Surface((0.30, 0.31, 0.32), "metal", 0.001, roughness=0.6),
    "dock_door": Surface((0.62, 0.64, 0.64), "metal", 0.001, roughness=0.45),
    "rack_blue": Surface((0.012, 0.05, 0.20), "metal", 0.002, roughness=0.4),
    "rack_orange": Surface((0.75, 0.17, 0.012), "metal", 0.002, roughness=0.4),
    "pallet_wood": Surface((0.44, 0.29, 0.15), "wood", 0.02, "grain", (0.34, 0.21, 0.10), 0.9),
    "carton": Surface((0.42, 0.27, 0.14), "wood", 0.005, "weave", (0.38, 0.24, 0.12), 0.9),
    "carton_pale": Surface((0.58, 0.46, 0.31), "wood", 0.005, "weave", (0.53, 0.42, 0.28), 0.9),
    "crate_blue": Surface((0.03, 0.14, 0.36), "chipboard", 0.004, roughness=0.5),
    "crate_green": Surface((0.05, 0.25, 0.12), "chipboard", 0.004, roughness=0.5),
    "drum_blue": Surface((0.02, 0.10, 0.30), "metal", 0.001, roughness=0.35),
}
