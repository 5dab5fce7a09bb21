//! The WebSocket of a page: one thread reads, another one writes.

use super::orders::FAILED;
use super::outgoing::{Out, Outgoing};
use super::questions::Mailbox;
use std::io::{self, Read, Write};
use std::net::{Shutdown, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, channel};
use std::thread;
use tungstenite::handshake::derive_accept_key;
use tungstenite::protocol::{Role, WebSocketConfig};
use tungstenite::{Bytes, Message, WebSocket};

/// Largest message of a page [byte]: a camera path of 3600 frames has half as much.
const LARGEST_MESSAGE: usize = 2 << 20;

/// A stream that is only read: what the protocol wants to write, the writer's thread does.
struct ReadOnly(TcpStream);

impl Read for ReadOnly {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        self.0.read(buffer)
    }
}

impl Write for ReadOnly {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// Who answers the questions of pages.
pub(crate) trait Answerer: Send + Sync {
    /// A page opens; whether anybody is there to answer it.
    fn join(&self, page: &Visitor) -> bool;
    /// A page asks; what it is told at once.
    fn take(&self, page: &Visitor, text: &str) -> Option<Outgoing>;
    /// A page is gone.
    fn leave(&self, page: &Visitor);
}

/// A page that is open.
#[derive(Debug)]
pub(crate) struct Visitor {
    /// Its number.
    pub id: u64,
    /// The way to it.
    pub out: Out,
    /// Where its questions wait for the painter.
    pub mailbox: Arc<Mailbox>,
}

/// Carries messages until the page goes.
pub(super) fn serve(mut stream: TcpStream, key: &str, id: u64, answerer: &dyn Answerer) -> io::Result<()> {
    let accept = derive_accept_key(key.as_bytes());
    let head = format!(
        "HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Accept: {accept}\r\n\r\n"
    );
    stream.write_all(head.as_bytes())?;
    stream.set_read_timeout(None)?; // a page may look on for hours
    let (sender, outgoing) = channel();
    let waiting = Arc::new(AtomicUsize::new(0));
    let out = Out::new(sender, Arc::clone(&waiting), stream.try_clone()?);
    let writing = stream.try_clone()?;
    let writer = thread::Builder::new().spawn(move || write(writing, &outgoing, &waiting))?;
    let page = Visitor { id, out, mailbox: Arc::default() };
    if answerer.join(&page) {
        read(ReadOnly(stream), &page, answerer);
        answerer.leave(&page);
    } else {
        page.out.end(FAILED);
    }
    drop(page);
    let _ = writer.join(); // ends when whoever answers has let the page go
    Ok(())
}

fn config() -> WebSocketConfig {
    WebSocketConfig::default()
        .max_message_size(Some(LARGEST_MESSAGE))
        .max_frame_size(Some(LARGEST_MESSAGE))
        .write_buffer_size(0)
}

fn write(stream: TcpStream, outgoing: &Receiver<Outgoing>, waiting: &AtomicUsize) {
    let closing = stream.try_clone();
    let mut socket = WebSocket::from_raw_socket(stream, Role::Server, Some(config()));
    for outgoing in outgoing {
        let size = outgoing.size();
        let message = match outgoing {
            Outgoing::Text(text) => Message::text(text),
            Outgoing::Picture(bytes) => Message::binary(bytes),
            Outgoing::Pong(bytes) => Message::Pong(Bytes::from(bytes)),
            Outgoing::End => break,
        };
        if socket.send(message).is_err() {
            break;
        }
        waiting.fetch_sub(size, Ordering::SeqCst);
    }
    waiting.store(0, Ordering::SeqCst); // nothing more is sent
    let _ = socket.close(None);
    // Ends the reader, too.
    let _ = closing.map(|stream| stream.shutdown(Shutdown::Both));
}

/// Passes on what the page asks, until it goes or sends what no page sends.
fn read(stream: ReadOnly, page: &Visitor, answerer: &dyn Answerer) {
    let mut socket = WebSocket::from_raw_socket(stream, Role::Server, Some(config()));
    while let Ok(message) = socket.read() {
        let answer = match message {
            Message::Text(text) => answerer.take(page, &text),
            Message::Ping(bytes) => Some(Outgoing::Pong(bytes.to_vec())),
            Message::Close(_) => return,
            _ => None,
        };
        if let Some(answer) = answer {
            page.out.send(answer);
        }
    }
}
