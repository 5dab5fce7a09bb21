"""A small differentiable scene: a smooth cloud before a panorama, seen through a ball of glass."""

import numpy as np

from refraxel import Medium, Model, Region, grid_points

BOUNDS = ((-1.0, -1.0, -1.0), (1.0, 1.0, 1.0))


def ball(index: float = 1.3, nodes: int = 25) -> Region:
    points = grid_points(BOUNDS, (nodes,) * 3)
    return Region.body(np.linalg.norm(points, axis=-1) - 0.6, BOUNDS, index=index, absorption=(0.3, 0.1, 0.05))


def lens(nodes: int = 25) -> Region:
    points = grid_points(BOUNDS, (nodes,) * 3)
    return Region.graded(1.0 + 0.3 * np.exp(-6.0 * np.sum(points**2, axis=-1)), BOUNDS, blurred=True)


def model(region: Region | None, nodes: int = 9) -> Model:
    points = grid_points(BOUNDS, (nodes,) * 3)
    x, y, z = np.moveaxis(points, -1, 0)
    density = 0.6 + 0.3 * np.sin(1.5 * x + y) * np.cos(z)
    sh = np.stack([0.3 * np.sin(k + x * (k % 3) + 0.7 * y - 0.4 * z) for k in range(12)], axis=-1)
    rows, columns = np.mgrid[0:16, 0:32]
    angles = 2 * np.pi * (columns + 0.5) / 32
    height = np.cos(np.pi * (rows + 0.5) / 16)
    background = np.stack([0.5 + 0.2 * np.sin(angles), 0.5 + 0.2 * height, 0.5 + 0.2 * np.cos(angles)], axis=-1)
    medium = None if region is None else Medium([region])
    colour = 0.4 * sh.reshape(*density.shape, 3, 4)
    return Model.from_arrays(density, colour, BOUNDS, background=background, medium=medium, step=0.5)


def rays(count: int = 2000) -> tuple[np.ndarray, np.ndarray]:
    """From all around through the middle, some past the ball."""
    random = np.random.default_rng(5)
    origins = random.normal(size=(count, 3))
    origins *= 3.0 / np.linalg.norm(origins, axis=1, keepdims=True)
    return origins, random.uniform(-0.4, 0.4, size=(count, 3)) - origins


def adjoints(count: int = 2000) -> tuple[np.ndarray, np.ndarray]:
    random = np.random.default_rng(6)
    return random.normal(size=(count, 3)), random.normal(size=count)
