//! Pages without a browser, and the programs that serve them.

use crate::common::running::{PATIENCE, Running};
use serde_json::{Value, json};
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::process::{Command, Stdio};
use tungstenite::client::IntoClientRequest;
use tungstenite::{Message, WebSocket};

/// A page without a browser.
pub struct Page(pub WebSocket<TcpStream>);

/// A picture that a page receives.
pub struct Picture {
    pub header: Value,
    pub pixels: image::RgbImage,
}

pub fn host(url: &str) -> &str {
    url.strip_prefix("http://").unwrap().split('/').next().unwrap()
}

impl Page {
    /// A page of this address; its first message is the scene.
    pub fn open(url: &str) -> (Self, Value) {
        let mut page = Self::knock(url, Some(&format!("http://{}", host(url)))).unwrap();
        let scene = page.told("scene");
        (page, scene)
    }

    pub fn knock(url: &str, origin: Option<&str>) -> Result<Self, String> {
        Self::knock_with(url, &cookie(url), origin)
    }

    pub fn knock_with(url: &str, cookie: &str, origin: Option<&str>) -> Result<Self, String> {
        let mut request = format!("ws://{}/socket", host(url)).into_client_request().unwrap();
        request.headers_mut().insert("Cookie", cookie.parse().unwrap());
        if let Some(origin) = origin {
            request.headers_mut().insert("Origin", origin.parse().unwrap());
        }
        let stream = TcpStream::connect(host(url)).unwrap();
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        let (socket, _) = tungstenite::client::client(request, stream).map_err(|e| e.to_string())?;
        Ok(Self(socket))
    }

    pub fn ask(&mut self, question: Value) {
        self.0.send(Message::text(question.to_string())).unwrap();
    }

    /// The next message of this kind; others are left out.
    pub fn told(&mut self, kind: &str) -> Value {
        loop {
            if let Message::Text(text) = self.0.read().unwrap() {
                let told: Value = serde_json::from_str(&text).unwrap();
                if told["tell"] == kind {
                    return told;
                }
                assert_ne!(told["tell"], "refused", "{told}");
            }
        }
    }

    /// The text of the next message.
    pub fn told_or_refused(&mut self) -> String {
        loop {
            if let Message::Text(text) = self.0.read().unwrap() {
                return text.to_string();
            }
        }
    }

    /// The next picture of any kind, acknowledged.
    pub fn picture(&mut self) -> Picture {
        loop {
            match self.0.read().unwrap() {
                Message::Binary(bytes) => {
                    let length = u32::from_le_bytes(bytes[..4].try_into().unwrap()) as usize;
                    let header: Value = serde_json::from_slice(&bytes[4..4 + length]).unwrap();
                    let pixels = image::load_from_memory(&bytes[4 + length..]).unwrap().into_rgb8();
                    if header["picture"] == "frame" {
                        self.ask(json!({ "ask": "got", "frame": header["frame"] }));
                    }
                    return Picture { header, pixels };
                }
                Message::Text(text) => assert!(!text.contains("refused"), "{text}"),
                _ => {}
            }
        }
    }

    /// All that arrives until the program ends the connection: what is told, and the headers of pictures.
    pub fn rest(mut self) -> (Vec<Value>, Vec<Value>) {
        let (mut told, mut headers) = (Vec::new(), Vec::new());
        while let Ok(message) = self.0.read() {
            match message {
                Message::Text(text) => told.push(serde_json::from_str(&text).unwrap()),
                Message::Binary(bytes) => {
                    let length = u32::from_le_bytes(bytes[..4].try_into().unwrap()) as usize;
                    let header: Value = serde_json::from_slice(&bytes[4..4 + length]).unwrap();
                    // The program may have ended meanwhile.
                    let got = json!({ "ask": "got", "frame": header["frame"] });
                    let _ = self.0.send(Message::text(got.to_string()));
                    headers.push(header);
                }
                _ => {}
            }
        }
        (told, headers)
    }

    /// The best picture of a look.
    pub fn best(&mut self, look: Value) -> Picture {
        let id = look["id"].clone();
        self.ask(look);
        loop {
            let picture = self.picture();
            if picture.header["id"] == id && picture.header["last"] == true {
                return picture;
            }
        }
    }
}

/// The answer to a request with these lines.
pub fn request(url: &str, lines: &[&str]) -> String {
    let mut stream = TcpStream::connect(host(url)).unwrap();
    stream.set_read_timeout(Some(PATIENCE)).unwrap();
    stream.write_all(format!("{}\r\n\r\n", lines.join("\r\n")).as_bytes()).unwrap();
    let mut answer = Vec::new();
    stream.read_to_end(&mut answer).unwrap();
    String::from_utf8_lossy(&answer).into_owned()
}

pub fn token(url: &str) -> &str {
    url.split('/').nth(3).unwrap()
}

/// What a browser gets for the address, and sends from then on.
pub fn cookie(url: &str) -> String {
    let path = format!("GET /{}/ HTTP/1.1", token(url));
    let answer = request(url, &[&path, &format!("Host: {}", host(url))]);
    let set = answer.lines().find_map(|line| line.strip_prefix("Set-Cookie: "));
    set.unwrap_or_else(|| panic!("{answer}")).split(';').next().unwrap().to_owned()
}

/// The address in the first line that has one.
pub fn address(lines: &mut impl BufRead) -> String {
    let mut line = String::new();
    loop {
        line.clear();
        assert!(lines.read_line(&mut line).unwrap() > 0, "no address");
        if let Some((_, url)) = line.split_once("live view: ") {
            return url.trim().to_owned();
        }
    }
}

/// Starts `view --json`: the program, and the address that it prints.
pub fn viewed(command: &mut Command) -> (Running, String) {
    let mut program = Running(command.stdout(Stdio::piped()).spawn().unwrap());
    let mut out = BufReader::new(program.0.stdout.take().unwrap());
    let mut text = String::new();
    while !text.contains('}') {
        assert!(out.read_line(&mut text).unwrap() > 0, "{text}");
    }
    let told: Value = serde_json::from_str(&text).unwrap();
    (program, told["url"].as_str().unwrap().to_owned())
}
