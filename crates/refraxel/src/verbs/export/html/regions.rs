//! The refractive regions in a page: level sets near their surfaces, fields, and what surfaces mirror.

use super::pack::Pack;
use crate::exit::{Exit, Failure};
use anyhow::anyhow;
use refraxel_core::{Domain, IndexGrid, Interpolation, LevelSet, Vec3};
use refraxel_train::model::index_edit::typical_index;
use refraxel_train::model::{Model, Refraction};
use serde_json::{Value, json};

/// Level sets are cut off so far from their surface [voxel]: nobody asks for their values there.
const NEAR: f32 = 8.0;
const IS_BODY: u32 = 1;
const IS_UNIFORM: u32 = 2;

/// Adds all regions and returns what the document says of each.
pub fn add(model: &Model, pack: &mut Pack) -> Result<Vec<Value>, Failure> {
    let Refraction { medium, optics, .. } = &model.refraction;
    let first = 4 * (3 * model.field.degree.basis()).div_ceil(4) as u32;
    let mut parts = Parts { coefficients: first, words: Vec::new(), clearances: Vec::new() };
    let mut told = Vec::new();
    for (k, grid) in medium.regions().iter().enumerate() {
        let is_uniform = grid.level_set().is_some() && grid.interior_index().is_some();
        if !is_uniform && grid.interpolation() != Interpolation::CubicBSpline {
            let error = anyhow!(
                "region {} has another interpolation of its index than cubic; a page renders that alone (option index.interpolation)",
                k + 1
            );
            return Err(Failure::new(Exit::BadInput, error));
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

/// Words of `Region` in viewer/share/shaders/scene.wgsl.
const WORDS: usize = 32;

/// What is known of all regions so far.
struct Parts {
    /// Numbers before the next coefficients.
    coefficients: u32,
    words: Vec<u32>,
    clearances: Vec<u8>,
}

impl Parts {
    fn add(&mut self, grid: &IndexGrid<f32>, is_uniform: bool, [step, strength]: [f32; 2], pack: &mut Pack) {
        // The page knows splines alone: its edges are round.
        let level = grid.level_set().map(LevelSet::rounded);
        let level = level.as_deref();
        let kind = if level.is_some() { IS_BODY } else { 0 } | if is_uniform { IS_UNIFORM } else { 0 };
        let clearance = self.clearances.len() as u32;
        let surface = level.map_or(0, |level| {
            self.clearances.extend(distances(level));
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
            [field, clearance, 0, 0],
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

/// Per cell, x fastest, the distance to the nearest that may hold the surface [cell].
fn distances(level: &LevelSet<f32>) -> Vec<u8> {
    let level = level.cast::<f64>();
    let domain = level.domain();
    let cells = domain.resolution.map(|n| n - 1);
    let edge = domain.bounds.extent();
    let middle = |c: [u32; 3]| {
        let at = [0, 1, 2]
            .map(|a: usize| domain.bounds.min[a] + edge[a] * (f64::from(c[a]) + 0.5) / f64::from(cells[a]));
        Vec3::from(at)
    };
    let mut all = Vec::with_capacity(cells.iter().map(|&n| n as usize).product());
    for z in 0..cells[2] {
        for y in 0..cells[1] {
            all.extend((0..cells[0]).map(|x| level.clearance(middle([x, y, z])).unwrap_or(1)));
        }
    }
    all
}
