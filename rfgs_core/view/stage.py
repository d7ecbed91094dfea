# SPDX-License-Identifier: Apache-2.0
"""The three-dimensional part of the page: everything is drawn in world metres, Z up."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from jaxtyping import Bool, Float, Float32, UInt8

from rfgs_core.render.cameras import Camera
from rfgs_core.view.coverage import DRAWN_M, Coverage
from rfgs_core.view.frame import Mesh, ShownFrame
from rfgs_core.view.layer_colors import coverage_picture
from rfgs_core.view.radios import RadioShapes
from rfgs_core.view.rays import Rays
from rfgs_core.view.room import Room
from rfgs_core.view.selection import SCENE_TICKS, Selection

if TYPE_CHECKING:
    from viser import ClientHandle, ViserServer

_BACKGROUND = (24, 26, 31)
_TRUTH, _OUTLINE = (235, 200, 170), (170, 138, 110)
_BONE = (255, 20, 130)
_ROOM, _EDGE = (46, 48, 54), (70, 74, 84)
_TX, _RX = (255, 90, 80), (90, 160, 255)
_LINK, _HELD_OUT = (20, 150, 60), (255, 110, 0)
_POINT_M, _GAUSSIAN_M = 0.02, 0.014
_BORESIGHT_M = 0.4
_LINE_PX = 2.0
_THIN_PX = 1.0
_BONE_PX = 4.0
#: The page looks along this from what it shows.
_AHEAD = np.array([0.5, 0.6, -0.4]) / np.linalg.norm([0.5, 0.6, -0.4])
#: Space around people that is in view [m].
_AROUND_M = 2.2
#: Narrower pages have the controls below: what is shown stands higher there, and farther away.
_NARROW_PX, _LOWER_M, _FARTHER = 576, 1.1, 1.4


class Stage:
    """Draws into the scene of a server."""

    def __init__(self, server: ViserServer, seen_m: Float[np.ndarray, "2 3"]) -> None:
        """Prepares an empty scene.

        Args:
            server: Where to draw.
            seen_m: Lowest and highest corner of what a page looks at first [m].
        """
        self._scene = server.scene
        self._groups: dict[str, list[Any]] = {}
        self._scene.set_up_direction("+z")
        self._scene.set_background_image(np.full((2, 2, 3), _BACKGROUND, np.uint8))
        low, high = seen_m
        self._centre = (low + high) / 2.0
        self._reach = _AROUND_M + float(np.linalg.norm((high - low)[:2]))
        server.initial_camera.look_at = tuple(self._centre)
        server.initial_camera.position = tuple(self._centre - self._reach * _AHEAD)
        server.on_client_connect(self._welcome)

    def _welcome(self, client: ClientHandle) -> None:
        """Shows people above the controls where these cover the lower half of the page."""
        if client.camera.image_width >= _NARROW_PX:
            return
        aim = self._centre - [0.0, 0.0, _LOWER_M]
        with client.atomic():
            # In this order: a camera that is moved takes the point that it looks at along.
            client.camera.position = tuple(aim - _FARTHER * self._reach * _AHEAD)
            client.camera.look_at = tuple(aim)

    def draw_gaussians(
        self,
        frame: ShownFrame,
        rows: Bool[np.ndarray, "M"],
        rgb: Float[np.ndarray, "M 3"],
        selection: Selection,
    ) -> None:
        """Replaces the Gaussians by those of the marked rows."""
        if selection.drawn_as == "points" or not rows.any():
            handle = self._scene.add_point_cloud(
                "/points", frame.means[rows], rgb[rows],
                point_size=_GAUSSIAN_M, point_shape="circle", precision="float32",
            )  # fmt: skip
        else:
            opacities = np.minimum(frame.opacities[rows] * selection.brightness, 1.0)
            handle = self._scene.add_gaussian_splats(
                "/splats", frame.means[rows], frame.covariances[rows], rgb[rows],
                opacities[:, None],
            )  # fmt: skip
        self._replace("gaussians", handle)

    def draw_truth(self, truth: Mesh | None) -> None:
        """Replaces the true surface of what moves."""
        if truth is None:
            return
        lines = self._scene.add_line_segments(
            "/truth/outline", level_lines(truth), _OUTLINE, thickness=_THIN_PX,
            thickness_units="screen",
        )  # fmt: skip
        body = self._scene.add_mesh_simple(
            "/truth/surface", truth.vertices, truth.faces, color=_TRUTH, opacity=0.4, side="double"
        )
        top = truth.vertices[truth.vertices[:, 2].argmax()]
        name = self._scene.add_label(
            "/truth/name", "outline: ground truth", position=top, anchor="bottom-center",
            font_screen_scale=0.8,
        )  # fmt: skip
        self._groups |= {"outline": [lines], "surface": [body], "truth": [name]}

    def draw_skeletons(self, bones: Float[np.ndarray, "bone 2 3"] | None) -> None:
        """Replaces the fitted skeletons; None where a frame has none."""
        for old in self._groups.pop("skeleton", []):
            old.remove()
        if bones is None or not len(bones):
            return
        handle = self._scene.add_line_segments(
            "/skeleton", bones, _BONE, thickness=_BONE_PX, thickness_units="screen"
        )
        self._groups["skeleton"] = [handle]

    def draw_room(self, room: Room) -> None:
        """Draws what stands still."""
        self._groups["room"] = []
        if len(room.low.faces):
            low = self._scene.add_mesh_simple(
                "/room/low", room.low.vertices, room.low.faces, color=_ROOM, side="double",
                flat_shading=True, cast_shadow=False, receive_shadow=False,
            )  # fmt: skip
            self._groups["room"].append(low)
        if len(room.edges):
            edges = self._scene.add_line_segments(
                "/room/edges", room.edges, _EDGE, thickness=1.0, thickness_units="screen"
            )
            self._groups["room"].append(edges)

    def draw_radios(self, radio: RadioShapes) -> None:
        """Draws elements, boresights, names and links."""
        ends = radio.places + _BORESIGHT_M * radio.boresights
        arrows = np.stack([radio.places, ends], axis=1)
        self._groups["radios"] = [
            self._scene.add_arrows(
                "/radios/boresights", arrows, (235, 235, 235),
                shaft_radius=0.01, head_radius=0.03, head_length=0.08,
            ),
            *self._elements("tx", radio.tx_xyz, _TX),
            *self._elements("rx", radio.rx_xyz, _RX),
            *(
                self._scene.add_label(
                    f"/radios/names/{index}", name, position=place, anchor="bottom-center",
                    font_screen_scale=0.8,
                )
                for index, (name, place) in enumerate(zip(radio.names, radio.places, strict=True))
            ),
        ]  # fmt: skip
        self._groups["links"] = []
        if len(radio.links):
            colors = np.where(radio.held_out[:, None, None], _HELD_OUT, _LINK)
            lines = self._scene.add_line_segments(
                "/links", radio.links, np.repeat(colors, 2, axis=1).astype(np.uint8),
                thickness=_LINE_PX, thickness_units="screen",
            )  # fmt: skip
            self._groups["links"] = [lines]

    def draw_rays(self, rays: Rays) -> None:
        """Replaces the ways of the waves."""
        for old in self._groups.pop("rays", []):
            old.remove()
        if len(rays.segments):
            handle = self._scene.add_line_segments(
                "/rays", rays.segments, np.repeat(_linear(rays.colors)[:, None], 2, axis=1),
                thickness=_THIN_PX, thickness_units="screen",
            )  # fmt: skip
            self._groups["rays"] = [handle]

    def draw_coverage(self, coverage: Coverage) -> None:
        """Draws how strongly each place would be heard, on the floor."""
        (west, east), (south, north) = coverage.edges_m
        middle = (west + east) / 2.0, (south + north) / 2.0, coverage.floor_m + DRAWN_M
        # Exact colours: pictures are drawn without light, and rows of pixels run along y.
        handle = self._scene.add_image(
            "/coverage", coverage_picture(coverage), east - west, north - south,
            position=middle, cast_shadow=False, receive_shadow=False,
        )  # fmt: skip
        self._groups["coverage"] = [handle]

    def draw_cameras(self, cameras: list[Camera]) -> None:
        """Draws a frustum per camera; a click looks through it."""
        self._groups["cameras"] = []
        for camera in cameras:
            frustum = self._scene.add_camera_frustum(
                f"/cameras/{camera.name}", _fov_rad(camera), camera.width / camera.height,
                scale=0.15, color=(200, 200, 90), wxyz=_wxyz(camera), position=camera.position_m,
            )  # fmt: skip
            frustum.on_click(lambda event, eye=camera: self.look_through(event.client, eye))
            self._groups["cameras"].append(frustum)

    def look_through(self, client: ClientHandle, camera: Camera) -> None:
        """Moves the view of one client into a camera."""
        with client.atomic():
            client.camera.wxyz = _wxyz(camera)
            client.camera.position = camera.position_m
            client.camera.fov = _fov_rad(camera)

    def set_visible(self, selection: Selection) -> None:
        """Shows and hides groups as chosen."""
        shown = {name: getattr(selection, name) for name in SCENE_TICKS}
        shown |= {name: selection.truth == name for name in ("outline", "surface")}
        shown["truth"] = selection.truth != "hidden"
        for name, visible in shown.items():
            for handle in self._groups.get(name, []):
                handle.visible = visible

    def _replace(self, group: str, handle: Any) -> None:
        for old in self._groups.get(group, []):
            if old.name != handle.name:
                old.remove()
        self._groups[group] = [handle]

    def _elements(self, name: str, places: np.ndarray, color: tuple[int, int, int]) -> list[Any]:
        return [
            self._scene.add_point_cloud(
                f"/radios/{name}", places, color,
                point_size=_POINT_M, point_shape="square", precision="float32",
            )
        ]  # fmt: skip


def _fov_rad(camera: Camera) -> float:
    """Vertical field of view."""
    return float(2.0 * np.arctan2(camera.height / 2.0, camera.fl_y))


def _linear(rgb: UInt8[np.ndarray, "n 3"]) -> UInt8[np.ndarray, "n 3"]:
    """Colours of lines that look like these: the page takes them for light, not for sRGB."""
    return (255.0 * (rgb / 255.0) ** 2.2 + 0.5).astype(np.uint8)


def _wxyz(camera: Camera) -> Float[np.ndarray, "4"]:
    """Rotation world from view axes (+x right, +y down, +z forward), w first."""
    from viser.transforms import SO3

    return SO3.from_matrix(camera.view_from_world[:3, :3].T).wxyz


#: Height between two planes [m].
SPACING_M = 0.06


def level_lines(mesh: Mesh, spacing_m: float = SPACING_M) -> Float32[np.ndarray, "line 2 3"]:
    """Cuts a mesh with level planes.

    Args:
        mesh: The surface; planes stand at whole multiples of the spacing, whatever it does.
        spacing_m: Height between two planes [m].

    Returns:
        One line per triangle and plane that meet [m].
    """
    corners = mesh.vertices[mesh.faces].astype(np.float64)
    if not len(corners):
        return np.zeros((0, 2, 3), np.float32)
    # Halfway between multiples, as feet stand on the floor and boxes end at round numbers.
    height = corners[..., 2] / spacing_m - 0.5
    first = np.ceil(height.min(axis=1)).astype(int)
    count = np.maximum(np.floor(height.max(axis=1)).astype(int) - first + 1, 0)
    face = np.repeat(np.arange(len(corners)), count)
    plane = first[face] + np.arange(len(face)) - np.repeat(np.cumsum(count) - count, count)
    above = height[face] - plane[:, None]
    cut = corners[face]
    ends = np.zeros((len(face), 3, 3))
    crossed = np.zeros((len(face), 3), bool)
    for edge in range(3):
        low, high = above[:, edge], above[:, (edge + 1) % 3]
        crossed[:, edge] = (low < 0) != (high < 0)
        share = np.divide(low, low - high, out=np.zeros_like(low), where=low != high)
        ends[:, edge] = cut[:, edge] + share[:, None] * (cut[:, (edge + 1) % 3] - cut[:, edge])
    crosses = crossed.sum(axis=1) == 2
    return ends[crosses][crossed[crosses]].reshape(-1, 2, 3).astype(np.float32)
