//! What a phone's sense of gravity says about the way up.

use crate::Problem;
use crate::parsed::ParsedDataset;
use refraxel_core::Vec3;

/// The mean upward direction of photographs that are farther from the vertical were taken on their side [degree].
const TILTED: f64 = 60.0;

/// States which way is up, and doubts it where the photographs lie on their side.
pub(super) fn state_up(parsed: &mut ParsedDataset, up: Vec3<f64>) {
    parsed.up = Some(up);
    let sum = parsed.frames.iter().fold(Vec3::zero(), |sum, f| sum - f.pose.rotation.columns[1]);
    let angle = (up.dot(sum) / sum.length()).clamp(-1.0, 1.0).acos().to_degrees();
    if angle > TILTED {
        parsed.problems.push(Problem::warning(format!(
            "the tops of the photographs point {angle:.0} degrees away from what the phone says is up: it was held on its side, or \
             the photographs were turned after it wrote the poses; look at the poses in the viewer, and state --up if it is another"
        )));
    }
}
