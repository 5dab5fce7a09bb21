"""refraxel as a method of NerfBaselines, which trains and scores many methods by one protocol: PSNR, SSIM and LPIPS.

Needs ``pip install nerfbaselines``, and ``torch`` with ``torchvision`` for LPIPS. NerfBaselines finds the method by itself::

    nerfbaselines train --method refraxel --backend python --data DATA --output OUT --set run.steps=4000

``--set`` takes the options of training, which ``refraxel.options()`` lists. Masks of a NerfBaselines dataset say which pixels may be
used, never where glass is: glass is found without masks.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from nerfbaselines import Method, register
from numpy.typing import NDArray

from ._refraxel import Camera, Dataset, Run, Session
from .errors import InputError

__all__ = ["Refraxel"]

NAME = "refraxel"
# Camera models of NerfBaselines in the order of their numbers, with ours and the coefficients that ours takes. Theirs are in the
# order of OpenCV's full model: k1, k2, p1, p2, k3, k4.
LENSES: tuple[tuple[str, str, tuple[int, ...]], ...] = (
    ("pinhole", "pinhole", ()),
    ("opencv", "opencv", (0, 1, 2, 3)),
    ("opencv_fisheye", "fisheye", (0, 1, 4, 5)),
)


def _camera(camera: Any) -> Camera:
    """One camera of NerfBaselines, whose frame has x right, y down and z forward as ours."""
    _, lens, taken = LENSES[int(camera.camera_models)]
    given = np.asarray(camera.distortion_parameters, np.float64)
    padded = np.concatenate([given, np.zeros(8)])
    fx, fy, cx, cy = (float(value) for value in camera.intrinsics)
    width, height = (int(value) for value in camera.image_sizes)
    # Their poses are single precision; the nearest rotation is a rotation in double precision.
    pose = np.asarray(camera.poses, np.float64)[:3, :4].copy()
    left, _, right = np.linalg.svd(pose[:, :3])
    pose[:, :3] = left @ right
    coefficients = [float(padded[k]) for k in taken]
    return Camera(width, height, (fx, fy), pose, center=(cx, cy), lens=lens, distortion=coefficients)  # type: ignore[arg-type]


def _pixels(images: Any, k: int, camera: Camera) -> NDArray[Any]:
    """Image or mask k without the padding of a stack."""
    return np.ascontiguousarray(np.asarray(images[k])[: camera.height, : camera.width])


def _dataset(data: Mapping[str, Any]) -> Dataset:
    """All views of a NerfBaselines dataset, as training views."""
    metadata = data["metadata"]
    space = metadata.get("color_space", "srgb")
    if space != "srgb":
        raise InputError(f"the dataset's color_space is {space!r}; expected 'srgb'")
    cameras = [_camera(camera) for camera in data["cameras"]]
    images = [_pixels(data["images"], k, camera) for k, camera in enumerate(cameras)]
    masks = data.get("masks")
    behind = metadata.get("background_color")
    return Dataset.from_arrays(
        images,
        cameras,
        masks=None if masks is None else [_pixels(masks, k, camera) for k, camera in enumerate(cameras)],
        names=[f"{k:04}_{Path(path).name}" for k, path in enumerate(data["image_paths"])],
        train=list(range(len(cameras))),
        test=[],
        backdrop="surroundings" if behind is None else [float(value) / 255 for value in behind],
        mask_meaning="keep",
    )


class Refraxel(Method):  # type: ignore[misc,unused-ignore]
    """A training or a finished run, with the functions that NerfBaselines calls."""

    def __init__(
        self,
        *,
        checkpoint: str | None = None,
        train_dataset: Mapping[str, Any] | None = None,
        config_overrides: Mapping[str, Any] | None = None,
    ) -> None:
        given = dict(config_overrides or {})
        if float(given.get("run.minutes", 0)) != 0:
            raise InputError("run.minutes is set, and NerfBaselines counts steps; set run.steps")
        self._checkpoint = checkpoint
        self._last: dict[str, float] = {}
        self._run = None if checkpoint is None else Run.load(checkpoint)
        self._session: Session | None = None
        if train_dataset is not None:
            data = _dataset(train_dataset)
            if self._run is None:
                self._session = Session(data, options=given)
            else:
                self._session = self._run.resume(data, options=given)
        elif self._run is None:
            raise InputError("neither a checkpoint nor a training dataset is given; give one of them")
        self._loaded = None if self._run is None else self._run.step

    @classmethod
    def get_method_info(cls) -> Any:
        return {
            "method_id": NAME,
            "required_features": frozenset(("color",)),
            "supported_camera_models": frozenset(name for name, _, _ in LENSES),
            "supported_outputs": ("color", "accumulation", {"name": "depth", "type": "depth"}),
            "can_resume_training": True,
        }

    def get_info(self) -> Any:
        chosen = self._trained().options
        return {
            **self.get_method_info(),
            "num_iterations": int(chosen["run"]["steps"]),
            "loaded_step": self._loaded,
            "loaded_checkpoint": self._checkpoint,
            "batch_size": int(chosen["run"]["batch"]),
            "hparams": {f"{group}.{name}": value for group, values in chosen.items() for name, value in values.items()},
        }

    def _trained(self) -> Session | Run:
        trained = self._session or self._run
        assert trained is not None  # one of them is there from the start
        return trained

    def _hear(self, event: dict[str, Any]) -> None:
        if event["event"] == "record":
            self._last = {"psnr": float(event["train_psnr"])}

    def train_iteration(self, step: int) -> dict[str, float]:
        """One step, with the decisions that fall into it: some steps take seconds, while it is found out what bends rays."""
        if self._session is None:
            raise InputError("this run was loaded to be rendered; give train_dataset to train it on")
        self._session.run(until_step=step + 1, on_event=self._hear)
        return {**self._last, "num_rays": float(self._session.options["run"]["batch"])}

    def render(self, camera: Any, *, options: Any = None) -> dict[str, NDArray[np.float32]]:
        del options  # an 8-bit colour, opacity and depth cost one march together
        shown = self._trained().render(_camera(camera.item()))
        return {
            "color": shown.colour.astype(np.float32) / np.float32(255),
            "accumulation": shown.opacity,
            "depth": shown.depth,
        }

    def save(self, path: str) -> None:
        """A run that ``refraxel render`` and the other verbs of the program read."""
        Path(path).mkdir(parents=True, exist_ok=True)
        if self._session is not None:
            self._session.save(path)
        elif self._run is not None:
            self._run.save(path)


register(
    {
        "id": NAME,
        "method_class": f"{__name__}:{Refraxel.__name__}",
        "backends_order": ["python"],
        "required_features": ["color"],
        "supported_camera_models": [name for name, _, _ in LENSES],
        "metadata": {
            "name": NAME,
            "description": "A voxel radiance field with an index of refraction: rays bend in glass and water. Trains on a CPU.",
            "licenses": [{"name": "MIT"}, {"name": "Apache-2.0"}],
        },
    }
)
