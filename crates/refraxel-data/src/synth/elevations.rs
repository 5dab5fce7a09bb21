//! How far above the horizontal plane cameras stand.

/// One degree [rad].
const DEGREE: f64 = std::f64::consts::PI / 180.0;

/// A range of elevations of cameras above the horizontal plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Elevations {
    /// Lowest [rad].
    pub low: f64,
    /// Highest [rad].
    pub high: f64,
}

impl Elevations {
    /// From 12° to 78° above the ground.
    pub const UPPER: Elevations = Elevations { low: 12.0 * DEGREE, high: 78.0 * DEGREE };
    /// All directions but those within 12° of straight up or down.
    pub const FULL: Elevations = Elevations { low: -78.0 * DEGREE, high: 78.0 * DEGREE };
    /// From 35° to 80°: into a basin.
    pub const STEEP: Elevations = Elevations { low: 35.0 * DEGREE, high: 80.0 * DEGREE };

    /// Both ends in degrees.
    pub fn degrees(&self) -> [f64; 2] {
        [self.low, self.high].map(f64::to_degrees)
    }
}
