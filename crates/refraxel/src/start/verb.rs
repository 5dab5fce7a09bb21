//! `refraxel view` without a run.

use super::{browser, desk::Desk};
use crate::cli::ViewArgs;
use crate::console::Console;
use crate::exit::{Exit, Failure, OrExit};
use crate::progress::Show;
use crate::verbs::interrupts::{wait_for_interrupt, watch_for_interrupts};
use crate::viewer::{Page, Server};
use anyhow::Context;
use serde_json::json;
use std::sync::Arc;

/// The start page, until Ctrl-C.
pub fn run(args: &ViewArgs) -> Result<(), Failure> {
    watch_for_interrupts()?;
    let folder = std::env::current_dir().context("there is no current folder").or_exit(Exit::Io)?;
    let threads = args.threads.map(|n| ["--threads".to_owned(), n.to_string()]);
    let renderer = vec!["--device".to_owned(), args.renderer.device.to_string()];
    let desk = Desk::new(folder.clone(), threads.into_iter().flatten().collect(), renderer);
    let desk = desk.context("cannot make a folder for pictures").or_exit(Exit::Io)?;
    let server = Server::bind(args.port.unwrap_or(0)).or_exit(Exit::Io)?;
    let url = server.url();
    server.with_files(desk.pictures()).serve(Page::Start, Arc::new(desk.clone()));
    let text = format!(
        "start page at {url}\nopen this address in a browser, if it does not open by itself; Ctrl-C ends the program, and saves what \
         is trained\nwhat is made goes into {}",
        folder.display()
    );
    Console::new(args.json).result(&text, &json!({ "url": url, "page": "start" })).or_exit(Exit::Io)?;
    // Not opened where a program reads the address; where no browser can be started, the text says what to do.
    let _leads_there = if args.json { None } else { browser::open(&url).ok().flatten() };
    wait_for_interrupt();
    Show::suited(args.json).say("the start page ends; running work is stopped, and a training is saved");
    desk.end("The program was ended in its terminal. `refraxel view` starts it again, and opens this page at another address.");
    Ok(())
}
