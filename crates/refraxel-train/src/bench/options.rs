//! How much is measured.

/// Size and patience of a benchmark.
#[derive(Clone, Copy, Debug)]
pub struct BenchOptions {
    /// Nodes per axis.
    pub resolution: u32,
    /// Rays of a batch.
    pub rays: usize,
    /// Repetitions; the best counts.
    pub repetitions: usize,
}

impl BenchOptions {
    /// A benchmark of a minute, or of a few seconds.
    pub fn suited_to(quick: bool) -> Self {
        let (rays, repetitions) = if quick { (4096, 3) } else { (16_384, 15) };
        Self { resolution: 128, rays, repetitions }
    }
}
