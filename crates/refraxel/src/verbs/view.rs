//! `refraxel view`: a live page of a run, or the start page.

use super::interrupts::{wait_for_interrupt, watch_for_interrupts};
use super::reopen::reopen_source;
use super::threads::set_thread_count;
use crate::cli::ViewArgs;
use crate::console::Console;
use crate::exit::{Exit, Failure, OrExit};
use crate::progress::Show;
use crate::start;
use crate::verbs::train::evidence::EVIDENCE;
use crate::viewer::{Films, LAST_WORDS, Painter, Scene, Server};
use anyhow::Context;
use refraxel_train::run::Run;
use serde_json::json;
use std::path::Path;
use std::sync::Arc;
use std::thread;
use std::time::Instant;

/// The verb.
pub fn run(args: &ViewArgs) -> Result<(), Failure> {
    match &args.run {
        Some(folder) => view(folder, args),
        None => start::run(args),
    }
}

fn view(folder: &Path, args: &ViewArgs) -> Result<(), Failure> {
    set_thread_count(args.threads)?;
    watch_for_interrupts()?;
    let show = Show::suited(args.json);
    let (source, origin) = Run::source_of(folder)?;
    // Both read much; each waits for the disk, too.
    let (run, data) = rayon::join(|| Run::load_to_render(folder), || reopen_source(&source, origin));
    let run = run?;
    let films = Films::of(folder).context("cannot make a folder for films").or_exit(Exit::Io)?;
    let server = Server::bind(args.port.unwrap_or(0)).or_exit(Exit::Io)?;
    let server = server.with_files([folder.join(EVIDENCE)]).with_films(films.clone());
    let data = match data {
        Ok(data) => Some(data),
        Err(failure) => {
            show.say(&format!("note: without photographs: {}", failure.error));
            None
        }
    };
    let scene = Scene::new(name(folder), run, data.as_ref()).on(args.renderer.device, show)?;
    let photographs = Arc::clone(scene.photographs());
    let (painter, orders) = Painter::new(scene, 1.0);
    let url = server.url();
    server.start(orders.clone(), photographs, None);
    thread::spawn(|| painter.work());
    let text =
        format!("{} at {url}\nopen this address in a browser; Ctrl-C ends the viewer", folder.display());
    Console::new(args.json).result(&text, &json!({ "url": url })).or_exit(Exit::Io)?;
    wait_for_interrupt();
    let until = Instant::now() + LAST_WORDS;
    let why = format!(
        "The viewer was ended in its terminal. `refraxel view {}` starts it again and prints another address.",
        folder.display()
    );
    orders.end(why, || Instant::now() < until);
    films.end();
    Ok(())
}

/// What the page calls a run.
pub fn name(folder: &Path) -> String {
    let last =
        std::path::absolute(folder).ok().and_then(|p| Some(p.file_name()?.to_string_lossy().into_owned()));
    last.unwrap_or_else(|| folder.display().to_string())
}
