//! What a step did.

/// What a step did.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StepOutcome {
    /// The number that the step was submitted with.
    pub step: u64,
    /// Rays of the batch.
    pub rays: u64,
    /// Σ over rays of |C − target|², without priors.
    pub squared_error: f64,
    /// Samples whose colour was evaluated.
    pub samples: u64,
    /// Index samples, and lengths of paths in what absorbs, that were left out since the derivative of their path overflowed.
    pub overflows: u64,
    /// False when the squared error or a parameter was NaN or infinite.
    pub finite: bool,
}
