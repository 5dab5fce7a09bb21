//! The surface of what is opaque in a run, with the colours that photographs show of it.

use super::eyes::Eyes;
use super::surfaces::Solid;
use crate::exit::{Exit, Failure};
use refraxel_core::grid::BRICK_VOXELS;
use refraxel_core::sh::{C0, MAX_BASIS};
use refraxel_core::{Mesh, Vec3, VoxelField};
use refraxel_train::model::opaque::Opacity;

/// A part of the mesh that has fewer triangles than this share of the largest one is left out.
const SMALL: f64 = 1e-3;
/// The same for parts with fewer triangles than this: specks of about two voxels.
const SPECK: usize = 200;
/// Parts of the mesh in which no voxel gives this share of a pixel's light to any camera are left out.
const SEEN: f32 = 0.1;

/// What is opaque, as a mesh.
pub(super) struct Opaque {
    /// Closed, in world coordinates, with at least one triangle.
    pub(super) mesh: Mesh,
    /// Of each vertex (sRGB-encoded, 1 = white).
    pub(super) colours: Vec<[f32; 3]>,
    /// Opacity of a voxel at which things begin [1].
    pub(super) level: f64,
    /// Parts that are too small to be things.
    pub(super) small: usize,
    /// Parts that no photograph shows, such as walls inside things.
    pub(super) unseen: usize,
    /// Share of the vertices whose colour no photograph shows.
    pub(super) guessed: f64,
}

impl Opaque {
    pub(super) fn solid(&self) -> Solid<'_> {
        Solid { region: 0, mesh: &self.mesh, colours: Some(&self.colours), index: None }
    }

    /// That of a run, with `detail` cells per voxel; `None` where nothing is opaque. Without `eyes` all colours are means over all
    /// directions.
    pub(super) fn of(
        eyes: Option<&Eyes>,
        field: &VoxelField<f32>,
        detail: u32,
    ) -> Result<Option<Self>, Failure> {
        if !Opacity::fits(field, detail) {
            return Err(Exit::BadInput.because(format!(
                "--detail {detail} needs too much memory for what is opaque; try a smaller one"
            )));
        }
        let opacity = Opacity::of(field);
        let level = opacity.level(field, &eyes.map(Eyes::straight_rays).unwrap_or_default());
        let whole = opacity.mesh(level, detail);
        let weights = eyes.map(Eyes::weights).transpose()?;
        let (mesh, [small, unseen]) = chosen(&whole, detail, |x| {
            weights.as_deref().is_none_or(|weights| weight(field, weights, x) >= SEEN)
        });
        if mesh.triangles.is_empty() {
            return Ok(None);
        }
        let points: Vec<_> = mesh.vertices.iter().copied().zip(mesh.normals.iter().copied()).collect();
        let seen = eyes.map_or(Ok(vec![None; points.len()]), |eyes| eyes.colours(&points))?;
        let missing = seen.iter().filter(|colour| colour.is_none()).count();
        let guessed = missing as f64 / seen.len() as f64;
        let colours = seen.into_iter().zip(&points).map(|(c, p)| c.unwrap_or_else(|| mean(field, *p)));
        Ok(Some(Self { colours: colours.collect(), mesh, level, small, unseen, guessed }))
    }
}

/// The parts of a mesh that are things, and how many are too small or not seen.
fn chosen(mesh: &Mesh, detail: u32, is_seen: impl Fn(Vec3<f64>) -> bool) -> (Mesh, [usize; 2]) {
    let part = mesh.parts();
    let count = part.iter().max().map_or(0, |last| *last as usize + 1);
    let (mut size, mut seen) = (vec![0; count], vec![false; count]);
    mesh.triangles.iter().for_each(|t| size[part[t[0] as usize] as usize] += 1);
    for (&x, &part) in mesh.vertices.iter().zip(&part) {
        seen[part as usize] |= is_seen(x);
    }
    let largest = size.iter().zip(&seen).filter(|(_, seen)| **seen).map(|(size, _)| *size).max().unwrap_or(0);
    let least = (SPECK * (detail * detail) as usize).min(largest).max((SMALL * largest as f64) as usize);
    let is_large = |p: usize| size[p] >= least;
    let unseen = (0..count).filter(|&p| is_large(p) && !seen[p]).count();
    let small = (0..count).filter(|&p| !is_large(p)).count();
    let keep = |v: usize| is_large(part[v] as usize) && seen[part[v] as usize];
    (mesh.of_parts(keep).0, [small, unseen])
}

/// The largest weight of the voxels around a point.
fn weight(field: &VoxelField<f32>, weights: &[f32], x: Vec3<f64>) -> f32 {
    let node = field.domain.node(x.cast()).map(f32::floor).to_array();
    let corner = |k: u32| {
        let at: [u32; 3] = std::array::from_fn(|a| (node[a].max(0.0) as u32).saturating_add(k >> a & 1));
        let voxel = field.map.voxel(at);
        if voxel < BRICK_VOXELS { 0.0 } else { weights[voxel] } // the empty brick stands for many places
    };
    (0..8).map(corner).fold(0.0, f32::max)
}

/// The mean colour over all directions, a little below a surface.
fn mean(field: &VoxelField<f32>, (x, normal): (Vec3<f64>, Vec3<f64>)) -> [f32; 3] {
    let mut basis = [0.0; MAX_BASIS];
    basis[0] = C0 as f32;
    let voxels = f64::from(field.domain.node_jvp(x.cast(), normal.cast()).length());
    let below = x - normal * (0.5 / voxels.max(f64::MIN_POSITIVE));
    let matter = field.at(below.cast(), &basis).or_else(|| field.at(x.cast(), &basis));
    matter.map_or([0.5; 3], |matter| matter.colour.map(|c| c.min(1.0)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use refraxel_core::{Aabb, BrickMap, Domain, Extent, ShDegree, vec3};

    /// Three balls, the second smaller and the third a speck.
    fn three() -> Mesh {
        let cube = Aabb::cube(1.0);
        let domain = Domain { bounds: cube, extent: Extent::Bounded, resolution: [49; 3] };
        Mesh::of_level(&domain, 1, |x| {
            let balls = [(-0.5, 0.4), (0.3, 0.3), (0.8, 0.04)].map(|(at, radius)| {
                let r = x - vec3(at, 0.01, -0.02);
                (r.length() - radius, r.normalized())
            });
            balls.into_iter().fold((f64::MAX, x), |best, ball| if ball.0 < best.0 { ball } else { best })
        })
    }

    #[test]
    fn specks_and_what_no_photograph_shows_are_left_out_and_counted() {
        let whole = three();
        assert_eq!(whole.bodies(), 3);
        let (mesh, counts) = chosen(&whole, 1, |_| true);
        assert_eq!((mesh.bodies(), mesh.open_edges(), counts), (2, 0, [1, 0]));
        let (mesh, counts) = chosen(&whole, 1, |x| x.x < 0.0);
        assert_eq!((mesh.bodies(), mesh.open_edges(), counts), (1, 0, [1, 1]));
        assert!(mesh.bounds().unwrap().max.x < 0.0);
        let (mesh, _) = chosen(&whole, 1, |_| false);
        assert!(mesh.triangles.is_empty());
    }

    #[test]
    fn unseen_places_have_the_mean_colour_over_all_directions_and_the_largest_weight_around_them() {
        let bounds = Aabb::cube(1.0);
        let domain = Domain { bounds, extent: Extent::Bounded, resolution: [9; 3] };
        let degree = ShDegree::new(1).unwrap();
        let mut field = VoxelField::uniform(domain, BrickMap::dense([9; 3]), degree, 0.0);
        for voxel in field.colour[BRICK_VOXELS * degree.stride()..].chunks_exact_mut(degree.stride()) {
            (voxel[0], voxel[4], voxel[8]) = (0.4 / C0 as f32, -0.25 / C0 as f32, 9.0);
            voxel[1] = 3.0; // of one direction alone
        }
        let colour = mean(&field, (vec3(0.1, 0.2, 0.3), vec3(0.0, 0.0, 1.0)));
        for (c, expected) in colour.into_iter().zip([0.9, 0.25, 1.0]) {
            assert!((c - expected).abs() < 1e-6, "{colour:?}");
        }
        let mut weights = vec![0.0; field.map.voxels()];
        weights[0] = 1.0; // of the empty brick
        weights[field.map.voxel([5, 5, 6])] = 0.3;
        assert_eq!(weight(&field, &weights, vec3(0.1, 0.2, 0.3)), 0.3); // node (4.4, 4.8, 5.2)
        assert_eq!(weight(&field, &weights, vec3(-0.9, -0.9, 1.0)), 0.0);
    }
}
