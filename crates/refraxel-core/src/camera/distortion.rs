//! The smooth map of the image plane behind every polynomial lens model, and its inverse.

/// Radial (rational), tangential and thin-prism distortion of a point q = (u, v) of the plane, theory (1.3).
///
/// With r² = u² + v² and ρ = (1 + Σ kᵢ r²ⁱ) / (1 + Σ bᵢ r²ⁱ):
/// u' = u ρ + 2 p1 u v + p2 (r² + 2u²) + s1 r²,
/// v' = v ρ + 2 p2 u v + p1 (r² + 2v²) + s2 r².
/// Source: Brown 1971; OpenCV and COLMAP camera models.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Distortion {
    /// k: numerator coefficients of r², r⁴, r⁶, r⁸.
    pub radial: [f64; 4],
    /// b: denominator coefficients of r², r⁴, r⁶.
    pub denominator: [f64; 3],
    /// Tangential p1, p2.
    pub p: [f64; 2],
    /// Thin prism s1, s2.
    pub s: [f64; 2],
}

/// Rows of the derivative of (u', v') by (u, v).
pub(super) type Jacobian = [[f64; 2]; 2];

/// Accepted error of the inverse [focal length]: 1e-9 of 1000 pixels is a millionth of a pixel.
const RESIDUAL: f64 = 1e-9;
/// Newton converges quadratically; a start that needs more than this is not in the basin.
const ITERATIONS: usize = 20;
/// Points between the centre and q where one-to-one is checked: a fold narrower than 1/12 of the radius is not seen.
const FOLD_SAMPLES: usize = 12;
/// Steps from the centre outwards when Newton from the distorted point itself fails.
const CONTINUATION_STEPS: usize = 8;

impl Distortion {
    /// The distorted point and the derivative there.
    pub fn apply(&self, [u, v]: [f64; 2]) -> ([f64; 2], Jacobian) {
        let ([p1, p2], [s1, s2]) = (self.p, self.s);
        let r2 = u * u + v * v;
        let (rho, d_rho) = self.radial_factor(r2);
        let distorted = [
            u * rho + 2.0 * p1 * u * v + p2 * (r2 + 2.0 * u * u) + s1 * r2,
            v * rho + 2.0 * p2 * u * v + p1 * (r2 + 2.0 * v * v) + s2 * r2,
        ];
        let cross = 2.0 * u * v * d_rho + 2.0 * p1 * u + 2.0 * p2 * v;
        let jacobian = [
            [rho + 2.0 * u * u * d_rho + 2.0 * p1 * v + 6.0 * p2 * u + 2.0 * s1 * u, cross + 2.0 * s1 * v],
            [cross + 2.0 * s2 * u, rho + 2.0 * v * v * d_rho + 2.0 * p2 * u + 6.0 * p1 * v + 2.0 * s2 * v],
        ];
        (distorted, jacobian)
    }

    /// (ρ, dρ/dr²) at r², by Horner's rule.
    fn radial_factor(&self, r2: f64) -> (f64, f64) {
        let [k1, k2, k3, k4] = self.radial;
        let [b1, b2, b3] = self.denominator;
        let numerator = 1.0 + r2 * (k1 + r2 * (k2 + r2 * (k3 + r2 * k4)));
        let d_numerator = k1 + r2 * (2.0 * k2 + r2 * (3.0 * k3 + r2 * 4.0 * k4));
        let denominator = 1.0 + r2 * (b1 + r2 * (b2 + r2 * b3));
        let d_denominator = b1 + r2 * (2.0 * b2 + r2 * 3.0 * b3);
        let rho = numerator / denominator;
        (rho, (d_numerator - rho * d_denominator) / denominator)
    }

    /// True when the map keeps its orientation all the way from the centre to `q`, so that no other point nearer to
    /// the centre on the same spoke has the same image.
    pub fn one_to_one_up_to(&self, [u, v]: [f64; 2]) -> bool {
        self.is_mild(u * u + v * v) || self.keeps_orientation([u, v])
    }

    /// Whether the derivative differs from the identity by less than 1 in norm everywhere within a radius. It then keeps its
    /// orientation: its symmetric part is positive definite. Sufficient, and cheaper than looking:
    /// Σ (2i + 1) |kᵢ| r²ⁱ + (8 (|p1| + |p2|) + 2 (|s1| + |s2|)) r bounds the norm.
    fn is_mild(&self, r2: f64) -> bool {
        let [k1, k2, k3, k4] = self.radial.map(f64::abs);
        let radial = r2 * (3.0 * k1 + r2 * (5.0 * k2 + r2 * (7.0 * k3 + r2 * 9.0 * k4)));
        let [p, s] = [self.p, self.s].map(|[a, b]| a.abs() + b.abs());
        self.denominator == [0.0; 3] && radial + (8.0 * p + 2.0 * s) * r2.sqrt() < 1.0
    }

    /// Whether the derivative keeps its orientation at points from the centre to `q`.
    fn keeps_orientation(&self, [u, v]: [f64; 2]) -> bool {
        (0..=FOLD_SAMPLES).all(|i| {
            let t = i as f64 / FOLD_SAMPLES as f64;
            let (_, j) = self.apply([t * u, t * v]);
            determinant(&j) > 0.0 && j[0][0] + j[1][1] > 0.0
        })
    }

    /// The point that is distorted to `target`, on the branch that contains the centre.
    pub fn invert(&self, target: [f64; 2]) -> Option<[f64; 2]> {
        let accept = |q: [f64; 2]| self.one_to_one_up_to(q).then_some(q);
        self.newton(target, target).and_then(accept).or_else(|| self.follow(target).and_then(accept))
    }

    /// Continuation: Newton's method for points along the spoke towards `target`, each from the last solution. Finds strong
    /// distortions, for which Newton's method from the target itself leaves its basin.
    fn follow(&self, target: [f64; 2]) -> Option<[f64; 2]> {
        (1..=CONTINUATION_STEPS).try_fold([0.0, 0.0], |q, i| {
            let t = i as f64 / CONTINUATION_STEPS as f64;
            self.newton([t * target[0], t * target[1]], q)
        })
    }

    /// Newton's method for `apply(q) = target`.
    fn newton(&self, target: [f64; 2], start: [f64; 2]) -> Option<[f64; 2]> {
        let mut q = start;
        for _ in 0..ITERATIONS {
            let (distorted, j) = self.apply(q);
            let error = [distorted[0] - target[0], distorted[1] - target[1]];
            let det = determinant(&j);
            let step = [
                (j[1][1] * error[0] - j[0][1] * error[1]) / det,
                (j[0][0] * error[1] - j[1][0] * error[0]) / det,
            ];
            if error[0].hypot(error[1]) < RESIDUAL {
                // One more step is free accuracy, except at the fold where the derivative vanishes.
                let polished = [q[0] - step[0], q[1] - step[1]];
                return Some(if step[0].hypot(step[1]) < RESIDUAL { polished } else { q });
            }
            q = [q[0] - step[0], q[1] - step[1]];
        }
        None
    }
}

/// Determinant of a 2×2 matrix of rows: > 0 where the map keeps its orientation.
fn determinant(j: &Jacobian) -> f64 {
    j[0][0] * j[1][1] - j[0][1] * j[1][0]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn jacobian_is_the_central_difference_of_the_map() {
        let distortion = Distortion {
            radial: [0.1, -0.2, 0.05, 0.01],
            denominator: [0.07, -0.02, 0.01],
            p: [0.01, -0.02],
            s: [0.03, 0.015],
        };
        let (q, h) = ([0.4, -0.3], 1e-5);
        let (_, j) = distortion.apply(q);
        for column in 0..2 {
            let (mut plus, mut minus) = (q, q);
            plus[column] += h;
            minus[column] -= h;
            let (a, b) = (distortion.apply(plus).0, distortion.apply(minus).0);
            for row in 0..2 {
                let difference = (a[row] - b[row]) / (2.0 * h);
                assert!((j[row][column] - difference).abs() < 1e-9, "entry ({row}, {column})"); // h² third derivative
            }
        }
    }

    #[test]
    fn what_is_called_mild_keeps_its_orientation() {
        let mut mild = 0;
        for k in 0..4000 {
            // Coefficients and points that cover −½..½ evenly, by the golden ratio and its relatives.
            let at = |i: i32| (f64::from(k) * 1.220_744_084_605_76_f64.powi(-i)).fract() - 0.5;
            let distortion = Distortion {
                radial: [at(1), at(2), at(3), at(4)],
                denominator: [0.0; 3],
                p: [0.2 * at(5), 0.2 * at(6)],
                s: [0.2 * at(7), 0.2 * at(8)],
            };
            let [u, v] = [2.0 * at(9), 2.0 * at(10)];
            if distortion.is_mild(u * u + v * v) {
                mild += 1;
                assert!(distortion.keeps_orientation([u, v]), "{distortion:?} at {u}, {v}");
            }
        }
        assert!((400..3600).contains(&mild), "{mild}");
        let barrel = Distortion { radial: [-0.4, 0.0, 0.0, 0.0], ..Distortion::default() };
        assert!(barrel.one_to_one_up_to([0.6, 0.6]) && !barrel.one_to_one_up_to([0.8, 0.8]));
        let rational = Distortion { denominator: [0.1, 0.0, 0.0], ..Distortion::default() };
        assert!(!rational.is_mild(0.01), "only looked at");
    }

    #[test]
    fn a_strong_pincushion_is_inverted_from_a_point_at_twice_the_radius() {
        let distortion = Distortion { radial: [0.0, 0.0, 0.0, 0.5], ..Distortion::default() };
        let q = [0.9, 0.6];
        let found = distortion.invert(distortion.apply(q).0).unwrap();
        assert!((found[0] - q[0]).abs() < 1e-9 && (found[1] - q[1]).abs() < 1e-9);
    }
}
