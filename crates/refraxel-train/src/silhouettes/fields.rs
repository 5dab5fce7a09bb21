//! Index grids to start from.
//!
//! Every field gives the n of its nodes as control values: the grid's coefficients are n²/2 at the nodes, see
//! [`IndexGrid::from_control_values`]. Nodes of the border stay at n = 1.

use super::region::{Spacing, region_grid};
use rayon::prelude::*;
use refraxel_core::{Aabb, Domain, Extent, IndexGrid, Interpolation, LevelSet, Vec3, vec3};
use refraxel_data::IndexVolume;
use refraxel_data::synth::{IndexTruth, Shape};

/// Where an index grid lies and how it is interpolated; bounds and resolution as from [`region_grid`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Site {
    /// The grid's box, its border of vacuum included.
    pub bounds: Aabb<f32>,
    /// Nodes per axis.
    pub resolution: [u32; 3],
    /// Between the nodes.
    pub interpolation: Interpolation,
}

/// Samples per axis and voxel of shapes with a sharp surface. Even: no sample lies on a face that runs through nodes.
const SAMPLES: usize = 4;
/// Samples per axis and voxel of the truth, which can be slow to evaluate.
const TRUTH_SAMPLES: usize = 2;
/// Distances up to this many voxels are computed; the others follow from them.
const EXACT: u8 = 4;

impl Site {
    /// The grid around a box, as [`region_grid`] lays it.
    pub fn around(bounds: &Aabb<f32>, spacing: Spacing, interpolation: Interpolation) -> Self {
        let (bounds, resolution) = region_grid(bounds, spacing);
        Self { bounds, resolution, interpolation }
    }

    /// The nodes of the grid.
    pub fn domain(&self) -> Domain<f32> {
        Domain { bounds: self.bounds, extent: Extent::Bounded, resolution: self.resolution }
    }

    /// n = 1 everywhere.
    ///
    /// # Panics
    /// As all of the following: if the resolution has less than 7 nodes on an axis.
    pub fn vacuum(&self) -> IndexGrid<f32> {
        IndexGrid::vacuum(self.bounds, self.resolution, self.interpolation)
    }

    /// n > 0 of each node, x fastest.
    ///
    /// # Panics
    /// If there is not one value per node.
    pub fn of_nodes(&self, n: &[f32]) -> IndexGrid<f32> {
        let mut grid = self.vacuum();
        assert_eq!(n.len(), grid.coefficients().len(), "one index per node");
        let parameters: Vec<usize> = grid.parameters().collect();
        let coefficients = grid.coefficients_mut();
        parameters.into_iter().for_each(|node| coefficients[node] = 0.5 * n[node] * n[node]);
        grid.find_flat_cells(None);
        grid
    }

    /// n = 1 + (n0 − 1) f of each node, f = 0..=1 the share of its voxel that is object.
    ///
    /// # Panics
    /// If there is not one share per node.
    pub fn of_occupancy(&self, occupancy: &[f32], n0: f32) -> IndexGrid<f32> {
        let n: Vec<f32> = occupancy.iter().map(|f| 1.0 + (n0 - 1.0) * f).collect();
        self.of_nodes(&n)
    }

    /// The truth, averaged over the voxel of each node (2³ samples).
    pub fn truth(&self, truth: &IndexTruth) -> IndexGrid<f32> {
        self.of_nodes(&self.means(TRUTH_SAMPLES, |x| truth.n(x.cast()) as f32))
    }

    /// A volume of measured or simulated n, trilinear between the centres of its cells; n = 1 outside its box.
    pub fn volume(&self, volume: &IndexVolume) -> IndexGrid<f32> {
        self.of_nodes(&self.means(1, |x| volume.index(x.cast()) as f32))
    }

    /// n0 inside of a closed shape, 1 outside, averaged over voxels (4³ samples). Inside is where a line has crossed the
    /// surface an odd number of times, whichever way its triangles are turned.
    pub fn shape(&self, shape: &Shape, n0: f32) -> IndexGrid<f32> {
        self.of_occupancy(&super::inside::occupancy(shape, &self.domain(), SAMPLES), n0)
    }

    /// The level set of a closed shape by its exact distances; `rough` says where its surface is, to four voxels. Keeps
    /// the surface of a mesh to a hundredth of a voxel where it is smooth; creases are rounded as splines have to.
    pub fn distance(&self, shape: &Shape, rough: &LevelSet<f32>) -> LevelSet<f32> {
        let (domain, inside) = (self.domain(), super::inside::occupancy(shape, &self.domain(), 1));
        let reach = f32::from(EXACT) * domain.voxel();
        let value = |node: usize| {
            let x = rough.position(node);
            let is_near = rough.clearance(x).is_some_and(|c| c <= EXACT);
            let distance = if is_near { (shape.surface(x.cast()).0.abs() as f32).min(reach) } else { reach };
            if inside[node] > 0.5 { -distance } else { distance }
        };
        let values: Vec<f32> = (0..inside.len()).into_par_iter().map(value).collect();
        let n = self.resolution.map(|n| n as usize);
        let mut level = LevelSet::from_samples(self.bounds, self.resolution, |x| {
            let at = domain.node(x).map(|g| g.round() as usize);
            values[at.x + n[0] * (at.y + n[1] * at.z)]
        });
        level.redistance();
        level
    }

    /// Mean of `samples`³ values over the voxel of each node.
    fn means(&self, samples: usize, value: impl Fn(Vec3<f32>) -> f32 + Sync) -> Vec<f32> {
        let (domain, n) = (self.domain(), self.resolution.map(|n| n as usize));
        let offset = |k: usize| (k as f32 + 0.5) / samples as f32 - 0.5;
        let total = samples.pow(3);
        let mean = |node: usize| {
            let at = domain.coordinates(node);
            let sum: f32 = (0..total)
                .map(|k| {
                    vec3(offset(k % samples), offset(k / samples % samples), offset(k / samples / samples))
                })
                .map(|o| value(domain.position(at + o)))
                .sum();
            sum / total as f32
        };
        (0..n[0] * n[1] * n[2]).into_par_iter().map(mean).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use refraxel_data::synth::TriangleMesh;
    use serde_json::json;

    const BOX: Aabb<f32> = Aabb { min: vec3(-0.5, -0.4, -0.3), max: vec3(0.5, 0.4, 0.3) };

    fn site() -> Site {
        Site::around(&BOX, Spacing::Voxel(0.025), Interpolation::CubicBSpline)
    }

    /// ∫ (n − 1) dV over the grid.
    fn content(grid: &IndexGrid<f32>) -> f64 {
        let v = f64::from(grid.voxel()).powi(3);
        (0..grid.coefficients().len())
            .map(|i| f64::from((2.0 * grid.coefficients()[i]).sqrt() - 1.0) * v)
            .sum()
    }

    #[test]
    fn nodes_are_control_values() {
        let n = |x: Vec3<f32>| 1.0 + 0.3 * (-x.dot(x) * 20.0).exp();
        let s = site();
        let expected = IndexGrid::from_control_values(s.bounds, s.resolution, s.interpolation, n);
        let found = s.of_nodes(&s.means(1, n));
        let pairs = found.coefficients().iter().zip(expected.coefficients());
        assert!(pairs.into_iter().all(|(a, b)| (a - b).abs() < 1e-5));
        assert_eq!(s.vacuum().index(Vec3::zero()), 1.0);
    }

    #[test]
    fn the_truth_of_a_ball_is_the_ball() {
        let json = json!({ "refractive": [{ "shape": "sphere", "center": [0.0, 0.0, 0.0], "radius": 0.3, "ior": 1.5 }] });
        let truth = IndexTruth::from_scene_json(&json).unwrap();
        let volume = 4.0 / 3.0 * std::f64::consts::PI * 0.027;
        let grid = site().truth(&truth);
        assert!((content(&grid) / (0.5 * volume) - 1.0).abs() < 0.005);
        assert!((grid.index(vec3(0.1, 0.0, 0.1)) - 1.5).abs() < 1e-6);
    }

    #[test]
    fn a_mesh_fills_its_inside_whichever_way_it_is_turned() {
        let corner = |k: u32| Vec3::from([k & 1, k >> 1 & 1, k >> 2].map(|b| f64::from(b) * 0.4 - 0.2));
        let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let triangles = quads.iter().flat_map(|q| [[q[0], q[1], q[2]], [q[0], q[2], q[3]]]);
        let inside_out = triangles.clone().map(|[a, b, c]| [c, b, a]).collect();
        let expected = 0.5 * 0.4_f64.powi(3);
        for triangles in [triangles.collect(), inside_out] {
            let mesh = TriangleMesh::new((0..8).map(corner).collect(), triangles).unwrap();
            let grid = site().shape(&Shape::Mesh(mesh), 1.5);
            assert!((content(&grid) / expected - 1.0).abs() < 0.03);
            assert!((grid.index(Vec3::zero()) - 1.5).abs() < 1e-6 && grid.index(vec3(0.0, 0.0, 0.28)) == 1.0);
        }
    }

    #[test]
    fn the_level_set_of_a_mesh_keeps_its_surface() {
        use refraxel_core::Mesh;
        let (s, radius) = (site(), 0.21);
        let sphere = |x: Vec3<f64>| (x.length() - radius, x.normalized());
        let mesh = Mesh::of_level(&s.domain().cast(), 3, sphere);
        let shape = Shape::Mesh(TriangleMesh::new(mesh.vertices, mesh.triangles).unwrap());
        // No distance, but it has its surface nearby.
        let rough = |x: Vec3<f32>| (40.0 * (x.length() - 0.2)).tanh();
        let rough = LevelSet::from_samples(s.bounds, s.resolution, rough);
        let level = s.distance(&shape, &rough).cast::<f64>();
        for k in 0..200 {
            let t = f64::from(k);
            let x = vec3((t * 0.71).sin(), (t * 1.3).cos(), (t * 0.37).sin()).normalized() * radius;
            let (off, gradient) = level.sample(x);
            assert!(off.abs() < 0.015 * level.voxel(), "{} voxels", off / level.voxel());
            assert!((gradient.length() - 1.0).abs() < 0.03, "{}", gradient.length());
        }
    }

    #[test]
    fn a_volume_is_read_between_its_cells_and_is_vacuum_outside() {
        let cells = [8, 10, 12];
        let bounds = Aabb::new(vec3(-0.4, -0.3, -0.2), vec3(0.4, 0.3, 0.2));
        let at = |i: usize, a: usize| (i as f64 + 0.5) / cells[a] as f64;
        let n = |k: usize| 1.2 + 0.1 * at(k / 120, 0) + 0.2 * at(k / 12 % 10, 1) - 0.1 * at(k % 12, 2);
        let volume = IndexVolume::new(bounds, cells, (0..960).map(|k| n(k) as f32).collect()).unwrap();
        let grid = site().volume(&volume);
        // Trilinear interpolation and B-spline control values both keep what is linear (w is nearly so).
        assert!(
            (grid.index(vec3(0.1, 0.06, 0.04)) - (1.2 + 0.1 * 0.625 + 0.2 * 0.6 - 0.1 * 0.6)).abs() < 1e-3
        );
        assert_eq!(grid.index(vec3(0.5, 0.0, 0.0)), 1.0);
    }
}
