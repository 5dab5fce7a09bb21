"""Paths of rays: closed forms, and gradients in double precision."""

import numpy as np
import pytest

import scenes
from refraxel import InputError, Medium, Model, Region, from_grid, grid_points, to_grid

BOUNDS = scenes.BOUNDS


def glass(index: float = 1.5, nodes: int = 41) -> Region:
    points = grid_points(BOUNDS, (nodes,) * 3)
    return Region.body(np.linalg.norm(points, axis=-1) - 0.7, BOUNDS, index=index)


def luneburg(nodes: int) -> Region:
    radius = np.linalg.norm(grid_points(BOUNDS, (nodes,) * 3), axis=-1) / 0.8
    return Region.graded(np.sqrt(2.0 - np.minimum(radius, 1.0) ** 2), BOUNDS, blurred=True)


def test_a_ball_bends_rays_as_snell_says() -> None:
    heights = np.linspace(0.05, 0.6, 12)
    origins = np.stack([np.full(12, -3.0), heights, np.zeros(12)], axis=-1)
    paths = Medium([glass()]).trace(origins, np.tile([1.0, 0.0, 0.0], (12, 1)))
    expected = -2 * (np.arcsin(heights / 0.7) - np.arcsin(heights / (1.5 * 0.7)))
    np.testing.assert_allclose(np.arcsin(paths.directions[:, 1]), expected, atol=2e-4)
    assert paths.escaped.all() and (paths.events == 2).all()
    assert paths.points(0).shape == (4, 3)


def test_a_luneburg_lens_focuses_parallel_rays_on_its_rim() -> None:
    heights = np.linspace(-0.5, 0.5, 11)
    origins = np.stack([np.full(11, -2.0), heights, np.zeros(11)], axis=-1)
    medium = Medium([luneburg(81)])
    paths = medium.trace(origins, np.tile([1.0, 0.0, 0.0], (11, 1)), step=0.25)
    # Behind the lens rays are straight: where they pass the plane of the focus x = 0.8.
    at = paths.origins + paths.directions * ((0.8 - paths.origins[:, :1]) / paths.directions[:, :1])
    assert np.abs(at[:, 1:]).max() < 4e-3
    assert medium.index([0.0, 0.0, 0.0]) == pytest.approx(np.sqrt(2.0), abs=2e-3)


@pytest.mark.parametrize("region", [glass(1.4), scenes.lens(41)], ids=["ball", "lens"])
def test_gradients_of_exit_rays_match_central_differences(region: Region) -> None:
    medium = Medium([region])
    random = np.random.default_rng(2)
    origins = np.concatenate([np.full((20, 1), -3.0), random.uniform(-0.3, 0.3, size=(20, 2))], axis=1)
    directions = np.tile([1.0, 0.02, -0.01], (20, 1))
    # Directions leave; positions are those at the end of the box.
    weights = random.normal(size=(20, 3))
    gradient = medium.trace(origins, directions, step=0.05).vjp(d_directions=weights)

    def total(shift: np.ndarray, turn: np.ndarray) -> float:
        paths = medium.trace(origins + shift, directions + turn, step=0.05)
        return float(np.sum(paths.directions * weights))

    along, eps = random.normal(size=(20, 3)), 1e-5
    nothing = np.zeros((20, 3))
    by_origin = (total(eps * along, nothing) - total(-eps * along, nothing)) / (2 * eps)
    by_direction = (total(nothing, eps * along) - total(nothing, -eps * along)) / (2 * eps)
    assert np.sum(gradient["origins"] * along) == pytest.approx(by_origin, rel=5e-3, abs=2e-3)
    assert np.sum(gradient["directions"] * along) == pytest.approx(by_direction, rel=5e-3, abs=5e-3)


def test_the_gradient_by_the_index_is_that_of_snells_law() -> None:
    origins, directions = [[-3.0, 0.35, 0.0]], [[1.0, 0.0, 0.0]]
    gradient = Medium([glass(1.5)]).trace(origins, directions).vjp(d_directions=[[0.0, 1.0, 0.0]])
    b, r, n = 0.35, 0.7, 1.5
    angle = 2 * (np.arcsin(b / r) - np.arcsin(b / (n * r)))
    expected = -np.cos(angle) * 2 * b / (n**2 * r * np.sqrt(1 - (b / (n * r)) ** 2))
    assert gradient["index.0"] == pytest.approx(expected, rel=1e-3)
    assert gradient["surface.0"].shape == (41, 41, 41)


def test_long_and_short_directions_are_directions() -> None:
    medium, origins = Medium([glass()]), np.array([[-3.0, 0.3, 0.0]])
    expected = medium.trace(origins, [[1.0, 0.02, 0.0]])
    for length in [1e30, 1e200, 1e-200]:
        found = medium.trace(origins, length * np.array([[1.0, 0.02, 0.0]]))
        np.testing.assert_allclose(found.directions, expected.directions, atol=1e-12)


@pytest.mark.parametrize("corners", [(-1e300, 1e300), (1.0, 1.0 + 1e-9), (1.0, -1.0), (1e8, 1e8 + 1.0)])
def test_boxes_without_a_place_in_single_precision_are_refused(corners: tuple[float, float]) -> None:
    bounds = [[corners[0]] * 3, [corners[1]] * 3]
    with pytest.raises(InputError, match="bounds from"):
        Model.from_arrays(np.ones((5, 5, 5)), np.ones((5, 5, 5, 3)), bounds)
    with pytest.raises(InputError, match="bounds from"):
        Region.graded(np.ones((9, 9, 9)), bounds)


def test_grids_of_another_shape_are_refused() -> None:
    model = scenes.model(None)
    with pytest.raises(InputError, match=r"grid has the shape \(22, 21, 21\)"):
        from_grid(model, np.zeros((22, 21, 21)))
    with pytest.raises(InputError, match="values have the shape"):
        to_grid(model, np.zeros(3))
    with pytest.raises(InputError, match=r"expected \(2, 3\)"):
        grid_points((-1.0, 1.0), (3, 3, 3))
    with pytest.raises(InputError, match="three numbers"):
        grid_points(BOUNDS, (3, 3, 1))


def test_what_cannot_be_traced_is_refused() -> None:
    with pytest.raises(InputError, match="border"):
        Region.body(-np.ones((9, 9, 9)), BOUNDS)
    with pytest.raises(InputError, match="index"):
        Region.body(scenes.grid_points(BOUNDS, (9, 9, 9))[..., 0] ** 2 + 1.0, BOUNDS, index=1e300)
    with pytest.raises(InputError, match="max_segments is 0"):
        Medium([glass()]).trace([[0.0, 0.0, 0.0]], [[1.0, 0.0, 0.0]], max_segments=0)
    with pytest.raises(InputError, match="at least 7 nodes"):
        Region.graded(np.ones((5, 5, 5)), BOUNDS)
    with pytest.raises(InputError, match="overlap"):
        Medium([scenes.lens(), scenes.lens()])
    with pytest.raises(InputError, match="without regions"):
        Medium([]).trace([[0.0, 0.0, 0.0]], [[1.0, 0.0, 0.0]])
    with pytest.raises(InputError, match="leapfrog"):
        Medium([glass()]).trace([[0.0, 0.0, 0.0]], [[1.0, 0.0, 0.0]], integrator="runge_kutta")
