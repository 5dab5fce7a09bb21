//! Exposure and white balance of each photograph: three gains of light per view learn beside the scene, theory (8.7)–(8.9).

use crate::least_squares::outlier_weight;
use refraxel_core::radiance::Filter;
use refraxel_data::{quantile, quantize};
use serde::{Deserialize, Serialize};

/// Channels whose error is this count a quarter.
const ROBUST: f64 = 0.1;
/// A gain changes by at most so much at a time [natural logarithm].
const MOST: f64 = 0.05;
/// How much a gain of 1 counts beside what rays say. Gains that vary slowly with the direction of the camera look like colours
/// that do.
const PRIOR: f64 = 0.01;
/// Codes above this are cut off by the camera: they say nothing of a gain.
const CUT: f32 = 0.98;
/// Numbers of a view.
const PER_VIEW: usize = 9;
/// Rounds in which the gains of a view are fitted alone.
const ROUNDS: usize = 40;

/// The gains of all training views.
#[derive(Clone, Debug, PartialEq)]
pub struct Exposures {
    views: Vec<View>,
}

/// The gains of a view, per channel, and the quadratic model of its error.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct View {
    /// Natural logarithm of the light of the photograph by that of the scene.
    gain: [f64; 3],
    matrix: [f64; 3],
    slope: [f64; 3],
}

/// How far gains are from 1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ExposureShift {
    /// Largest one of a channel [stop].
    pub largest: f64,
    /// Median over the views of their largest one [stop].
    pub median: f64,
}

impl Exposures {
    /// Photographs that are taken as they are.
    pub fn new(views: usize) -> Self {
        Self { views: vec![View::default(); views] }
    }

    /// What makes the photograph of each view one of common exposure.
    pub fn filters(&self) -> Vec<Filter<f32>> {
        self.views.iter().map(|v| Filter::new(v.gain.map(|g| g as f32))).collect()
    }

    /// Natural logarithms of the gains of a view.
    pub fn gain(&self, view: usize) -> [f64; 3] {
        self.views[view].gain
    }

    /// How far they are from 1.
    pub fn shift(&self) -> ExposureShift {
        let largest = |v: &View| v.gain.iter().fold(0.0_f64, |m, g| m.max(g.abs())) / std::f64::consts::LN_2;
        let [largest, median] =
            [1.0, 0.5].map(|q| quantile(self.views.iter().map(largest), q).unwrap_or(0.0));
        ExposureShift { largest, median }
    }

    /// Takes note of what rays of some views show beside their targets of common exposure, and changes the gains; their mean over
    /// all views stays 1. `memory` is the share that is kept of what earlier rays said.
    pub fn learn(&mut self, views: &[usize], targets: &[[f32; 3]], residuals: &[[f32; 3]], memory: f64) {
        for view in &mut self.views {
            view.matrix.iter_mut().chain(&mut view.slope).for_each(|m| *m *= memory);
        }
        for ((view, target), residual) in views.iter().zip(targets).zip(residuals) {
            self.views[*view].add(*target, *residual);
        }
        self.views.iter_mut().for_each(|v| v.step(PRIOR));
        let count = self.views.len().max(1) as f64;
        for c in 0..3 {
            let mean = self.views.iter().map(|v| v.gain[c]).sum::<f64>() / count;
            self.views.iter_mut().for_each(|v| v.gain[c] -= mean);
        }
    }

    /// All numbers, view by view.
    pub fn to_numbers(&self) -> Vec<f64> {
        self.views.iter().flat_map(|v| [v.gain, v.matrix, v.slope]).flatten().collect()
    }

    /// The exposures of these numbers; `None` if they make no sense.
    pub fn of_numbers(numbers: &[f64]) -> Option<Self> {
        let is_sound = numbers.len().is_multiple_of(PER_VIEW) && numbers.iter().all(|n| n.is_finite());
        let part = |n: &[f64], first: usize| std::array::from_fn(|c| n[first + c]);
        let view = |n: &[f64]| View { gain: part(n, 0), matrix: part(n, 3), slope: part(n, 6) };
        is_sound.then(|| Self { views: numbers.chunks(PER_VIEW).map(view).collect() })
    }

    /// Number of views.
    pub fn len(&self) -> usize {
        self.views.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.views.is_empty()
    }
}

impl View {
    /// A ray with its target t' = F(photograph) and C − t', theory (8.8).
    fn add(&mut self, target: [f32; 3], residual: [f32; 3]) {
        let taken = Filter::new(self.gain.map(|g| -g as f32)).through(target).colour;
        if taken.iter().any(|c| *c > CUT) {
            return;
        }
        let by = Filter::clear().through(target).by_thickness;
        for c in 0..3 {
            let (j, r) = (-f64::from(by[c]), f64::from(residual[c]));
            let weight = outlier_weight(r * r, ROBUST * ROBUST);
            if (weight * j * r).is_finite() {
                self.matrix[c] += weight * j * j;
                self.slope[c] += weight * j * r;
            }
        }
    }

    fn step(&mut self, prior: f64) {
        for c in (0..3).filter(|&c| self.matrix[c] > 0.0) {
            let to_data = -self.slope[c] / self.matrix[c];
            let step = ((to_data - prior * self.gain[c]) / (1.0 + prior)).clamp(-MOST, MOST);
            self.gain[c] += step;
            self.slope[c] += self.matrix[c] * step;
        }
    }
}

/// Natural logarithms of the gains of a photograph that the scene was not learned from: those with which what is
/// `rendered` fits it best, by the pixels that are `chosen`.
pub fn fitted(rendered: &[[u8; 3]], truth: &[[u8; 3]], chosen: impl Fn(usize) -> bool) -> [f64; 3] {
    let code = |rgb: [u8; 3]| rgb.map(|c| f32::from(c) / 255.0);
    let pixels: Vec<usize> = (0..truth.len()).filter(|&p| chosen(p)).collect();
    let mut view = View::default();
    for _ in 0..ROUNDS {
        let filter = Filter::new(view.gain.map(|g| g as f32));
        (view.matrix, view.slope) = ([0.0; 3], [0.0; 3]);
        for &p in &pixels {
            let (seen, target) = (code(rendered[p]), filter.through(code(truth[p])).colour);
            view.add(target, [0, 1, 2].map(|c| seen[c] - target[c]));
        }
        view.step(0.0);
    }
    view.gain
}

/// The colours of a rendering as a photograph of these gains would show them.
pub fn exposed(rendered: &mut [[u8; 3]], gain: [f64; 3]) {
    let filter = Filter::new(gain.map(|g| -g as f32));
    for pixel in rendered {
        *pixel = filter.through(pixel.map(|c| f32::from(c) / 255.0)).colour.map(quantize);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    /// Codes of a scene.
    fn scene(k: u64) -> [f32; 3] {
        [0, 1, 2].map(|c| Random::new(1).uniform(k, c) as f32 * 0.8)
    }

    #[test]
    fn gains_of_photographs_are_found_up_to_their_mean() {
        let truth = [[0.3, 0.1, -0.1], [-0.2, 0.0, 0.2], [-0.1, -0.1, -0.1]];
        let taken =
            |view: usize, k: u64| Filter::new(truth[view].map(|g: f64| -g as f32)).through(scene(k)).colour;
        let mut exposures = Exposures::new(3);
        for step in 0..60 {
            let filters = exposures.filters();
            let (mut views, mut targets, mut residuals) = (Vec::new(), Vec::new(), Vec::new());
            for k in 0..90 {
                let (view, pixel) = ((k % 3) as usize, 90 * step + k);
                let target = filters[view].through(taken(view, pixel)).colour;
                views.push(view);
                residuals.push([0, 1, 2].map(|c| scene(pixel)[c] - target[c]));
                targets.push(target);
            }
            exposures.learn(&views, &targets, &residuals, 0.8);
        }
        for view in 0..3 {
            for c in 0..3 {
                assert!(
                    (exposures.gain(view)[c] - truth[view][c]).abs() < 0.01,
                    "{:?}",
                    exposures.gain(view)
                );
            }
        }
        let shift = exposures.shift();
        assert!((shift.largest - 0.3 / std::f64::consts::LN_2).abs() < 0.02 && shift.median < shift.largest);
        assert_eq!(Exposures::of_numbers(&exposures.to_numbers()), Some(exposures));
        assert!(Exposures::of_numbers(&[0.0; 7]).is_none());
    }

    #[test]
    fn a_photograph_alone_is_fitted_by_half_of_its_pixels() {
        let gain = [0.25, -0.1, 0.05];
        let code = |k: u64| scene(k).map(quantize);
        let rendered: Vec<[u8; 3]> = (0..400).map(code).collect();
        let mut photograph = rendered.clone();
        exposed(&mut photograph, gain);
        let found = fitted(&rendered, &photograph, |p| p % 2 == 0);
        assert!((0..3).all(|c| (found[c] - gain[c]).abs() < 0.01), "{found:?}");
        let mut again = rendered;
        exposed(&mut again, found);
        let worst = again.iter().zip(&photograph).flat_map(|(a, b)| (0..3).map(|c| a[c].abs_diff(b[c])));
        assert!(worst.max().unwrap() <= 2);
    }
}
