"""Gradients of rendering against central differences, from numpy, JAX and PyTorch.

Rendering is in single precision: sums over 2000 rays differ by about 1e-5 of their size, so that a difference over a step of 1e-2 is right
to about 1e-3 of a gradient's size; kinks at cell faces and rays that graze the ball add to this.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import scenes
from refraxel import InputError, Model, from_grid, to_grid

STEP = 1e-2


def loss(model: Model, origins: np.ndarray, directions: np.ndarray) -> float:
    colour, transmittance, _ = model.render(origins, directions)
    d_colour, d_transmittance = scenes.adjoints(len(origins))
    return float(np.sum(colour.astype(np.float64) * d_colour) + np.sum(transmittance.astype(np.float64) * d_transmittance))


def difference(f: Callable[[float], Any], step: float = STEP) -> Any:
    """By Richardson: without the error of second order."""
    central = [(f(s) - f(-s)) / (2 * s) for s in (step, 2 * step)]
    return (4 * central[0] - central[1]) / 3


def direction(name: str, like: np.ndarray) -> np.ndarray:
    random = np.random.default_rng(len(name))
    if like.ndim == 0:
        return np.ones((), dtype=np.float32)
    v = random.normal(size=like.shape)
    if like.ndim == 3 and like.shape[0] > 16:
        # Splines of an index and of a surface are moved smoothly: single nodes would not be resolved by single precision.
        points = scenes.grid_points(scenes.BOUNDS, like.shape)
        v = 0.1 * np.exp(-4.0 * np.sum((points - [0.1, -0.1, 0.2]) ** 2, axis=-1))
    return v.astype(np.float32)


@pytest.mark.parametrize("region", ["none", "ball", "lens"])
def test_gradients_by_parameters_match_central_differences(region: str) -> None:
    model = scenes.model({"none": None, "ball": scenes.ball(), "lens": scenes.lens()}[region])
    origins, directions = scenes.rays()
    gradients = model.vjp(origins, directions, *scenes.adjoints())
    for name, value in model.parameters().items():
        if name == "absorption.0":
            continue  # clear glass is the edge of its range
        along = direction(name, value)

        def moved(step: float, name: str = name, value: np.ndarray = value, along: np.ndarray = along) -> float:
            model.set(name, value + np.float32(step) * along)
            found = loss(model, origins, directions)
            model.set(name, value)
            return found

        # A background of texels has kinks, over which rays that bend more move.
        expected = difference(moved, 2e-3 if name == "index.0" and value.ndim == 0 else STEP)
        found = float(np.sum(gradients[name].astype(np.float64) * along))
        assert found == pytest.approx(expected, rel=0.03, abs=0.02), name


def test_the_gradient_by_absorption_matches_central_differences() -> None:
    model = scenes.model(scenes.ball())
    clear = model.get("absorption.0")
    tint = np.array([0.1, 0.2, 0.3], dtype=np.float32)
    origins, directions = scenes.rays()

    def tinted(step: float) -> float:
        model.set("absorption.0", clear + tint + np.float32(step))
        return loss(model, origins, directions)

    expected = difference(tinted)
    model.set("absorption.0", clear + tint)
    found = model.vjp(origins, directions, *scenes.adjoints())["absorption.0"].sum()
    assert found == pytest.approx(expected, rel=0.005)


@pytest.mark.parametrize("region", ["none", "ball", "lens"])
def test_gradients_by_rays_match_central_differences(region: str) -> None:
    model = scenes.model({"none": None, "ball": scenes.ball(), "lens": scenes.lens()}[region])
    origins, directions = scenes.rays()
    d_colour, d_transmittance = scenes.adjoints()
    gradients = model.vjp(origins, directions, d_colour, d_transmittance)
    random = np.random.default_rng(8)
    for name in ["origins", "directions"]:
        along = random.normal(size=origins.shape)

        def moved(step: float, name: str = name, along: np.ndarray = along) -> np.ndarray:
            """The loss of each ray: a few whose path jumps shall not hide the others."""
            by = {name: step * along}
            colour, clear, _ = model.render(origins + by.get("origins", 0.0), directions + by.get("directions", 0.0))
            losses: np.ndarray = np.sum(colour.astype(np.float64) * d_colour, axis=-1) + clear * d_transmittance
            return losses

        found = np.sum(gradients[name].astype(np.float64) * along, axis=-1)
        error = np.abs(found - difference(moved, 2e-3))
        size = np.sqrt(np.mean(found**2))
        assert np.quantile(error, 0.9) < 0.03 * size and np.median(error) < 0.003 * size, name


def test_a_constant_background_receives_the_sum_of_its_texels() -> None:
    density, colour = np.full((5, 5, 5), 0.2), np.full((5, 5, 5, 3), 0.3)
    model = Model.from_arrays(density, colour, scenes.BOUNDS, background=(0.2, 0.4, 0.6))
    origins, directions = scenes.rays(50)
    _, transmittance, _ = model.render(origins, directions)
    found = model.vjp(origins, directions, np.ones((50, 3)))["background"].sum(axis=(0, 1))
    assert found == pytest.approx(np.full(3, transmittance.sum()), rel=1e-5)


def test_a_uniform_cloud_absorbs_as_the_closed_form_says() -> None:
    model = Model.from_arrays(np.full((9, 9, 9), 0.7), np.full((9, 9, 9, 3), 0.25), scenes.BOUNDS, background=(1, 1, 1))
    colour, transmittance, _ = model.render([[-3.0, 0.1, 0.2]], [[2.0, 0.0, 0.0]])
    assert transmittance[0] == pytest.approx(np.exp(-0.7 * 2.0), rel=1e-4)
    assert colour[0] == pytest.approx(0.25 + 0.75 * transmittance[0], rel=1e-4)


def test_grids_and_voxels_are_each_others_inverse() -> None:
    model = scenes.model(None)
    values = model.get("raw_density")
    grid = to_grid(model, values)
    assert grid.shape == (21, 21, 21)
    np.testing.assert_array_equal(to_grid(model, from_grid(model, grid)), grid)
    density = model.density_scale * np.logaddexp(0.0, grid)
    np.testing.assert_allclose(density, scenes.density(scenes.grid_points(scenes.BOUNDS, (21, 21, 21))), rtol=1e-4)


def test_wrong_shapes_and_values_are_refused() -> None:
    model = scenes.model(scenes.ball())
    with pytest.raises(InputError, match=r"raw_density has the shape \[3\]"):
        model.set("raw_density", np.zeros(3))
    with pytest.raises(InputError, match="n > 0"):
        model.set("index.0", np.float32(-1.0))
    with pytest.raises(InputError, match="shapes that render gives"):
        model.vjp(*scenes.rays(3), np.ones((3, 3)), np.ones((3, 1)))
    with pytest.raises(InputError, match="shapes that render gives"):
        model.vjp(*scenes.rays(5), np.ones((3, 5)))
    with pytest.raises(InputError, match="index.0, surface.0"):
        model.get("indices")
    with pytest.raises(InputError, match="vector 0 is zero"):
        model.render([[0.0, 0.0, 0.0]], [[0.0, 0.0, 0.0]])
    with pytest.raises(InputError, match=r"expected \(..., 3\)"):
        model.render([[0.0, 0.0]], [[1.0, 0.0]])


def test_gradients_of_many_rays_are_the_sum_of_those_of_their_portions() -> None:
    model = scenes.model(scenes.ball())
    origins, directions = (np.tile(a, (10, 1)) for a in scenes.rays(2000))
    d_colour = np.ones_like(origins)
    whole = model.vjp(origins, directions, d_colour)
    part = model.vjp(origins[:2000], directions[:2000], d_colour[:2000])
    for name, gradient in part.items():
        expected = np.tile(gradient, (10, 1)) if name in ("origins", "directions") else 10 * gradient
        np.testing.assert_allclose(whole[name], expected, rtol=1e-3, atol=1e-4 * np.abs(expected).max(), err_msg=name)


def test_gradients_are_not_taken_of_a_model_that_has_changed() -> None:
    model = scenes.model(scenes.ball())
    origins, directions = scenes.rays(50)
    density = {"raw_density": model.get("raw_density")}
    *_, changes = model._render(origins, directions, density)
    expected = model.vjp(origins, directions, np.ones((50, 3)))
    model.set("raw_density", density["raw_density"] + np.float32(1.0))
    found = model._vjp(origins, directions, np.ones((50, 3)), None, density, changes)
    np.testing.assert_allclose(found["sh"], expected["sh"], rtol=1e-4, atol=1e-6)  # put back
    model.set("index.0", np.float32(1.2))
    with pytest.raises(InputError, match="index.0 of the model has changed"):
        model._vjp(origins, directions, np.ones((50, 3)), None, density, changes)


def test_jax_gives_the_same_gradients_also_within_jit() -> None:
    jax = pytest.importorskip("jax")
    from refraxel.jax import camera_rays, parameters, renderer

    model = scenes.model(scenes.ball())
    render, values = renderer(model), parameters(model, "raw_density", "sh", "index.0", "surface.0", "background")
    origins, directions = (a.astype(np.float32) for a in scenes.rays(300))
    d_colour, d_transmittance = (a.astype(np.float32) for a in scenes.adjoints(300))

    def total(values, origins, directions):
        colour, transmittance = render(values, origins, directions)
        return (colour * d_colour).sum() + (transmittance * d_transmittance).sum()

    found = jax.jit(jax.grad(total, argnums=(0, 1, 2)))(values, origins, directions)
    expected = model.vjp(origins, directions, d_colour, d_transmittance)
    for name, gradient in {**found[0], "origins": found[1], "directions": found[2]}.items():
        size = np.abs(expected[name]).max()
        np.testing.assert_allclose(gradient, expected[name], atol=1e-5 * size, err_msg=name)

    rays_of = np.random.default_rng(1).uniform(-0.1, 0.1, size=(400, 3)) + [0.0, 0.0, 1.0]

    def by_pose(pose):
        colour, _ = render({}, *camera_rays(pose, rays_of))
        return colour.sum()

    pose = np.eye(4)
    pose[:3, 3] = (0.05, -0.02, -3.0)
    gradient = np.asarray(jax.grad(by_pose)(pose))
    for axis in range(3):
        shift = np.zeros((4, 4))
        shift[axis, 3] = 1.0

        def moved(step: float, shift: np.ndarray = shift) -> float:
            return float(by_pose(pose + step * shift))

        expected_shift = difference(moved, 2e-3)
        assert gradient[axis, 3] == pytest.approx(expected_shift, rel=0.02, abs=0.5), axis


def test_torch_gives_the_same_gradients_and_learns() -> None:
    torch = pytest.importorskip("torch")
    from refraxel.torch import camera_rays, parameters, render, trace

    model = scenes.model(scenes.ball())
    values = parameters(model, "raw_density", "sh", "index.0", "surface.0", "background", "absorption.0")
    origins, directions = (torch.tensor(a, dtype=torch.float32, requires_grad=True) for a in scenes.rays(300))
    d_colour, d_transmittance = (torch.tensor(a, dtype=torch.float32) for a in scenes.adjoints(300))
    colour, transmittance = render(model, origins, directions, values)
    ((colour * d_colour).sum() + (transmittance * d_transmittance).sum()).backward()
    expected = model.vjp(*(t.detach().numpy() for t in (origins, directions, d_colour, d_transmittance)))
    for name, leaf in {**values, "origins": origins, "directions": directions}.items():
        size = np.abs(expected[name]).max()
        np.testing.assert_allclose(leaf.grad.numpy(), expected[name], atol=1e-5 * size, err_msg=name)

    pose = torch.eye(4, dtype=torch.float64)
    pose[2, 3] = -3.0
    pose.requires_grad_(True)
    seen = render(model, *camera_rays(pose, torch.tensor([[0.02, 0.01, 1.0], [-0.1, 0.03, 1.0]])))[0]
    seen.sum().backward()
    assert torch.isfinite(pose.grad).all() and pose.grad[:3, 3].abs().max() > 0

    # The index is found from what rays show.
    true = render(model, origins.detach(), directions.detach())[0].detach()
    index = torch.tensor(1.2, requires_grad=True)
    optimiser = torch.optim.Adam([index], lr=0.02)
    for _ in range(40):
        optimiser.zero_grad()
        shown, _ = render(model, origins.detach(), directions.detach(), {"index.0": index})
        ((shown - true) ** 2).mean().backward()
        optimiser.step()
    assert float(index) == pytest.approx(1.3, abs=0.02)

    from refraxel import Medium

    start = torch.tensor([[-3.0, 0.2, 0.1]], dtype=torch.float64, requires_grad=True)
    way = torch.tensor([[1.0, 0.0, 0.0]], dtype=torch.float64, requires_grad=True)
    medium = Medium([scenes.ball()])
    assert torch.autograd.gradcheck(lambda o, d: trace(medium, o, d)[1], (start, way), eps=1e-6, atol=1e-5)
