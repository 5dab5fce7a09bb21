//! How far one camera is from where the data put it.

use refraxel_core::{Mat3, Pose, Vec3};

/// How far a camera is from where the data put it: R' = exp(ω) R, t' = t + τ, theory (8.1).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Correction {
    /// ω: the axis times the angle, in the world [rad].
    pub rotation: Vec3<f64>,
    /// τ [scene unit].
    pub translation: Vec3<f64>,
}

impl Correction {
    /// Where the camera is.
    pub fn of(&self, given: &Pose) -> Pose {
        let rotation = Mat3::turning(self.rotation) * given.rotation;
        Pose { rotation, translation: given.translation + self.translation }
    }

    /// The same in one unit for all six numbers.
    pub(super) fn numbers(&self, unit: f64) -> [f64; 6] {
        let (r, t) = (self.rotation, self.translation * (1.0 / unit));
        [r.x, r.y, r.z, t.x, t.y, t.z]
    }

    /// A step further, in one unit for all six numbers.
    pub(super) fn moved(&self, step: &[f64; 6], unit: f64) -> Self {
        let part = |k: usize| Vec3 { x: step[k], y: step[k + 1], z: step[k + 2] };
        Self { rotation: self.rotation + part(0), translation: self.translation + part(3) * unit }
    }
}
