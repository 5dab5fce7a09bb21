//! The full bent render against central differences, with steps, hops and quadrature points held fixed.

use super::measures::exit_vjp;
use super::scene::options;
use super::sharp_gradients::Functional;
use crate::background::{Background, EnvironmentMap};
use crate::grid::BrickMap;
use crate::index::MediumGradient;
use crate::index::tests::Sequence;
use crate::optics::{Integrator, Options, Path, PathAdjoint, RayAdjoint, Tracer};
use crate::radiance::{PixelAdjoint, QuadraturePoint, quadrature, render, render_vjp};
use crate::segment::SegmentAdjoint;
use crate::sh::ShDegree;
use crate::{
    Aabb, Domain, Extent, FieldGradient, IndexGrid, Interpolation, LevelSet, Medium, Ray, Vec3, VoxelField,
    vec3,
};

const WEIGHTS: [f64; 3] = [0.8, -0.5, 1.1];

/// Central differences in f64 with step 1e-6 of O(1) quantities: truncation 1e-10, rounding 1e-10.
const STEP: f64 = 1e-6;
const TOLERANCE: f64 = 1e-6;

struct Scene {
    field: VoxelField<f64>,
    medium: Medium<f64>,
    background: EnvironmentMap<f64>,
    options: Options<f64>,
}

/// dLoss of everything, from one ray.
struct Gradient {
    field: FieldGradient<f64>,
    medium: MediumGradient<f64>,
    texels: Vec<[f64; 3]>,
    ray: RayAdjoint<f64>,
}

fn scene(interpolation: Interpolation, integrator: Integrator) -> Scene {
    let mut r = Sequence(41);
    let map = BrickMap::new([12; 3], |b| b != [0, 2, 1]);
    let domain = Domain::with_longest(Aabb::cube(1.3), Extent::Bounded, 12);
    let mut field = VoxelField::uniform(domain, map, ShDegree::new(2).unwrap(), -3.0);
    field.density.iter_mut().for_each(|v| *v = 1.5 * r.next() - 5.0);
    field.colour.iter_mut().for_each(|v| *v = 0.2 * r.next());
    field.clear_empty_brick();
    let mut region = |min: Vec3<f64>, max: Vec3<f64>, resolution| {
        let mut grid = IndexGrid::vacuum(Aabb::new(min, max), resolution, interpolation);
        for node in grid.parameters().collect::<Vec<_>>() {
            grid.coefficients_mut()[node] = 0.5 * (1.3 + 0.1 * r.next()).powi(2);
        }
        grid.find_flat_cells(None);
        grid
    };
    let left = region(vec3(-1.0, -0.9, -0.8), vec3(0.1, 0.8, 0.9), [12, 13, 14]);
    let right = region(vec3(0.1, -0.7, -0.9), vec3(1.1, 0.9, 0.8), [11, 14, 13]);
    let mut background = EnvironmentMap::uniform(6, [0.0; 3]);
    background.texels.iter_mut().for_each(|t| *t = r.vector().to_array());
    let medium = Medium::new(vec![left, right]).unwrap();
    Scene { field, medium, background, options: options(integrator, 0.4) }
}

impl Scene {
    fn tracer(&self) -> Tracer<'_, f64> {
        Tracer::new(&self.medium, &self.field.domain, self.options)
    }
    fn points(&self, path: &Path<f64>) -> Vec<QuadraturePoint<f64>> {
        quadrature(&self.field.domain, &path.segments, 0.1, 0.3)
    }
    /// A linear functional of the pixel over the background; `path` gives the steps.
    fn loss(&self, ray: &Ray<f64>, path: &Path<f64>, points: &[QuadraturePoint<f64>]) -> f64 {
        let path = self.tracer().replay(ray, path);
        let pixel = render(&self.field, &path.segments, points);
        let behind =
            Background::Environment(self.background.clone()).radiance(path.exit.origin, path.exit.direction);
        let colour: f64 =
            (0..3).map(|c| WEIGHTS[c] * (pixel.colour[c] + pixel.transmittance * behind[c])).sum();
        // A term of the exit position, as a near background would have.
        colour + 0.1 * path.exit.origin.dot(vec3(0.3, -0.7, 0.5))
    }
    /// The radiance part of the adjoint: dLoss/dsegments and dLoss/dexit.
    fn radiance_vjp(
        &self,
        path: &Path<f64>,
        g: &mut Gradient,
    ) -> (Vec<SegmentAdjoint<f64>>, RayAdjoint<f64>) {
        let points = self.points(path);
        let direction = path.exit.direction;
        let d =
            PixelAdjoint { colour: WEIGHTS, transmittance: 0.0, behind: self.background.radiance(direction) };
        let d_segments = render_vjp(&self.field, &path.segments, &points, &d, &mut g.field);
        let left = render(&self.field, &path.segments, &points).transmittance;
        let d_behind = WEIGHTS.map(|w| w * left);
        let stencil = self.background.stencil(direction);
        for (texel, w) in stencil.index.into_iter().zip(stencil.weight) {
            (0..3).for_each(|c| g.texels[texel][c] += w * d_behind[c]);
        }
        let origin = vec3(0.3, -0.7, 0.5) * 0.1;
        (d_segments, RayAdjoint { origin, direction: self.background.radiance_vjp(direction, d_behind) })
    }
    fn zero_gradient(&self) -> Gradient {
        Gradient {
            field: self.field.zero_gradient(),
            medium: self.medium.zero_gradient(),
            texels: vec![[0.0; 3]; self.background.texels.len()],
            ray: RayAdjoint::default(),
        }
    }
    fn gradient(&self, ray: &Ray<f64>, path: &Path<f64>) -> Gradient {
        let mut g = self.zero_gradient();
        let (segments, exit) = self.radiance_vjp(path, &mut g);
        let d = PathAdjoint { segments: &segments, reflections: &[], exit };
        g.ray = self.tracer().vjp(ray, path, &d, &mut g.medium);
        g
    }
}

/// One ray through both regions from outside, one that starts inside a region, where n ≠ 1.
fn rays() -> [Ray<f64>; 2] {
    [
        Ray { origin: vec3(-1.7, 0.25, 0.12), direction: vec3(1.0, -0.1, 0.03).normalized() },
        Ray { origin: vec3(-0.42, 0.11, 0.23), direction: vec3(0.7, 0.2, -0.3).normalized() },
    ]
}

fn relative(fd: &[f64], exact: &[f64]) -> f64 {
    let size = fd.iter().chain(exact).fold(0.0_f64, |m, v| m.max(v.abs()));
    fd.iter().zip(exact).fold(0.0_f64, |m, (a, b)| m.max((a - b).abs())) / size
}

/// Every `stride`-th index with a gradient.
fn touched(g: &[f64], stride: usize) -> Vec<usize> {
    (0..g.len()).filter(|&i| g[i] != 0.0).step_by(stride).collect()
}

/// Central differences of the loss in a few of the parameters that `value` names.
fn check(
    name: &str,
    s: &mut Scene,
    ray: &Ray<f64>,
    exact: &[f64],
    value: impl Fn(&mut Scene, usize) -> &mut f64,
) {
    let path = s.tracer().trace(ray);
    let points = s.points(&path);
    let (mut fd, mut adjoint) = (Vec::new(), Vec::new());
    for i in touched(exact, 1 + exact.iter().filter(|g| **g != 0.0).count() / 60) {
        let before = *value(s, i);
        *value(s, i) = before + STEP;
        let up = s.loss(ray, &path, &points);
        *value(s, i) = before - STEP;
        fd.push((up - s.loss(ray, &path, &points)) / (2.0 * STEP));
        *value(s, i) = before;
        adjoint.push(exact[i]);
    }
    let error = relative(&fd, &adjoint);
    assert!(fd.len() > 3 && error < TOLERANCE, "{name}: {error:.1e} over {} parameters", fd.len());
}

fn every_gradient_matches(interpolation: Interpolation, integrator: Integrator) {
    for ray in rays() {
        let mut s = scene(interpolation, integrator);
        let path = s.tracer().trace(&ray);
        assert!(path.steps.iter().filter(|s| s.kick > 0.0).count() > 15, "bends too little");
        let turned = path.exit.direction.dot(ray.direction).acos();
        assert!(turned > 0.02, "turns by {turned}");
        let g = s.gradient(&ray, &path);
        let scene = &mut s;
        for region in 0..2 {
            check("w", scene, &ray, &g.medium.index[region], |s, i| {
                &mut s.medium.region_mut(region).coefficients_mut()[i]
            });
        }
        check("density", scene, &ray, &g.field.density, |s, i| &mut s.field.density[i]);
        check("colour", scene, &ray, &g.field.colour, |s, i| &mut s.field.colour[i]);
        let texels = g.texels.as_flattened();
        check("background", scene, &ray, texels, |s, i| &mut s.background.texels[i / 3][i % 3]);
        let points = s.points(&path);
        let (mut fd, mut exact) = (Vec::new(), Vec::new());
        for axis in 0..6 {
            let shifted = |e: f64| {
                let mut r = ray;
                if axis < 3 {
                    r.origin[axis] += e
                } else {
                    r.direction[axis - 3] += e
                }
                s.loss(&r, &path, &points)
            };
            fd.push((shifted(STEP) - shifted(-STEP)) / (2.0 * STEP));
            exact.push(if axis < 3 { g.ray.origin[axis] } else { g.ray.direction[axis - 3] });
        }
        assert!(relative(&fd, &exact) < TOLERANCE, "ray: {fd:?} vs {exact:?}");
    }
}

#[test]
fn all_gradients_of_a_bent_render_match_central_differences_with_leapfrog() {
    Interpolation::ALL.into_iter().for_each(|i| every_gradient_matches(i, Integrator::Leapfrog));
}

#[test]
fn all_gradients_of_a_bent_render_match_central_differences_with_euler() {
    Interpolation::ALL.into_iter().for_each(|i| every_gradient_matches(i, Integrator::ExplicitEuler));
}

#[test]
fn all_gradients_of_a_render_through_a_sharp_body_match_central_differences() {
    let mut s = scene(Interpolation::CubicBSpline, Integrator::Leapfrog);
    let level = LevelSet::from_samples(Aabb::cube(1.0), [20; 3], |x: Vec3<f64>| {
        x.length() - 0.6 - 0.1 * (4.0 * x.x).sin() * (5.0 * x.y + 3.0 * x.z).cos()
    });
    let n = |x: Vec3<f64>| 1.4 + 0.1 * (3.0 * x.x + x.y).sin();
    let body = IndexGrid::sharp_from_samples(level, [15; 3], Interpolation::CubicBSpline, n);
    s.medium = Medium::new(vec![body]).unwrap();
    for ray in rays() {
        let path = s.tracer().trace(&ray);
        assert!(path.events().count() > 0);
        let g = s.gradient(&ray, &path);
        let scene = &mut s;
        check("w", scene, &ray, &g.medium.index[0], |s, i| &mut s.medium.region_mut(0).coefficients_mut()[i]);
        check("level set", scene, &ray, &g.medium.level_set[0], |s, i| {
            &mut s.medium.region_mut(0).level_set_mut().unwrap().coefficients_mut()[i]
        });
        check("density", scene, &ray, &g.field.density, |s, i| &mut s.field.density[i]);
        check("colour", scene, &ray, &g.field.colour, |s, i| &mut s.field.colour[i]);
    }
}

#[test]
fn exhausted_paths_have_their_adjoint_too() {
    let mut s = scene(Interpolation::CubicBSpline, Integrator::Leapfrog);
    s.options.max_segments = 14;
    let ray = rays()[0];
    let path = s.tracer().trace(&ray);
    assert_eq!(path.end, crate::optics::PathEnd::Exhausted);
    let d_exit = RayAdjoint { origin: vec3(0.3, -0.2, 0.9), direction: vec3(1.0, 0.4, -0.6) };
    let d_ray = exit_vjp(&s.tracer(), &ray, &path, d_exit, &mut s.medium.zero_gradient());
    let u = vec3(0.4, -0.7, 0.2);
    let along = |e: f64| {
        let exit = s.tracer().replay(&Ray { origin: ray.origin + u * e, ..ray }, &path).exit;
        exit.origin.dot(d_exit.origin) + exit.direction.dot(d_exit.direction)
    };
    let fd = (along(STEP) - along(-STEP)) / (2.0 * STEP);
    assert!((fd - d_ray.origin.dot(u)).abs() < TOLERANCE, "{fd} vs {}", d_ray.origin.dot(u));
}

#[test]
fn the_path_adjoint_is_the_transpose_of_its_derivative() {
    // <v, J u> by a difference along a random u in all parameters of the path at once; <Jᵀ v, u> by the adjoint.
    for integrator in [Integrator::Leapfrog, Integrator::ExplicitEuler] {
        let (s, ray) = (scene(Interpolation::CubicBSpline, integrator), rays()[0]);
        let path = s.tracer().trace(&ray);
        let mut r = Sequence(77);
        let f = Functional::random(&path, &mut r);
        let mut grad = s.medium.zero_gradient();
        let d_ray = s.tracer().vjp(&ray, &path, &f.adjoint(&[]), &mut grad);
        let (u_origin, u_direction) = (r.vector(), r.vector());
        let u: Vec<Vec<f64>> = grad.index.iter().map(|g| g.iter().map(|_| r.next()).collect()).collect();
        let functional = |e: f64| {
            let mut s = scene(Interpolation::CubicBSpline, integrator);
            for (region, u) in u.iter().enumerate() {
                let grid = s.medium.region_mut(region);
                for node in grid.parameters().collect::<Vec<_>>() {
                    grid.coefficients_mut()[node] += e * u[node];
                }
            }
            let ray = Ray { origin: ray.origin + u_origin * e, direction: ray.direction + u_direction * e };
            f.of(&s.tracer().replay(&ray, &path))
        };
        let forward = (functional(STEP) - functional(-STEP)) / (2.0 * STEP);
        let inner = |a: &[f64], b: &[f64]| -> f64 { a.iter().zip(b).map(|(a, b)| a * b).sum() };
        let medium: f64 = grad.index.iter().zip(&u).map(|(g, u)| inner(g, u)).sum();
        let backward = medium + d_ray.origin.dot(u_origin) + d_ray.direction.dot(u_direction);
        assert!((forward - backward).abs() < TOLERANCE * forward.abs(), "{forward} vs {backward}");
    }
}
