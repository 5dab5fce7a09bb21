//! What the painter can be asked for, from any thread.

use super::outgoing::Out;
use super::protocol::Ask;
use refraxel_train::run::Run;
use serde_json::Value;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::Duration;

/// Asks the painter for something, from any thread.
#[derive(Clone, Debug)]
pub struct Orders {
    sender: Sender<Order>,
    pages: Arc<AtomicUsize>,
}

/// What the painter can be asked for.
#[derive(Debug)]
pub(super) enum Order {
    /// A page opens.
    Join(u64, Out),
    /// A page asks for something that the painter answers.
    Ask(u64, Ask),
    /// A page is gone.
    Leave(u64),
    /// Training has gone on; whoever sends it learns how long it took to take over.
    Renew(Box<Run>, Sender<Duration>),
    /// Something happened in the training. Pages that open later are told what is kept, and the last of what is not.
    Tell { what: Value, is_kept: bool },
    /// Share of the time that the painter may work.
    Share(f64),
}

impl Orders {
    /// Orders that arrive at the other end of the channel, by whoever counts its `pages` there.
    pub(super) fn new(sender: Sender<Order>, pages: Arc<AtomicUsize>) -> Self {
        Self { sender, pages }
    }

    /// Gives an order; where the painter is gone, nothing happens.
    pub(super) fn give(&self, order: Order) {
        let _ = self.sender.send(order);
    }

    /// Shows the run as it is now; how long the painter was busy with it is told when it has been.
    pub fn renew(&self, run: Run) -> Receiver<Duration> {
        let (sender, taken) = channel();
        self.give(Order::Renew(Box::new(run), sender));
        taken
    }

    /// Tells all pages what happens in the training, also those that open later.
    pub fn tell(&self, what: Value) {
        self.give(Order::Tell { what, is_kept: true });
    }

    /// Tells all pages what the training does now; pages that open later are told the last of it.
    pub fn tell_now(&self, what: Value) {
        self.give(Order::Tell { what, is_kept: false });
    }

    /// Share of the time that the painter may work, in (0, 1].
    pub fn set_share(&self, share: f64) {
        self.give(Order::Share(share));
    }

    /// Whether any page is open.
    pub fn has_pages(&self) -> bool {
        self.pages.load(Ordering::SeqCst) > 0
    }
}
