//! What bodies absorb.

use super::adam::{DECAY, adam};
use crate::backend::AbsorptionObjective;
use crate::model::{IndexMoments, Refraction};

/// One step of Adam on the coefficients of every region that rays have met, which stay >= 0. The parameters are the optical
/// thicknesses over the longest edge of the region: the rate does not depend on the unit of length. False when one of them
/// left the finite numbers; it then keeps its value.
pub fn update_absorption(
    refraction: &mut Refraction,
    moments: &mut [IndexMoments],
    gradients: &[[f64; 3]],
    objective: &AbsorptionObjective,
) -> bool {
    let mut finite = true;
    for (region, (grad, moments)) in gradients.iter().zip(moments).enumerate() {
        if grad.iter().all(|g| *g == 0.0) {
            continue;
        }
        let grid = refraction.medium.region_mut(region);
        let edge = grid.domain().bounds.extent().max_element();
        let steps = adam(&mut moments.absorption, DECAY, &[0, 1, 2], |c| grad[c] as f32 / edge);
        let Some(steps) = steps else {
            finite = false;
            continue;
        };
        let mut absorption = grid.absorption();
        for (a, step) in absorption.iter_mut().zip(steps) {
            *a += objective.rate * step / edge;
        }
        if absorption.iter().all(|a| a.is_finite()) {
            grid.set_absorption(absorption.map(|a| a.max(0.0)));
        } else {
            finite = false;
        }
    }
    finite
}
