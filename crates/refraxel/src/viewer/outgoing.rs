//! The way of messages to a page.

use super::protocol::Tell;
use serde::Serialize;
use std::net::{Shutdown, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::Sender;

/// What may wait to be sent to a page [byte]; a page that takes less than it asks for is closed.
const MOST_WAITING: usize = 32 << 20;

/// What is sent to a page.
#[derive(Clone, Debug)]
pub enum Outgoing {
    /// JSON text.
    Text(String),
    /// A picture.
    Picture(Vec<u8>),
    /// The answer to a ping.
    Pong(Vec<u8>),
    /// Nothing follows, and the connection ends.
    End,
}

impl Outgoing {
    /// What a page is told.
    pub fn tell(tell: &impl Serialize) -> Self {
        Self::Text(serde_json::to_string(tell).unwrap_or_default()) // names and numbers: cannot fail
    }

    /// Its size [byte], about.
    pub fn size(&self) -> usize {
        64 + match self {
            Self::Text(text) => text.len(),
            Self::Picture(bytes) | Self::Pong(bytes) => bytes.len(),
            Self::End => 0,
        }
    }
}

/// The way to a page, for any thread.
#[derive(Clone, Debug)]
pub struct Out {
    sender: Sender<Outgoing>,
    /// What waits in it [byte].
    waiting: Arc<AtomicUsize>,
    stream: Arc<TcpStream>,
}

impl Out {
    /// The way by a channel whose other end writes to the stream; whoever does so takes off from what is `waiting`.
    pub fn new(sender: Sender<Outgoing>, waiting: Arc<AtomicUsize>, stream: TcpStream) -> Self {
        Self { sender, waiting, stream: Arc::new(stream) }
    }

    /// Whether something is still to be sent.
    pub fn is_waiting(&self) -> bool {
        self.waiting.load(Ordering::SeqCst) > 0
    }

    /// Says why nothing more is sent, and ends the connection.
    pub fn end(&self, why: &str) {
        self.send(Outgoing::tell(&Tell::Ended { why: why.to_owned() }));
        self.send(Outgoing::End);
    }

    /// Sends something, if the page is there and takes what it gets.
    pub fn send(&self, outgoing: Outgoing) {
        let size = outgoing.size();
        let fits = self.waiting.fetch_add(size, Ordering::SeqCst) + size <= MOST_WAITING;
        if !fits || self.sender.send(outgoing).is_err() {
            let _ = self.stream.shutdown(Shutdown::Both); // ends reader and writer
        }
    }
}
