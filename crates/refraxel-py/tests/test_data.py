"""Cameras, datasets and scenes."""

from pathlib import Path

import numpy as np
import pytest

import refraxel
from refraxel import Camera, Dataset, InputError


def cameras(count: int) -> list[Camera]:
    eyes = [(3 * np.cos(a), 3 * np.sin(a), 1.0) for a in np.linspace(0, 2 * np.pi, count, endpoint=False)]
    return [Camera.look_at(eye, (0, 0, 0), size=(8, 6)) for eye in eyes]


def images(count: int) -> list[np.ndarray]:
    return [np.full((6, 8, 3), 20 * k, dtype=np.uint8) for k in range(count)]


def test_a_camera_projects_the_points_of_its_rays_to_their_pixels() -> None:
    camera = Camera.look_at((3.0, 1.0, 0.5), (0.0, 0.0, 0.0), size=(8, 6))
    origins, directions = camera.rays()
    assert origins.shape == directions.shape == (6, 8, 3)
    assert camera.project(origins[2, 5] + 4.0 * directions[2, 5]) == pytest.approx((5.5, 2.5))
    pose = camera.world_from_camera
    np.testing.assert_allclose(camera.directions() @ pose[:3, :3].T, directions, atol=1e-14)
    assert camera.moved(pose) == camera


def test_lenses_bend_directions_and_wrong_ones_are_refused() -> None:
    pose = np.eye(4)
    fisheye = Camera(8, 8, (3.0, 3.0), pose, lens="fisheye", distortion=(0.01, 0.0, 0.0, 0.0))
    assert np.abs(fisheye.directions() - Camera(8, 8, (3.0, 3.0), pose).directions()).max() > 0.05
    with pytest.raises(InputError, match="k1, k2, k3, k4"):
        Camera(8, 8, (3.0, 3.0), pose, lens="fisheye", distortion=(0.01,))
    with pytest.raises(InputError, match="orthonormal"):
        Camera(8, 8, (3.0, 3.0), 2.0 * np.eye(3, 4))


def test_cameras_that_are_none_are_refused() -> None:
    pose, nan = np.eye(4), float("nan")
    with pytest.raises(InputError, match="at most"):
        Camera(4294967295, 4294967295, (3.0, 3.0), pose)
    with pytest.raises(InputError, match="at least one"):
        Camera(8, 8, (3.0, 3.0), pose).resized(-1, 8)
    with pytest.raises(InputError, match="at most"):
        Camera.look_at((3.0, 0.0, 0.0), (0.0, 0.0, 0.0), size=(100_000, 100_000))
    with pytest.raises(InputError, match="center"):
        Camera(8, 8, (3.0, 3.0), pose, center=(nan, 4.0))
    with pytest.raises(InputError, match="distortion"):
        Camera(8, 8, (3.0, 3.0), pose, lens="fisheye", distortion=(nan, 0.0, 0.0, 0.0))
    with pytest.raises(InputError, match="rigid"):
        Camera(8, 8, (3.0, 3.0), pose.reshape(2, 8))
    with pytest.raises(InputError, match="complex"):
        Camera(8, 8, (3.0, 3.0), pose.astype(complex))
    with pytest.raises(InputError, match="views"):
        refraxel.Scene("glass_ball").dataset(size=(8, 8), views=(0, 0, 0))
    with pytest.raises(InputError, match="size"):
        refraxel.Scene("glass_ball").dataset(size=(1_000_000, 8))
    with pytest.raises(InputError, match="train and test"):
        Dataset.from_arrays(images(10), cameras(10), train=[0, 1, 2], test=[2])


def test_arrays_come_back_as_they_were() -> None:
    masks = [np.zeros((6, 8), dtype=bool) for _ in range(10)]
    masks[1][2, 3] = True
    data = Dataset.from_arrays(images(10), cameras(10), masks=masks, backdrop=(1.0, 1.0, 1.0))
    assert len(data) == 10 and data.test == [0, 8] and 9 in data.train
    np.testing.assert_array_equal(data.image(4), images(10)[4])
    np.testing.assert_array_equal(data.mask(1) == 255, masks[1])
    assert data.cameras[3] == cameras(10)[3]
    assert data.bounds.shape == (2, 3)


def test_what_is_wrong_with_arrays_is_said() -> None:
    with pytest.raises(InputError, match="9 cameras for 10 images"):
        Dataset.from_arrays(images(10), cameras(9))
    with pytest.raises(InputError, match=r"0000.png has the shape \[6, 8\]"):
        Dataset.from_arrays([i[..., 0] for i in images(10)], cameras(10))
    with pytest.raises(InputError, match="uint8 or float32"):
        Dataset.from_arrays([i.astype(np.int64) for i in images(10)], cameras(10))  # type: ignore[misc]
    with pytest.raises(InputError, match="12"):
        Dataset.from_arrays(images(10), cameras(10), train=[12])


def test_a_missing_folder_is_named() -> None:
    with pytest.raises(InputError, match="no_such_folder"):
        Dataset.open("no_such_folder")


def test_a_scene_written_to_a_folder_opens_with_its_splits(tmp_path: Path) -> None:
    refraxel.synth("glass_ball", tmp_path / "ball", size=16, views=5, spp=1)
    data = Dataset.open(tmp_path / "ball")
    assert (len(data.train), len(data.val), len(data.test)) == (5, 1, 2)
    assert data.image(0).shape[:2] == (16, 16)
    cut = Dataset.open(tmp_path / "ball", crop=(2, 1, 0, 3), up=(0, 0, 2))
    assert cut.image(0).shape[:2] == (12, 14)
    assert (cut.image(0) == data.image(0)[1:13, 2:]).all()
    with pytest.raises(InputError, match="not all 0"):
        Dataset.open(tmp_path / "ball", up=(0, 0, 0))


def test_the_exact_tracer_sees_glass_bend_light() -> None:
    scene = refraxel.Scene("glass_ball")
    camera = Camera.look_at((3.0, 0.0, 0.8), (0.0, 0.0, 0.0), fov_x=0.5, size=(24, 24))
    view = scene.render(camera, spp=1)
    assert view["image"].shape == (24, 24, 3) and view["mask"].max() == 255
    y, x = np.argwhere(view["mask"] == 255)[0]
    origins, directions = camera.rays()
    [(points, path)] = scene.paths(origins[y, x][None], directions[y, x][None])
    assert len(points) > 2 and np.linalg.norm(path[-1] - path[0]) > 1e-3
    colours = scene.radiance(origins[:2], directions[:2])
    assert colours.shape == (2, 24, 3) and np.isfinite(colours).all()
    inside = points[1] + 1e-3 * path[2]
    assert scene.index(inside) == pytest.approx(1.5)


def test_unknown_scenes_are_answered_with_the_known_ones() -> None:
    with pytest.raises(InputError, match="luneburg"):
        refraxel.Scene("glas_ball")
    assert "luneburg" in [name for name, _, _ in refraxel.scenes()]
