//! Batches that a backend draws on its own, beside the same batches drawn on the host.

use super::bent::sharp_model;
use super::scenes::{Sequence, index_objective, objective, straight_model};
use super::suite::Suite;
use crate::backend::{Backend, Objective, StepOutcome};
use crate::model::{Gate, Model, RegionState};
use crate::rays::{Draw, RaySampler, Selection};
use refraxel_core::radiance::Filter;
use refraxel_core::{Camera, Extent, Lens, Pose, Vec3, vec3};
use refraxel_data::{Backdrop, Image, Mask, MaskMeaning, Photo, Pixels, View};

/// Sizes of the photographs [pixel]: rows end within words, and at their ends.
const SIZES: [[u32; 2]; 3] = [[37, 29], [64, 48], [33, 70]];
/// The name of photographs of which so few pixels count that most rays find none.
pub const SCARCE: &str = "few pixels count";
/// Rays of a batch.
const RAYS: usize = 500;

/// What photographs of noise are like.
#[derive(Clone)]
struct Likeness {
    lenses: [Lens; 3],
    channels: u32,
    is_real: bool,
    /// Meaning of the masks, per view, and the share of the pixels that they cover.
    masks: [Option<(MaskMeaning, f32)>; 3],
    backdrop: Backdrop,
}

const PLAIN: Likeness = Likeness {
    lenses: [Lens::Pinhole; 3],
    channels: 3,
    is_real: false,
    masks: [None; 3],
    backdrop: Backdrop::Color([1.0; 3]),
};

impl Likeness {
    fn view(&self, k: usize, noise: &mut Sequence) -> (View, Photo) {
        let ([width, height], turn) = (SIZES[k], 2.1 * k as f64);
        let eye = vec3(3.0 * turn.cos(), 3.0 * turn.sin(), 1.2 - k as f64);
        let lens = self.lenses[k];
        let camera =
            Camera { lens, ..Camera::look_at(eye, Vec3::zero(), vec3(0.0, 0.0, 1.0), 0.7, [width, height]) };
        let count = (width * height) as usize;
        let values = (0..count * self.channels as usize).map(|_| 0.5 + 0.5 * noise.next());
        let pixels = if self.is_real {
            Pixels::F32(values.collect())
        } else {
            Pixels::U8(values.map(|v| (255.0 * v) as u8).collect())
        };
        let image = Image { width, height, channels: self.channels, pixels };
        let covered = |share: f32| {
            // Full, in part, and none, in patches of four columns.
            let mut patch = 0.0;
            let mut coverage = |p: usize| {
                if p.is_multiple_of(4) {
                    patch = 0.5 + 0.5 * noise.next();
                }
                if patch < share {
                    255
                } else if patch < 1.1 * share {
                    60
                } else {
                    0
                }
            };
            Mask { width, height, coverage: (0..count).map(&mut coverage).collect() }
        };
        let mask = self.masks[k].map(|(_, share)| share).map(covered);
        let mask_meaning = self.masks[k].map_or(MaskMeaning::Keep, |(meaning, _)| meaning);
        (View { mask_meaning, ..View::of_file(format!("{k}.png"), camera) }, Photo::new(image, mask))
    }

    fn sampler(&self) -> RaySampler {
        let mut noise = Sequence(11);
        let (views, photos) = (0..SIZES.len()).map(|k| self.view(k, &mut noise)).unzip();
        RaySampler::new(views, photos, self.backdrop, 5)
    }
}

/// A sampler, and what it draws from.
pub struct Case {
    /// What is peculiar to it.
    pub name: &'static str,
    /// The sampler.
    pub sampler: RaySampler,
    /// The pixels of a batch.
    pub selection: Selection,
    /// Half the width of the window over which colours are averaged [pixel].
    pub reach: u32,
}

impl Case {
    /// A batch of this number.
    pub fn draw(&self, number: u64) -> Draw<'_> {
        Draw { sampler: &self.sampler, number, size: RAYS, selection: self.selection, reach: self.reach }
    }
}

/// Photographs of all kinds.
pub fn cases() -> Vec<Case> {
    let blurred = |name, likeness: Likeness, selection, reach| Case {
        name,
        sampler: likeness.sampler(),
        selection,
        reach,
    };
    let case = |name, likeness, selection| blurred(name, likeness, selection, 0);
    let transparent = Likeness { channels: 4, backdrop: Backdrop::Transparent, ..PLAIN };
    let refractive = |share| Some((MaskMeaning::Refractive, share));
    let glass = Likeness { masks: [refractive(0.3), None, refractive(0.5)], ..PLAIN };
    let opencv = Lens::OpenCv { k: [0.05, -0.01, 0.0, 0.0], p: [0.001, 0.0] };
    let blind = Lens::OpenCv { k: [-5.0, 0.0, 0.0, 0.0], p: [0.0; 2] };
    let kept = [Some((MaskMeaning::Keep, 0.6)), Some((MaskMeaning::Ignore, 0.3)), None];
    let few = [Some((MaskMeaning::Keep, 0.02)); 3];
    let mut all = vec![
        case("photographs of 8 bits", PLAIN, Selection::All),
        case("masks of what counts", Likeness { masks: kept, ..PLAIN }, Selection::All),
        case(SCARCE, Likeness { masks: few, ..PLAIN }, Selection::All),
        case("outside what is refractive", glass.clone(), Selection::Outside(2)),
        case("inside what is refractive", glass.clone(), Selection::Inside(0.8)),
        blurred("blurred on either side of a mask", glass, Selection::All, 1),
        blurred("blurred, masks of what counts", Likeness { masks: kept, ..PLAIN }, Selection::All, 4),
        blurred("blurred and transparent", transparent.clone(), Selection::All, 2),
        case("transparent", transparent, Selection::All),
        case("alpha that says nothing", Likeness { channels: 4, ..PLAIN }, Selection::All),
        case("photographs in f32", Likeness { is_real: true, ..PLAIN }, Selection::All),
        case("lenses", Likeness { lenses: [opencv, blind, opencv], ..PLAIN }, Selection::All),
        case("exposures", PLAIN, Selection::All),
    ];
    if let Some(last) = all.last_mut() {
        let gains = [[0.4, 0.1, -0.2], [-0.3, 0.0, 0.2], [0.0; 3]];
        last.sampler.set_exposures(&gains.map(Filter::new));
    }
    all
}

/// What may change between two batches.
pub fn change(case: &mut Case) {
    case.sampler.keep_aside(1);
    case.sampler.shift_masks(1.5);
    let moved = |view: usize, given: &Camera| {
        let pose = given.world_from_camera;
        let translation = pose.translation + vec3(0.01, 0.0, 0.02) * view as f64;
        Camera { world_from_camera: Pose { translation, ..pose }, ..*given }
    };
    case.sampler.set_cameras(moved);
}

/// Balls of which only some rays bend: those that meet one in its middle.
pub fn gated_model() -> Model {
    let mut model = sharp_model(Extent::Bounded);
    let domain = *model.refraction.medium.regions()[0].domain();
    let nodes = domain.resolution.iter().product::<u32>() as usize;
    let share = |node: usize| f32::from(domain.place(node).length() < 0.3);
    let gate = Gate::new(domain, &(0..nodes).map(share).collect::<Vec<_>>());
    let regions = model.refraction.medium.regions().len();
    model.refraction.states =
        (0..regions).map(|_| RegionState { gate: Some(gate.clone()), ..RegionState::default() }).collect();
    model
}

fn step_on<B: Backend>(backend: &mut B, begin: impl FnOnce(&mut B) -> bool) -> Option<StepOutcome> {
    let has_begun = begin(backend);
    let outcomes = backend.outcomes(true);
    assert_eq!(outcomes.len(), usize::from(has_begun));
    outcomes.into_iter().next()
}

/// Two backends learn the same from a batch, whoever draws it.
fn teaches_the_same<B: Backend>(suite: &Suite<B>, model: &Model, cases: &mut [Case], objective: &Objective) {
    let (mut one, mut other) = (suite.backend(model.clone()), suite.backend(model.clone()));
    let mut step = 0;
    for case in cases {
        for is_changed in [false, true] {
            if is_changed {
                change(case);
            }
            let (draw, tolerance) = (case.draw(step), suite.tolerances.ray);
            let got = step_on(&mut one, |b| b.submit_drawn(&draw, objective, step)).unwrap();
            let want = step_on(&mut other, |b| {
                b.submit(&draw.batch(), objective, step);
                true
            });
            let (want, what) = (want.unwrap(), (case.name, is_changed));
            assert!(got.finite && got.rays == want.rays, "{what:?}: {} and {} rays", got.rays, want.rays);
            let error = (got.squared_error / want.squared_error - 1.0).abs();
            assert!(error < tolerance, "{what:?}: {} and {}", got.squared_error, want.squared_error);
            assert!(got.samples.abs_diff(want.samples) <= want.samples / 200, "{what:?}: samples");
            step += 1;
        }
    }
    assert_eq!(one.why_on_host(), None);
}

/// Photographs of all kinds.
pub fn drawn_batches_teach_what_those_of_the_host_do<B: Backend>(suite: &Suite<B>) {
    teaches_the_same(suite, &straight_model(1, Extent::Bounded), &mut cases(), &objective());
}

/// Rays that may bend are the same, and those that lie beside masks.
pub fn drawn_batches_bend_as_those_of_the_host_do<B: Backend>(suite: &Suite<B>) {
    let o = Objective { bent_weight: 0.5, index: Some(index_objective()), ..objective() };
    let masked = |case: &Case| matches!(case.selection, Selection::Inside(_)) || case.name == SCARCE;
    let mut few: Vec<Case> = cases().into_iter().filter(masked).collect();
    teaches_the_same(suite, &gated_model(), &mut few, &o);
}

/// Nothing is learned where masks exclude all pixels, and whoever asks is told.
pub fn a_batch_without_pixels_is_told<B: Backend>(suite: &Suite<B>) {
    let masks = [Some((MaskMeaning::Keep, 0.0)); 3];
    let case = Case {
        name: "none",
        sampler: Likeness { masks, ..PLAIN }.sampler(),
        selection: Selection::All,
        reach: 0,
    };
    let mut backend = suite.backend(straight_model(0, Extent::Bounded));
    let told = step_on(&mut backend, |b| b.submit_drawn(&case.draw(0), &objective(), 0));
    assert!(told.is_none_or(|outcome| outcome.rays == 0 && outcome.samples == 0));
}
