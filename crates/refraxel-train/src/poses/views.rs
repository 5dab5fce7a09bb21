//! The poses of all training views.

use super::correction::Correction;
use super::lens::{LensCorrection, Lenses};
use super::normal::Normal;
use super::shift::PoseShift;
use refraxel_core::{Camera, Pose};
use refraxel_data::quantile;

/// The poses of all training views.
#[derive(Clone, Debug, PartialEq)]
pub struct Poses {
    pub(super) given: Vec<Pose>,
    /// Distance of the cameras from the scene: what a turn of 1 rad counts like [scene unit].
    pub(super) unit: f64,
    pub(super) views: Vec<View>,
    /// Their lenses, if these learn.
    pub(super) lenses: Option<Lenses>,
}

#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct View {
    pub(super) correction: Correction,
    pub(super) normal: Normal,
}

impl Poses {
    /// Cameras at such a distance from the scene, where the data put them.
    pub fn new(given: Vec<Pose>, distance: f64) -> Self {
        let views = vec![View::default(); given.len()];
        Self { given, unit: distance, views, lenses: None }
    }

    /// The same, with lenses that learn from what the data say of these cameras, one per view.
    ///
    /// # Panics
    /// If there is not one camera per view.
    #[must_use]
    pub fn with_lenses(self, given: &[Camera]) -> Self {
        assert_eq!(given.len(), self.len(), "one camera per view");
        Self { lenses: Some(Lenses::new(given)), ..self }
    }

    /// The camera of a view, which the data put here.
    pub fn camera(&self, view: usize, given: &Camera) -> Camera {
        Camera { world_from_camera: self.pose(view), ..self.lens(view).of(given) }
    }

    /// How far the lens of a view is from what the data say.
    pub fn lens(&self, view: usize) -> LensCorrection {
        self.lenses.as_ref().map(|l| l.of_view(view)).unwrap_or_default()
    }

    /// Whether lenses learn, too.
    pub fn learns_lenses(&self) -> bool {
        self.lenses.is_some()
    }

    /// Where the camera of a view is.
    pub fn pose(&self, view: usize) -> Pose {
        self.views[view].correction.of(&self.given[view])
    }

    /// How far that is from where the data put them.
    pub fn shift(&self) -> PoseShift {
        let all = || self.views.iter().map(|v| v.correction);
        let turn = |q| quantile(all().map(|c| c.rotation.length().to_degrees()), q).unwrap_or(0.0);
        let way = |q| quantile(all().map(|c| c.translation.length()), q).unwrap_or(0.0);
        let [largest_turn, median_turn] = [1.0, 0.5].map(turn);
        let [largest_way, median_way] = [1.0, 0.5].map(way);
        let lens = self.lenses.as_ref().map(Lenses::shift);
        PoseShift { largest_turn, median_turn, largest_way, median_way, lens }
    }

    /// The same cameras, where the data put them.
    #[must_use]
    pub fn forgotten(&self) -> Self {
        let lenses = self.lenses.as_ref().map(Lenses::forgotten);
        Self { lenses, ..Self::new(self.given.clone(), self.unit) }
    }

    /// Distance of the cameras from the scene [scene unit].
    pub fn unit(&self) -> f64 {
        self.unit
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
