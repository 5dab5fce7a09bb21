//! The adjoint of a path, theory (2.15)–(2.18) and (2.27)–(2.29): the loop of [`Tracer::replay`], read backwards.

use super::event::SegmentEndAdjoint;
use super::options::Integrator;
use super::path::{EventKind, Path, Step};
use super::path_adjoint::{PathAdjoint, RayAdjoint};
use super::step::{KickedStep, State, drift_vjp, exit_vjp};
use super::tracer::Tracer;
use crate::segment::SegmentAdjoint;
use crate::{IndexGradient, Ray, Real, Vec3};

impl<T: Real> Tracer<'_, T> {
    /// Transpose of the derivative of [`Self::replay`] and of [`Self::partial_reflections`], theory (2.15)–(2.18),
    /// (2.27)–(2.29), (7.3), (7.4) and (7.12).
    ///
    /// `path` is a path of `ray`, `d` is dLoss/d(path). Returns dLoss/d(camera ray) and adds dLoss/d(coefficients of w and
    /// φ) to `grad`, from the last kick to the first.
    ///
    /// Exact for the replayed path. Not followed: changes of the number of steps, of which surfaces the path meets, and of
    /// their events from refraction to total reflection; sines of grazing rays below [`GRAZING`](super::GRAZING).
    ///
    /// # Panics
    /// For Runge–Kutta, which has no adjoint; unless there is one adjoint per segment; and if there are more adjoints than
    /// partial reflections.
    pub fn vjp(
        &self,
        ray: &Ray<T>,
        path: &Path<T>,
        d: &PathAdjoint<'_, T>,
        grad: &mut impl IndexGradient<T>,
    ) -> RayAdjoint<T> {
        assert!(self.options.integrator != Integrator::RungeKutta4, "Runge–Kutta has no adjoint");
        assert_eq!(d.segments.len(), path.segments.len(), "one adjoint per segment");
        if d.reflections.is_empty() || !self.has_smooth_regions() {
            return self.replay_vjp(ray, path, d, grad);
        }
        let mut segments = d.segments.to_vec();
        let sharp = self.smooth_reflections_vjp(path, d.reflections, &mut segments, grad);
        self.replay_vjp(
            ray,
            path,
            &PathAdjoint { segments: &segments, reflections: &sharp, exit: d.exit },
            grad,
        )
    }

    /// [`Self::vjp`] where all partial reflections are those of sharp surfaces.
    fn replay_vjp(
        &self,
        ray: &Ray<T>,
        path: &Path<T>,
        d: &PathAdjoint<'_, T>,
        grad: &mut impl IndexGradient<T>,
    ) -> RayAdjoint<T> {
        let Some(mut d_state) = self.end(path).map(|p| exit_vjp(p, &d.exit)) else { return d.exit };
        let mut later = path.events().filter(|e| e.kind == EventKind::Refraction).count();
        assert!(d.reflections.len() <= later, "no more adjoints than partial reflections");
        for ((step, segment), d_segment) in path.steps.iter().zip(&path.segments).zip(d.segments).rev() {
            let mut step = *step;
            if let Some(event) = step.event {
                let is_mirror = event.kind == EventKind::Refraction;
                later -= usize::from(is_mirror);
                let d_mirror = d.reflections.get(later).filter(|_| is_mirror);
                let d_segment_end = SegmentEndAdjoint { tau: d_segment.end, mirror: d_mirror };
                self.event_vjp(&step, segment, d_segment_end, &mut d_state, grad);
                step.drift = T::zero(); // the transpose of the event includes that of the drift
            }
            self.advance_vjp(&step, segment.start, *d_segment, &mut d_state, grad);
        }
        self.start_vjp(ray, &d_state, grad)
    }

    /// Momentum at the end of a path, which an event may have just changed; `None` for a path without segments.
    fn end(&self, path: &Path<T>) -> Option<Vec3<T>> {
        let (step, segment) = (path.steps.last()?, path.segments.last()?);
        let mut state = State { x: segment.start, p: segment.momentum };
        if let Some(event) = &step.event {
            let at = self.impact(step, event, &state);
            state = at.after(&event.turn(&at));
        }
        Some(state.p)
    }

    /// Transpose of one step that began at `x`: `d` of the state after it becomes that before it.
    #[inline]
    fn advance_vjp(
        &self,
        step: &Step<T>,
        x: Vec3<T>,
        d_segment: SegmentAdjoint<T>,
        d: &mut State<T>,
        grad: &mut impl IndexGradient<T>,
    ) {
        let Some(region) = step.within.map(usize::from).filter(|_| step.kick != T::zero()) else {
            return drift_vjp(step.drift, d_segment, d);
        };
        let grid = &self.medium.regions()[region];
        let at = KickedStep { grid, region, x, kick: step.kick, drift: step.drift };
        self.options.integrator.step_vjp(&at, d_segment, d, grad)
    }

    /// Transpose of p = n(x) d at the camera, theory (2.18): n = √(2w), hence dn = dw/n.
    fn start_vjp(&self, ray: &Ray<T>, d: &State<T>, grad: &mut impl IndexGradient<T>) -> RayAdjoint<T> {
        let mut out = RayAdjoint { origin: d.x, direction: d.p };
        if let Some(region) = self.medium.ruling_at(ray.origin) {
            let grid = &self.medium.regions()[region];
            let n = grid.index(ray.origin);
            out.direction = d.p * n;
            let d_w = d.p.dot(ray.direction) / n;
            grad.add(region, grid, ray.origin, d_w, Vec3::zero());
            out.origin += grid.w_gradient(ray.origin) * d_w;
        }
        out
    }
}
