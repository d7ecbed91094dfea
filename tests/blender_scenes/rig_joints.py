# SPDX-License-Identifier: GPL-3.0-or-later
"""Run as a program: what the scenes say of some bodies, at rest and with bent limbs.

python rig_joints.py OUT.npz: heads of our bones [N, B, 3] and joints of labels [N, 17, 3], in the
axes of `rfgs_core.articulated`.
"""

import os
import sys

import bpy
import numpy as np

import addon_rfgs
from addon_rfgs.scene.rig import read_rig
from blender_scenes.people.body import load_body
from blender_scenes.people.character import build_character
from blender_scenes.people.shape_space import adult, child, joints_at_rest, turned

addon_rfgs.register()
rng = np.random.default_rng(99)
heads, joints = [], []
for number, phenotype in enumerate([adult(rng), adult(rng), child(rng)]):
    body = load_body(phenotype)
    armature = build_character(f"body{number}", body, bpy.context.scene.collection)
    rig = read_rig(armature)
    assert rig is not None
    bpy.context.view_layer.update()
    heads.append(joints_at_rest(body))
    joints.append(turned(rig.joints(armature)))
np.savez(sys.argv[1], heads=np.stack(heads), joints=np.stack(joints))
sys.stdout.flush()
os._exit(0)
