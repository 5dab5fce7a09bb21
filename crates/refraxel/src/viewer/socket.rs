//! The WebSocket of a page: one thread reads, another one writes.

use super::control::{Control, Wish};
use super::orders::{FAILED, Order, Orders};
use super::outgoing::{Out, Outgoing};
use super::photograph_desk::PhotographDesk;
use super::protocol::{Ask, Tell};
use super::questions::Mailbox;
use std::io::{self, Read, Write};
use std::net::{Shutdown, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, channel};
use std::thread;
use tungstenite::handshake::derive_accept_key;
use tungstenite::protocol::{Role, WebSocketConfig};
use tungstenite::{Bytes, Message, WebSocket};

/// Largest message of a page [byte].
const LARGEST_MESSAGE: usize = 64 * 1024;

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
pub(super) struct Answerers {
    /// The painter.
    pub orders: Orders,
    /// Who reads photographs.
    pub photographs: Arc<PhotographDesk>,
    /// The training, where there is one.
    pub control: Option<Control>,
    /// Number of the next page.
    pub next_id: AtomicU64,
}

/// A page that is open.
struct Page {
    id: u64,
    out: Out,
    mailbox: Arc<Mailbox>,
}

/// Carries messages until the page goes.
pub(super) fn serve(mut stream: TcpStream, key: &str, answerers: &Answerers) -> io::Result<()> {
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
    let id = answerers.next_id.fetch_add(1, Ordering::SeqCst);
    let page = Page { id, out, mailbox: Arc::default() };
    if answerers.orders.give(Order::Join(id, page.out.clone(), Arc::clone(&page.mailbox))) {
        read(ReadOnly(stream), &page, answerers);
        answerers.orders.give(Order::Leave(id));
    } else {
        page.out.end(FAILED);
    }
    drop(page);
    let _ = writer.join(); // ends when the painter has let the page go
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
fn read(stream: ReadOnly, page: &Page, answerers: &Answerers) {
    let mut socket = WebSocket::from_raw_socket(stream, Role::Server, Some(config()));
    while let Ok(message) = socket.read() {
        let answer = match message {
            Message::Text(text) => match serde_json::from_str(&text) {
                Ok(ask) => pass_on(ask, page, answerers),
                Err(error) => Some(refused(format!("this question is not understood: {error}"))),
            },
            Message::Ping(bytes) => Some(Outgoing::Pong(bytes.to_vec())),
            Message::Close(_) => return,
            _ => None,
        };
        if let Some(answer) = answer {
            page.out.send(answer);
        }
    }
}

/// Gives a question to whom it concerns.
fn pass_on(ask: Ask, page: &Page, answerers: &Answerers) -> Option<Outgoing> {
    match (ask, &answerers.control) {
        (Ask::Photo { view }, _) => answerers.photographs.ask(page.id, view, &page.out),
        (Ask::Pause { .. } | Ask::Stop, None) => return Some(refused("nothing is trained here".to_owned())),
        (Ask::Pause { paused }, Some(control)) => control(Wish::Pause(paused)),
        (Ask::Stop, Some(control)) => control(Wish::Stop),
        (ask, _) => {
            if page.mailbox.put(ask) {
                answerers.orders.give(Order::Look(page.id));
            }
        }
    }
    None
}

fn refused(why: String) -> Outgoing {
    Outgoing::tell(&Tell::Refused { why })
}
