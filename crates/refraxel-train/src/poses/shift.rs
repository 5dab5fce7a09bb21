//! How far all cameras are from where the data put them.

use super::lens::LensShift;

/// How far cameras are from where the data put them.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct PoseShift {
    /// Largest turn [degree].
    pub largest_turn: f64,
    /// Median turn [degree].
    pub median_turn: f64,
    /// Largest way [scene unit].
    pub largest_way: f64,
    /// Median way [scene unit].
    pub median_way: f64,
    /// How far the lens that has changed most is from what the data say of it, if lenses learn.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lens: Option<LensShift>,
}
