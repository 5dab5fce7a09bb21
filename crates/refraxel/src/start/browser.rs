//! Opens the page in the browser of the desktop.

use std::io::{self, Write};
use std::path::Path;
use std::process::{Command, Stdio};
use std::thread;
use tempfile::NamedTempFile;

/// Opens an address in the browser, where there is one. The file that leads there has to stay until it has.
///
/// The address holds the token, and everybody on this machine may read the words of a program. Therefore the browser gets the name of a
/// file that this user alone may read.
pub fn open(url: &str) -> io::Result<Option<NamedTempFile>> {
    let Some(program) = program() else { return Ok(None) };
    let mut file = tempfile::Builder::new().prefix("refraxel-start-").suffix(".html").tempfile()?;
    file.write_all(leading_to(url).as_bytes())?;
    file.flush()?;
    Ok(start(program, file.path()).then_some(file))
}

/// A page that leads to an address of letters, digits and `:/.`.
fn leading_to(url: &str) -> String {
    format!(
        "<!doctype html><meta charset=\"utf-8\"><title>refraxel</title><meta http-equiv=\"refresh\" content=\"0;url={url}\">\n\
         <a href=\"{url}\">refraxel</a>\n"
    )
}

/// What opens a file in the browser; `None` where nobody looks at a screen.
fn program() -> Option<&'static str> {
    if cfg!(target_os = "macos") {
        return Some("open");
    }
    if cfg!(windows) {
        return Some("explorer");
    }
    let has_screen = ["DISPLAY", "WAYLAND_DISPLAY"]
        .iter()
        .any(|name| std::env::var_os(name).is_some_and(|v| !v.is_empty()));
    has_screen.then_some("xdg-open")
}

fn start(program: &str, file: &Path) -> bool {
    let mut command = Command::new(program);
    command.arg(file).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    // It is no part of this program: Ctrl-C does not end it.
    #[cfg(unix)]
    std::os::unix::process::CommandExt::process_group(&mut command, 0);
    let Ok(mut child) = command.spawn() else { return false };
    thread::spawn(move || child.wait()); // it may stay as long as the browser
    true
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;
    use std::os::unix::fs::PermissionsExt;

    #[test]
    fn the_file_that_leads_to_the_page_is_read_by_nobody_else() {
        let file = tempfile::Builder::new().prefix("refraxel-start-").suffix(".html").tempfile().unwrap();
        assert_eq!(file.as_file().metadata().unwrap().permissions().mode() & 0o077, 0);
        assert!(leading_to("http://127.0.0.1:1/ab/").contains("url=http://127.0.0.1:1/ab/\""));
    }
}
