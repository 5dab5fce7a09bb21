//! The files of pages, as `viewer/` builds them.

/// A file of the page.
pub struct File {
    /// What browsers take it for.
    pub kind: &'static str,
    /// Its bytes.
    pub bytes: &'static [u8],
}

/// Which page a server has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Page {
    /// A scene.
    Scene,
    /// What to do next.
    Start,
}

/// The file of this name; the page itself has an empty one.
pub fn file(page: Page, name: &str) -> Option<File> {
    let [html, script, style]: [&[u8]; 3] = match page {
        Page::Scene => [
            include_bytes!("../../assets/viewer/index.html"),
            include_bytes!("../../assets/viewer/page.js"),
            include_bytes!("../../assets/viewer/page.css"),
        ],
        Page::Start => [
            include_bytes!("../../assets/start/index.html"),
            include_bytes!("../../assets/start/page.js"),
            include_bytes!("../../assets/start/page.css"),
        ],
    };
    let (kind, bytes) = match name {
        "" => ("text/html; charset=utf-8", html),
        "page.js" => ("text/javascript; charset=utf-8", script),
        "page.css" => ("text/css; charset=utf-8", style),
        _ => return None,
    };
    Some(File { kind, bytes })
}

/// What browsers take a picture or a film for, by its name.
pub fn kind_of(name: &str) -> &'static str {
    match name.rsplit_once('.').map_or("", |(_, extension)| extension) {
        "png" => "image/png",
        "gif" => "image/gif",
        "mp4" => "video/mp4",
        "webm" => "video/webm",
        _ => "application/octet-stream",
    }
}
