//! From grid to finer grid.

use super::error::TrainError;
use super::start::Trainer;
use crate::events::{Event, Observer, Task};
use crate::plan::kept_bricks;
use crate::schedule::{Progress, stage_domain, training_marching};
use refraxel_core::BrickMap;

/// Rays that decide what is pruned.
pub(crate) const PRUNING_RAYS: u64 = 600_000;
/// Every voxel has more weight than this.
const NOTHING: f32 = -1.0;

impl Trainer {
    /// The stage that this point belongs to. Where rays may bend in surroundings the coarsest grid is passed over: what will be seen
    /// through glass is predicted from the first grids, and the coarsest shows too little of it.
    pub(super) fn stage(&self, progress: Progress) -> u32 {
        let passes_over = self.bends() && self.plan.finest.extent.is_unbounded();
        let first = u32::from(passes_over).min(self.options.grid.stages - 1);
        progress.stage(&self.options).max(first)
    }

    /// Prune what no ray sees, if rays look where they will, and move to the next, finer grid.
    pub(super) fn next_stage(&mut self, observer: &mut Observer) -> Result<(), TrainError> {
        let stage = self.stage(self.scheduled());
        let marching = training_marching(&self.options, self.plan.near);
        observer.progress(Task::Pruning, 0, 2)?;
        self.backend.refresh_occupancy(&marching);
        let rays = self.sampler.spread(PRUNING_RAYS);
        let peak = self.backend.peak_weights(&rays, &marching, observer.cancel())?;
        observer.progress(Task::Pruning, 1, 2)?;
        self.let_go_of_good_state()?; // no copy on the host while two grids are alive there
        let domain = stage_domain(&self.options, &self.plan.finest, stage);
        // Straight rays never looked inside what is refractive: where they will bend they see other places.
        let least = if self.waits_to_bend() { NOTHING } else { self.options.grid.prune_weight };
        let map = kept_bricks(self.backend.map(), &peak, least, &domain);
        // A field that shows nothing yet must not lose all it could still become.
        let map = if map.bricks().is_empty() { BrickMap::dense(domain.resolution) } else { map };
        self.go_to_stage(stage, map, observer)?;
        self.keep_good_state()
    }

    /// Takes the field to the grid of a stage.
    pub(super) fn go_to_stage(
        &mut self,
        stage: u32,
        map: BrickMap,
        observer: &mut Observer,
    ) -> Result<(), TrainError> {
        self.backend.resample(stage_domain(&self.options, &self.plan.finest, stage), map);
        self.backend.refresh_occupancy(&training_marching(&self.options, self.plan.near));
        self.check_device()?;
        self.state.stage = stage;
        let (resolution, voxels) = (self.backend.domain().resolution, self.backend.map().voxels() as u64);
        self.note(Event::Stage { stage, resolution, voxels }, observer);
        Ok(())
    }
}
