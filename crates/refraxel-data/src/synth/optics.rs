//! Refraction and reflection at a sharp interface, in closed form.

use refraxel_core::Vec3;

/// Direction after refraction, theory (6.1), Snell's law n1 sin θ1 = n2 sin θ2; `None` on total internal reflection.
///
/// `d` unit direction of travel, `normal` unit and facing the incoming ray (d · normal <= 0). Returns a unit vector.
/// The tangential momentum n d_t is what is conserved; the normal one follows from |d| = 1. Error: rounding only.
/// Not differentiable at the critical angle.
pub fn refract(d: Vec3<f64>, normal: Vec3<f64>, n1: f64, n2: f64) -> Option<Vec3<f64>> {
    let eta = n1 / n2;
    let cos1 = -d.dot(normal);
    let sin2_squared = eta * eta * (d + normal * cos1).dot(d + normal * cos1);
    if sin2_squared >= 1.0 {
        return None;
    }
    Some(((d + normal * cos1) * eta - normal * (1.0 - sin2_squared).sqrt()).normalized())
}

/// Mirrored direction d − 2 (d · n) n, theory (6.1); unit when `d` and `normal` are.
pub fn reflect(d: Vec3<f64>, normal: Vec3<f64>) -> Vec3<f64> {
    (d - normal * (2.0 * d.dot(normal))).normalized()
}

/// Unpolarised Fresnel reflectance R = (r_s² + r_p²) / 2 of a lossless interface, theory (6.2); transmittance is 1 − R.
///
/// `cos1` = cosine of the angle of incidence in [0, 1], travelling from index `n1` into `n2`. Returns 1 beyond the
/// critical angle. Worked number: normal incidence, 1 → 1.5: R = 0.04.
/// Source: Born & Wolf, Principles of Optics, § 1.5.2.
pub fn fresnel(cos1: f64, n1: f64, n2: f64) -> f64 {
    let eta = n1 / n2;
    let sin2_squared = eta * eta * (1.0 - cos1 * cos1);
    if sin2_squared >= 1.0 {
        return 1.0;
    }
    let cos2 = (1.0 - sin2_squared).sqrt();
    let s = (n1 * cos1 - n2 * cos2) / (n1 * cos1 + n2 * cos2);
    let p = (n2 * cos1 - n1 * cos2) / (n2 * cos1 + n1 * cos2);
    0.5 * (s * s + p * p)
}

/// Beer–Lambert transmittance exp(−α s) per colour, theory (6.4); `absorption` α [1 / scene unit] >= 0, `length` s
/// [scene unit].
pub fn transmittance(absorption: [f64; 3], length: f64) -> [f64; 3] {
    absorption.map(|a| if a == 0.0 { 1.0 } else { (-a * length).exp() })
}

#[cfg(test)]
mod tests {
    use super::*;
    use refraxel_core::vec3;

    const TOL: f64 = 1e-12; // f64 eps times the dozens of operations of one interface
    const UP: Vec3<f64> = Vec3::new(0.0, 0.0, 1.0);

    fn falling(angle: f64) -> Vec3<f64> {
        vec3(angle.sin() * 0.6, angle.sin() * 0.8, -angle.cos())
    }

    #[test]
    fn refraction_obeys_snells_law_in_the_plane_of_incidence() {
        for (n1, n2) in [(1.0, 1.5), (1.5, 1.0), (1.33, 2.4)] {
            for k in 0..40 {
                let d = falling(f64::from(k) * 0.018);
                let Some(t) = refract(d, UP, n1, n2) else { continue };
                assert!((n2 * t.cross(UP).length() - n1 * d.cross(UP).length()).abs() < TOL);
                assert!((t.length() - 1.0).abs() < TOL && t.z < 0.0);
                assert!(d.cross(UP).dot(t).abs() < TOL, "leaves the plane of incidence");
            }
        }
    }

    #[test]
    fn basic_radiance_is_invariant_because_tangential_momentum_is() {
        // n² cos θ dΩ is the area that a cone of rays covers in tangential momentum; equal areas mean equal L/n².
        let (n1, n2) = (1.0, 1.7);
        let area = |n: f64, a: Vec3<f64>, b: Vec3<f64>| n * n * (a.x * b.y - a.y * b.x);
        let (a, b) = (falling(0.4), vec3(0.1, -0.3, -1.0).normalized());
        let (ta, tb) = (refract(a, UP, n1, n2).unwrap(), refract(b, UP, n1, n2).unwrap());
        assert!((area(n1, a, b) - area(n2, ta, tb)).abs() < 1e-10);
    }

    #[test]
    fn total_reflection_starts_at_the_critical_angle() {
        let critical = (1.0_f64 / 1.5).asin();
        assert!(refract(falling(critical - 1e-7), UP, 1.5, 1.0).is_some());
        assert!(refract(falling(critical + 1e-7), UP, 1.5, 1.0).is_none());
        assert_eq!(fresnel((critical + 1e-7).cos(), 1.5, 1.0), 1.0);
    }

    #[test]
    fn fresnel_matches_its_sine_and_tangent_forms() {
        for (n1, n2) in [(1.0_f64, 1.5_f64), (1.5, 1.0), (1.33, 1.0), (1.0, 2.42)] {
            for k in 1..60 {
                let a = f64::from(k) * 0.026;
                if n1 / n2 * a.sin() >= 1.0 {
                    continue;
                }
                let b = (n1 / n2 * a.sin()).asin();
                let (s, p) = ((a - b).sin() / (a + b).sin(), (a - b).tan() / (a + b).tan());
                assert!((fresnel(a.cos(), n1, n2) - 0.5 * (s * s + p * p)).abs() < TOL);
            }
        }
    }

    #[test]
    fn normal_incidence_and_brewsters_angle_are_the_textbook_values() {
        assert!((fresnel(1.0, 1.0, 1.5) - 0.04).abs() < TOL);
        let brewster = 1.5_f64.atan();
        // Only s-polarised light is reflected there: R = (cos 2θ)² / 2.
        assert!((fresnel(brewster.cos(), 1.0, 1.5) - 0.5 * (2.0 * brewster).cos().powi(2)).abs() < TOL);
    }

    #[test]
    fn reflectance_is_the_same_from_both_sides() {
        for k in 0..50 {
            let d = falling(f64::from(k) * 0.03);
            let t = refract(d, UP, 1.0, 1.5).unwrap();
            assert!((fresnel(-d.z, 1.0, 1.5) - fresnel(-t.z, 1.5, 1.0)).abs() < 1e-10);
        }
    }

    #[test]
    fn energy_of_the_two_fields_adds_up_to_one() {
        // T from the transmitted amplitudes (not as 1 − R): n2 cos θ2 / (n1 cos θ1) |t|², averaged over s and p.
        for k in 0..52 {
            let (n1, n2, cos1) = (1.0, 1.5, (f64::from(k) * 0.03).cos());
            let cos2 = (1.0_f64 - (n1 / n2) * (n1 / n2) * (1.0 - cos1 * cos1)).sqrt();
            let ts = 2.0 * n1 * cos1 / (n1 * cos1 + n2 * cos2);
            let tp = 2.0 * n1 * cos1 / (n2 * cos1 + n1 * cos2);
            let transmitted = n2 * cos2 / (n1 * cos1) * 0.5 * (ts * ts + tp * tp);
            assert!((fresnel(cos1, n1, n2) + transmitted - 1.0).abs() < 1e-10);
        }
    }

    #[test]
    fn tint_multiplies_along_a_path() {
        let a = [0.3, 0.0, 2.0];
        let (one, two) = (transmittance(a, 0.4), transmittance(a, 0.8));
        for c in 0..3 {
            assert!((one[c] * one[c] - two[c]).abs() < TOL);
        }
    }
}
