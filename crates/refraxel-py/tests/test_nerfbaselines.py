"""The method for NerfBaselines: its program trains and scores a dataset, and its cameras are ours."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import refraxel

pytest.importorskip("nerfbaselines")


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


def test_its_program_trains_scores_and_goes_on(folder: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    settings = [word for option in ("run.steps=60", "grid.resolution=24") for word in ("--set", option)]
    chosen = ["--method", "refraxel", "--backend", "python", "--data", str(folder), "--logger", "none"]
    nerfbaselines("train", *chosen, "--output", str(out), *settings)
    scores = json.loads(next(out.glob("results-*.json")).read_text())["metrics"]
    assert scores["psnr"] > 10, scores
    checkpoint = out / "checkpoint-60"
    run = refraxel.Run.load(checkpoint)
    assert run.step == 60

    # The score is that of the run by our own measure.
    ours = run.evaluate(refraxel.Dataset.open(folder))["psnr"]
    assert abs(ours - scores["psnr"]) < 0.02, (ours, scores)


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
    )[0]
    corner = np.stack(np.meshgrid(np.arange(40), np.arange(30)), -1).reshape(-1, 2)
    origins, directions = get_rays(given, corner)
    directions /= np.linalg.norm(directions, axis=-1, keepdims=True)
    for their, our in zip((origins, directions), _camera(given).rays(), strict=True):
        assert np.allclose(their, our.reshape(-1, 3), atol=2e-5)
