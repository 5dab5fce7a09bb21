//! What the log says of a run: what happened, and how good it is.

use super::error::TrainError;
use super::start::Trainer;
use super::tally::Tally;
use crate::cancel::Cancel;
use crate::device::Device;
use crate::evaluation::{render, score};
use crate::events::{Event, Observer, Record};
use crate::metrics::ImageScore;
use crate::schedule::training_marching;
use refraxel_data::{Photo, View};

/// Records of the validation score in a run.
const VALIDATIONS: f64 = 20.0;

impl Trainer {
    /// Something happened that stays in the log.
    pub(super) fn note(&mut self, event: Event, observer: &mut Observer) {
        self.events.push(event.clone());
        observer.tell(event);
    }

    /// The run is trained on this device from now on: in its state, and in the log with the next record.
    pub fn name_device(&mut self, device: Device) {
        self.events.push(Event::DeviceChosen { device: device.clone() });
        self.state.device = Some(device);
    }

    /// A record of what happened since the last one, if that was more than steps: for a run that pauses.
    pub fn last_words(&mut self) -> Option<Record> {
        (!self.events.is_empty() && !self.since.is_empty()).then(|| self.record())
    }

    pub(super) fn record(&mut self) -> Record {
        let tally = std::mem::replace(&mut self.since, Tally::new());
        Record {
            step: self.state.step,
            progress: self.progress().0,
            seconds: self.seconds(),
            train_psnr: tally.psnr(),
            val_psnr: None,
            resolution: self.backend.domain().resolution.into_iter().max().unwrap_or(0),
            voxels: self.backend.map().voxels() as u64,
            samples_per_ray: tally.samples_per_ray(),
            krays_per_s: tally.krays_per_s(),
            overflows: tally.overflows(),
            phase: self.state.phase,
            index: self.backend.medium().mean_indices(),
            absorption: self.backend.medium().absorption(),
            poses: self.alignment.poses.as_ref().map(|p| p.shift()),
            exposures: self.alignment.exposures.as_ref().map(|e| e.shift()),
            events: std::mem::take(&mut self.events),
        }
    }

    /// PSNR of the validation view, some times in a run; then the state counts as good, too.
    pub(super) fn validate_if_due(&mut self, cancel: &Cancel) -> Result<Option<f64>, TrainError> {
        let progress = self.progress();
        if progress.0 * VALIDATIONS < f64::from(self.state.validations + 1) {
            return Ok(None);
        }
        let marching = training_marching(&self.options, self.plan.near);
        let score_of = |(view, photo): &(View, Photo)| -> Result<ImageScore, TrainError> {
            let rendering = render(&*self.backend, &view.camera, &marching, cancel)?;
            Ok(score(&rendering, view, photo, self.plan.backdrop)?)
        };
        // Of photographs that learn nothing: nobody knows the camera and the exposure of another one.
        let is_plain = !self.alignment.learns();
        let score = self.validation.as_ref().filter(|_| is_plain).map(score_of).transpose()?;
        self.state.validations = (progress.0 * VALIDATIONS) as u32;
        self.since = Tally::new();
        self.check_device()?;
        self.keep_good_state()?;
        Ok(score.map(|s| s.psnr))
    }
}
