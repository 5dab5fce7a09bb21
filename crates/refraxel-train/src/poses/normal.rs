//! What rays say of the six numbers of a camera: a quadratic model of their error.

use crate::least_squares::{outlier_weight, solved};

/// Entries of a matrix of six rows and columns.
const ENTRIES: usize = 36;
/// Rays whose root mean square error over the channels is this count a quarter.
const ROBUST: f64 = 0.1;
/// Rays whose colour changes by so much when the camera turns by a pixel count a quarter.
const STEEP: f64 = 0.5;
/// Damping of the normal equations, so that they have a solution.
const DAMPING: f64 = 1e-3;
/// How much where the data put a camera counts beside what rays say, in the mean of the latter.
const PRIOR: f64 = 0.003;
/// Numbers of a model.
pub(super) const NUMBERS: usize = ENTRIES + 6;

/// M and g of the error E(δ) ≈ E + g·δ + ½ δᵀ M δ.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Normal {
    /// Symmetric, row by row.
    matrix: [f64; ENTRIES],
    slope: [f64; 6],
}

/// What a ray counts in matrix and slope.
#[derive(Clone, Copy, Debug)]
pub(super) struct Weights {
    pub squared: f64,
    pub linear: f64,
}

impl Default for Normal {
    fn default() -> Self {
        Self { matrix: [0.0; ENTRIES], slope: [0.0; 6] }
    }
}

impl Normal {
    /// Forgets a part.
    pub(super) fn fade(&mut self, kept: f64) {
        self.matrix.iter_mut().chain(&mut self.slope).for_each(|m| *m *= kept);
    }

    /// A ray by the gradient s of its squared error, theory (8.3): s sᵀ/4|r|², at most Jᵀ J, which is half of what Gauss and Newton
    /// take. The scene gives way together with the camera. A ray that shows what it should says nothing, and one that sees something
    /// else a pixel further, as behind glass, says little: its error is no parabola. What it counted; `None`: nothing.
    pub(super) fn add_squared(&mut self, slope: [f64; 6], residual: [f32; 3], pixel: f64) -> Option<Weights> {
        let error: f64 = residual.iter().map(|r| f64::from(*r).powi(2)).sum();
        let scale = 1.0 / (4.0 * error + f64::from(f32::MIN_POSITIVE));
        let steepness: f64 = scale * slope.iter().map(|s| (s * pixel).powi(2)).sum::<f64>();
        let weight = robust(error) * outlier_weight(steepness, STEEP * STEEP);
        let weights = Weights { squared: weight * scale, linear: weight };
        (error > 0.0 && slope.iter().all(|s| s.is_finite())).then(|| {
            self.add(slope, weights);
            weights
        })
    }

    /// A residual r with its Jacobian J by its weight: 2 w J Jᵀ and 2 w r J.
    pub(super) fn add_linear(&mut self, jacobian: [f64; 6], residual: f64) {
        let weight = 2.0 * robust(residual * residual);
        if residual.is_finite() && jacobian.iter().all(|s| s.is_finite()) {
            self.add(jacobian, Weights { squared: weight, linear: weight * residual });
        }
    }

    fn add(&mut self, v: [f64; 6], Weights { squared, linear }: Weights) {
        for i in 0..6 {
            (0..6).for_each(|j| self.matrix[6 * i + j] += squared * v[i] * v[j]);
            self.slope[i] += linear * v[i];
        }
    }

    /// Something else has moved on which the error depends, and so its slope.
    pub(super) fn add_slope(&mut self, by: &[f64; 6]) {
        self.slope.iter_mut().zip(by).for_each(|(s, by)| *s += by);
    }

    /// What where the data put the camera counts.
    fn prior(&self) -> f64 {
        PRIOR * (0..6).map(|i| self.matrix[7 * i]).sum::<f64>() / 6.0
    }

    /// M⁻¹ v, with the prior.
    pub(super) fn following(&self, v: &[f64; 6]) -> Option<[f64; 6]> {
        let (mut matrix, prior) = (self.matrix, self.prior());
        (0..6).for_each(|i| matrix[7 * i] += prior);
        solved(&matrix, v, DAMPING).map(|x| std::array::from_fn(|k| x[k]))
    }

    /// The step to the least error, however long. Where the data put the camera, `from` there, has a say as well.
    pub(super) fn least(&self, from: [f64; 6]) -> Option<[f64; 6]> {
        let prior = self.prior();
        self.following(&std::array::from_fn(|i| -self.slope[i] - prior * from[i]))
    }

    /// The step to the least error, theory (8.4); shorter where it would be longer than `most`. Where the data put the camera,
    /// `from` there, has a say as well. `None` where nothing is known.
    pub(super) fn step(&self, most: f64, from: Option<[f64; 6]>) -> Option<[f64; 6]> {
        let step = match from {
            Some(from) => self.least(from)?,
            None => {
                let step = solved(&self.matrix, &self.slope.map(|s| -s), DAMPING)?;
                std::array::from_fn(|k| step[k])
            }
        };
        let half = |k: usize| step[k..k + 3].iter().map(|s| s * s).sum::<f64>().sqrt();
        let shorter = (most / half(0).max(half(3))).min(1.0);
        Some(step.map(|s| shorter * s))
    }

    /// The camera has moved: the same model around the place where it is now.
    pub(super) fn moved(&mut self, step: &[f64; 6]) {
        for (i, slope) in self.slope.iter_mut().enumerate() {
            *slope += (0..6).map(|j| self.matrix[6 * i + j] * step[j]).sum::<f64>();
        }
    }

    pub(super) fn numbers(&self) -> impl Iterator<Item = f64> {
        self.matrix.into_iter().chain(self.slope)
    }

    pub(super) fn of_numbers(numbers: [f64; NUMBERS]) -> Self {
        let (matrix, slope) =
            (std::array::from_fn(|k| numbers[k]), std::array::from_fn(|k| numbers[ENTRIES + k]));
        Self { matrix, slope }
    }
}

/// Weight of a ray of a squared error.
fn robust(squared_error: f64) -> f64 {
    outlier_weight(squared_error, 3.0 * ROBUST * ROBUST)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    #[test]
    fn a_quadratic_error_has_its_least_value_one_step_away() {
        let truth = [0.01, -0.02, 0.005, 0.0, 0.03, -0.01];
        let random = Random::new(2);
        let row = |k: u64| -> [f64; 6] { std::array::from_fn(|i| random.uniform(k, i as u64) - 0.5) };
        let mut normal = Normal::default();
        for k in 0..40 {
            let residual = -(0..6).map(|i| row(k)[i] * truth[i]).sum::<f64>();
            normal.add_linear(row(k), residual);
        }
        let step = normal.step(1.0, None).unwrap();
        assert!((0..6).all(|i| (step[i] - truth[i]).abs() < 0.01 * 0.03), "{step:?}");
        let before = normal.slope[4].abs();
        normal.moved(&truth);
        assert!(normal.slope.iter().all(|s| s.abs() < 1e-12 * before), "{:?}", normal.slope);
        let held = normal.step(1.0, Some(truth)).unwrap();
        assert!((0..6).all(|i| held[i] * truth[i] <= 0.0), "back to where the data put it: {held:?}");
        assert!(Normal::default().step(1.0, None).is_none());
    }

    #[test]
    fn a_long_step_is_shortened() {
        let mut normal = Normal::default();
        for i in 0..6 {
            normal.add_linear(std::array::from_fn(|k| f64::from(u8::from(k == i))), -0.02);
        }
        let step = normal.step(0.01, None).unwrap();
        let half = |k: usize| step[k..k + 3].iter().map(|s| s * s).sum::<f64>().sqrt();
        assert!((half(0) - 0.01).abs() < 1e-12 && (half(3) - 0.01).abs() < 1e-12);
    }

    #[test]
    fn the_gradient_of_one_channel_says_half_as_much_as_its_jacobian_and_leads_as_far() {
        let (jacobian, residual) = ([0.3, -0.1, 0.2, 0.5, 0.0, 1.0], 0.05_f32);
        let (mut by_gradient, mut by_jacobian) = (Normal::default(), Normal::default());
        let slope = jacobian.map(|j: f64| 2.0 * f64::from(residual) * j);
        by_gradient.add_squared(slope, [residual, 0.0, 0.0], 0.0);
        by_jacobian.add_linear(jacobian, f64::from(residual));
        let weights = robust(f64::from(residual).powi(2));
        for (k, (a, b)) in by_gradient.numbers().zip(by_jacobian.numbers()).enumerate() {
            let share = if k < ENTRIES { 0.5 } else { 1.0 };
            assert!((a - share * b).abs() < 1e-6 * weights, "{k}: {a} {b}");
        }
    }
}
