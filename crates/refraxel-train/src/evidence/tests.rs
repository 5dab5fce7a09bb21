//! Predictions where the truth is known: photographs of a true body before a panorama that the field of straight rays knows.

use super::*;
use crate::CpuBackend;
use crate::backend::{Backend, Layers, Marching};
use crate::cancel::Cancel;
use crate::events::Observer;
use crate::model::{Model, Optics, Refraction};
use crate::random::Random;
use crate::rays::{RaySampler, WHITE};
use refraxel_core::{
    Aabb, Background, BrickMap, Camera, Domain, EnvironmentMap, Extent, IndexGrid, Interpolation, LevelSet,
    Medium, Ray, ShDegree, Vec3, VoxelField, vec3,
};
use refraxel_data::{
    Backdrop, Dataset, Image, Mask, MaskMeaning, Photo, Pixels, PosedPhoto, Split, quantize,
};

const SIZE: u32 = 96;
pub(crate) const RADIUS: f32 = 0.5;
const VIEWS: usize = 12;
pub(crate) const CUBE: Aabb<f32> = Aabb { min: vec3(-0.65, -0.65, -0.65), max: vec3(0.65, 0.65, 0.65) };

/// A ball with waves on its surface.
fn surface(waves: f32) -> LevelSet<f32> {
    let phi = |x: Vec3<f32>| x.length() - RADIUS - waves * (9.0 * x.x).sin() * (8.0 * x.y).cos();
    LevelSet::from_samples(CUBE, [33; 3], phi)
}

pub(crate) fn medium(surface: LevelSet<f32>, index: f32) -> Refraction {
    let medium = Medium::new(vec![IndexGrid::sharp(surface, index)]).unwrap();
    Refraction { medium, states: Vec::new(), optics: Optics::default() }
}

/// Nothing but a panorama of smooth noise.
pub(crate) fn surroundings() -> Model {
    let domain = Domain::with_longest(Aabb::cube(2.0), Extent::Bounded, 9);
    let map = BrickMap::new(domain.resolution, |_| true);
    let field = VoxelField::uniform(domain, map, ShDegree::new(0).unwrap(), -15.0);
    let (height, random) = (24, Random::new(5));
    let texels = (0..2 * height * height).map(|k| [0, 1, 2].map(|c| random.uniform(k as u64, c) as f32));
    let map = EnvironmentMap::from_texels(height, texels.collect()).unwrap();
    Model::straight(field, Background::Environment(map))
}

pub(crate) const MARCHING: Marching =
    Marching { step: 0.5, near: 0.0, min_optical_depth: 0.0, min_transmittance: 0.0 };

/// The field of straight rays, and photographs of a true ball whose masks are those of a ball of `mask` times its radius.
pub(crate) fn photographed(truth: Refraction, mask: f32) -> (CpuBackend, Photographs) {
    let (backend, sampler) = taken(truth, |r| r.origin.cross(r.direction).length() < mask * RADIUS);
    (backend, Photographs::new(&sampler, &(0..VIEWS).collect::<Vec<_>>(), |_| true))
}

/// The field of straight rays, and photographs of a truth whose masks show what these rays meet.
pub(crate) fn taken(truth: Refraction, meets: impl Fn(&Ray<f32>) -> bool) -> (CpuBackend, RaySampler) {
    let mut backend = CpuBackend::new(surroundings());
    backend.set_medium(truth);
    let photograph = |k: usize| {
        let (z, angle) = (1.4 - 0.2 * k as f64, 2.4 * k as f64);
        let eye = vec3(angle.cos(), angle.sin(), z).normalized() * 3.0;
        let camera = Camera::look_at(eye, Vec3::zero(), vec3(0.0, 0.0, 1.0), 0.6, [SIZE; 2]);
        let at = |p: u32| camera.ray(f64::from(p % SIZE) + 0.5, f64::from(p / SIZE) + 0.5).unwrap().cast();
        let rays: Vec<Ray<f32>> = (0..SIZE * SIZE).map(at).collect();
        let seen = backend.render(&rays, &MARCHING, Layers::All);
        let codes = seen.iter().flat_map(|p| p.colour.map(quantize)).collect();
        let image = Image { width: SIZE, height: SIZE, channels: 3, pixels: Pixels::U8(codes) };
        let coverage = rays.iter().map(|r| if meets(r) { 255 } else { 0 }).collect();
        let mask = Mask { width: SIZE, height: SIZE, coverage };
        let photo = Photo::new(image, Some(mask));
        PosedPhoto { name: format!("{k}.png"), camera, photo, mask_meaning: MaskMeaning::Refractive }
    };
    let all: Vec<PosedPhoto> = (0..VIEWS).map(photograph).collect();
    let photos = all.iter().map(|p| p.photo.clone()).collect();
    let split = Split { train: (0..VIEWS).collect(), ..Split::default() };
    let data = Dataset::in_memory(all, split, Backdrop::Color(WHITE)).unwrap();
    let sampler = RaySampler::new(data.views, photos, Backdrop::Color(WHITE), 0);
    backend.set_medium(Refraction::none());
    (backend, sampler)
}

#[test]
fn the_score_peaks_at_the_true_index_far_above_looking_straight_through() {
    let (backend, photographs) = photographed(medium(surface(0.0), 1.5), 1.0);
    let scores = |n: f32, detail: Detail| {
        predict(&backend, &MARCHING, &photographs, detail, &medium(surface(0.0), n), Way::Bent)
            .scores(&photographs)
    };
    let values = [1.0, 1.15, 1.3, 1.45, 1.6, 1.75];
    let unknown = Unknown::new("index", &values, &[0.03, 0.01, 0.005], [1.0, 4.0]);
    let score = |v: &[f32], detail: Detail| Ok(scores(v[0], detail));
    let from = first(std::slice::from_ref(&unknown), false, |v, detail, _| score(v, detail)).unwrap();
    let found = refined(&from, &[unknown], Detail::Fine, score).unwrap();
    assert!((found.values[0] - 1.5).abs() < 0.011, "{found:?}");
    assert!(found.scores.mean().mean > 0.9);
    let medium_of = |n: f32| medium(surface(0.0), n);
    let through = predict(&backend, &MARCHING, &photographs, Detail::Fine, &medium_of(1.5), Way::Straight);
    let through = through.scores(&photographs);
    assert!(found.scores.above(&through).significance() > 10.0);
    // Where nothing bends, both are the same.
    let difference = scores(1.0, Detail::Fine).mean().mean - through.mean().mean;
    assert!(difference.abs() < 0.05, "{difference}");
    let range = interval(found.values[0], [1.0, 4.0], |n| scores(n, Detail::Fine)).unwrap().range;
    assert!(range[0] < 1.5 && range[1] > 1.5 && range[1] - range[0] < 0.09, "{range:?}");
    let of_others =
        predict(&backend, &MARCHING, &photographs, Detail::Fine, &medium(surface(0.0), 1.5), Way::Bent)
            .scores_of_others(&photographs)
            .mean();
    assert!(of_others.mean < 0.3, "{of_others:?}");
}

#[test]
fn a_lens_without_a_surface_is_looked_through_too() {
    let of = |x: Vec3<f32>| {
        let r = x.length() / RADIUS;
        (1.0 + 0.96 * (1.0 - r * r).max(0.0)).sqrt()
    };
    let grid = IndexGrid::from_samples(CUBE, [41; 3], Interpolation::default(), of);
    let medium = || Refraction::of(vec![grid.clone()]);
    let (backend, photographs) = photographed(medium(), 1.0);
    let [bent, through] = [Way::Bent, Way::Straight].map(|way| {
        predict(&backend, &MARCHING, &photographs, Detail::Middle, &medium(), way).scores(&photographs).mean()
    });
    assert!(through.views == VIEWS && bent.mean > through.mean + 0.5, "{bent:?} {through:?}");
}

#[test]
fn the_picture_that_convinced_shows_the_photograph_once_more() {
    let (backend, photographs) = photographed(medium(surface(0.0), 1.5), 1.0);
    let medium = medium(surface(0.0), 1.5);
    let of_view = |view| Shown::new(&backend, &MARCHING, (&photographs, view), (&medium, [0.0, 0.9]), 0);
    let shown = of_view(3).unwrap();
    let pixels = shown.size[0] * shown.size[1];
    assert_eq!((shown.view.as_str(), shown.photograph.len(), shown.predicted.1), ("3.png", pixels, 0.9));
    let error = |pixels: &[[u8; 3]]| {
        let pairs = pixels.as_flattened().iter().zip(shown.photograph.as_flattened());
        pairs.map(|(a, b)| f64::from(a.abs_diff(*b))).sum::<f64>() / (3 * pixels.len()) as f64
    };
    let [straight, predicted] = [&shown.straight_through.0, &shown.predicted.0].map(|p| error(p));
    assert!(predicted < 1.0 && straight > 20.0 * predicted, "{straight} {predicted}");
    assert!(of_view(VIEWS).is_none());
}

#[test]
fn waves_that_masks_do_not_show_are_smoothed_by_the_gradient_of_the_score() {
    let (backend, photographs) = photographed(medium(surface(0.0), 1.5), 1.0);
    let refiner = Refiner {
        backend: &backend,
        marching: MARCHING,
        photographs: &photographs,
        outlines: &[],
        axis: None,
        others: &[],
        optics: Optics::default(),
        effort: 0.5,
        until: None,
    };
    let (cancel, mut ignore) = (Cancel::new(), |_| {});
    let mut observer = Observer::new(&cancel, &mut ignore);
    let wavy = surface(0.012);
    let (mended, index) = refiner.refine(&wavy, 1.46, &mut observer).unwrap().unwrap();
    let score = |surface: &LevelSet<f32>, n: f32| {
        let seen = predict(
            &backend,
            &MARCHING,
            &photographs,
            Detail::Middle,
            &medium(surface.clone(), n),
            Way::Bent,
        );
        mean(&seen.scores(&photographs))
    };
    let [before, after] = [score(&wavy, 1.46), score(&mended, index)];
    assert!(after > before + 0.15, "{before} {after}");
    assert!((index - 1.5).abs() < 0.03, "{index}");
    cancel.cancel();
    let mut observer = Observer::new(&cancel, &mut ignore);
    assert!(refiner.refine(&wavy, 1.5, &mut observer).is_err());
}
