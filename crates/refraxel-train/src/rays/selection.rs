//! Which pixels batches draw from.

/// Which pixels a batch draws from.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Selection {
    /// All of them, evenly.
    #[default]
    All,
    /// Those that show nothing refractive, not even in part or so many pixels beside them.
    Outside(u32),
    /// All of them, but at least this share of the rays inside refractive masks.
    Inside(f64),
    /// Those inside refractive masks, each moved by up to so many pixels along both axes: the further outside, the fewer.
    Around(u32),
}
