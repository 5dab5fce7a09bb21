//! Connections whose request has not arrived: there are so many at most, and the oldest makes room for the newest.

use std::collections::VecDeque;
use std::net::{Shutdown, TcpStream};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Connections that may wait at a time. A request that is sent at once is read long before so many others arrive.
const MOST: usize = 256;

/// Connections whose request has not arrived.
#[derive(Debug, Default)]
pub struct Doorstep(Mutex<VecDeque<Arc<TcpStream>>>);

impl Doorstep {
    /// A connection waits there, and the oldest is closed where there are too many.
    pub fn enter(&self, stream: &Arc<TcpStream>) {
        let mut waiting = self.waiting();
        if waiting.len() >= MOST {
            close(waiting.pop_front());
        }
        waiting.push_back(Arc::clone(stream));
    }

    /// The request of a connection has arrived, or will not.
    pub fn leave(&self, stream: &Arc<TcpStream>) {
        self.waiting().retain(|other| !Arc::ptr_eq(other, stream));
    }

    /// Closes the oldest connection, where the system has no room for another one.
    pub fn make_room(&self) {
        close(self.waiting().pop_front());
    }

    fn waiting(&self) -> MutexGuard<'_, VecDeque<Arc<TcpStream>>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Ends whoever reads from the connection.
fn close(oldest: Option<Arc<TcpStream>>) {
    let _ = oldest.map(|stream| stream.shutdown(Shutdown::Both)); // its other end may be gone
}
