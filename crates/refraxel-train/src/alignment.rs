//! What the photographs themselves learn beside the scene.

use crate::exposures::Exposures;
use crate::poses::Poses;
use refraxel_core::Camera;
use refraxel_data::Dataset;

/// Where the cameras of the training views are, and how their photographs are exposed, as far as a run learns that.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Alignment {
    /// Where the cameras are.
    pub poses: Option<Poses>,
    /// How the photographs are exposed.
    pub exposures: Option<Exposures>,
}

impl Alignment {
    /// Whether anything of it learns.
    pub fn learns(&self) -> bool {
        self.poses.is_some() || self.exposures.is_some()
    }

    /// The cameras of all views of a dataset: of those trained on as learned, of others where the data put them, with lenses as
    /// learned.
    pub fn cameras(&self, data: &Dataset) -> Vec<Camera> {
        let training = || data.split.train.iter().map(|&i| &data.views[i].camera);
        let mut all: Vec<Camera> = data.views.iter().map(|v| self.with_lens(&v.camera, training())).collect();
        if let Some(poses) = &self.poses {
            data.split
                .train
                .iter()
                .enumerate()
                .for_each(|(k, &i)| all[i] = poses.camera(k, &data.views[i].camera));
        }
        all
    }

    /// A camera of the data with its lens as learned, if training views, whose cameras these are, were taken with it.
    pub fn with_lens<'a>(&self, given: &Camera, mut training: impl Iterator<Item = &'a Camera>) -> Camera {
        let Some(poses) = self.poses.as_ref().filter(|p| p.learns_lenses()) else { return *given };
        let view = training.position(|c| c.has_lens_of(given));
        view.map_or(*given, |view| poses.lens(view).of(given))
    }

    /// The same before it has learned anything.
    #[must_use]
    pub fn forgotten(&self) -> Self {
        let poses = self.poses.as_ref().map(Poses::forgotten);
        let exposures = self.exposures.as_ref().map(|e| Exposures::new(e.len()));
        Self { poses, exposures }
    }
}
