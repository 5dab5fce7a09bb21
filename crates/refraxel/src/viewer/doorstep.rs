//! Connections whose request has not arrived: there are so many at most, and the oldest makes room for the newest.

use crate::locked::locked;
use std::collections::VecDeque;
use std::net::{Shutdown, TcpStream};
use std::sync::{Arc, Mutex};

/// Connections that may wait at a time. A request that is sent at once is read long before so many others arrive.
const MOST: usize = 256;

/// Connections whose request has not arrived.
#[derive(Debug, Default)]
pub struct Doorstep(Mutex<VecDeque<Arc<TcpStream>>>);

impl Doorstep {
    /// A connection waits there, and the oldest is closed where there are too many.
    pub fn enter(&self, stream: &Arc<TcpStream>) {
        let mut waiting = locked(&self.0);
        if waiting.len() >= MOST {
            close(waiting.pop_front());
        }
        waiting.push_back(Arc::clone(stream));
    }

    /// The request of a connection has arrived, or will not.
    pub fn leave(&self, stream: &Arc<TcpStream>) {
        locked(&self.0).retain(|other| !Arc::ptr_eq(other, stream));
    }

    /// Closes the oldest connection, where the system has no room for another one.
    pub fn make_room(&self) {
        close(locked(&self.0).pop_front());
    }
}

/// Ends whoever reads from the connection.
fn close(oldest: Option<Arc<TcpStream>>) {
    let _ = oldest.map(|stream| stream.shutdown(Shutdown::Both)); // its other end may be gone
}
