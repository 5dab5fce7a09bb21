//! The refractive regions in a page: level sets near their surfaces, fields, and what surfaces mirror.

use super::pack::Pack;
use crate::exit::{Exit, Failure};
use refraxel_core::{Domain, IndexGrid, Interpolation, LevelSet, Vec3};
use refraxel_train::model::index_edit::typical_index;
use refraxel_train::model::{Model, Refraction};
use serde_json::{Value, json};

/// Level sets are cut off so far from their surface [voxel]: nobody asks for their values there.
const NEAR: f32 = 8.0;
const IS_BODY: u32 = 1;
const IS_UNIFORM: u32 = 2;
const IS_OF_PLANES: u32 = 4;

/// Adds all regions and returns what the document says of each.
pub fn add(model: &Model, pack: &mut Pack) -> Result<Vec<Value>, Failure> {
    let Refraction { medium, optics, .. } = &model.refraction;
    let scales = 4 * (3 * model.field.degree.basis()).div_ceil(4) as u32;
    let all: Vec<_> =
        medium.regions().iter().flat_map(planes).flat_map(|(h, m)| [m.x, m.y, m.z, *h]).collect();
    let coefficients = scales + all.len() as u32;
    let mut parts = Parts { plane: scales, coefficients, words: Vec::new(), clearances: Vec::new() };
    // Not packed: an edge is where two of them meet.
    pack.reals("planes", all);
    let mut told = Vec::new();
    for (k, grid) in medium.regions().iter().enumerate() {
        let is_uniform = grid.level_set().is_some() && grid.interior_index().is_some();
        if !is_uniform && grid.interpolation() != Interpolation::CubicBSpline {
            return Err(Exit::BadInput.because(format!(
                "region {} has another interpolation of its index than cubic; a page renders that alone (option index.interpolation)",
                k + 1
            )));
        }
        let typical = typical_index(grid);
        let is_bubble = typical.is_none();
        told.push(json!({ "index": typical.unwrap_or(1.0), "slides": !is_bubble, "uniform": is_uniform }));
        let strength = model.reflection.mirrors.get(k).map_or(0.0, |m| m.strength);
        parts.add(grid, is_uniform, [optics.step * grid.voxel() / grid.largest_index(), strength], pack);
    }
    let one = if parts.words.is_empty() { vec![0; WORDS] } else { parts.words };
    pack.words("regions", one);
    pack.bytes("clearances", &parts.clearances);
    Ok(told)
}

/// The planes of a body; none where it has no flat face.
fn planes(grid: &IndexGrid<f32>) -> &[(f32, Vec3<f32>)] {
    grid.level_set().map_or(&[], LevelSet::planes)
}

/// Words of `Region` in viewer/share/shaders/scene.wgsl.
const WORDS: usize = 32;

/// What is known of all regions so far.
struct Parts {
    /// Numbers before the next plane.
    plane: u32,
    /// Numbers before the next coefficients.
    coefficients: u32,
    words: Vec<u32>,
    clearances: Vec<u8>,
}

impl Parts {
    fn add(&mut self, grid: &IndexGrid<f32>, is_uniform: bool, [step, strength]: [f32; 2], pack: &mut Pack) {
        let level = grid.level_set();
        let is_of_planes = level.is_some_and(LevelSet::is_of_planes);
        let kind = IS_BODY * u32::from(level.is_some())
            + IS_UNIFORM * u32::from(is_uniform)
            + IS_OF_PLANES * u32::from(is_of_planes);
        let (planes, plane) = (planes(grid).len() as u32, self.plane);
        self.plane += 4 * planes;
        let clearance = self.clearances.len() as u32;
        let surface = level.filter(|_| !is_of_planes).map_or(0, |level| {
            self.clearances.extend(level.clearances());
            let most = NEAR * level.voxel();
            let near: Vec<f32> = level.coefficients().iter().map(|c| c.clamp(-most, most)).collect();
            self.put(&near, pack)
        });
        let field = if is_uniform { 0 } else { self.put(grid.coefficients(), pack) };
        let own = level.map_or(grid.domain(), LevelSet::domain);
        let index = grid.interior_index().unwrap_or(1.0);
        let (a, b) = (place(own), place(grid.domain()));
        let region: [u32; WORDS] = [
            [a[0], a[1], a[2], index.to_bits()],
            [a[3], a[4], a[5], step.to_bits()],
            reals(grid.absorption(), strength),
            [a[6], a[7], a[8], kind],
            [b[0], b[1], b[2], 1.0_f32.to_bits()],
            [b[3], b[4], b[5], grid.largest_index().to_bits()],
            [b[6], b[7], b[8], surface],
            [field, clearance, planes, plane],
        ]
        .as_flattened()
        .try_into()
        .unwrap_or_else(|_| unreachable!("eight times four words"));
        self.words.extend(region);
    }

    /// Adds coefficients and returns where they begin.
    fn put(&mut self, coefficients: &[f32], pack: &mut Pack) -> u32 {
        let at = self.coefficients;
        let packed = pack.packed(coefficients);
        pack.splines.push(packed);
        self.coefficients += coefficients.len() as u32;
        at
    }
}

fn reals(v: [f32; 3], last: f32) -> [u32; 4] {
    [v[0], v[1], v[2], last].map(f32::to_bits)
}

/// Lowest corner, nodes per scene unit, and nodes.
fn place(domain: &Domain<f32>) -> [u32; 9] {
    let scale = domain.nodes_per_unit().hadamard(domain.unit_per_world());
    let (low, scale) = (domain.bounds.min.to_array().map(f32::to_bits), scale.to_array().map(f32::to_bits));
    let n = domain.resolution;
    [low[0], low[1], low[2], scale[0], scale[1], scale[2], n[0], n[1], n[2]]
}

#[cfg(test)]
mod tests {
    use super::*;
    use refraxel_core::{Aabb, vec3};

    #[test]
    fn flat_faces_go_as_planes_and_what_they_cut_as_coefficients() {
        let cube = Aabb::cube(1.0);
        let ball = LevelSet::from_control_values(cube, [17; 3], |x: Vec3<f32>| x.length() - 0.7);
        let top = [(vec3(0.0, 0.0, 1.0), 0.2)];
        let mut parts = Parts { plane: 8, coefficients: 40, words: Vec::new(), clearances: Vec::new() };
        let mut pack = Pack::default();
        for body in [ball.clone(), ball.clone().cut_by(top), ball.clone().with_planes(top)] {
            let grid = IndexGrid::vacuum(cube, [17; 3], Interpolation::CubicBSpline).with_level_set(body);
            parts.add(&grid, true, [0.1, 1.0], &mut pack);
        }
        // Kind, first coefficient, planes and the first of them; a body of planes has six more, which cut it off inside its box.
        let told = |k: usize| [15, 27, 30, 31].map(|word| parts.words[WORDS * k + word]);
        assert_eq!(told(0), [IS_BODY | IS_UNIFORM, 40, 0, 8]);
        assert_eq!(told(1), [IS_BODY | IS_UNIFORM, 40 + 17 * 17 * 17, 1, 8]);
        assert_eq!(told(2), [IS_BODY | IS_UNIFORM | IS_OF_PLANES, 0, 7, 12]);
        assert_eq!((pack.splines.len(), parts.clearances.len()), (2, 2 * 16 * 16 * 16));
    }
}
