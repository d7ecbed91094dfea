# SPDX-License-Identifier: GPL-3.0-or-later
"""What a file holds as plain data, to see what an operator changes and what undo brings back.

Read inside Blender by the scripts that are played there.
"""

from __future__ import annotations

import hashlib
from typing import Any

import bpy
import numpy as np

#: Kinds of data that operators of the add-on may change.
_KINDS = (
    *("scenes", "collections", "objects", "meshes", "curves", "armatures", "cameras", "lights"),
    *("materials", "node_groups", "actions", "images", "worlds", "texts"),
)
#: Properties that say how things are evaluated, not what the file holds.
_PASSING = {
    *("rna_type", "original", "preview", "depsgraph", "is_evaluated", "session_uid", "users"),
    *("is_embedded_data", "is_runtime_data", "execution_time", "asset_data", "id_data"),
    *("is_missing", "tag", "bl_system_properties", "bindings"),
    # Many, and nothing to an add-on whose buttons neither render nor pose.
    *("pose", "bones", "edit_bones", "parent_bone"),
    *("tool_settings", "view_layers", "eevee", "cycles", "cycles_curves", "render", "display"),
}
_DEEPEST = 4
_SIMPLE = {"BOOLEAN", "INT", "FLOAT", "STRING", "ENUM"}


def file_state() -> dict[str, Any]:
    """Name of each data block → what it holds."""
    found = {
        f"{kind} {item.name_full}": _block(item)
        for kind in _KINDS
        for item in getattr(bpy.data, kind)
    }
    layer = bpy.context.window_manager.windows[0].view_layer
    active = layer.objects.active
    found["selection"] = {
        "active": active.name if active else "",
        "selected": sorted(item.name for item in layer.objects if item.select_get()),
        "hidden": sorted(item.name for item in layer.objects if item.hide_get()),
    }
    return found


def changes(before: dict[str, Any], after: dict[str, Any]) -> list[str]:
    """Where two states differ, one line each."""
    lines = [f"- {name}" for name in sorted(before.keys() - after.keys())]
    lines += [f"+ {name}" for name in sorted(after.keys() - before.keys())]
    for name in sorted(before.keys() & after.keys()):
        first, second = _flat(before[name]), _flat(after[name])
        for key in sorted(first.keys() | second.keys()):
            if first.get(key) != second.get(key):
                lines.append(f"{name}{key}: {first.get(key)} → {second.get(key)}")
    return lines


def _flat(value: Any, key: str = "") -> dict[str, Any]:
    if isinstance(value, dict):
        rows = [_flat(part, f"{key}.{name}") for name, part in value.items()]
    elif isinstance(value, list):
        rows = [_flat(part, f"{key}[{index}]") for index, part in enumerate(value)]
    else:
        return {key: value}
    return {name: part for row in rows for name, part in row.items()} or {key: value}


def _block(item: bpy.types.ID) -> Any:
    if isinstance(item, bpy.types.Mesh):
        return {
            "points": _digest(item.vertices, "co", 3),
            "corners": _digest(item.loops, "vertex_index", 1, np.int32),
            "attributes": {row.name: _attribute(row) for row in item.attributes},
            "materials": [row.name if row else "" for row in item.materials],
            "custom": _custom(item),
        }
    if isinstance(item, bpy.types.Curve):
        points = [tuple(p.co) for spline in item.splines for p in spline.points]
        return {"points": points, "levels": [spline.material_index for spline in item.splines]}
    if isinstance(item, bpy.types.NodeTree):  # sockets lead to nodes, and these to sockets
        return {"nodes": [node.name for node in item.nodes], "links": len(item.links)}
    return _struct(item, 0)


def _attribute(row: Any) -> str:
    for field in ("vector", "color", "value"):
        if row.data and hasattr(row.data[0], field) and row.data_type != "STRING":
            width = np.size(getattr(row.data[0], field))
            kind = np.float32 if "FLOAT" in row.data_type else np.int32
            return _digest(row.data, field, width, np.float32 if width > 2 else kind)
    return row.data_type


def _digest(rows: Any, field: str, width: int, kind: type = np.float32) -> str:
    values = np.zeros(len(rows) * width, kind)
    if len(rows) and isinstance(getattr(rows[0], field), bool):
        values = np.zeros(len(rows), bool)
    rows.foreach_get(field, values)
    return f"{len(rows)} {hashlib.sha256(values.tobytes()).hexdigest()[:16]}"


def _struct(item: Any, depth: int) -> Any:
    # Before 5.2 the inputs of geometry nodes are free properties of their modifier.
    inputs = isinstance(item, bpy.types.NodesModifier) and not hasattr(item, "properties")
    free = inputs or isinstance(item, bpy.types.ID)
    row: dict[str, Any] = {"custom": _custom(item)} if free else {}
    if depth > _DEEPEST:
        return row
    for spec in item.bl_rna.properties:
        name = spec.identifier
        if name in _PASSING:
            continue
        try:
            value = getattr(item, name)
        except (AttributeError, RuntimeError, TypeError, UnicodeDecodeError):
            continue
        if spec.type in _SIMPLE:
            row[name] = _plain(value)
        elif spec.type == "POINTER" and value is not None:
            linked = isinstance(value, bpy.types.ID)
            row[name] = value.name_full if linked else _struct(value, depth + 1)
        elif spec.type == "COLLECTION":
            row[name] = [
                part.name_full if isinstance(part, bpy.types.ID) else _struct(part, depth + 1)
                for part in value
            ]
    return row


def _custom(item: Any) -> dict[str, Any]:
    """Free properties; those of add-ons are read as properties, which makes empty ones here."""
    free = [key for key in item.keys() if key != "rfgs" and not key.startswith("cycles")]
    return {key: _plain(item[key]) for key in free}


def _plain(value: Any) -> Any:
    if isinstance(value, bool | int | str):
        return value
    if isinstance(value, float):
        return repr(value)
    if isinstance(value, bpy.types.ID):
        return value.name_full
    if hasattr(value, "keys"):
        return {key: _plain(value[key]) for key in value.keys()}
    if isinstance(value, set):
        return sorted(value)
    if hasattr(value, "__len__"):  # vectors and matrices among them
        return [_plain(part) for part in value]
    return str(type(value).__name__)
