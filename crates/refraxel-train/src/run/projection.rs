//! What a checkpoint keeps of the frame of a projective grid.

use refraxel_core::{Extent, Projection, Vec3};
use serde::{Deserialize, Serialize};

#[derive(Clone, Copy, Serialize, Deserialize)]
pub(super) struct StoredProjection {
    eye: [f32; 3],
    right: [f32; 3],
    down: [f32; 3],
    ahead: [f32; 3],
    near: f32,
    edges: [[f32; 2]; 2],
    baseline: f32,
}

/// Sines of the angles by which stored axes may differ from right ones.
const SKEW: f32 = 1e-4;

impl StoredProjection {
    pub(super) fn of(extent: &Extent) -> Option<Self> {
        let Extent::Projective(Projection { eye, axes, near, edges, baseline }) = *extent else {
            return None;
        };
        let [right, down, ahead] = axes.map(Vec3::to_array);
        Some(Self { eye: eye.to_array(), right, down, ahead, near, edges, baseline })
    }

    pub(super) fn projection(&self) -> Projection {
        let Self { eye, right, down, ahead, near, edges, baseline } = *self;
        let axes = [right, down, ahead].map(Vec3::from);
        Projection { eye: Vec3::from(eye), axes, near, edges, baseline }
    }

    /// Whether points can be placed by it: right angles, lengths above 0, edges in their order.
    pub(super) fn is_valid(&self) -> bool {
        let Projection { eye, axes: [right, down, ahead], near, edges, baseline } = self.projection();
        let is_frame = (right.cross(down) - ahead).length() < SKEW
            && (right.length() - 1.0).abs() < SKEW
            && (down.length() - 1.0).abs() < SKEW;
        let is_length = |l: f32| l.is_finite() && l > 0.0;
        let is_window = |[low, high]: [f32; 2]| low.is_finite() && is_length(high - low);
        eye.is_finite()
            && is_frame
            && is_length(near)
            && is_length(baseline)
            && baseline <= near
            && edges.into_iter().all(is_window)
    }
}
