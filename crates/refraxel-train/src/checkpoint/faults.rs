//! Where the write of a checkpoint asks something of the system. Tests make it fail there, or end the program; otherwise this is
//! nothing.

use std::io;

/// A request to the system follows.
#[cfg(not(test))]
pub(super) fn reach() -> io::Result<()> {
    Ok(())
}

#[cfg(test)]
pub(crate) use armed::{Fault, with_fault};

#[cfg(test)]
pub(super) use armed::reach;

#[cfg(test)]
mod armed {
    use super::*;
    use std::cell::Cell;

    /// What happens at a request.
    #[derive(Clone, Copy, Debug)]
    pub(crate) enum Fault {
        /// The system says that the disk is full.
        Full,
        /// The program ends, as when it is killed or gets no memory.
        Death,
    }

    thread_local! {
        /// What happens at which of the requests to come, from 0, and how many there were.
        static ARMED: Cell<Option<(Fault, usize)>> = const { Cell::new(None) };
        static REACHED: Cell<usize> = const { Cell::new(0) };
    }

    /// Works with a fault at request number `at`, from 0; also tells how many requests there were.
    pub(crate) fn with_fault<T>(fault: Fault, at: usize, work: impl FnOnce() -> T) -> (T, usize) {
        ARMED.set(Some((fault, at)));
        REACHED.set(0);
        let done = work();
        ARMED.set(None);
        (done, REACHED.get())
    }

    pub(in super::super) fn reach() -> io::Result<()> {
        let here = REACHED.replace(REACHED.get() + 1);
        match ARMED.get().filter(|(_, at)| *at == here) {
            None => Ok(()),
            Some((Fault::Full, _)) => Err(io::ErrorKind::StorageFull.into()),
            Some((Fault::Death, _)) => std::process::abort(),
        }
    }
}
