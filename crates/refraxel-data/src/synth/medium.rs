//! What fills a refractive body: an index, constant or graded, and a tint.

use super::vector;
use refraxel_core::{Vec3, vec3};
use serde::{Deserialize, Serialize};

/// The refractive index as a function of position.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Index {
    /// n everywhere.
    Constant {
        /// n [1].
        ior: f64,
    },
    /// Luneburg lens n² = 2 − r²/R², theory (6.5): images a far point onto its rim (Luneburg 1944).
    Luneburg {
        /// Centre [scene unit].
        #[serde(with = "vector")]
        center: Vec3<f64>,
        /// R [scene unit], where n = 1.
        radius: f64,
    },
    /// Maxwell's fish-eye n = 2 / (1 + r²/R²), theory (6.6): images each point of its rim onto the opposite one
    /// (Maxwell 1854).
    FishEye {
        /// Centre [scene unit].
        #[serde(with = "vector")]
        center: Vec3<f64>,
        /// R [scene unit], where n = 1.
        radius: f64,
    },
    /// A bump of warm or dense air, theory (6.9): n = 1 + (n0 − 1) exp(−r² / 2σ²).
    Gaussian {
        /// Centre [scene unit].
        #[serde(with = "vector")]
        center: Vec3<f64>,
        /// σ [scene unit].
        sigma: f64,
        /// n0 at the centre; below 1 for hot air.
        peak: f64,
    },
    /// Parabolic fibre or rod lens n² = n0² (1 − α² ρ²), theory (6.7); ρ = distance from the axis.
    Fibre {
        /// A point of the axis [scene unit].
        #[serde(with = "vector")]
        center: Vec3<f64>,
        /// Unit direction of the axis.
        #[serde(with = "vector")]
        axis: Vec3<f64>,
        /// n0 on the axis.
        ior: f64,
        /// α [1 / scene unit]; rays oscillate with period about 2π / α along the axis.
        alpha: f64,
    },
    /// Layers with n² linear in height, theory (6.8), as in an atmosphere that makes mirages; rays are parabolas.
    Layered {
        /// Height [scene unit] where n = `bottom`.
        z_bottom: f64,
        /// Height [scene unit] where n = `top`.
        z_top: f64,
        /// n at `z_bottom`.
        bottom: f64,
        /// n at `z_top`.
        top: f64,
    },
}

impl Index {
    /// The refractive index n(x).
    #[inline]
    pub fn n(&self, x: Vec3<f64>) -> f64 {
        match *self {
            Index::Constant { ior } => ior,
            Index::FishEye { center, radius } => {
                2.0 / (1.0 + (x - center).dot(x - center) / (radius * radius))
            }
            Index::Gaussian { center, sigma, peak } => {
                1.0 + (peak - 1.0) * (-0.5 * (x - center).dot(x - center) / (sigma * sigma)).exp()
            }
            Index::Luneburg { center, radius } => {
                (2.0 - (x - center).dot(x - center) / (radius * radius)).sqrt()
            }
            Index::Fibre { center, axis, ior, alpha } => {
                let across = (x - center) - axis * (x - center).dot(axis);
                ior * (1.0 - alpha * alpha * across.dot(across)).sqrt()
            }
            Index::Layered { z_bottom, z_top, bottom, top } => {
                let t = (x.z - z_bottom) / (z_top - z_bottom);
                (bottom * bottom * (1.0 - t) + top * top * t).sqrt()
            }
        }
    }

    /// The force ∇w = ∇(n²/2) [1 / scene unit] of dp/dt = ∇w.
    pub fn force(&self, x: Vec3<f64>) -> Vec3<f64> {
        match *self {
            Index::Constant { .. } => Vec3::zero(),
            Index::Luneburg { center, radius } => (x - center) * -(radius * radius).recip(),
            Index::FishEye { center, radius } => {
                let n = self.n(x);
                (x - center) * (-n * n * n / (radius * radius)) // n ∇n with ∇n = −n² r / R²
            }
            Index::Gaussian { center, sigma, .. } => {
                let n = self.n(x);
                (x - center) * (-n * (n - 1.0) / (sigma * sigma))
            }
            Index::Fibre { center, axis, ior, alpha } => {
                let across = (x - center) - axis * (x - center).dot(axis);
                across * -(ior * alpha * ior * alpha)
            }
            Index::Layered { z_bottom, z_top, bottom, top } => {
                vec3(0.0, 0.0, 0.5 * (top * top - bottom * bottom) / (z_top - z_bottom))
            }
        }
    }

    /// True where rays are straight.
    pub fn is_constant(&self) -> bool {
        matches!(self, Index::Constant { .. })
    }

    /// The formula, for people who read `scene.json`.
    pub fn formula(&self) -> &'static str {
        match self {
            Index::Constant { .. } => "ior",
            Index::Luneburg { .. } => "sqrt(2 - r^2/R^2) for r<=R, 1 outside",
            Index::FishEye { .. } => "2/(1 + r^2/R^2) for r<=R, 1 outside",
            Index::Gaussian { .. } => "1 + (peak - 1)*exp(-r^2/(2*sigma^2))",
            Index::Fibre { .. } => "ior*sqrt(1 - alpha^2*rho^2), rho = distance from the axis",
            Index::Layered { .. } => {
                "sqrt(bottom^2*(1 - t) + top^2*t), t = (z - z_bottom)/(z_top - z_bottom)"
            }
        }
    }
}

/// An index and a tint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Medium {
    /// Refractive index.
    pub index: Index,
    /// Beer–Lambert coefficient α per colour (red, green, blue) [1 / scene unit], >= 0.
    pub absorption: [f64; 3],
}

impl Medium {
    /// A clear medium of constant index.
    pub fn clear(ior: f64) -> Medium {
        Medium { index: Index::Constant { ior }, absorption: [0.0; 3] }
    }

    /// A clear medium of graded index.
    pub fn graded(index: Index) -> Medium {
        Medium { index, absorption: [0.0; 3] }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_force_is_the_gradient_of_half_n_squared() {
        let center = vec3(0.1, -0.2, 0.05);
        let axis = vec3(0.6, 0.0, 0.8);
        for index in [
            Index::Constant { ior: 1.5 },
            Index::Luneburg { center, radius: 0.5 },
            Index::FishEye { center, radius: 0.5 },
            Index::Gaussian { center, sigma: 0.2, peak: 1.3 },
            Index::Fibre { center, axis, ior: 1.6, alpha: 1.2 },
            Index::Layered { z_bottom: -0.7, z_top: 0.1, bottom: 1.5, top: 1.33 },
        ] {
            let (x, h) = (vec3(0.3, 0.1, -0.1), 1e-5);
            let w = |x| 0.5 * index.n(x) * index.n(x);
            let central = [vec3(h, 0.0, 0.0), vec3(0.0, h, 0.0), vec3(0.0, 0.0, h)]
                .map(|e| (w(x + e) - w(x - e)) / (2.0 * h));
            assert!((index.force(x) - central.into()).length() < 1e-8, "{index:?}");
        }
    }

    #[test]
    fn the_lenses_meet_the_air_without_a_step() {
        let center = Vec3::zero();
        for index in [Index::Luneburg { center, radius: 0.5 }, Index::FishEye { center, radius: 0.5 }] {
            assert!((index.n(vec3(0.3, 0.4, 0.0)) - 1.0).abs() < 1e-15);
        }
    }
}
