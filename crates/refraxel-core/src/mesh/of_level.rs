//! From a function to the mesh of its zero level.

use super::triangles::Mesh;
use super::{relax, tetrahedra};
use crate::{Domain, Vec3};

impl Mesh {
    /// The boundary of the region where `sample(x).0` < 0, on the nodes of a box with `detail` ≥ 1 cells per voxel and axis.
    ///
    /// `sample` returns a function and its gradient, continuous inside the box and positive in the outermost cells. Empty
    /// if the function has one sign at all nodes.
    ///
    /// Error: vertices lie on the zero level to 1e-3 of a cell wherever the function is smooth over a cell, and normals are
    /// those of its gradient. Chords cut corners: a ball of radius R loses a share of its volume of about 0.125 (h/R)²,
    /// h being the edge of a cell. Parts thinner than a cell can be missed.
    ///
    /// Source: marching tetrahedra, Doi & Koide 1991. Dual methods (surface nets, dual contouring) are no alternative:
    /// their edges can belong to four triangles.
    ///
    /// ```
    /// use refraxel_core::{Aabb, Domain, Extent, Mesh, Vec3};
    /// let cube = Aabb::cube(1.0);
    /// let domain = Domain { bounds: cube, extent: Extent::Bounded, resolution: [33; 3] };
    /// let ball = Mesh::of_level(&domain, 1, |x: Vec3<f64>| (x.length() - 0.6, x.normalized()));
    /// assert!((ball.volume() / (4.0 / 3.0 * std::f64::consts::PI * 0.216) - 1.0).abs() < 0.004);
    /// assert_eq!((ball.bodies(), ball.open_edges()), (1, 0));
    /// ```
    ///
    /// # Panics
    /// If a node of a face of the box lies inside, or `detail` is 0.
    pub fn of_level(
        domain: &Domain<f64>,
        detail: u32,
        sample: impl Fn(Vec3<f64>) -> (f64, Vec3<f64>),
    ) -> Self {
        assert!(detail > 0, "at least one cell per voxel");
        let resolution = domain.resolution.map(|n| (n - 1) * detail + 1);
        let domain = Domain { resolution, ..*domain };
        let mut mesh = tetrahedra::march(&domain, &sample);
        relax::relax(&mut mesh, domain.voxel(), &sample);
        mesh.normals = mesh.vertices.iter().map(|&x| sample(x).1.normalized()).collect();
        mesh
    }
}
