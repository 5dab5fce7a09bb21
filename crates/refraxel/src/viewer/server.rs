//! The server of the page: loopback only, one thread per connection.

use super::gate::{Entry, LARGEST_HEAD, Refusal, Request, admit, parse};
use super::page;
use super::painter::Orders;
use super::photographs::Photographs;
use super::socket;
use std::io::{self, ErrorKind, Read, Write};
use std::net::{Ipv4Addr, SocketAddr, TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::thread;
use std::time::Duration;

/// A connection that sends or takes nothing for so long is closed.
const PATIENCE: Duration = Duration::from_secs(20);
/// Connections at a time; more are closed at once.
const MOST_CONNECTIONS: usize = 64;
/// Bytes of the token, each two hexadecimal digits of the address.
const TOKEN: usize = 16;

/// Why there is no server.
#[derive(Debug, thiserror::Error)]
pub enum ServerError {
    /// The port is taken, or there is no loopback.
    #[error(
        "cannot listen at 127.0.0.1:{port}: {source}; choose another --port, or leave it out for any that is free"
    )]
    Listen {
        /// The port, 0 for any.
        port: u16,
        /// What the system says.
        source: io::Error,
    },
    /// No token can be made.
    #[error("the system gives no random numbers for the address: {0}")]
    Random(getrandom::Error),
}

/// What a page may ask of a training.
pub type Control = Arc<dyn Fn(Wish) + Send + Sync>;

/// A wish of a page about the training that it shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wish {
    /// Wait, or go on.
    Pause(bool),
    /// Save and end.
    Stop,
}

/// A server that listens and lets nobody in yet.
#[derive(Debug)]
pub struct Server {
    listener: TcpListener,
    address: SocketAddr,
    token: String,
}

/// What all connections share.
pub(super) struct Shared {
    pub address: SocketAddr,
    pub token: String,
    pub orders: Orders,
    pub photographs: Arc<Photographs>,
    pub control: Option<Control>,
    pub next_id: AtomicU64,
    connections: AtomicUsize,
}

impl Server {
    /// Listens on loopback; port 0 stands for any that is free.
    pub fn bind(port: u16) -> Result<Self, ServerError> {
        let listen = |source| ServerError::Listen { port, source };
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port)).map_err(listen)?;
        let address = listener.local_addr().map_err(listen)?;
        let mut bytes = [0; TOKEN];
        getrandom::fill(&mut bytes).map_err(ServerError::Random)?;
        let token = bytes.iter().map(|b| format!("{b:02x}")).collect();
        Ok(Self { listener, address, token })
    }

    /// The address of the page, which nobody else can guess.
    pub fn url(&self) -> String {
        format!("http://{}/{}/", self.address, self.token)
    }

    /// Serves in threads of its own until the program ends.
    pub fn start(self, orders: Orders, photographs: Arc<Photographs>, control: Option<Control>) {
        let Self { listener, address, token } = self;
        let (next_id, connections) = (AtomicU64::new(0), AtomicUsize::new(0));
        let shared = Arc::new(Shared { address, token, orders, photographs, control, next_id, connections });
        thread::spawn(move || {
            for stream in listener.incoming() {
                let Ok(stream) = stream else {
                    thread::sleep(Duration::from_millis(50)); // no descriptors are left, for now
                    continue;
                };
                accept(stream, &shared);
            }
        });
    }
}

fn accept(stream: TcpStream, shared: &Arc<Shared>) {
    if shared.connections.fetch_add(1, Ordering::SeqCst) >= MOST_CONNECTIONS {
        shared.connections.fetch_sub(1, Ordering::SeqCst);
        return;
    }
    let shared = Arc::clone(shared);
    thread::spawn(move || {
        let _ = serve(stream, &shared); // a page that goes away is no failure
        shared.connections.fetch_sub(1, Ordering::SeqCst);
    });
}

/// Answers one request; a WebSocket stays until its page goes.
fn serve(mut stream: TcpStream, shared: &Shared) -> io::Result<()> {
    stream.set_nodelay(true)?;
    stream.set_read_timeout(Some(PATIENCE))?;
    stream.set_write_timeout(Some(PATIENCE))?;
    let entry = read_head(&mut stream)?.and_then(|request| admit(&request, shared.address, &shared.token));
    match entry {
        Ok(Entry::Socket(key)) => socket::serve(stream, &key, shared),
        Ok(Entry::File(name)) => match page::file(&name) {
            Some(file) => respond(&mut stream, "200 OK", file.kind, file.bytes, shared.address.port()),
            None => refuse(&mut stream, Refusal::NotFound, shared),
        },
        Err(refusal) => refuse(&mut stream, refusal, shared),
    }
}

/// Reads to the end of the head. Nothing may follow it before the answer.
fn read_head(stream: &mut TcpStream) -> io::Result<Result<Request, Refusal>> {
    let mut head = Vec::new();
    let mut part = [0; 1024];
    loop {
        let read = stream.read(&mut part[..(LARGEST_HEAD - head.len()).min(1024)])?;
        if read == 0 {
            return Err(ErrorKind::UnexpectedEof.into());
        }
        head.extend(&part[..read]);
        match parse(&head) {
            Ok(Some(request)) => return Ok(Ok(request)),
            Ok(None) => {}
            Err(refusal) => return Ok(Err(refusal)),
        }
    }
}

fn refuse(stream: &mut TcpStream, refusal: Refusal, shared: &Shared) -> io::Result<()> {
    let (status, why) = refusal.status();
    respond(stream, status, "text/plain; charset=utf-8", why.as_bytes(), shared.address.port())
}

fn respond(stream: &mut TcpStream, status: &str, kind: &str, body: &[u8], port: u16) -> io::Result<()> {
    let head = format!(
        "HTTP/1.1 {status}\r\nContent-Type: {kind}\r\nContent-Length: {}\r\nConnection: close\r\n\
         Cache-Control: no-store\r\nX-Content-Type-Options: nosniff\r\nReferrer-Policy: no-referrer\r\n\
         Cross-Origin-Resource-Policy: same-origin\r\nContent-Security-Policy: default-src 'none'; script-src 'self'; \
         style-src 'self'; img-src blob: data:; connect-src ws://127.0.0.1:{port} ws://localhost:{port}; base-uri 'none'; \
         form-action 'none'; frame-ancestors 'none'\r\n\r\n",
        body.len()
    );
    stream.write_all(head.as_bytes())?;
    stream.write_all(body)
}
