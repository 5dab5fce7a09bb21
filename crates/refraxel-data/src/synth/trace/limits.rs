//! How far rays are followed, and what that cost.

/// Whether interfaces reflect.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reflection {
    /// Fresnel reflection and transmission, both followed.
    On,
    /// Only transmission, with weight 1; total internal reflection still reflects.
    Off,
}

/// How far the tree of rays is followed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Whether interfaces reflect.
    pub reflection: Reflection,
    /// A branch that carries less than this share of its pixel sample is not followed; its energy is given to the
    /// other branch, so that weights always add up to 1.
    pub energy_cut: f64,
    /// Interfaces after which a ray is given up; what it still carries is reported as [`Tally::lost`].
    pub depth: u32,
    /// Error allowed per step in graded media [scene unit].
    pub tolerance: f64,
}

impl Default for Limits {
    fn default() -> Limits {
        Limits { reflection: Reflection::On, energy_cut: 1e-3, depth: 64, tolerance: 1e-9 }
    }
}

/// The cost of tracing.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tally {
    /// Flights from one surface to the next.
    pub flights: u64,
    /// Sum over samples of the energy that ended at the depth limit.
    pub lost: f64,
}

impl Tally {
    /// Sum of two tallies.
    pub fn plus(self, o: Tally) -> Tally {
        Tally { flights: self.flights + o.flights, lost: self.lost + o.lost }
    }
}
