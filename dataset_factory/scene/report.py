# SPDX-License-Identifier: Apache-2.0
"""The scene check as a person reads it, and with what a radio needs added."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from dataset_factory.scene.blender import Blender
from dataset_factory.scene.bundle import read_bundle
from dataset_factory.scene.devices import choose_devices, scene_problems
from dataset_factory.scene.outline import left_out, usual_radios
from dataset_factory.scene.overrides import overrides_file
from dataset_factory.scene.radios import SCENE_RADIO, chosen_radios, scene_radio
from dataset_factory.scene.report_rows import read_report
from rfgs_core.errors import RfgsError
from rfgs_core.radio import Radio

#: Findings about the radios of the scene's devices, not about those that were asked for.
_OF_DEVICES = {"material_band", "device_inside", "device_outside", "devices_differ"}
#: The same about the radios that the panel in Blender would trace.
_OF_PANEL = {"device_left_out", "devices_silent"}
#: Static objects shown; the rest is counted.
_MOST_STATIC = 40


def check_file(
    blender: Blender, frames: str, said: dict[str, Any], label: str, radios: list[Radio]
) -> dict[str, Any]:
    """Looks at a scene as `generate` would, without keeping anything.

    Args:
        blender: The Blender file.
        frames: `A:B[:STEP]`, empty for the scene's own range.
        said: Overrides, in the words of the YAML file.
        label: Where they come from, for messages.
        radios: Radios that shall be traced; none takes that of the scene's own devices, and
            where there is no such device leaves materials and devices unchecked.

    Returns:
        The add-on's report; with radios also the devices they would use.

    Raises:
        RfgsError: The file cannot be opened, or the overrides make no sense.
    """
    asked = ["--frames", frames] if frames else []
    with TemporaryDirectory(prefix="rfgs-") as name, overrides_file(said, label) as more:
        folder = Path(name)
        blender.run("check", "--out", str(folder / "check.json"), *asked, *more)
        report = read_report(folder / "check.json")
        radios = radios or list(chosen_radios(usual_radios(report["devices"])).values())
        report["findings"] = [row for row in report["findings"] if row["kind"] not in _OF_PANEL]
        if radios:
            report["findings"] += _left_out(report["devices"], radios)
        if radios and not has_errors(report):
            first = str(report["scene"]["frames"][0])
            one = ["--frames", f"{first}:{first}"]
            blender.run("export", "--out", str(folder / "bundle"), *one, *more)
            _add_radios(report, folder / "bundle", radios)
    return report


def has_errors(report: dict[str, Any]) -> bool:
    """Whether `generate` would refuse the scene."""
    return any(row["severity"] == "error" for row in report["findings"])


def table(report: dict[str, Any]) -> str:
    """The report as a page of text: objects, what else was found, guesses, findings."""
    return "\n".join([*_summary(report), "", *_objects(report), "", *_rest(report)])


def _left_out(devices: list[dict[str, Any]], radios: list[Radio]) -> list[dict[str, Any]]:
    """Findings about devices that the radios do without."""
    rows = []
    for sentence in left_out(devices, radios):
        message, _, remedy = sentence.partition("; ")
        row = {"severity": "warning", "object": "the scene", "message": message, "remedy": remedy}
        rows.append({**row, "kind": "device_left_out"})
    return rows


def _add_radios(report: dict[str, Any], folder: Path, radios: list[Radio]) -> None:
    bundle, devices, usable, problems = read_bundle(folder), {}, [], []
    for radio in radios:
        try:
            if radio.name == SCENE_RADIO:
                packets = radio.samples_per_frame
                radio = replace(scene_radio(bundle), samples_per_frame=packets)
            devices[radio.name], guess = choose_devices(bundle, radio)
        except RfgsError as error:
            problems.append(str(error).removeprefix(f"{bundle.info['blend_name']}: "))
            continue
        usable.append(radio)
        report["guesses"] += [guess] if guess else []
    report["radios"] = {
        name: [{"name": row.name, "position_m": list(row.position_m)} for row in rows]
        for name, rows in devices.items()
    }
    problems += scene_problems(bundle, devices, usable)
    report["findings"] = [
        {"severity": "error", "object": "the scene", "message": problem, "remedy": ""}
        for problem in problems
    ] + [row for row in report["findings"] if row["kind"] not in _OF_DEVICES]


def _summary(report: dict[str, Any]) -> Iterator[str]:
    scene = report["scene"]
    frames = scene["frames"]
    step = f":{frames[1] - frames[0]}" if len(frames) > 1 and frames[1] - frames[0] > 1 else ""
    yield (
        f"{report['file']}: {len(frames)} frames {frames[0]}:{frames[-1]}{step} of "
        f"{scene['frame_start']}:{scene['frame_end']} at {scene['fps']:.4g} fps, "
        f"1 unit = {scene['unit_scale_m']:.4g} m"
    )
    if scene["bounds_m"]:
        low, high = scene["bounds_m"]
        size = [b - a for a, b in zip(low, high, strict=True)]
        yield f"bounds {_lengths(size)} m from {_point(low)} to {_point(high)}"


def _objects(report: dict[str, Any]) -> list[str]:
    head = ["object", "class", "moves", "instance", "triangles", "size [m]", "material", "because"]
    moving = [row for row in report["objects"] if row["moving"]]
    static = [row for row in report["objects"] if not row["moving"]]
    rows = [head]
    for item in [*moving, *static[:_MOST_STATIC]]:
        for index, material in enumerate(item["materials"]):
            start = [
                item["name"],
                item["class"],
                "yes" if item["moving"] else "no",
                item["instance"],
                str(item["triangles"]),
                _lengths(item["size_m"]),
            ]
            name = f" ({material['name']})" if material["name"] else ""
            end = [material["radio_material"] + name, material["why"]]
            rows.append([*(start if index == 0 else [""] * len(start)), *end])
    lines = _aligned(rows)
    if len(static) > _MOST_STATIC:
        lines.append(f"… and {len(static) - _MOST_STATIC} more static objects (--json lists all)")
    return lines


def _rest(report: dict[str, Any]) -> Iterator[str]:
    cameras = [row["name"] for row in report["cameras"]]
    origin = "made up" if any(row["made_up"] for row in report["cameras"]) else "the scene's own"
    rows = [["cameras", f"{len(cameras)}, {origin}" if cameras else "none"]]
    rows.append(["lights", report["lights"]])
    for item in report["instances"]:
        if item["person"]:
            rows.append([f"person {item['name']}", f"17 joints {item['joints']}"])
    rows.append(["devices", _named(report["devices"]) or "none in the scene"])
    for name, devices in report.get("radios", {}).items():
        rows.append([f"radio {name}", _named(devices)])
    # Guessed materials stand in the table of objects.
    for row in report["guesses"]:
        if row["what"] != "radio_material":
            label = "" if row["object"] == "the scene" else f" {row['object']}"
            rows.append([f"guessed {row['what']}{label}", f"{row['value']}: {row['why']}"])
    yield from _aligned([*rows, *_findings(report["findings"])])


def _findings(found: list[dict[str, Any]]) -> Iterator[list[str]]:
    """One line per finding; objects of which the same is to be said share one."""
    groups: dict[tuple[str, ...], list[str]] = {}
    for row in found:
        key = (row["severity"], row["message"], row["remedy"])
        groups.setdefault(key, []).append(row["object"])
    for (severity, message, remedy), names in groups.items():
        label = "" if names == ["the scene"] else ", ".join(names[:3]) + " "
        if len(names) > 3:
            label = f"{', '.join(names[:3])} and {len(names) - 3} more: each "
        yield [severity, f"{label}{message}" + (f"; {remedy}" if remedy else "")]


def _aligned(rows: list[list[str]]) -> list[str]:
    widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))]
    return [
        "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip()
        for row in rows
    ]


def _named(devices: list[dict[str, Any]]) -> str:
    return ", ".join(f"{row['name']} at {_point(row['position_m'])}" for row in devices)


def _lengths(values: list[float]) -> str:
    return " x ".join(f"{value:.2f}" for value in values)


def _point(values: list[float]) -> str:
    return "(" + ", ".join(f"{value:.2f}" for value in values) + ")"
