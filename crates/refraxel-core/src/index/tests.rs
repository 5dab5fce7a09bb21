use super::priors::{Penalty, deviation, deviation_vjp, variation, variation_vjp};
use super::*;
use crate::{Aabb, Vec3, vec3};

/// A small pseudo-random sequence in [−1, 1).
pub(crate) struct Sequence(pub u64);
impl Sequence {
    pub(crate) fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }
    pub(crate) fn vector(&mut self) -> Vec3<f64> {
        vec3(self.next(), self.next(), self.next())
    }
}

/// A box with voxels of different edge lengths and random indices around 1.2.
fn random_grid(interpolation: Interpolation, seed: u64) -> IndexGrid<f64> {
    let bounds = Aabb::new(vec3(-1.0, -1.2, 0.3), vec3(1.0, 1.5, 2.0));
    let mut grid = IndexGrid::vacuum(bounds, [13, 12, 11], interpolation);
    let mut r = Sequence(seed);
    for node in grid.parameters().collect::<Vec<_>>() {
        grid.coefficients_mut()[node] = 0.5 * (1.2 + 0.2 * r.next()).powi(2);
    }
    grid.find_flat_cells(None);
    grid
}

fn points(grid: &IndexGrid<f64>, count: usize) -> Vec<Vec3<f64>> {
    let (b, mut r) = (grid.domain().bounds, Sequence(17));
    (0..count).map(|_| b.center() + r.vector().hadamard(b.extent() * 0.49)).collect()
}

/// Central differences in f64 with step 1e-5 of O(1) quantities whose third derivatives reach 1e3: 1e-7.
const STEP: f64 = 1e-5;
const TOLERANCE: f64 = 1e-6;

fn along(axis: usize, e: f64) -> Vec3<f64> {
    let mut s = Vec3::zero();
    s[axis] = e;
    s
}

#[test]
fn the_force_is_the_gradient_of_w_except_for_interpolated_differences() {
    for interpolation in Interpolation::ALL {
        let grid = random_grid(interpolation, 3);
        let worst = points(&grid, 40).into_iter().fold(0.0_f64, |worst, x| {
            let fd = |a| (grid.w(x + along(a, STEP)) - grid.w(x - along(a, STEP))) / (2.0 * STEP);
            worst.max((vec3(fd(0), fd(1), fd(2)) - grid.gradient(x)).length())
        });
        let is_gradient = worst < TOLERANCE;
        assert_eq!(is_gradient, interpolation != Interpolation::TrilinearOfDifferences, "{worst}");
    }
}

#[test]
fn the_hessian_product_is_the_derivative_of_the_force() {
    for interpolation in Interpolation::ALL {
        let (grid, v) = (random_grid(interpolation, 5), vec3(0.3, -1.1, 0.7));
        for x in points(&grid, 40) {
            let jv = grid.gradient_pullback(x, v);
            for a in 0..3 {
                let (up, down) = (grid.gradient(x + along(a, STEP)), grid.gradient(x - along(a, STEP)));
                let fd = (up - down).dot(v) / (2.0 * STEP);
                assert!((fd - jv[a]).abs() < 1e-5, "{interpolation:?} axis {a}: {fd} vs {}", jv[a]);
            }
        }
    }
}

#[test]
fn scatter_is_the_transpose_of_sampling() {
    for interpolation in Interpolation::ALL {
        let grid = random_grid(interpolation, 7);
        let mut r = Sequence(1);
        for x in points(&grid, 40) {
            let (d_w, d_g) = (r.next(), r.vector());
            let mut grad = vec![0.0; grid.coefficients().len()];
            grid.scatter(x, d_w, d_g, &mut grad);
            // J acts on the deviation from vacuum, whose border is 0.
            let (w, g) = grid.sample(x);
            let forward = d_w * (w - VACUUM) + d_g.dot(g);
            let backward: f64 = grad.iter().zip(grid.coefficients()).map(|(d, c)| d * (c - VACUUM)).sum();
            assert!((forward - backward).abs() < 1e-13, "{interpolation:?}: {forward} vs {backward}");
            assert!((0..grad.len()).all(|j| grid.is_parameter(j) || grad[j] == 0.0));
        }
    }
}

#[test]
fn the_gradient_of_w_agrees_with_central_differences() {
    for interpolation in Interpolation::ALL {
        let grid = random_grid(interpolation, 9);
        for x in points(&grid, 20) {
            let d_x = grid.w_gradient(x);
            for a in 0..3 {
                let fd = (grid.w(x + along(a, STEP)) - grid.w(x - along(a, STEP))) / (2.0 * STEP);
                assert!((fd - d_x[a]).abs() < TOLERANCE);
            }
        }
    }
}

#[test]
fn the_field_is_vacuum_outside_and_twice_differentiable_at_the_box() {
    let grid = random_grid(Interpolation::CubicBSpline, 11);
    let b = grid.domain().bounds;
    for (outside, face) in [
        (b.max + vec3(0.1, 0.1, 0.1), vec3(b.max.x, 0.1, 1.0)),
        (b.min - vec3(0.1, 0.0, 0.0), vec3(0.0, 0.2, b.min.z)),
    ] {
        for x in [outside, face] {
            assert_eq!(grid.sample(x), (VACUUM, Vec3::zero()));
            assert_eq!(grid.gradient_pullback(x, vec3(1.0, 2.0, -1.0)), Vec3::zero());
            assert!(grid.is_flat(x));
        }
    }
    // Three layers of flat nodes make the outermost cells flat; one cell further the force starts with its square.
    let inner = vec3(b.min.x + 2.0 / 12.0 + 1e-3, 0.2, 1.1);
    assert!(!grid.is_flat(inner) && grid.gradient(inner).length() < 1e-3);
}

#[test]
fn prefiltered_samples_are_met_at_the_nodes() {
    let bounds = Aabb::new(vec3(0.0, 0.0, 0.0), vec3(1.0, 1.2, 0.9));
    let index = |x: Vec3<f64>| 1.3 + 0.2 * (9.0 * x.x).sin() * (7.0 * x.y).cos() + 0.1 * x.z;
    for interpolation in Interpolation::ALL {
        let grid = IndexGrid::from_samples(bounds, [14, 17, 12], interpolation, index);
        for node in grid.parameters() {
            let x = grid.position(node);
            assert!((grid.index(x) - index(x)).abs() < 1e-12);
        }
    }
}

#[test]
fn clearance_names_exactly_the_cells_that_differ_or_are_free() {
    let bounds = Aabb::new(vec3(0.0, 0.0, 0.0), vec3(19.0, 19.0, 19.0));
    let mut grid = IndexGrid::vacuum(bounds, [20; 3], Interpolation::CubicBSpline);
    let node = 10 + 20 * (9 + 20 * 8);
    let at = |grid: &IndexGrid<f64>, x: f64| grid.lattice().clearance_at(vec3(x, 9.5, 8.5)).unwrap();
    let pattern = |grid: &IndexGrid<f64>| [3.5, 7.5, 8.5, 11.5, 12.5].map(|x| at(grid, x));
    let mut free = vec![false; grid.coefficients().len()];
    free[node] = true;
    grid.find_flat_cells(Some(&free));
    // Node 10 is in the stencils of cells 8 … 11.
    assert_eq!(pattern(&grid), [5, 1, 0, 0, 1]);
    grid.find_flat_cells(None);
    assert_eq!(pattern(&grid), [16; 5], "without the free node all is flat");
    grid.coefficients_mut()[node] += 1e-3;
    grid.find_flat_cells(None);
    assert_eq!(pattern(&grid), [5, 1, 0, 0, 1]);
}

#[test]
fn overlapping_regions_are_refused_and_touching_ones_accepted() {
    let cube = |x: f64| {
        let bounds = Aabb::new(vec3(x, 0.0, 0.0), vec3(x + 1.0, 1.0, 1.0));
        IndexGrid::vacuum(bounds, [8; 3], Interpolation::CubicBSpline)
    };
    assert!(Medium::new(vec![cube(0.0), cube(1.0), cube(2.5)]).is_ok());
    let overlap = Medium::new(vec![cube(0.0), cube(1.5), cube(2.0)]).unwrap_err();
    assert_eq!(overlap, Overlap { first: 1, second: 2 });
    let ball = |x: f64| {
        let bounds = Aabb::new(vec3(x, 0.0, 0.0), vec3(x + 1.0, 1.0, 1.0));
        let middle = bounds.center();
        IndexGrid::sharp(LevelSet::from_samples(bounds, [16; 3], |x| (x - middle).length() - 0.3), 1.5)
    };
    assert!(Medium::new(vec![ball(0.0), ball(0.2), ball(0.4)]).is_ok(), "bodies may lie in each other");
    let overlap = Medium::new(vec![ball(0.0), cube(0.5)]).unwrap_err();
    assert_eq!(overlap, Overlap { first: 0, second: 1 });
}

#[test]
fn where_bodies_overlap_the_last_of_them_says_what_the_index_is() {
    let cube = Aabb::cube(1.0);
    let ball = |radius: f64, n: f64| {
        IndexGrid::sharp(LevelSet::from_samples(cube, [24; 3], |x: Vec3<f64>| x.length() - radius), n)
    };
    let medium = Medium::new(vec![ball(0.7, 1.5), ball(0.4, 1.0), ball(0.6, 1.33)]).unwrap();
    for (r, ruling, n) in [(0.8, None, 1.0), (0.65, Some(0), 1.5), (0.5, Some(2), 1.33), (0.1, Some(2), 1.33)]
    {
        let x = vec3(r, 0.0, 0.0);
        assert_eq!(medium.ruling_at(x), ruling);
        assert!((medium.index(x) - n).abs() < 1e-14 && (medium.w(x) - 0.5 * n * n).abs() < 1e-14);
    }
}

#[test]
fn gradients_of_the_index_priors_match_central_differences() {
    let mut grid = random_grid(Interpolation::CubicBSpline, 13);
    let penalties =
        [Penalty::Charbonnier { epsilon: 0.02 }, Penalty::Squared, Penalty::Huber { delta: 0.05 }];
    for penalty in penalties {
        let mut grad = vec![0.0; grid.coefficients().len()];
        variation_vjp(&grid, penalty, 0.7, &mut grad);
        deviation_vjp(&grid, 1.0, penalty, 0.2, &mut grad);
        for node in grid.parameters().step_by(7).collect::<Vec<_>>() {
            let mut energy = |e: f64| {
                grid.coefficients_mut()[node] += e;
                let sum = 0.7 * variation(&grid, penalty) + 0.2 * deviation(&grid, 1.0, penalty);
                grid.coefficients_mut()[node] -= e;
                sum
            };
            let fd = (energy(STEP) - energy(-STEP)) / (2.0 * STEP);
            assert!((fd - grad[node]).abs() < 1e-9, "{penalty:?}: {fd} vs {}", grad[node]);
        }
        assert!((0..grad.len()).all(|j| grid.is_parameter(j) || grad[j] == 0.0));
    }
}

#[test]
fn a_body_has_its_priors_on_all_nodes() {
    let bounds = Aabb::new(vec3(0.0, 0.0, 0.0), vec3(1.0, 1.0, 1.0));
    let level = LevelSet::from_samples(bounds, [9; 3], |x: Vec3<f64>| (x - Vec3::splat(0.5)).length() - 0.2);
    let mut grid = IndexGrid::sharp(level, 1.4);
    assert_eq!((grid.parameters().count(), grid.interior_index()), (343, Some(1.4)));
    assert!(variation(&grid, Penalty::Squared) < 1e-20);
    assert!((deviation(&grid, 1.0, Penalty::Squared) - 0.5 * 0.16).abs() < 1e-12);
    // A corner has three edges.
    grid.coefficients_mut()[342] = 0.5 * 1.5 * 1.5;
    grid.find_flat_cells(None);
    assert!((variation(&grid, Penalty::Squared) - 3.0 * 0.5 * 0.01 / 343.0).abs() < 1e-12);
    assert_eq!(grid.interior_index(), None);
}

#[test]
fn the_field_of_a_body_fills_its_box() {
    // A linear w is its own spline; in the outermost cells it is continued.
    let bounds = Aabb::new(vec3(0.0, 0.0, 0.0), vec3(1.0, 1.2, 0.9));
    let level = LevelSet::from_samples(bounds, [9; 3], |x: Vec3<f64>| (x - Vec3::splat(0.4)).length() - 0.3);
    let n = |x: Vec3<f64>| (2.0 + x.x - 0.5 * x.y + 0.3 * x.z).sqrt();
    let grid = IndexGrid::sharp_from_samples(level, [8, 9, 7], Interpolation::CubicBSpline, n);
    let mut r = Sequence(6);
    for x in points(&grid, 100) {
        assert!(
            (grid.index(x) - n(x)).abs() < 1e-12
                && (grid.gradient(x) - vec3(0.5, -0.25, 0.15)).length() < 1e-12
        );
        let (d_w, d_g) = (r.next(), r.vector());
        let mut grad = vec![0.0; grid.coefficients().len()];
        grid.scatter(x, d_w, d_g, &mut grad);
        let backward: f64 = grad.iter().zip(grid.coefficients()).map(|(d, c)| d * c).sum();
        assert!((d_w * grid.w(x) + d_g.dot(grid.gradient(x)) - backward).abs() < 1e-12);
    }
}

#[test]
fn variation_counts_each_edge_once() {
    let bounds = Aabb::new(vec3(0.0, 0.0, 0.0), vec3(1.0, 1.0, 1.0));
    // One free node of n = 1.4 among vacuum: six edges of difference 0.4.
    let grid = IndexGrid::from_samples(bounds, [7; 3], Interpolation::Trilinear, |_| 1.4);
    assert!((variation(&grid, Penalty::Squared) - 6.0 * 0.5 * 0.16).abs() < 1e-12_f64);
    assert!((deviation(&grid, 1.0, Penalty::Squared) - 0.5 * 0.16).abs() < 1e-12_f64);
}
