//! Constants of the Rust code for the kernels. No number is repeated in WGSL.

use crate::bodies::{
    BODY, BODY_OF_PLANES, CUBIC_B_SPLINE, MAX_REGIONS, NO_BODY, TRILINEAR, TRILINEAR_OF_DIFFERENCES,
};
use crate::shape::Shape;
use refraxel_core::background::POLE;
use refraxel_core::grid::{BRICK, BRICK_VOXELS};
use refraxel_core::index::{BORDER, BORDER_VALUE, CUTS, FLAT, NUDGE, TOUCH, VACUUM};
use refraxel_core::optics::{CROSSING_SPACING, CROSSING_STEPS, GRAZING, MAX_LATTICE, STRAIGHT, transition};
use refraxel_core::radiance::{GROUP, clearcoat, light};
use refraxel_core::sh::{C0, C1, C2, C3, C3_5, MAX_BASIS};
use refraxel_train::backend::{BUCKET_SLOTS, RULE, TV_EPSILON};
use refraxel_train::model::gate;
use refraxel_train::random::{MIX, MIX_SHIFTS, WEYL};
use refraxel_train::rays::{LANES, OFFSET_LANE, PIXEL_LANE, REDRAWS, TAPS};
use std::fmt::Write;

/// Invocations of a workgroup: the voxels of a brick.
pub(crate) const WORKGROUP: u32 = BRICK_VOXELS as u32;
/// Bit of `Task::wants`: voxels receive gradients.
pub(crate) const WANTS_FIELD: u32 = 1;
/// Bit of `Task::wants`: rays receive gradients.
pub(crate) const WANTS_RAYS: u32 = 2;
/// Bit of `Task::wants`: the radiance behind the field comes with the rays.
pub(crate) const GIVEN_BEHIND: u32 = 4;
/// Bit of `Task::wants`: paths are kept, to be learned from.
pub(crate) const WANTS_PATHS: u32 = 8;
/// Bit of `Task::wants`: the index and surfaces receive gradients.
pub(crate) const WANTS_INDEX: u32 = 16;
/// Bit of `Task::wants`: bodies absorb, or may learn to.
pub(crate) const ABSORBS: u32 = 32;
/// Bit of `Task::wants`: surfaces mirror.
pub(crate) const MIRRORS: u32 = 64;
/// Bit of `Task::wants`: caches say what they mirror.
pub(crate) const READS_CACHES: u32 = 128;
/// Bit of `Task::wants`: opaque things have a clearcoat.
pub(crate) const COATED: u32 = 256;
/// Bits of `Segment::event`: the ray passes; it is turned back; it comes from inside the body.
const REFRACTS: u32 = 1;
const REFLECTS: u32 = 2;
const FROM_INSIDE: u32 = 4;
/// Words of the status: a failure of an earlier step; the loss of this one, or a parameter, is not finite.
pub(crate) const STATUS_FAILED: u32 = 0;
pub(crate) const STATUS_LOSS: u32 = 1;
pub(crate) const STATUS_PARAMETER: u32 = 2;
/// Samples of the step.
pub(crate) const STATUS_SAMPLES: u32 = 3;
/// The squared error of the step, two words of fixed point.
pub(crate) const STATUS_ERROR: u32 = 4;
/// Index samples that were left out since the derivative of their path overflowed.
pub(crate) const STATUS_OVERFLOWS: u32 = 6;
/// The device left loops before their end.
pub(crate) const STATUS_CUT: u32 = 7;
/// Of the rays whose paths are followed, how many have reached the end of theirs, and segments of the longest.
pub(crate) const STATUS_OVER: u32 = 8;
pub(crate) const STATUS_LONGEST: u32 = 9;
/// Records of reflections, the heads of their lists included.
pub(crate) const STATUS_REFLECTIONS: u32 = 10;
/// Rays of the batch for which no pixel was found.
pub(crate) const STATUS_ABSENT: u32 = 11;
/// Words of the status.
pub(crate) const STATUS_WORDS: u32 = 12;
/// Words of an outcome: the two of the squared error, samples, whether the step failed, index samples left out, whether loops were
/// left, rays, and padding.
pub(crate) const OUTCOME_WORDS: usize = 8;
/// Bits behind the point of a fixed-point number: steps of 1.5e-11, far below [`RULE`]'s ε, and sums up to 1.3e8.
const FIXED_BITS: i32 = 36;
/// Values of larger magnitude are cut to it.
const FIXED_LIMIT: f32 = (1 << 26) as f32;
/// The contraction stretches L∞ distances by at most 4/m − 3/m² ≤ 4/3, and a group of steps can lower the growth m by a
/// quarter: `cpu/node_map.rs`.
const STRETCH: f32 = 4.0 / 3.0;
const STRETCH_MOST: f32 = 16.0 / 3.0;

/// Something that a photograph or a gate does not have.
pub(crate) const NONE: u32 = u32::MAX;
/// The region of vacuum.
const NO_REGION: u32 = u32::MAX;
/// Distance to the nearest marked cell from outside of a lattice; those of cells are bytes.
const OUTSIDE: u32 = 256;

/// The value of a fixed-point number.
pub(crate) fn from_fixed(low: u32, high: u32) -> f64 {
    let whole = (u64::from(high) << 32 | u64::from(low)) as i64;
    whole as f64 * 2f64.powi(-FIXED_BITS)
}

/// 64 bits as kernels have them, the lower word first.
pub(crate) fn words(bits: u64) -> [u32; 2] {
    [bits as u32, (bits >> 32) as u32]
}

/// The constants as WGSL.
pub(crate) fn declarations(shape: &Shape) -> String {
    let mut out = String::new();
    let whole = [
        ("WORKGROUP", WORKGROUP),
        ("WANTS_FIELD", WANTS_FIELD),
        ("WANTS_RAYS", WANTS_RAYS),
        ("GIVEN_BEHIND", GIVEN_BEHIND),
        ("STATUS_FAILED", STATUS_FAILED),
        ("STATUS_LOSS", STATUS_LOSS),
        ("STATUS_PARAMETER", STATUS_PARAMETER),
        ("STATUS_SAMPLES", STATUS_SAMPLES),
        ("STATUS_ERROR", STATUS_ERROR),
        ("STATUS_OVERFLOWS", STATUS_OVERFLOWS),
        ("STATUS_CUT", STATUS_CUT),
        ("STATUS_OVER", STATUS_OVER),
        ("STATUS_LONGEST", STATUS_LONGEST),
        ("STATUS_REFLECTIONS", STATUS_REFLECTIONS),
        ("STATUS_ABSENT", STATUS_ABSENT),
        ("OUTCOME_WORDS", OUTCOME_WORDS as u32),
        ("WANTS_PATHS", WANTS_PATHS),
        ("WANTS_INDEX", WANTS_INDEX),
        ("ABSORBS", ABSORBS),
        ("MIRRORS", MIRRORS),
        ("READS_CACHES", READS_CACHES),
        ("COATED", COATED),
        ("MAX_REGIONS", MAX_REGIONS as u32),
        ("REFRACTS", REFRACTS),
        ("REFLECTS", REFLECTS),
        ("FROM_INSIDE", FROM_INSIDE),
        ("BORDER", BORDER as u32),
        ("BRICK_VOXELS", BRICK_VOXELS as u32),
        ("BUCKET_SLOTS", BUCKET_SLOTS as u32),
        ("GROUP", GROUP as u32),
        ("MAX_BASIS", MAX_BASIS as u32),
        ("DEGREE", u32::from(shape.degree.get())),
        ("BASIS", shape.degree.basis() as u32),
        ("BLOCKS", shape.blocks()),
        ("CUBIC_B_SPLINE", CUBIC_B_SPLINE),
        ("TRILINEAR_OF_DIFFERENCES", TRILINEAR_OF_DIFFERENCES),
        ("TRILINEAR", TRILINEAR),
        ("NO_BODY", NO_BODY),
        ("BODY", BODY),
        ("BODY_OF_PLANES", BODY_OF_PLANES),
        ("NONE", NONE),
        ("LANES", LANES as u32),
        ("OFFSET_LANE", OFFSET_LANE as u32),
        ("PIXEL_LANE", PIXEL_LANE as u32),
        ("REDRAWS", REDRAWS as u32),
        ("TAPS", TAPS as u32),
        ("MIX_SHIFT_0", MIX_SHIFTS[0]),
        ("MIX_SHIFT_1", MIX_SHIFTS[1]),
        ("MIX_SHIFT_2", MIX_SHIFTS[2]),
        ("NO_REGION", NO_REGION),
        ("OUTSIDE", OUTSIDE),
        ("CROSSING_STEPS", CROSSING_STEPS as u32),
        ("CUTS", CUTS as u32),
        ("MAX_LATTICE", MAX_LATTICE),
    ];
    for (name, value) in whole {
        let _ = writeln!(out, "const {name}: u32 = {value}u;");
    }
    for (name, value) in [("WEYL", WEYL), ("MIX_0", MIX[0]), ("MIX_1", MIX[1])] {
        let [low, high] = words(value);
        let _ = writeln!(out, "const {name}: vec2<u32> = vec2<u32>({low}u, {high}u);");
    }
    let real = [
        ("BRICK", BRICK as f32),
        ("FAR", f32::MAX),
        ("TAU", std::f32::consts::TAU),
        ("POLE", POLE as f32),
        ("TV_EPSILON", TV_EPSILON),
        ("RMS_DECAY", RULE.decay),
        ("RMS_EPSILON", RULE.epsilon),
        ("STRETCH", STRETCH),
        ("NUDGE", NUDGE as f32),
        ("BORDER_VALUE", BORDER_VALUE as f32),
        ("TOUCH", TOUCH as f32),
        ("VACUUM", VACUUM as f32),
        ("FLAT", FLAT as f32),
        ("STRAIGHT", STRAIGHT as f32),
        ("GRAZING", GRAZING as f32),
        ("PASSAGE_FLAT", transition::FLAT as f32),
        ("PASSAGE_LEAST", transition::LEAST as f32),
        ("PASSAGE_INSIDE", transition::INSIDE as f32),
        ("LEAST_SLOPE", clearcoat::LEAST_SLOPE as f32),
        ("LEAST_COSINE", clearcoat::LEAST_COSINE as f32),
        ("LIGHT_TOE", light::TOE as f32),
        ("LIGHT_TOE_SLOPE", light::TOE_SLOPE as f32),
        ("LIGHT_OFFSET", light::OFFSET as f32),
        ("GAMMA", light::GAMMA as f32),
        ("CROSSING_SPACING", CROSSING_SPACING as f32),
        ("EPSILON", f32::EPSILON),
        ("GATE_HALF", gate::HALF),
        ("GATE_STEP", gate::STEP),
        ("GATE_HOP", gate::HOP),
        ("STRETCH_MOST", STRETCH_MOST),
        ("FIXED_LIMIT", FIXED_LIMIT),
        ("FIXED_UPPER", 2f32.powi(FIXED_BITS - 32)),
        ("FIXED_STEP", 2f32.powi(-FIXED_BITS)),
        ("SH_C0", C0 as f32),
        ("SH_C1", C1 as f32),
        ("SH_C2_0", C2[0] as f32),
        ("SH_C2_1", C2[1] as f32),
        ("SH_C2_2", C2[2] as f32),
        ("SH_C3_0", C3[0] as f32),
        ("SH_C3_1", C3[1] as f32),
        ("SH_C3_2", C3[2] as f32),
        ("SH_C3_3", C3[3] as f32),
        ("SH_C3_5", C3_5 as f32),
    ];
    for (name, value) in real {
        let _ = writeln!(out, "const {name}: f32 = {value:?}f;");
    }
    out
}
