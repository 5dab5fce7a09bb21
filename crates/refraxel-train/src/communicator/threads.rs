//! Processes that are threads of one: for tests, and to count what would travel.

use super::exchange::Communicator;
use std::sync::Mutex;
use std::sync::mpsc::{Receiver, Sender, channel};

/// One of them.
pub struct Thread {
    rank: usize,
    to: Vec<Sender<Vec<u32>>>,
    from: Mutex<Vec<Receiver<Vec<u32>>>>,
}

/// So many of them.
pub fn group(count: usize) -> Vec<Thread> {
    let mut to: Vec<Vec<Sender<_>>> = (0..count).map(|_| Vec::new()).collect();
    let mut from: Vec<Vec<Receiver<_>>> = (0..count).map(|_| Vec::new()).collect();
    for senders in &mut to {
        for receivers in &mut from {
            let (sender, receiver) = channel();
            senders.push(sender);
            receivers.push(receiver);
        }
    }
    let each = to.into_iter().zip(from).enumerate();
    each.map(|(rank, (to, from))| Thread { rank, to, from: Mutex::new(from) }).collect()
}

impl Communicator for Thread {
    fn rank(&self) -> usize {
        self.rank
    }

    fn count(&self) -> usize {
        self.to.len()
    }

    /// # Panics
    /// If one of the others is gone.
    fn exchange(&self, messages: Vec<Vec<u32>>) -> Vec<Vec<u32>> {
        self.to
            .iter()
            .zip(messages)
            .for_each(|(to, message)| to.send(message).expect("all communicator are there"));
        let from = self.from.lock().unwrap_or_else(|e| e.into_inner());
        from.iter().map(|from| from.recv().expect("all communicator are there")).collect()
    }
}
