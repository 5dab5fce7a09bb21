//! When the cameras learn where they are.

use super::Trainer;
use crate::backend::Backend;
use crate::poses::{PoseRate, Poses};
use crate::rays::Selection;
use crate::schedule::{Moment, Phase, picture_objective, training_marching};

/// Batches of poses have numbers of their own.
const BATCHES: u64 = u64::MAX / 8;
/// Share that is kept of what earlier batches said, at the start and at the end of a run.
const MEMORY: [f64; 2] = [0.8, 0.97];
/// A camera turns or moves by at most so many pixels at a time.
const MOST: f64 = 0.5;

impl<B: Backend> Trainer<B> {
    /// Poses that begin where the data put the cameras, where they are to learn.
    pub(super) fn fresh_poses(&self) -> Option<Poses> {
        let middle = self.plan.finest.bounds.center().cast();
        let given: Vec<_> = self.sampler.poses().copied().collect();
        let distance = |p: &refraxel_core::Pose| (p.translation - middle).length();
        let unit = given.iter().map(distance).sum::<f64>() / given.len().max(1) as f64;
        self.options.pose.learn.is_on().then(|| Poses::new(given, unit.max(f64::EPSILON)))
    }

    /// What the poses have learned.
    pub fn poses(&self) -> Option<&Poses> {
        self.poses.as_ref()
    }

    /// Go on with these poses.
    pub fn go_on_with_poses(&mut self, poses: Option<Poses>) {
        if let Some(poses) = &poses {
            self.sampler.set_poses(&poses.current());
        }
        self.poses = poses;
    }

    /// A step of the cameras, when it is time for one.
    pub(super) fn learn_poses_if_due(&mut self, moment: Moment) {
        let (step, options) = (self.state.step, &self.options.pose);
        let is_due =
            step >= options.first && step.is_multiple_of(options.every) && moment.progress.0 < options.hold;
        // Rays that bend say as much as others; they are not drawn more often.
        let is_straight = moment.phase(&self.options) == Phase::Straight;
        let selection = if is_straight { self.selection(moment) } else { Selection::All };
        let Some(poses) = self.poses.as_mut().filter(|_| is_due) else { return };
        let (batch, views) = self.sampler.batch_of_views(BATCHES + step, options.rays as usize, selection);
        let objective = picture_objective(training_marching(&self.options, self.plan.near));
        let gradients = self.backend.ray_gradients(&batch, &objective);
        let memory = MEMORY[0] + (MEMORY[1] - MEMORY[0]) * moment.progress.0;
        let pixel = f64::from(self.sampler.pixel_size(self.plan.finest.bounds.center())) / poses.unit();
        poses.learn(&views, &batch.rays, &gradients, PoseRate { memory, pixel, most: MOST * pixel });
        self.sampler.set_poses(&poses.current());
    }
}
