//! The surface of a region, or a hull, as lines: where planes across the axes cut its mesh.

use super::error::SceneError;
use super::protocol::{HullPart, Piece};
use super::scene::Scene;
use refraxel_core::{Aabb, Domain, Mesh, Vec3};
use refraxel_train::model::Gate;
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

/// A hull as pieces of lines, in the coordinates of the renderer.
pub fn hull(gate: &Gate) -> (Aabb<f64>, Vec<Piece>) {
    let domain = gate.domain().cast::<f64>();
    // A voxel more on each side, which is empty: the mesh of a hull that reaches the end of its grid is closed there.
    let voxel =
        domain.bounds.extent().zip(Vec3::from(domain.resolution.map(f64::from)), |e, n| e / (n - 1.0));
    let bounds = Aabb::new(domain.bounds.min - voxel, domain.bounds.max + voxel);
    let wider = Domain { bounds, resolution: domain.resolution.map(|n| n + 2), ..domain };
    let level = |x: Vec3<f64>| {
        let inside = x.zip(domain.bounds.min, f64::max).zip(domain.bounds.max, f64::min);
        let is_near = (x - inside).zip(voxel, |off, voxel| off.abs() / voxel).max_element() < 0.5;
        0.5 - if is_near { f64::from(gate.share_at(inside.cast())) / 255.0 } else { 0.0 }
    };
    let slope = |x: Vec3<f64>, axis: usize| {
        let mut step = Vec3::zero();
        step[axis] = voxel[axis];
        (level(x + step) - level(x - step)) / (2.0 * voxel[axis])
    };
    let mesh = Mesh::of_level(&wider, 1, |x| (level(x), Vec3::from([0, 1, 2].map(|axis| slope(x, axis)))));
    (bounds, of_mesh(&mesh, bounds))
}

/// All hulls of a scene in the user's world.
pub fn hulls(scene: &Scene) -> Vec<HullPart> {
    let part = |gate| {
        let (bounds, pieces) = hull(gate);
        let bounds = scene.origin().to_world(bounds);
        HullPart { min: bounds.min.to_array(), max: bounds.max.to_array(), pieces }
    };
    scene.hulls().map(part).collect()
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
    fn a_hull_is_drawn_where_its_voxels_are_half_full_also_at_the_end_of_its_grid() {
        let bounds = Aabb::cube(1.0);
        let domain = Domain { bounds, extent: Extent::Bounded, resolution: [33; 3] };
        // A ball of which a part lies outside of the grid.
        let middle = Vec3::new(0.6, 0.0, 0.0);
        let share = |node| (0.5 - ((domain.place(node) - middle).length() - 0.6) * 16.0f32).clamp(0.0, 1.0);
        let gate = Gate::new(domain, &(0..33 * 33 * 33).map(share).collect::<Vec<f32>>());
        let (wider, pieces) = hull(&gate);
        assert!(pieces.len() > 500, "{}", pieces.len());
        let place = |ends: &[i16]| {
            wider.min + Vec3::from([0, 1, 2].map(|k: usize| f64::from(ends[k]) / STEPS * wider.extent()[k]))
        };
        let mut at_end = 0;
        for piece in &pieces {
            let a = place(&piece[..3]);
            let off = ((a - middle.cast()).length() - 0.6).abs();
            let is_end = a.x > 1.0 - 2.0 / 32.0;
            assert!(off < 0.02 || is_end, "{a:?}: {off}");
            at_end += usize::from(is_end);
        }
        assert!(at_end > 50, "{at_end}");
    }

    #[test]
    fn lines_lie_on_the_surface_and_their_normals_point_outwards() {
        let bounds = Aabb::cube(1.0);
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
