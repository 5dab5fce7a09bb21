//! Adam's step on an array of parameters.

use crate::model::AdamMoments;

/// Decays of the mean and of the mean square.
pub(super) const DECAY: [f32; 2] = [0.9, 0.99];
/// Floor of the denominator, as a share of the largest: voxels that hardly matter must not follow noise.
const FLOOR: f32 = 0.1;

/// Steps after which the rate of nodes has [halved](slower).
pub(super) const HALF_OF_NODES: f32 = 150.0;

/// How much less a rate is after so many steps, when it halves in `half` and falls with their number from there on (Robbins & Monro
/// 1951): colours cannot settle behind a surface that trembles, and what photographs do not determine drifts, for as long as it moves.
pub(super) fn slower(moments: &AdamMoments, half: f32) -> f32 {
    half / (half + moments.steps as f32)
}

/// The change of each of the parameters `which`, for a learning rate of 1: Adam (Kingma & Ba 2015). `None` where a moment left the
/// finite numbers: the step has failed, and the parameters must stay.
pub(super) fn adam(
    moments: &mut AdamMoments,
    decay: [f32; 2],
    which: &[usize],
    grad: impl Fn(usize) -> f32,
) -> Option<Vec<f32>> {
    moments.steps += 1;
    let unbias = decay.map(|d| (1.0 - d.powi(moments.steps.min(1 << 20) as i32)).recip());
    let (mut largest, mut finite) = (0.0_f32, true);
    for &j in which {
        let g = grad(j);
        moments.first[j] += (1.0 - decay[0]) * (g - moments.first[j]);
        moments.second[j] += (1.0 - decay[1]) * (g * g - moments.second[j]);
        finite &= moments.second[j].is_finite(); // then the first one is, too
        largest = largest.max(moments.second[j]);
    }
    if !finite {
        return None;
    }
    let floor = FLOOR * (largest * unbias[1]).sqrt() + f32::MIN_POSITIVE;
    let step = |&j: &usize| -moments.first[j] * unbias[0] / (moments.second[j] * unbias[1]).sqrt().max(floor);
    Some(which.iter().map(step).collect())
}
