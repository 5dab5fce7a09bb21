"""Values of stored voxels as dense grids, and back."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._refraxel import Model
from .errors import InputError


def grid_points(bounds: ArrayLike, resolution: Sequence[int]) -> NDArray[np.float64]:
    """Positions [scene unit] of the nodes of a grid, shape (X, Y, Z, 3).

    ``bounds``: lower and upper corner, shape (2, 3). ``resolution``: nodes per axis, from face to face of the box.
    """
    corners = np.asarray(bounds, dtype=np.float64)
    if corners.shape != (2, 3):
        raise InputError(f"bounds have the shape {corners.shape}; expected (2, 3): the lower corner, then the upper one")
    if len(resolution) != 3 or min(resolution) < 2:
        raise InputError(f"resolution is {tuple(resolution)}; expected three numbers of nodes, at least 2 each")
    low, high = corners
    axes = [np.linspace(low[a], high[a], resolution[a]) for a in range(3)]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)


def to_grid(model: Model, values: NDArray[Any], empty: float = 0.0) -> NDArray[Any]:
    """Values of the stored voxels, shape (V, ...), on the dense grid of the model, shape (X, Y, Z, ...).

    Nodes that are not stored get the value ``empty``.
    """
    if values.shape[:1] != (len(model.voxels),):
        raise InputError(f"values have the shape {values.shape}; expected ({len(model.voxels)}, ...), one for each stored voxel")
    inside = np.all(model.voxels < np.asarray(model.resolution), axis=1)
    grid = np.full((*model.resolution, *values.shape[1:]), empty, dtype=values.dtype)
    x, y, z = model.voxels[inside].T
    grid[x, y, z] = values[inside]
    return grid


def from_grid(model: Model, grid: Any) -> Any:
    """Values on the dense grid of the model, shape (X, Y, Z, ...), at its stored voxels, shape (V, ...).

    ``grid`` may be an array of numpy, PyTorch or JAX; the result is of the same kind, and is differentiable where those are. Bricks of
    4 × 4 × 4 voxels are stored whole: beyond the last node they repeat its values, which nothing reads.
    """
    if tuple(grid.shape[:3]) != tuple(model.resolution):
        raise InputError(f"grid has the shape {tuple(grid.shape)}; expected {tuple(model.resolution)} and more axes, as the model has nodes")
    x, y, z = np.minimum(model.voxels, np.asarray(model.resolution) - 1).T
    return grid[x, y, z]
