//! Compare a ray with its target, and the sweep from the back of its samples.

use super::layout::Layout;
use super::mirrored::{self, MirroredSample, Section, ShownAdjoint};
use super::record::Record;
use super::sample::RaySamples;
use super::scene::Scene;
use super::tape::Tape;
use crate::backend::{Batch, Objective, PixelGradient};
use refraxel_core::priors::{cauchy_slope, opacity_beta_slope};
use refraxel_core::radiance::Filter;
use refraxel_core::{Background, Ray, Vec3};

/// A range of a batch, and what is minimised.
#[derive(Clone, Copy)]
pub(super) struct BatchLoss<'a> {
    pub batch: &'a Batch,
    pub objective: &'a Objective,
    /// dLoss/d(what rays show), where it does not follow from the targets.
    pub asked: Option<&'a [PixelGradient]>,
}

/// A ray of a batch with what was found of it.
pub(super) struct Compared<'a> {
    pub batch: &'a Batch,
    /// Its number in the batch.
    pub ray: usize,
    pub samples: RaySamples<'a>,
    /// Transmittance at its end.
    pub left: f32,
    /// The ray that reaches the background.
    pub exit: &'a Ray<f32>,
    /// What absorbs light from the background.
    pub through: &'a Filter<f32>,
    /// Weight of its squared error.
    pub weight: f32,
}

/// Where the adjoint of a ray starts.
pub(super) struct PixelAdjoint {
    pub squared_error: f64,
    pub shown: ShownAdjoint,
    /// dLoss/d(the background itself) for a transmittance of 1.
    d_background: [f32; 3],
    /// dLoss/d(thickness of what absorbs light from the background).
    pub d_thickness: [f32; 3],
    /// dLoss/d(transmittance at the end of the ray), from the prior on opacity or as given.
    d_transmittance: f32,
    /// The transmittance at the end of the ray.
    last: f32,
    /// Weight of the prior on each sample.
    sparsity: f32,
}

impl Compared<'_> {
    /// Loss of the ray, its adjoint, and the gradient of the background. Where the adjoint is given, there is no target.
    #[inline(always)]
    pub(super) fn with_target(
        &self,
        scene: &Scene,
        batch_loss: BatchLoss,
        mirrored: &mut [MirroredSample],
        tape: &mut Tape,
    ) -> PixelAdjoint {
        let left = self.left;
        let pixel = self.samples.composite(left);
        let given = self.batch.behind.get(self.ray).copied();
        let exit = self.exit;
        let behind = given.unwrap_or_else(|| scene.background.radiance(exit.origin, exit.direction));
        let filtered = self.through.through(behind);
        let behind = filtered.colour;
        let (mut d_colour, mut squared_error) = ([0.0; 3], 0.0);
        let shown = mirrored::shown(self.samples.samples, mirrored, &pixel, behind);
        let asked = batch_loss.asked.map(|asked| asked[self.ray]);
        if let Some(asked) = asked {
            d_colour = asked.colour;
        } else {
            let target = self.batch.target[self.ray];
            for c in 0..3 {
                let error = shown[c] - target[c];
                squared_error += f64::from(error * error);
                d_colour[c] = 2.0 * self.weight * error;
            }
        }
        let d_exit = mirrored::look_back(self.samples.samples, mirrored, d_colour, &mut tape.lookups);
        let d_filter = filtered.vjp(d_exit);
        let (d_background, d_thickness) = (d_filter.colour, d_filter.thickness.map(|d| left * d));
        if let (None, Background::Environment(map)) = (given, scene.background) {
            let stencil = map.stencil(exit.direction);
            for k in 0..4 {
                let w = left * stencil.weight[k];
                tape.texels.push((stencil.index[k] as u32, d_background.map(|g| w * g)));
            }
        }
        let opacity = batch_loss.objective.opacity;
        let prior = if opacity > 0.0 { opacity * opacity_beta_slope(left) } else { 0.0 };
        let d_transmittance = asked.map_or(prior, |asked| asked.transmittance);
        let shown = ShownAdjoint { d_colour, d_exit, behind };
        let sparsity = batch_loss.objective.sparsity;
        PixelAdjoint {
            squared_error,
            shown,
            d_background,
            d_thickness,
            d_transmittance,
            last: left,
            sparsity,
        }
    }

    /// dLoss/d(direction) of the exit ray through the background, tangential.
    pub(super) fn background_vjp(&self, scene: &Scene, d: &PixelAdjoint) -> Vec3<f32> {
        let Background::Environment(map) = scene.background else { return Vec3::zero() };
        if !self.batch.behind.is_empty() {
            return Vec3::zero();
        }
        let unit = self.exit.direction;
        let free = map.radiance_vjp(unit, d.d_background.map(|g| g * d.last));
        free - unit * unit.dot(free)
    }
}

impl PixelAdjoint {
    /// The sweep from the back of a section: one record per sample, from the last on, theory (3.10)–(3.13). The twin of
    /// [`RaySamples::composite`].
    #[inline(always)]
    pub(super) fn march_back(
        &self,
        layout: &Layout,
        samples: RaySamples,
        section: &Section,
        tape: &mut Tape,
    ) {
        let mut segment = u32::MAX;
        let (mut behind, d_colour_ray, mut d_weight_behind) = (section.behind, section.d_colour, 0.0);
        for s in samples.samples.iter().rev() {
            if s.segment != segment {
                segment = s.segment;
                tape.bases.push(layout.functions_of(&samples.segment_of(s).basis));
            }
            let mut contrast = s.d_weight - d_weight_behind;
            d_weight_behind += s.alpha * contrast;
            let mut d_colour = [0.0; 3];
            for c in 0..3 {
                contrast += d_colour_ray[c] * (s.colour[c] - behind[c]);
                // A colour clamped at 0 has no slope.
                d_colour[c] = if s.colour[c] > 0.0 { s.before * s.alpha * d_colour_ray[c] } else { 0.0 };
                behind[c] += s.alpha * (s.colour[c] - behind[c]);
            }
            let mut d_tau = s.before * (1.0 - s.alpha) * contrast - self.last * self.d_transmittance;
            if self.sparsity > 0.0 {
                d_tau += self.sparsity * cauchy_slope(s.tau);
            }
            tape.records.push(Record {
                cell: s.cell,
                fraction: s.fraction,
                basis: tape.bases.len() as u32 - 1,
                d_theta: d_tau * s.slope,
                d_colour,
            });
        }
    }
}
