"""The bodies of a MuJoCo environment as meshes, and where they are in a sequence of states."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from pbcs_ompl.core.interfaces import ResettableModel
from pbcs_ompl.core.types import Array
from pbcs_ompl.resettable.adapters.mujoco import MujocoEnv
from pbcs_ompl.resettable.simulation import simulation_of

SEGMENTS = 16
"""Corners around a capsule or cylinder, of which a page holds dozens."""


@dataclass(frozen=True)
class Bodies:
    """What moves.

    Attributes:
        model: The MuJoCo model.
        moving: The bodies that have geometries and move with joints [M].
        positions, turns: Of each state and body, in the world [T, M, 3], and as quaternions w, x, y, z [T, M, 4].
    """

    model: Any
    moving: list[int]
    positions: Array
    turns: Array

    def add_to(self, scene: Any) -> dict[int, Any]:
        """Add a mesh for each body to a scene of viser; return their handles."""
        handles = {}
        for body in self.moving:
            first, count = int(self.model.body_geomadr[body]), int(self.model.body_geomnum[body])
            meshes = [mesh for geom in range(first, first + count) if (mesh := _mesh(self.model, geom)) is not None]
            if meshes:
                import trimesh

                handles[body] = scene.add_mesh_trimesh(f"bodies/{body}", trimesh.util.concatenate(meshes))
        return handles

    def pose(self, handles: dict[int, Any], index: int) -> None:
        """Put the meshes where the bodies are in a state."""
        for place, body in enumerate(self.moving):
            if body in handles:
                handles[body].position = tuple(self.positions[index, place])
                handles[body].wxyz = tuple(self.turns[index, place])


def bodies_in(model: ResettableModel, states: Array) -> Bodies | None:
    """Return the bodies of a MuJoCo environment along states [T, D].

    None where there is no MuJoCo, or where the feature is not the place of a body, so that bodies and tree would have
    nothing to do with each other.
    """
    env = model.env.inner if isinstance(model.env, MujocoEnv) else model.env
    simulation = simulation_of(env)
    if simulation is None:
        return None
    import mujoco

    functions: Any = mujoco
    body, data = simulation.model, simulation.data
    moving = [index for index in range(1, body.nbody) if body.body_weldid[index] and body.body_geomnum[index]]
    before = np.array(model.env.get_env_state())
    positions, turns = [], []
    for state in states:
        model.env.set_env_state(np.array(state))
        functions.mj_kinematics(body, data)
        positions.append(np.array(data.xpos[moving]))
        turns.append(np.array(data.xquat[moving]))
    model.env.set_env_state(before)
    found = Bodies(body, moving, np.array(positions), np.array(turns))
    features = model.feature(states)
    if features.shape[1] < 2 or not moving:
        return None
    apart = np.abs(found.positions[:, :, :2] - features[:, None, :2]).max(axis=(0, 2))
    return found if apart.min() < np.min(model.bin_size) else None


def _mesh(model: Any, geom: int) -> Any:
    """Return a geometry as a mesh in the frame of its body; None for planes, height fields and what is invisible."""
    import mujoco
    import trimesh

    simulation: Any = mujoco
    kinds = simulation.mjtGeom
    size, kind = model.geom_size[geom], int(model.geom_type[geom])
    colour = model.geom_rgba[geom]
    if colour[3] == 0 or kind in (int(kinds.mjGEOM_PLANE), int(kinds.mjGEOM_HFIELD)):
        return None
    if kind == int(kinds.mjGEOM_SPHERE):
        mesh = trimesh.creation.icosphere(subdivisions=2, radius=size[0])
    elif kind == int(kinds.mjGEOM_CAPSULE):
        mesh = trimesh.creation.capsule(height=2 * size[1], radius=size[0], count=[SEGMENTS, SEGMENTS])
        mesh.apply_translation(-mesh.bounds.mean(axis=0))
    elif kind == int(kinds.mjGEOM_CYLINDER):
        mesh = trimesh.creation.cylinder(radius=size[0], height=2 * size[1], sections=SEGMENTS)
    elif kind == int(kinds.mjGEOM_BOX):
        mesh = trimesh.creation.box(extents=2 * size)
    elif kind == int(kinds.mjGEOM_ELLIPSOID):
        mesh = trimesh.creation.icosphere(subdivisions=2)
        mesh.apply_scale(size)
    else:
        mesh = _stored_mesh(model, int(model.geom_dataid[geom]))
    transform = trimesh.transformations.quaternion_matrix(model.geom_quat[geom])
    transform[:3, 3] = model.geom_pos[geom]
    mesh.apply_transform(transform)
    visual: Any = mesh.visual
    visual.vertex_colors = (255 * colour).astype(np.uint8)
    return mesh


def _stored_mesh(model: Any, index: int) -> Any:
    import trimesh

    vertex, face = int(model.mesh_vertadr[index]), int(model.mesh_faceadr[index])
    return trimesh.Trimesh(np.array(model.mesh_vert[vertex:vertex + model.mesh_vertnum[index]]),
                           np.array(model.mesh_face[face:face + model.mesh_facenum[index]]))
