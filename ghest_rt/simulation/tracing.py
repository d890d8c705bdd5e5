"""Ray casting into the scene: what each ray meets, how far away, how it is lit."""

from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from ghest_rt.geometry.so3 import Array
from ghest_rt.simulation.scene import PLATE_GROUPS

_FAR_M = 20.0
_TO_LIGHT = np.array([0.80, 0.0, 0.60])  # from above and behind, the same for either arm
_AMBIENT = 0.82


def shade(normals: Array) -> Array:
    """Return the brightness 0.82-1 of surfaces with (n, 3) normals in E: soft light, rather from above and behind."""
    return np.asarray(_AMBIENT + (1.0 - _AMBIENT) * (0.5 + 0.5 * (normals @ _TO_LIGHT)))


@dataclass(frozen=True, slots=True, eq=False)
class Hits:
    """What n rays met.

    Attributes:
        geom: (n,) geom number, -1 for none.
        z_m: (n,) depth: distance along the camera's z axis, infinite for none.
        normals: (n, 3) unit surface normals in E; zero for none.
    """

    geom: NDArray[np.int32]
    z_m: Array
    normals: Array


class Tracer:
    """Casts rays for one camera, which shades the plate of its own marker itself and so leaves it out here."""

    def __init__(self, model: mujoco.MjModel, own_marker: str) -> None:
        self._model = model
        self._groups = np.ones(6, dtype=np.uint8)
        self._groups[PLATE_GROUPS[own_marker]] = 0
        rgb = np.zeros((model.ngeom + 1, 3))
        rgb[:-1] = 255.0 * model.geom_rgba[:, :3]
        self._rgb = rgb

    def cast(self, data: mujoco.MjData, e_from_camera: Array, rays: Array) -> Hits:
        """Cast (n, 3) rays (x, y, 1) in camera axes from the camera's centre."""
        n = len(rays)
        directions = rays @ e_from_camera[:3, :3].T
        lengths = np.sqrt(np.einsum("ij,ij->i", directions, directions))
        directions /= lengths[:, None]
        geom = np.empty(n, dtype=np.int32)
        distance = np.empty(n)
        normals = np.empty(3 * n)
        mujoco.mj_multiRay(
            self._model,
            data,
            e_from_camera[:3, 3],
            directions.ravel(),
            self._groups,
            True,
            -1,
            geom,
            distance,
            normals,
            n,
            _FAR_M,
        )
        missed = geom < 0
        distance /= lengths
        distance[missed] = np.inf
        normals[np.repeat(missed, 3)] = 0.0
        return Hits(geom, distance, normals.reshape(n, 3))

    def colors(self, hits: Hits) -> Array:
        """Return the (n, 3) colours 0-255 of what was met; black for nothing."""
        return np.asarray(self._rgb[hits.geom] * shade(hits.normals)[:, None])
