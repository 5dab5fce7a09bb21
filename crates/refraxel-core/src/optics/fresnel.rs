//! Fresnel's formulas: the share of the light that an interface mirrors, theory (7.1), and its transpose, theory (7.3).

use crate::Real;

/// A ray at an interface: normal momenta and w = n²/2 on both sides.
///
/// Normal momentum is n cos θ, so that Snell's law is part of the arguments: `before² − 2 w_before = after² − 2 w_after`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Incidence<T> {
    /// a = |p · m| on the side that the ray comes from [1], ≥ 0.
    pub before: T,
    /// s = |p · m| on the other side [1], ≥ 0; not both are 0.
    pub after: T,
    /// w₁ on the side that the ray comes from [1].
    pub w_before: T,
    /// w₂ on the other side [1].
    pub w_after: T,
}

impl<T: Real> Incidence<T> {
    /// Amplitudes r_s and r_p of the two polarisations, across and in the plane of incidence, theory (7.1).
    fn amplitudes(&self) -> [T; 2] {
        let Self { before: a, after: s, w_before, w_after } = *self;
        [(a - s) / (a + s), (w_after * a - w_before * s) / (w_after * a + w_before * s)]
    }

    /// Unpolarised reflectance R ∈ [0, 1], theory (7.1): 0.04 at normal incidence on n = 1.5, from either side.
    ///
    /// Source: Fresnel's formulas, Born and Wolf, section 1.5.2.
    pub fn reflectance(&self) -> T {
        let [s, p] = self.amplitudes();
        T::of(0.5) * (s * s + p * p)
    }

    /// Transpose of the derivative of [`Self::reflectance`], theory (7.3): dLoss/d(each field), in place of the fields. The
    /// four fields count as independent; the caller adds the derivative of `after` by the others. Finite on all of the
    /// domain.
    pub fn reflectance_vjp(&self, d_reflectance: T) -> Self {
        let Self { before: a, after: s, w_before, w_after } = *self;
        let [r_s, r_p] = self.amplitudes();
        // forward: r = (u − v) / (u + v), dr = 2 (v du − u dv) / (u + v)²
        let two = T::of(2.0);
        let slope = |r: T, u: T, v: T| d_reflectance * r * two / ((u + v) * (u + v));
        let by_s = slope(r_s, a, s);
        let (u, v) = (w_after * a, w_before * s);
        let by_p = slope(r_p, u, v);
        let (d_u, d_v) = (by_p * v, -by_p * u);
        Self {
            before: by_s * s + d_u * w_after,
            after: -by_s * a + d_v * w_before,
            w_before: d_v * s,
            w_after: d_u * a,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Light that meets an interface from index `n1` to `n2` at an angle with this cosine.
    fn at(cosine: f64, n1: f64, n2: f64) -> Incidence<f64> {
        let sine2 = n1 * n1 * (1.0 - cosine * cosine);
        Incidence {
            before: n1 * cosine,
            after: (n2 * n2 - sine2).sqrt(),
            w_before: 0.5 * n1 * n1,
            w_after: 0.5 * n2 * n2,
        }
    }

    #[test]
    fn glass_mirrors_four_per_cent_at_normal_incidence() {
        assert!((at(1.0, 1.0, 1.5).reflectance() - 0.04).abs() < 1e-15);
        assert!((at(1.0, 1.5, 1.0).reflectance() - 0.04).abs() < 1e-15);
    }

    #[test]
    fn one_polarisation_vanishes_at_brewsters_angle() {
        let brewster = 1.5_f64.atan();
        let i = at(brewster.cos(), 1.0, 1.5);
        let [s, p] = i.amplitudes();
        assert!(p.abs() < 1e-15 && (s + (1.5_f64.powi(2) - 1.0) / (1.5_f64.powi(2) + 1.0)).abs() < 1e-15);
        assert!((i.reflectance() - 0.5 * s * s).abs() < 1e-15);
    }

    #[test]
    fn everything_is_mirrored_at_grazing_incidence_and_at_the_critical_angle() {
        assert!((at(1e-9, 1.0, 1.5).reflectance() - 1.0).abs() < 1e-7);
        let critical = (1.0 - (1.0_f64 / 1.5).powi(2)).sqrt();
        assert!((at(critical * (1.0 + 1e-14), 1.5, 1.0).reflectance() - 1.0).abs() < 1e-5);
    }

    #[test]
    fn both_directions_of_a_ray_are_mirrored_alike() {
        for k in 1..20 {
            let there = at(0.05 * f64::from(k), 1.0, 1.7);
            let back = Incidence {
                before: there.after,
                after: there.before,
                w_before: there.w_after,
                w_after: there.w_before,
            };
            assert!((there.reflectance() - back.reflectance()).abs() < 1e-15);
        }
    }

    #[test]
    fn nothing_is_mirrored_where_the_index_does_not_change() {
        assert!(at(0.3, 1.4, 1.4).reflectance() < 1e-30);
    }

    #[test]
    fn derivatives_match_central_differences() {
        let e = 1e-6;
        for i in [at(0.9, 1.0, 1.5), at(0.2, 1.0, 1.33), at(0.95, 1.6, 1.0)] {
            let d = i.reflectance_vjp(0.7);
            let difference = |change: fn(&mut Incidence<f64>, f64)| {
                let along = |e: f64| {
                    let mut j = i;
                    change(&mut j, e);
                    0.7 * j.reflectance()
                };
                (along(e) - along(-e)) / (2.0 * e)
            };
            assert!((difference(|j, e| j.before += e) - d.before).abs() < 1e-9);
            assert!((difference(|j, e| j.after += e) - d.after).abs() < 1e-9);
            assert!((difference(|j, e| j.w_before += e) - d.w_before).abs() < 1e-9);
            assert!((difference(|j, e| j.w_after += e) - d.w_after).abs() < 1e-9);
        }
    }
}
