//! The search where the truth is known: photographs are rendered with true bodies before a panorama.

use super::*;
use crate::CpuBackend;
use crate::backend::Marching;
use crate::cancel::Cancel;
use crate::evidence::tests::surroundings;
use crate::initial::Site;
use crate::model::RegionState;
use crate::options::SurfaceProfile;
use crate::rays::{RaySampler, WHITE};
use crate::schedule::Progress;
use crate::verdict::Hypothesis;
use refraxel_core::{Aabb, Camera, IndexGrid, LevelSet, Medium, Ray, Vec3, vec3};
use refraxel_data::{Backdrop, Dataset, Image, Mask, MaskMeaning, Photo, Pixels, PosedPhoto, Split};

const SIZE: u32 = 96;
const RADIUS: f32 = 0.5;

fn cube(middle: Vec3<f32>) -> Aabb<f32> {
    Aabb::new(middle - Vec3::splat(0.65), middle + Vec3::splat(0.65))
}

/// A ball as a level set.
fn ball(middle: Vec3<f32>, radius: f32) -> LevelSet<f32> {
    LevelSet::from_samples(cube(middle), [41; 3], |x| (x - middle).length() - radius)
}

fn glass(middle: Vec3<f32>, index: f32) -> IndexGrid<f32> {
    IndexGrid::sharp(ball(middle, RADIUS), index)
}

/// The backend that knows the surroundings, and photographs of true bodies, whose silhouettes are those of balls.
struct Setting {
    backend: CpuBackend,
    sampler: RaySampler,
    options: Options,
    /// Of the balls that masks show.
    radius: f32,
}

impl Setting {
    fn new(truth: Vec<IndexGrid<f32>>, middles: &[Vec3<f32>]) -> Self {
        Self::masked(truth, middles, RADIUS)
    }

    /// With masks of balls of another radius.
    fn masked(truth: Vec<IndexGrid<f32>>, middles: &[Vec3<f32>], radius: f32) -> Self {
        let mut options = Options::default();
        options.reflection.enabled = crate::options::Switch::Off;
        let mut backend = CpuBackend::new(surroundings());
        let states = vec![RegionState::default(); truth.len()];
        let medium = Medium::new(truth).unwrap();
        backend.set_medium(Refraction { medium, optics: options.optics(), states });
        let marching = Marching::exhaustive(0.5);
        let photograph = |k: usize| {
            let (z, angle) = (1.4 - 0.2 * k as f64, 2.4 * k as f64);
            let eye = vec3(angle.cos(), angle.sin(), z).normalized() * 3.0;
            let camera = Camera::look_at(eye, Vec3::zero(), vec3(0.0, 0.0, 1.0), 0.75, [SIZE; 2]);
            let at =
                |p: u32| camera.ray(f64::from(p % SIZE) + 0.5, f64::from(p / SIZE) + 0.5).unwrap().cast();
            let rays: Vec<Ray<f32>> = (0..SIZE * SIZE).map(at).collect();
            let seen = backend.render(&rays, &marching, Layers::All);
            let codes =
                seen.iter().flat_map(|p| p.colour.map(|c| (255.0 * c).round().clamp(0.0, 255.0) as u8));
            let image = Image { width: SIZE, height: SIZE, channels: 3, pixels: Pixels::U8(codes.collect()) };
            let meets =
                |r: &Ray<f32>| middles.iter().any(|m| (r.origin - *m).cross(r.direction).length() < radius);
            let coverage = rays.iter().map(|r| if meets(r) { 255 } else { 0 }).collect();
            let mask = Mask { width: SIZE, height: SIZE, coverage };
            let photo = Photo::new(image, Some(mask));
            PosedPhoto { name: format!("{k}.png"), camera, photo, mask_meaning: MaskMeaning::Refractive }
        };
        let photographs: Vec<PosedPhoto> = (0..14).map(photograph).collect();
        let photos = photographs.iter().map(|p| p.photo.clone()).collect();
        let split = Split { train: (0..14).collect(), ..Split::default() };
        let data = Dataset::in_memory(photographs, split, Backdrop::Color(WHITE)).unwrap();
        Self {
            backend,
            sampler: RaySampler::new(data.views, photos, Backdrop::Color(WHITE), 0),
            options,
            radius,
        }
    }

    fn region(&self, middle: Vec3<f32>, is_shared: bool) -> Region {
        let interpolation = self.options.index.interpolation.into();
        let site = Site { bounds: cube(middle), resolution: [41; 3], interpolation };
        Region { is_shared, ..Region::body(site, |x| (x - middle).length() - self.radius, &self.options) }
    }

    /// What the search finds, and which events it tells.
    fn found(&mut self, regions: &[Region]) -> Vec<Fits> {
        let Self { backend, sampler, options, .. } = self;
        let known = Known { sampler, options, near: 0.0, index: None, progress: Progress(0.0) };
        let (cancel, mut ignore) = (Cancel::new(), |_| {});
        fits(backend, regions, &known, &mut Watch::new(&cancel, &mut ignore)).unwrap()
    }

    /// The best hypothesis on one ball in the middle.
    fn best(&mut self) -> (Hypothesis, Vec<f32>, f64) {
        let region = self.region(Vec3::zero(), false);
        let found = self.found(&[region]).remove(0);
        let best = &found.fits[0];
        (best.candidate.proposal.kind, best.candidate.values.clone(), best.error / found.straight)
    }
}

fn alone(truth: Vec<IndexGrid<f32>>) -> Setting {
    Setting::new(truth, &[Vec3::zero()])
}

#[test]
fn the_index_of_a_solid_body_is_found() {
    for index in [1.33, 1.5, 1.8] {
        let (kind, values, part) = alone(vec![glass(Vec3::zero(), index)]).best();
        assert_eq!(kind, Hypothesis::Solid, "{index}: {values:?} {part}");
        assert!((values[0] - index).abs() < 0.006 && values[1].abs() < 0.3, "{index}: {values:?}");
        assert!(part < 0.3, "{part}");
    }
}

#[test]
fn masks_that_are_too_small_or_too_large_hide_neither_size_nor_index() {
    for by in [-0.06_f32, 0.06] {
        let mut setting = Setting::masked(vec![glass(Vec3::zero(), 1.5)], &[Vec3::zero()], RADIUS + by);
        let region = setting.region(Vec3::zero(), false);
        let unit = region.unit;
        let found = setting.found(&[region]).remove(0).fits.remove(0).candidate;
        assert_eq!(found.proposal.kind, Hypothesis::Solid, "{by}: {:?}", found.values);
        let radius = RADIUS + by + found.values[1] * unit;
        assert!((found.values[0] - 1.5).abs() < 0.03, "{by}: {:?}", found.values);
        assert!((radius - RADIUS).abs() < 0.3 * unit, "{by}: {:?}, voxels of {unit}", found.values);
    }
}

#[test]
fn wall_and_index_of_a_shell_are_found() {
    let air = IndexGrid::sharp(ball(Vec3::zero(), 0.7 * RADIUS), 1.0);
    let (kind, values, _) = alone(vec![glass(Vec3::zero(), 1.5), air]).best();
    assert_eq!(kind, Hypothesis::Shell, "{values:?}");
    assert!((values[0] - 1.5).abs() < 0.03 && (values[1] - 0.3).abs() < 0.03, "{values:?}");
}

/// A lens by its index at a distance from the middle [radius].
fn lens(index: impl Fn(f32) -> f32) -> IndexGrid<f32> {
    let of = |x: Vec3<f32>| index(x.length() / RADIUS);
    IndexGrid::from_samples(cube(Vec3::zero()), [41; 3], Options::default().index.interpolation.into(), of)
}

#[test]
fn a_lens_is_told_from_a_body_of_one_index() {
    let (kind, values, _) = alone(vec![lens(|r| (1.0 + 0.96 * (1.0 - r * r).max(0.0)).sqrt())]).best();
    assert_eq!(kind, Hypothesis::Graded);
    assert!((values[0] - 1.4).abs() < 0.02 && (values[1] - 1.0).abs() < 0.15, "{values:?}");
}

#[test]
fn steep_lenses_are_found() {
    // A bell that has faded to 0.02 at the border.
    let bell = |r: f32| 1.0 + 0.5 * (-3.22 * r * r).exp() * f32::from(u8::from(r < 1.2));
    let (kind, values, part) = alone(vec![lens(bell)]).best();
    assert_eq!(kind, Hypothesis::Graded, "{values:?} {part}");
    assert!((values[0] - 1.5).abs() < 0.06 && values[1] > 1.4, "{values:?} {part}");
    // The fish eye is none of the powers, and along a valley from (1.6, 3.4) to (2.4, 1.3) many are about as wrong. What is found must
    // explain more than 2.0 and 2.0, which come nearest to its index and leave 0.77.
    let fish_eye = |r: f32| if r < 1.0 { 2.0 / (1.0 + r * r) } else { 1.0 };
    let (kind, values, part) = alone(vec![lens(fish_eye)]).best();
    assert_eq!(kind, Hypothesis::Graded, "{values:?} {part}");
    assert!(part < 0.7 && values[1] > 1.4, "{values:?} {part}");
}

#[test]
fn glass_that_absorbs_has_its_colour_and_clear_glass_has_none() {
    let truth = [0.3, 1.5, 3.0];
    let mut tinted = glass(Vec3::zero(), 1.5);
    tinted.set_absorption(truth);
    let mut setting = alone(vec![tinted]);
    let region = setting.region(Vec3::zero(), false);
    let found = setting.found(&[region]).remove(0).fits.remove(0).candidate;
    assert_eq!(found.proposal.kind, Hypothesis::Solid);
    assert!((found.values[0] - 1.5).abs() < 0.02, "{:?}", found.values);
    for (tint, truth) in found.tint.into_iter().zip(truth) {
        assert!((tint - truth).abs() < 0.1 * truth + 0.1, "{:?}", found.tint);
    }
    let mut setting = alone(vec![glass(Vec3::zero(), 1.5)]);
    let region = setting.region(Vec3::zero(), false);
    assert_eq!(setting.found(&[region]).remove(0).fits[0].candidate.tint, [0.0; 3]);
}

#[test]
fn where_nothing_bends_the_search_says_so() {
    let mut setting = alone(vec![glass(Vec3::zero(), 1.0)]);
    setting.options.search.profile = SurfaceProfile::Sharp;
    let (_, values, part) = setting.best();
    assert!((values[0] - 1.0).abs() < 0.01, "{values:?}");
    assert!(part > 0.97, "no better than straight rays: {part}");
}

#[test]
fn two_bodies_of_different_index_have_their_own() {
    let middles = [vec3(-0.6, 0.0, 0.0), vec3(0.6, 0.1, 0.0)];
    let truth = vec![glass(middles[0], 1.45), glass(middles[1], 1.65)];
    let mut setting = Setting::new(truth, &middles);
    let regions = middles.map(|m| setting.region(m, true));
    for (found, index) in setting.found(&regions).iter().zip([1.45, 1.65]) {
        let best = &found.fits[0].candidate;
        assert_eq!(best.proposal.kind, Hypothesis::Solid);
        assert!((best.values[0] - index).abs() < 0.02, "{index}: {:?}", best.values);
    }
}
