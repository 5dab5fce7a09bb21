use super::*;
use crate::field::{FieldGradient, VoxelField};
use crate::grid::{BrickMap, Extent, Projection};
use crate::index::tests::Sequence;
use crate::sh::ShDegree;
use crate::{Aabb, AlignedVec, Domain, Ray, vec3};

fn field(degree: u8, extent: Extent, seed: u64) -> VoxelField<f64> {
    let bounds = Aabb::new(vec3(-1.0, -1.2, -0.8), vec3(1.0, 1.2, 0.8));
    let domain = Domain::with_longest(bounds, extent, 11);
    let map = BrickMap::new(domain.resolution, |b| b != [1, 1, 1]);
    let mut f = VoxelField::uniform(domain, map, ShDegree::new(degree).unwrap(), -2.0);
    let mut r = Sequence(seed);
    f.density.iter_mut().for_each(|v| *v = 2.0 * r.next() - 2.5);
    f.colour.iter_mut().for_each(|v| *v = 0.3 * r.next());
    f.clear_empty_brick();
    f
}

/// What is seen from a point in front of the field.
fn projective() -> Extent {
    let ahead = vec3(0.1, 0.2, 1.0).normalized();
    let right = vec3(0.0, 1.0, 0.0).cross(ahead).normalized();
    Extent::Projective(Projection {
        eye: ahead * -3.0,
        axes: [right, ahead.cross(right), ahead],
        near: 1.4,
        edges: [[-0.9, 0.9], [-0.9, 0.9]],
        baseline: 1.2,
    })
}

/// Two segments with a kink, as a bent ray has; the second travels in a medium of index 1.3.
fn bent_path() -> Vec<Segment<f64>> {
    let p0 = vec3(0.6, 0.5, 0.3).normalized();
    let kink = vec3(-0.1, -0.05, 0.02);
    let p1 = vec3(0.5, 0.7, -0.2).normalized() * 1.3;
    vec![
        Segment { start: kink - p0 * 1.9, momentum: p0, range: [0.3, 1.9] },
        Segment { start: kink, momentum: p1, range: [0.0, 0.9] },
    ]
}

const BEHIND: [f64; 3] = [0.2, 0.7, 0.4];
const WEIGHTS: [f64; 3] = [0.8, -0.5, 1.1];
const OPACITY_WEIGHT: f64 = 0.37;

/// A linear functional of C + T B and T, whose gradient the adjoint must give.
fn loss(f: &VoxelField<f64>, path: &[Segment<f64>], points: &[QuadraturePoint<f64>]) -> f64 {
    let p = render(f, path, points);
    let colour: f64 = (0..3).map(|c| WEIGHTS[c] * (p.colour[c] + p.transmittance * BEHIND[c])).sum();
    colour + OPACITY_WEIGHT * p.transmittance
}

fn adjoint(
    f: &VoxelField<f64>,
    path: &[Segment<f64>],
    points: &[QuadraturePoint<f64>],
) -> (FieldGradient<f64>, Vec<SegmentAdjoint<f64>>) {
    let d = PixelAdjoint { colour: WEIGHTS, transmittance: OPACITY_WEIGHT, behind: BEHIND };
    let mut grad = f.zero_gradient();
    let d_path = render_vjp(f, path, points, &d, &mut grad);
    (grad, d_path)
}

/// Largest difference between two gradients relative to the larger one's size.
fn relative(a: &[f64], b: &[f64]) -> f64 {
    let size = a.iter().chain(b).fold(0.0_f64, |m, v| m.max(v.abs()));
    a.iter().zip(b).fold(0.0_f64, |m, (a, b)| m.max((a - b).abs())) / size
}

/// Central differences in f64 with step 1e-6 of O(1) quantities: truncation 1e-12, rounding 1e-10.
const STEP: f64 = 1e-6;
const TOLERANCE: f64 = 1e-6;

#[test]
fn parameter_gradients_match_central_differences_on_bent_paths() {
    for (degree, extent) in
        [(0, Extent::Bounded), (1, Extent::Contracted), (2, projective()), (3, Extent::Contracted)]
    {
        let (mut f, path) = (field(degree, extent, 7), bent_path());
        let points = quadrature(&f.domain, &path, 0.17, 0.3);
        let (grad, _) = adjoint(&f, &path, &points);
        type Parameters = fn(&mut VoxelField<f64>) -> &mut AlignedVec<f64>;
        let kinds: [(&str, &[f64], Parameters); 2] =
            [("density", &grad.density, |f| &mut f.density), ("colour", &grad.colour, |f| &mut f.colour)];
        for (name, grad, parameters) in kinds {
            let (mut fd, mut exact) = (Vec::new(), Vec::new());
            for i in (0..grad.len()).filter(|&i| grad[i] != 0.0).step_by(3) {
                let v = parameters(&mut f)[i];
                parameters(&mut f)[i] = v + STEP;
                let up = loss(&f, &path, &points);
                parameters(&mut f)[i] = v - STEP;
                fd.push((up - loss(&f, &path, &points)) / (2.0 * STEP));
                parameters(&mut f)[i] = v;
                exact.push(grad[i]);
            }
            assert!(exact.len() > 5 && relative(&fd, &exact) < TOLERANCE, "{name}, degree {degree}");
        }
    }
}

#[test]
fn path_gradients_match_central_differences() {
    for (degree, extent) in [(1, projective()), (2, Extent::Bounded), (3, Extent::Contracted)] {
        let (f, path) = (field(degree, extent, 3), bent_path());
        let points = quadrature(&f.domain, &path, 0.17, 0.3);
        let (_, d_path) = adjoint(&f, &path, &points);
        let (mut fd, mut exact) = (Vec::new(), Vec::new());
        for (segment, axis, is_momentum) in
            (0..path.len()).flat_map(|s| (0..3).flat_map(move |a| [(s, a, false), (s, a, true)]))
        {
            let shifted = |e: f64| {
                let mut p = path.clone();
                let v = if is_momentum { &mut p[segment].momentum } else { &mut p[segment].start };
                v[axis] += e;
                loss(&f, &p, &points)
            };
            fd.push((shifted(STEP) - shifted(-STEP)) / (2.0 * STEP));
            let d = d_path[segment];
            exact.push(if is_momentum { d.momentum[axis] } else { d.start[axis] });
        }
        assert!(relative(&fd, &exact) < TOLERANCE, "degree {degree}: {fd:?} vs {exact:?}");
    }
}

#[test]
fn single_precision_gradients_agree_with_double() {
    let (f, path) = (field(2, Extent::Bounded, 11), bent_path());
    let points = quadrature(&f.domain, &path, 0.17, 0.3);
    let (exact, _) = adjoint(&f, &path, &points);
    let single = |v: &[f64]| AlignedVec::from_slice(&v.iter().map(|&v| v as f32).collect::<Vec<_>>());
    let single = VoxelField::<f32> {
        domain: f.domain.cast(),
        map: f.map.clone(),
        degree: f.degree,
        density: single(&f.density),
        colour: single(&f.colour),
    };
    let path32: Vec<_> = path
        .iter()
        .map(|s| Segment {
            start: s.start.cast(),
            momentum: s.momentum.cast(),
            range: s.range.map(|v| v as f32),
        })
        .collect();
    let points32: Vec<_> = points
        .iter()
        .map(|q| QuadraturePoint { segment: q.segment, t: q.t as f32, dt: q.dt as f32 })
        .collect();
    let d = PixelAdjoint {
        colour: WEIGHTS.map(|v| v as f32),
        transmittance: OPACITY_WEIGHT as f32,
        behind: BEHIND.map(|v| v as f32),
    };
    let mut grad = single.zero_gradient();
    render_vjp(&single, &path32, &points32, &d, &mut grad);
    let wide = |v: &[f32]| v.iter().map(|&v| f64::from(v)).collect::<Vec<_>>();
    assert!(relative(&wide(&grad.density), &exact.density) < 1e-3);
    assert!(relative(&wide(&grad.colour), &exact.colour) < 1e-3);
}

#[test]
fn forward_and_adjoint_are_transposes_for_colour() {
    // C is linear in the SH coefficients while no channel is clamped: <g, C(k) − C(0)> = <grad, k>.
    let mut f = field(2, Extent::Bounded, 5);
    f.colour.iter_mut().for_each(|v| *v *= 0.3);
    let path = bent_path();
    let points = quadrature(&f.domain, &path, 0.1, 0.0);
    let (grad, _) = adjoint(&f, &path, &points);
    let inner: f64 = grad.colour.iter().zip(f.colour.iter()).map(|(g, k)| g * k).sum();
    let with = loss(&f, &path, &points);
    f.colour.fill(0.0);
    assert!((with - loss(&f, &path, &points) - inner).abs() < 1e-12);
}

#[test]
fn a_uniform_fog_transmits_exp_minus_sigma_length() {
    let bounds = Aabb::new(vec3(-1.0, -1.0, -1.0), vec3(1.0, 1.0, 1.0));
    let domain = Domain::with_longest(bounds, Extent::Bounded, 9);
    let map = BrickMap::dense(domain.resolution);
    let f = VoxelField::uniform(domain, map, ShDegree::new(0).unwrap(), -3.0_f64);
    let ray = Ray { origin: vec3(-3.0, 0.1, 0.2), direction: vec3(1.0, 0.0, 0.0) };
    let path = [Segment::straight(&ray, &f.domain, 0.0).unwrap()];
    let pixel = render(&f, &path, &quadrature(&f.domain, &path, 0.125, 0.5));
    let sigma = f.density_scale() * crate::field::softplus(-3.0);
    assert!((pixel.transmittance - (-2.0 * sigma).exp()).abs() < 1e-12);
    assert!((pixel.colour[0] - 0.5 * (1.0 - pixel.transmittance)).abs() < 1e-12);
}

#[test]
fn contracted_steps_reach_the_far_limit_in_logarithmic_time() {
    let f = field(0, Extent::Contracted, 1);
    let ray = Ray { origin: vec3(0.0, 0.0, 0.0), direction: vec3(0.0, 0.6, 0.8) };
    let path = [Segment::straight(&ray, &f.domain, 0.0).unwrap()];
    let points = quadrature(&f.domain, &path, 0.1, 0.5);
    assert!(points.len() < 80, "{} points", points.len());
    let covered: f64 = points.iter().map(|q| q.dt).sum();
    assert!((covered - path[0].range[1]).abs() < 0.2 * path[0].range[1]);
}

#[test]
fn a_straight_ray_cut_into_pieces_has_the_same_points_colour_and_depth() {
    let f = field(1, Extent::Bounded, 9);
    let ray = Ray { origin: vec3(-3.0, 0.1, 0.2), direction: vec3(0.96, 0.1, 0.05).normalized() };
    let whole = Segment::straight(&ray, &f.domain, 0.0).unwrap();
    let [start, end] = whole.range;
    // Pieces shorter than a step, a medium of index 1.5 in name only, and an empty piece.
    let cuts: Vec<f64> = (0..=40).map(|k| start + (end - start) * f64::from(k) / 40.0).collect();
    let mut pieces: Vec<_> = cuts
        .windows(2)
        .map(|c| Segment {
            start: whole.at(c[0]),
            momentum: whole.momentum * 1.5,
            range: [0.0, (c[1] - c[0]) / 1.5],
        })
        .collect();
    pieces.insert(7, Segment { range: [0.0, 0.0], ..pieces[7] });
    pieces.insert(0, Segment { range: [start, start], ..whole });
    let (a, b) = (quadrature(&f.domain, &[whole], 0.17, 0.3), quadrature(&f.domain, &pieces, 0.17, 0.3));
    assert_eq!(a.len(), b.len());
    let (a, b) = (render(&f, &[whole], &a), render(&f, &pieces, &b));
    assert!((a.transmittance - b.transmittance).abs() < 1e-12 && (a.depth - b.depth).abs() < 1e-12);
    assert!((0..3).all(|c| (a.colour[c] - b.colour[c]).abs() < 1e-12));
}
