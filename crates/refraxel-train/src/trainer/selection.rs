//! Which rays a run learns from.

use super::start::Trainer;
use crate::rays::Selection;
use crate::refraction_search::MASK_MARGIN;
use crate::schedule::{Moment, Phase, mask_ray_fraction};
use refraxel_core::Extent;

/// Least share of rays inside masks while the index learns alone.
const INDEX_INSIDE_SHARE: f64 = 0.7;

impl Trainer {
    pub(super) fn selection(&self, moment: Moment) -> Selection {
        match moment.phase() {
            _ if !moment.bends => self.straight_selection(),
            Phase::Straight => Selection::Outside(MASK_MARGIN),
            Phase::Index => {
                Selection::Inside(self.options.refraction.mask_ray_fraction.max(INDEX_INSIDE_SHARE))
            }
            Phase::Joint => Selection::Inside(mask_ray_fraction(&self.options, moment)),
        }
    }

    /// How far photographs are blurred [pixel], theory (4.26): a window is as wide as a voxel, until the grid is as fine as it becomes or
    /// rays bend.
    pub(super) fn reach(&self, moment: Moment) -> u32 {
        if self.state.stage + 1 >= self.options.grid.stages || moment.phase() != Phase::Straight {
            return 0;
        }
        let domain = self.backend.domain();
        let at = match domain.extent {
            Extent::Projective(frame) => frame.nearest(),
            Extent::Bounded | Extent::Contracted => domain.bounds.center(),
        };
        let pixels = domain.voxel() / self.sampler.pixel_size(at);
        (0.5 * (pixels - 1.0)).max(0.0) as u32
    }

    /// Rays that stay straight after a decision make up for the time in which they did not look inside masks.
    fn straight_selection(&self) -> Selection {
        let Some(verdict) = &self.state.verdict else { return Selection::All };
        let since = verdict.proof.map_or(verdict.progress, |proof| proof.progress);
        if since < 1.0 {
            Selection::Inside(self.sampler.mask_share() / (1.0 - since))
        } else {
            Selection::All
        }
    }
}
