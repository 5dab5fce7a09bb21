//! Work that takes long: it runs without the interpreter's lock while the calling thread hears its events and signals.

use crate::json;
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use refraxel_train::cancel::Cancel;
use refraxel_train::events::Event;
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::thread;
use std::time::Duration;

/// How long a signal such as Ctrl-C waits at most until it is heard.
const PATIENCE: Duration = Duration::from_millis(50);

/// Runs `work` on another thread and gives its events to `on_event` on this one. What `on_event` or a signal raises cancels
/// the work, and is raised once that has stopped.
pub fn attended<T: Send>(
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
