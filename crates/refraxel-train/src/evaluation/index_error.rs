//! How far a reconstructed refractive index is from a known one.

use crate::model::Refraction;
use rayon::prelude::*;
use refraxel_core::{Vec3, vec3};
use refraxel_data::Dataset;
use refraxel_data::synth::IndexTruth;
use serde::{Deserialize, Serialize};

/// Cells along the longest edge of the lattice: enough that a finer one changes the means by less than their digits shown.
const CELLS: usize = 64;
/// Share of the truth's box added on each side, so that air around the object counts too.
const MARGIN: f64 = 0.1;

/// Mean errors of the index of refraction over the cells of a regular lattice.
///
/// *Boundary* cells lie within one lattice step of a refractive surface; *inside* and *outside* are the others. Places in
/// opaque bodies do not count. A mean over no cells is absent.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct IndexError {
    /// Mean reconstructed index inside.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mean_inside: Option<f64>,
    /// Mean true index inside.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub true_mean_inside: Option<f64>,
    /// Mean of |n − truth| inside.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mae_inside: Option<f64>,
    /// Mean of |n − truth| at the boundary.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mae_boundary: Option<f64>,
    /// Mean of |n − truth| outside.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mae_outside: Option<f64>,
}

/// Where a cell lies.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Place {
    Inside,
    Boundary,
    Outside,
}

/// Sums over the cells of one place.
#[derive(Clone, Copy, Default)]
struct Sums {
    cells: f64,
    n: f64,
    truth: f64,
    error: f64,
}

impl Sums {
    fn mean(&self, sum: f64) -> Option<f64> {
        (self.cells > 0.0).then(|| sum / self.cells)
    }
}

/// Compares the index `n(x)` with the truth over the truth's bounding box, enlarged by a fifth.
pub fn index_error(truth: &IndexTruth, n: impl Fn(Vec3<f64>) -> f64 + Sync) -> IndexError {
    let bounds = truth.bounding_box();
    let (low, extent) = (bounds.min - bounds.extent() * MARGIN, bounds.extent() * (1.0 + 2.0 * MARGIN));
    let step = extent.max_element() / CELLS as f64;
    let [nx, ny, nz] = extent.to_array().map(|e| (e / step).round().max(1.0) as usize);
    let layers: Vec<[Sums; 3]> = (0..nz)
        .into_par_iter()
        .map(|k| {
            let mut sums = [Sums::default(); 3];
            for (i, j) in (0..ny).flat_map(|j| (0..nx).map(move |i| (i, j))) {
                let x = low + vec3(i as f64 + 0.5, j as f64 + 0.5, k as f64 + 0.5) * step;
                add(truth, &n, (x, step), &mut sums);
            }
            sums
        })
        .collect();
    let total = |place: Place| {
        layers.iter().map(|l| l[place as usize]).fold(Sums::default(), |a, b| Sums {
            cells: a.cells + b.cells,
            n: a.n + b.n,
            truth: a.truth + b.truth,
            error: a.error + b.error,
        })
    };
    let (inside, boundary, outside) = (total(Place::Inside), total(Place::Boundary), total(Place::Outside));
    IndexError {
        mean_inside: inside.mean(inside.n),
        true_mean_inside: inside.mean(inside.truth),
        mae_inside: inside.mean(inside.error),
        mae_boundary: boundary.mean(boundary.error),
        mae_outside: outside.mean(outside.error),
    }
}

fn add(truth: &IndexTruth, n: impl Fn(Vec3<f64>) -> f64, (x, step): (Vec3<f64>, f64), sums: &mut [Sums; 3]) {
    if truth.is_opaque(x) {
        return;
    }
    let distance = truth.signed_distance_like(x);
    let place = match distance {
        d if d.abs() <= step => Place::Boundary,
        d if d < 0.0 => Place::Inside,
        _ => Place::Outside,
    };
    let (found, expected) = (n(x), truth.n(x));
    let s = &mut sums[place as usize];
    s.cells += 1.0;
    s.n += found;
    s.truth += expected;
    s.error += (found - expected).abs();
}

/// Errors of the index where the truth is known. Straight rays mean an index of 1 everywhere.
pub fn index_errors(data: &Dataset, refraction: &Refraction) -> Option<IndexError> {
    Some(index_error(&data.index_truth()?, |x| refraction.index(x.cast()).into()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn truth(entry: serde_json::Value) -> IndexTruth {
        IndexTruth::from_scene_json(&json!({ "refractive": [entry] })).unwrap()
    }

    fn ball() -> IndexTruth {
        truth(json!({ "shape": "sphere", "center": [0.1, -0.2, 0.3], "radius": 0.5, "ior": 1.5 }))
    }

    #[test]
    fn the_truth_itself_has_no_error() {
        let t = ball();
        let e = index_error(&t, |x| t.n(x));
        assert_eq!((e.mae_inside, e.mae_boundary, e.mae_outside), (Some(0.0), Some(0.0), Some(0.0)));
        assert!((e.mean_inside.unwrap() - 1.5).abs() < 1e-12);
    }

    #[test]
    fn straight_rays_are_wrong_by_the_contrast_inside_and_right_outside() {
        let e = index_error(&ball(), |_| 1.0);
        assert_eq!((e.mean_inside, e.true_mean_inside, e.mae_outside), (Some(1.0), Some(1.5), Some(0.0)));
        assert!((e.mae_inside.unwrap() - 0.5).abs() < 1e-12);
        // A shell of one step on each side: a little less than half of it lies inside.
        let h: f64 = 1.2 / 64.0;
        let volume = |r: f64| r.powi(3);
        let share = (volume(0.5) - volume(0.5 - h)) / (volume(0.5 + h) - volume(0.5 - h));
        assert!((e.mae_boundary.unwrap() - 0.5 * share).abs() < 0.01);
    }

    #[test]
    fn the_mean_of_a_graded_lens_is_its_integral() {
        let t = truth(json!({ "shape": "luneburg", "center": [0.0, 0.0, 0.0], "radius": 0.5 }));
        let e = index_error(&t, |_| 1.0);
        // n = √(2 − r²/R²), averaged over the ball of radius q R that lies farther than one step inside.
        let q = 1.0 - 1.2 / 64.0 / 0.5;
        let steps = 10_000;
        let shell = |i: usize| {
            let r = q * (i as f64 + 0.5) / f64::from(steps);
            3.0 * r * r * (2.0 - r * r).sqrt() / q.powi(3) * q / f64::from(steps)
        };
        let mean: f64 = (0..steps as usize).map(shell).sum();
        assert!((e.true_mean_inside.unwrap() - mean).abs() < 1e-3, "{e:?} {mean}");
        assert!((e.mae_inside.unwrap() - (mean - 1.0)).abs() < 1e-3);
    }

    #[test]
    fn opaque_places_do_not_count() {
        let json = json!({
            "refractive": [{ "shape": "box", "min": [0.0, 0.0, 0.0], "max": [1.0, 1.0, 1.0], "ior": 1.33 }],
            "opaque": [{ "shape": "box", "min": [0.2, 0.2, 0.2], "max": [0.8, 0.8, 0.8] }],
        });
        let t = IndexTruth::from_scene_json(&json).unwrap();
        let e = index_error(&t, |x| if t.is_opaque(x) { 9.0 } else { t.n(x) });
        assert_eq!(e.mae_inside, Some(0.0));
    }

    #[test]
    fn nested_and_borderless_media_are_measured() {
        use refraxel_data::synth::{SceneOptions, scene};
        for name in ["aquarium", "gaussian_bump"] {
            let t = IndexTruth::of_scene(&scene(name, &SceneOptions::default()).unwrap()).unwrap();
            let e = index_error(&t, |_| 1.0);
            assert!(
                (e.mae_inside.unwrap() - (e.true_mean_inside.unwrap() - 1.0)).abs() < 1e-9,
                "{name} {e:?}"
            );
            // The bump fades out beyond its border and never ends.
            assert!(e.mae_outside < Some(0.01) && e.mae_boundary > Some(0.01), "{name} {e:?}");
        }
    }
}
