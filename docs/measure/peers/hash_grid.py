"""A NeRF with a hash grid after instant-ngp (Müller et al. 2022), in plain PyTorch on the CPU. Rays are straight.

usage: hash_grid.py SCENE OUT CPU_SECONDS EVERY     trains on SCENE, renders each EVERY-th test view into OUT
"""

import json
import sys
import time
from pathlib import Path

import numpy as np
import torch
import torch.nn.functional as F
from scene import Budget, read_truth, read_views, training_rays, write_picture
from torch import nn

LEVELS, COARSEST, FINEST, TABLE, FEATURES = 6, 16, 128, 2**17, 2
SAMPLES = 128  # per ray, on the longest way through the box; those in empty cells are left out
CELLS = 32  # of the occupancy grid, per axis
BATCH = 2**15  # samples
RATE = 0.03  # of Adam at the start; a tenth of it at the end


class Interpolate(torch.autograd.Function):
    """Weighted sums of table rows: (N, 8) places and weights to (N, FEATURES). PyTorch's own gradient of it takes ten times as long."""

    @staticmethod
    def forward(ctx, table, place, weight):
        ctx.save_for_backward(place, weight)
        return F.embedding_bag(place, table, mode="sum", per_sample_weights=weight)

    @staticmethod
    def backward(ctx, d_sum):
        place, weight = ctx.saved_tensors
        d_table = torch.zeros(FEATURES, LEVELS * TABLE)
        for k in range(FEATURES):
            d_table[k].scatter_add_(0, place.flatten().long(), (weight * d_sum[:, k, None]).flatten())
        return d_table.t(), None, None


class Field(nn.Module):
    """Density and colour at points of the unit cube, from interpolated features and two small networks."""

    def __init__(self) -> None:
        super().__init__()
        growth = (FINEST / COARSEST) ** (1 / (LEVELS - 1))
        self.register_buffer("sizes", torch.tensor([int(COARSEST * growth**k) for k in range(LEVELS)]))
        # One table of TABLE entries per level.
        self.table = nn.Parameter((torch.rand(LEVELS * TABLE, FEATURES) - 0.5) * 2e-4)
        self.shape = nn.Sequential(nn.Linear(LEVELS * FEATURES, 64), nn.ReLU(), nn.Linear(64, 16))
        self.shade = nn.Sequential(nn.Linear(16 + 9, 64), nn.ReLU(), nn.Linear(64, 64), nn.ReLU(), nn.Linear(64, 3))
        # The factors of the spatial hash, as 32-bit integers.
        self.register_buffer("primes", torch.tensor([1, 2654435761 - 2**32, 805459861], dtype=torch.int32))
        self.register_buffer("starts", torch.arange(LEVELS, dtype=torch.int32)[:, None] * TABLE)

    def features(self, x: torch.Tensor) -> torch.Tensor:
        """(P, 3) in [0, 1] to (P, LEVELS * FEATURES)."""
        scaled = x[:, None] * (self.sizes[:, None] - 1)  # (P, LEVELS, 3)
        low = scaled.floor()
        ends = torch.stack([low.int(), low.int() + 1], -1) * self.primes[:, None]  # (P, LEVELS, 3, 2)
        hx, hy, hz = ends.unbind(2)
        place = (hx[..., :, None, None] ^ hy[..., None, :, None] ^ hz[..., None, None, :]).flatten(2)
        part = torch.stack([1 - (scaled - low), scaled - low], -1)
        wx, wy, wz = part.unbind(2)
        weight = wx[..., :, None, None] * wy[..., None, :, None] * wz[..., None, None, :]
        place = ((place & (TABLE - 1)) + self.starts).view(-1, 8)
        return Interpolate.apply(self.table, place, weight.view(-1, 8)).view(len(x), LEVELS * FEATURES)

    def density(self, x: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        """Density (P,) [1 / edge of the box] and what the shade is computed from (P, 16)."""
        hidden = self.shape(self.features(x))
        return torch.exp((hidden[:, 0] - 3).clamp(max=11)), hidden

    def forward(self, x: torch.Tensor, direction: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        """Density (P,) and colour (P, 3) at x, seen along `direction`."""
        density, hidden = self.density(x)
        return density, torch.sigmoid(self.shade(torch.cat([hidden, harmonics(direction)], -1)))


def harmonics(d: torch.Tensor) -> torch.Tensor:
    """Polynomials of degree 0 to 2 of unit directions (P, 3): (P, 9)."""
    x, y, z = d.unbind(-1)
    return torch.stack([torch.ones_like(x), x, y, z, x * y, y * z, x * z, x * x - y * y, 3 * z * z - 1], -1)


class Box:
    """The unit cube around the box of the scene, and which of its cells are not empty."""

    def __init__(self, bounds: list[list[float]]) -> None:
        low, high = (torch.tensor(b, dtype=torch.float32) for b in bounds)
        self.edge = float((high - low).max()) * 1.02
        self.low = (low + high) / 2 - self.edge / 2
        self.occupancy = torch.ones(CELLS**3)
        self.full = torch.ones(CELLS**3, dtype=torch.bool)

    def cell(self, x: torch.Tensor) -> torch.Tensor:
        i = (x * CELLS).long().clamp(0, CELLS - 1)
        return (i[..., 0] * CELLS + i[..., 1]) * CELLS + i[..., 2]

    @torch.no_grad()
    def look(self, field: Field) -> None:
        """Densities at a random point of each cell; a cell is full if a step through it would be seen."""
        cells = torch.arange(CELLS**3)
        i = torch.stack([cells // CELLS**2, cells // CELLS % CELLS, cells % CELLS], -1)
        density, _ = field.density((i + torch.rand(len(i), 3)) / CELLS)
        self.occupancy = torch.maximum(self.occupancy * 0.8, density)
        self.full = self.occupancy > min(0.01 / (3**0.5 / SAMPLES), float(self.occupancy.mean()))


def render(field: Field, box: Box, origins: torch.Tensor, directions: torch.Tensor, jitter: bool) -> tuple[torch.Tensor, int]:
    """Colours (M, 3) of rays over white, and the number of samples."""
    start = (origins - box.low) / box.edge
    inverse = 1 / directions
    t0, t1 = -start * inverse, (1 - start) * inverse
    near = torch.minimum(t0, t1).amax(-1).clamp(min=0)
    far = torch.maximum(t0, t1).amin(-1)
    step = 3**0.5 / SAMPLES
    offset = torch.rand(len(start), 1) if jitter else torch.full((len(start), 1), 0.5)
    t = near[:, None] + (torch.arange(SAMPLES) + offset) * step
    x = start[:, None] + t[..., None] * directions[:, None]
    used = (t < far[:, None]) & box.full[box.cell(x)]
    ray, _ = used.nonzero(as_tuple=True)
    density, colour = field(x[used].clamp(0, 1), directions[ray])
    depth = torch.zeros(t.shape).masked_scatter(used, density * step)
    passed = torch.exp(-(depth.cumsum(-1) - depth))
    weight = passed * (1 - torch.exp(-depth))
    seen = torch.zeros(len(start), 3).index_add(0, ray, weight[used][:, None] * colour)
    return seen + torch.exp(-depth.sum(-1, keepdim=True)), len(ray)


def train(field: Field, box: Box, folder: Path, budget: Budget) -> int:
    """Adam on squared errors of random pixels until the budget is used; the number of steps."""
    origins, directions, colours = (torch.from_numpy(a) for a in training_rays(folder))
    adam = torch.optim.Adam(field.parameters(), lr=RATE, eps=1e-15, betas=(0.9, 0.99))
    steps, rays = 0, 256
    while (used := budget.used) < 1:
        for group in adam.param_groups:
            group["lr"] = RATE * 0.1**used
        k = torch.randint(len(origins), (rays,))
        colour, samples = render(field, box, origins[k], directions[k], jitter=True)
        loss = F.mse_loss(colour, colours[k])
        adam.zero_grad()
        loss.backward()
        adam.step()
        steps += 1
        if steps % 16 == 0:
            box.look(field)
            rays = min(rays * BATCH // max(samples, 1), 8192)
    return steps


def main() -> None:
    folder, out = Path(sys.argv[1]), Path(sys.argv[2])
    budget, every = Budget(float(sys.argv[3])), int(sys.argv[4])
    torch.manual_seed(0)
    torch.set_num_threads(1)  # a second thread waits more than it works, and waiting is CPU time, too
    field, box = Field(), Box(read_truth(folder)["aabb"])
    steps = train(field, box, folder, budget)
    trained = time.process_time()
    for view in read_views(folder, "test", every):
        origins, directions = (torch.from_numpy(a) for a in view.rays())
        with torch.no_grad():
            parts = [render(field, box, o, d, jitter=False)[0] for o, d in zip(origins.split(8192), directions.split(8192), strict=True)]
        write_picture(out / view.name, np.asarray(torch.cat(parts)).reshape(view.colour.shape))
    print(json.dumps({"steps": steps, "train_cpu_s": trained, "render_cpu_s": time.process_time() - trained}))


if __name__ == "__main__":
    main()
