"""A scene in three dimensions as one page for the browser: the tree as it grows, the plan, the controller on its way.

The page plays by itself and has a slider for the time. It needs no other file and no network.
"""

from collections.abc import Sequence
from contextlib import redirect_stdout
from dataclasses import dataclass
from io import StringIO
from typing import Any

import numpy as np

from pbcs_ompl.core.errors import MissingDependency
from pbcs_ompl.core.interfaces import ResettableModel
from pbcs_ompl.core.tree import Tree
from pbcs_ompl.core.types import Array
from pbcs_ompl.figures.bodies import Bodies, bodies_in
from pbcs_ompl.figures.tree import depth

GENERATOR = '<meta name="generator" content="pbcs view">'
"""Marks a page of ours, which a new one may replace."""
MOST_EDGES, MOST_STATES, CHUNKS, CORNERS = 50_000, 250, 40, 48
STEP_SECONDS, REST_SECONDS = 0.06, 1.0
EDGE, WALL, GOAL = (150, 150, 150), (70, 70, 75), (241, 196, 15)
PLAN, WAY, SET = (214, 39, 40), (44, 160, 44), (142, 68, 173)
SHALLOW, DEEP = np.array([30, 60, 200]), np.array([60, 210, 160])


@dataclass(frozen=True)
class Places:
    """Where states lie in the scene: the first three dimensions of the feature, or the plane z = 0.

    A model with walls, or whose bodies stand in the feature's plane, keeps its own lengths; elsewhere dimensions have
    units of their own, and each is drawn 10 long.

    Attributes:
        model: The environment.
        origin: The feature at the scene's origin [F], F at most 3.
        scale: Length in the scene of one unit of the feature [F].
    """

    model: ResettableModel
    origin: Array
    scale: Array

    @classmethod
    def of(cls, model: ResettableModel, *, own_lengths: bool) -> "Places":
        """Return the places of a model."""
        low, high = model.feature_low[:3], model.feature_high[:3]
        if own_lengths:
            return cls(model, np.zeros(len(low)), np.ones(len(low)))
        return cls(model, low, 10.0 / np.maximum(high - low, 1e-12))

    def of_features(self, features: Array) -> Array:
        """Return places [B, 3] of features [B, F]."""
        places = np.zeros((len(features), 3))
        count = len(self.origin)
        places[:, :count] = (features[:, :count] - self.origin) * self.scale
        return places

    def __call__(self, states: Array) -> Array:
        """Return places [B, 3] of states [B, D]."""
        return self.of_features(self.model.feature(np.atleast_2d(states)))

    @property
    def extent(self) -> float:
        """The longest edge of what is explored."""
        corners = self.of_features(np.array([self.model.feature_low, self.model.feature_high]))
        return float(np.ptp(corners, axis=0).max())


def scene_page(model: ResettableModel, *, tree: Tree | None = None, path: Array | None = None,
               rollout: Array | None = None, activations: Sequence[tuple[Array, float]] = ()) -> str:
    """Return the page as HTML.

    Args:
        model: The environment.
        tree: A tree, which grows in the order in which its nodes were added; thinned evenly to 50,000 edges.
        path: States of the plan [T+1, D].
        rollout: States of one execution of a controller [T+1, D]; the bodies of a MuJoCo environment move along it,
            and along the plan where there is none.
        activations: Centre (a state [D]) and radius of each activation set.

    Raises:
        MissingDependency: viser is not installed.
    """
    moving = rollout if rollout is not None else path
    bodies = None if moving is None else bodies_in(model, moving)
    places = Places.of(model, own_lengths=bool(len(model.walls)) or bodies is not None)
    with redirect_stdout(StringIO()):  # it prints where it listens, whatever `verbose` says
        server = _viser().ViserServer(host="127.0.0.1", port=0, verbose=False)
    try:
        stage = _Stage(server, places)
        stage.add_surroundings()
        film = server.get_scene_serializer()
        if tree is not None and len(tree) > 1:
            stage.grow(tree, film)
        if path is not None:
            stage.add_line("plan", places(path), PLAN, 2.0)
            film.insert_sleep(REST_SECONDS)
        for index, (centre, radius) in enumerate(activations):
            stage.add_ring(f"activation sets/{index}", centre, radius)
        if moving is not None:
            if rollout is not None:
                stage.add_line("controller", places(rollout), WAY, 2.0)
            stage.move(moving, bodies, film)
        film.insert_sleep(REST_SECONDS)
        return str(film.as_html()).replace("<head>", f"<head>{GENERATOR}", 1)
    finally:
        with redirect_stdout(StringIO()):
            server.stop()


class _Stage:
    """The scene of a server, in the lengths of `places`."""

    def __init__(self, server: Any, places: Places):
        self.scene, self.places, self.unit = server.scene, places, places.extent / 100
        corners = places.of_features(np.array([places.model.feature_low, places.model.feature_high]))
        middle = corners.mean(axis=0)
        server.scene.set_up_direction("+z")
        server.initial_camera.look_at = tuple(middle)
        server.initial_camera.position = tuple(middle + 100 * self.unit * np.array([0.0, -0.6, 0.8]))

    def add_surroundings(self) -> None:
        """Add walls, the goal, and the box of what is explored."""
        model = self.places.model
        low, high = self.places.of_features(np.array([model.feature_low, model.feature_high]))
        (x0, y0, z0), (x1, y1, _) = low, high
        self.add_line("explored", np.array([[x, y, z0] for x, y in ((x0, y0), (x1, y0), (x1, y1), (x0, y1), (x0, y0))]),
                      EDGE, 0.5)
        height = 4 * self.unit
        for index, (x0, y0, x1, y1) in enumerate(np.reshape(model.walls, (-1, 4))):
            self.scene.add_box(f"walls/{index}", WALL, (x1 - x0, y1 - y0, height), opacity=0.8,
                               position=((x0 + x1) / 2, (y0 + y1) / 2, height / 2))
        if model.goal_circle is not None:
            x, y, radius = model.goal_circle
            place = self.places.of_features(np.array([[x, y]]))[0]
            self.scene.add_cylinder("goal", radius * float(self.places.scale[0]), 0.5 * self.unit, GOAL, opacity=0.7,
                                    position=tuple(place))

    def grow(self, tree: Tree, film: Any) -> None:
        """Show the edges of a tree in portions, the oldest first."""
        edges = np.flatnonzero(tree.parents >= 0)
        edges = edges[:: -(-len(edges) // MOST_EDGES)] if len(edges) > MOST_EDGES else edges
        points, depths = self.places(tree.states), depth(tree.parents)
        share = (depths[edges] / max(1, depths.max()))[:, None]
        colours = (SHALLOW + share * (DEEP - SHALLOW)).astype(np.uint8)
        for index, part in enumerate(np.array_split(np.arange(len(edges)), min(CHUNKS, len(edges)))):
            nodes = edges[part]
            ends = np.stack([points[tree.parents[nodes]], points[nodes]], axis=1)
            self.scene.add_line_segments(f"tree/{index}", ends, np.repeat(colours[part][:, None], 2, axis=1),
                                         thickness=0.3 * self.unit)
            film.insert_sleep(STEP_SECONDS)

    def add_line(self, name: str, points: Array, colour: tuple[int, int, int], thickness: float) -> None:
        """Add a line through points [N, 3], a little above the tree."""
        lifted = points + np.array([0.0, 0.0, 0.3 * self.unit])
        self.scene.add_line_segments(name, np.stack([lifted[:-1], lifted[1:]], axis=1), colour,
                                     thickness=0.4 * thickness * self.unit)

    def add_ring(self, name: str, centre: Array, radius: float) -> None:
        """Add the edge of a ball of the feature's plane."""
        angles = np.linspace(0.0, 2 * np.pi, CORNERS + 1)
        feature = np.repeat(self.places.model.feature(centre[None]), len(angles), axis=0)
        feature[:, 0] += radius * np.cos(angles)
        feature[:, 1 % feature.shape[1]] += radius * np.sin(angles)
        self.add_line(name, self.places.of_features(feature), SET, 1.0)

    def move(self, states: Array, bodies: Bodies | None, film: Any) -> None:
        """Move the bodies, or a ball, along states."""
        chosen = np.unique(np.linspace(0, len(states) - 1, min(len(states), MOST_STATES)).astype(int))
        places = self.places(states)
        ball = None if bodies else self.scene.add_icosphere("ball", 1.2 * self.unit, WAY, subdivisions=2)
        handles = {} if bodies is None else bodies.add_to(self.scene)
        for index in chosen:
            if ball is not None:
                ball.position = tuple(places[index])
            if bodies is not None:
                bodies.pose(handles, index)
            film.insert_sleep(STEP_SECONDS)


def _viser() -> Any:
    try:
        import viser
    except ModuleNotFoundError as error:
        raise MissingDependency("views need viser: pip install 'pbcs-ompl[view]'") from error
    return viser
