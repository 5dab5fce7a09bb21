"""Rendering as a function of JAX, differentiable by parameters and rays, also within ``jit``. Needs ``pip install jax``."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from ._refraxel import Model

__all__ = ["camera_rays", "parameters", "renderer"]

Arrays = Mapping[str, Any]


def parameters(model: Model, *names: str) -> dict[str, jax.Array]:
    """Parameters of a model as a dictionary of arrays, a pytree: those named, or all."""
    return {name: jnp.asarray(model.get(name)) for name in names or tuple(model.names)}


def camera_rays(world_from_camera: jax.Array, directions: jax.Array) -> tuple[jax.Array, jax.Array]:
    """Origins and directions in the world, each (..., 3), of a camera with the pose (4, 4) or (3, 4).

    ``directions`` (..., 3) are those of the camera's frame, ``camera.directions()``. Differentiable by the pose.
    """
    rotated = directions @ world_from_camera[:3, :3].T
    return jnp.broadcast_to(world_from_camera[:3, 3], rotated.shape), rotated


def renderer(model: Model) -> Callable[[Arrays, Any, Any], tuple[jax.Array, jax.Array]]:
    """The function ``render(values, origins, directions)`` of a model, which gives colour (..., 3) and transmittance (...).

    ``values``: parameters by name that the model takes over; those that are absent stay as they are in the model. ``origins``,
    ``directions``: (..., 3); directions need not be unit vectors. Gradients go to all three arguments. They are exact for the discrete
    march with its points held fixed. Single precision, on the CPU, by a callback; ``vmap`` is not supported: rays may have any
    number of axes.
    """

    def shapes(origins: Any) -> tuple[jax.ShapeDtypeStruct, jax.ShapeDtypeStruct]:
        before = origins.shape[:-1]
        return jax.ShapeDtypeStruct((*before, 3), jnp.float32), jax.ShapeDtypeStruct(before, jnp.float32)

    def take(values: Arrays) -> None:
        for name, value in values.items():
            model.set(name, np.asarray(value))

    def forward(values: Arrays, origins: Any, directions: Any) -> tuple[Any, Any]:
        take(values)
        return model.render(np.asarray(origins), np.asarray(directions))[:2]

    def backward(values: Arrays, origins: Any, directions: Any, d_colour: Any, d_transmittance: Any) -> tuple[Any, Any, Any]:
        take(values)
        rays = np.asarray(origins), np.asarray(directions)
        found = model.vjp(*rays, np.asarray(d_colour), np.asarray(d_transmittance))
        return {name: found[name] for name in values}, found["origins"], found["directions"]

    @jax.custom_vjp  # type: ignore[untyped-decorator,unused-ignore]
    def render(values: Arrays, origins: Any, directions: Any) -> Any:
        return jax.pure_callback(forward, shapes(origins), values, origins, directions)

    def render_forward(values: Arrays, origins: Any, directions: Any) -> Any:
        return render(values, origins, directions), (values, origins, directions)

    def render_backward(saved: Any, d: Any) -> Any:
        like = jax.tree.map(lambda a: jax.ShapeDtypeStruct(a.shape, jnp.float32), saved)
        found = jax.pure_callback(backward, like, *saved, *d)
        return jax.tree.map(lambda g, a: g.astype(a.dtype), found, saved)

    render.defvjp(render_forward, render_backward)
    return render  # type: ignore[no-any-return,unused-ignore]
