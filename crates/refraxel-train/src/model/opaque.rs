//! The surface of what is opaque as a closed mesh.

use rayon::prelude::*;
use refraxel_core::grid::{BRICK_VOXELS, Border, GaussianKernel, trilinear};
use refraxel_core::radiance::quadrature;
use refraxel_core::segment::Segment;
use refraxel_core::sh::MAX_BASIS;
use refraxel_core::{Aabb, Domain, Extent, Mesh, Ray, Vec3, VoxelField, vec3};
use std::f64::consts::LN_2;

/// Standard deviation of the blur that takes the grain of a learned field out of its surface [voxel], and where it is cut off.
const BLUR: (f32, usize) = (0.6, 2);
/// Of a contracted grid, what lies farther from the centre than this is left out [half edge of the box]: voxels are four times as
/// long there, and few photographs say how far things are.
pub const MESH_REACH: f64 = 2.0;
/// Levels that are tried, from 1 to so many times this.
const LEVELS: (usize, f64) = (16, 0.05);
/// The level where no ray ends in anything opaque: about what trained scenes have.
pub const USUAL_LEVEL: f64 = 0.4;
/// Rays whose transmittance ends above this say nothing of a surface.
const LIT: f64 = 0.1;
/// Step along them [voxel], and the largest error that counts [step]: farther behind, a ray has missed its surface.
const STEP: (f32, usize) = (0.5, 8);
/// What a ray counts that passes through a hole of its surface [step].
const HOLE: usize = 32;
/// Nodes that a mesh may be drawn on: a gigabyte of signs.
const MOST_NODES: u64 = 1 << 30;

/// How opaque a field is, 1 − e^(−σ h) over the edge h of a voxel, on its nodes and a little smoothed.
pub struct Opacity {
    domain: Domain<f64>,
    /// One number per node, x fastest.
    values: Vec<f32>,
}

impl Opacity {
    /// That of a field; of a contracted one within [`MESH_REACH`].
    pub fn of(field: &VoxelField<f32>) -> Self {
        let domain = field.domain.cast::<f64>();
        let [nx, ny, _] = domain.resolution.map(|n| n as usize);
        let mut values = vec![0.0; domain.resolution.iter().map(|&n| n as usize).product()];
        for voxel in BRICK_VOXELS..field.map.voxels() {
            let node = field.map.node(voxel);
            if (0..3).all(|a| node[a] < domain.resolution[a]) {
                let [x, y, z] = node.map(|n| n as usize);
                values[x + nx * (y + ny * z)] = opacity(field, voxel, node);
            }
        }
        let mut grid = Self { domain, values };
        grid.blur();
        grid
    }

    /// Whether a mesh with so many cells per voxel fits into memory.
    pub fn fits(field: &VoxelField<f32>, detail: u32) -> bool {
        let nodes = field.domain.resolution.map(|n| u64::from(n + 2) * u64::from(detail));
        nodes.iter().try_fold(1, |product: u64, n| product.checked_mul(*n)).is_some_and(|n| n <= MOST_NODES)
    }

    /// The level whose boundary lies nearest to where half of the light of rays comes from, which are straight. Surfaces that have not
    /// learned to be sharp are less opaque per voxel than others.
    pub fn level(&self, field: &VoxelField<f32>, rays: &[Ray<f32>]) -> f64 {
        let errors = |ray: &Ray<f32>| self.errors(field, ray).unwrap_or([0; LEVELS.0]);
        let sum = |a: [usize; LEVELS.0], b: [usize; LEVELS.0]| std::array::from_fn(|k| a[k] + b[k]);
        let total = rays.par_iter().map(errors).reduce(|| [0; LEVELS.0], sum);
        let best = (0..LEVELS.0).min_by_key(|&k| total[k]).filter(|_| total != [0; LEVELS.0]);
        best.map_or(USUAL_LEVEL, |k| LEVELS.1 * (k + 1) as f64)
    }

    /// How far a ray meets the boundary of each level from where half of its light comes from [step]; `None` for a ray that ends in
    /// nothing opaque.
    fn errors(&self, field: &VoxelField<f32>, ray: &Ray<f32>) -> Option<[usize; LEVELS.0]> {
        let path = [Segment::straight(ray, &field.domain, 0.0)?];
        let basis = [0.0; MAX_BASIS];
        let (mut depth, mut half) = (0.0_f64, None);
        let mut first = [None; LEVELS.0];
        let points = quadrature(&field.domain, &path, STEP.0 * field.domain.voxel(), 0.5);
        for (k, point) in points.iter().enumerate() {
            let x = path[0].at(point.t);
            depth += field.at(x, &basis).map_or(0.0, |matter| f64::from(matter.density * point.dt));
            let crossed = (self.at(x.cast()) / LEVELS.1).clamp(0.0, LEVELS.0 as f64) as usize;
            first[..crossed].iter_mut().for_each(|first| *first = first.or(Some(k)));
            half = half.or((depth > LN_2).then_some(k));
            if half.is_some_and(|half| k > half + STEP.1) && depth > -LIT.ln() {
                break;
            }
        }
        let half = half.filter(|_| depth > -LIT.ln())?;
        let error = |first: Option<usize>| match first {
            Some(k) if k < half + STEP.1 => k.abs_diff(half).min(STEP.1),
            _ => HOLE,
        };
        Some(first.map(error))
    }

    /// The boundary of what is more opaque than `level` in (0, 1), in world coordinates, with `detail` ≥ 1 cells per voxel. It
    /// closes where the grid ends.
    pub fn mesh(&self, level: f64, detail: u32) -> Mesh {
        // In node coordinates cells are cubes in every grid; one more layer of nodes, of nothing, closes the mesh.
        let top = Vec3::from(self.domain.resolution.map(f64::from));
        let around = Domain {
            bounds: Aabb::new(Vec3::splat(-1.0), top),
            extent: Extent::Bounded,
            resolution: self.domain.resolution.map(|n| n + 2),
        };
        let mut mesh = Mesh::of_level(&around, detail, |g| {
            let (value, gradient) = self.sample(g);
            (level - value, -gradient)
        });
        for (x, normal) in mesh.vertices.iter_mut().zip(&mut mesh.normals) {
            let slope = self.slope(*x);
            *x = self.domain.position(*x);
            let outwards = self.domain.node_vjp(*x, -slope);
            if outwards.length() > 0.0 {
                *normal = outwards.normalized();
            }
        }
        mesh
    }

    /// Opacity at a world point; 0 outside the grid.
    pub fn at(&self, x: Vec3<f64>) -> f64 {
        self.sample(self.domain.node(x)).0
    }

    /// Opacity at node coordinates and its gradient, trilinear in a grid that continues with zeros.
    fn sample(&self, g: Vec3<f64>) -> (f64, Vec3<f64>) {
        let base = g.map(f64::floor);
        let first = base.to_array().map(|b| b as i64);
        let corners = std::array::from_fn(|k| self.node([0, 1, 2].map(|a| first[a] + (k as i64 >> a & 1))));
        let value = corners.iter().zip(trilinear::weights(g - base)).map(|(v, w)| v * w).sum();
        (value, trilinear::gradient(g - base, &corners))
    }

    /// The gradient over a whole voxel, for normals: that of [`Self::sample`] jumps between cells.
    fn slope(&self, g: Vec3<f64>) -> Vec3<f64> {
        let along = |e: Vec3<f64>| self.sample(g + e).0 - self.sample(g - e).0;
        vec3(along(vec3(0.5, 0.0, 0.0)), along(vec3(0.0, 0.5, 0.0)), along(vec3(0.0, 0.0, 0.5)))
    }

    fn node(&self, node: [i64; 3]) -> f64 {
        let n = self.domain.resolution.map(i64::from);
        let is_inside = (0..3).all(|a| (0..n[a]).contains(&node[a]));
        let at = node[0] + n[0] * (node[1] + n[1] * node[2]);
        if is_inside { f64::from(self.values[at as usize]) } else { 0.0 }
    }

    fn blur(&mut self) {
        let kernel = GaussianKernel::new(BLUR.0, BLUR.1, Border::Continued);
        let [nx, ny, _] = self.domain.resolution.map(|n| n as usize);
        self.values.par_chunks_mut(nx * ny).for_each(|plane| {
            kernel.along_rows(plane, nx);
            kernel.across_rows(plane, nx);
        });
        kernel.across_rows(&mut self.values, nx * ny);
    }
}

/// 1 − e^(−σ h) of a voxel, theory (3.5) and (3.9); h grows with the step outside the box of a contracted grid.
fn opacity(field: &VoxelField<f32>, voxel: usize, node: [u32; 3]) -> f32 {
    let domain = &field.domain;
    let x = domain.position(Vec3::from(node.map(|n| n as f32)));
    let growth = domain.growth(x);
    if f64::from(growth) > MESH_REACH {
        return 0.0;
    }
    -(-optical_depth(field, voxel) * growth).exp_m1()
}

/// σ h of a voxel [1], h being the edge of a voxel inside the box.
pub fn optical_depth(field: &VoxelField<f32>, voxel: usize) -> f32 {
    let density = field.density_scale() * refraxel_core::field::softplus(field.density[voxel]);
    density * field.domain.voxel()
}
