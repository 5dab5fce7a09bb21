//! Bent rays on the CPU backend against the tracer and the radiance of `refraxel-core` in double precision.

use super::*;
use refraxel_core::optics::{Options, PathAdjoint, RayAdjoint};
use refraxel_core::{IndexGrid, Interpolation, Medium, Path, Tracer};

/// Two soft balls of glass beside each other.
fn refraction() -> Refraction {
    let ball = |center: Vec3<f32>| {
        let half = vec3(0.45, 0.45, 0.45);
        let n = move |x: Vec3<f32>| 1.25 - 0.25 * (((x - center).length() - 0.25) / 0.05).tanh();
        let bounds = Aabb::new(center - half, center + half);
        IndexGrid::from_control_values(bounds, [25; 3], Interpolation::CubicBSpline, n)
    };
    let medium = Medium::new(vec![ball(vec3(-0.5, 0.0, 0.0)), ball(vec3(0.45, 0.1, 0.1))]).unwrap();
    Refraction { medium, ..Refraction::none() }
}

fn backend(extent: Extent) -> CpuBackend {
    // Smooth enough that the rounding of a bent path does not show.
    let mut field = field(2, extent);
    for brick in 0..field.map.slots() {
        let at = field.map.brick_of(brick as u32).map(|b| b as f32);
        field.density[64 * brick..64 * (brick + 1)].fill(-2.0 + (at[0] + 2.0 * at[1] + at[2]).sin());
    }
    field.clear_empty_brick();
    let mut backend = CpuBackend::new(field, environment());
    backend.set_refraction(refraction());
    backend
}

struct Bent {
    oracle: Oracle,
    medium: Medium<f64>,
}

impl Bent {
    fn new(backend: &CpuBackend) -> Self {
        Self { oracle: Oracle::new(backend), medium: backend.refraction().medium.cast() }
    }
    fn tracer(&self) -> Tracer<'_, f64> {
        Tracer::new(&self.medium, &self.oracle.field.domain, Options::default())
    }
    fn path(&self, ray: &Ray<f32>, offset: f32) -> (Path<f64>, Vec<QuadraturePoint<f64>>) {
        let path = self.tracer().trace(&ray.cast());
        let step = f64::from(objective().marching.step) * self.oracle.field.domain.voxel();
        let points = quadrature(&self.oracle.field.domain, &path.segments, step, f64::from(offset));
        (path, points)
    }
}

#[test]
fn bent_rendering_agrees_with_the_reference() {
    for extent in [Extent::Bounded, Extent::Contracted] {
        let backend = backend(extent);
        let (bent, b) = (Bent::new(&backend), batch(200));
        let mut turned = 0;
        for (ray, got) in b.rays.iter().zip(backend.render(&b.rays, &objective().marching)) {
            let (path, points) = bent.path(ray, 0.5);
            turned += usize::from(path.exit.direction.dot(ray.direction.cast()) < 0.999);
            let want = render(&bent.oracle.field, &path.segments, &points);
            let behind = bent.oracle.background.radiance(path.exit.origin, path.exit.direction);
            for c in 0..3 {
                let want = want.colour[c] + want.transmittance * behind[c];
                assert!(
                    (f64::from(got.colour[c]) - want).abs() < 2e-3,
                    "{extent:?}: {} {want}",
                    got.colour[c]
                );
            }
            assert!((f64::from(got.depth) - want.depth).abs() < 1e-2 * want.depth.max(1.0));
        }
        assert!(turned > 60, "only {turned} rays bend");
    }
}

/// How the index learns in tests: everything counts.
pub(super) fn index_objective() -> IndexObjective {
    IndexObjective {
        rate: 0.01,
        blur: 0.0,
        clip: f32::INFINITY,
        variation: (0.0, Penalty::Squared),
        deviation: (0.0, Penalty::Squared),
        largest: 2.0,
        trust: 0.02,
        surface_rate: 0.01,
        surface_blur: 3.0,
        surface_smooth: 0.01,
        most_events: 8,
    }
}

#[test]
fn bent_gradients_agree_with_the_reference() {
    let backend = backend(Extent::Bounded);
    let (bent, b) = (Bent::new(&backend), batch(300));
    let index = index_objective();
    let got = backend.gradient(&b, &Objective { index: Some(index), ..objective() });
    let mut field = bent.oracle.field.zero_gradient();
    let mut medium = bent.medium.zero_gradient();
    let mut rays = Vec::new();
    for (k, ray) in b.rays.iter().enumerate() {
        let (path, points) = bent.path(ray, b.offset[k]);
        let pixel = render(&bent.oracle.field, &path.segments, &points);
        let behind = bent.oracle.background.radiance(path.exit.origin, path.exit.direction);
        let error = |c: usize| pixel.colour[c] + pixel.transmittance * behind[c] - f64::from(b.target[k][c]);
        let colour = [0, 1, 2].map(|c| 2.0 * error(c));
        let d = PixelAdjoint { colour, transmittance: 0.0, behind };
        let segments = render_vjp(&bent.oracle.field, &path.segments, &points, &d, &mut field);
        let Background::Environment(map) = &bent.oracle.background else { unreachable!() };
        let d_background = colour.map(|g| g * pixel.transmittance);
        let direction = map.radiance_vjp(path.exit.direction, d_background);
        let exit = RayAdjoint { origin: Vec3::zero(), direction };
        let d_path = PathAdjoint { segments: &segments, reflections: &[], exit };
        rays.push(bent.tracer().vjp(&ray.cast(), &path, &d_path, &mut medium));
    }
    let worst = relative(&got.field.density, &field.density);
    assert!(worst < 2e-3, "density: {worst}");
    let worst = relative(&got.field.colour, &field.colour);
    assert!(worst < 2e-3, "colour: {worst}");
    for region in 0..2 {
        let worst = relative(&got.medium.index[region], &medium.index[region]);
        assert!(worst < 5e-3, "index of region {region}: {worst}");
    }
    let flat = |v: Vec3<f64>| v.to_array();
    let want: Vec<f64> = rays.iter().flat_map(|d| flat(d.origin)).collect();
    let origins: Vec<f32> = got.rays.iter().flat_map(|d| d.0.to_array()).collect();
    assert!(relative(&origins, &want) < 5e-3, "{}", relative(&origins, &want));
}

#[test]
fn bent_steps_are_the_same_for_any_number_of_threads() {
    let index = IndexObjective {
        rate: 0.01,
        blur: 1.0,
        clip: 1.0,
        variation: (0.1, Penalty::Charbonnier { epsilon: 0.01 }),
        deviation: (0.1, Penalty::Squared),
        largest: 2.0,
        trust: 0.02,
        surface_rate: 0.01,
        surface_blur: 3.0,
        surface_smooth: 0.01,
        most_events: 8,
    };
    let learned = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let mut backend = backend(Extent::Bounded);
            let o = Objective { index: Some(index), ..objective() };
            (0..4).for_each(|step| _ = backend.learn(&batch(700), &o, step));
            let index = backend.refraction().medium.regions()[0].coefficients().to_vec();
            (backend.field().density.to_vec(), index)
        })
    };
    let one = learned(1);
    assert_eq!(one, learned(2));
    assert_eq!(one, learned(3));
    assert_ne!(one.1, refraction().medium.regions()[0].coefficients());
}
