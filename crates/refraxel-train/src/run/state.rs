//! Where a run stands.

use crate::device::Device;
use crate::schedule::{PausedSchedule, Phase};
use crate::verdict::{Baseline, Verdict};
use serde::{Deserialize, Serialize};

/// Where a run stands. The random numbers are a function of the seed and the step, so this is all their state.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct State {
    /// Steps done.
    pub step: u64,
    /// Stage of the schedule.
    pub stage: u32,
    /// What the run is busy with.
    #[serde(default)]
    pub phase: Phase,
    /// Where the schedule was held for the last time, and until when.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub paused: Option<PausedSchedule>,
    /// Share of the schedule after which rays bent, once they do: it is held while that is decided.
    #[serde(default)]
    pub bends_since: Option<f64>,
    /// Refractive things were sought that no mask shows.
    #[serde(default)]
    pub detection_done: bool,
    /// By how much the borders of refractive masks were moved outwards when rays were to bend [pixel].
    #[serde(default, skip_serializing_if = "is_zero")]
    pub mask_shift: f32,
    /// Rays were to bend, but nothing refractive was found: they stay straight.
    #[serde(default)]
    pub stays_straight: bool,
    /// What the judge decided about refractive regions, where hypotheses raced.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub verdict: Option<Verdict>,
    /// What straight rays had learned when rays began to bend, until bent ones have been held against it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub baseline: Option<Baseline>,
    /// Seconds spent training.
    pub seconds: f64,
    /// The device that it was trained on last, where that was noted.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub device: Option<Device>,
    /// Validation scores recorded.
    pub validations: u32,
    /// Factor on the learning rates after overflows.
    pub rate_scale: f32,
    /// Overflows since the last good state.
    pub rollbacks: u32,
}

fn is_zero(shift: &f32) -> bool {
    *shift == 0.0
}

impl Default for State {
    fn default() -> Self {
        Self {
            step: 0,
            stage: 0,
            phase: Phase::Straight,
            paused: None,
            bends_since: None,
            detection_done: false,
            mask_shift: 0.0,
            stays_straight: false,
            verdict: None,
            baseline: None,
            seconds: 0.0,
            device: None,
            validations: 0,
            rate_scale: 1.0,
            rollbacks: 0,
        }
    }
}
