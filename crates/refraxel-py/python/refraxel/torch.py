"""Rendering as a function of PyTorch, differentiable by parameters and rays. Needs ``pip install torch``."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import torch

from ._refraxel import Medium, Model

__all__ = ["camera_rays", "parameters", "render", "trace"]


def parameters(model: Model, *names: str) -> dict[str, torch.Tensor]:
    """Parameters of a model as leaves that require gradients: those named, or all."""
    chosen = names or tuple(model.names)
    return {name: torch.tensor(model.get(name), requires_grad=True) for name in chosen}


def camera_rays(world_from_camera: torch.Tensor, directions: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
    """Origins and directions in the world, each (..., 3), of a camera with the pose (4, 4) or (3, 4).

    ``directions`` (..., 3) are those of the camera's frame, ``torch.as_tensor(camera.directions())``. Differentiable by the pose.
    """
    rotated = directions.to(world_from_camera) @ world_from_camera[:3, :3].T
    return world_from_camera[:3, 3].expand_as(rotated), rotated


def render(
    model: Model,
    origins: torch.Tensor,
    directions: torch.Tensor,
    values: Mapping[str, torch.Tensor] | None = None,
) -> tuple[torch.Tensor, torch.Tensor]:
    """What rays show: colour (..., 3) and transmittance (...).

    ``origins``, ``directions``: (..., 3); directions need not be unit vectors. ``values``: parameters by name that the model takes
    over, such as ``{"raw_density": theta}``; those that are absent stay as they are in the model. Gradients go to the rays and to all
    ``values``. They are exact for the discrete march with its points held fixed. Computed on the CPU in single precision;
    tensors on other devices are copied there and back. Several threads may render one model. ``backward`` puts ``values`` back, and
    raises InputError if other parameters of the model, or its marching, have changed since.
    """
    named = dict(values or {})
    return _Render.apply(model, tuple(named), origins, directions, *named.values())  # type: ignore[no-any-return,unused-ignore]


def _numpy(tensor: torch.Tensor) -> np.ndarray[Any, Any]:
    return np.asarray(tensor.detach().to("cpu", torch.float32).numpy())


class _Render(torch.autograd.Function):  # type: ignore[misc,unused-ignore]
    @staticmethod
    def forward(ctx: Any, model: Model, names: tuple[str, ...], *tensors: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        origins, directions, *values = tensors
        ctx.model, ctx.names = model, names
        ctx.save_for_backward(*tensors)
        given = {name: _numpy(value) for name, value in zip(names, values, strict=True)}
        colour, transmittance, _, ctx.changes = model._render(_numpy(origins), _numpy(directions), given)
        return torch.from_numpy(colour).to(origins), torch.from_numpy(transmittance).to(origins)

    @staticmethod
    def backward(ctx: Any, d_colour: torch.Tensor, d_transmittance: torch.Tensor) -> tuple[Any, ...]:
        origins, directions, *values = ctx.saved_tensors
        # Another call may have given the model other values meanwhile.
        given = {name: _numpy(value) for name, value in zip(ctx.names, values, strict=True)}
        rays = _numpy(origins), _numpy(directions)
        found = ctx.model._vjp(*rays, _numpy(d_colour), _numpy(d_transmittance), given, ctx.changes)
        tensors = zip(("origins", "directions", *ctx.names), ctx.saved_tensors, strict=True)
        return (None, None, *(torch.as_tensor(found[name]).to(tensor) for name, tensor in tensors))


def trace(medium: Medium, origins: torch.Tensor, directions: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
    """Where rays leave a medium: positions and unit directions, each (..., 3), differentiable by the rays. Double precision."""
    return _Trace.apply(medium, origins, directions)  # type: ignore[no-any-return,unused-ignore]


class _Trace(torch.autograd.Function):  # type: ignore[misc,unused-ignore]
    @staticmethod
    def forward(ctx: Any, medium: Medium, origins: torch.Tensor, directions: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        ctx.like = origins
        ctx.paths = medium.trace(origins.detach().cpu().numpy(), directions.detach().cpu().numpy())
        return torch.from_numpy(ctx.paths.origins).to(origins), torch.from_numpy(ctx.paths.directions).to(origins)

    @staticmethod
    def backward(ctx: Any, d_origins: torch.Tensor, d_directions: torch.Tensor) -> tuple[Any, ...]:
        found = ctx.paths.vjp(d_origins.cpu().numpy(), d_directions.cpu().numpy())
        return None, torch.from_numpy(found["origins"]).to(ctx.like), torch.from_numpy(found["directions"]).to(ctx.like)
