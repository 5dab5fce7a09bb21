//! The files of the page, as `viewer/` builds them.

/// A file of the page.
pub struct File {
    /// What browsers take it for.
    pub kind: &'static str,
    /// Its bytes.
    pub bytes: &'static [u8],
}

/// The file of this name; the page itself has an empty one.
pub fn file(name: &str) -> Option<File> {
    let (kind, bytes): (_, &[u8]) = match name {
        "" => ("text/html; charset=utf-8", include_bytes!("../../assets/viewer/index.html")),
        "page.js" => ("text/javascript; charset=utf-8", include_bytes!("../../assets/viewer/page.js")),
        "page.css" => ("text/css; charset=utf-8", include_bytes!("../../assets/viewer/page.css")),
        _ => return None,
    };
    Some(File { kind, bytes })
}
