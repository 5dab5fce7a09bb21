//! The views of a scene rendered in memory: cameras, pictures, masks and truth, without files.

use super::cameras::{CAMERA_ANGLE_X, CameraSet, cameras};
use super::hash::mix;
use super::render::{Frame, Sampling, refracts, render_view};
use super::scene::{Environment, Scene};
use super::texture::srgb_from_linear;
use super::trace::{Limits, Tally};
use super::truth::IndexTruth;
use crate::dataset::Split;
use crate::image::{Image, Mask};
use crate::part::Part;
use rayon::prelude::*;
use refraxel_core::Camera;
use std::time::Instant;

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

    /// Those of a part.
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
    /// Choice of cameras and of the jitter in pixels.
    pub seed: u64,
    /// Samples per pixel.
    pub spp: u32,
    /// Samples per pixel with detail; 0 or at most `spp`: none.
    pub detail_spp: u32,
    /// How far rays are followed.
    pub limits: Limits,
    /// Also render the test views without refractive bodies.
    pub twins: bool,
}

impl Default for DatasetOptions {
    fn default() -> DatasetOptions {
        DatasetOptions {
            size: [200, 200],
            views: ViewCounts::default(),
            cameras: CameraSet::Upper,
            seed: 0,
            spp: 16,
            detail_spp: 0,
            limits: Limits::default(),
            twins: false,
        }
    }
}

impl DatasetOptions {
    pub(super) fn sampling(&self) -> Sampling {
        Sampling { spp: self.spp, detail_spp: self.detail_spp, seed: self.seed, limits: self.limits }
    }

    /// The cameras of one split around a scene.
    pub fn split_cameras(&self, scene: &Scene, part: Part) -> Vec<Camera> {
        cameras(
            self.cameras.elevations(scene),
            self.views.of(part),
            mix(self.seed, 100 + part as u64),
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

/// One view in memory.
#[derive(Clone, Debug)]
pub struct SynthView {
    /// Its split.
    pub part: Part,
    /// File name that it has on disk, e.g. `r_0.png`.
    pub name: String,
    /// Pose and intrinsics.
    pub camera: Camera,
    /// sRGB, 8 bits.
    pub image: Image,
    /// Coverage by refractive bodies as first thing seen.
    pub mask: Mask,
    /// The same view without refractive bodies; test views only, and only with [`DatasetOptions::twins`].
    pub twin: Option<Image>,
}

/// A dataset in memory.
#[derive(Clone, Debug)]
pub struct SynthDataset {
    /// Train, validation and test views, in this order.
    pub views: Vec<SynthView>,
    /// Indices into `views`.
    pub split: Split,
    /// sRGB colour behind everything, where it is one colour.
    pub background: Option<[u8; 3]>,
    /// The index as a function of position; `None` for scenes without refraction.
    pub truth: Option<IndexTruth>,
    /// What rendering has cost.
    pub cost: Cost,
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

/// The one sRGB colour behind a scene.
pub(super) fn background_of(scene: &Scene) -> Option<[u8; 3]> {
    match scene.environment {
        Environment::Constant(c) => Some(c.map(|v| (255.0 * srgb_from_linear(v)).round() as u8)),
        Environment::Sky { .. } | Environment::Landscape { .. } => None,
    }
}

/// Renders all views of a scene in memory, on the current rayon pool.
///
/// The same scene and options give the same bits on any number of threads.
pub fn render_dataset(scene: &Scene, options: &DatasetOptions) -> SynthDataset {
    let start = Instant::now();
    let twin = (options.twins && refracts(scene)).then(|| scene.without_refraction());
    let rendered: Vec<(SynthView, Cost)> = options
        .planned_views(scene)
        .into_par_iter()
        .map(|planned| view_of(scene, twin.as_ref(), options, &planned))
        .collect();
    let mut cost = rendered.iter().fold(Cost::default(), |sum, (_, c)| sum.plus(*c));
    cost.seconds = start.elapsed().as_secs_f64();
    let views: Vec<SynthView> = rendered.into_iter().map(|(v, _)| v).collect();
    let of = |part| views.iter().enumerate().filter(|(_, v)| v.part == part).map(|(i, _)| i).collect();
    let split = Split {
        train: of(Part::Train),
        val: of(Part::Val),
        test: of(Part::Test),
        rule: "as rendered".into(),
    };
    SynthDataset { views, split, background: background_of(scene), truth: IndexTruth::of_scene(scene), cost }
}

fn view_of(
    scene: &Scene,
    twin: Option<&Scene>,
    options: &DatasetOptions,
    planned: &PlannedView,
) -> (SynthView, Cost) {
    let PlannedView { part, index, camera } = *planned;
    let frame = render_view(scene, &camera, planned.number(), &options.sampling());
    let twin = twin.filter(|_| part == Part::Test);
    let twin = twin.map(|twin| render_view(twin, &camera, planned.number(), &options.sampling()));
    let cost = twin.iter().map(Cost::of_frame).fold(Cost::of_frame(&frame), Cost::plus);
    let view = SynthView {
        part,
        name: format!("r_{index}.png"),
        camera,
        image: frame.image(),
        mask: frame.mask(),
        twin: twin.map(|t| t.image()),
    };
    (view, cost)
}

/// Horizontal field of view of all cameras [rad], as `transforms_*.json` states it.
pub(super) const ANGLE: f64 = CAMERA_ANGLE_X;

#[cfg(test)]
mod tests {
    use super::super::scenes::{SceneOptions, scene};
    use super::*;

    fn small() -> DatasetOptions {
        DatasetOptions {
            size: [24, 16],
            views: ViewCounts { train: 2, val: 1, test: 2 },
            spp: 4,
            twins: true,
            ..DatasetOptions::default()
        }
    }

    #[test]
    fn any_number_of_threads_gives_the_same_pictures() {
        let scene = scene("glass_ball", &SceneOptions::default()).unwrap();
        let on = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| render_dataset(&scene, &small()))
        };
        let (one, three) = (on(1), on(3));
        for (a, b) in one.views.iter().zip(&three.views) {
            assert_eq!((&a.image, &a.mask, &a.twin), (&b.image, &b.mask, &b.twin));
        }
        assert_eq!(one.cost.samples, 7 * 24 * 16 * 4);
    }

    #[test]
    fn a_dataset_has_its_splits_masks_and_twins() {
        let scene = scene("glass_ball", &SceneOptions::default()).unwrap();
        let data = render_dataset(&scene, &small());
        assert_eq!((data.split.train.len(), data.split.val.len(), data.split.test.len()), (2, 1, 2));
        assert!(data.views.iter().all(|v| v.mask.coverage.iter().filter(|&&c| c == 255).count() > 10));
        assert!(data.views.iter().all(|v| v.twin.is_some() == (v.part == Part::Test)));
        assert_eq!(data.background, Some([255; 3]));
        let test = &data.views[data.split.test[0]];
        assert_ne!(Some(&test.image), test.twin.as_ref());
    }

    #[test]
    fn another_seed_gives_other_cameras_and_pictures() {
        let scene = scene("glass_ball", &SceneOptions::default()).unwrap();
        let [a, b] = [0, 1].map(|seed| render_dataset(&scene, &DatasetOptions { seed, ..small() }));
        assert_ne!(a.views[0].camera, b.views[0].camera);
        assert_ne!(a.views[0].image, b.views[0].image);
    }
}
