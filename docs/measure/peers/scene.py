"""A scene in NeRF-synthetic layout as numpy arrays, a clock of CPU seconds, and pictures on disk: what all peers share."""

import json
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from PIL import Image


@dataclass
class View:
    """One photograph: sRGB values (height, width, 3) in [0, 1] on white, and the rays through its pixels, row by row."""

    name: str
    colour: np.ndarray
    pose: np.ndarray  # world from camera (3, 4), OpenGL axes
    focal: float  # [pixel]

    def rays(self, dx: float = 0.5, dy: float = 0.5) -> tuple[np.ndarray, np.ndarray]:
        """Origins and unit directions (height * width, 3) of rays at the offset (dx, dy) [pixel] within each pixel."""
        height, width = self.colour.shape[:2]
        x, y = np.meshgrid(np.arange(width) + dx - width / 2, np.arange(height) + dy - height / 2)
        camera = np.stack([x, -y, np.full_like(x, -self.focal)], -1).reshape(-1, 3) / self.focal
        direction = camera @ self.pose[:, :3].T
        direction /= np.linalg.norm(direction, axis=-1, keepdims=True)
        return np.broadcast_to(self.pose[:, 3], direction.shape).astype(np.float32), direction.astype(np.float32)


def read_views(folder: Path, split: str, every: int = 1) -> list[View]:
    """The views of a split; of the test views each `every`-th one."""
    table = json.loads((folder / f"transforms_{split}.json").read_text())
    views = []
    for frame in table["frames"][::every]:
        path = folder / (frame["file_path"] + ".png")
        rgba = np.asarray(Image.open(path).convert("RGBA"), np.float32) / 255
        colour = rgba[..., :3] * rgba[..., 3:] + 1 - rgba[..., 3:]
        focal = colour.shape[1] / 2 / np.tan(table["camera_angle_x"] / 2)
        pose = np.asarray(frame["transform_matrix"], np.float64)[:3]
        views.append(View(path.name, colour, pose, float(focal)))
    return views


def read_truth(folder: Path) -> dict:
    """scene.json: the box of the scene, and the refractive bodies for those who are told."""
    return json.loads((folder / "scene.json").read_text())


def training_rays(folder: Path) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Origins, directions and colours (N, 3) of all pixels of all training views."""
    views = read_views(folder, "train")
    origins, directions = zip(*(view.rays() for view in views), strict=True)
    colours = [view.colour.reshape(-1, 3) for view in views]
    return np.concatenate(origins), np.concatenate(directions), np.concatenate(colours)


class Budget:
    """CPU seconds of all threads of this process since it began, the imports included."""

    def __init__(self, seconds: float) -> None:
        self.seconds = seconds

    @property
    def used(self) -> float:
        """The part of the budget that is used, from 0 to 1."""
        return min(time.process_time() / self.seconds, 1.0)


def write_picture(path: Path, colour: np.ndarray) -> None:
    """An 8-bit picture of sRGB values (height, width, 3)."""
    path.parent.mkdir(parents=True, exist_ok=True)
    Image.fromarray(np.round(np.clip(colour, 0, 1) * 255).astype(np.uint8)).save(path)
