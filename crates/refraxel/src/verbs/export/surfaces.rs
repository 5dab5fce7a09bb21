//! The surfaces of a run that are written.

use crate::exit::{Exit, Failure};
use anyhow::anyhow;
use refraxel_core::Vec3;
use refraxel_train::Refraction;
use refraxel_train::model::surface::Surface;

/// One region's surface and its number, from 1.
pub(super) struct Numbered {
    pub(super) region: usize,
    pub(super) surface: Surface,
}

/// The surfaces of all regions that have one. Errors where none has one.
pub(super) fn surfaces(refraction: &Refraction, name: &str, detail: u32) -> Result<Vec<Numbered>, Failure> {
    let refuse =
        |problem: &str| Failure::new(Exit::BadInput, anyhow!("{name} has no surface to export: {problem}"));
    if refraction.is_none() {
        return Err(refuse(
            "its rays are straight; train with refractive masks, --refraction-box or --index-from",
        ));
    }
    let regions = refraction.medium.regions();
    if !regions.iter().all(|r| Surface::fits(r, detail)) {
        return Err(refuse(&format!("--detail {detail} needs too much memory; try a smaller one")));
    }
    let all = regions.iter().enumerate();
    let all = all.filter_map(|(k, r)| Some(Numbered { region: k + 1, surface: Surface::of(r, detail)? }));
    // Vacuum has a surface only where it lies in a body.
    let shows = |n: &Numbered| {
        let is_bubble = !refraction.medium.neighbours(n.region - 1).is_empty();
        !n.surface.mesh.triangles.is_empty() && (is_bubble || n.surface.index != 1.0)
    };
    let found: Vec<Numbered> = all.filter(shows).collect();
    if found.is_empty() {
        return Err(refuse(
            "its index is 1 everywhere; look at the index with `refraxel render RUN --slices --out DIR`, and train longer or with better masks",
        ));
    }
    Ok(found)
}

/// Three numbers in the precision of the files.
pub(super) fn narrow(v: Vec3<f64>) -> [f32; 3] {
    v.cast::<f32>().to_array()
}

/// A ball, and a hollow one beside it.
#[cfg(test)]
pub(super) fn ball_and_shell() -> Vec<Numbered> {
    use refraxel_core::{Aabb, IndexGrid, LevelSet, vec3};
    let body = |center: Vec3<f32>, shell: f32, index: f32| {
        let bounds = Aabb::new(center - Vec3::splat(1.0), center + Vec3::splat(1.0));
        let distance = |x: Vec3<f32>| {
            let d = (x - center).length() - 0.5;
            if shell > 0.0 { d.abs() - shell } else { d }
        };
        let mut grid = IndexGrid::sharp(LevelSet::from_samples(bounds, [33; 3], distance), index);
        grid.set_absorption(if shell > 0.0 { [0.2, 1.6, 6.0] } else { [0.0; 3] });
        Surface::of(&grid, 1).unwrap()
    };
    vec![
        Numbered { region: 1, surface: body(Vec3::zero(), 0.0, 1.5) },
        Numbered { region: 3, surface: body(vec3(4.0, 0.0, 0.0), 0.2, 1.33) },
    ]
}
