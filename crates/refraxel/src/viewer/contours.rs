//! The surface of a region as lines: where planes across the axes cut its mesh.

use super::error::SceneError;
use super::protocol::Piece;
use super::scene::Scene;
use refraxel_core::{Aabb, Mesh, Vec3};
use refraxel_train::model::surface::Surface;

/// Planes across each axis.
const PLANES: usize = 12;
/// Steps from one end of the region's box to the other, in which places are told.
const STEPS: f64 = 4095.0;
/// Length of the normals that are told.
const NORMAL: f64 = 100.0;

/// The surface of a region as pieces of lines. Empty where nothing in it refracts.
pub fn contours(scene: &Scene, region: usize) -> Result<Vec<Piece>, SceneError> {
    let regions = scene.learned().medium.regions();
    let grid = regions.get(region).ok_or(SceneError::Region { found: region, count: regions.len() })?;
    if !Surface::fits(grid, 1) {
        return Err(SceneError::Look(format!(
            "region {} is too large for its surface to be drawn",
            region + 1
        )));
    }
    let bounds = grid.domain().bounds.cast();
    Ok(Surface::of(grid, 1).map_or_else(Vec::new, |surface| of_mesh(&surface.mesh, bounds)))
}

fn of_mesh(mesh: &Mesh, bounds: Aabb<f64>) -> Vec<Piece> {
    let mut pieces = Vec::new();
    for triangle in &mesh.triangles {
        let corners = mesh.corners(*triangle);
        let normal = triangle.iter().fold(Vec3::zero(), |n, &v| n + mesh.normals[v as usize]).normalized();
        for axis in 0..3 {
            let at = |plane: usize| {
                bounds.min[axis] + bounds.extent()[axis] * (plane as f64 + 0.5) / PLANES as f64
            };
            let cuts = (0..PLANES).filter_map(|plane| cut(corners, axis, at(plane)));
            pieces.extend(cuts.map(|[a, b]| piece(a, b, normal, bounds)));
        }
    }
    pieces
}

/// Where a plane across an axis cuts a triangle.
fn cut(corners: [Vec3<f64>; 3], axis: usize, at: f64) -> Option<[Vec3<f64>; 2]> {
    let edges = [[0, 1], [1, 2], [2, 0]].map(|[a, b]| [corners[a], corners[b]]);
    let mut ends = edges.into_iter().filter_map(|[a, b]| {
        let crosses = (a[axis] < at) != (b[axis] < at);
        crosses.then(|| a + (b - a) * ((at - a[axis]) / (b[axis] - a[axis])))
    });
    Some([ends.next()?, ends.next()?])
}

fn piece(a: Vec3<f64>, b: Vec3<f64>, normal: Vec3<f64>, bounds: Aabb<f64>) -> Piece {
    let step = |x: Vec3<f64>, k: usize| ((x[k] - bounds.min[k]) / bounds.extent()[k] * STEPS).round() as i16;
    std::array::from_fn(|k| match k {
        0..3 => step(a, k),
        3..6 => step(b, k - 3),
        _ => (normal[k - 6] * NORMAL).round() as i16,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use refraxel_core::{Domain, Extent};

    #[test]
    fn lines_lie_on_the_surface_and_their_normals_point_outwards() {
        let bounds = Aabb::new(Vec3::splat(-1.0), Vec3::splat(1.0));
        let domain = Domain { bounds, extent: Extent::Bounded, resolution: [25; 3] };
        let ball = Mesh::of_level(&domain, 1, |x: Vec3<f64>| (x.length() - 0.6, x.normalized()));
        let pieces = of_mesh(&ball, bounds);
        assert!(pieces.len() > 500, "{}", pieces.len());
        let place =
            |ends: &[i16]| Vec3::from([0, 1, 2].map(|k: usize| f64::from(ends[k]) / STEPS * 2.0 - 1.0));
        for piece in &pieces {
            let (a, b, normal) = (place(&piece[..3]), place(&piece[3..6]), &piece[6..]);
            assert!((a.length() - 0.6).abs() < 0.01 && (b.length() - 0.6).abs() < 0.01);
            let normal = Vec3::from([0, 1, 2].map(|k: usize| f64::from(normal[k]) / NORMAL));
            assert!(normal.dot(a.normalized()) > 0.9);
        }
    }
}
