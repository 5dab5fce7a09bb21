//! The adjoint along a stored path, theory (2.15)–(2.18) and (2.27)–(2.29): the loop of [`Tracer::replay`], read backwards.

use super::step::{State, drift_vjp, exit_vjp};
use super::{EventKind, Integrator, PartialReflectionAdjoint, Path, RayAdjoint, Step, Tracer};
use crate::radiance::SegmentAdjoint;
use crate::{IndexGradient, Ray, Real, Vec3};

impl<T: Real> Tracer<'_, T> {
    /// Transpose of the derivative of [`Self::replay`]. From dLoss/d(start, momentum) of each segment, as
    /// [`crate::radiance::render_vjp`] returns them, and dLoss/dexit: adds dLoss/dcoefficients to `grad`, from the last kick to the
    /// first, and returns dLoss/d(camera ray).
    ///
    /// # Panics
    /// For Runge–Kutta, which has no adjoint, and unless there is one `d_segments` per segment.
    pub fn vjp(
        &self,
        ray: &Ray<T>,
        path: &Path<T>,
        d_segments: &[SegmentAdjoint<T>],
        d_exit: &RayAdjoint<T>,
        grad: &mut impl IndexGradient<T>,
    ) -> RayAdjoint<T> {
        self.vjp_with_reflections(ray, path, (d_segments, &[]), d_exit, grad)
    }

    /// [`Self::vjp`] of a loss that also depends on [`Self::partial_reflections`], theory (7.3), (7.4) and (7.11): `d_reflections`
    /// has one adjoint for each, or for the first of them.
    ///
    /// # Panics
    /// As [`Self::vjp`], and if there are more adjoints than partial reflections.
    pub fn vjp_with_reflections(
        &self,
        ray: &Ray<T>,
        path: &Path<T>,
        (d_segments, d_reflections): (&[SegmentAdjoint<T>], &[PartialReflectionAdjoint<T>]),
        d_exit: &RayAdjoint<T>,
        grad: &mut impl IndexGradient<T>,
    ) -> RayAdjoint<T> {
        assert!(self.options.integrator != Integrator::RungeKutta4, "Runge–Kutta has no adjoint");
        assert_eq!(d_segments.len(), path.segments.len(), "one adjoint per segment");
        let has_gradual = !d_reflections.is_empty() && self.has_smooth_regions();
        let with_gradual = has_gradual.then(|| {
            let mut d_segments = d_segments.to_vec();
            let sharp = self.gradual_vjp(path, d_reflections, &mut d_segments, grad);
            (d_segments, sharp)
        });
        let (d_segments, d_reflections) = match &with_gradual {
            Some((d_segments, sharp)) => (&d_segments[..], &sharp[..]),
            None => (d_segments, d_reflections),
        };
        let Some(mut d) = self.end(path).map(|p| exit_vjp(p, d_exit)) else { return *d_exit };
        let mut later = path.events().filter(|e| e.kind == EventKind::Refraction).count();
        assert!(d_reflections.len() <= later, "no more adjoints than partial reflections");
        for ((step, segment), d_segment) in path.steps.iter().zip(&path.segments).zip(d_segments).rev() {
            let mut step = *step;
            if let Some(event) = step.event {
                let is_mirror = event.kind == EventKind::Refraction;
                later -= usize::from(is_mirror);
                let d_mirror = d_reflections.get(later).filter(|_| is_mirror);
                self.meet_vjp((&step, segment), d_mirror, &mut d, grad);
                step.drift = T::zero(); // done
            }
            self.advance_vjp((&step, segment.start), *d_segment, &mut d, grad);
        }
        self.start_vjp(ray, &d, grad)
    }

    /// Momentum at the end of a path, which an exhausted one may have just changed.
    fn end(&self, path: &Path<T>) -> Option<Vec3<T>> {
        let (step, segment) = (path.steps.last()?, path.segments.last()?);
        let mut state = State { x: segment.start, p: segment.momentum };
        self.meet(&mut step.clone(), false, &mut state);
        Some(state.p)
    }

    /// Transpose of one step that began at `x`.
    #[inline]
    fn advance_vjp(
        &self,
        (step, x): (&Step<T>, Vec3<T>),
        d_segment: SegmentAdjoint<T>,
        d: &mut State<T>,
        grad: &mut impl IndexGradient<T>,
    ) {
        if step.kick == T::zero() {
            return drift_vjp(step.drift, d_segment, d);
        }
        let region = usize::from(step.region);
        let grid = &self.medium.regions()[region];
        self.options.integrator.step_vjp((region, grid), (step, x), d_segment, d, grad);
    }

    /// Transpose of p = n(x) d at the camera, theory (2.18): n = √(2w), dn = dw/n.
    fn start_vjp(&self, ray: &Ray<T>, d: &State<T>, grad: &mut impl IndexGradient<T>) -> RayAdjoint<T> {
        let mut out = RayAdjoint { origin: d.x, direction: d.p };
        if let Some(region) = self.medium.ruling_at(ray.origin) {
            let grid = &self.medium.regions()[region];
            let n = grid.index(ray.origin);
            out.direction = d.p * n;
            let d_w = d.p.dot(ray.direction) / n;
            grad.add((region, grid), ray.origin, (d_w, Vec3::zero()));
            out.origin += grid.w_gradient(ray.origin) * d_w;
        }
        out
    }
}
