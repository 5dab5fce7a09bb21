//! How badly straight rays explain a pixel.

/// Squared error, over the three channels, that counts half: rays that end at something unknown must not decide.
const SATURATION: f64 = 0.01;

/// How badly straight rays explain a pixel, 0 to 1, by its squared error (Geman & McClure 1985).
pub(super) fn misfit(squared_error: f64) -> f64 {
    squared_error / (squared_error + SATURATION)
}
