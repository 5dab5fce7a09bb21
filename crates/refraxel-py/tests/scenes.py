"""A small differentiable scene: a smooth cloud before a panorama, seen through a ball of glass."""

import numpy as np

from refraxel import Medium, Model, Region, grid_points

BOUNDS = ((-1.0, -1.0, -1.0), (1.0, 1.0, 1.0))


def ball(index: float = 1.3, nodes: int = 25) -> Region:
    points = grid_points(BOUNDS, (nodes,) * 3)
    return Region.body(np.linalg.norm(points, axis=-1) - 0.6, BOUNDS, index=index, absorption=(0.0, 0.0, 0.0))


def lens(nodes: int = 25) -> Region:
    points = grid_points(BOUNDS, (nodes,) * 3)
    return Region.graded(1.0 + 0.3 * np.exp(-6.0 * np.sum(points**2, axis=-1)), BOUNDS, blurred=True)


def density(points: np.ndarray) -> np.ndarray:
    """Almost nothing at the border of the box and at the surface of the ball: the points of the quadrature are held fixed, so that
    gradients say nothing of the length that begins or ends there."""
    x, y, z = np.moveaxis(points, -1, 0)
    away = 1.0 - np.exp(-(((np.linalg.norm(points, axis=-1) - 0.6) / 0.3) ** 2))
    cloud: np.ndarray = (0.8 + 0.4 * np.sin(1.5 * x + y) * np.cos(z)) * np.prod(1.0 - points**2, axis=-1)
    found: np.ndarray = 1e-3 + cloud * away
    return found


def model(region: Region | None, nodes: int = 21) -> Model:
    points = grid_points(BOUNDS, (nodes,) * 3)
    x, y, z = np.moveaxis(points, -1, 0)
    sh = np.stack([0.3 * np.sin(k + x * (k % 3) + 0.7 * y - 0.4 * z) for k in range(12)], axis=-1)
    rows, columns = np.mgrid[0:16, 0:32]
    angles = 2 * np.pi * (columns + 0.5) / 32
    height = np.cos(np.pi * (rows + 0.5) / 16)
    background = np.stack([0.5 + 0.2 * np.sin(angles), 0.5 + 0.2 * height, 0.5 + 0.2 * np.cos(angles)], axis=-1)
    medium = None if region is None else Medium([region])
    colour = 0.4 * sh.reshape(*x.shape, 3, 4)
    return Model.from_arrays(density(points), colour, BOUNDS, background=background, medium=medium, step=0.05)


def rays(count: int = 2000) -> tuple[np.ndarray, np.ndarray]:
    """From all around through the middle and past the ball; none grazes it, where a small change decides whether a ray bends."""
    random = np.random.default_rng(5)
    origins = random.normal(size=(4 * count, 3))
    origins *= 3.0 / np.linalg.norm(origins, axis=1, keepdims=True)
    directions = random.uniform(-0.6, 0.6, size=origins.shape) - origins
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    distance = np.linalg.norm(np.cross(origins, directions), axis=1)
    chosen = np.flatnonzero((distance < 0.45) | (distance > 0.7))[:count]
    return origins[chosen], directions[chosen]


def adjoints(count: int = 2000) -> tuple[np.ndarray, np.ndarray]:
    random = np.random.default_rng(6)
    return random.normal(size=(count, 3)), random.normal(size=count)
