//! What happens in a run: typed events for whoever follows it, and how it is stopped.

use crate::cancel::{Cancel, Cancelled};
use crate::device::Device;
use crate::exposures::ExposureShift;
use crate::poses::PoseShift;
use crate::schedule::Phase;
use crate::verdict::{Found, Hypothesis, Proof, StayReason, Verdict};
use serde::{Deserialize, Serialize};

pub use crate::evidence::Shown;

/// Something that happened in a run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "event", rename_all = "snake_case")]
#[non_exhaustive]
pub enum Event {
    /// The run is trained on this device from now on.
    DeviceChosen {
        /// The device.
        device: Device,
    },
    /// Batches come from the host from now on, although the device draws them on its own otherwise.
    DrawnOnHost {
        /// Why.
        why: String,
    },
    /// The field moved to another grid.
    Stage {
        /// Number of the stage, from 0.
        stage: u32,
        /// Nodes of the grid per axis.
        resolution: [u32; 3],
        /// Voxels that are stored.
        voxels: u64,
    },
    /// The run is busy with something else from now on.
    Phase {
        /// What it is.
        phase: Phase,
    },
    /// Masks that contradict those of the other views were left out where shapes are carved.
    MasksIgnored {
        /// The views whose masks are wrong altogether: missing, or of another view.
        views: Vec<IgnoredMask>,
        /// Median overlap of all views, as in [`IgnoredMask::overlap`].
        usual_overlap: f32,
    },
    /// Masks of some views said which rays of the others meet something refractive.
    MasksCompleted {
        /// Views that have masks.
        stated: usize,
        /// All training views.
        views: usize,
        /// Masks that are needed at least.
        needed: usize,
        /// Whether it was found out. Otherwise views without masks count as if they showed nothing refractive.
        is_completed: bool,
        /// Share of the pixels of all views inside masks from then on.
        pixels: f64,
    },
    /// What straight rays cannot explain ends elsewhere than the masks: these end there from now on.
    MasksShifted {
        /// By how much their borders move outwards [pixel].
        by: f32,
        /// Mean misfit of straight rays near the new border on its inner side, 0 to 1.
        inside: f64,
        /// And on its outer side.
        outside: f64,
    },
    /// What was found without masks ends elsewhere, by what straight rays fail to explain beside it: it ends there from now on.
    Outlined {
        /// Share of the variance of misfits near its outlines that these explained, 0 to 1.
        before: f64,
        /// And that they explain now.
        now: f64,
        /// Share of the pixels of all views inside them from then on.
        pixels: f64,
    },
    /// No masks say what is refractive, and straight rays explain everything.
    NothingDetected {
        /// Share of the variance of what straight rays do not explain that the best shape explains, 0 to 1.
        separation: f64,
        /// What it had to reach.
        needed: f64,
    },
    /// No masks say what is refractive, and something was found that straight rays do not explain.
    Detected {
        /// Share of the variance of what straight rays do not explain that what was found explains, 0 to 1.
        separation: f64,
        /// Share of the pixels of all views that show it.
        pixels: f64,
    },
    /// Something refractive was found.
    RegionFound {
        /// Number of the region, from 0.
        region: usize,
        /// Middle of its box in the user's world [scene unit].
        center: [f64; 3],
        /// Edges of its box [scene unit].
        extent: [f32; 3],
        /// Nodes of its grid per axis.
        nodes: [u32; 3],
        /// Number of its faces, where it is bounded by planes.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        faces: Option<usize>,
        /// How far its outlines are from those of an ellipsoid [pixel], where it was taken for one.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        ellipsoid: Option<f32>,
        /// It was taken for a body of revolution.
        #[serde(default, skip_serializing_if = "std::ops::Not::not")]
        revolution: bool,
    },
    /// The unknown numbers of a region were searched: the hypothesis whose prediction is most alike.
    IndexSearched {
        /// Number of the region.
        region: usize,
        /// The hypothesis.
        hypothesis: Hypothesis,
        /// What fits best.
        found: Vec<Found>,
        /// How alike its prediction is to photographs that were kept aside, −1 to 1, theory (4.24).
        likeness: f64,
    },
    /// Prediction tells nothing, and straight rays may not win: the index is guessed.
    IndexGuessed {
        /// Number of the region.
        region: usize,
        /// The index that rays bend by at first.
        index: f32,
    },
    /// It is decided what stands in the regions, by prediction or by a race.
    Judged {
        /// What was decided.
        verdict: Verdict,
        /// The pictures that it rests on, one per region that prediction knows; not in logs.
        #[serde(skip)]
        pictures: Vec<Shown>,
    },
    /// Rays bend from now on.
    RaysBend {
        /// What stands in the regions where they do.
        hypotheses: Vec<Hypothesis>,
    },
    /// Bent rays were held against what straight ones had learned when it was decided.
    Proven {
        /// How they stood.
        proof: Proof,
    },
    /// Rays were to bend, but are straight from now on.
    RaysStayStraight {
        /// Why.
        why: StayReason,
    },
    /// Opaque things have a clearcoat from now on.
    ClearcoatAdded,
    /// A step overflowed; the run went back to its last good state.
    RolledBack {
        /// The step that overflowed.
        step: u64,
        /// Factor on all learning rates from now on.
        rate_scale: f32,
    },
    /// How far a piece of work has come that takes a while. Not stored in logs.
    Progress {
        /// The work.
        task: Task,
        /// Parts done.
        done: u64,
        /// Parts in all, as far as is known.
        total: u64,
    },
    /// One line of the training log.
    Record(Record),
}

/// One line of the training log.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Record {
    /// Steps done.
    pub step: u64,
    /// Share of the run that is done.
    pub progress: f64,
    /// Seconds spent training, over all resumptions.
    pub seconds: f64,
    /// PSNR of the training rays since the last record [dB].
    pub train_psnr: f64,
    /// PSNR of a validation view [dB], where one was rendered.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub val_psnr: Option<f64>,
    /// Nodes along the longest edge.
    pub resolution: u32,
    /// Stored voxels.
    pub voxels: u64,
    /// Samples shaded per ray.
    pub samples_per_ray: f64,
    /// Thousand rays per second since the last record.
    pub krays_per_s: f64,
    /// Evaluations of the index, and lengths of paths in what absorbs, that taught nothing since the last record: their paths were so
    /// chaotic that derivatives overflowed.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub overflows: u64,
    /// What the run is busy with.
    #[serde(default)]
    pub phase: Phase,
    /// Mean index of refraction where it is above 1, per region.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub index: Vec<f64>,
    /// What each refractive region absorbs of red, green and blue [1 / scene unit]; empty where all are clear.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub absorption: Vec<[f32; 3]>,
    /// How far the cameras are from where the data put them, if poses learn.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub poses: Option<PoseShift>,
    /// How far the exposures of the photographs are from their mean, if they learn.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub exposures: Option<ExposureShift>,
    /// What happened since the last record, apart from progress.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub events: Vec<Event>,
}

fn is_zero(count: &u64) -> bool {
    *count == 0
}

/// A mask that contradicts those of the other views.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct IgnoredMask {
    /// Name of the view's image.
    pub view: String,
    /// Overlap of the mask and the projection of the shape that the other views show: intersection over union.
    pub overlap: f32,
}

/// A piece of work inside of a run that takes a while.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum Task {
    /// Training itself: ten-thousandths of the run.
    Training,
    /// Decoding photographs.
    LoadingPhotos,
    /// Looking for what straight rays do not explain, view by view.
    Seeking,
    /// Looking for what hides refractive things, view by view.
    FindingOccluders,
    /// Carving shapes out of silhouettes.
    Carving,
    /// Searching the index: one part per index that is tried.
    SearchingIndex,
    /// The surface of a body by the gradient of what it should show: one part per step.
    RefiningSurface,
    /// Straight rays learn the inside of masks, or hypotheses race: one part per step.
    Judging,
    /// Letting radiance probes look at the field.
    Baking,
    /// Finding out which voxels no ray sees, and moving to a finer grid.
    Pruning,
    /// Rendering and scoring views.
    Evaluating,
}

/// Whoever follows a run: is told what happens, and may stop it.
pub struct Observer<'a> {
    cancel: &'a Cancel,
    observer: &'a mut dyn FnMut(Event),
}

impl<'a> Observer<'a> {
    /// Tells an observer, and stops as soon as somebody wishes so.
    pub fn new(cancel: &'a Cancel, observer: &'a mut dyn FnMut(Event)) -> Self {
        Self { cancel, observer }
    }

    /// Something happened.
    pub fn tell(&mut self, event: Event) {
        (self.observer)(event);
    }

    /// A piece of work goes on, unless somebody wishes to stop.
    pub fn progress(&mut self, task: Task, done: u64, total: u64) -> Result<(), Cancelled> {
        self.tell(Event::Progress { task, done, total });
        self.cancel.check()
    }

    /// Does a piece of work that tells what happens, and notes all of it but progress in `events`.
    pub(crate) fn noting<T>(&mut self, events: &mut Vec<Event>, work: impl FnOnce(&mut Observer) -> T) -> T {
        let cancel = self.cancel;
        let mut both = |event: Event| {
            if !matches!(event, Event::Progress { .. }) {
                events.push(event.clone());
            }
            self.tell(event);
        };
        work(&mut Observer::new(cancel, &mut both))
    }

    /// The wish to stop.
    pub fn cancel(&self) -> &'a Cancel {
        self.cancel
    }
}
