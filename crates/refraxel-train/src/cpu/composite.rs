//! What a ray shows of its samples, its surfaces and the background; on the way back, the comparison with its target and the sweep
//! from the back of its samples.

use super::layout::Layout;
use super::mirrored::{self, MirroredSample, Section, ShownAdjoint};
use super::packet::PacketRay;
use super::record::Record;
use super::sample::RaySamples;
use super::tape::Tape;
use crate::backend::{Batch, Objective, PixelGradient};
use refraxel_core::priors::depth_cost;
use refraxel_core::radiance::Pixel;
use refraxel_core::{Background, Ray, Vec3};

/// The last stage: a ray over the background, theory (3.9), (7.5).
#[inline(always)]
pub(super) fn composite(
    background: &Background<f32>,
    ray: &PacketRay,
    samples: RaySamples,
    mirrored: &mut [MirroredSample],
) -> Pixel<f32> {
    let mut pixel = samples.composite(ray.left);
    let behind = background.radiance(ray.exit.origin, ray.exit.direction);
    let behind = ray.through.through(behind).colour;
    pixel.colour = mirrored::shown(samples.samples, mirrored, &pixel, behind);
    pixel
}

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
    pub batch_loss: BatchLoss<'a>,
    /// Its number in the batch.
    pub number: usize,
    pub found: &'a PacketRay,
    pub samples: RaySamples<'a>,
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
    /// dLoss/d(transmittance at the end of the ray), from a measured depth or as given.
    d_transmittance: f32,
    /// The transmittance at the end of the ray.
    last: f32,
    /// 2 λ_c of theory (4.5) and the target of the ray: what draws the colours of its samples.
    draws: f32,
    target: [f32; 3],
    /// λ_d of theory (4.27) and where something was measured; 0 where nothing was.
    measured: (f32, f32),
}

impl Compared<'_> {
    /// The way back of the last stage: loss of the ray, its adjoint, and the gradient of the background. Where the adjoint is given,
    /// there is no target.
    #[inline(always)]
    pub(super) fn composite_vjp(
        &self,
        background: &Background<f32>,
        mirrored: &mut [MirroredSample],
        tape: &mut Tape,
    ) -> PixelAdjoint {
        let BatchLoss { batch, objective, asked } = self.batch_loss;
        let PacketRay { left, exit, through, .. } = self.found;
        let left = *left;
        let pixel = self.samples.composite(left);
        let given = batch.behind.get(self.number).copied();
        let behind = given.unwrap_or_else(|| background.radiance(exit.origin, exit.direction));
        let filtered = through.through(behind);
        let behind = filtered.colour;
        let (mut d_colour, mut squared_error) = ([0.0; 3], 0.0);
        let shown = mirrored::shown(self.samples.samples, mirrored, &pixel, behind);
        let asked = asked.map(|asked| asked[self.number]);
        let target = if asked.is_some() { [0.0; 3] } else { batch.target[self.number] };
        let is_drawn = asked.is_none() && !self.found.bent;
        let draws = if is_drawn && given.is_none() { 2.0 * objective.sample_colour } else { 0.0 };
        if let Some(asked) = asked {
            d_colour = asked.colour;
        } else {
            for c in 0..3 {
                let error = shown[c] - target[c];
                squared_error += f64::from(error * error);
                d_colour[c] = 2.0 * self.weight * error;
            }
        }
        let d_exit = mirrored::look_back(self.samples.samples, mirrored, d_colour, &mut tape.lookups);
        let d_filter = filtered.vjp(d_exit);
        let (d_background, d_thickness) = (d_filter.colour, d_filter.thickness.map(|d| left * d));
        if let (None, Background::Environment(map)) = (given, background) {
            let stencil = map.stencil(exit.direction);
            for k in 0..4 {
                let w = left * stencil.weight[k];
                tape.texels.push((stencil.index[k] as u32, d_background.map(|g| w * g)));
            }
        }
        let measured = batch.measured(self.number).filter(|_| is_drawn && objective.depth > 0.0);
        let measured = measured.map_or((0.0, 0.0), |at| (objective.depth, at));
        // Light from behind everything was measured nowhere: it costs as much as can be.
        let d_transmittance = asked.map_or(measured.0, |asked| asked.transmittance);
        let shown = ShownAdjoint { d_colour, d_exit, behind };
        PixelAdjoint {
            squared_error,
            shown,
            d_background,
            d_thickness,
            d_transmittance,
            last: left,
            draws,
            target,
            measured,
        }
    }
}

impl PixelAdjoint {
    /// dLoss/d(direction) of the exit ray through the background, tangential.
    pub(super) fn background_vjp(
        &self,
        background: &Background<f32>,
        batch: &Batch,
        exit: &Ray<f32>,
    ) -> Vec3<f32> {
        let Background::Environment(map) = background else { return Vec3::zero() };
        if !batch.behind.is_empty() {
            return Vec3::zero();
        }
        let unit = exit.direction;
        let free = map.radiance_vjp(unit, self.d_background.map(|g| g * self.last));
        free - unit * unit.dot(free)
    }

    /// The sweep over all sections of a ray; its records come in the order of the samples.
    #[inline(always)]
    pub(super) fn sweep(
        &self,
        layout: &Layout,
        samples: RaySamples,
        mirrored: &[MirroredSample],
        tape: &mut Tape,
    ) {
        let first = tape.records.len();
        let RaySamples { samples: all, segments } = samples;
        for section in mirrored::sections(all.len(), mirrored, self.shown) {
            let own = RaySamples { samples: &all[section.samples.clone()], segments };
            self.sweep_section(layout, own, &section, tape);
        }
        tape.records[first..].reverse();
    }

    /// The sweep from the back of a section: one record per sample, from the last on, theory (3.10)–(3.13). The twin of
    /// [`RaySamples::composite`].
    #[inline(always)]
    fn sweep_section(&self, layout: &Layout, samples: RaySamples, section: &Section, tape: &mut Tape) {
        let mut segment = u32::MAX;
        let (mut behind, d_colour_ray, mut d_weight_behind) = (section.behind, section.d_colour, 0.0);
        for s in samples.samples.iter().rev() {
            if s.segment != segment {
                segment = s.segment;
                tape.bases.push(layout.functions_of(&samples.segment_of(s).basis));
            }
            let mut contrast = s.d_weight - d_weight_behind;
            if self.measured.0 > 0.0 {
                let on = samples.segment_of(s);
                contrast += self.measured.0 * depth_cost(on.arc + on.speed * s.t, self.measured.1);
            }
            d_weight_behind += s.alpha * contrast;
            let mut d_colour = [0.0; 3];
            for c in 0..3 {
                contrast += d_colour_ray[c] * (s.colour[c] - behind[c]);
                // A colour clamped at 0 has no slope.
                let drawn = d_colour_ray[c] + self.draws * (s.colour[c] - self.target[c]);
                d_colour[c] = if s.colour[c] > 0.0 { s.before * s.alpha * drawn } else { 0.0 };
                behind[c] += s.alpha * (s.colour[c] - behind[c]);
            }
            let d_tau = s.before * (1.0 - s.alpha) * contrast - self.last * self.d_transmittance;
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
