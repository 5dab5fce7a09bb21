//! Who is let in: requests that know the token, name this address as their host, and come from this page.

use std::net::SocketAddr;

/// Largest head of a request [byte].
pub const LARGEST_HEAD: usize = 16 * 1024;
const MOST_HEADERS: usize = 64;

/// A request as far as it counts here.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Request {
    pub method: String,
    pub path: String,
    pub host: Option<String>,
    pub origin: Option<String>,
    /// The key of a WebSocket handshake, where one is asked for.
    pub key: Option<String>,
}

/// Why a request is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Refusal {
    /// It cannot be read.
    Malformed,
    /// It reads nothing but asks for something else.
    Method,
    /// It was meant for another host, whose name leads here.
    Host,
    /// It comes from another page.
    Origin,
    /// It does not know the token, or asks for what is not there.
    NotFound,
}

impl Refusal {
    /// Status line and explanation.
    pub fn status(self) -> (&'static str, &'static str) {
        match self {
            Self::Malformed => ("400 Bad Request", "This is no request that this server reads."),
            Self::Method => ("405 Method Not Allowed", "This server is only read."),
            Self::Host => ("403 Forbidden", "This server answers to its own address only."),
            Self::Origin => ("403 Forbidden", "This server answers to its own page only."),
            Self::NotFound => {
                ("404 Not Found", "There is nothing here. Open the whole address that `refraxel` printed.")
            }
        }
    }
}

/// What a request that is let in asks for.
#[derive(Clone, Debug, PartialEq)]
pub enum Entry {
    /// A file of the page, by its name.
    File(String),
    /// A WebSocket, with the key of its handshake.
    Socket(String),
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
    let upgrades = all("upgrade").iter().any(|v| v.eq_ignore_ascii_case("websocket"));
    Ok(Some(Request {
        method: parsed.method.unwrap_or_default().to_owned(),
        path: parsed.path.unwrap_or_default().to_owned(),
        host: one("host")?,
        origin: one("origin")?,
        key: one("sec-websocket-key")?.filter(|_| upgrades),
    }))
}

/// Lets a request in that was made to this address with its token. Browsers state the origin of every WebSocket; it has to be
/// this server's own page, so that no other page that is open reaches the scene.
pub fn admit(request: &Request, address: SocketAddr, token: &str) -> Result<Entry, Refusal> {
    let port = address.port();
    let hosts = [format!("127.0.0.1:{port}"), format!("localhost:{port}")];
    if !request.host.as_ref().is_some_and(|host| hosts.contains(host)) {
        return Err(Refusal::Host);
    }
    let own = |origin: &String| hosts.iter().any(|host| *origin == format!("http://{host}"));
    match (&request.origin, &request.key) {
        (Some(origin), _) if !own(origin) => return Err(Refusal::Origin),
        (None, Some(_)) => return Err(Refusal::Origin),
        _ => {}
    }
    if request.method != "GET" {
        return Err(Refusal::Method);
    }
    let path = request.path.split('?').next().unwrap_or_default();
    let name = path.strip_prefix('/').and_then(|p| p.split_once('/')).filter(|(t, _)| is_same(t, token));
    match (name, &request.key) {
        (Some((_, "socket")), Some(key)) => Ok(Entry::Socket(key.clone())),
        (Some((_, name)), None) => Ok(Entry::File(name.to_owned())),
        _ => Err(Refusal::NotFound),
    }
}

/// Compares without ending at the first letter that differs, whose time would tell it.
fn is_same(a: &str, b: &str) -> bool {
    let differs = a.bytes().zip(b.bytes()).fold(0, |all, (a, b)| all | (a ^ b));
    a.len() == b.len() && differs == 0
}

#[cfg(test)]
mod tests {
    use super::*;

    fn request(lines: &[&str]) -> Result<Entry, Refusal> {
        let head = format!("{}\r\n\r\n", lines.join("\r\n"));
        let request = parse(head.as_bytes())?.expect("a whole head");
        admit(&request, "127.0.0.1:4000".parse().unwrap(), "secret")
    }

    const SOCKET: [&str; 3] = ["GET /secret/socket HTTP/1.1", "Upgrade: websocket", "Sec-WebSocket-Key: k"];

    #[test]
    fn only_the_own_page_with_the_token_gets_a_socket() {
        let with = |more: &[&str]| request(&[&SOCKET[..], more].concat());
        let host = "Host: 127.0.0.1:4000";
        let own = "Origin: http://127.0.0.1:4000";
        assert_eq!(with(&[host, own]), Ok(Entry::Socket("k".to_owned())));
        assert!(with(&["Host: localhost:4000", "Origin: http://localhost:4000"]).is_ok());
        assert_eq!(with(&[host]), Err(Refusal::Origin));
        assert_eq!(with(&[host, "Origin: http://127.0.0.1:5000"]), Err(Refusal::Origin));
        assert_eq!(with(&[host, "Origin: null"]), Err(Refusal::Origin));
        assert_eq!(with(&["Host: evil.example:4000", own]), Err(Refusal::Host));
        assert_eq!(with(&[own]), Err(Refusal::Host));
        assert_eq!(with(&[host, host, own]), Err(Refusal::Malformed));
    }

    #[test]
    fn files_need_the_whole_token() {
        let get = |path: &str| request(&[&format!("GET {path} HTTP/1.1"), "Host: 127.0.0.1:4000"]);
        assert_eq!(get("/secret/"), Ok(Entry::File(String::new())));
        assert_eq!(get("/secret/page.js?x"), Ok(Entry::File("page.js".to_owned())));
        for path in ["/", "/secre/", "/secrett/", "/Secret/", "//", "/secret", "/../secret"] {
            assert_eq!(get(path), Err(Refusal::NotFound), "{path}");
        }
        let post = request(&["POST /secret/ HTTP/1.1", "Host: 127.0.0.1:4000"]);
        assert_eq!(post, Err(Refusal::Method));
    }

    #[test]
    fn heads_without_end_are_refused() {
        assert_eq!(parse(b"GET / HT"), Ok(None));
        let endless = [b"GET /".to_vec(), vec![b'a'; LARGEST_HEAD]].concat();
        assert_eq!(parse(&endless), Err(Refusal::Malformed));
        assert_eq!(parse(b"\x16\x03\x01 tls\r\n\r\n"), Err(Refusal::Malformed));
    }
}
