//! What surfaces mirror, against the reference; derivatives are central differences of it.

use super::reference::{Marched, Reference};
use super::scenes::{Sequence, batch, environment, index_objective, objective, picked, smooth_field};
use super::suite::Suite;
use crate::backend::{AbsorptionObjective, Backend, Batch, BatchGradient, Caches, Layers, Objective};
use crate::cancel::Cancel;
use crate::model::{Mirror, MirrorSource, Model, ProbeLayout, Reflection, Refraction};
use refraxel_core::optics::{GRAZING, PartialReflection};
use refraxel_core::radiance::{Absorption, ProbeGrid, QuadraturePoint, mix, render_through};
use refraxel_core::segment::Segment;
use refraxel_core::sh::ShDegree;
use refraxel_core::{Aabb, Background, Extent, IndexGrid, Interpolation, LevelSet, Path, Ray, Vec3, vec3};

fn bounds() -> Aabb<f32> {
    Aabb::cube(0.6)
}

/// A ball of glass in the field, with caches of noise.
pub fn sharp_ball() -> Model {
    let level = LevelSet::from_samples(bounds(), [33; 3], |x: Vec3<f32>| x.length() - 0.4);
    with_ball(IndexGrid::sharp(level, 1.5))
}

/// The same with a soft edge.
pub fn soft_ball() -> Model {
    let n = |x: Vec3<f32>| 1.25 - 0.25 * ((x.length() - 0.4) / 0.03).tanh();
    with_ball(IndexGrid::from_control_values(bounds(), [33; 3], Interpolation::CubicBSpline, n))
}

/// A ball of glass with a drop of water in it, and a bubble partly in both: three media, surfaces below others.
pub fn nested_balls() -> Model {
    let ball = |center: Vec3<f32>, radius: f32, n: f32| {
        let bounds = Aabb::cube_at(center, 1.5 * radius);
        IndexGrid::sharp(
            LevelSet::from_samples(bounds, [31; 3], |x: Vec3<f32>| (x - center).length() - radius),
            n,
        )
    };
    with_bodies(vec![
        ball(Vec3::zero(), 0.4, 1.5),
        ball(vec3(0.05, -0.05, 0.1), 0.26, 1.33),
        ball(vec3(-0.12, 0.05, 0.0), 0.2, 1.0),
    ])
}

fn with_ball(ball: IndexGrid<f32>) -> Model {
    with_bodies(vec![ball])
}

fn with_bodies(bodies: Vec<IndexGrid<f32>>) -> Model {
    let refraction = Refraction::of(bodies);
    let layout = ProbeLayout { longest: 4, degree: ShDegree::new(2).unwrap() };
    let mut reflection = Reflection::of(&refraction, MirrorSource::Learned, &layout);
    let mut r = Sequence(5);
    for (k, mirror) in reflection.mirrors.iter_mut().enumerate() {
        let coefficients = mirror.outer.coefficients.iter_mut().chain(&mut mirror.inner.coefficients);
        coefficients.for_each(|c| *c = 0.15 * r.next());
        mirror.strength = 0.8 - 0.1 * k as f32;
    }
    Model { refraction, reflection, ..Model::straight(smooth_field(Extent::Bounded), environment()) }
}

/// The reference with its mirrors.
#[derive(Clone)]
pub(super) struct Mirrored {
    scene: Reference,
    pub(super) mirrors: Vec<WideMirror>,
}

/// A mirror in double precision: its outer and its inner cache, and its body.
#[derive(Clone)]
pub(super) struct WideMirror {
    caches: [ProbeGrid<f64>; 2],
    strength: f64,
    /// What the body absorbs.
    pub(super) absorption: [f64; 3],
}

/// A probe grid in double precision.
pub(super) fn wide(cache: &ProbeGrid<f32>) -> ProbeGrid<f64> {
    let values = cache.coefficients.iter().map(|&v| f64::from(v)).collect();
    ProbeGrid::grey(cache.bounds().cast(), cache.resolution(), cache.degree())
        .with_coefficients(values)
        .unwrap()
}

impl Mirrored {
    fn new(model: &Model) -> Self {
        let regions = model.refraction.medium.regions();
        let wide = |(mirror, grid): (&Mirror, &IndexGrid<f32>)| WideMirror {
            caches: [wide(&mirror.outer), wide(&mirror.inner)],
            strength: mirror.strength.into(),
            absorption: grid.absorption().map(f64::from),
        };
        let mirrors = model.reflection.mirrors.iter().zip(regions).map(wide).collect();
        Self { scene: Reference::new(model), mirrors }
    }

    /// What a ray shows that takes the steps of `path`, with the quadrature points held.
    fn shown(&self, ray: &Ray<f64>, path: &Path<f64>, points: &[QuadraturePoint<f64>]) -> [f64; 3] {
        let (tracer, mut reflections) = (self.scene.tracer(), Vec::new());
        let path = tracer.replay(ray, path);
        tracer.partial_reflections(&path, &mut reflections);
        let absorption = Absorption::new(&self.scene.medium, &path);
        let seen = self.scene.background.radiance(path.exit.origin, path.exit.direction);
        let mut seen = absorption.whole().through(seen).colour;
        for segment in (0..path.segments.len()).rev() {
            for r in reflections.iter().filter(|r| r.segment == segment).rev() {
                seen = self.mirror(r, &absorption, seen);
            }
            let own: Vec<QuadraturePoint<f64>> =
                points.iter().filter(|q| q.segment == segment).copied().collect();
            let pixel = render_through(&self.scene.field, &path.segments, &own, &absorption);
            seen = [0, 1, 2].map(|c| pixel.colour[c] + pixel.transmittance * seen[c]);
        }
        seen
    }

    fn mirror(&self, r: &PartialReflection<f64>, absorption: &Absorption<f64>, behind: [f64; 3]) -> [f64; 3] {
        // Light that arrives inside a body comes from there.
        let from = &self.mirrors[usize::from(r.within.unwrap_or(r.region))];
        let cache = &from.caches[usize::from(r.within.is_some())];
        let mirrored = cache.radiance(&cache.stencil(r.position, r.direction));
        let mirrored = absorption.after(r.segment).through(mirrored).colour;
        mix(self.mirrors[usize::from(r.region)].strength * r.reflectance, mirrored, behind)
    }

    /// Whether a ray of a batch meets the surface of a region in vacuum.
    fn sees_from_vacuum(&self, region: usize, batch: &Batch) -> bool {
        let (tracer, mut found) = (self.scene.tracer(), Vec::new());
        batch.rays.iter().any(|ray| {
            tracer.partial_reflections(&tracer.trace(&ray.cast()), &mut found);
            found.iter().any(|r| usize::from(r.region) == region && r.within.is_none())
        })
    }

    /// Σ |C − target|² of rays with the paths that they had once.
    fn loss(&self, batch: &Batch, marched: &[Marched]) -> f64 {
        let mut tinted = self.clone();
        for (k, mirror) in self.mirrors.iter().enumerate() {
            tinted.scene.medium.region_mut(k).set_absorption(mirror.absorption);
        }
        let error = |k: usize| {
            let shown = tinted.shown(&batch.rays[k].cast(), &marched[k].path, &marched[k].points);
            (0..3).map(|c| (shown[c] - f64::from(batch.target[k][c])).powi(2)).sum::<f64>()
        };
        (0..marched.len()).map(error).sum()
    }
}

/// Colours with and without what a sharp surface mirrors.
pub fn mirroring_agrees_with_the_reference<B: Backend>(suite: &Suite<B>) {
    agrees_with_the_reference(suite, sharp_ball(), 50);
}

/// The same for surfaces with a medium on both sides, of which the last in the list rules.
pub fn bodies_in_bodies_refract_and_mirror_as_the_reference_does<B: Backend>(suite: &Suite<B>) {
    agrees_with_the_reference(suite, nested_balls(), 50);
}

/// The same for a smooth transition of the index.
pub fn soft_edges_mirror_as_the_reference_does<B: Backend>(suite: &Suite<B>) {
    agrees_with_the_reference(suite, soft_ball(), 40);
}

pub(super) fn agrees_with_the_reference<B: Backend>(suite: &Suite<B>, model: Model, at_least: usize) {
    let (reference, b, marching) = (Mirrored::new(&model), batch(300), objective().marching);
    let backend = suite.backend(model);
    let silent = backend.render(&b.rays, &marching, Layers::Transmitted);
    let all = backend.render(&b.rays, &marching, Layers::All);
    let mut changed = 0;
    for ((ray, got), silent) in b.rays.iter().zip(all).zip(silent) {
        let marched = reference.scene.march(ray, 0.5);
        let want = reference.shown(&ray.cast(), &marched.path, &marched.points);
        changed += usize::from((got.colour[0] - silent.colour[0]).abs() > 1e-3);
        for c in 0..3 {
            let got = f64::from(got.colour[c]);
            assert!((got - want[c]).abs() < suite.tolerances.bent, "{got} {}", want[c]);
        }
    }
    assert!(changed > at_least, "only {changed} rays show a reflection");
}

const E: f64 = 1e-5;
/// Entries of an array that are compared, at most.
const COMPARED: usize = 12;

/// A reference and the rays of its loss.
pub(super) struct Differences {
    reference: Mirrored,
    batch: Batch,
}

impl Differences {
    /// Compares central differences of the loss along each of `parameters` of the reference with `got`.
    pub(super) fn compare<P>(&self, got: &[f32], tolerance: f64, parameters: P)
    where
        P: Fn(&mut Mirrored) -> &mut [f64],
    {
        let (reference, b) = (&self.reference, &self.batch);
        let marched: Vec<Marched> =
            b.rays.iter().zip(&b.offset).map(|(r, o)| reference.scene.march(r, *o)).collect();
        let size = got.iter().fold(0.0_f64, |m, v| m.max(f64::from(v.abs())));
        let touched: Vec<usize> = (0..got.len()).filter(|&j| f64::from(got[j].abs()) > 0.05 * size).collect();
        assert!(size > 0.0 && !touched.is_empty(), "nothing has a gradient");
        for &j in touched.iter().step_by(1 + touched.len() / COMPARED) {
            let along = |e: f64| {
                let mut moved = reference.clone();
                parameters(&mut moved)[j] += e;
                moved.loss(b, &marched)
            };
            let fd = (along(E) - along(-E)) / (2.0 * E);
            assert!((fd - f64::from(got[j])).abs() < tolerance * size, "{j}: {fd} vs {} of {size}", got[j]);
        }
    }
}

/// The rays of a batch along which derivatives are followed exactly: with no more events than [`index_objective`] takes, and
/// none at grazing incidence, where adjoints are bounded.
pub(super) fn followed(batch: Batch, reference: &Reference) -> Batch {
    let is_steep = |level: &LevelSet<f64>, segment: &Segment<f64>, x: Vec3<f64>| {
        level.sample(x).1.normalized().dot(segment.momentum.normalized()).abs() > 1.2 * GRAZING
    };
    let is_followed = |ray: &Ray<f32>| {
        let path = reference.tracer().trace(&ray.cast());
        let events = path.steps.iter().enumerate().filter(|(_, s)| s.event.is_some());
        let mut levels =
            events.map(|(i, s)| (i, s, reference.medium.regions()[usize::from(s.region)].level_set()));
        path.events().count() <= index_objective().surface_events as usize
            && levels.all(|(i, step, level)| {
                let x = path.segments[i].at(step.drift);
                level.is_some_and(|l| path.segments[i..=i + 1].iter().all(|s| is_steep(l, s, x)))
            })
    };
    picked(&batch, |k| is_followed(&batch.rays[k]))
}

/// Compares what all mirroring bodies have; gives what is needed to compare what only some have.
pub(super) fn compare_what_all_have<B: Backend>(
    suite: &Suite<B>,
    model: Model,
) -> (BatchGradient, Differences) {
    let reference = Mirrored::new(&model);
    let d = Differences { batch: followed(batch(100), &reference.scene), reference };
    let absorption = Some(AbsorptionObjective { rate: 0.0 });
    let objective = Objective { index: Some(index_objective()), absorption, ..objective() };
    let got = suite.backend(model).gradient(&d.batch, &objective);
    let t = &suite.tolerances;
    for (k, mirror) in got.reflection.iter().enumerate() {
        // No ray in vacuum sees the surface of a body that lies wholly in another.
        if d.reference.sees_from_vacuum(k, &d.batch) {
            d.compare(&mirror.outer, t.bent, |m| &mut m.mirrors[k].caches[0].coefficients);
        }
        d.compare(&mirror.inner, t.bent, |m| &mut m.mirrors[k].caches[1].coefficients);
        let strength = [mirror.strength as f32];
        d.compare(&strength, 0.5 * t.bent, |m| std::slice::from_mut(&mut m.mirrors[k].strength));
        // Rounding of bent paths in single precision, as for paths without mirrors.
        d.compare(&got.medium.index[k], t.mirrored_index, |m| {
            m.scene.medium.region_mut(k).coefficients_mut()
        });
    }
    d.compare(&got.field.density, t.bent, |m| &mut m.scene.field.density);
    (got, d)
}

/// dLoss/d(caches, strength, density, colour, index, surface, background).
pub fn gradients_of_mirrors_and_of_what_lies_before_and_behind_match_central_differences<B: Backend>(
    suite: &Suite<B>,
) {
    compare_what_sharp_bodies_have(suite, sharp_ball());
}

/// Compares what bodies with a surface have, too.
pub(super) fn compare_what_sharp_bodies_have<B: Backend>(
    suite: &Suite<B>,
    model: Model,
) -> (BatchGradient, Differences) {
    let (got, d) = compare_what_all_have(suite, model);
    let t = &suite.tolerances;
    d.compare(&got.field.colour, t.bent, |m| &mut m.scene.field.colour);
    d.compare(&got.medium.level_set[0], t.mirrored_index, |m| {
        m.scene.medium.region_mut(0).level_set_mut().unwrap().coefficients_mut()
    });
    d.compare(got.background.as_flattened(), t.bent, |m| match &mut m.scene.background {
        Background::Environment(map) => map.texels.as_flattened_mut(),
        Background::Constant(c) => c,
    });
    (got, d)
}

/// The same of bodies in bodies: both media of a surface, and the caches of the medium in which the light arrives.
pub fn gradients_of_bodies_in_bodies_match_central_differences<B: Backend>(suite: &Suite<B>) {
    compare_what_nested_bodies_have(suite, nested_balls());
}

/// Compares what bodies in bodies have: the surface of each, too.
pub(super) fn compare_what_nested_bodies_have<B: Backend>(
    suite: &Suite<B>,
    model: Model,
) -> (BatchGradient, Differences) {
    let (got, d) = compare_what_all_have(suite, model);
    for (k, level_set) in got.medium.level_set.iter().enumerate() {
        d.compare(level_set, suite.tolerances.mirrored_index, |m| {
            m.scene.medium.region_mut(k).level_set_mut().unwrap().coefficients_mut()
        });
    }
    (got, d)
}

/// The same of a smooth transition, without a surface.
pub fn gradients_of_soft_edges_that_mirror_match_central_differences<B: Backend>(suite: &Suite<B>) {
    compare_what_all_have(suite, soft_ball());
}

/// Mirrors of strength 0 are windows.
pub fn without_strength_a_picture_is_that_of_transmission<B: Backend>(suite: &Suite<B>) {
    let model = sharp_ball();
    let silent = model.reflection.without_strength();
    let (mut backend, b, marching) = (suite.backend(model), batch(100), objective().marching);
    let transmitted = backend.render(&b.rays, &marching, Layers::Transmitted);
    backend.set_reflection(silent);
    for (a, b) in backend.render(&b.rays, &marching, Layers::All).iter().zip(&transmitted) {
        assert!((0..3).all(|c| (a.colour[c] - b.colour[c]).abs() < 1e-5));
    }
}

/// A field of nothing before a background of one colour, around one body and around bodies in bodies: also probes
/// that lie in another medium than the one that they show hold its light.
pub fn a_furnace_shows_one_colour_whatever_is_mirrored<B: Backend>(suite: &Suite<B>) {
    for make in [sharp_ball, nested_balls] {
        for source in [MirrorSource::Learned, MirrorSource::Exact] {
            let mut model = make();
            model.field.density.fill(-40.0);
            model.background = Background::Constant([0.3, 0.6, 0.9]);
            model.reflection.source = source;
            let (mut backend, marching) = (suite.backend(model), objective().marching);
            if source == MirrorSource::Learned {
                backend.bake(Caches::Reflection, &marching, &Cancel::new()).unwrap();
            }
            for pixel in backend.render(&batch(200).rays, &marching, Layers::All) {
                for (got, want) in pixel.colour.into_iter().zip([0.3, 0.6, 0.9]) {
                    assert!((got - want).abs() < 2e-3, "{source:?}: {:?}", pixel.colour);
                }
            }
        }
    }
}

/// Against the normal a front face mirrors 4 % of what lies behind the camera.
pub fn secondary_rays_see_what_a_camera_at_the_surface_sees<B: Backend>(suite: &Suite<B>) {
    let mut model = sharp_ball();
    model.reflection.mirrors[0].strength = 1.0;
    let backend = suite.backend(model);
    let ray = Ray { origin: vec3(-0.9, 0.0, 0.0), direction: vec3(1.0, 0.0, 0.0) };
    let marching = objective().marching;
    let [all, black] = [MirrorSource::Exact, MirrorSource::Black]
        .map(|source| backend.render(&[ray], &marching, Layers::Mirroring(source))[0].colour);
    assert!((0..3).all(|c| all[c] > black[c]), "{all:?} {black:?}");
}
