"""Faces and markers beside each other, which stay so from wherever one looks.

Each part stands at its place on a line across the view. As the camera goes round, the line goes
with it, so that all parts are seen from the same side: their cameras are linked.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, TypeVar

import numpy as np

from facert.data.arrays import BoolArray, FloatArray, IntArray, require_bounded
from facert.data.rig import Mesh
from facert.data.take import Source
from facert.mesh.caps import caps_of
from facert.mesh.normals import vertex_normals
from facert.pages.paint import LEVELS, MOST, Paint, skin
from facert.render.faces import Face
from facert.render.shade import DARK, frame_points

if TYPE_CHECKING:
    from viser import CameraHandle, ClientHandle, MeshHandle, ViserServer

ABOVE, BELOW = np.array([240.0, 242, 244]), np.array([196.0, 201, 207])  # the backdrop
MARKER = (31, 111, 139)
FIELD = 0.36  # radians from top to bottom: little perspective
HEIGHT = 1.3  # of a row
CENTRE = np.array([0.0, -0.03, 0.0])  # of the first row
FRONT, UP = np.array([0.0, 0.0, 1.0]), np.array([0.0, 1.0, 0.0])
GAP = 0.08  # between two parts; each is 1 high or wide
ASPECT = 1.2  # of the picture, width over height, until a browser reports it
APRON = 0.004  # how deep, see `ColourLayer`
BACK = 2.5  # of its own colour, the light that the inside needs to look as it does when rendered
_POINT = 0.022
_TURNED = 1e-3  # of the line across the view: less is not worth a message


class Part:
    """An object on the stage, scaled to about 1.

    Parameters
    ----------
    server : ViserServer
    label : str
    points : array, shape (n, 3)
        Where it is, in its own units.
    """

    def __init__(self, server: ViserServer, label: str, points: FloatArray) -> None:
        self._server = server
        self._fit(points)
        self.root = server.scene.add_frame(f"/{label}", show_axes=False)
        server.scene.add_label(
            f"/{label}/label", label, position=(0.0, -0.56, 0.0), anchor="top-center"
        )

    def _fit(self, points: FloatArray) -> None:
        """Scale it to points (n, 3)."""
        require_bounded(points, "/source/markers")
        camera = frame_points(points)
        self._centre, self._scale = np.array(camera.centre), 0.5 / max(camera.reach, 1e-9)
        self.width = float(np.ptp(points[:, 0])) * self._scale

    def _placed(self, points: FloatArray) -> FloatArray:
        return np.asarray((points - self._centre) * self._scale)


@dataclass(frozen=True, eq=False)
class ColourLayer:
    """The triangles of a mesh that have one colour, with an apron: the triangles around them.

    The browser computes a vertex's normal from the layer's triangles alone: without the apron
    there would be a seam. The apron is hidden a little below the neighbours' own triangles.
    """

    used: IntArray
    """Vertices of the whole mesh, (n,)."""
    own: BoolArray
    """Which of them the coloured triangles have; the others are the apron's. Shape (n,)."""
    faces: IntArray
    """Among `used`, (f, 3)."""


def colour_layer(faces: IntArray, chosen: BoolArray) -> ColourLayer:
    """The layer of chosen triangles, (F,), of a mesh (F, 3)."""
    inside = np.zeros(int(faces.max(initial=-1)) + 1, dtype=np.bool_)
    inside[faces[chosen]] = True
    triangles = faces[inside[faces].any(axis=1)]
    used, compact = np.unique(triangles, return_inverse=True)
    return ColourLayer(used, inside[used], compact.reshape(-1, 3))


class FacePart(Part):
    """A mesh that moves and is painted: a mesh for each colour, as a browser's has one.

    Its inside, and what is seen through its holes, is dark, as `facert.render.shade` has it.

    Parameters
    ----------
    server : ViserServer
    label : str
    mesh : Mesh
        At rest.
    own : Paint
        Its own colours, see `facert.pages.paint.skin`; the same for all parts of one rig.
    subject : int, optional
        So many vertices, the first, are what it is scaled and placed by; all by default.
    """

    def __init__(
        self,
        server: ViserServer,
        label: str,
        mesh: Mesh,
        own: Paint,
        subject: int | None = None,
    ) -> None:
        super().__init__(server, label, mesh.vertices[:subject])
        self.width = float(np.ptp(mesh.vertices[:, 0])) * self._scale
        self._faces, self._own = mesh.faces, own
        self._caps = caps_of(mesh.vertices, mesh.faces)
        self._applied: Paint | None = None
        self._layers: list[ColourLayer] = []
        shown = range(max(MOST, LEVELS))
        self._meshes = [self._add_mesh(f"/{label}/colour{index}", "front") for index in shown]
        self._inside = self._add_mesh(f"/{label}/inside", "back")
        caps = self._caps.faces(len(mesh.vertices))
        self._inside.faces = np.concatenate([mesh.faces, caps, caps[:, ::-1]]).astype(np.uint32)
        self._inside.color = _bytes(BACK * DARK)
        self.draw(mesh.vertices)

    def draw(self, vertices: FloatArray, paint: Paint | None = None) -> None:
        """The mesh with these vertices (V, 3), in its own colours or others; NaN: no pose."""
        if not np.isfinite(vertices).all():
            for mesh in (*self._meshes, self._inside):
                mesh.visible = False
            self._applied = None
            return
        placed = self._placed(vertices)
        sunk = placed - APRON * vertex_normals(placed, self._faces)
        with self._server.atomic():
            self._apply_paint(paint or self._own)
            for mesh, layer in zip(self._meshes, self._layers, strict=False):
                if len(layer.faces):
                    chosen = np.where(layer.own[:, None], placed[layer.used], sunk[layer.used])
                    mesh.vertices = chosen.astype(np.float32)
            closed = np.concatenate([placed, self._caps.middles(placed)])
            self._inside.vertices, self._inside.visible = closed.astype(np.float32), True

    def _add_mesh(self, name: str, side: Literal["front", "back"]) -> MeshHandle:
        corner, triangle = np.zeros((3, 3)), np.array([[0, 1, 2]])
        add = self._server.scene.add_mesh_simple
        return add(name, corner, triangle, side=side, visible=False)

    def _apply_paint(self, paint: Paint) -> None:
        """Show the mesh in these colours: one layer of triangles for each."""
        if self._applied is paint:
            return
        self._applied = paint
        self._layers = [
            colour_layer(self._faces, paint.paint == k) for k in range(len(paint.palette))
        ]
        for index, mesh in enumerate(self._meshes):
            used = index < len(self._layers) and len(self._layers[index].faces) > 0
            mesh.visible = used
            if used:
                mesh.faces = self._layers[index].faces.astype(np.uint32)
                mesh.color = _bytes(paint.palette[index])


class MarkerPart(Part):
    """Markers in space."""

    def __init__(self, server: ViserServer, label: str, markers: FloatArray) -> None:
        seen = markers[~np.isnan(markers).any(axis=2)]
        super().__init__(server, label, seen)
        self._points = server.scene.add_point_cloud(
            f"/{label}/points",
            np.zeros((1, 3)),
            MARKER,
            point_size=_POINT,
            point_shape="circle",
            precision="float32",
        )
        self.draw(markers[0])

    def turn_to(self, markers: FloatArray) -> None:
        """Show those of another take, (T, M, 3)."""
        self._fit(markers[~np.isnan(markers).any(axis=2)])

    def draw(self, markers: FloatArray) -> None:
        """Markers (M, 3); those that are NaN are left out."""
        there = self._placed(markers[~np.isnan(markers).any(axis=1)])
        self._points.visible = len(there) > 0
        if len(there):
            self._points.points = there.astype(np.float32)


AnyPart = TypeVar("AnyPart", bound=Part)


class Stage:
    """The places of the parts, and the cameras that look at them.

    Parameters
    ----------
    server : ViserServer
    covered : float
        Share of the picture's height, from below, that something else covers.
    """

    def __init__(self, server: ViserServer, covered: float = 0.0) -> None:
        self._server, self._free = server, 1.0 - covered
        self._rows: list[list[Part]] = []
        self._width, self._height, self._centre = 1.0, HEIGHT, CENTRE
        self._right = np.array([1.0, 0.0, 0.0])
        self._aspects: dict[int, float] = {}
        server.scene.set_up_direction("+y")
        server.scene.set_background_image(_backdrop(), format="png")
        _light(server)
        server.on_client_connect(self._link)

    def add(self, part: AnyPart, row: int = 0) -> AnyPart:
        """Put a part to the right of the others in its row, the first row highest; return it."""
        while len(self._rows) <= row:
            self._rows.append([])
        self._rows[row].append(part)
        self.arrange()
        return part

    def arrange(self) -> None:
        """Line up the parts that are shown, and let every camera see them all."""
        self._line_up()
        camera = self._server.initial_camera
        camera.fov, camera.look_at = FIELD, tuple(self._centre)
        camera.position = tuple(self._centre + self._distance(ASPECT) * FRONT)
        for client in self._server.get_clients().values():
            self._fit(client.camera, client.camera.position - client.camera.look_at)

    def _line_up(self) -> None:
        """Place each row about the middle, the next one below it."""
        rows = [[part for part in row if part.root.visible] for row in self._rows]
        widths = [0.0]
        with self._server.atomic():
            for number, row in enumerate(rows):
                ends = np.cumsum([0.0] + [part.width + GAP for part in row])
                widths.append(float(ends[-1]) + GAP)
                middles = (ends[:-1] + ends[1:] - ends[-1]) / 2.0
                for part, middle in zip(row, middles, strict=True):
                    part.root.position = tuple(middle * self._right - number * HEIGHT * UP)
        filled = sum(bool(row) for row in rows)
        rows_height = max(filled, 1) * HEIGHT
        self._width, self._height = max(widths), rows_height / self._free
        self._centre = CENTRE - (self._height - HEIGHT) / 2.0 * UP

    def _distance(self, aspect: float) -> float:
        """Distance from which a camera sees all rows."""
        return max(self._height, self._width / aspect) / 2.0 / float(np.tan(FIELD / 2.0))

    def _fit(self, camera: CameraHandle, side: FloatArray) -> None:
        """Let a camera see all rows from one side."""
        direction = side / max(float(np.linalg.norm(side)), 1e-9)
        camera.position = self._centre + self._distance(camera.aspect) * direction
        camera.look_at = self._centre

    def _link(self, client: ClientHandle) -> None:
        client.camera.on_update(self._follow)

    def _follow(self, camera: CameraHandle) -> None:
        """Turn the line with the camera, about the vertical."""
        w, x, y, z = camera.wxyz
        right = np.array([1 - 2 * (y * y + z * z), 0.0, 2 * (x * z - w * y)])
        length = float(np.linalg.norm(right))
        visitor, aspect = camera.client.client_id, self._aspects.get(camera.client.client_id)
        if aspect is None or abs(aspect - camera.aspect) > 0.01:  # new, or a window of another size
            self._aspects[visitor] = camera.aspect
            self._fit(camera, FRONT if aspect is None else camera.position - camera.look_at)
            return
        if length > 0.1 and np.abs(right / length - self._right).max() > _TURNED:
            self._right = right / length
            self._line_up()


class ActorParts:
    """The recording on the stage: its markers, and the actor's face where one is given."""

    def __init__(
        self, server: ViserServer, stage: Stage, source: Source | None, face: Face | None
    ) -> None:
        self._source, self._face = source, face
        self._markers: MarkerPart | None = None
        if source is not None and source.kind == "markers":
            self._markers = stage.add(MarkerPart(server, "markers", source.values))
        self._mesh: FacePart | None = None
        if face is not None:
            self._mesh = stage.add(face_part(server, face))

    def turn_to(self, source: Source, face: Face | None) -> None:
        """Show another recording of the same actor."""
        self._source, self._face = source, face
        if self._markers is not None:
            self._markers.turn_to(source.values)

    def draw(self, frame: int) -> None:
        """Show a frame."""
        if self._source is not None and self._markers is not None:
            self._markers.draw(self._source.values[frame])
        if self._face is not None and self._mesh is not None:
            self._mesh.draw(self._face.motion.fetch(np.array([frame]))[0])


def face_part(server: ViserServer, face: Face, own: Paint | None = None) -> FacePart:
    """The part of a face, in its own colours (see `skin`) unless others are given."""
    neutral = face.motion.neutral
    return FacePart(server, face.label, neutral, own or skin(neutral), face.subject)


def _bytes(colour: FloatArray) -> tuple[int, int, int]:
    red, green, blue = np.rint(255 * colour).astype(int).tolist()
    return red, green, blue


def _light(server: ViserServer) -> None:
    """A warm key from the upper left, cool sky, and a rim: as in `facert.render.shade`."""
    scene = server.scene
    scene.configure_environment_map(None)
    scene.configure_default_lights(False)
    scene.add_light_hemisphere(
        "/lights/sky", sky_color=(214, 226, 246), ground_color=(120, 104, 96), intensity=1.1
    )
    scene.add_light_directional(
        "/lights/key", color=(255, 244, 230), intensity=2.0, position=(-4.2, 5.2, 7.4)
    )
    scene.add_light_directional(
        "/lights/rim", color=(200, 218, 255), intensity=0.9, position=(6.0, 2.0, -4.0)
    )


def _backdrop() -> np.ndarray[tuple[int, int, int], np.dtype[np.uint8]]:
    """A grey that darkens downwards, (256, 2, 3)."""
    share = np.linspace(0.0, 1.0, 256)[:, None, None]
    return np.broadcast_to(np.rint((1 - share) * ABOVE + share * BELOW), (256, 2, 3)).astype(
        np.uint8
    )
