//! Reads photographs for pages, one at a time and in turn, of each page the latest that it asks for.

use super::outgoing::{Out, Outgoing};
use super::photographs::Photographs;
use super::protocol::{Header, Tell, message};
use std::collections::VecDeque;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};

/// Where pages ask for photographs.
#[derive(Debug, Default)]
pub struct PhotographDesk {
    waiting: Mutex<VecDeque<Wish>>,
    changed: Condvar,
}

#[derive(Debug)]
struct Wish {
    page: u64,
    view: usize,
    out: Out,
}

impl PhotographDesk {
    /// A page asks for a photograph, instead of the one that it waits for.
    pub fn ask(&self, page: u64, view: usize, out: &Out) {
        let mut waiting = self.waiting();
        match waiting.iter_mut().find(|wish| wish.page == page) {
            Some(wish) => wish.view = view,
            None => waiting.push_back(Wish { page, view, out: out.clone() }),
        }
        self.changed.notify_one();
    }

    /// Answers until the program ends.
    pub fn work(&self, photographs: &Photographs) {
        loop {
            let Wish { view, out, .. } = self.next();
            out.send(match photographs.jpeg(view) {
                Ok((jpeg, size)) => Outgoing::Picture(message(&Header::Photo { view, size }, &jpeg)),
                Err(why) => Outgoing::tell(&Tell::Refused { why }),
            });
        }
    }

    fn next(&self) -> Wish {
        let mut waiting = self.waiting();
        loop {
            if let Some(wish) = waiting.pop_front() {
                return wish;
            }
            waiting = self.changed.wait(waiting).unwrap_or_else(PoisonError::into_inner);
        }
    }

    fn waiting(&self) -> MutexGuard<'_, VecDeque<Wish>> {
        self.waiting.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
