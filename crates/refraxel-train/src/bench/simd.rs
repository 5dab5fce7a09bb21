//! The vector instructions that are measured with.

/// Name of the widest vector instructions that this machine has and the kernels use.
pub fn simd_level() -> String {
    let level = format!("{:?}", fearless_simd::Level::new()).to_lowercase();
    level.split('(').next().unwrap_or_default().to_owned()
}
