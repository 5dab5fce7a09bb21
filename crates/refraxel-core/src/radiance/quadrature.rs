//! Where the field is sampled along a path: the midpoint rule of theory (3.9).

use crate::segment::Segment;
use crate::{Domain, Real};

/// A quadrature point: over an interval of length `dt` about `t` the field counts as constant, with its value at `t`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct QuadraturePoint<T> {
    /// Number of the segment of the path.
    pub segment: usize,
    /// Parameter of the midpoint [scene unit].
    pub t: T,
    /// Length of the interval in t [scene unit]; its arc length is |p| dt. In a projective domain, where density counts per
    /// voxel, that of an interval through as many voxels at the nearest depth.
    pub dt: T,
}

/// Number of points that share one step length, so that one vector of 16 lanes can work on them.
pub const GROUP: usize = 16;

/// Midpoint rule along a path, theory (3.9), with steps of about `step` [scene unit inside the box], shifted by `offset` ∈
/// [0, 1) steps.
///
/// The step is adapted to the distance from the box, theory (3.3), every [`GROUP`] points. The rest of a step at the end of
/// a segment is continued in the next segment: however short the segments, there is one point per step. Error: O(step²)
/// where density and colour are smooth over a step. In a projective domain steps are even in node coordinates.
///
/// The points are part of the discretisation: derivatives hold t and dt fixed.
pub fn quadrature<T: Real>(
    domain: &Domain<T>,
    path: &[Segment<T>],
    step: T,
    offset: T,
) -> Vec<QuadraturePoint<T>> {
    let half = T::of(0.5);
    let mut points = Vec::new();
    let mut phase = offset; // steps from the start of the segment to its first point
    for (segment, s) in path.iter().enumerate() {
        let per_t = s.momentum.length().recip();
        let [t0, t1] = s.range;
        if t0 >= t1 {
            continue;
        }
        if let Some((line, per_lambda)) = domain.perspective(s.start, s.momentum, t0) {
            let (end, step_lambda, dt) = (line.lambda(t1), step / per_lambda, step * per_t);
            let mut middle = phase * step_lambda;
            while middle <= end {
                points.push(QuadraturePoint { segment, t: line.t(middle), dt });
                middle += step_lambda;
            }
            phase = (middle - end) / step_lambda;
            continue;
        }
        let mut dt = step * domain.growth(s.at(t0)) * per_t;
        let mut t = t0 + (phase - half) * dt;
        'segment: loop {
            for k in 0..GROUP {
                let middle = t + (T::of(k as f64) + half) * dt;
                if middle <= t1 {
                    points.push(QuadraturePoint { segment, t: middle, dt });
                } else {
                    phase = (middle - t1) / dt;
                    break 'segment;
                }
            }
            t += T::of(GROUP as f64) * dt;
            dt = step * domain.growth(s.at(t)) * per_t;
        }
    }
    points
}
