//! Work that takes long: it runs without the interpreter's lock while the calling thread hears its events and signals.

use crate::errors::cancelled;
use crate::json;
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use rayon::prelude::*;
use refraxel_train::cancel::Cancel;
use refraxel_train::events::Event;
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::thread;
use std::time::Duration;

/// How long a signal such as Ctrl-C waits at most until it is heard.
const PATIENCE: Duration = Duration::from_millis(50);

/// Runs `work` on another thread and gives its events to `on_event` on this one. What `on_event` or a signal raises cancels
/// the work, and is raised once that has stopped.
pub fn with_events<T: Send>(
    py: Python<'_>,
    cancel: &Cancel,
    on_event: Option<&Bound<'_, PyAny>>,
    work: impl FnOnce(&mut dyn FnMut(Event)) -> T + Send,
) -> PyResult<T> {
    let (sender, mut events) = channel();
    thread::scope(|scope| {
        // The work hears of nobody who stopped listening.
        let worker = scope.spawn(move || work(&mut |event| _ = sender.send(event)));
        let mut raised = None;
        loop {
            let waiting = &mut events;
            let event = py.detach(move || waiting.recv_timeout(PATIENCE));
            if event == Err(RecvTimeoutError::Disconnected) {
                break;
            }
            if raised.is_some() {
                continue;
            }
            let heard = event
                .ok()
                .zip(on_event)
                .map_or(Ok(()), |(event, f)| f.call1((json::to_python(py, &event)?,)).map(|_| ()));
            if let Err(error) = heard.and_then(|()| py.check_signals()) {
                raised = Some(error);
                cancel.cancel();
            }
        }
        let done = py.detach(|| worker.join());
        if let Some(error) = raised {
            cancel.reset();
            return Err(error);
        }
        done.map_err(|_| PyRuntimeError::new_err("a bug of refraxel: the work panicked, see standard error"))
    })
}

/// Runs `work` that tells nothing in the same way. It looks now and then whether it shall [`go_on`].
pub fn interruptible<T: Send>(
    py: Python<'_>,
    work: impl FnOnce(&Cancel) -> PyResult<T> + Send,
) -> PyResult<T> {
    let cancel = Cancel::new();
    with_events(py, &cancel, None, |_| work(&cancel))?
}

/// An error once somebody wishes that the work stops.
pub fn go_on(cancel: &Cancel) -> PyResult<()> {
    cancel.check().map_err(|_| cancelled())
}

/// What `f` makes of each item, in parallel, unless a signal stops it between two of them.
pub fn for_each<I: Sync, T: Send>(
    py: Python<'_>,
    items: &[I],
    f: impl Fn(&I) -> T + Send + Sync,
) -> PyResult<Vec<T>> {
    interruptible(py, |cancel| items.par_iter().map(|item| go_on(cancel).map(|()| f(item))).collect())
}
