//! The radiance field in a page: the bricks that can be seen, densities in 16 bits, coefficients of colour in 8.

use super::pack::{Pack, Packed};
use refraxel_core::background::POLE;
use refraxel_core::grid::{BRICK, BRICK_VOXELS, Cell};
use refraxel_core::radiance::GROUP;
use refraxel_core::sh::{C0, C1, C2, C3, C3_5, MAX_BASIS};
use refraxel_core::{Background, BrickMap, VoxelField};
use refraxel_train::backend::Marching;
use refraxel_train::model::{Model, Optimiser};
use serde_json::{Value, json};
use std::ops::Range;

/// Share of the coefficients of colour that the 8 bits reach; the few beyond are cut.
const REACHED: f64 = 0.999;
/// Error of a voxel's colour by the rounding of its coefficients, in the root mean square over all directions: two steps of a
/// screen. Pixels err by less, since several voxels make one.
const COLOUR_ERROR: f32 = 2.0 / 255.0;
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
    let seen = seen(&field.map, &optimiser.occupied);
    let kept: Vec<u32> =
        (1..field.map.slots() as u32).filter(|&s| seen[voxels_of(s)].contains(&true)).collect();
    let bricks: Vec<[u32; 3]> = kept.iter().map(|&s| field.map.brick_of(s)).collect();
    let map = BrickMap::with_bricks(field.map.resolution(), bricks);
    let map = map.unwrap_or_else(|| unreachable!("bricks of a map, each once"));
    // The empty slot comes first in both.
    let slots: Vec<u32> = std::iter::once(0).chain(kept).collect();
    pack.words("scene", scene(model, &map));
    pack.words("task", task(marching, field));
    pack.words("table", map.table_words().map(|entry| entry as u32));
    pack.words("forward", map.forward_rows().as_flattened().iter().copied());
    let words =
        |&s: &u32| [optimiser.occupied[s as usize] as u32, (optimiser.occupied[s as usize] >> 32) as u32];
    pack.words("occupied", slots.iter().flat_map(words));
    let voxels: Vec<usize> = slots.iter().flat_map(|&s| voxels_of(s)).collect();
    // Invisible densities are all alike: a number that compresses to nothing.
    let least = marching.theta_min(field).max(refraxel_core::field::EMPTY_DENSITY as f32) - 1.0;
    let visible = |&v: &usize| if seen[v] { field.density[v].max(least) } else { least };
    let density: Vec<f32> = voxels.iter().map(visible).collect();
    let density = pack.packed(&density);
    colours(field, &voxels, &seen, pack);
    let texels = match &model.background {
        Background::Constant(_) => &[][..],
        Background::Environment(map) => &map.texels[..],
    };
    pack.reals("texels", texels.as_flattened().iter().copied());
    (Field { constants: constants(model), density }, map.voxels())
}

/// The voxels of a brick.
fn voxels_of(slot: u32) -> Range<usize> {
    slot as usize * BRICK_VOXELS..(slot as usize + 1) * BRICK_VOXELS
}

/// Whether each voxel is a corner of a cell that can be seen.
fn seen(map: &BrickMap, occupied: &[u64]) -> Vec<bool> {
    let mut seen = vec![false; map.voxels()];
    for (slot, &cells) in (0..).zip(occupied).skip(1) {
        for local in (0..BRICK_VOXELS as u32).filter(|local| cells >> local & 1 == 1) {
            map.corners(Cell { slot, local }).iter().for_each(|&voxel| seen[voxel as usize] = true);
        }
    }
    seen
}

/// Step of the codes of colours with which the colour of a voxel has the root-mean-square error [`COLOUR_ERROR`] over all
/// directions. A step Δ errs by Δ²/12 in the mean square of a coefficient, whose function has the mean square 1/4π on the sphere:
/// Δ² · basis / 48π = COLOUR_ERROR².
fn colour_step(basis: usize) -> f32 {
    COLOUR_ERROR * (48.0 * std::f32::consts::PI / basis as f32).sqrt()
}

/// Adds the coefficients of colour: 8 bits each, with a scale of their own. All that is not needed, as what no cell reads and
/// differences that cannot be seen, becomes few numbers, which compress.
fn colours(field: &VoxelField<f32>, voxels: &[usize], seen: &[bool], pack: &mut Pack) {
    let (stride, used) = (field.degree.stride(), 3 * field.degree.basis());
    let lanes = used.next_multiple_of(4);
    let finest = 127.0 * colour_step(field.degree.basis());
    let scale = |lane: usize| {
        let read = voxels.iter().filter(|&&v| seen[v]);
        let mut all: Vec<f32> = read.map(|v| field.colour[v * stride + lane].abs()).collect();
        if all.is_empty() {
            return finest;
        }
        let reached = ((all.len() - 1) as f64 * REACHED) as usize;
        let (_, &mut most, _) = all.select_nth_unstable_by(reached, f32::total_cmp);
        most.max(finest)
    };
    let scales: Vec<f32> = (0..lanes).map(|lane| if lane < used { scale(lane) } else { 1.0 }).collect();
    let code = |v: usize, lane: usize| {
        if lane >= used || !seen[v] {
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
        whole(map.bricks_per_axis(), 0),
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
    use refraxel_core::{Aabb, Domain, Extent, ShDegree};

    #[test]
    fn voxels_are_seen_that_are_corners_of_a_visible_cell_also_in_the_next_brick() {
        let map = BrickMap::dense([12, 8, 8]);
        let mut occupied = vec![0_u64; map.slots()];
        let slot = |brick| map.slot(brick) as usize;
        let bricks = |seen: &[bool]| {
            let mut kept: Vec<[u32; 3]> = (1..map.slots() as u32)
                .filter(|&s| seen[voxels_of(s)].contains(&true))
                .map(|s| map.brick_of(s))
                .collect();
            kept.sort_unstable();
            kept
        };
        occupied[slot([0, 0, 0])] = 1 << 3; // the cell (3, 0, 0), whose upper corners lie in the next brick along x
        let across = seen(&map, &occupied);
        assert_eq!(bricks(&across), [[0, 0, 0], [1, 0, 0]]);
        assert_eq!(across.iter().filter(|seen| **seen).count(), 8);
        occupied[slot([0, 0, 0])] = 1 << 1;
        assert_eq!(bricks(&seen(&map, &occupied)), [[0, 0, 0]]);
    }

    #[test]
    fn codes_of_colours_err_by_two_steps_of_a_screen_and_what_no_cell_reads_is_nothing() {
        let degree = ShDegree::new(2).unwrap();
        let cube = Aabb::cube(1.0_f32);
        let domain = Domain::with_longest(cube, Extent::Bounded, 8);
        let mut field = VoxelField::uniform(domain, BrickMap::dense([8, 8, 8]), degree, -2.0);
        let (stride, used) = (degree.stride(), 3 * degree.basis());
        for (k, x) in field.colour.iter_mut().enumerate() {
            *x = if k % stride < used { (k as f32 * 0.37).sin() } else { 0.0 };
        }
        let voxels: Vec<usize> = voxels_of(1).collect();
        let seen: Vec<bool> = (0..field.map.voxels()).map(|v| v % 2 == 0).collect();
        let mut pack = Pack::default();
        colours(&field, &voxels, &seen, &mut pack);
        let lanes = used.next_multiple_of(4);
        let step = colour_step(degree.basis());
        let mut square = 0.0;
        for (v, codes) in voxels.iter().zip(pack.bytes.chunks(lanes)) {
            let read = codes[..used].iter().zip(&field.colour[v * stride..]);
            let error = read.map(|(&c, x)| (f32::from(c as i8) * step - x).powi(2)).sum::<f32>();
            assert!(seen[*v] || codes.iter().all(|c| *c == 0), "{v}");
            square += if seen[*v] { error / 3.0 / (4.0 * std::f32::consts::PI) } else { 0.0 };
        }
        let error = (square / 32.0).sqrt();
        assert!((0.8..1.2).contains(&(error / COLOUR_ERROR)), "{error}");
    }
}
