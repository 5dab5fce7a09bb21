//! The radiance field in a page: the bricks that can be seen, densities in 16 bits, coefficients of colour in 8.

use super::pack::{Pack, Packed};
use refraxel_core::background::POLE;
use refraxel_core::grid::{BRICK, BRICK_VOXELS};
use refraxel_core::radiance::GROUP;
use refraxel_core::sh::{C0, C1, C2, C3, C3_5, MAX_BASIS};
use refraxel_core::{Background, BrickMap, VoxelField};
use refraxel_train::backend::Marching;
use refraxel_train::model::{Model, Optimiser};
use serde_json::{Value, json};

/// Share of the coefficients of colour that the 8 bits reach; the few beyond are cut.
const REACHED: f64 = 0.999;
/// Bounds on the stretching of steps by the contraction: 4/m − 3/m² ≤ 4/3, and four times that where steps grow in groups.
const STRETCH: [f32; 2] = [4.0 / 3.0, 16.0 / 3.0];

/// What the document says of the field.
pub struct Field {
    /// Constants of the shaders.
    pub constants: Value,
    /// Where the densities lie.
    pub density: Packed,
}

/// Adds the field and the background; also returns how many voxels there are.
pub fn add(model: &Model, optimiser: &Optimiser, marching: &Marching, pack: &mut Pack) -> (Field, usize) {
    let field = &model.field;
    let kept = visible(&field.map, &optimiser.occupied);
    let bricks: Vec<[u32; 3]> = kept.iter().map(|&s| field.map.brick_of(s)).collect();
    let map = BrickMap::with_bricks(field.map.resolution(), bricks);
    let map = map.unwrap_or_else(|| unreachable!("bricks of a map, each once"));
    // The empty slot comes first in both.
    let slots: Vec<u32> = std::iter::once(0).chain(kept).collect();
    pack.words("scene", scene(model, &map));
    pack.words("task", task(marching, field));
    let all: usize = per_axis(&map).iter().map(|&n| n as usize).product();
    let entry = |k| map.entry(k).slot().map_or_else(|far| -(far as i32), |slot| slot as i32) as u32;
    pack.words("table", (0..all).map(entry));
    pack.words("forward", map.forward_rows().as_flattened().iter().copied());
    let words =
        |&s: &u32| [optimiser.occupied[s as usize] as u32, (optimiser.occupied[s as usize] >> 32) as u32];
    pack.words("occupied", slots.iter().flat_map(words));
    let voxels = |&s: &u32| s as usize * BRICK_VOXELS..(s as usize + 1) * BRICK_VOXELS;
    // Invisible densities are all alike: a number that compresses to nothing.
    let least = marching.theta_min(field).max(refraxel_core::field::EMPTY_DENSITY as f32) - 1.0;
    let density: Vec<f32> = slots.iter().flat_map(voxels).map(|v| field.density[v].max(least)).collect();
    let density = pack.packed(&density);
    colours(field, slots.iter().flat_map(voxels), pack);
    let texels = match &model.background {
        Background::Constant(_) => &[][..],
        Background::Environment(map) => &map.texels[..],
    };
    pack.reals("texels", texels.as_flattened().iter().copied());
    (Field { constants: constants(model), density }, map.voxels())
}

/// The slots that hold a cell which can be seen, or a corner of one.
fn visible(map: &BrickMap, occupied: &[u64]) -> Vec<u32> {
    // Bits of the cells at the far faces of a brick, per axis.
    let last = BRICK - 1;
    let face =
        |axis: u32| (0..64).filter(|l| (l >> (2 * axis)) & last == last).fold(0_u64, |m, l| m | 1 << l);
    let faces = [face(0), face(1), face(2)];
    let mut keeps = vec![false; map.slots()];
    for (slot, &cells) in occupied.iter().enumerate().skip(1) {
        for corner in 0..8 {
            let at = faces.iter().enumerate().filter(|(axis, _)| corner >> axis & 1 == 1);
            if at.fold(cells, |m, (_, face)| m & face) != 0 {
                keeps[map.forward_rows()[slot][corner] as usize / BRICK_VOXELS] = true;
            }
        }
    }
    (1..map.slots() as u32).filter(|&s| keeps[s as usize]).collect()
}

/// Adds the coefficients of colour: 8 bits each, with a scale of their own.
fn colours(field: &VoxelField<f32>, voxels: impl Iterator<Item = usize>, pack: &mut Pack) {
    let (stride, used) = (field.degree.stride(), 3 * field.degree.basis());
    let lanes = used.next_multiple_of(4);
    let voxels: Vec<usize> = voxels.collect();
    let scale = |lane: usize| {
        let mut all: Vec<f32> = voxels.iter().map(|v| field.colour[v * stride + lane].abs()).collect();
        let reached = ((all.len() - 1) as f64 * REACHED) as usize;
        let (_, &mut most, _) = all.select_nth_unstable_by(reached, f32::total_cmp);
        most.max(f32::MIN_POSITIVE)
    };
    let scales: Vec<f32> = (0..lanes).map(|lane| if lane < used { scale(lane) } else { 1.0 }).collect();
    let code = |v: usize, lane: usize| {
        if lane >= used {
            return 0;
        }
        let share = field.colour[v * stride + lane] / scales[lane];
        (share.clamp(-1.0, 1.0) * 127.0).round() as i8 as u8
    };
    let codes: Vec<u8> =
        voxels.iter().flat_map(|&v| (0..lanes).map(move |lane| (v, lane))).map(|(v, l)| code(v, l)).collect();
    pack.bytes("colours", &codes);
    pack.reals("scales", scales);
}

/// Bricks per axis.
fn per_axis(map: &BrickMap) -> [u32; 3] {
    map.resolution().map(|n| n.div_ceil(BRICK))
}

/// `Scene` of `scene.wgsl`.
fn scene(model: &Model, map: &BrickMap) -> Vec<u32> {
    let real = |v: [f32; 3], last: u32| [v[0].to_bits(), v[1].to_bits(), v[2].to_bits(), last];
    let domain = &model.field.domain;
    let placement = domain.placement();
    let [right, down, ahead] = placement.axes.map(|axis| real(axis.to_array(), 0));
    let (rows, plain) = match &model.background {
        Background::Constant(c) => (0, *c),
        Background::Environment(map) => (map.height() as u32, [0.0; 3]),
    };
    let whole = |v: [u32; 3], last: u32| [v[0], v[1], v[2], last];
    [
        real(placement.center.to_array(), placement.reach.to_bits()),
        real(placement.unit_per_world.to_array(), model.field.density_scale().to_bits()),
        real(domain.nodes_per_unit().to_array(), domain.voxel().to_bits()),
        real(placement.lowest.to_array(), placement.extent),
        real(placement.highest.to_array(), map.slots() as u32),
        whole(domain.resolution.map(|n| n - 2), rows),
        whole(map.brick_strides(), 0),
        whole(per_axis(map), 0),
        real(plain, 0),
        right,
        down,
        ahead,
    ]
    .concat()
}

/// `Task` of `scene.wgsl`; what learns is 0.
fn task(marching: &Marching, field: &VoxelField<f32>) -> Vec<u32> {
    let step = marching.step * field.domain.voxel();
    let reals = [step, marching.near, marching.theta_min(field), marching.min_transmittance];
    let mut words = vec![0; 20];
    words.iter_mut().skip(2).zip(reals).for_each(|(word, x)| *word = x.to_bits());
    words
}

/// The constants of the shaders, which repeat none of them.
fn constants(model: &Model) -> Value {
    let (degree, regions) = (model.field.degree, model.refraction.medium.regions().len());
    json!({
        "u32": {
            "WORKGROUP": BRICK_VOXELS,
            "GROUP": GROUP,
            "MAX_BASIS": MAX_BASIS,
            "DEGREE": degree.get(),
            "BASIS": degree.basis(),
            "BLOCKS": (3 * degree.basis()).div_ceil(4),
            "MOST_REGIONS": regions.max(1),
        },
        "f32": {
            "BRICK": BRICK as f32,
            "FAR": f32::MAX,
            "TAU": std::f32::consts::TAU,
            "POLE": POLE as f32,
            "STRETCH": STRETCH[0],
            "STRETCH_MOST": STRETCH[1],
            "SH_C0": C0 as f32,
            "SH_C1": C1 as f32,
            "SH_C2_0": C2[0] as f32,
            "SH_C2_1": C2[1] as f32,
            "SH_C2_2": C2[2] as f32,
            "SH_C3_0": C3[0] as f32,
            "SH_C3_1": C3[1] as f32,
            "SH_C3_2": C3[2] as f32,
            "SH_C3_3": C3[3] as f32,
            "SH_C3_5": C3_5 as f32,
        },
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bricks_are_kept_for_their_cells_and_for_corners_of_their_neighbours() {
        let map = BrickMap::dense([12, 8, 8]);
        let mut occupied = vec![0_u64; map.slots()];
        let slot = |brick| map.slot(brick) as usize;
        occupied[slot([0, 0, 0])] = 1 << 3; // the cell (3, 0, 0), whose upper corners lie in the next brick along x
        let mut kept: Vec<[u32; 3]> = visible(&map, &occupied).iter().map(|&s| map.brick_of(s)).collect();
        kept.sort_unstable();
        assert_eq!(kept, [[0, 0, 0], [1, 0, 0]]);
        occupied[slot([0, 0, 0])] = 1 << 1;
        assert_eq!(visible(&map, &occupied), [slot([0, 0, 0]) as u32]);
    }
}
