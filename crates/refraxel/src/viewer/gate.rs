//! Who is let in: requests that know the token, name this machine as their host, and come from this page.
//!
//! The address that is printed holds the token. It is exchanged for a cookie, so that it stays neither in the address bar nor in the
//! history. Cookies are shared by all ports of a host; that of a page is named after the port that its browser sees.

use data_encoding::BASE64;
use std::net::{Ipv4Addr, Ipv6Addr};

/// Largest head of a request [byte]; cookies of other pages of this host are in it.
pub const LARGEST_HEAD: usize = 32 * 1024;
const MOST_HEADERS: usize = 64;
/// The version of WebSockets, RFC 6455.
pub const VERSION: &str = "13";
/// Port of an address that names none.
const USUAL_PORT: u16 = 80;
/// Letters of a name that is refused, as far as they are repeated.
const MOST_LETTERS: usize = 60;

/// A request as far as it counts here.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Request {
    pub method: String,
    pub path: String,
    pub host: Option<String>,
    pub origin: Option<String>,
    /// Names and values.
    pub cookies: Vec<(String, String)>,
    /// A link of another site leads here.
    pub is_from_elsewhere: bool,
    /// A WebSocket is asked for.
    pub handshake: Option<Handshake>,
}

/// What a request for a WebSocket states.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Handshake {
    pub key: Option<String>,
    pub version: Option<String>,
    /// Whether this connection is to become one, and not that of a proxy in between.
    pub is_for_here: bool,
}

/// Why a request is refused.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Refusal {
    /// It cannot be read.
    Malformed,
    /// It reads nothing but asks for something else.
    Method,
    /// It was meant for another host, whose name leads here.
    Host(Option<String>),
    /// It comes from another page.
    Origin,
    /// It does not know the token, or asks for what is not there.
    NotFound,
    /// A WebSocket without what belongs to its handshake.
    Handshake(&'static str),
    /// A WebSocket of another version, or none where one is expected.
    Version,
    /// There are as many pages as there may be.
    Full(usize),
}

impl Refusal {
    /// Status line.
    pub fn status(&self) -> &'static str {
        match self {
            Self::Malformed | Self::Handshake(_) => "400 Bad Request",
            Self::Host(_) | Self::Origin => "403 Forbidden",
            Self::NotFound => "404 Not Found",
            Self::Method => "405 Method Not Allowed",
            Self::Version => "426 Upgrade Required",
            Self::Full(_) => "503 Service Unavailable",
        }
    }

    /// What was found, what is expected, and what to do; `port` is that of the server.
    pub fn explanation(&self, port: u16) -> String {
        match self {
            Self::Malformed => "This is no request of HTTP/1.1 that this server reads. Its address begins with http://, not https://.".to_owned(),
            Self::Method => "This server is only read: expected GET.".to_owned(),
            Self::Host(found) => {
                let found = found.as_ref().map_or("no name".to_owned(), |name| {
                    let name: String = name.chars().filter(|c| !c.is_control()).take(MOST_LETTERS).collect();
                    format!("\"{name}\"")
                });
                format!(
                    "This server answers to names of its own machine, localhost, 127.0.0.1 or [::1], with any port; the request is for \
                     {found}. From another machine, forward the port with `ssh -L 8080:127.0.0.1:{port} HOST`, and open \
                     http://127.0.0.1:8080/ with the rest of the address that `refraxel` has printed."
                )
            }
            Self::Origin => "This server answers to its own page only, and the request comes from another one. Open the address that \
                             `refraxel` has printed in a tab of its own."
                .to_owned(),
            Self::NotFound => "There is nothing here, or it is not known who asks. Open the whole address that `refraxel` has printed, also in a \
                               browser that has shown this page before: each start has another one. It is kept as a cookie, which the \
                               browser has to allow."
                .to_owned(),
            Self::Handshake(missing) => format!("This is no WebSocket: expected {missing}."),
            Self::Version => format!("A WebSocket is expected here, version {VERSION}."),
            Self::Full(most) => {
                format!("{most} pages of this scene are open, and no more can be. Close one; this page looks again every second.")
            }
        }
    }
}

/// What a request that is let in asks for.
#[derive(Clone, Debug, PartialEq)]
pub enum Entry {
    /// A cookie, for the token in its path.
    Cookie {
        name: String,
        /// A link of another site leads here.
        is_from_elsewhere: bool,
    },
    /// A file of the page, by its name.
    File(String),
    /// A WebSocket, with the key of its handshake.
    Socket(String),
    /// Whether it would get a WebSocket.
    Probe,
}

/// Reads the head of a request; `None` while it is not whole.
pub fn parse(head: &[u8]) -> Result<Option<Request>, Refusal> {
    let mut headers = [httparse::EMPTY_HEADER; MOST_HEADERS];
    let mut parsed = httparse::Request::new(&mut headers);
    match parsed.parse(head) {
        Ok(httparse::Status::Partial) if head.len() < LARGEST_HEAD => return Ok(None),
        Ok(httparse::Status::Partial) | Err(_) => return Err(Refusal::Malformed),
        Ok(httparse::Status::Complete(_)) => {}
    }
    let all = |name: &str| -> Vec<String> {
        let named = parsed.headers.iter().filter(|h| h.name.eq_ignore_ascii_case(name));
        named.map(|h| String::from_utf8_lossy(h.value).trim().to_owned()).collect()
    };
    let one = |name: &str| match &all(name)[..] {
        [] => Ok(None),
        [value] => Ok(Some(value.clone())),
        _ => Err(Refusal::Malformed),
    };
    let lists = |name: &str, word: &str| {
        all(name).iter().flat_map(|list| list.split(',')).any(|item| item.trim().eq_ignore_ascii_case(word))
    };
    let cookies = all("cookie");
    let cookies = cookies.iter().flat_map(|list| list.split(';')).filter_map(|cookie| cookie.split_once('='));
    let upgrades = lists("upgrade", "websocket");
    let handshake = Handshake {
        key: one("sec-websocket-key")?,
        version: one("sec-websocket-version")?,
        is_for_here: lists("connection", "upgrade"),
    };
    Ok(Some(Request {
        method: parsed.method.unwrap_or_default().to_owned(),
        path: parsed.path.unwrap_or_default().to_owned(),
        host: one("host")?,
        origin: one("origin")?,
        cookies: cookies.map(|(name, value)| (name.trim().to_owned(), value.trim().to_owned())).collect(),
        is_from_elsewhere: lists("sec-fetch-site", "cross-site"),
        handshake: upgrades.then_some(handshake),
    }))
}

/// Lets a request in that was made to this machine by name with the token. Browsers state the origin of every WebSocket; it has to
/// be this server's own page, so that no other page that is open reaches the scene. Which port the browser sees does not matter:
/// a name that is made to lead here (DNS rebinding) stays another name.
pub fn admit(request: &Request, token: &str) -> Result<Entry, Refusal> {
    let host = request.host.as_deref().and_then(|host| Some((host, port_of_this_machine(host)?)));
    let Some((host, port)) = host else { return Err(Refusal::Host(request.host.clone())) };
    let own = format!("http://{host}");
    match (&request.origin, &request.handshake) {
        (Some(origin), _) if !origin.eq_ignore_ascii_case(&own) => return Err(Refusal::Origin),
        (None, Some(_)) => return Err(Refusal::Origin),
        _ => {}
    }
    if request.method != "GET" {
        return Err(Refusal::Method);
    }
    let path = request.path.split('?').next().unwrap_or_default();
    let name = path.strip_prefix('/').ok_or(Refusal::NotFound)?;
    let cookie = format!("refraxel-{port}");
    if is_same(name.strip_suffix('/').unwrap_or(name), token) {
        return Ok(Entry::Cookie { name: cookie, is_from_elsewhere: request.is_from_elsewhere });
    }
    if !request.cookies.iter().any(|(name, value)| *name == cookie && is_same(value, token)) {
        return Err(Refusal::NotFound);
    }
    match (name, &request.handshake) {
        ("socket", Some(handshake)) => handshake.check().map(Entry::Socket),
        ("socket", None) => Ok(Entry::Probe),
        (name, None) => Ok(Entry::File(name.to_owned())),
        (_, Some(_)) => Err(Refusal::NotFound),
    }
}

impl Handshake {
    /// The key, if everything that RFC 6455, 4.2.1, asks of a request is there.
    fn check(&self) -> Result<String, Refusal> {
        if !self.is_for_here {
            return Err(Refusal::Handshake("the header Connection: Upgrade"));
        }
        if self.version.as_deref() != Some(VERSION) {
            return Err(Refusal::Version);
        }
        let key = self.key.as_ref().filter(|key| BASE64.decode(key.as_bytes()).is_ok_and(|k| k.len() == 16));
        key.cloned().ok_or(Refusal::Handshake("the header Sec-WebSocket-Key with 16 bytes as base64"))
    }
}

/// The port of an address that stands for the machine itself by its name, wherever that leads.
fn port_of_this_machine(host: &str) -> Option<u16> {
    let (name, port) = match host.rsplit_once(':') {
        Some((name, port)) if !port.ends_with(']') => (name, port.parse().ok()?),
        _ => (host, USUAL_PORT),
    };
    let v6 = name.strip_prefix('[').and_then(|name| name.strip_suffix(']'));
    let is_here = name.eq_ignore_ascii_case("localhost")
        || name.parse().is_ok_and(|address: Ipv4Addr| address.is_loopback())
        || v6.and_then(|name| name.parse().ok()).is_some_and(|address: Ipv6Addr| address.is_loopback());
    is_here.then_some(port)
}

/// Compares without ending at the first letter that differs, whose time would tell it.
fn is_same(a: &str, b: &str) -> bool {
    let differs = a.bytes().zip(b.bytes()).fold(0, |all, (a, b)| all | (a ^ b));
    a.len() == b.len() && differs == 0
}

#[cfg(test)]
mod tests {
    use super::*;

    const HOST: &str = "Host: 127.0.0.1:4000";
    const COOKIE: &str = "Cookie: other=1; refraxel-4000=secret";
    const ORIGIN: &str = "Origin: http://127.0.0.1:4000";
    const SOCKET: [&str; 5] = [
        "GET /socket HTTP/1.1",
        "Upgrade: websocket",
        "Connection: keep-alive, Upgrade",
        "Sec-WebSocket-Version: 13",
        "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==",
    ];

    fn request(lines: &[&str]) -> Result<Entry, Refusal> {
        let head = format!("{}\r\n\r\n", lines.join("\r\n"));
        admit(&parse(head.as_bytes())?.expect("a whole head"), "secret")
    }

    fn socket(more: &[&str]) -> Result<Entry, Refusal> {
        request(&[&SOCKET[..], more].concat())
    }

    #[test]
    fn only_the_own_page_with_the_cookie_gets_a_socket() {
        let key = "dGhlIHNhbXBsZSBub25jZQ==".to_owned();
        assert_eq!(socket(&[HOST, COOKIE, ORIGIN]), Ok(Entry::Socket(key)));
        assert_eq!(socket(&[HOST, ORIGIN]), Err(Refusal::NotFound));
        assert_eq!(socket(&[HOST, ORIGIN, "Cookie: refraxel-4000=secres"]), Err(Refusal::NotFound));
        assert_eq!(socket(&[HOST, ORIGIN, "Cookie: refraxel-5000=secret"]), Err(Refusal::NotFound));
        assert_eq!(socket(&[HOST, COOKIE]), Err(Refusal::Origin));
        assert_eq!(socket(&[HOST, COOKIE, "Origin: http://127.0.0.1:5000"]), Err(Refusal::Origin));
        assert_eq!(socket(&[HOST, COOKIE, "Origin: http://localhost:4000"]), Err(Refusal::Origin));
        assert_eq!(socket(&[HOST, COOKIE, "Origin: https://127.0.0.1:4000"]), Err(Refusal::Origin));
        assert_eq!(socket(&[HOST, COOKIE, "Origin: null"]), Err(Refusal::Origin));
        assert_eq!(socket(&[COOKIE, ORIGIN]), Err(Refusal::Host(None)));
        assert_eq!(socket(&[HOST, HOST, COOKIE, ORIGIN]), Err(Refusal::Malformed));
    }

    #[test]
    fn names_of_this_machine_are_answered_to_with_any_port_and_others_with_none() {
        let get = |host: &str| request(&["GET /secret/ HTTP/1.1", &format!("Host: {host}")]);
        for (host, port) in [
            ("127.0.0.1:4000", 4000),
            ("127.0.0.1", 80),
            ("localhost:8080", 8080),
            ("LocalHost", 80),
            ("127.8.9.1:1", 1),
            ("[::1]:4000", 4000),
            ("[::1]", 80),
        ] {
            let name = format!("refraxel-{port}");
            assert_eq!(get(host), Ok(Entry::Cookie { name, is_from_elsewhere: false }), "{host}");
        }
        let evil = "evil.example:4000";
        for host in [
            evil,
            "evil.example",
            "127.0.0.1.evil.example:4000",
            "localhost.evil.example",
            "10.0.0.1:4000",
            "[fe80::1]:4000",
            "0.0.0.0:4000",
            "127.0.0.1:4000:4000",
            "127.0.0.1:99999",
            "",
        ] {
            assert_eq!(get(host), Err(Refusal::Host(Some(host.to_owned()))), "{host}");
        }
        let said = Refusal::Host(Some(evil.to_owned())).explanation(4000);
        assert!(said.contains(evil) && said.contains("ssh -L 8080:127.0.0.1:4000"), "{said}");
        // The port that a browser leaves out.
        let usual = ["Host: localhost", "Origin: http://localhost", "Cookie: refraxel-80=secret"];
        assert!(socket(&usual).is_ok());
    }

    #[test]
    fn a_cookie_needs_the_whole_token_and_files_need_the_cookie() {
        let get = |path: &str| request(&[&format!("GET {path} HTTP/1.1"), HOST]);
        for path in ["/secret/", "/secret", "/secret/?x"] {
            let name = "refraxel-4000".to_owned();
            assert_eq!(get(path), Ok(Entry::Cookie { name, is_from_elsewhere: false }), "{path}");
        }
        for path in
            ["/", "/secre/", "/secrett/", "/Secret/", "//", "/../secret", "/page.js", "/secret/page.js"]
        {
            assert_eq!(get(path), Err(Refusal::NotFound), "{path}");
        }
        let with = |path: &str| request(&[&format!("GET {path} HTTP/1.1"), HOST, COOKIE]);
        assert_eq!(with("/"), Ok(Entry::File(String::new())));
        assert_eq!(with("/page.js?x"), Ok(Entry::File("page.js".to_owned())));
        assert_eq!(with("/socket"), Ok(Entry::Probe));
        assert_eq!(request(&["POST / HTTP/1.1", HOST, COOKIE]), Err(Refusal::Method));
    }

    #[test]
    fn a_handshake_states_its_version_its_key_and_that_it_is_for_this_connection() {
        let without = |header: &str, instead: &str| {
            let lines = SOCKET.iter().filter(|line| !line.starts_with(header));
            let lines: Vec<&str> = lines.copied().chain([HOST, COOKIE, ORIGIN, instead]).collect();
            request(&lines)
        };
        let other = "X: y";
        for (header, instead) in [
            ("Sec-WebSocket-Key", other),
            ("Sec-WebSocket-Key", "Sec-WebSocket-Key: k"),
            ("Sec-WebSocket-Key", "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZXM="),
            ("Connection", other),
            ("Connection", "Connection: keep-alive"),
        ] {
            let refused = without(header, instead);
            assert!(matches!(refused, Err(Refusal::Handshake(_))), "{header}, {instead}: {refused:?}");
        }
        for instead in [other, "Sec-WebSocket-Version: 8"] {
            assert_eq!(without("Sec-WebSocket-Version", instead), Err(Refusal::Version), "{instead}");
        }
    }

    #[test]
    fn heads_without_end_are_refused() {
        assert_eq!(parse(b"GET / HT"), Ok(None));
        let endless = [b"GET /".to_vec(), vec![b'a'; LARGEST_HEAD]].concat();
        assert_eq!(parse(&endless), Err(Refusal::Malformed));
        assert_eq!(parse(b"\x16\x03\x01 tls\r\n\r\n"), Err(Refusal::Malformed));
    }
}
