//! What other threads may ask of a session that is running.

use crate::cancel::Cancel;
use crate::run::Run;
use std::collections::VecDeque;
use std::sync::mpsc::{Receiver, Sender, channel};

/// Whoever wants a copy of the run.
type Request = Sender<Run>;

/// Asks a session for something, from any thread. Clones ask the same session.
#[derive(Clone, Debug)]
pub struct Handle {
    cancel: Cancel,
    requests: Sender<Request>,
}

/// Requests of all handles.
pub(super) struct Requests {
    sender: Sender<Request>,
    receiver: Receiver<Request>,
    /// Received, not yet answered.
    waiting: VecDeque<Request>,
}

impl Requests {
    pub(super) fn new() -> Self {
        let (sender, receiver) = channel();
        Self { sender, receiver, waiting: VecDeque::new() }
    }

    /// Whether somebody waits for an answer.
    pub(super) fn are_there(&mut self) -> bool {
        self.waiting.extend(self.receiver.try_iter());
        !self.waiting.is_empty()
    }

    /// The next to be answered.
    pub(super) fn next(&mut self) -> Option<Request> {
        if self.are_there() { self.waiting.pop_front() } else { None }
    }
}

impl Handle {
    pub(super) fn new(cancel: Cancel, requests: &Requests) -> Self {
        Self { cancel, requests: requests.sender.clone() }
    }

    /// Stop at the next opportunity: between two steps, or inside a long phase, which then has changed nothing.
    pub fn cancel(&self) {
        self.cancel.cancel();
    }

    /// A copy of the run between two of the next steps, or when [`Session::run`](super::Session::run) ends. While nothing runs,
    /// nobody answers; once the session is gone, the receiver fails.
    pub fn snapshot(&self) -> Receiver<Run> {
        let (answer, run) = channel();
        // A session that is gone drops the request, which the receiver notices.
        let _ = self.requests.send(answer);
        run
    }
}
