//! When the photographs themselves learn: where their cameras are, and their exposures.

use super::start::Trainer;
use crate::alignment::Alignment;
use crate::backend::{Layers, Objective};
use crate::exposures::Exposures;
use crate::poses::{PoseRate, Poses, lens_slopes};
use crate::rays::{Selection, shown};
use crate::schedule::{Moment, Phase, training_marching};
use rayon::prelude::*;
use refraxel_core::{Camera, Pose};

/// Batches of this have numbers of their own.
const BATCHES: u64 = u64::MAX / 8;
/// Share that is kept of what earlier batches said, at the start and at the end of a run.
const MEMORY: [f64; 2] = [0.8, 0.97];
/// Lenses learn from this share of a run on: a scene that is still coarse says nothing right of them.
const LENSES_FROM: f64 = 0.2;
/// Poses learn every so many steps, from that many rays, from this step on (they need a scene to be compared with), and are held after
/// this share of the run.
const EVERY: u64 = 4;
const RAYS: usize = 4096;
const FIRST: u64 = 48;
const HOLD: f64 = 0.9;
/// A camera turns or moves by at most so many pixels at a time.
const MOST: f64 = 0.5;

impl Trainer {
    /// What the photographs are to learn, before they have learned anything.
    pub(super) fn fresh_alignment(&self) -> Alignment {
        let learns_exposures = self.options.exposure.enabled.is_on();
        let exposures = learns_exposures.then(|| Exposures::new(self.sampler.views()));
        Alignment { poses: self.options.pose.enabled.is_on().then(|| self.given_poses()), exposures }
    }

    /// Poses that begin where the data put the cameras.
    fn given_poses(&self) -> Poses {
        let middle = self.plan.finest.bounds.center().cast();
        let cameras: Vec<Camera> = self.sampler.given_cameras().copied().collect();
        let given: Vec<Pose> = cameras.iter().map(|c| c.world_from_camera).collect();
        let distance = |p: &Pose| (p.translation - middle).length();
        let unit = given.iter().map(distance).sum::<f64>() / given.len().max(1) as f64;
        let poses = Poses::new(given, unit.max(f64::EPSILON));
        if self.options.pose.lens.is_on() { poses.with_lenses(&cameras) } else { poses }
    }

    /// What the photographs themselves have learned.
    pub fn alignment(&self) -> &Alignment {
        &self.alignment
    }

    /// Go on with what photographs have learned.
    pub fn go_on_with_alignment(&mut self, alignment: Alignment) {
        if let Some(poses) = &alignment.poses {
            self.sampler.set_cameras(|view, given| poses.camera(view, given));
        }
        if let Some(exposures) = &alignment.exposures {
            self.sampler.set_exposures(&exposures.filters());
        }
        self.alignment = alignment;
    }

    /// A step of what the photographs themselves learn, when it is time for one.
    pub(super) fn align_if_due(&mut self, moment: Moment) {
        let step = self.state.step;
        let is_due = step >= FIRST && step.is_multiple_of(EVERY) && moment.progress.0 < HOLD;
        if self.alignment.learns() && is_due {
            self.align(moment);
        }
    }

    fn align(&mut self, moment: Moment) {
        // Rays that bend say as much as others; they are not drawn more often.
        let is_straight = moment.phase() == Phase::Straight;
        let selection = if is_straight { self.selection(moment) } else { Selection::All };
        let (batch, views) = self.sampler.batch_of_views(BATCHES + self.state.step, RAYS, selection);
        let marching = training_marching(&self.options, self.plan.near);
        let memory = MEMORY[0] + (MEMORY[1] - MEMORY[0]) * moment.progress.0;
        let residuals: Vec<[f32; 3]> = if let Some(poses) = &mut self.alignment.poses {
            let gradients = self.backend.ray_gradients(&batch, &Objective::still(marching));
            let pixel = f64::from(self.sampler.pixel_size(self.plan.finest.bounds.center())) / poses.unit();
            let rate = PoseRate { memory, pixel, most: MOST * pixel };
            let slopes = |(view, ray): (&usize, _)| lens_slopes(self.sampler.camera(*view), ray);
            let slopes: Vec<_> = if poses.learns_lenses() && moment.progress.0 >= LENSES_FROM {
                views.par_iter().zip(&batch.rays).map(slopes).collect()
            } else {
                Vec::new()
            };
            poses.learn(&views, &batch.rays, &gradients, &slopes, rate);
            self.sampler.set_cameras(|view, given| poses.camera(view, given));
            gradients.iter().map(|d| d.residual).collect()
        } else {
            let seen = shown(&self.backend.render(&batch.rays, &marching, Layers::All), &batch);
            let pairs = seen.iter().zip(&batch.target);
            pairs.map(|(colour, target)| [0, 1, 2].map(|c| colour[c] - target[c])).collect()
        };
        if let Some(exposures) = &mut self.alignment.exposures {
            exposures.learn(&views, &batch.target, &residuals, memory);
            self.sampler.set_exposures(&exposures.filters());
        }
    }
}
