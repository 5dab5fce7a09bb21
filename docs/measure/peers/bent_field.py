"""A radiance field on voxels in Mitsuba 3 and Dr.Jit, after Mitsuba's tutorial on radiance fields, with rays that bend at the true shapes
of the refractive bodies. The shapes are told; the index of refraction is learned, by a search and then by its gradient.

usage: bent_field.py SCENE OUT CPU_SECONDS EVERY [straight]     trains on SCENE, renders each EVERY-th test view into OUT
"""

import json
import sys
import time
from pathlib import Path

import drjit as dr
import mitsuba as mi
import numpy as np
from scene import Budget, read_truth, read_views, training_rays, write_picture
from scipy.ndimage import zoom

mi.set_variant("llvm_ad_rgb")
from mitsuba import Float, Point3f, Ray3f, TensorXf, UInt32, Vector3f  # noqa: E402 (known once a variant is set)

STAGES = ((0.0, 32), (0.3, 64), (0.6, 96))  # from which part of the budget, nodes along the longest edge
EVENTS = 4  # surfaces that a path meets at most; total internal reflections count
SAMPLES, MIRRORED = 96, 32  # along a path, along the first mirrored ray
BATCH = 4096  # rays
RATE = 0.2  # of Adam at the start; a tenth of it at the end
SEARCH = (0.3, np.arange(1.05, 1.85, 0.05))  # when rays begin to bend, and the indices that are tried
Rays = tuple[Point3f, Vector3f]


class Field:
    """Raw density and the colour's coefficients of degree 0 and 1 at nodes (Z, Y, X, 13) of the box of a scene."""

    def __init__(self, truth: dict, bodies: list[dict]) -> None:
        self.low, self.high = (np.asarray(b, np.float64) for b in truth["aabb"])
        self.bodies = mi.load_dict({"type": "scene", **{f"body{k}": body(b) for k, b in enumerate(bodies)}})
        self.adam = mi.ad.Adam(lr=RATE, mask_updates=True)
        nodes = np.zeros((*self.shape(STAGES[0][1]), 13), np.float32)
        nodes[..., 0] = -4.0  # nearly empty
        self.adam["nodes"], self.adam["index"] = TensorXf(nodes), Float(1.3)
        self.texture = mi.Texture3f(self.adam["nodes"], wrap_mode=dr.WrapMode.Clamp)
        self.bends = False

    def shape(self, longest: int) -> tuple[int, ...]:
        edges = (self.high - self.low)[::-1]
        return tuple(int(round(longest * e / edges.max())) for e in edges)

    def refine(self, longest: int) -> None:
        nodes = self.adam["nodes"].numpy()
        factors = [a / b for a, b in zip(self.shape(longest), nodes.shape[:3], strict=True)]
        self.adam["nodes"] = TensorXf(zoom(nodes, (*factors, 1), order=1))

    def exit(self, o: Point3f, d: Vector3f) -> tuple[Float, Float]:
        """Where a ray enters and leaves the box; equal where it misses."""
        a, b = (Point3f(self.low) - o) / d, (Point3f(self.high) - o) / d
        near = dr.maximum(dr.max(dr.minimum(a, b)), 0)
        return near, dr.maximum(dr.min(dr.maximum(a, b)), near)

    def at(self, x: Point3f, d: Vector3f) -> tuple[Float, Vector3f]:
        """Density [1 / scene unit] and radiance at x, seen along d."""
        unit = (x - Point3f(self.low)) / Vector3f(self.high - self.low)
        v = self.texture.eval(unit)
        inside = dr.all((unit >= 0) & (unit <= 1))
        density = dr.select(inside, 10 * dr.log(1 + dr.exp(v[0])), 0)
        colour = Vector3f(*(v[1 + 4 * c] + v[2 + 4 * c] * d.x + v[3 + 4 * c] * d.y + v[4 + 4 * c] * d.z for c in range(3)))
        return density, dr.maximum(colour + 0.5, 0)


def body(truth: dict) -> dict:
    """A body of scene.json as a shape of Mitsuba."""
    to_world = mi.ScalarTransform4f()
    if truth["shape"] == "sphere":
        return {"type": "sphere", "center": truth["center"], "radius": truth["radius"]}
    low, high = np.asarray(truth["min"]), np.asarray(truth["max"])
    return {"type": "cube", "to_world": to_world.translate((low + high) / 2).scale((high - low) / 2)}


def path(field: Field, o: Point3f, d: Vector3f, index: Float) -> tuple[list[tuple[Point3f, Vector3f, Float]], Rays, Float]:
    """The segments (origin, direction, length) of rays through the bodies, the ray that the first surface mirrors, and its reflectance."""
    segments, mirrored, reflectance = [], (o, d), Float(0)
    alive = dr.full(mi.Bool, True, dr.width(o))
    for event in range(EVENTS + 1):
        _, end = field.exit(o, d)
        if event == EVENTS or not field.bends:
            segments.append((o, d, dr.select(alive, end, 0)))
            break
        hit = field.bodies.ray_intersect(Ray3f(o, d), alive)
        meets = hit.is_valid() & (hit.t < end) & alive
        segments.append((o, d, dr.select(alive, dr.select(meets, hit.t, end), 0)))
        share, cos_t, _, eta_ti = mi.fresnel(dr.dot(-d, hit.n), index)
        bounced = mi.reflect(-d, Vector3f(hit.n))
        through = mi.refract(-d, Vector3f(hit.n), cos_t, eta_ti)
        if event == 0:
            mirrored, reflectance = (hit.spawn_ray(dr.detach(bounced)).o, dr.detach(bounced)), dr.select(meets, dr.detach(share), 0)
        onward = dr.normalize(dr.select(share >= 1, bounced, through))
        after = hit.spawn_ray(onward)
        o, d, alive = dr.select(meets, after.o, o), dr.select(meets, onward, d), meets
    return segments, mirrored, reflectance


def march(field: Field, segments: list, samples: int, offset: Float) -> tuple[Vector3f, Float, Float]:
    """Light along a broken line before its first corner and behind it, and the share that passes up to the corner."""
    near, _ = field.exit(segments[0][0], segments[0][1])
    near = dr.detach(dr.minimum(near, segments[0][2]))
    ends = [segments[0][2]]
    for _, _, length in segments[1:]:
        ends.append(ends[-1] + length)
    k = dr.arange(UInt32, dr.width(near) * samples)
    ray = k // samples
    wide = lambda value: dr.gather(type(value), value, ray)  # noqa: E731
    step = wide((ends[-1] - near) / samples)
    s = wide(near) + (Float(k % samples) + offset) * step
    x, d = wide(segments[0][0]) + s * wide(segments[0][1]), wide(segments[0][1])
    for start, (origin, direction, _) in zip(ends, segments[1:], strict=False):
        behind = s >= wide(start)
        turned = wide(direction)
        x = dr.select(behind, wide(origin) + (s - wide(start)) * turned, x)
        d = dr.select(behind, turned, d)
    density, colour = field.at(x, d)
    depth = density * step
    passed = dr.exp(-dr.block_prefix_sum(depth, samples))
    light = passed * (1 - dr.exp(-depth)) * colour
    first = s < wide(ends[0])
    before = Vector3f(*(dr.block_sum(dr.select(first, c, 0), samples) for c in light))
    behind = Vector3f(*(dr.block_sum(dr.select(first, 0, c), samples) for c in light))
    corner = dr.exp(-dr.block_sum(dr.select(first, depth, 0), samples))
    return before, behind + dr.exp(-dr.block_sum(depth, samples)), corner


def render(field: Field, o: Point3f, d: Vector3f, index: Float, seed: int | None) -> Vector3f:
    """sRGB colours of rays over white, by a power of 1 / 2.2; linear light is mixed."""
    jitter = lambda n: 0.5 if seed is None else mi.PCG32(size=n, initstate=seed).next_float32()  # noqa: E731
    segments, mirrored, reflectance = path(field, o, d, index)
    before, behind, corner = march(field, segments, SAMPLES, jitter(dr.width(o) * SAMPLES))
    light = before + behind
    which = dr.compress(reflectance > 0.001) if field.bends else UInt32()
    if dr.width(which) > 0:
        o1, d1 = (dr.gather(type(v), v, which) for v in mirrored)
        _, end = field.exit(o1, d1)
        one, two, _ = march(field, [(o1, d1, end)], MIRRORED, jitter(dr.width(which) * MIRRORED))
        change = dr.gather(Float, reflectance, which) * (dr.gather(Float, corner, which) * (one + two) - dr.gather(Vector3f, behind, which))
        added = dr.zeros(Vector3f, dr.width(o))
        dr.scatter_add(added, change, which)
        light += added
    return dr.power(dr.maximum(light, 1e-4), 1 / 2.2)


def rays(arrays: tuple, k: np.ndarray) -> list:
    return [kind(np.ascontiguousarray(a[k].T)) for kind, a in zip((Point3f, Vector3f, Vector3f), arrays, strict=False)]


def search(field: Field, arrays: tuple, meeting: np.ndarray, random: np.random.Generator) -> float:
    """The index with the least error on rays that meet a body."""
    o, d, truth = rays(arrays, random.choice(meeting, min(BATCH, len(meeting)), replace=False))
    errors = [dr.mean(dr.squared_norm(render(field, o, d, Float(n), 1) - truth))[0] for n in SEARCH[1]]
    return float(SEARCH[1][int(np.argmin(errors))])


def train(field: Field, folder: Path, budget: Budget) -> int:
    """Adam on squared errors until the budget is used; the number of steps. Rays that meet a body wait until they may bend."""
    arrays = training_rays(folder)
    random = np.random.default_rng(0)
    o, d, _ = rays(arrays, np.arange(len(arrays[0])))
    meets = field.bodies.ray_test(Ray3f(o, d)).numpy()
    pixels, meeting = np.flatnonzero(~meets), np.flatnonzero(meets)
    waiting, steps = list(STAGES[1:]), 0
    while (used := budget.used) < 1:
        if waiting and used >= waiting[0][0]:
            field.refine(waiting.pop(0)[1])
        if len(meeting) and not field.bends and used >= SEARCH[0]:
            field.bends = True
            field.adam["index"] = Float(search(field, arrays, meeting, random))
            pixels = np.arange(len(meets))
        field.adam.set_learning_rate({"nodes": RATE * 0.1**used, "index": 0.003 * 0.1**used})
        field.texture.set_tensor(field.adam["nodes"])
        o, d, truth = rays(arrays, random.choice(pixels, BATCH))
        loss = dr.mean(dr.squared_norm(render(field, o, d, field.adam["index"], steps) - truth))
        dr.backward(loss)
        field.adam.step()
        steps += 1
    field.texture.set_tensor(field.adam["nodes"])
    return steps


def main() -> None:
    folder, out = Path(sys.argv[1]), Path(sys.argv[2])
    budget, every = Budget(float(sys.argv[3])), int(sys.argv[4])
    dr.set_thread_count(1)
    truth = read_truth(folder)
    field = Field(truth, [] if "straight" in sys.argv[5:] else truth["refractive"])
    steps = train(field, folder, budget)
    trained = time.process_time()
    index = dr.detach(field.adam["index"])
    for view in read_views(folder, "test", every):
        colour = np.zeros(view.colour.shape)
        for dx, dy in ((0.25, 0.25), (0.25, 0.75), (0.75, 0.25), (0.75, 0.75)):
            o, d = rays(view.rays(dx, dy), slice(None))
            colour += np.clip(render(field, o, d, index, None).numpy().T.reshape(colour.shape), 0, 1) / 4
        write_picture(out / view.name, colour)
    told = {"index": index[0]} if field.bends else {}
    print(json.dumps({"steps": steps, "train_cpu_s": trained, "render_cpu_s": time.process_time() - trained, **told}))


if __name__ == "__main__":
    main()
