//! What surfaces mirror on the CPU backend, against the mathematics of `refraxel-core` in double precision.

use super::*;
use crate::backend::ReflectionObjective;
use crate::reflection::{MirrorSource, ProbeLayout, Reflection};
use refraxel_core::optics::{Options, PartialReflection};
use refraxel_core::radiance::{ProbeGrid, mix};
use refraxel_core::{IndexGrid, Interpolation, LevelSet, Medium, Path, Tracer};

/// A ball of glass in the field, with caches of noise.
fn backend() -> CpuBackend {
    let level = LevelSet::from_samples(bounds(), [33; 3], |x: Vec3<f32>| x.length() - 0.4);
    backend_with(IndexGrid::sharp(level, 1.5))
}

/// The same with a soft edge.
fn soft_backend() -> CpuBackend {
    let n = |x: Vec3<f32>| 1.25 - 0.25 * ((x.length() - 0.4) / 0.03).tanh();
    backend_with(IndexGrid::from_control_values(bounds(), [33; 3], Interpolation::CubicBSpline, n))
}

fn bounds() -> Aabb<f32> {
    Aabb::new(vec3(-0.6, -0.6, -0.6), vec3(0.6, 0.6, 0.6))
}

fn backend_with(ball: IndexGrid<f32>) -> CpuBackend {
    let mut field = field(2, Extent::Bounded);
    for brick in 0..field.map.slots() {
        let at = field.map.brick_of(brick as u32).map(|b| b as f32);
        field.density[64 * brick..64 * (brick + 1)].fill(-2.0 + (at[0] + 2.0 * at[1] + at[2]).sin());
    }
    field.clear_empty_brick();
    let medium = Medium::new(vec![ball]).unwrap();
    let mut backend = CpuBackend::new(field, environment());
    backend.set_refraction(Refraction { medium, ..Refraction::none() });
    let layout = ProbeLayout { longest: 4, degree: ShDegree::new(2).unwrap() };
    let mut reflection = Reflection::of(backend.refraction(), MirrorSource::Learned, &layout);
    let (mirror, mut r) = (&mut reflection.mirrors[0], Sequence(5));
    let coefficients = mirror.outer.coefficients.iter_mut().chain(&mut mirror.inner.coefficients);
    coefficients.for_each(|c| *c = 0.15 * r.next());
    mirror.strength = 0.8;
    backend.set_reflection(reflection);
    backend
}

/// The reference: forward only; derivatives are differences of it.
#[derive(Clone)]
struct Mirrored {
    field: VoxelField<f64>,
    background: Background<f64>,
    medium: Medium<f64>,
    caches: [ProbeGrid<f64>; 2],
    strength: f64,
}

impl Mirrored {
    fn new(backend: &CpuBackend) -> Self {
        let Oracle { field, background } = Oracle::new(backend);
        let mirror = &backend.reflection().mirrors[0];
        let cache = |c: &ProbeGrid<f32>| {
            let values = c.coefficients.iter().map(|&v| f64::from(v)).collect();
            ProbeGrid::grey(c.bounds().cast(), c.resolution(), c.degree()).with_coefficients(values).unwrap()
        };
        Self {
            field,
            background,
            medium: backend.refraction().medium.cast(),
            caches: [cache(&mirror.outer), cache(&mirror.inner)],
            strength: mirror.strength.into(),
        }
    }

    fn tracer(&self) -> Tracer<'_, f64> {
        Tracer::new(&self.medium, &self.field.domain, Options::default())
    }

    fn path(&self, ray: &Ray<f32>, offset: f32) -> (Path<f64>, Vec<QuadraturePoint<f64>>) {
        let path = self.tracer().trace(&ray.cast());
        let step = f64::from(objective().marching.step) * self.field.domain.voxel();
        let points = quadrature(&self.field.domain, &path.segments, step, f64::from(offset));
        (path, points)
    }

    /// What a ray shows that takes the steps of `path`, with the quadrature points held.
    fn shown(&self, ray: &Ray<f64>, path: &Path<f64>, points: &[QuadraturePoint<f64>]) -> [f64; 3] {
        let (path, mut reflections) = (self.tracer().replay(ray, path), Vec::new());
        self.tracer().partial_reflections(&path, &mut reflections);
        let mut seen = self.background.radiance(path.exit.origin, path.exit.direction);
        for segment in (0..path.segments.len()).rev() {
            for r in reflections.iter().filter(|r| r.segment == segment).rev() {
                seen = self.mirror(r, seen);
            }
            let own: Vec<QuadraturePoint<f64>> =
                points.iter().filter(|q| q.segment == segment).copied().collect();
            let pixel = render(&self.field, &path.segments, &own);
            seen = [0, 1, 2].map(|c| pixel.colour[c] + pixel.transmittance * seen[c]);
        }
        seen
    }

    fn mirror(&self, r: &PartialReflection<f64>, behind: [f64; 3]) -> [f64; 3] {
        let cache = &self.caches[usize::from(r.from_inside)];
        let mirrored = cache.radiance(&cache.stencil(r.position, r.direction));
        mix(self.strength * r.reflectance, mirrored, behind)
    }

    /// Σ |C − target|² of rays with the paths that they had once.
    fn loss(&self, batch: &Batch, paths: &[(Path<f64>, Vec<QuadraturePoint<f64>>)]) -> f64 {
        let error = |k: usize| {
            let shown = self.shown(&batch.rays[k].cast(), &paths[k].0, &paths[k].1);
            (0..3).map(|c| (shown[c] - f64::from(batch.target[k][c])).powi(2)).sum::<f64>()
        };
        (0..paths.len()).map(error).sum()
    }
}

#[test]
fn mirroring_agrees_with_the_reference() {
    agrees_with_the_reference(&backend(), 50);
}

#[test]
fn soft_edges_mirror_as_the_reference_does() {
    agrees_with_the_reference(&soft_backend(), 40);
}

fn agrees_with_the_reference(backend: &CpuBackend, at_least: usize) {
    let (reference, b) = (Mirrored::new(backend), batch(300));
    let silent = backend.render_transmitted(&b.rays, &objective().marching);
    let mut changed = 0;
    for ((ray, got), silent) in b.rays.iter().zip(backend.render(&b.rays, &objective().marching)).zip(silent)
    {
        let (path, points) = reference.path(ray, 0.5);
        let want = reference.shown(&ray.cast(), &path, &points);
        changed += usize::from((got.colour[0] - silent.colour[0]).abs() > 1e-3);
        for c in 0..3 {
            let got = f64::from(got.colour[c]);
            assert!((got - want[c]).abs() < 2e-3, "{got} {}", want[c]);
        }
    }
    assert!(changed > at_least, "only {changed} rays show a reflection");
}

const E: f64 = 1e-5;

/// Central differences of the loss along each of `parameters` of the reference, against `got`.
fn compare<P>(
    (reference, b): (&Mirrored, &Batch),
    (got, tolerance): (&[f32], f64),
    stride: usize,
    parameters: P,
) where
    P: Fn(&mut Mirrored) -> &mut [f64],
{
    let paths: Vec<_> = b.rays.iter().zip(&b.offset).map(|(r, o)| reference.path(r, *o)).collect();
    let size = got.iter().fold(0.0_f64, |m, v| m.max(f64::from(v.abs())));
    let touched: Vec<usize> = (0..got.len()).filter(|&j| f64::from(got[j].abs()) > 0.05 * size).collect();
    assert!(size > 0.0 && !touched.is_empty(), "nothing has a gradient");
    for &j in touched.iter().step_by(1 + touched.len() / stride) {
        let along = |e: f64| {
            let mut moved = reference.clone();
            parameters(&mut moved)[j] += e;
            moved.loss(b, &paths)
        };
        let fd = (along(E) - along(-E)) / (2.0 * E);
        assert!((fd - f64::from(got[j])).abs() < tolerance * size, "{j}: {fd} vs {} of {size}", got[j]);
    }
}

/// Compares what all mirroring bodies have; the gradient, the reference and the batch for what only some have.
fn compare_what_all_have(backend: &CpuBackend) -> (BatchGradient, Mirrored, Batch) {
    let (reference, b) = (Mirrored::new(backend), batch(100));
    let index = IndexObjective { clip: f32::INFINITY, most_events: 8, ..bent::index_objective() };
    let got = backend.gradient(&b, &Objective { index: Some(index), ..objective() });
    let at = (&reference, &b);
    compare(at, (&got.reflection[0].outer, 2e-3), 12, |m| &mut m.caches[0].coefficients);
    compare(at, (&got.reflection[0].inner, 2e-3), 12, |m| &mut m.caches[1].coefficients);
    compare(at, (&[got.reflection[0].strength as f32], 1e-3), 1, |m| std::slice::from_mut(&mut m.strength));
    compare(at, (&got.field.density, 2e-3), 12, |m| &mut m.field.density);
    // Rounding of bent paths in single precision, as for paths without mirrors.
    compare(at, (&got.medium.index[0], 2e-2), 12, |m| m.medium.region_mut(0).coefficients_mut());
    (got, reference, b)
}

#[test]
fn gradients_of_mirrors_and_of_what_lies_before_and_behind_match_central_differences() {
    let (got, reference, b) = compare_what_all_have(&backend());
    let at = (&reference, &b);
    compare(at, (&got.field.colour, 2e-3), 12, |m| &mut m.field.colour);
    compare(at, (&got.medium.level_set[0], 2e-2), 12, |m| {
        m.medium.region_mut(0).level_set_mut().unwrap().coefficients_mut()
    });
    let texels = got.background.as_flattened();
    compare(at, (texels, 2e-3), 12, |m| match &mut m.background {
        Background::Environment(map) => map.texels.as_flattened_mut(),
        Background::Constant(c) => c,
    });
}

#[test]
fn gradients_of_soft_edges_that_mirror_match_central_differences() {
    compare_what_all_have(&soft_backend());
}

#[test]
fn mirrors_learn_the_same_with_any_number_of_threads() {
    let learned = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let mut backend = backend();
            let reflection =
                Some(ReflectionObjective { rate: 0.01, rate_strength: 0.01, rate_clearcoat: 0.01 });
            let o = Objective { reflection, ..objective() };
            (0..4).for_each(|step| _ = backend.learn(&batch(700), &o, step));
            backend.bake_reflection(&o.marching);
            (
                backend.field().density.to_vec(),
                backend.reflection().clone(),
                backend.moments().reflection.clone(),
            )
        })
    };
    let one = learned(1);
    assert!(one == learned(2) && one == learned(3));
    assert!(one.1.mirrors[0].strength != 0.8);
}

#[test]
fn without_strength_a_picture_is_that_of_transmission() {
    let mut backend = backend();
    let b = batch(100);
    let transmitted = backend.render_transmitted(&b.rays, &objective().marching);
    backend.set_reflection(backend.reflection().without_strength());
    for (a, b) in backend.render(&b.rays, &objective().marching).iter().zip(&transmitted) {
        assert!((0..3).all(|c| (a.colour[c] - b.colour[c]).abs() < 1e-5));
    }
}

/// A field of nothing before a background of one colour.
fn furnace(source: MirrorSource) -> CpuBackend {
    let mut furnace = backend();
    let mut field = furnace.field().clone();
    field.density.fill(-40.0);
    let mut empty = CpuBackend::new(field, Background::Constant([0.3, 0.6, 0.9]));
    empty.set_refraction(furnace.refraction().clone());
    furnace.reflection.source = source;
    empty.set_reflection(furnace.reflection().clone());
    empty
}

#[test]
fn a_furnace_shows_one_colour_whatever_is_mirrored() {
    for source in [MirrorSource::Baked, MirrorSource::Exact] {
        let mut backend = furnace(source);
        let marching = objective().marching;
        if source == MirrorSource::Baked {
            backend.bake_reflection(&marching);
        }
        for pixel in backend.render(&batch(200).rays, &marching) {
            for (got, want) in pixel.colour.into_iter().zip([0.3, 0.6, 0.9]) {
                assert!((got - want).abs() < 2e-3, "{source:?}: {:?}", pixel.colour);
            }
        }
    }
}

#[test]
fn secondary_rays_see_what_a_camera_at_the_surface_sees() {
    let mut backend = backend();
    backend.reflection.source = MirrorSource::Exact;
    backend.reflection.mirrors[0].strength = 1.0;
    // Against the normal: 4 % of what lies behind the camera, as far as the front face is concerned.
    let ray = Ray { origin: vec3(-0.9, 0.0, 0.0), direction: vec3(1.0, 0.0, 0.0) };
    let marching = objective().marching;
    let [all, black] = [MirrorSource::Exact, MirrorSource::Black]
        .map(|s| backend.render_mirroring(&[ray], &marching, s)[0].colour);
    assert!((0..3).all(|c| all[c] > black[c]), "{all:?} {black:?}");
}
