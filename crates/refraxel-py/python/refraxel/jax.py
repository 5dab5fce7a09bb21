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

    # What may have changed between a rendering and its gradients: each parameter, and the marching.
    changes = jax.ShapeDtypeStruct((len(model.names) + 1,), jnp.uint32)

    def arrays(values: Arrays) -> dict[str, Any]:
        return {name: np.asarray(value) for name, value in values.items()}

    def forward(values: Arrays, origins: Any, directions: Any) -> tuple[Any, Any, Any]:
        colour, transmittance, _, changes = model._render(np.asarray(origins), np.asarray(directions), arrays(values))
        return colour, transmittance, changes

    def backward(values: Arrays, origins: Any, directions: Any, changes: Any, *d: Any) -> tuple[Any, Any, Any]:
        d_colour, d_transmittance = (np.asarray(a) for a in d)
        rays = np.asarray(origins), np.asarray(directions)
        found = model._vjp(*rays, d_colour, d_transmittance, arrays(values), np.asarray(changes))
        return {name: found[name] for name in values}, found["origins"], found["directions"]

    def called(values: Arrays, origins: Any, directions: Any) -> Any:
        return jax.pure_callback(forward, (*shapes(origins), changes), values, origins, directions)

    @jax.custom_vjp  # type: ignore[untyped-decorator,unused-ignore]
    def render(values: Arrays, origins: Any, directions: Any) -> Any:
        return called(values, origins, directions)[:2]

    def render_forward(values: Arrays, origins: Any, directions: Any) -> Any:
        *shown, since = called(values, origins, directions)
        return tuple(shown), ((values, origins, directions), since)

    def render_backward(saved: Any, d: Any) -> Any:
        given, since = saved
        like = jax.tree.map(lambda a: jax.ShapeDtypeStruct(a.shape, jnp.float32), given)
        found = jax.pure_callback(backward, like, *given, since, *d)
        return jax.tree.map(lambda g, a: g.astype(a.dtype), found, given)

    render.defvjp(render_forward, render_backward)
    return render  # type: ignore[no-any-return,unused-ignore]
