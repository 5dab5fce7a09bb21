"""Differentiable voxel radiance fields for scenes with glass, water and other refractive things.

>>> import refraxel
>>> data = refraxel.Scene("glass_ball").dataset(size=(64, 64), views=(24, 0, 4))
>>> run = refraxel.train(data, options={"run.steps": 300})
>>> run.evaluate(data)["psnr"]

Lengths are in scene units, angles in radians. World coordinates are those of the data. A camera looks along +z of its own
frame, with x right and y down; pixel (0, 0) is the upper left one. Colours are sRGB-encoded, 1 = white, unless "linear" is said.
Arrays of positions and values on grids are indexed [x, y, z].
"""

from ._refraxel import (
    Camera,
    Dataset,
    Medium,
    Model,
    Paths,
    Region,
    Rendering,
    Run,
    Scene,
    Session,
    __version__,
    options,
    scenes,
    set_threads,
    synth,
)
from .errors import CancelledError, DivergedError, FileError, InputError, RefraxelError
from .grids import from_grid, grid_points, to_grid
from .training import events, train

__all__ = [
    "Camera",
    "CancelledError",
    "Dataset",
    "DivergedError",
    "FileError",
    "InputError",
    "Medium",
    "Model",
    "Paths",
    "RefraxelError",
    "Region",
    "Rendering",
    "Run",
    "Scene",
    "Session",
    "__version__",
    "events",
    "from_grid",
    "grid_points",
    "options",
    "scenes",
    "set_threads",
    "synth",
    "to_grid",
    "train",
]
