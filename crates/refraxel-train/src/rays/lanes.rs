//! Which of its random numbers a ray takes for what.

/// Random numbers that a ray may take.
pub const LANES: u64 = 64;
/// The number that shifts its quadrature points; those before are the colour behind it.
pub const OFFSET_LANE: u64 = 3;
/// The numbers that move a pixel of a refractive mask along columns and rows.
pub const MOVE_LANES: [u64; 2] = [4, 5];
/// The first of the numbers that choose its pixel. That one is left out: the first pixel is the one whose turn it is.
pub const PIXEL_LANE: u64 = 8;
/// Pixels that must not be used are drawn again this often before the ray is given up.
pub const REDRAWS: u64 = 32;
