//! The surfaces of what is refractive as closed meshes.

use super::index_edit::{half_way_index, typical_index};
use refraxel_core::{IndexGrid, Mesh};

/// The boundary of one region.
#[derive(Clone, Debug)]
pub struct Surface {
    /// The boundary in world coordinates; without triangles where nothing in the region refracts.
    pub mesh: Mesh,
    /// The index of what lies inside: [`typical_index`], or 1 for a body of vacuum, a bubble.
    pub index: f32,
    /// What lies inside absorbs this much of red, green and blue [1 / scene unit].
    pub absorption: [f32; 3],
    /// Where it was drawn.
    pub boundary: Boundary,
}

/// Where a region ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Boundary {
    /// Where the index jumps, theory (2.22).
    Jump,
    /// Half-way in n between vacuum and the [`typical_index`] of a field without a surface.
    HalfWay,
}

/// Nodes that a mesh may be drawn on: a gigabyte of signs.
const MOST_NODES: u64 = 1 << 30;

impl Surface {
    /// The surface of a region, with `detail` ≥ 1 cells per voxel and axis; `None` where a region without level set is
    /// vacuum. The mesh of a body is its whole surface, also where other bodies rule.
    pub fn of(grid: &IndexGrid<f32>, detail: u32) -> Option<Self> {
        let (wide, absorption) = (grid.cast::<f64>(), grid.absorption());
        let Some(level) = wide.level_set() else {
            let (index, middle) = (typical_index(grid)?, f64::from(half_way_index(grid)?));
            let side = if index > 1.0 { 1.0 } else { -1.0 };
            let above = |x| {
                let n = wide.index(x);
                (side * (middle - n), wide.w_gradient(x) * (-side / n))
            };
            let mesh = Mesh::of_level(wide.domain(), detail, above);
            return Some(Self { mesh, index, absorption, boundary: Boundary::HalfWay });
        };
        let index = typical_index(grid).unwrap_or(1.0);
        let mesh = Mesh::of_level(level.domain(), detail, |x| level.sample(x));
        Some(Self { mesh, index, absorption, boundary: Boundary::Jump })
    }

    /// Whether a region with this detail fits into memory.
    pub fn fits(grid: &IndexGrid<f32>, detail: u32) -> bool {
        let resolution = grid.level_set().map_or(grid.domain(), |l| l.domain()).resolution;
        let nodes = resolution.map(|n| u64::from(n) * u64::from(detail));
        nodes.iter().try_fold(1, |product: u64, n| product.checked_mul(*n)).is_some_and(|n| n <= MOST_NODES)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use refraxel_core::{Aabb, Interpolation, LevelSet, Vec3};
    use std::f64::consts::PI;

    fn volume(radius: f64) -> f64 {
        4.0 / 3.0 * PI * radius.powi(3)
    }

    #[test]
    fn vertices_of_a_body_lie_on_its_level_set() {
        let ball = LevelSet::from_samples(Aabb::cube(1.0), [33; 3], |x: Vec3<f32>| x.length() - 0.6);
        let surface = Surface::of(&IndexGrid::sharp(ball.clone(), 1.5), 1).unwrap();
        assert_eq!((surface.index, surface.boundary), (1.5, Boundary::Jump));
        assert_eq!((surface.mesh.open_edges(), surface.mesh.bodies()), (0, 1));
        let (ball, voxel) = (ball.cast::<f64>(), f64::from(ball.voxel()));
        for (x, normal) in surface.mesh.vertices.iter().zip(&surface.mesh.normals) {
            assert!(ball.value(*x).abs() < 1e-4 * voxel);
            assert!(normal.dot(x.normalized()) > 0.999);
        }
        assert!((surface.mesh.volume() / volume(0.6) - 1.0).abs() < 0.003, "{}", surface.mesh.volume());
    }

    #[test]
    fn a_soft_ball_ends_half_way_whether_it_is_denser_or_thinner() {
        for inside in [1.5, 0.8] {
            let n = |x: Vec3<f32>| {
                0.5 * (1.0 + inside) - 0.5 * (inside - 1.0) * ((x.length() - 0.6) * 20.0).tanh()
            };
            let grid =
                IndexGrid::from_control_values(Aabb::cube(1.0), [49; 3], Interpolation::CubicBSpline, n);
            let surface = Surface::of(&grid, 1).unwrap();
            assert_eq!((surface.boundary, surface.mesh.open_edges()), (Boundary::HalfWay, 0));
            assert!((surface.mesh.volume() / volume(0.6) - 1.0).abs() < 0.02, "{}", surface.mesh.volume());
            assert!((surface.index - inside).abs() < 5e-3, "{}", surface.index);
        }
    }

    #[test]
    fn vacuum_has_no_surface_and_too_much_detail_is_noticed() {
        let vacuum = IndexGrid::vacuum(Aabb::cube(1.0), [100; 3], Interpolation::CubicBSpline);
        assert!(Surface::of(&vacuum, 1).is_none());
        assert!(
            Surface::fits(&vacuum, 8) && !Surface::fits(&vacuum, 11) && !Surface::fits(&vacuum, u32::MAX)
        );
        // A body whose surface has shrunk away.
        let gone = LevelSet::from_samples(Aabb::cube(1.0), [9; 3], |_| 0.5_f32);
        let surface = Surface::of(&IndexGrid::sharp(gone, 1.5), 1).unwrap();
        assert!(surface.mesh.triangles.is_empty());
    }
}
