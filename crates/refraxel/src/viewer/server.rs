//! The server of the page: loopback only, one thread per connection.

use super::answers::SceneAnswers;
use super::control::Control;
use super::doorstep::Doorstep;
use super::films::Films;
use super::gate::{Entry, LARGEST_HEAD, Refusal, Request, VERSION, admit, parse};
use super::orders::Orders;
use super::page::{self, Page, kind_of};
use super::photograph_desk::PhotographDesk;
use super::photographs::Photographs;
use super::socket::{self, Answerer};
use std::borrow::Cow;
use std::io::{self, ErrorKind, Read, Write};
use std::net::{Ipv4Addr, SocketAddr, TcpListener, TcpStream};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::thread;
use std::time::{Duration, Instant};

/// A connection that takes nothing for so long is closed.
const PATIENCE: Duration = Duration::from_secs(20);
/// The whole head of a request arrives in so long.
const HEAD_PATIENCE: Duration = Duration::from_secs(5);
/// Connections that the system keeps until they are accepted. Of those beyond, it lets one try again after a second; the 128 of the
/// standard library are soon there.
#[cfg(unix)]
const BACKLOG: nix::sys::socket::Backlog = nix::sys::socket::Backlog::MAXCONN;
/// Requests that are answered at a time; more are refused.
const MOST_ANSWERS: usize = 256;
/// Pages at a time.
const MOST_PAGES: usize = 16;
const TEXT: &str = "text/plain; charset=utf-8";
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

/// A server that listens and lets nobody in yet.
#[derive(Debug)]
pub struct Server {
    listener: TcpListener,
    address: SocketAddr,
    token: String,
    files: Vec<PathBuf>,
    films: Option<Films>,
}

/// What all connections share.
struct Shared {
    port: u16,
    token: String,
    page: Page,
    /// Pictures and films that are served under their own names.
    files: Vec<PathBuf>,
    answerer: Arc<dyn Answerer>,
    next_page: AtomicU64,
    doorstep: Doorstep,
    answers: AtomicUsize,
    pages: AtomicUsize,
}

impl Server {
    /// Listens on loopback; port 0 stands for any that is free.
    pub fn bind(port: u16) -> Result<Self, ServerError> {
        let listen = |source| ServerError::Listen { port, source };
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port)).map_err(listen)?;
        #[cfg(unix)]
        nix::sys::socket::listen(&listener, BACKLOG).map_err(|error| listen(error.into()))?;
        let address = listener.local_addr().map_err(listen)?;
        let mut bytes = [0; TOKEN];
        getrandom::fill(&mut bytes).map_err(ServerError::Random)?;
        let token = bytes.iter().map(|b| format!("{b:02x}")).collect();
        Ok(Self { listener, address, token, files: Vec::new(), films: None })
    }

    /// The same server, which also serves these pictures under their own names, once they are there.
    #[must_use]
    pub fn with_files(mut self, files: impl IntoIterator<Item = PathBuf>) -> Self {
        self.files.extend(files);
        self
    }

    /// The same server, whose pages may ask for films of the run.
    #[must_use]
    pub fn with_films(self, films: Films) -> Self {
        let files = films.files();
        Self { films: Some(films), ..self }.with_files(files)
    }

    /// The address of the page, which nobody else can guess.
    pub fn url(&self) -> String {
        format!("http://{}/{}/", self.address, self.token)
    }

    /// Serves the page of a scene in threads of its own until the program ends.
    pub fn start(mut self, orders: Orders, photographs: Arc<Photographs>, control: Option<Control>) {
        let desk = Arc::new(PhotographDesk::default());
        let asked = Arc::clone(&desk);
        thread::spawn(move || desk.work(&photographs));
        let films = self.films.take();
        self.serve(Page::Scene, Arc::new(SceneAnswers { orders, photographs: asked, control, films }));
    }

    /// Serves a page in threads of its own until the program ends.
    pub(crate) fn serve(self, page: Page, answerer: Arc<dyn Answerer>) {
        let Self { listener, address, token, files, .. } = self;
        let [answers, pages] = [0; 2].map(AtomicUsize::new);
        let shared = Arc::new(Shared {
            port: address.port(),
            token,
            page,
            files,
            answerer,
            next_page: AtomicU64::new(0),
            doorstep: Doorstep::default(),
            answers,
            pages,
        });
        thread::spawn(move || {
            for stream in listener.incoming() {
                match stream {
                    Ok(stream) => accept(Arc::new(stream), &shared),
                    Err(_) => {
                        // No descriptors are left, for now.
                        shared.doorstep.make_room();
                        thread::sleep(Duration::from_millis(5));
                    }
                }
            }
        });
    }
}

impl Shared {
    /// A file of the page, or one of the pictures under its own name; `None` while there is none.
    fn file(&self, name: &str) -> Option<Answer> {
        if let Some(page::File { kind, bytes }) = page::file(self.page, name) {
            return Some(Answer::File(kind, bytes.into()));
        }
        let file = self.files.iter().find(|f| f.file_name().is_some_and(|own| own == name))?;
        Some(Answer::File(kind_of(name), std::fs::read(file).ok()?.into()))
    }
}

fn accept(stream: Arc<TcpStream>, shared: &Arc<Shared>) {
    shared.doorstep.enter(&stream);
    let (accepted, serving) = (Arc::clone(&stream), Arc::clone(shared));
    let thread = thread::Builder::new().spawn(move || {
        let _ = serve(accepted, &serving); // a page that goes away is no failure
    });
    if thread.is_err() {
        // The system has none left. A training does not end by that.
        shared.doorstep.leave(&stream);
        shared.doorstep.make_room();
    }
}

/// One of so many places, until it is dropped.
struct Place {
    shared: Arc<Shared>,
    which: fn(&Shared) -> &AtomicUsize,
}

impl Place {
    fn take(shared: &Arc<Shared>, which: fn(&Shared) -> &AtomicUsize, most: usize) -> Option<Self> {
        let place = Self { shared: Arc::clone(shared), which };
        // Taken in any case; a place too many is given back at once.
        (which(shared).fetch_add(1, Ordering::SeqCst) < most).then_some(place)
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        (self.which)(&self.shared).fetch_sub(1, Ordering::SeqCst);
    }
}

/// Answers one request; a WebSocket stays until its page goes.
fn serve(stream: Arc<TcpStream>, shared: &Arc<Shared>) -> io::Result<()> {
    let request = read_head(&stream);
    shared.doorstep.leave(&stream);
    let request = request?;
    let mut stream = stream.try_clone()?;
    let Some(_place) = Place::take(shared, |shared| &shared.answers, MOST_ANSWERS) else { return Ok(()) };
    stream.set_nodelay(true)?;
    stream.set_write_timeout(Some(PATIENCE))?;
    let host = request.as_ref().ok().and_then(|request| request.host.clone()).unwrap_or_default();
    let take_page =
        || Place::take(shared, |shared| &shared.pages, MOST_PAGES).ok_or(Refusal::Full(MOST_PAGES));
    let answer = request.and_then(|request| match admit(&request, &shared.token)? {
        Entry::Cookie { name, is_from_elsewhere } => Ok(Answer::Cookie(name, is_from_elsewhere)),
        Entry::Socket(key) => Ok(Answer::Socket(key, take_page()?)),
        Entry::Probe => take_page().and(Err(Refusal::Version)),
        Entry::File(name) => shared.file(&name).ok_or(Refusal::NotFound),
    });
    match answer {
        Ok(Answer::Socket(key, _place)) => {
            let id = shared.next_page.fetch_add(1, Ordering::SeqCst);
            socket::serve(stream, &key, id, &*shared.answerer)
        }
        Ok(Answer::Cookie(name, is_from_elsewhere)) => {
            hand_out(&mut stream, &name, &shared.token, is_from_elsewhere)
        }
        Ok(Answer::File(kind, bytes)) => respond(&mut stream, "200 OK", kind, &bytes, &host),
        Err(refusal) => {
            let text = refusal.explanation(shared.port);
            respond(&mut stream, refusal.status(), TEXT, text.as_bytes(), "")
        }
    }
}

/// What a request gets.
enum Answer {
    /// The cookie of this name; a link of another site may have led here.
    Cookie(String, bool),
    /// A file of this kind.
    File(&'static str, Cow<'static, [u8]>),
    /// A WebSocket, for the key of its handshake, as long as it has a place among the pages.
    Socket(String, Place),
}

/// Reads to the end of the head. Nothing may follow it before the answer.
fn read_head(mut stream: &TcpStream) -> io::Result<Result<Request, Refusal>> {
    let mut head = Vec::new();
    let mut part = [0; 1024];
    let until = Instant::now() + HEAD_PATIENCE;
    loop {
        let left = until.saturating_duration_since(Instant::now());
        // No time at all would stand for no limit.
        stream.set_read_timeout(Some(left.max(Duration::from_millis(1))))?;
        if left.is_zero() {
            return Err(ErrorKind::TimedOut.into());
        }
        let read = stream.read(&mut part[..(LARGEST_HEAD - head.len()).min(1024)])?;
        if read == 0 {
            return Err(ErrorKind::UnexpectedEof.into());
        }
        head.extend(&part[..read]);
        // Once a line: who sends a byte at a time shall cost no more.
        if !part[..read].contains(&b'\n') && head.len() < LARGEST_HEAD {
            continue;
        }
        match parse(&head) {
            Ok(Some(request)) => return Ok(Ok(request)),
            Ok(None) => {}
            Err(refusal) => return Ok(Err(refusal)),
        }
    }
}

/// Hands out the token as a cookie, and leads to the address without it. Other sites cannot make a browser send it, nor can scripts
/// read it. Not even the redirection of their own link sends it; there, a page without content leads on.
fn hand_out(stream: &mut TcpStream, name: &str, token: &str, is_from_elsewhere: bool) -> io::Result<()> {
    let (status, lead) = match is_from_elsewhere {
        true => ("200 OK", "Refresh: 0;url=/"),
        false => ("303 See Other", "Location: /"),
    };
    let head = format!(
        "HTTP/1.1 {status}\r\n{lead}\r\nSet-Cookie: {name}={token}; HttpOnly; SameSite=Strict; Path=/\r\n\
         Content-Length: 0\r\nConnection: close\r\nCache-Control: no-store\r\nReferrer-Policy: no-referrer\r\n\r\n"
    );
    stream.write_all(head.as_bytes())
}

/// A page of `host` may connect to it; where there is none, nothing may.
fn respond(stream: &mut TcpStream, status: &str, kind: &str, body: &[u8], host: &str) -> io::Result<()> {
    let sockets = if host.is_empty() { String::new() } else { format!(" ws://{host}") };
    let head = format!(
        "HTTP/1.1 {status}\r\nContent-Type: {kind}\r\nContent-Length: {}\r\nConnection: close\r\n\
         Sec-WebSocket-Version: {VERSION}\r\nCache-Control: no-store\r\nX-Content-Type-Options: nosniff\r\n\
         Referrer-Policy: no-referrer\r\nCross-Origin-Resource-Policy: same-origin\r\nCross-Origin-Opener-Policy: same-origin\r\n\
         Content-Security-Policy: default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; \
         connect-src 'self'{sockets}; base-uri 'none'; form-action 'none'; frame-ancestors 'none'\r\n\r\n",
        body.len()
    );
    stream.write_all(head.as_bytes())?;
    stream.write_all(body)
}
