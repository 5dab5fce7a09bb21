//! Poses as numbers, as checkpoints store them.

use super::correction::Correction;
use super::lens::Lenses;
use super::normal::{NUMBERS, Normal};
use super::views::{Poses, View};
use refraxel_core::{Mat3, Pose, Vec3};

/// Numbers that say all of a view: where the data put it, its correction and its normal equations.
const PER_VIEW: usize = 12 + 6 + NUMBERS;

impl Poses {
    /// All that there is to know of them but their lenses: the unit, then view by view.
    pub fn to_numbers(&self) -> Vec<f64> {
        let mut all = vec![self.unit];
        for (given, view) in self.given.iter().zip(&self.views) {
            all.extend(given.rotation.rows().as_flattened());
            all.extend(given.translation.to_array());
            all.extend(view.correction.numbers(1.0));
            all.extend(view.normal.numbers());
        }
        all
    }

    /// All that there is to know of their lenses, if these learn.
    pub fn lenses_to_numbers(&self) -> Option<Vec<f64>> {
        self.lenses.as_ref().map(Lenses::to_numbers)
    }

    /// The same poses with the lenses of these numbers; `None` if those make no sense.
    #[must_use]
    pub fn with_lenses_of_numbers(self, numbers: &[f64]) -> Option<Self> {
        let lenses = Lenses::of_numbers(numbers).filter(|l| l.len() == self.len())?;
        Some(Self { lenses: Some(lenses), ..self })
    }

    /// The poses of these numbers, with the lenses of the data; `None` if they make no sense.
    pub fn of_numbers(numbers: &[f64]) -> Option<Self> {
        let (&unit, views) = numbers.split_first()?;
        let is_sound =
            unit > 0.0 && views.len().is_multiple_of(PER_VIEW) && numbers.iter().all(|n| n.is_finite());
        let part = |n: &[f64], first: usize| Vec3 { x: n[first], y: n[first + 1], z: n[first + 2] };
        let given = |n: &[f64]| {
            let rotation = Mat3 { columns: [0, 3, 6].map(|k| part(n, k)) }.transpose();
            Pose { rotation, translation: part(n, 9) }
        };
        let view = |n: &[f64]| View {
            correction: Correction { rotation: part(n, 12), translation: part(n, 15) },
            normal: Normal::of_numbers(std::array::from_fn(|k| n[18 + k])),
        };
        is_sound.then(|| Self {
            given: views.chunks(PER_VIEW).map(given).collect(),
            unit,
            views: views.chunks(PER_VIEW).map(view).collect(),
            lenses: None,
        })
    }
}
