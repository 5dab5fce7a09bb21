//! Reads photographs for pages, one at a time and in turn, of each page the latest that it asks for.

use super::outgoing::{Out, Outgoing};
use super::photographs::Photographs;
use super::protocol::{Header, Tell, message};
use crate::locked::locked;
use std::collections::VecDeque;
use std::sync::{Condvar, Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

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
        let mut waiting = locked(&self.waiting);
        match waiting.iter_mut().find(|wish| wish.page == page) {
            Some(wish) => wish.view = view,
            None => waiting.push_back(Wish { page, view, out: out.clone() }),
        }
        self.changed.notify_one();
    }

    /// Answers until the program ends. Rests as long as it has worked before it serves the same page again: of one that asks without
    /// end, others notice little.
    pub fn work(&self, photographs: &Photographs) {
        let (mut last, mut took) = (None, Duration::ZERO);
        loop {
            let Wish { page, mut view, out } = self.next();
            if last.replace(page) == Some(page) {
                thread::sleep(took);
                view = self.later(page).unwrap_or(view);
            }
            let start = Instant::now();
            out.send(match photographs.jpeg(view) {
                Ok((jpeg, size)) => Outgoing::Picture(message(&Header::Photo { view, size }, &jpeg)),
                Err(why) => Outgoing::tell(&Tell::Refused { why }),
            });
            took = start.elapsed();
        }
    }

    fn next(&self) -> Wish {
        let mut waiting = locked(&self.waiting);
        loop {
            if let Some(wish) = waiting.pop_front() {
                return wish;
            }
            waiting = self.changed.wait(waiting).unwrap_or_else(PoisonError::into_inner);
        }
    }

    /// The photograph that a page has come to want meanwhile.
    fn later(&self, page: u64) -> Option<usize> {
        let mut waiting = locked(&self.waiting);
        let place = waiting.iter().position(|wish| wish.page == page)?;
        waiting.remove(place).map(|wish| wish.view)
    }
}
