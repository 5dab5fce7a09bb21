use super::measures::{exit_vjp, median_and_largest, momentum_at_start};
use super::scene::{domain, options, ramp};
use crate::index::tests::Sequence;
use crate::optics::{Integrator, Options, RayAdjoint, Tracer};
use crate::{Aabb, IndexGrid, Interpolation, Medium, Ray, Real, Vec3, vec3};

/// A ball of glass with a soft edge and a flat inside, and a lens without flat parts beside it.
fn ball_and_lens() -> Medium<f64> {
    let ball = |x: Vec3<f64>| 1.0 + 0.5 * ramp(x.length() - 0.6, 0.04);
    let lens =
        |x: Vec3<f64>| 1.0 + 0.3 * (-(9.0 * (x - vec3(1.6, 0.0, 0.0)).dot(x - vec3(1.6, 0.0, 0.0)))).exp();
    let beside = Aabb::new(vec3(1.0, -0.6, -0.5), vec3(2.2, 0.6, 0.7));
    Medium::new(vec![
        IndexGrid::from_samples(Aabb::cube(1.0), [49; 3], Interpolation::CubicBSpline, ball),
        IndexGrid::from_samples(beside, [21, 22, 23], Interpolation::CubicBSpline, lens),
    ])
    .unwrap()
}

fn rays() -> Vec<Ray<f64>> {
    let mut r = Sequence(31);
    (0..40)
        .map(|_| {
            let origin = r.vector().normalized() * 2.6;
            let target = r.vector() * 0.5 + vec3(0.2, 0.0, 0.0);
            Ray { origin, direction: (target - origin).normalized() }
        })
        .collect()
}

#[test]
fn the_energy_error_is_bounded_and_of_second_order_in_the_step() {
    let (medium, domain) = (ball_and_lens(), domain());
    let drift = |step: f64| {
        let tracer = Tracer::new(&medium, &domain, options(Integrator::Leapfrog, step));
        let mut worst: f64 = 0.0;
        for ray in rays() {
            let path = tracer.trace(&ray);
            for i in (0..path.segments.len()).filter(|&i| path.steps[i].kick > 0.0) {
                let p = momentum_at_start(&medium, &path, i);
                worst = worst.max((p.dot(p) - 2.0 * medium.w(path.segments[i].start)).abs());
            }
        }
        worst
    };
    let (coarse, fine) = (drift(0.5), drift(0.25));
    let order = (coarse / fine).log2();
    assert!(coarse < 0.02 && (1.8..2.3).contains(&order), "{coarse}, {fine}: order {order}");
}

#[test]
fn exit_rays_converge_to_the_reference_with_the_order_of_their_integrator() {
    let (medium, domain) = (ball_and_lens(), domain());
    let exits = |integrator, step: f64| {
        let tracer = Tracer::new(&medium, &domain, options(integrator, step));
        rays().iter().map(|r| tracer.trace(r).exit.direction).collect::<Vec<_>>()
    };
    let exact = exits(Integrator::RungeKutta4, 0.05);
    let error = |integrator, step| {
        let off = exits(integrator, step).into_iter().zip(&exact).map(|(a, b)| (a - *b).length());
        median_and_largest(off.collect())[0]
    };
    let order = |integrator| {
        let (coarse, fine) = (error(integrator, 0.4), error(integrator, 0.1));
        ((coarse / fine).log2() / 2.0, coarse)
    };
    let (euler, euler_error) = order(Integrator::ExplicitEuler);
    let (leapfrog, leapfrog_error) = order(Integrator::Leapfrog);
    assert!((0.7..1.4).contains(&euler), "Euler: order {euler}, {euler_error}");
    assert!((1.6..2.6).contains(&leapfrog), "leapfrog: order {leapfrog}, {leapfrog_error}");
    assert!(leapfrog_error < 0.1 * euler_error);
}

#[test]
fn hops_through_flat_cells_change_nothing() {
    let (hopping, domain) = (ball_and_lens(), domain());
    let mut marching = hopping.clone();
    let grid = marching.region_mut(0);
    let inside = |j: usize| grid.position(j).length() < 0.5;
    let free: Vec<bool> = (0..grid.coefficients().len()).map(inside).collect();
    grid.find_flat_cells(Some(&free));
    let (mut hops, mut saved) = (0, 0);
    for ray in rays() {
        let o = options(Integrator::Leapfrog, 0.5);
        let a = Tracer::new(&hopping, &domain, o).trace(&ray);
        let b = Tracer::new(&marching, &domain, o).trace(&ray);
        hops += a.steps.iter().filter(|s| s.lattice > 1).count();
        saved += b.segments.len() - a.segments.len();
        // Cells count as flat up to differences of 1e-6 of w.
        let off = a.exit.direction - b.exit.direction;
        assert!(off.length() < 1e-5, "{off:?}");
    }
    assert!(hops > 10 && saved > 100, "{hops} hops saved {saved} segments");
}

/// Largest distance, in position or momentum, between the segments of paths and those that the same steps give when they
/// are undone from the exit on, theory (2.19).
fn undone_steps_differ_by<T: Real>(medium: &Medium<T>) -> f64 {
    let domain = domain().cast::<T>();
    let tracer = Tracer::new(medium, &domain, Options::default());
    let mut worst = 0.0_f64;
    for ray in rays() {
        let path = tracer.trace(&ray.cast());
        let mut x = path.exit.origin;
        let mut p = path.segments[path.segments.len() - 1].momentum;
        for (step, segment) in path.steps.iter().zip(&path.segments).rev() {
            // forward: p1 = p0 + k ∇w(x0), x1 = x0 + h p1
            worst = worst.max((p - segment.momentum).length().f64());
            x -= p * step.drift;
            worst = worst.max((x - segment.start).length().f64());
            p -= medium.regions()[usize::from(step.region)].gradient(x) * step.kick;
        }
    }
    worst
}

#[test]
fn leapfrog_returns_to_start_when_reversed() {
    let medium = ball_and_lens();
    let [double, single] = [undone_steps_differ_by(&medium), undone_steps_differ_by(&medium.cast::<f32>())];
    assert!(double < 1e-11 && single < 1e-4, "{double}, {single}");
}

#[test]
fn single_precision_gradients_agree_with_double() {
    fn gradient<T: Real>(medium: &Medium<T>) -> Vec<f64> {
        let domain = domain().cast::<T>();
        let tracer = Tracer::new(medium, &domain, Options::default());
        let mut grad = medium.zero_gradient();
        for ray in rays() {
            let (ray, v) = (ray.cast::<T>(), Sequence(3).vector().cast::<T>());
            let path = tracer.trace(&ray);
            let d_exit = RayAdjoint { origin: Vec3::zero(), direction: v };
            exit_vjp(&tracer, &ray, &path, d_exit, &mut grad);
        }
        grad.index.concat().into_iter().map(T::f64).collect()
    }
    let medium = ball_and_lens();
    let (double, single) = (gradient(&medium), gradient(&medium.cast::<f32>()));
    let size = double.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    let worst = double.iter().zip(&single).fold(0.0_f64, |m, (a, b)| m.max((a - b).abs()));
    assert!(worst < 1e-3 * size, "{}", worst / size);
}

#[test]
fn choosing_the_steps_again_changes_derivatives_by_a_term_of_second_order() {
    // The adjoint holds hops and steps fixed; the trace of a shifted ray enters the first cell elsewhere.
    let (medium, domain) = (ball_and_lens(), domain());
    let error = |step: f64| {
        let tracer = Tracer::new(&medium, &domain, options(Integrator::Leapfrog, step));
        let mut r = Sequence(8);
        let off = rays().into_iter().map(|ray| {
            let (path, v, u) = (tracer.trace(&ray), r.vector(), r.vector());
            let d_exit = RayAdjoint { origin: Vec3::zero(), direction: v };
            let d = exit_vjp(&tracer, &ray, &path, d_exit, &mut medium.zero_gradient());
            let exit =
                |e: f64| tracer.trace(&Ray { origin: ray.origin + u * e, ..ray }).exit.direction.dot(v);
            let fd = (exit(1e-5) - exit(-1e-5)) / 2e-5;
            (fd - d.origin.dot(u)) / fd.abs().max(0.1)
        });
        median_and_largest(off.collect())[0]
    };
    let (coarse, fine) = (error(0.4), error(0.1));
    assert!(coarse < 0.02 && fine < 0.1 * coarse, "{coarse} to {fine}");
}

#[test]
fn free_coefficients_inside_a_flat_region_get_their_gradient() {
    let (mut medium, domain) = (ball_and_lens(), domain());
    let ray = Ray { origin: vec3(-2.0, 0.1, 0.05), direction: vec3(1.0, 0.0, 0.0) };
    let d_exit = RayAdjoint { origin: Vec3::zero(), direction: vec3(0.0, 1.0, 0.0) };
    let o = options(Integrator::Leapfrog, 0.5);
    let gradient = |medium: &Medium<f64>| {
        let tracer = Tracer::new(medium, &domain, o);
        let path = tracer.trace(&ray);
        let mut grad = medium.zero_gradient();
        exit_vjp(&tracer, &ray, &path, d_exit, &mut grad);
        (grad.index.swap_remove(0), path)
    };
    let node = 24 + 49 * (25 + 49 * 25); // beside the ray, near the centre
    assert_eq!(gradient(&medium).0[node], 0.0, "hopped over");
    let grid = medium.region_mut(0);
    let free: Vec<bool> = (0..grid.coefficients().len()).map(|j| grid.is_parameter(j)).collect();
    grid.find_flat_cells(Some(&free));
    let (grad, path) = gradient(&medium);
    let mut exit = |e: f64| {
        medium.region_mut(0).coefficients_mut()[node] += e;
        let out = Tracer::new(&medium, &domain, o).replay(&ray, &path).exit.direction.y;
        medium.region_mut(0).coefficients_mut()[node] -= e;
        out
    };
    let fd = (exit(1e-6) - exit(-1e-6)) / 2e-6;
    assert!(fd.abs() > 1e-3 && (fd - grad[node]).abs() < 1e-6 * fd.abs(), "{fd} vs {}", grad[node]);
}
