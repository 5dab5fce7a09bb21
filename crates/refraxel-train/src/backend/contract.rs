//! What a machine does for those who train, and what they may rely on.

use super::gradient::BatchGradient;
use super::layers::Layers;
use super::marching::Marching;
use super::mask::BrickMask;
use super::mirroring::{Caches, Mirroring};
use super::objective::Objective;
use super::outcome::StepOutcome;
use super::ray_gradient::RayGradient;
use super::snapshot::Snapshot;
use crate::cancel::{Cancel, Cancelled};
use crate::model::{Model, Optimiser, Reflection, Refraction};
use crate::rays::{Batch, Draw};
use refraxel_core::radiance::{Pixel, clearcoat::Clearcoat};
use refraxel_core::{BrickMap, Domain, Ray};
use std::any::Any;

/// A machine that renders a model and learns its parameters.
///
/// **Steps may lag.** [`submit`](Self::submit) may return before the step is done; [`outcomes`](Self::outcomes) tells later
/// what came of it. All other methods behave as if every submitted step had been done.
///
/// **Failure.** After a step whose outcome is not finite, no step changes anything until the next [`load`](Self::load).
///
/// **Faults.** A device can be lost, or its memory exhausted. [`fault`](Self::fault) says so; all outcomes are not finite from
/// then on, and what else the backend gives means nothing.
pub trait Backend: Any + Send {
    /// Why the machine cannot go on, and what to do; `None` while it can.
    fn fault(&self) -> Option<String> {
        None
    }
    /// Whether a [fault](Self::fault) is possible. Whoever trains there keeps copies of what would be lost.
    fn may_fail(&self) -> bool {
        false
    }

    /// Go on from this model: at the start, after a resumption, for a fork, or back from a failure. Without an optimiser's
    /// state, moments start at zero and every stored cell may hold matter. Forgets outcomes that nobody asked for.
    ///
    /// # Panics
    /// If the optimiser's state [does not fit](Optimiser::fits) the model.
    fn load(&mut self, model: Model, optimiser: Option<Optimiser>);
    /// The model and the optimiser's state as they are now. Ask for a [fault](Self::fault) afterwards: then it means nothing.
    fn snapshot(&self) -> Snapshot<'_>;

    /// Where the grid of the field lies, and its resolution.
    fn domain(&self) -> &Domain<f32>;
    /// Which bricks of the grid are stored.
    fn map(&self) -> &BrickMap;
    /// What bends the rays.
    fn medium(&self) -> &Refraction;
    /// What mirrors.
    fn mirroring(&self) -> Mirroring;

    /// Bend the rays otherwise; the moments of the index start at zero.
    fn set_medium(&mut self, medium: Refraction);
    /// Mirror otherwise; the moments of mirrors start at zero.
    fn set_reflection(&mut self, reflection: Reflection);
    /// Give opaque things a clearcoat; its moments start at zero.
    fn set_clearcoat(&mut self, clearcoat: Clearcoat<f32>);
    /// Set the raw density of the voxels `inside`; their moments start at zero.
    fn set_density(&mut self, value: f32, inside: &BrickMask);
    /// Move the field to another domain over the same box and another set of bricks by interpolation; the moments of the
    /// field start at zero, and every stored cell may hold matter.
    fn resample(&mut self, domain: Domain<f32>, map: BrickMap);
    /// Find out again which cells may hold matter at these cut-offs.
    fn refresh_occupancy(&mut self, marching: &Marching);
    /// Let radiance probes look at the field as it is, theory (7.9). When cancelled, nothing has changed.
    fn bake(&mut self, caches: Caches, marching: &Marching, cancel: &Cancel) -> Result<(), Cancelled>;

    /// Render rays over the background.
    fn render(&self, rays: &[Ray<f32>], marching: &Marching, layers: Layers) -> Vec<Pixel<f32>>;
    /// Begin a step: render a batch, compare, accumulate gradients, add priors, update the parameters. `step` counts from 0.
    fn submit(&mut self, batch: &Batch, objective: &Objective, step: u64);
    /// Begin a step on a batch that is yet to be drawn; false where there is no ray to draw, and no step has begun. A machine that draws
    /// batches on its own finds that out later: the [outcome](StepOutcome::rays) tells it.
    fn submit_drawn(&mut self, draw: &Draw<'_>, objective: &Objective, step: u64) -> bool {
        let batch = draw.batch();
        let is_any = !batch.rays.is_empty();
        if is_any {
            self.submit(&batch, objective, step);
        }
        is_any
    }
    /// Why the last batch came from the host although the machine draws batches on its own; `None` where there is nothing to say.
    fn why_on_host(&self) -> Option<String> {
        None
    }
    /// The outcomes of submitted steps that were not asked for yet and are known by now, in order; with `wait`, of all.
    fn outcomes(&mut self, wait: bool) -> Vec<StepOutcome>;
    /// The gradient of the batch's loss without total variation; changes nothing.
    fn gradient(&self, batch: &Batch, objective: &Objective) -> BatchGradient;
    /// The gradient of the batch's loss with respect to each of its rays; changes nothing.
    fn ray_gradients(&self, batch: &Batch, objective: &Objective) -> Vec<RayGradient>;
    /// Largest rendering weight T a that any of the rays gives to the samples around each voxel, theory (4.11).
    fn peak_weights(
        &self,
        rays: &[Ray<f32>],
        marching: &Marching,
        cancel: &Cancel,
    ) -> Result<Vec<f32>, Cancelled>;
}
