//! What the painter can be asked for, from any thread.

use super::outgoing::Out;
use super::protocol::Training;
use super::questions::Mailbox;
use refraxel_train::run::Run;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::thread;
use std::time::Duration;

/// What pages are told where the painter is gone.
pub(super) const FAILED: &str =
    "The program has a bug and shows nothing any more; its terminal says which. Start it again.";
/// Longest time that a program which ends waits for pages to learn why.
pub const LAST_WORDS: Duration = Duration::from_secs(1);
/// How often somebody who waits for pages looks whether they have what they shall get.
const LOOK: Duration = Duration::from_millis(10);

/// Asks the painter for something, from any thread.
#[derive(Clone, Debug)]
pub struct Orders {
    sender: Sender<Order>,
    pages: Arc<AtomicUsize>,
}

/// What the painter can be asked for.
#[derive(Debug)]
pub(super) enum Order {
    /// A page opens: the way to it, and where its questions lie.
    Join(u64, Out, Arc<Mailbox>),
    /// A page has put questions into its mailbox, which was empty.
    Look(u64),
    /// A page is gone.
    Leave(u64),
    /// Training has gone on; whoever sends it learns how long it took to take over.
    Renew(Box<Run>, Sender<Duration>),
    /// Something happened in the training. Pages that open later are told what is kept, and the last of what is not.
    Tell { what: Training, is_kept: bool },
    /// Nothing changes any more, and why.
    End(String),
    /// Share of the time that the painter may work.
    Share(f64),
    /// Whoever sends it learns when there is nothing to paint, and gets the ways to all pages.
    Idle(Sender<Vec<Out>>),
}

impl Orders {
    /// Orders that arrive at the other end of the channel, by whoever counts its `pages` there.
    pub(super) fn new(sender: Sender<Order>, pages: Arc<AtomicUsize>) -> Self {
        Self { sender, pages }
    }

    /// Gives an order; whether the painter is there to obey it.
    pub(super) fn give(&self, order: Order) -> bool {
        self.sender.send(order).is_ok()
    }

    /// Shows the run as it is now; how long the painter was busy with it is told when it has been.
    pub fn renew(&self, run: Run) -> Receiver<Duration> {
        let (sender, taken) = channel();
        self.give(Order::Renew(Box::new(run), sender));
        taken
    }

    /// Tells all pages what happens in the training, also those that open later.
    pub fn tell(&self, what: Training) {
        self.give(Order::Tell { what, is_kept: true });
    }

    /// Tells all pages what the training does now; pages that open later are told the last of it.
    pub fn tell_now(&self, what: Training) {
        self.give(Order::Tell { what, is_kept: false });
    }

    /// Tells all pages that the program ends soon, and why, also those that open later; waits until they have that and what there
    /// is to see, while `goes_on` says so and any are open.
    pub fn end(&self, why: String, goes_on: impl Fn() -> bool) {
        self.give(Order::End(why));
        self.settle(|| self.has_pages() && goes_on());
    }

    /// Share of the time that the painter may work, in (0, 1].
    pub fn set_share(&self, share: f64) {
        self.give(Order::Share(share));
    }

    /// Waits until all pages have what there is to see, while `goes_on` says so.
    fn settle(&self, goes_on: impl Fn() -> bool) {
        let (sender, idle) = channel();
        self.give(Order::Idle(sender));
        let ways = loop {
            match idle.recv_timeout(LOOK) {
                Ok(ways) => break ways,
                Err(RecvTimeoutError::Timeout) if goes_on() => {}
                Err(_) => return,
            }
        };
        while ways.iter().any(Out::is_waiting) && goes_on() {
            thread::sleep(LOOK);
        }
    }

    /// Whether any page is open.
    pub fn has_pages(&self) -> bool {
        self.pages.load(Ordering::SeqCst) > 0
    }
}
