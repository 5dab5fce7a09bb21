//! How the index of a region varies before it learns.

use serde::{Deserialize, Serialize};

/// How the index of a region varies, before it learns.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Profile {
    /// One index, which jumps at the surface.
    Sharp,
    /// One index, with a transition of some voxels.
    Smooth,
    /// w = n²/2 rises from ½ at the surface to its largest value in the middle, as a parabola of the depth.
    Graded,
}
