//! A run under way: how it starts or goes on, and where it stands.

use super::handle::{Handle, Requests};
use super::setup::Setup;
use super::{IntoBackend, SessionError};
use crate::backend::Backend;
use crate::cancel::Cancel;
use crate::device::Device;
use crate::events::Event;
use crate::model::{Gate, Model, Optimiser};
use crate::options::Options;
use crate::plan::Plan;
use crate::run::{Run, Source, State};
use crate::trainer::Trainer;
use refraxel_data::Dataset;

/// A run under way.
pub struct Session {
    pub(super) data: Dataset,
    pub(super) source: Source,
    pub(super) trainer: Trainer,
    pub(super) cancel: Cancel,
    pub(super) requests: Requests,
    /// The step that was saved last.
    pub(super) saved: u64,
}

impl Session {
    /// Start a run: decode the photographs and plan the model; `make` gives a backend with a model, such as
    /// [`CpuBackend::new`], or says why there is none.
    pub fn start<M: IntoBackend>(
        setup: Setup,
        make: impl FnOnce(Model) -> M,
        observer: &mut dyn FnMut(Event),
    ) -> Result<Self, SessionError> {
        setup.check()?;
        let (options, photos) = (setup.effective_options(), setup.photos(observer)?);
        let plan = Plan::new(&options, &setup.data, &photos);
        plan.check()?;
        let backend = make(plan.start(&options)).into_backend().map_err(SessionError::Backend)?;
        let training_data = setup.training_data(photos)?;
        let mut trainer = Trainer::new(options, plan, training_data, backend, State::default());
        trainer.begin();
        Ok(Self::of(setup, trainer))
    }

    /// Go on with a run that was saved; `make` gives a backend with its model, such as [`CpuBackend::resumed`]. The options of
    /// the run count, except for its length, `run.minutes`, `run.steps` and `run.stop_after`, and `run.save_every`, which are those
    /// of the setup.
    pub fn resume<M: IntoBackend>(
        mut setup: Setup,
        run: Run,
        make: impl FnOnce(Model, Optimiser) -> M,
        observer: &mut dyn FnMut(Event),
    ) -> Result<Self, SessionError> {
        setup.data = setup.data.with_origin(run.plan.origin);
        let offered = Source::of(&setup.data);
        if run.source.train != offered.train {
            let (was, found) = (run.source.train.len(), offered.train.len());
            return Err(SessionError::OtherViews { data: setup.source.name(), was, found });
        }
        if run.source.has_other_views_than(&setup.data) {
            return Err(SessionError::OtherPhotographs);
        }
        if run.state.bends_since.is_none() && !run.state.stays_straight {
            setup.check_refraction(&run.options)?;
        }
        let training_data = setup.training_data(setup.photos(observer)?)?;
        let backend = make(run.model, run.optimiser).into_backend().map_err(SessionError::Backend)?;
        let mut options = run.options;
        let length = &setup.options.run;
        (options.run.minutes, options.run.steps) = (length.minutes, length.steps);
        (options.run.stop_after, options.run.save_every) = (length.stop_after, length.save_every);
        let options = options.checked()?;
        let mut trainer = Trainer::new(options, run.plan, training_data, backend, run.state);
        trainer.go_on_with_alignment(run.alignment);
        if run.detected.is_some() {
            trainer.go_on_with(run.detected);
        }
        Ok(Self::of(setup, trainer))
    }

    fn of(setup: Setup, trainer: Trainer) -> Self {
        let Setup { data, source, cancel, .. } = setup;
        let saved = trainer.state().step;
        Self { data, source, trainer, cancel, requests: Requests::new(), saved }
    }

    /// For other threads: stops the run, and asks for copies of it while it goes on.
    pub fn handle(&self) -> Handle {
        Handle::new(self.cancel.clone(), &self.requests)
    }

    /// Why the device cannot go on; see [`Backend::fault`]. What [`Self::snapshot`] gives is the last good state then.
    pub fn fault(&self) -> Option<String> {
        self.backend().fault()
    }

    /// The run is trained on this device from now on: in its state, and in the log with the next record.
    pub fn name_device(&mut self, device: Device) {
        self.trainer.name_device(device);
    }

    /// The backend, to look at the model.
    pub fn backend(&self) -> &dyn Backend {
        self.trainer.backend()
    }

    /// What was found where no mask shows it.
    pub fn detected(&self) -> Option<&Gate> {
        self.trainer.detected()
    }

    /// Where the run stands.
    pub fn state(&self) -> &State {
        self.trainer.state()
    }

    /// Its options.
    pub fn options(&self) -> &Options {
        self.trainer.options()
    }

    /// Share of the run that is done, 0 to 1.
    pub fn progress(&self) -> f64 {
        self.trainer.progress().0
    }

    /// The data.
    pub fn data(&self) -> &Dataset {
        &self.data
    }
}
