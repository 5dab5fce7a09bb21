// Where the grid lies in the world, theory (3.2) and (3.3).

const CONTRACTED: u32 = 1u;
const PROJECTIVE: u32 = 2u;

// A direction as (right, down, ahead) of a projective grid.
fn turned(v: vec3<f32>) -> vec3<f32> {
    return vec3<f32>(dot(scene.right, v), dot(scene.down, v), dot(scene.ahead, v));
}

// Normalised coordinates before contraction.
fn unit(x: vec3<f32>) -> vec3<f32> {
    if (scene.extent == PROJECTIVE) {
        let p = turned(x - scene.center);
        let middle = 0.5 * (scene.lowest.xy + scene.highest.xy);
        return vec3<f32>((p.xy / p.z - middle) * scene.unit_per_world.xy, 1.0 - scene.unit_per_world.z / p.z);
    }
    return (x - scene.center) * scene.unit_per_world;
}

fn max_element(v: vec3<f32>) -> f32 {
    return max(v.x, max(v.y, v.z));
}

// How fast normalised coordinates of a projective grid move along a line through x in direction v, times the squared depth: the
// same everywhere on it.
fn rate(x: vec3<f32>, v: vec3<f32>) -> vec3<f32> {
    let p = turned(x - scene.center);
    let w = turned(v);
    return vec3<f32>(w.xy * p.z - p.xy * w.z, w.z) * scene.unit_per_world;
}

// u (2/m − 1/m²) where m = ‖u‖∞ > 1 in a contracted domain.
fn contract(u: vec3<f32>) -> vec3<f32> {
    if (scene.extent != CONTRACTED) {
        return u;
    }
    let inverse = 1.0 / max(max_element(abs(u)), 1.0);
    return u * (inverse * (2.0 - inverse));
}

// Node coordinates of normalised ones, not below 0.
fn node_of_unit(u: vec3<f32>) -> vec3<f32> {
    return max((contract(u) + scene.reach) * scene.nodes_per_unit, vec3<f32>(0.0));
}

// Transpose of the derivative of the node coordinates: dLoss/dx from dLoss/dnode.
fn node_vjp(x: vec3<f32>, d_node: vec3<f32>) -> vec3<f32> {
    let d_u = d_node * scene.nodes_per_unit;
    if (scene.extent == PROJECTIVE) {
        let p = turned(x - scene.center);
        let d = d_u * scene.unit_per_world / p.z;
        return scene.right * d.x + scene.down * d.y + scene.ahead * ((d.z - d.x * p.x - d.y * p.y) / p.z);
    }
    let u = unit(x);
    let m = max_element(abs(u));
    if (scene.extent != CONTRACTED || m <= 1.0) {
        return d_u * scene.unit_per_world;
    }
    let inverse = 1.0 / m;
    var axis = vec3<f32>(0.0, 0.0, 1.0);
    if (abs(u.x) == m) {
        axis = vec3<f32>(1.0, 0.0, 0.0);
    } else if (abs(u.y) == m) {
        axis = vec3<f32>(0.0, 1.0, 0.0);
    }
    let slope = sign(dot(axis, u)) * 2.0 * inverse * inverse * (inverse - 1.0);
    return (d_u * (inverse * (2.0 - inverse)) + axis * (slope * dot(u, d_u))) * scene.unit_per_world;
}

// Factor by which steps grow at a point.
fn growth_at(x: vec3<f32>) -> f32 {
    return select(1.0, max(max_element(abs(unit(x))), 1.0), scene.extent == CONTRACTED);
}

// Bound on the nodes per unit of t that a point inside the box moves through, see `NodeMap::fastest` of the CPU backend.
fn fastest(momentum: vec3<f32>) -> f32 {
    let speed = abs(momentum) * scene.unit_per_world;
    if (scene.extent == CONTRACTED) {
        return max_element(scene.nodes_per_unit) * max_element(speed);
    }
    return max_element(speed * scene.nodes_per_unit);
}

// Bound on how much faster than inside the box a step can move through the nodes of a contracted grid.
fn stretch(growth: f32) -> f32 {
    return select(STRETCH, min(growth * STRETCH, STRETCH_MOST), growth > 1.0);
}

// Interval of t inside a slab; empty (1, 0) where a parallel ray passes beside it.
fn clip_axis(start: f32, momentum: f32, lowest: f32, highest: f32) -> vec2<f32> {
    if (momentum == 0.0) {
        return select(vec2<f32>(1.0, 0.0), vec2<f32>(0.0, FAR), start >= lowest && start <= highest);
    }
    let a = (lowest - start) / momentum;
    let b = (highest - start) / momentum;
    return vec2<f32>(min(a, b), max(a, b));
}

// Interval of t of a ray inside the grid from `near` on; empty where the first is not below the second.
fn clip(start: vec3<f32>, momentum: vec3<f32>, near: f32) -> vec2<f32> {
    if (scene.extent == PROJECTIVE) {
        return clip_frustum(turned(start - scene.center), turned(momentum), near);
    }
    let x = clip_axis(start.x, momentum.x, scene.lowest.x, scene.highest.x);
    let y = clip_axis(start.y, momentum.y, scene.lowest.y, scene.highest.y);
    let z = clip_axis(start.z, momentum.z, scene.lowest.z, scene.highest.z);
    let first = max(max(x.x, y.x), max(z.x, max(near, 0.0)));
    return vec2<f32>(first, min(x.y, min(y.y, z.y)));
}

// The same of a line in the frame of a projective grid.
fn clip_frustum(p: vec3<f32>, v: vec3<f32>, near: f32) -> vec2<f32> {
    let low = scene.lowest;
    let high = scene.highest;
    var range = vec2<f32>(max(near, 0.0), FAR);
    range = clip_plane(range, low.z - p.z, -v.z);
    range = clip_plane(range, p.z - high.z, v.z);
    range = clip_plane(range, low.x * p.z - p.x, low.x * v.z - v.x);
    range = clip_plane(range, p.x - high.x * p.z, v.x - high.x * v.z);
    range = clip_plane(range, low.y * p.z - p.y, low.y * v.z - v.y);
    return clip_plane(range, p.y - high.y * p.z, v.y - high.y * v.z);
}

// What of the t in a range is below a plane whose height over a line is height + t slope.
fn clip_plane(range: vec2<f32>, height: f32, slope: f32) -> vec2<f32> {
    if (slope < 0.0) {
        return vec2<f32>(max(range.x, -height / slope), range.y);
    }
    if (slope > 0.0) {
        return vec2<f32>(range.x, min(range.y, -height / slope));
    }
    return vec2<f32>(select(range.x, FAR, height > 0.0), range.y);
}
