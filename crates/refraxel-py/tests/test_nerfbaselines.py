"""The method for NerfBaselines: its program trains and scores a dataset, and its cameras are ours."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import refraxel

pytest.importorskip("nerfbaselines")
image = pytest.importorskip("PIL.Image")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("nerfbaselines") / "ball"
    refraxel.synth("glass_ball", folder, size=32, views=12, spp=1)
    # What NerfBaselines asks of a dataset on disk, beside the files of the format.
    loader = "nerfbaselines.datasets.blender:load_blender_dataset"
    (folder / "nb-info.json").write_text(
        json.dumps({"loader": loader, "id": "ball", "scene": "ball", "evaluation_protocol": "default"})
    )
    return folder


def nerfbaselines(*words: str) -> None:
    done = subprocess.run([sys.executable, "-m", "nerfbaselines", *words], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr


def test_its_program_trains_goes_on_and_renders(folder: Path, tmp_path: Path) -> None:
    # Its scores include LPIPS, which needs PyTorch and weights from the network: training scores nothing.
    never = "1000000"
    chosen = ["--method", "refraxel", "--backend", "python", "--data", str(folder), "--logger", "none"]
    chosen += ["--eval-few-iters", never, "--eval-all-iters", never, "--disable-output-artifact", "--save-iters", "30,60"]
    chosen += [word for option in ("run.steps=60", "grid.resolution=24") for word in ("--set", option)]
    nerfbaselines("train", *chosen, "--output", str(tmp_path / "whole"))
    last = tmp_path / "whole" / "checkpoint-60"
    run = refraxel.Run.load(last)
    assert run.step == 60
    resumed = ["--checkpoint", str(tmp_path / "whole" / "checkpoint-30"), "--output", str(tmp_path / "resumed")]
    nerfbaselines("train", *chosen, *resumed)
    parameters = refraxel.Run.load(tmp_path / "resumed" / "checkpoint-60").model().parameters()
    assert all(np.array_equal(value, parameters[name]) for name, value in run.model().parameters().items())

    shown = tmp_path / "shown"
    nerfbaselines("render", "--checkpoint", str(last), "--data", str(folder), "--output", str(shown), "--backend", "python")
    data = refraxel.Dataset.open(folder)
    camera = data.cameras[data.test[0]]
    picture = image.open(next((shown / "color").rglob("r_0.png")))
    assert np.abs(np.asarray(picture)[..., :3].astype(int) - run.render(camera).colour).max() <= 1


@pytest.mark.parametrize(
    ("model", "distortion"),
    [("pinhole", []), ("opencv", [0.1, -0.02, 0.003, 0.004]), ("opencv_fisheye", [0.1, -0.02, 0.0, 0.0, 0.01, 0.002])],
)
def test_its_cameras_have_the_same_rays(model, distortion: list[float]) -> None:
    from nerfbaselines import camera_model_to_int, new_cameras
    from nerfbaselines.cameras import get_rays

    from refraxel.nerfbaselines import _camera

    mine = refraxel.Camera.look_at((2, 1, 3), (0, 0, 0), size=(40, 30))
    given = new_cameras(
        poses=mine.world_from_camera[None, :3].astype(np.float32),
        intrinsics=np.array([[*mine.focal, *mine.center]], np.float32),
        camera_models=np.array([camera_model_to_int(model)], np.int32),
        distortion_parameters=np.array([distortion], np.float32),
        image_sizes=np.array([[40, 30]], np.int32),
    )
    corner = np.stack(np.meshgrid(np.arange(40), np.arange(30)), -1).reshape(-1, 2)
    origins, directions = get_rays(given[np.zeros(len(corner), int)], corner)
    directions /= np.linalg.norm(directions, axis=-1, keepdims=True)
    for their, our in zip((origins, directions), _camera(given[0]).rays(), strict=True):
        assert np.allclose(their, our.reshape(-1, 3), atol=2e-5)
