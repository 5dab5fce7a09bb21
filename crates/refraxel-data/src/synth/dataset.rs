//! Which views a dataset has, and what rendering them costs.

use super::cameras::{CAMERA_ANGLE_X, CameraSet, cameras};
use super::hash::mix;
use super::render::{Frame, Sampling};
use super::scene::Scene;
use super::trace::Tally;
use crate::part::Part;
use refraxel_core::Camera;

/// How many views each split has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ViewCounts {
    /// Views to learn from.
    pub train: usize,
    /// Views for tuning.
    pub val: usize,
    /// Held-out views.
    pub test: usize,
}

impl Default for ViewCounts {
    /// Those of the path-traced scenes.
    fn default() -> ViewCounts {
        ViewCounts { train: 100, val: 10, test: 40 }
    }
}

impl ViewCounts {
    /// All views, without twins.
    pub fn total(&self) -> usize {
        self.train + self.val + self.test
    }

    /// The parts that have views.
    pub(super) fn parts(self) -> impl Iterator<Item = Part> {
        Part::ALL.into_iter().filter(move |part| self.of(*part) > 0)
    }

    /// Views of a part.
    pub(super) fn of(self, part: Part) -> usize {
        match part {
            Part::Train => self.train,
            Part::Val => self.val,
            Part::Test => self.test,
        }
    }
}

/// What a dataset is made with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DatasetOptions {
    /// Width and height [pixel].
    pub size: [u32; 2],
    /// Views per split.
    pub views: ViewCounts,
    /// From where the scene is seen.
    pub cameras: CameraSet,
    /// How their pixels are sampled; cameras are chosen by the same seed.
    pub sampling: Sampling,
}

impl DatasetOptions {
    /// The cameras of one split around a scene.
    pub fn split_cameras(&self, scene: &Scene, part: Part) -> Vec<Camera> {
        cameras(
            self.cameras.elevations(scene),
            self.views.of(part),
            mix(self.sampling.seed, 100 + part as u64),
            self.size,
        )
    }

    /// All views, twins apart, split by split.
    pub(super) fn planned_views(&self, scene: &Scene) -> Vec<PlannedView> {
        let of_part = |part| {
            let cameras = self.split_cameras(scene, part).into_iter().enumerate();
            cameras.map(move |(index, camera)| PlannedView { part, index, camera })
        };
        Part::ALL.into_iter().flat_map(of_part).collect()
    }
}

/// A view that is to be rendered.
#[derive(Clone, Copy, Debug)]
pub(super) struct PlannedView {
    pub part: Part,
    /// Its place in its split.
    pub index: usize,
    pub camera: Camera,
}

impl PlannedView {
    /// The number that the jitter of the view depends on; its twin has the same.
    pub fn number(&self) -> u64 {
        (self.part as u64) << 32 | self.index as u64
    }
}

/// What rendering has cost.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Cost {
    /// Camera rays.
    pub samples: u64,
    /// Flights from one surface to the next, and energy lost at the depth limit.
    pub tally: Tally,
    /// Wall-clock time [s].
    pub seconds: f64,
}

impl Cost {
    pub(super) fn of_frame(frame: &Frame) -> Cost {
        Cost { samples: frame.samples, tally: frame.tally, seconds: 0.0 }
    }

    pub(super) fn plus(self, o: Cost) -> Cost {
        Cost {
            samples: self.samples + o.samples,
            tally: self.tally.plus(o.tally),
            seconds: self.seconds + o.seconds,
        }
    }

    /// Camera rays per second of wall-clock time.
    pub fn rays_per_second(&self) -> f64 {
        self.samples as f64 / self.seconds
    }
}

/// Horizontal field of view of all cameras [rad], as `transforms_*.json` states it.
pub(super) const ANGLE: f64 = CAMERA_ANGLE_X;

#[cfg(test)]
mod tests {
    use super::super::render::render_view;
    use super::super::scenes::{SceneOptions, scene};
    use super::*;

    #[test]
    fn another_seed_gives_other_cameras_and_pictures() {
        let scene = scene("glass_ball", &SceneOptions::default()).unwrap();
        let views = ViewCounts { train: 1, val: 0, test: 0 };
        let [a, b] = [0, 1].map(|seed| {
            let sampling = Sampling { spp: 4, seed, ..Sampling::default() };
            let options = DatasetOptions { size: [24, 16], views, cameras: CameraSet::Upper, sampling };
            options.split_cameras(&scene, Part::Train)[0]
        });
        assert_ne!(a, b);
        let image =
            |seed| render_view(&scene, &a, 0, &Sampling { spp: 4, seed, ..Sampling::default() }).image();
        assert_ne!(image(0), image(1));
    }
}
