//! Training runs under way.

use crate::camera::Camera;
use crate::dataset::Dataset;
use crate::errors::{cancelled, of_session, raised, refused};
use crate::evaluation::{part, scores};
use crate::interruptible::with_events;
use crate::json;
use crate::rendering::Rendering;
use crate::run::Run;
use crate::settings::set_options;
use pyo3::prelude::*;
use pyo3::types::PyMapping;
use refraxel::exit::Failure;
use refraxel::verbs::files::{absolute, create_folder};
use refraxel::verbs::known_index;
use refraxel_data::scene_region;
use refraxel_train::cancel::Cancel;
use refraxel_train::events::Event;
use refraxel_train::options::Switch;
use refraxel_train::run::Source;
use refraxel_train::session::{Handle, Session as Inner, Setup, Stop, Until};
use refraxel_train::{CpuBackend, Options, refraction_search};
use std::path::PathBuf;
use std::sync::{Mutex, MutexGuard, TryLockError};
use std::time::Duration;

/// How long to wait for an answer of a running session before signals are heard.
const PATIENCE: Duration = Duration::from_millis(50);

/// A training run under way. One thread runs it; others may cancel() it or ask for a snapshot().
#[pyclass(frozen, module = "refraxel")]
pub struct Session {
    inner: Mutex<Inner>,
    handle: Handle,
    cancel: Cancel,
}

impl Session {
    fn start(
        py: Python<'_>,
        setup: Setup,
        on_event: Option<&Bound<'_, PyAny>>,
        earlier: Option<refraxel_train::run::Run>,
    ) -> PyResult<Self> {
        let cancel = setup.cancel.clone();
        let started = with_events(py, &cancel, on_event, |observer| match earlier {
            None => Inner::start(setup, CpuBackend::new, observer),
            Some(run) => Inner::resume(setup, run, CpuBackend::resumed, observer),
        })?;
        let inner = started.map_err(of_session)?;
        Ok(Self { handle: inner.handle(), inner: Mutex::new(inner), cancel })
    }

    /// Goes on with a run.
    pub fn resumed(
        py: Python<'_>,
        run: refraxel_train::run::Run,
        data: &Dataset,
        given: Option<&Bound<'_, PyMapping>>,
        on_event: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let mut options = run.options.clone();
        options.run.stop_after = 0;
        set_options(&mut options, given)?;
        let changed = options.differences(&run.options).into_iter().find(|d| !d.name.starts_with("run."));
        if let Some(changed) = changed {
            return Err(refused(format!(
                "option {} is {}, but the run was trained with {}; only the length of a run may change",
                changed.name, changed.here, changed.there
            )));
        }
        let source = run.source.clone();
        let setup = setup(py, data, options, source, Some(&run))?;
        Self::start(py, setup, on_event, Some(run))
    }

    /// What `f` does with the session in another thread, which holds it no longer than that takes: while events are still
    /// heard here, others may have it already. A panic damages the session.
    fn with_events<T: Send>(
        &self,
        py: Python<'_>,
        on_event: Option<&Bound<'_, PyAny>>,
        f: impl FnOnce(&mut Inner, &mut dyn FnMut(Event)) -> T + Send,
    ) -> PyResult<T> {
        with_events(py, &self.cancel, on_event, |observer| Ok(f(&mut *self.idle()?, observer)))?
    }

    /// The session itself, unless it is busy in another thread.
    fn idle(&self) -> PyResult<MutexGuard<'_, Inner>> {
        match self.inner.try_lock() {
            Ok(inner) => Ok(inner),
            Err(TryLockError::Poisoned(_)) => Err(refused("the session has failed; load what it saved last")),
            Err(TryLockError::WouldBlock) => Err(refused(
                "the session is running in another thread; cancel() it first, or ask for a snapshot()",
            )),
        }
    }
}

/// What a session is made of.
fn setup(
    py: Python<'_>,
    data: &Dataset,
    options: Options,
    source: Source,
    saved: Option<&refraxel_train::run::Run>,
) -> PyResult<Setup> {
    let index = py.detach(|| known_index::read(&source, &data.data, saved, &options)).map_err(raised)?;
    Ok(Setup { data: data.data.clone(), options, index, source, cancel: Cancel::new() })
}

#[pymethods]
impl Session {
    /// Starts a run: decodes the photographs and plans the model.
    ///
    /// Where views have masks of what is refractive, where run() finds something that straight rays do not explain, or with
    /// index_from, rays bend if that explains the views better; the option refraction.bend says otherwise.
    ///
    /// options: values by name, see refraxel.options(). index_from: a file with a known index (scene.json, .npz, .ply, .obj).
    /// on_event: called with every event, a dictionary.
    #[new]
    #[pyo3(signature = (data, *, options = None, index_from = None, on_event = None))]
    fn new(
        py: Python<'_>,
        data: &Dataset,
        options: Option<&Bound<'_, PyMapping>>,
        index_from: Option<PathBuf>,
        on_event: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let mut all = Options::suited_to(
            scene_region(&data.data).extent(),
            refraction_search::is_told(index_from.is_some(), &data.data),
        );
        if let Some(file) = &index_from {
            known_index::suit(&mut all, file);
            known_index::held(&mut all);
        }
        // As the program does where nobody says: rays bend where something tells, or the detector finds, what is refractive.
        all.refraction.bend = Switch::On;
        set_options(&mut all, options)?;
        if index_from.is_some() {
            known_index::refuse_unused(&all).map_err(raised)?;
        }
        let mut source = data.source.clone();
        source.index_from = index_from.as_deref().map(absolute);
        Self::start(py, setup(py, data, all, source, None)?, on_event, None)
    }

    /// Trains until the end, a step counted from the start of the run, or for some seconds; whatever comes first.
    ///
    /// Returns "finished", "reached" or "cancelled". on_event is called in this thread; what it raises, KeyboardInterrupt included, stops
    /// training between two steps (or inside a long phase, which then has changed nothing) and is raised again.
    #[pyo3(signature = (*, until_step = None, seconds = None, on_event = None))]
    fn run(
        &self,
        py: Python<'_>,
        until_step: Option<u64>,
        seconds: Option<f64>,
        on_event: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<&'static str> {
        let elapsed = seconds.map(Duration::try_from_secs_f64).transpose();
        let elapsed = elapsed.map_err(|_| {
            refused(format!("seconds is {}; expected a number from 0 on", seconds.unwrap_or_default()))
        })?;
        let until = Until { step: until_step, elapsed };
        let stop = self.with_events(py, on_event, |inner, observer| inner.run(until, observer))?;
        Ok(match stop.map_err(of_session)? {
            Stop::Finished => "finished",
            Stop::Reached => "reached",
            Stop::Cancelled => "cancelled",
        })
    }

    /// Stops a run() at its next opportunity, from any thread. The next run() goes on.
    fn cancel(&self) {
        self.handle.cancel();
    }

    /// A copy of the run as it is now; while another thread runs it, between two of its steps.
    fn snapshot(&self, py: Python<'_>) -> PyResult<Run> {
        // Whoever runs the session answers between two steps; once it stands still, anybody may look.
        let mut answer = None;
        loop {
            match self.inner.try_lock() {
                Ok(mut inner) => {
                    let inner = &mut *inner;
                    return Ok(Run::new(py.detach(move || inner.snapshot())));
                }
                Err(TryLockError::Poisoned(_)) => return Err(refused("the session has failed")),
                Err(TryLockError::WouldBlock) => {}
            }
            let waiting = answer.get_or_insert_with(|| self.handle.snapshot());
            match py.detach(move || waiting.recv_timeout(PATIENCE)) {
                Ok(run) => return Ok(Run::new(run)),
                Err(_) => py.check_signals()?,
            }
        }
    }

    /// Saves the run in a folder, atomically; `refraxel train --resume` and Run.load() read it.
    fn save(&self, py: Python<'_>, folder: PathBuf) -> PyResult<()> {
        let saved = self.with_events(py, None, |inner, _| {
            create_folder(&folder)?;
            inner.save(&folder).map_err(Failure::from)
        });
        saved?.map_err(raised)
    }

    /// Renders and scores a part of the data: PSNR [dB] and SSIM, in all and per image, with the name of the protocol.
    #[pyo3(signature = (part = "test", *, on_event = None))]
    fn evaluate<'py>(
        &self,
        py: Python<'py>,
        part: &str,
        on_event: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let part = self::part(part)?;
        let found =
            self.with_events(py, on_event, |inner, observer| inner.evaluate(part, observer, &mut |_, _| {}))?;
        scores(py, &found.map_err(of_session)?)
    }

    /// What a camera sees.
    fn render(&self, py: Python<'_>, camera: Camera) -> PyResult<Rendering> {
        let local = |inner: &Inner| inner.data().origin.to_local(camera.0);
        let seen = self.with_events(py, None, |inner, _| inner.render(&local(inner)))?;
        Rendering::new(py, seen.map_err(|_| cancelled())?)
    }

    /// Steps done.
    #[getter]
    fn step(&self) -> PyResult<u64> {
        Ok(self.idle()?.state().step)
    }

    /// Share of the run that is done, 0 to 1.
    #[getter]
    fn progress(&self) -> PyResult<f64> {
        Ok(self.idle()?.progress())
    }

    /// Where the run stands.
    #[getter]
    fn state<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        json::to_python(py, self.idle()?.state())
    }

    /// Its options, by section and name.
    #[getter]
    fn options<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        json::to_python(py, self.idle()?.options())
    }
}
